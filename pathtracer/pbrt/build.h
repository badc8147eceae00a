/*
 * From descriptions (a directive's kind, parameters, transform and graphics state) to the renderable, piece by piece while
 * the text is read: nothing large is kept twice.
 *
 * Everything is private to pathtracer/pbrt. A pt_builder fails through its diag; functions return its code or go on with
 * defaults until the directive ends. Not thread-safe.
 */
#ifndef PT_PBRT_BUILD_H
#define PT_PBRT_BUILD_H

#include "pbrt/diag.h"
#include "pbrt/load.h"
#include "pbrt/names.h"
#include "pbrt/params.h"
#include "pbrt/xform.h"

/* Growing array; items owned, each of `size` bytes. */
struct pt_list {
    void *items;
    size_t count, room, size;
};

/* What an AreaLightSource asks for, until shapes carry it. */
struct pt_area_light {
    int on, two_sided;
    pt_vec3 emission;
    double power; /* lumens over the whole shape; <= 0: emission stands as it is */
    struct pt_loc loc;
};

enum pt_attribute { PT_ATTR_SHAPE, PT_ATTR_LIGHT, PT_ATTR_MATERIAL, PT_ATTR_MEDIUM, PT_ATTR_TEXTURE, PT_ATTR_COUNT };

/* The graphics state of pbrt. */
struct pt_state {
    struct pt_xform ctm[2]; /* at the start and end time */
    unsigned active;        /* bit 0: start, bit 1: end */
    int32_t material;
    struct pt_area_light area;
    int reverse_orientation;
    int32_t medium_in, medium_out;
    int colour_space;                                  /* enum pt_colour_space */
    const struct pt_params *attributes[PT_ATTR_COUNT]; /* borrows, NULL = none */
};

/* Header directives, kept until WorldBegin, in the order in which they are built. */
enum pt_header {
    PT_HEADER_FILM,
    PT_HEADER_FILTER,
    PT_HEADER_SAMPLER,
    PT_HEADER_INTEGRATOR,
    PT_HEADER_CAMERA,
    PT_HEADER_COUNT
};

/* What is used by its name before it is made. First in the items of its list. */
struct pt_wanted {
    const char *name;  /* in the scene's arena; NULL: it is made */
    struct pt_loc loc; /* of the first use */
};

struct pt_material_info {
    struct pt_wanted wanted; /* of v4 only */
    struct pt_loc loc;
    int has_opacity; /* of v3's uber, of what is mixed with an interface: becomes the alpha of shapes */
    struct pt_input opacity;
    int used;
    struct pt_params params; /* owns; of v3: its kind and parameters, which shapes may change; else empty */
};
struct pt_medium_info {
    struct pt_wanted wanted;
    struct pt_loc defined;
    const char *name; /* in the scene's arena */
};

struct pt_object_info {
    struct pt_wanted wanted; /* of v4 only; line 0: nobody wanted it, and its origin is still free */
    double origin[3];        /* of its space in the space it was defined in */
};

/* What a name meant. */
struct pt_name_undo {
    struct pt_names *names;
    const char *name; /* in the scene's arena */
    int32_t value;
};

struct pt_builder {
    struct pt_scene *scene; /* being made; its arena is in use from the start */
    struct pt_scene_defaults *defaults;
    const struct pt_load_options *options;
    const struct pt_source *source;
    const struct pt_state *state; /* of the directive in hand; borrows */
    struct pt_diag diag;
    char directory[1024]; /* of the main file, "" or ending in '/' */
    int is_v3;            /* Film "image": v3 meanings of defaults and lights */

    struct pt_params header[PT_HEADER_COUNT]; /* kind "" = not given */
    struct pt_xform camera_ctm[2];
    int32_t camera_medium;
    double transform_times[2], shutter[2];
    double origin[3];        /* of render space, in the world */
    double camera_start;     /* depth in front of the camera where its rays begin, and the origin is */
    double window_middle[2]; /* of what the camera sees, in its space; where rays begin at a depth, the screen is about it */
    struct pt_xform world_to_camera[2];

    struct pt_list images, textures, materials, material_infos, meshes, quadrics, world_shapes, object_shapes, objects,
        instances, lights, media, medium_infos;
    struct pt_names float_textures, colour_textures, named_materials, media_names, object_names, image_names;
    int name_scopes;          /* of v3: blocks that are open and at whose end names mean again what they did before */
    struct pt_list name_undo; /* struct pt_name_undo: what names meant that were set in those */

