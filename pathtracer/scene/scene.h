/*
 * The renderable: what a loaded scene is while it is being rendered. Plain data; read-only once built, so any thread may
 * read.
 *
 * Spaces. *Render space* is world space translated so that the camera (at shutter open), or what it sees from afar, is at
 * the origin; the translation is applied in double before anything becomes float, so that a scene far from the world's
 * origin keeps its precision.
 * Everything here is in render space and scene units, but for the shapes of an object (see pt_object), which are in the
 * space of their object. Colours are linear Rec.709 RGB. Ids are indices into the arrays of pt_scene, -1 = none; textures
 * have numbers, id + 1, 0 = none.
 *
 * Ownership. All arrays live in the scene's arena unless a field says otherwise.
 *
 * How a scene is made: zero the struct, fill camera … media, radiance_scale and effects, then call in this order
 * pt_camera_init (shade/camera.h), pt_accel_build (geom/accel.h), pt_contacts_find (integ/contact.h), pt_lights_build
 * (shade/light_build.h).
 * pt_accel_release, then pt_arena_release give everything back.
 */
#ifndef PT_SCENE_SCENE_H
#define PT_SCENE_SCENE_H

#include <stdint.h>

#include "scene/arena.h"
#include "scene/effects.h"
#include "scene/mat34.h"
#include "scene/materials.h"
#include "scene/vec.h"

enum pt_camera_kind { PT_CAMERA_PERSPECTIVE, PT_CAMERA_ORTHOGRAPHIC };

struct pt_camera {
    /* filled by the builder */
    int32_t kind;          /* enum pt_camera_kind */
    int32_t width, height; /* of the full image, pixels */
    float fov_deg;         /* perspective: full angle over the screen coordinate range [-1, 1] */
    float screen[4];       /* x0, x1, y0, y1 of the screen window; short side is [-1, 1] by default; y up */
    float lens_radius;     /* scene units; 0 = pinhole */
    float focal_distance;  /* scene units along +z of the camera */
    struct pt_mat34
        to_render[2]; /* camera (x right, y up, z forward; may be left-handed) → render, at shutter open, close */
    int32_t animated; /* to_render[1] counts */
    /* start > 0: rays begin at that depth, `before` from the lens; to_render is of the middle of the window there. `screen`
     * is about that middle, which is in the camera's own space, of a perspective one at depth 1. pbrt/far_view.c */
    float start, before, middle_x, middle_y, focus_beyond; /* the last: focal_distance - start */
    int32_t medium;                                        /* the camera lies in it, -1 = vacuum */
    /* derived by pt_camera_init */
    float x0, dx, y0, dy; /* z = 1 (perspective) or z = 0 (orthographic) plane: x = x0 + dx·raster_x, likewise y */
};

enum pt_wrap { PT_WRAP_REPEAT, PT_WRAP_BLACK, PT_WRAP_CLAMP, PT_WRAP_OCTAHEDRAL };
enum pt_pixel_type { PT_PIXEL_U8_SRGB, PT_PIXEL_U8_LINEAR, PT_PIXEL_FLOAT };

/* An image in memory, row 0 on top. Shared by textures that name the same file with the same encoding. */
struct pt_image_map {
    int32_t width, height; /* >= 1 */
    int32_t channels;      /* 1, 3 or 4 (rgb + alpha), interleaved */
    int32_t type;          /* enum pt_pixel_type */
    float gamma;           /* U8_LINEAR only: exponent that linearises; 1 = as is */
    const void *pixels;    /* width · height · channels values */
};

enum pt_texture_kind {
    PT_TEXTURE_CONSTANT,
    PT_TEXTURE_IMAGE,
    PT_TEXTURE_SCALE,        /* in[0] · in[1] */
    PT_TEXTURE_MIX,          /* (1 - in[2]) in[0] + in[2] in[1] */
    PT_TEXTURE_CHECKERBOARD, /* in[0] where floor(s) + floor(t) is even, in[1] elsewhere */
    PT_TEXTURE_BILERP        /* corners in[0] (0,0), in[1] (0,1), in[2] (1,0), in[3] (1,1) */
};

struct pt_texture {
    int32_t kind;          /* enum pt_texture_kind */
    int32_t image;         /* id, IMAGE only */
    int32_t wrap;          /* enum pt_wrap, IMAGE only */
    int32_t is_nearest;    /* IMAGE only: the nearest texel instead of the bilinear blend of four */
    int32_t invert;        /* IMAGE only: 1 - value, after scale; never below 0 */
    int32_t is_signed;     /* IMAGE only, of floats that are not inverted (heights): else what is below 0 is 0 */
    int32_t channel;       /* IMAGE: PT_CHANNEL_… (shade/texture.h) */
    float scale;           /* IMAGE only */
    float su, sv, du, dv;  /* s = su·u + du, t = sv·v + dv */
    struct pt_input in[4]; /* numbers below this texture's own: the array is in dependency order */
};

/* All that a hit reads of a corner lies in one cache line. */
struct pt_vertex {
    pt_vec3 p, n; /* n: shading normal, any length, already negated for a shape with reverse orientation; 0: none */
    float u, v;
};
_Static_assert(sizeof(struct pt_vertex) == 32, "a vertex is half a cache line");

struct pt_mesh {
    uint32_t vertex_count, triangle_count;
    const struct pt_vertex *vertices; /* [vertex_count], each within one cache line */
    const uint32_t *indices;          /* [triangle_count][3], each < vertex_count */
    int32_t has_normals;              /* where there are some, they decide the side of the geometric normal */
    int32_t has_uvs;                  /* else (0,0), (1,0), (1,1) at the three corners of a triangle */
};

enum pt_quadric_kind { PT_QUADRIC_SPHERE, PT_QUADRIC_DISK, PT_QUADRIC_CYLINDER };

struct pt_quadric {
    int32_t kind;               /* enum pt_quadric_kind */
    float radius, inner_radius; /* inner: disk only */
    float z_min, z_max;         /* sphere: within ± radius, all of it = whole; cylinder; disk: both its height */
    float phi_max;              /* radians, 2π = whole */
    struct pt_mat34 to_render, from_render; /* quadric's own space ↔ render (or the object's) space */
};

/* What a surface is where others are at the same place (integ/contact.h). */
enum pt_layer {
    PT_LAYER_OPAQUE,
    PT_LAYER_SHEET, /* lets rays through, and what is on either side of it is on the outside */
    PT_LAYER_SOLID  /* lets rays through; the side against its normal is within glass or fog, where nothing else is */
};
enum pt_shape_kind { PT_SHAPE_MESH, PT_SHAPE_QUADRIC };

struct pt_shape {
    int32_t kind;                  /* enum pt_shape_kind */
    int32_t data;                  /* id in meshes or quadrics */
    int32_t material;              /* id, never -1 */
    int32_t light;                 /* id of the area light it carries, -1 = none; always -1 in objects */
    int32_t medium_in, medium_out; /* on the side against / along the geometric normal; equal = the ray keeps its medium */
    int32_t flip_normal;   /* the geometric normal, which lamps, glass and media follow, is against that of the stored shape:
                            of triangles by the right-hand rule (reverse orientation XOR a transform that swaps
                            handedness), of quadrics away from centre or axis, +z of a disk (reverse orientation) */
    int32_t has_alpha;     /* `alpha` is not constant 1 */
    int32_t has_opacity;   /* the material lets rays through, and into the medium behind; `alpha` has its share */
    struct pt_input alpha; /* float: probability that a hit counts */
    /* derived by pt_contacts_find */
    int32_t layer;                   /* enum pt_layer: which of two is met first where surfaces touch */
    int32_t touches;                 /* there may be another surface at the same place … */
    pt_vec3 touch_least, touch_most; /* … within this box of render space */
};

/* A group of shapes that instances place; its shapes are consecutive and in the object's own space. */
struct pt_object {
    int32_t first_shape, shape_count;
};
/* A shape that moves by itself is an object of one shape with one animated instance. */
struct pt_instance {
    int32_t object;
    int32_t animated;             /* to_render[1] counts: interpolated as translation, rotation (slerp), scale over the
                                     shutter */
    struct pt_mat34 to_render[2]; /* object, moved by `origin` → render, at first and at last */
    pt_vec3 origin;               /* 0 unless animated; the motion turns about the point that to_render takes 0 to */
};