    int32_t open_object;         /* between ObjectBegin and ObjectEnd, else -1 */
    struct pt_list object_infos; /* struct pt_object_info, by object */
    int32_t default_material;    /* grey diffuse, made on first use; -1 before */
};

void pt_builder_init(struct pt_builder *b, struct pt_scene *scene, struct pt_scene_defaults *defaults,
                     const struct pt_load_options *options, const struct pt_source *source, struct base_err *err);
void pt_builder_release(struct pt_builder *b);

/* pbrt.c: reads `path` and all that it includes; on success build.c can finish the scene. */
int pt_pbrt_read(struct pt_builder *b, const char *path);

/* Appends a copy of *item; index, or -1 (the diag has failed). */
#define pt_list_add(b, list, item) pt_list_add_bytes(b, list, item, sizeof *(item))
int32_t pt_list_add_bytes(struct pt_builder *b, struct pt_list *list, const void *item, size_t size);
/* Joins a scene-relative file name to the main file's folder. */
void pt_builder_path(struct pt_builder *b, const char *name, char *path, size_t room);
/* Names a material or texture. pbrt-v3 keeps these in the graphics state, pbrt-v4 has one meaning for all of the scene. */
int pt_builder_name(struct pt_builder *b, struct pt_names *names, const char *name, int32_t value);
/* Takes back what was named since name_undo had `count` entries. */
void pt_builder_forget_names(struct pt_builder *b, size_t count);
/* Turns on an effect; the first caller's place is the reason. */
void pt_builder_effect(struct pt_builder *b, pt_effects bits, struct pt_loc loc);
/* Transforms at shutter open and close; whether they differ. */
int pt_builder_at_shutter(const struct pt_builder *b, const struct pt_xform ctm[2], struct pt_xform out[2]);
/* At the end of the text: fails for a name that was used and whose thing was never made. */
int pt_builder_check(struct pt_builder *b);
/* World → render. */
struct pt_xform pt_builder_to_render(const struct pt_builder *b, struct pt_xform world);

/* build_image.c: film, filter, sampler, integrator, camera; at WorldBegin. */
int pt_build_header(struct pt_builder *b);

/* far_view.c: where the rays of a camera that looks from afar should begin, from the scene with its acceleration structure;
 * camera_start when it is well where it is. Warns of a view that floats do not hold. */
double pt_build_far_view(struct pt_builder *b);

/* build_colour.c */
enum pt_colour_use { PT_USE_REFLECTANCE, PT_USE_UNBOUNDED, PT_USE_LIGHT };
/* Colour parameter: 1 when given, 0 and *out untouched when not. LIGHT follows pbrt-v4 (spectra other than rgb have
 * luminance 1) or v3 (absolute). */
int pt_build_colour(struct pt_builder *b, struct pt_params *p, const char *name, enum pt_colour_use use, pt_vec3 *out);
/* eta and k of a conductor, each by rgb, name, list or file; what is not given is copper. */
void pt_build_conductor(struct pt_builder *b, struct pt_params *p, const char *eta_name, const char *k_name,
                        pt_vec3 *eta_rgb, pt_vec3 *k_rgb);
/* Index of refraction of a dielectric: float, spectrum, or a glass's name. */
double pt_build_index(struct pt_builder *b, struct pt_params *p, const char *name, double fallback);

/* build_texture.c */
int pt_build_texture(struct pt_builder *b, const char *name, const char *class_name, struct pt_params *p);
/* Float or colour parameter that may be textured; the fallback when absent. */
struct pt_input pt_build_float_input(struct pt_builder *b, struct pt_params *p, const char *name, double fallback);
struct pt_input pt_build_colour_input(struct pt_builder *b, struct pt_params *p, const char *name, enum pt_colour_use use,
                                      pt_vec3 fallback);
struct pt_input pt_input_grey(double value);
/* Image map by file name; encoding: NULL = by file kind, "sRGB", "linear", "gamma X". -1 on failure. Colours of an EXR are
 * made Rec. 709's, by its chromaticities; numbers stay as they are. Of light, what is infinite, NaN or negative is said. */
enum pt_image_use { PT_IMAGE_COLOUR, PT_IMAGE_DATA, PT_IMAGE_LIGHT };
int32_t pt_build_image_map(struct pt_builder *b, struct pt_loc loc, const char *name, const char *encoding,
                           enum pt_image_use use);