enum pt_light_kind {
    PT_LIGHT_AREA, /* every shape that names it */
    PT_LIGHT_ENV_CONSTANT,
    PT_LIGHT_ENV_IMAGE,
    PT_LIGHT_DISTANT,
    PT_LIGHT_POINT,
    PT_LIGHT_SPOT
};
enum pt_env_map { PT_ENV_LATLONG, PT_ENV_EQUAL_AREA };

struct pt_light {
    /* filled by the builder */
    int32_t kind;      /* enum pt_light_kind */
    int32_t two_sided; /* AREA */
    int32_t shape;     /* AREA: the shape; one light per shape */
    int32_t image;     /* ENV_IMAGE: id of a FLOAT image map of 3 channels */
    int32_t mapping;   /* ENV_IMAGE: enum pt_env_map. LATLONG: z up, u = φ/2π from +x, v = θ/π from +z (row 0) */
    pt_vec3 emission;  /* AREA, ENV: radiance (ENV_IMAGE: factor on the image); POINT, SPOT: intensity W/sr;
                          DISTANT: irradiance on a surface facing it. All scales applied */
    pt_vec3 position;  /* POINT, SPOT */
    pt_vec3 direction; /* SPOT: axis; DISTANT: the way the light travels; unit */
    double cos_total, cos_start;        /* SPOT: full darkness beyond, full light within … */
    int32_t is_quartic;                 /* … and between them t⁴ of pbrt-v3 instead of v4's smoothstep */
    struct pt_mat34 from_render;        /* ENV_IMAGE: render → light space, of determinant 1 or -1 … */
    int32_t is_stretched;               /* … not a rotation, perhaps mirrored: to_render counts */
    struct pt_mat34 to_render;          /* … its inverse */
    int32_t has_portal;                 /* ENV: … through which its light mostly comes */
    pt_vec3 portal, portal_u, portal_v; /* a corner of it and its edges, render space */
    /* derived by pt_lights_build */
    int32_t first_emitter; /* AREA: emitter of primitive 0 */
    float emitter_pmf;     /* other kinds: probability that next-event estimation selects this light */
};

/* What next-event estimation selects: a whole light, or one triangle of an area light. Derived by pt_lights_build. */
struct pt_emitter {
    int32_t light;
    int32_t primitive;   /* AREA on a mesh: triangle */
    int32_t alias;       /* Walker/Vose alias table over the emitters … */
    float alias_q;       /* … keep this one when the fractional part is below q */
    float pmf;           /* by power; > 0 for all that can emit */
    float area_over_pmf; /* AREA on a mesh: of the triangle, units² */
    pt_vec3 p0, e1, e2;  /* AREA on a mesh: corner and edges to the other two */
    pt_vec3 n;           /* AREA on a mesh: unit normal of the emitting side … */
    pt_vec3 side; /* … where side.x + b1 side.y + b2 side.z >= 0 at the point p0 + b1 e1 + b2 e2, else of the other */
};

/*
 * A hierarchy over the emitters that are somewhere (not at infinity), four children to a node, each with bounds of where its
 * light comes from and where it goes (Conty Estevez & Kulla 2018). Derived by pt_lights_build; what each number does is in
 * shade/light_tree.c.
 */
enum { PT_LIGHT_FAN = 4 };

struct pt_light_node {
    float centre_x[PT_LIGHT_FAN], centre_y[PT_LIGHT_FAN], centre_z[PT_LIGHT_FAN]; /* of a sphere around all emitters */
    float radius[PT_LIGHT_FAN];                                                   /* of it, > 0 */
    float axis_x[PT_LIGHT_FAN], axis_y[PT_LIGHT_FAN], axis_z[PT_LIGHT_FAN];       /* unit, of a cone around all normals */
    float cos_normals[PT_LIGHT_FAN], sin_normals[PT_LIGHT_FAN];                   /* its half angle */
    float cos_emission[PT_LIGHT_FAN]; /* nothing is emitted further than this off a normal */
    float intensity[PT_LIGHT_FAN];    /* luminance times projected area, share of all children; 0: no child */
    int32_t two_sided[PT_LIGHT_FAN];  /* -1 or 0: a mask */
    int32_t child[PT_LIGHT_FAN];      /* a node, or ~emitter */
    int32_t parent;                   /* its place, PT_LIGHT_FAN · node + slot; -1 = this is the root */
};

struct pt_light_tree {
    struct pt_light_node *nodes; /* [0] is the root */
    int32_t node_count;
    int32_t *places; /* [emitter_count] PT_LIGHT_FAN · node + slot, -1 = in no node */
    float share;     /* probability that the hierarchy is asked rather than a light at infinity */
    int32_t *far;    /* emitters at infinity, each as likely as the others */
    int32_t far_count;
};

/* 2D piecewise-constant distribution over an environment image as cumulative sums from 0 to 1; derived. */
struct pt_env_distribution {
    int32_t width, height;           /* in cells */
    int32_t cell_width, cell_height; /* pixels of a cell; those of the last column and row may have fewer */
    double per_importance; /* 0: all pixels of a cell are as likely. Else pixels are chosen by importance, and this is
                                        their density over the unit square for each unit of luminance · weight of the row */
    const float *rows;     /* [height + 1] */
    const float *columns;  /* [height][width + 1] */
    /* where to start looking in a cumulative sum of n cells for u: at guide[floor(u · n)] (Chen & Asau 1974) */
    const uint16_t *row_guide;    /* [height] */
    const uint16_t *column_guide; /* [height][width] */
};

enum pt_medium_kind { PT_MEDIUM_HOMOGENEOUS, PT_MEDIUM_GRID };

struct pt_medium {
    int32_t kind;             /* enum pt_medium_kind */
    float g;                  /* Henyey–Greenstein asymmetry */
    pt_vec3 sigma_a, sigma_s; /* 1 / scene unit, scale applied; GRID: at density 1 */
    pt_vec3 emission;         /* radiance emitted per unit absorption (σa·Le), GRID: at density 1 */
    /* GRID: density at the centres of cells of the box [0,1]³ of the grid's space, trilinear, 0 outside */
    int32_t nx, ny, nz;
    const float *density;        /* [nz][ny][nx], >= 0 */
    struct pt_mat34 from_render; /* render → grid's unit box */
    int32_t mx, my, mz;          /* majorant cells; made by shade/medium */
    const float *majorant;       /* [mz][my][mx] largest density in each */
};

/* Why an effect is in the scene's set, for --explain. */
struct pt_effect_reason {
    int line; /* first scene line that asks for it, 0 if forced or none */
    char file[256];
};

struct pt_scene_stats {
    long long triangles; /* of all meshes */
    long long bytes;     /* memory of the scene, acceleration structure included */
    double parse_s, build_s, accel_s, texture_s;
};

struct pt_accel;

struct pt_scene {
    struct pt_camera camera;
    struct pt_image_map *images;
    struct pt_texture *textures;
    struct pt_material *materials;
    struct pt_mesh *meshes;
    struct pt_quadric *quadrics;
    struct pt_shape *shapes; /* [0, world_shape_count): in render space; then the objects' */
    struct pt_object *objects;
    struct pt_instance *instances;
    struct pt_light *lights;
    struct pt_medium *media;
    int32_t image_count, texture_count, material_count, mesh_count, quadric_count;
    int32_t shape_count, world_shape_count, object_count, instance_count, light_count, medium_count;
    int32_t light_selection; /* enum pt_light_selection: what is wanted where there are enough lights */
    float radiance_scale;    /* the film's exposure: factor from radiance to pixel value */
    pt_effects effects;      /* needed or forced */
    float still[2];          /* shares of the shutter, before and after things move; the rest is their time from 0 to 1 */

    /* derived by pt_accel_build */
    struct pt_accel *accel;         /* owns; released by pt_accel_release */
    pt_vec3 bounds_min, bounds_max; /* of all shapes; 0 when there are none */

    /* derived by pt_lights_build */
    struct pt_emitter *emitters;
    int32_t emitter_count;
    struct pt_light_tree *light_tree; /* NULL: emitters are selected by power */
    int32_t *env_lights;              /* ids of ENV_* lights */
    int32_t env_light_count;
    struct pt_env_distribution *env_distributions; /* [light_count] or NULL; used for ENV_IMAGE */

    struct pt_arena arena;
    struct pt_effect_reason effect_reasons[PT_FX_COUNT];
    struct pt_scene_stats stats;
};

#endif