/* An image of numbers as texture (normal maps): its number, or 0 after a failure. */
int32_t pt_build_image_texture(struct pt_builder *b, struct pt_loc loc, const char *name, const char *encoding);
/* Product of two inputs; constants fold. */
struct pt_input pt_input_product(struct pt_builder *b, struct pt_input x, struct pt_input y);
/* (1 - amount) x + amount y. */
struct pt_input pt_input_mix(struct pt_builder *b, struct pt_input x, struct pt_input y, struct pt_input amount);
/* The luminance of colours, exact for images and what is mixed of them by a number. */
struct pt_input pt_input_luminance(struct pt_builder *b, struct pt_input in);

/* build_material.c: id, or -1. */
int32_t pt_build_material(struct pt_builder *b, const char *kind, struct pt_params *p);
int32_t pt_build_default_material(struct pt_builder *b);
/* v3: parameters of a shape that are of its material (`id`, -1: the default) go before the material's own. Marks them as
 * used; the id of the material with them, `id` when there are none, -1 after a failure. */
int32_t pt_build_shape_material(struct pt_builder *b, int32_t id, struct pt_params *shape);
/* The material of NamedMaterial, `before` where a v3 scene names none. v4 may make it further down. -1 after a failure. */
int32_t pt_build_named_material(struct pt_builder *b, struct pt_loc loc, const char *name, int32_t before);
/* MakeNamedMaterial. */
int pt_build_make_named_material(struct pt_builder *b, const char *name, const char *kind, struct pt_params *p);

/* build_light.c */
int pt_build_light(struct pt_builder *b, struct pt_params *p);
int pt_build_area_light(struct pt_builder *b, struct pt_params *p, struct pt_area_light *out);
/* Light of one shape with `area` scene units² of surface; id. */
int32_t pt_build_shape_light(struct pt_builder *b, const struct pt_area_light *source, double area);

/* build_medium.c */
int pt_build_medium(struct pt_builder *b, struct pt_params *p);
/* Id of a medium by name, defined or not yet; -1 for "". */
int32_t pt_build_medium_ref(struct pt_builder *b, const char *name, struct pt_loc loc);
/* At the end: warns of grids that stay where they are while their object does not. */
void pt_build_check_grids(struct pt_builder *b);

/* build_shape.c */
int pt_build_shape(struct pt_builder *b, struct pt_params *p);
int pt_build_object_begin(struct pt_builder *b, const char *name, struct pt_loc loc);
int pt_build_instance(struct pt_builder *b, const char *name, struct pt_loc loc);
/* At the end: leaves out the instances of objects that turned out to be empty. */
void pt_build_drop_instances(struct pt_builder *b);

/* Triangles before they are placed. Positions: pd or pf; indices: as one or the other; the rest may be NULL. */
struct pt_soup {
    size_t vertex_count, triangle_count;
    const double *pd;
    const float *pf;
    const double *nd, *uvd;
    const float *nf, *uvf;
    const double *indices_d;
    const uint32_t *indices;
};
/* refine.c: a soup whose triangles that are huge against their distance from the origin of render space are cut up. */
struct pt_cut {
    struct pt_soup soup; /* the given one, or of these: */
    double *p, *n, *uv;  /* owns */
    uint32_t *indices;   /* owns; [corners] */
    size_t corners;
    int is_lost; /* so huge that it is not known where it is seen */
};
/* to_render: of the soup's positions. 0: out of memory. To be released in any case. */
int pt_build_cut(const struct pt_soup *soup, const struct pt_xform *to_render, struct pt_cut *out);
void pt_cut_release(struct pt_cut *cut_up);
/* At the end: the same of the meshes of objects, about the places that their instances give the origin. */
int pt_build_cut_instances(struct pt_builder *b);
int pt_build_mesh(struct pt_builder *b, struct pt_params *p, const struct pt_soup *soup);
/* Fails unless v, of the parameter "indices", is one of so many vertices. */
int pt_build_check_index(const struct pt_params *p, double v, size_t vertex_count);
/* build_tessellate.c: shapes that become triangles. */
int pt_build_bilinear(struct pt_builder *b, struct pt_params *p);
int pt_build_curve(struct pt_builder *b, struct pt_params *p);
int pt_build_height_field(struct pt_builder *b, struct pt_params *p);
int pt_build_revolved(struct pt_builder *b, struct pt_params *p);
/* subdiv.c */
int pt_build_loop_subdiv(struct pt_builder *b, struct pt_params *p);

#endif
