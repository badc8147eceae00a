/* What scene text becomes: shapes, lights, materials, media, camera, film, effects; v3 and v4 spellings of the same. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/pi.h"
#include "geom/accel.h"
#include "integ/surface.h"
#include "pt_text_scene.h"
#include "shade/texture.h"

#define TRIANGLE "\"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 1  1 0 1  0 1 1 ]"

static void near(float a, double b, double tolerance)
{
    if (!(fabs((double)a - b) <= tolerance))
        fail_msg("%.9g is not within %g of %.9g", (double)a, tolerance, b);
}

static void film_and_camera(void **state)
{
    (void)state;
    struct pt_scene_defaults d;
    struct pt_scene *s =
        text_scene("Film \"rgb\" \"integer xresolution\" 60 \"integer yresolution\" 40 \"float iso\" 150 "
                   "\"float exposuretime\" 2 \"float cropwindow\" [ 0.5 1 0.25 0.75 ] \"float maxcomponentvalue\" 9\n"
                   "PixelFilter \"triangle\" \"float xradius\" 1 \"float yradius\" 1.5\n"
                   "Sampler \"independent\" \"integer pixelsamples\" 7 Integrator \"volpath\" \"integer maxdepth\" 65\n"
                   "LookAt 1 2 3  1 2 13  0 1 0 Camera \"perspective\" \"float fov\" 50 \"float lensradius\" 0.1 "
                   "\"float focaldistance\" 4\nWorldBegin\n",
                   &d, NULL);
    assert_true(d.width == 60 && d.height == 40 && d.spp == 7 && d.integrator.max_depth == 65);
    assert_true(d.crop[0] == 30 && d.crop[1] == 10 && d.crop[2] == 60 && d.crop[3] == 30);
    assert_true(d.integrator.filter == PT_FILTER_TRIANGLE && d.integrator.filter_y == 1.5f &&
                d.integrator.max_component == 9);
    assert_int_equal(d.integrator.sampler, PT_SAMPLER_INDEPENDENT);
    near(s->radiance_scale, 3, 1e-6);
    near(s->camera.fov_deg, 50, 0);
    near(s->camera.screen[1], 1.5, 1e-6); /* the field of view is that of the short side */
    near(s->camera.screen[3], 1, 1e-6);
    near(s->camera.to_render[0].m[3], 0, 0); /* the camera is the origin */
    near(s->camera.to_render[0].m[10], 1, 1e-6);
    assert_true(s->effects == PT_FX_DEFOCUS);
    assert_int_equal(s->effect_reasons[15].line, 4);
    pt_scene_destroy(s);
    s = text_scene("Film \"image\" \"float scale\" 4 PixelFilter \"triangle\" \"float xwidth\" 1 WorldBegin", &d, NULL);
    near(s->radiance_scale, 4, 0);
    assert_true(d.width == 640 && d.integrator.filter_x == 1);
    pt_scene_destroy(s);
}

/* The same scene far from the origin keeps its vertices to the last bits. */
static void far_from_the_origin(void **state)
{
    (void)state;
    /* the object is defined where it stands */
    static const char format[] =
        "LookAt %d 0 -5  %d 0 0  0 1 0 Camera \"perspective\" WorldBegin\n"
        "Translate %d 0 0 Shape \"trianglemesh\" " TRIANGLE " ObjectBegin \"o\" Shape \"trianglemesh\" " TRIANGLE
        " ObjectEnd Identity ObjectInstance \"o\"";
    char text[1024];
    struct pt_scene *s[2];
    for (int i = 0; i < 2; i++) {
        int shift = i * 100000;
        snprintf(text, sizeof text, format, shift, shift, shift);
        s[i] = text_scene(text, NULL, NULL);
    }
    for (int i = 0; i < 3; i++)
        near(v3_len(v3_sub(s[1]->meshes[0].vertices[i].p, s[0]->meshes[0].vertices[i].p)), 0, 1e-6);
    near(s[0]->meshes[0].vertices[0].p.z, 6, 1e-6);
    for (int i = 0; i < 3; i++) {
        pt_vec3 q[2];
        for (int k = 0; k < 2; k++)
            q[k] = pt_mat34_point(&s[k]->instances[0].to_render[0], s[k]->meshes[1].vertices[i].p);
        near(q[1].x, (double)q[0].x, 1e-6);
        near(q[1].z, (double)q[0].z, 1e-6);
    }
    pt_scene_destroy(s[0]);
    pt_scene_destroy(s[1]);
}

/* What is far away for its size, in an object or in the space that it moves in, keeps its shape and its way. */
static void small_and_far_away(void **state)
{
    (void)state;
    static const char format[] = "LookAt %d 0 -.005  %d 0 0  0 1 0 Camera \"perspective\" WorldBegin\n"
                                 "ObjectBegin \"o\" Shape \"trianglemesh\" \"point3 P\" [ %d 0 0  %d.001 0 0  %d 0.001 0 ]\n"
                                 "ObjectEnd ObjectInstance \"o\" ActiveTransform EndTime %s ActiveTransform All\n"
                                 "Shape \"trianglemesh\" \"point3 P\" [ %d 0 0  %d.001 0 0  %d 0.001 0 ]";
    static const char *const ways[] = {"Translate .003 0 .002", "Rotate 30 1 0 0"};
    for (int way = 0; way < 2; way++) {
        struct pt_scene *s[2];
        for (int i = 0; i < 2; i++) {
            const int at = i * 5000;
            char text[1024];
            snprintf(text, sizeof text, format, at, at, at, at, at, ways[way], at, at, at);
            s[i] = text_scene(text, NULL, NULL);
        }
        for (int instance = 0; instance < 2; instance++)
            for (int corner = 0; corner < 3; corner++) {
                pt_vec3 q[2], edge[2];
                for (int i = 0; i < 2; i++) {
                    const struct pt_vertex *v = s[i]->meshes[instance].vertices;
                    struct pt_mat34 t;
                    pt_accel_instance_transform(s[i], instance, instance ? 0.7f : 0.0f, &t);
                    q[i] = pt_mat34_point(&t, v[corner].p);
                    edge[i] = pt_mat34_vector(&t, v3_sub(v[(corner + 1) % 3].p, v[corner].p));
                }
                near(v3_len(v3_sub(edge[1], edge[0])), 0, 1e-7);
                near(v3_len(v3_sub(q[1], q[0])), 0,
                     instance && way ? 1e-3 : 1e-7); /* two roundings of 5000, where it turns */
            }
        pt_scene_destroy(s[0]);
        pt_scene_destroy(s[1]);
    }
}

/* From atoms to the solar system: a triangle, a ball and a triangle of an object have the normals that they have at size 1. */
static void normals_at_any_scale(void **state)
{
    (void)state;
    for (int k = -12; k <= 12; k++) {
        const double s = pow(10.0, k);
        char text[1000];
        snprintf(
            text, sizeof text,
            "AttributeBegin Scale %g %g %g Shape \"trianglemesh\" \"point3 P\" [ -1 -1 1 1 -1 2 -1 1 3 ] Translate 0 0 9\n"
            "Shape \"sphere\" AttributeEnd ObjectBegin \"o\" Shape \"trianglemesh\" \"point3 P\" [ -1 -1 1 1 -1 2 -1 1 3 ]\n"
            "ObjectEnd Scale %g %g %g Translate 0 0 30 ObjectInstance \"o\"",
            s, s, s, s, s, s);
        struct pt_scene *scene = world_scene(text);
        for (int i = 0; i < 3; i++) {
            static const float from[3] = {0.0f, 7.0f, 25.0f};
            const pt_vec3 want = i == 1 ? v3(-0.3f, -0.3f, -sqrtf(0.82f)) : v3_norm(v3(-1, -2, 2));
            struct pt_ray ray = {v3_scale(v3(-0.3f, -0.3f, from[i]), (float)s), {0, 0, 1}, 0, INFINITY, 0};
            struct pt_hit hit;
            struct pt_place at;
            assert_true(pt_accel_intersect(scene, &ray, &hit));
            pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, &at);
            if (!(v3_len(v3_sub(at.s.n_geometric, want)) < 1e-4f))
                fail_msg("shape %d at scale %g: normal (%g, %g, %g)", i, s, (double)at.s.n_geometric.x,
                         (double)at.s.n_geometric.y, (double)at.s.n_geometric.z);
        }
        pt_scene_destroy(scene);
    }
}

static void orientation(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "Shape \"trianglemesh\" " TRIANGLE "\n AttributeBegin ReverseOrientation Shape \"trianglemesh\" " TRIANGLE
        " \"normal N\" [ 0 0 1 0 0 1 0 0 1 ] AttributeEnd\nScale -1 1 1 Shape \"trianglemesh\" " TRIANGLE
        " ReverseOrientation Shape \"sphere\"");
    assert_int_equal(s->shape_count, 4);
    /* the mirrored triangle's corners go round the other way; only ReverseOrientation turns a sphere inside out */
    assert_true(!s->shapes[0].flip_normal && s->shapes[1].flip_normal && s->shapes[2].flip_normal &&
                s->shapes[3].flip_normal);
    near(s->meshes[1].vertices[0].n.z, -1, 0); /* reversed orientation negates the given normals */
    pt_scene_destroy(s);
}

/* A ball of radius 1e6 as a floor, two units below: rays leave it as close to it as they would leave a small one. */
static void a_ball_as_a_floor(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene("Translate 0 -1000002 0 Shape \"sphere\" \"float radius\" 1e6");
    for (int i = 0; i < 9; i++) {
        struct pt_ray ray = {
            {0, 0, 0}, v3_norm(v3((float)(i % 3) * 0.7f - 0.5f, -1, (float)(i / 3) * 0.7f - 0.3f)), 0, INFINITY, 0};
        struct pt_hit hit;
        struct pt_place at;
        assert_true(pt_accel_intersect(s, &ray, &hit));
        pt_place_at_hit(PT_FX_ALL, s, &ray, &hit, &at);
        near(at.p.y, -2, 1e-5);
        pt_vec3 p = pt_offset_point(at.p, at.s.n_geometric, at.error, v3(0, 1, 0));
        near(p.y, -2, 2e-5);
        for (int k = 0; k < 9; k++) { /* and do not meet it again */
            ray = (struct pt_ray){p, v3_norm(v3((float)(k % 3) - 1.0f, 0.01f, (float)(k / 3) - 1.0f)), 0, INFINITY, 0};
            assert_false(pt_accel_intersect(s, &ray, &hit));
        }
    }
    pt_scene_destroy(s);
}

static void lights(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 1 2 3 ] \"float scale\" 2 \"bool twosided\" true\n"
        "Shape \"trianglemesh\" " TRIANGLE " AttributeEnd\n"
        "LightSource \"point\" \"rgb I\" [ 1 1 1 ] \"float power\" 12.566370614 \"point3 from\" [ 1 2 3 ]\n"
        "LightSource \"distant\" \"point from\" [ 0 0 0 ] \"point to\" [ 0 0 -2 ] \"rgb L\" [ 5 5 5 ]\n"
        "LightSource \"spot\" \"float coneangle\" 60 \"float conedeltaangle\" 60 \"blackbody I\" 6500 \"float scale\" 10\n"
        "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ] \"float illuminance\" 6.2831853\n"
        "LightSource \"point\" \"rgb I\" [ 0 0 0 ]\n"
        "AttributeBegin AreaLightSource \"diffuse\" \"float power\" 10 Translate 5 0 0 Shape \"sphere\" AttributeEnd");
    assert_int_equal(s->light_count, 6); /* the black one is gone */
    assert_true(s->lights[0].kind == PT_LIGHT_AREA && s->lights[0].shape == 0 && s->lights[0].two_sided &&
                s->shapes[0].light == 0);
    near(s->lights[0].emission.z, 6, 1e-6);
    near(s->lights[1].emission.x, 1, 1e-6); /* Φ / 4π */
    near(s->lights[1].position.y, 2, 1e-6);
    near(s->lights[2].direction.z, -1, 0);
    near((float)s->lights[3].cos_total, 0.5, 1e-6);
    near((float)s->lights[3].cos_start, 1, 1e-6);
    near(v3_luminance(s->lights[3].emission), 10, 0.01); /* v4: a black body of any heat has luminance 1 before its scale */
    near(s->lights[4].emission.x, 2, 1e-5);
    near(s->lights[5].emission.x, 10 / (4 * 3.14159265 * 3.14159265), 1e-5); /* Φ / (π area) */
    assert_true(s->effects == (PT_FX_DELTA_LIGHT | PT_FX_ENVIRONMENT | PT_FX_MANY_LIGHTS | PT_FX_QUADRIC));
    pt_scene_destroy(s);
    /* that of any spectrum, also of colours beyond Rec.709: a blue and a green laser */
    s = world_scene("LightSource \"point\" \"spectrum I\" [ 454 0 455 1 456 0 ] LightSource \"point\" \"spectrum I\" [ 531 "
                    "0 532 1 533 0 ] "
                    "LightSource \"point\" \"blackbody I\" 1000");
    for (int i = 0; i < 3; i++)
        near(v3_luminance(s->lights[i].emission), 1, 1e-5);
    pt_scene_destroy(s);
    for (int v3 = 0; v3 < 2; v3++) { /* each has its own fall-off */
        s = text_scene(v3 ? "Film \"image\" WorldBegin LightSource \"spot\"" : "WorldBegin LightSource \"spot\"", NULL,
                       NULL);
        assert_int_equal(s->lights[0].is_quartic, v3);
        pt_scene_destroy(s);
    }
    /* v3: [T scale], absolute */
    s = text_scene("Film \"image\" WorldBegin LightSource \"infinite\" \"blackbody L\" [ 5000 3 ] \"rgb scale\" [ 2 2 2 ]",
                   NULL, NULL);
    assert_true(v3_luminance(s->lights[0].emission) > 5 && v3_luminance(s->lights[0].emission) < 6);
    pt_scene_destroy(s);
}

/* Rays go through an interface: a lamp of it gives no light rather than some of it, and says so. */
static void interface_lamps_are_dark(void **state)
{
    (void)state;
    int warnings = 0;
    struct pt_scene *s = text_scene("WorldBegin Material \"interface\" AreaLightSource \"diffuse\" Shape \"sphere\"\n"
                                    "Material \"diffuse\" Shape \"sphere\"",
                                    NULL, &warnings);
    assert_true(s->light_count == 1 && s->shapes[0].light == -1 && s->shapes[1].light == 0 && warnings == 1);
    pt_scene_destroy(s);
}

/* A lamp of area A and power P has the radiance P/(π A), whatever transform made that area. */
static void power_of_stretched_lamps(void **state)
{
    (void)state;
    const double pi = 3.14159265358979323846, e2 = sqrt(0.75), e10 = sqrt(0.99);
    /* c = 0.1: ∫ sqrt(c² + (1 - c²) z²) dz from -0.2 to 0.5, of the zone of a spheroid */
    const double f1 = sqrt(0.01 + 0.99 * 0.25), f0 = sqrt(0.01 + 0.99 * 0.04);
    const double zone = 0.5 * (0.5 * f1 + 0.2 * f0) + 0.01 / (2 * e10) * (asinh(0.5 * e10 / 0.1) + asinh(0.2 * e10 / 0.1));
    const double ellipse =
        9.688448220547676; /* the perimeter of one with the half axes 2 and 1 (Abramowitz & Stegun, 17.3.30) */
    const struct {
        const char *shape;
        double area;
    } cases[] = {
        {"Scale 3 3 3 Shape \"disk\"", 9 * pi},
        {"Scale 2 1 1 Shape \"disk\"", 2 * pi},
        {"Scale 1 1 5 Shape \"disk\"", pi},
        {"Scale 1 1 -.01 Shape \"disk\"", pi},
        {"Scale 2 3 .1 Shape \"disk\" \"float phimax\" 90 \"float innerradius\" .5", 6 * pi / 4 * 0.75},
        {"Scale -2 2 2 Shape \"sphere\"", 16 * pi},
        {"Scale 2 1 1 Shape \"sphere\"", 2 * pi * (1 + 2 / e2 * asin(e2))},
        {"Rotate 30 1 2 3 Scale 2 1 1 Rotate 50 3 2 1 Shape \"sphere\"", 2 * pi * (1 + 2 / e2 * asin(e2))},
        {"Scale 1 1 .1 Shape \"sphere\"", 2 * pi * (1 + 0.01 / e10 * atanh(e10))},
        {"Scale 1 1 .1 Shape \"sphere\" \"float phimax\" 90 \"float zmin\" 0", 2 * pi * (1 + 0.01 / e10 * atanh(e10)) / 8},
        {"Scale 1 1 .1 Shape \"sphere\" \"float phimax\" 90 \"float zmin\" -.2 \"float zmax\" .5", pi / 2 * zone},
        {"Scale 3 3 .3 Shape \"sphere\" \"float radius\" 2 \"float zmin\" -.4 \"float zmax\" 1", 36 * 2 * pi * zone},
        {"Scale 1 1 .00001 Shape \"sphere\"", 2 * pi},
        {"Scale 1 1 100000 Shape \"sphere\"", 1e5 * pi * pi},
        {"Scale 1 1 3 Shape \"cylinder\"", 12 * pi},
        {"Scale 1 1 -3 Shape \"cylinder\" \"float phimax\" 60 \"float zmin\" -.25", pi * 1.25},
        {"Scale 2 1 1 Shape \"cylinder\"", 2 * ellipse},
        {"Scale 2 1 5 Shape \"cylinder\" \"float phimax\" 90 \"float radius\" 3", 9 * 10 * ellipse / 12},
        {"Scale 1 .00001 1 Shape \"cylinder\"", 8},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[400];
        snprintf(text, sizeof text, "AreaLightSource \"diffuse\" \"float power\" 100 %s", cases[i].shape);
        struct pt_scene *s = world_scene(text);
        double got = (double)s->lights[0].emission.x, want = 100 / (pi * cases[i].area);
        if (!(fabs(got / want - 1) < 1e-4)) /* what light_area.h promises */
            fail_msg("%s: %.6g, not %.6g", cases[i].shape, got, want);
        pt_scene_destroy(s);
    }
}

static void materials_of_both_versions(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"color Kd\" [ .1 .2 .3 ]\n"
        "MakeNamedMaterial \"b\" \"string type\" \"plastic\" \"float roughness\" 0.1 \"bool remaproughness\" \"false\"\n"
        "MakeNamedMaterial \"c\" \"string type\" [ \"glass\" ] \"float index\" [ 1.3 ]\n"
        "MakeNamedMaterial \"d\" \"string type\" \"mirror\"\n"
        "MakeNamedMaterial \"e\" \"string type\" \"metal\" \"float roughness\" 0.1\n"
        "MakeNamedMaterial \"f\" \"string type\" \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"d\" "
        "\"rgb amount\" [ .2 .2 .2 ]\n"
        "MakeNamedMaterial \"g\" \"string type\" \"mix\" \"string materials\" [ \"a\" \"d\" ] \"float amount\" 0.2\n"
        "Material \"coateddiffuse\" \"float roughness\" 0.25 Shape \"sphere\"\n"
        "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"string k\" [ \"metal-Au-k\" ] Shape \"sphere\"\n"
        "Material \"\" Shape \"sphere\" NamedMaterial \"e\" Shape \"sphere\"");
    const struct pt_material *m = s->materials;
    assert_true(m[0].kind == PT_BSDF_DIFFUSE && m[0].reflectance.value.z == 0.3f);
    assert_true(m[1].kind == PT_BSDF_COATED_DIFFUSE && m[1].roughness_u.value.x == 0.1f && !m[1].remap_roughness);
    assert_true(m[2].kind == PT_BSDF_DIELECTRIC && m[2].eta == 1.3f);
    assert_true(m[3].kind == PT_BSDF_CONDUCTOR && m[3].conductor_by_colour);
    /* v3 remaps roughness by a polynomial: 0.1 is alpha 0.4618 */
    assert_true(m[4].kind == PT_BSDF_CONDUCTOR && !m[4].remap_roughness);
    near(m[4].roughness_u.value.x, 0.4618, 1e-3);
    /* v3 mixes by the share of the first, v4 by that of the second */
    assert_true(m[5].mix_b == 0 && m[5].mix_a == 3);
    near(m[5].mix_amount.value.x, 0.2, 1e-6);
    assert_true(m[6].mix_a == 0 && m[6].mix_b == 3);
    assert_true(m[7].remap_roughness && m[7].kind == PT_BSDF_COATED_DIFFUSE);
    assert_true(m[8].eta_rgb.value.z > 1.2f && m[9].kind == PT_MATERIAL_INTERFACE);
    /* only materials in use ask for effects: no mix, no transmission, no mirror */
    pt_effects fx = s->effects;
    assert_true((fx & PT_FX_COATED) && (fx & PT_FX_GLOSSY) && (fx & PT_FX_INTERFACE) && (fx & PT_FX_SPECULAR));
    assert_false(fx & (PT_FX_MIX | PT_FX_TRANSMISSION | PT_FX_MEDIA));
    pt_scene_destroy(s);
}

/* Rays go through what is mixed with an interface, or with a material that is partly there, as often as the mix says: by alpha. */
static void mixed_with_nothing(void **state)
{
    (void)state;
    static const struct {
        const char *a, *b, *amount, *alpha;
        double opacity, share_of_b; /* share_of_b: -1 = a alone, 2 = b alone */
    } cases[] = {{"none", "solid", "\"float amount\" .25", "", 0.25, 2},
                 {"solid", "none", "\"float amount\" .25", "", 0.75, -1},
                 {"solid", "half", "\"float amount\" .5", "", 0.75, 1.0 / 3},
                 {"half", "none", "\"float amount\" .5", "\"float alpha\" .5", 0.125, -1},
                 {"solid", "solid", "\"float amount\" .5", "\"float alpha\" .5", 0.5, 0.5}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[600];
        snprintf(text, sizeof text,
                 "MakeNamedMaterial \"none\" \"string type\" \"interface\" MakeNamedMaterial \"solid\" \"string type\" "
                 "\"diffuse\" MakeNamedMaterial \"half\" \"string type\" \"uber\" \"rgb opacity\" [ .5 .5 .5 ]\n"
                 "Material \"mix\" \"string materials\" [ \"%s\" \"%s\" ] %s Shape \"sphere\" %s",
                 cases[i].a, cases[i].b, cases[i].amount, cases[i].alpha);
        struct pt_scene *s = world_scene(text);
        const struct pt_material *m = &s->materials[3];
        near(s->shapes[0].alpha.value.x, cases[i].opacity, 1e-6);
        assert_true(m->kind == PT_MATERIAL_MIX && (s->effects & PT_FX_ALPHA) && !(s->effects & PT_FX_INTERFACE));
        if (cases[i].share_of_b < 0 || cases[i].share_of_b > 1)
            assert_true(m->mix_a == m->mix_b && s->materials[m->mix_a].kind != PT_MATERIAL_INTERFACE);
        else
            near(m->mix_amount.value.x, cases[i].share_of_b, 1e-6);
        pt_scene_destroy(s);
    }
    struct pt_scene *s = world_scene("MakeNamedMaterial \"none\" \"string type\" \"interface\"\n"
                                     "Material \"mix\" \"string materials\" [ \"none\" \"none\" ] Shape \"sphere\"");
    assert_int_equal(s->materials[1].kind, PT_MATERIAL_INTERFACE);
    pt_scene_destroy(s);
    /* what a texture mixes */
    s = world_scene(
        "MakeNamedMaterial \"none\" \"string type\" \"interface\" MakeNamedMaterial \"solid\" \"string type\" "
        "\"diffuse\" Texture \"mask\" \"float\" \"checkerboard\"\n"
        "Material \"mix\" \"string materials\" [ \"solid\" \"none\" ] \"texture amount\" \"mask\" Shape \"sphere\"");
    assert_true(s->shapes[0].alpha.texture && s->textures[s->shapes[0].alpha.texture - 1].kind == PT_TEXTURE_MIX);
    near(pt_texture_eval(s, s->shapes[0].alpha.texture, 0.5f, 0.5f).x, 0, 0);
    near(pt_texture_eval(s, s->shapes[0].alpha.texture, 1.5f, 0.5f).x, 1, 0);
    pt_scene_destroy(s);
    /* of colours, the luminance */
    s = world_scene("Texture \"half\" \"spectrum\" \"constant\" \"rgb value\" [ .5 .5 .5 ]\n"
                    "Texture \"mask\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [ 1 0 0 ] \"texture tex2\" \"half\"\n"
                    "Texture \"less\" \"spectrum\" \"scale\" \"texture tex1\" \"mask\" \"rgb tex2\" [ .5 .5 .5 ]\n"
                    "Material \"uber\" \"texture opacity\" \"less\" Shape \"sphere\"");
    near(pt_texture_eval(s, s->shapes[0].alpha.texture, 0.5f, 0.5f).x, 0.5 * 0.2126, 1e-4);
    near(pt_texture_eval(s, s->shapes[0].alpha.texture, 1.5f, 0.5f).x, 0.25, 1e-4);
    pt_scene_destroy(s);
}

static void textures(void **state)
{
    (void)state;
    struct pt_scene *s =
        world_scene("Texture \"one\" \"spectrum\" \"constant\" \"rgb value\" [ .2 .4 .6 ]\n"
                    "Texture \"half\" \"spectrum\" \"scale\" \"texture tex\" \"one\" \"float scale\" 0.5\n"
                    "Texture \"check\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"half\" \"rgb tex2\" [ 1 1 1 ] "
                    "\"float uscale\" 8\n"
                    "Texture \"mask\" \"float\" \"checkerboard\"\n"
                    "Material \"diffuse\" \"texture reflectance\" \"half\" Shape \"sphere\"\n"
                    "Material \"diffuse\" \"texture reflectance\" \"check\" Shape \"sphere\" \"texture alpha\" \"mask\"");
    /* constants fold: nothing is looked up for them */
    assert_int_equal(s->materials[0].reflectance.texture, 0);
    near(s->materials[0].reflectance.value.z, 0.3, 1e-6);
    const struct pt_texture *t = &s->textures[s->materials[1].reflectance.texture - 1];
    assert_true(t->kind == PT_TEXTURE_CHECKERBOARD && t->su == 8 && !t->in[0].texture && t->in[0].value.x == 0.1f);
    assert_true(s->shapes[1].has_alpha && !s->shapes[0].has_alpha);
    assert_int_equal(s->effects, PT_FX_TEXTURE | PT_FX_ALPHA | PT_FX_QUADRIC | PT_FX_CONTACT);
    pt_scene_destroy(s);
}

static void media(void **state)
{
    (void)state;
    int warnings = 0;
    struct pt_scene *s = text_scene(
        "MediumInterface \"\" \"fog\" Camera \"perspective\" WorldBegin\n"
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 1 2 3 ] "
        "\"rgb sigma_s\" [ 0 0 0 ] \"float scale\" 0.5 \"float Lescale\" 3\n" /* which scales nothing without Le */
        "MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [ 1 3 ] "
        "\"point3 p0\" [ 1 -1 -1 ] \"point3 p1\" [ -1 1 1 ]\n" /* corners in any order: they turn nothing round */
        "MediumInterface \"smoke\" \"fog\" Material \"interface\" Shape \"sphere\"",
        NULL, &warnings);
    assert_int_equal(warnings, 0);
    assert_int_equal(s->camera.medium, 0); /* named before it was made */
    near(s->media[0].sigma_a.z, 1.5, 1e-6);
    assert_true(s->shapes[0].medium_in == 1 && s->shapes[0].medium_out == 0);
    assert_true(s->media[1].kind == PT_MEDIUM_GRID && s->media[1].density[1] == 3);
    pt_vec3 corner = pt_mat34_point(&s->media[1].from_render, v3(1, -1, 0));
    near(corner.x, 1, 1e-6);
    near(corner.y, 0, 1e-6);
    near(corner.z, 0.5, 1e-6);
    pt_effects fx = s->effects;
    assert_true((fx & PT_FX_ABSORPTION) && (fx & PT_FX_SCATTERING) && (fx & PT_FX_GRID_MEDIUM) && (fx & PT_FX_INTERFACE));
    pt_scene_destroy(s);
}

/* Figures of both tables that pbrt has, with their case and blanks; what is in neither is milk, and said. */
static void presets_of_media(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int warnings;
        double absorbed_red, scattered_blue;
    } cases[] = {{"Skin1", 0, 0.032, 1.01},
                 {"Espresso", 0, 4.7984, 1.0247},
                 {"Head & Shoulders Shampoo", 0, 0.084621, 0.034306},
                 {"Pacific Ocean Surface Water", 0, 0.031845, 0.00019617},
                 {"espresso", 1, 0.0011, 3.77}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[200];
        int warnings = 0;
        snprintf(text, sizeof text,
                 "WorldBegin MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"string preset\" \"%s\"", cases[i].name);
        struct pt_scene *s = text_scene(text, NULL, &warnings);
        assert_int_equal(warnings, cases[i].warnings);
        near(s->media[0].sigma_a.x, cases[i].absorbed_red, 1e-6);
        near(s->media[0].sigma_s.z, cases[i].scattered_blue, 1e-6);
        pt_scene_destroy(s);
    }
}

/* A grid that is denser than steps of a ray can be is as dense as they allow, and says so. */
static void grids_of_any_density(void **state)
{
    (void)state;
    static const struct {
        const char *more;
        int warnings;
        double sigma; /* of a box of 3 x 4 x 12, whose diagonal is 13, and a density of 2 at most */
    } cases[] = {{"\"float scale\" 1000", 0, 2000}, {"\"float scale\" 1e9", 1, 1e5 / (2 * 13)}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[600];
        int warnings = 0;
        snprintf(text, sizeof text,
                 "Camera \"perspective\" WorldBegin Rotate 30 1 2 3 MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" "
                 "\"integer nx\" 2 \"float density\" [ 2 0 ] \"point3 p1\" [ 3 4 12 ] \"rgb Le\" [ 1 1 1 ] %s "
                 "MediumInterface \"m\" \"\" Shape \"sphere\"",
                 cases[i].more);
        struct pt_scene *s = text_scene(text, NULL, &warnings);
        const struct pt_medium *m = &s->media[0];
        assert_int_equal(warnings, cases[i].warnings);
        near(m->sigma_a.x + m->sigma_s.x, cases[i].sigma, 1e-4 * cases[i].sigma);
        assert_true(m->emission.x == m->sigma_a.x); /* as hot as it was */
        pt_scene_destroy(s);
    }
}

/* A grid medium has one place, where it was made: that it does not follow an object is said once, and refused by --strict. */
static void grids_that_stay(void **state)
{
    (void)state;
    static const struct {
        const char *world;
        int line; /* of the warning, 0: none */
    } cases[] = {{"ObjectBegin \"o\" MediumInterface \"smoke\" \"\" Shape \"sphere\" ObjectEnd\n"
                  "ObjectInstance \"o\" Translate 5 0 0 ObjectInstance \"o\" Translate 5 0 0 ObjectInstance \"o\"",
                  2},
                 {"ObjectBegin \"o\" MediumInterface \"smoke\" \"\" Shape \"sphere\" ObjectEnd ObjectInstance \"o\"", 0},
                 {"Translate 3 1 2e5 ObjectBegin \"o\" MediumInterface \"smoke\" \"\" Shape \"sphere\" ObjectEnd\n"
                  "Identity Rotate 30 1 2 3 Rotate -30 1 2 3 ObjectInstance \"o\"",
                  0},
                 {"ObjectBegin \"o\" MediumInterface \"fog\" \"\" Shape \"sphere\" ObjectEnd\n"
                  "Translate 5 0 0 ObjectInstance \"o\" MediumInterface \"smoke\" \"\" Shape \"sphere\"",
                  0},
                 {"MediumInterface \"\" \"smoke\" ActiveTransform EndTime Translate 0 1 0 Shape \"sphere\"", 2},
                 {"ActiveTransform EndTime Translate 0 1 0 MakeNamedMedium \"more\" \"string type\" \"uniformgrid\" \"float "
                  "density\" 1",
                  3},
                 {"MediumInterface \"\" \"fog\" ActiveTransform EndTime Translate 0 1 0 Shape \"sphere\"", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[800];
        int warnings = 0;
        struct base_err err;
        snprintf(text, sizeof text,
                 "Camera \"perspective\" WorldBegin MakeNamedMedium \"fog\"\n"
                 "MakeNamedMedium \"smoke\" \"string type\" \"uniformgrid\" \"float density\" 1\n%s",
                 cases[i].world);
        pt_scene_destroy(text_scene(text, NULL, &warnings));
        assert_int_equal(warnings, cases[i].line > 0);
        assert_int_equal(text_scene_error(text, 1, &err), warnings ? BASE_EINVAL : 0);
        if (warnings)
            assert_int_equal(err.text[strlen("t.pbrt:")], '0' + cases[i].line);
    }
}

#define LE "\"rgb Le\" [ 1 1 1 ] "
/* "Lescale" for each density: as one emission, which is right where all are the same, of the same whole where they differ. */
static void glow_of_grids(void **state)
{
    (void)state;
    static const struct {
        const char *more;
        int warnings;
        double emission;
    } cases[] = {{LE "\"float Lescale\" 3", 0, 3},
                 {LE "\"float Lescale\" [ 3 3 ]", 0, 3},
                 {LE "\"float Lescale\" [ 2 6 ]", 1, 5},
                 {"\"float Lescale\" [ 2 6 ]", 0, 0},
                 {LE "\"float temperature\" [ 2000 3000 ] \"float temperaturescale\" 1", 1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[600];
        int warnings = 0;
        struct base_err err;
        snprintf(text, sizeof text,
                 "Camera \"perspective\" WorldBegin MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"integer nx\" 2 "
                 "\"float density\" [ 1 3 ] \"rgb sigma_a\" [ 1 1 1 ] %s MediumInterface \"m\" \"\" "
                 "Shape \"sphere\"",
                 cases[i].more);
        struct pt_scene *s = text_scene(text, NULL, &warnings);
        assert_int_equal(warnings, cases[i].warnings);
        near(s->media[0].emission.y, cases[i].emission, 1e-5);
        pt_scene_destroy(s);
        assert_int_equal(text_scene_error(text, 1, &err), warnings ? BASE_EINVAL : 0);
    }
}

/* pbrt takes the smaller of zmin and zmax as the lower limit. */
static void spheres_of_any_limits(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene("Shape \"sphere\" \"float zmin\" 0.5 \"float zmax\" -0.25\n"
                                     "Shape \"sphere\" \"float zmin\" 7 \"float zmax\" -0.25\n"
                                     "Shape \"paraboloid\" \"float radius\" 2 \"float zmin\" 4 \"float zmax\" 1");
    for (uint32_t i = 0; i < s->meshes[0].vertex_count; i++) {
        pt_vec3 v = s->meshes[0].vertices[i].p;
        near(hypotf(v.x, v.y), 2 * sqrt((double)v.z / 4), 1e-5); /* of the radius at the greater z */
    }
    assert_true(s->quadrics[0].z_min == -0.25f && s->quadrics[0].z_max == 0.5f);
    assert_true(s->quadrics[1].z_min == -0.25f && s->quadrics[1].z_max == 1.0f);
    pt_scene_destroy(s);
}

static void instances_and_motion(void **state)
{
    (void)state;
    struct pt_scene *s =
        world_scene("ObjectBegin \"o\" Translate 1 0 0 Shape \"sphere\" Shape \"trianglemesh\" " TRIANGLE " ObjectEnd\n"
                    "Shape \"disk\"\nTranslate 0 5 0 ObjectInstance \"o\"\n"
                    "ActiveTransform EndTime Translate 0 2 0 ActiveTransform All ObjectInstance \"o\" Shape \"sphere\"");
    assert_true(s->world_shape_count == 1 && s->shape_count == 4 && s->object_count == 2 && s->instance_count == 3);
    assert_true(s->objects[0].first_shape == 1 && s->objects[0].shape_count == 2);
    near(s->quadrics[0].to_render.m[3], 1, 0);
    assert_true(!s->instances[0].animated && s->instances[1].animated && s->instances[2].animated &&
                s->instances[2].object == 1);
    near(s->instances[0].to_render[0].m[7], 5, 0);
    near(s->instances[1].to_render[1].m[7], 7, 0);
    assert_true((s->effects & (PT_FX_MOTION | PT_FX_INSTANCES)) == (PT_FX_MOTION | PT_FX_INSTANCES));
    pt_scene_destroy(s);
}

/* The shutter need not be open from the first to the last transform. */
static void part_of_the_motion(void **state)
{
    (void)state;
    struct pt_scene *s =
        text_scene("TransformTimes 0 4 Camera \"perspective\" \"float shutteropen\" 1 \"float shutterclose\" 2 WorldBegin\n"
                   "ActiveTransform EndTime Translate 0 0 8 Rotate 80 0 1 0 ActiveTransform All Shape \"sphere\"",
                   NULL, NULL);
    const struct pt_instance *i = &s->instances[0];
    near(i->to_render[0].m[11], 2, 1e-5);
    near(i->to_render[1].m[11], 4, 1e-5);
    near(i->to_render[0].m[0], cos(20 * 3.14159265358979 / 180), 1e-5);
    near(i->to_render[1].m[2], sin(40 * 3.14159265358979 / 180), 1e-5);
    pt_scene_destroy(s);
}

/* What two transforms write in different ways, but is the same, does not move. */
static void the_same_twice_stands_still(void **state)
{
    (void)state;
    struct pt_scene *s =
        world_scene("Translate 0 0 5 ActiveTransform StartTime Scale 1 1 1 ActiveTransform EndTime\n"
                    "ConcatTransform [ 1 0 -0 0 -0 1 0 0 0 -0 1 0 -0 0 0 1 ] ActiveTransform All\n"
                    "AreaLightSource \"diffuse\" Shape \"sphere\" Transform [ -1 0 0 0 0 1 0 0 0 0 1 0 0 0 5 1 ]\n"
                    "ActiveTransform EndTime Transform [ -1 -0 0 0 -0 1 -0 0 0 -0 1 0 0 0 5 1 ] Shape \"disk\"");
    assert_true(s->instance_count == 0 && s->light_count == 2);
    pt_scene_destroy(s);
}

/* A transform without an inverse hides things, as exporters and animations use it, or makes a mesh flat, which pbrt shows. */
static void flattened(void **state)
{
    (void)state;
    int warnings = 0;
    struct pt_scene *s = text_scene(
        "WorldBegin ObjectBegin \"o\" Shape \"sphere\" ObjectEnd AreaLightSource \"diffuse\"\n"
        "AttributeBegin Scale 1 1 0 Shape \"trianglemesh\" " TRIANGLE " \"normal N\" [ 0 0 1 0 1 1 1 0 1 ] AttributeEnd\n"
        "AttributeBegin Scale 0 0 0 Shape \"trianglemesh\" " TRIANGLE " Shape \"sphere\" \"float phimax\" 90\n"
        "ObjectInstance \"o\" AttributeEnd Shape \"cylinder\"",
        NULL, &warnings);
    assert_int_equal(warnings, 2);
    assert_true(s->world_shape_count == 3 && s->instance_count == 0);
    struct pt_ray ray = {{0.2f, 0.2f, -1}, {0, 0, 1}, 0.0f, INFINITY, 0.0f};
    struct pt_hit hit;
    assert_true(pt_accel_intersect(s, &ray, &hit) && hit.shape == 0);
    near(hit.t, 1, 1e-6);
    pt_scene_destroy(s);
    /* too small, or too large, for Embree to invert: it ends the program */
    s = world_scene("Scale 1e-20 1e-20 1e-20 ObjectBegin \"o\" Shape \"sphere\" ObjectEnd ObjectInstance \"o\"\n"
                    "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Shape \"sphere\"");
    assert_int_equal(s->instance_count, 0);
    pt_scene_destroy(s);
    struct base_err err;
    assert_int_equal(
        text_scene_error("WorldBegin Scale 1e20 1e20 1e20 ActiveTransform EndTime Translate 1 0 0 Shape \"sphere\"", 0,
                         &err),
        BASE_EINVAL);
    assert_int_equal(text_scene_error("Scale 1 0 1 Camera \"perspective\" WorldBegin", 0, &err), BASE_EINVAL);
}

/* What grows from nothing: a ball of half its size half way. */
static void grows_from_nothing(void **state)
{
    (void)state;
    struct pt_scene *s =
        world_scene("Translate 0 0 5 Rotate 30 1 2 3 ActiveTransform StartTime Scale 0 0 0 ActiveTransform All "
                    "Shape \"sphere\"");
    for (int i = 0; i <= 4; i++) {
        struct pt_ray ray = {{0, 0, 0}, {0, 0, 1}, 0.0f, INFINITY, (float)i / 4.0f};
        struct pt_hit hit;
        assert_true(pt_accel_intersect(s, &ray, &hit));
        near(hit.t, 5 - i / 4.0, 1e-4);
    }
    pt_scene_destroy(s);
}

static void graphics_state(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "AttributeBegin Translate 1 0 0 Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" AttributeEnd\n"
        "Shape \"sphere\" TransformBegin Scale 2 2 2 CoordinateSystem \"twice\" TransformEnd\n"
        "CoordSysTransform \"twice\" Shape \"sphere\" \"float radius\" 5\nCoordSysTransform \"camera\" Shape \"sphere\"");
    near(s->quadrics[0].radius, 3, 0);
    near(s->quadrics[0].to_render.m[3], 1, 0);
    near(s->quadrics[1].radius, 1, 0);
    near(s->quadrics[1].to_render.m[3], 0, 0);
    near(s->quadrics[2].to_render.m[0], 2, 0);
    near(s->quadrics[3].to_render.m[0], 1, 0);
    pt_scene_destroy(s);
    /* a named system is one of both times: nothing moves */
    s = world_scene("TransformBegin Translate 3 0 0 CoordinateSystem \"here\" TransformEnd\n"
                    "ActiveTransform StartTime CoordSysTransform \"here\" ActiveTransform All Shape \"sphere\"");
    assert_int_equal(s->instance_count, 0);
    near(s->quadrics[0].to_render.m[3], 3, 0);
    pt_scene_destroy(s);
}

/* v3's shares of uber and mix are one number here: colours in them are said. */
static void coloured_shares_are_said(void **state)
{
    (void)state;
    static const char *const format =
        "Film \"image\" WorldBegin MakeNamedMaterial \"a\" \"string type\" \"uber\" \"rgb opacity\" [ %s ]\n"
        "MakeNamedMaterial \"b\" \"string type\" \"mix\" \"string namedmaterial1\" \"a\" "
        "\"string namedmaterial2\" \"a\" \"rgb amount\" [ %s ]";
    static const struct {
        const char *opacity, *amount;
        int warnings;
    } cases[] = {{".5 .5 .5", ".5 .5 .5", 0}, {"1 0 0", "1 1 1", 1}, {"1 1 1", "0 0 1", 1}, {"1 0 0", "0 0 1", 2}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[600];
        int warnings = 0;
        snprintf(text, sizeof text, format, cases[i].opacity, cases[i].amount);
        pt_scene_destroy(text_scene(text, NULL, &warnings));
        assert_int_equal(warnings, cases[i].warnings);
    }
}

/* So is the tint of an uber material that is glass here. */
static void tinted_uber_glass_is_said(void **state)
{
    (void)state;
    static const char *const tints[] = {"1 1 1", ".2 .9 .2"};
    for (int i = 0; i < 2; i++) {
        char text[200];
        int warnings = 0;
        snprintf(text, sizeof text, "Film \"image\" WorldBegin Material \"uber\" \"rgb Kd\" [ 0 0 0 ] \"rgb Kt\" [ %s ]",
                 tints[i]);
        pt_scene_destroy(text_scene(text, NULL, &warnings));
        assert_int_equal(warnings, i);
    }
}

static void warnings_come_once_and_strict_refuses(void **state)
{
    (void)state;
    static const char text[] =
        "WorldBegin\nMaterial \"hair\" Material \"hair\"\nMaterial \"measured\" \"string filename\" \"x\"";
    int warnings = 0;
    struct base_err err;
    pt_scene_destroy(text_scene(text, NULL, &warnings));
    assert_int_equal(warnings, 2);
    assert_int_equal(text_scene_error(text, 1, &err), BASE_EINVAL);
    assert_memory_equal(err.text, "t.pbrt:2:1: material \"hair\"", 27);
}

/* A sphere made of patches, curves, subdivided and revolved surfaces: they load, are finite, and about the right size. */
static void tessellated(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "Shape \"loopsubdiv\" \"integer levels\" 4 \"integer indices\" [ 0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5 ] "
        "\"point3 P\" [ 1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1 ]\n"
        "Shape \"loopsubdiv\" \"integer levels\" 2 \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ 0 0 0 1 0 0 1 1 0 0 1 "
        "0 ]\n"
        "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ]\nShape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 "
        "0 1 0 1 1 1 ]\n"
        "Shape \"curve\" \"float width\" 0.1 \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 ]\nShape \"cone\" \"float height\" 2\n"
        "Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [ 0 0 1 1 ]");
    assert_int_equal(s->mesh_count, 7);
    const struct pt_mesh *ball = &s->meshes[0];
    assert_int_equal(ball->triangle_count, 8 * 256);
    for (uint32_t i = 0; i < ball->vertex_count; i++) {
        const struct pt_vertex *v = &ball->vertices[i];
        float r = v3_len(v->p), along = v3_dot(v->p, v->n), len = v3_len(v->n);
        assert_true(r > 0.4f && r < 0.7f && fabsf(along) > 0.9f * r * len); /* a rounded octahedron: normals point along p */
        assert_true(along < 0);                                             /* pbrt's side: against the right-hand rule */
    }
    for (uint32_t i = 0; i < s->meshes[1].vertex_count; i++)
        assert_true(fabsf(s->meshes[1].vertices[i].p.z) < 1e-6f); /* flat stays flat, boundary included */
    assert_int_equal(s->meshes[2].triangle_count, 2);
    assert_int_equal(s->meshes[3].triangle_count, 128);
    const struct pt_mesh *tube = &s->meshes[4];
    for (uint32_t i = 0; i < tube->vertex_count; i++)
        near(hypotf(tube->vertices[i].p.y, tube->vertices[i].p.z), 0.05, 1e-5);
    pt_scene_destroy(s);
}

/* A tip with many neighbours is rounded as any other vertex: half way to their middle. */
static void a_tip_of_many_triangles(void **state)
{
    (void)state;
    enum { AROUND = 600, ROOM = 60 * AROUND };
    char *text = malloc(ROOM);
    assert_non_null(text);
    size_t n = (size_t)snprintf(text, ROOM, "Shape \"loopsubdiv\" \"integer levels\" 0 \"point3 P\" [ 0 0 1");
    for (int i = 0; i < AROUND; i++)
        n += (size_t)snprintf(text + n, ROOM - n, " %.5f %.5f 0", cos(2 * BASE_PI * i / AROUND),
                              sin(2 * BASE_PI * i / AROUND));
    n += (size_t)snprintf(text + n, ROOM - n, " ] \"integer indices\" [");
    for (int i = 0; i < AROUND; i++)
        n += (size_t)snprintf(text + n, ROOM - n, " 0 %d %d", 1 + i, 1 + (i + 1) % AROUND);
    snprintf(text + n, ROOM - n, " ]");
    struct pt_scene *s = world_scene(text);
    near(s->meshes[0].vertices[0].p.z, 0.5, 1e-6);
    near(s->meshes[0].vertices[0].n.z, -1, 1e-4);
    pt_scene_destroy(s);
    free(text);
}

/* Flat or not, two triangles have a patch only where positions, uv and normals run evenly over it. */
static void patches_of_two_triangles(void **state)
{
    (void)state;
    static const struct {
        const char *patch;
        uint32_t triangles;
    } cases[] = {{"\"point3 P\" [ 0 0 0 2 0 1 1 1 0 3 1 1 ]", 2},
                 {"\"point3 P\" [ 7.1 0 0 7.4 0 0 7.1 .3 0 7.3999999 .3 0 ]", 2},
                 {"\"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"point2 uv\" [ 0 0 2 0 1 3 3 3 ]", 2},
                 {"\"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"normal N\" [ 0 0 1 .1 0 1 0 .1 1 .1 .1 1 ]", 2},
                 {"\"point3 P\" [ 0 0 0 1 0 0 0 1 0 2 1 0 ]", 128},
                 {"\"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"point2 uv\" [ 0 0 1 0 0 1 2 1 ]", 128},
                 {"\"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"normal N\" [ 0 0 1 .1 0 1 0 .1 1 -.1 -.1 1 ]", 128}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[300];
        snprintf(text, sizeof text, "Shape \"bilinearmesh\" %s", cases[i].patch);
        struct pt_scene *s = world_scene(text);
        assert_int_equal(s->meshes[0].triangle_count, cases[i].triangles);
        pt_scene_destroy(s);
    }
}

/* Texture coordinates of a flat trapezoid: x = (2u - 1)(2 - v). */
static void trapezoid(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene("Shape \"bilinearmesh\" \"point3 P\" [ -2 0 5 2 0 5 -1 1 5 1 1 5 ]");
    for (int i = 0; i < 20; i++) {
        float u = 0.03f + 0.047f * (float)i, v = 0.52f + 0.02f * (float)i;
        struct pt_ray ray = {{(2 * u - 1) * (2 - v), v, 0}, {0, 0, 1}, 0.0f, INFINITY, 0.0f};
        struct pt_hit hit;
        struct pt_place at;
        assert_true(pt_accel_intersect(s, &ray, &hit));
        pt_place_at_hit(PT_FX_ALL, s, &ray, &hit, &at);
        near(at.s.u, (double)u, 5e-3); /* within a cell of an eighth: |d²u/dx dv| / 64 at most */
        near(at.s.v, (double)v, 1e-5);
    }
    pt_scene_destroy(s);
}

/* A twisted patch is smooth without normals of its own: z = 5 + xy, and with the other orientation. */
static void saddle(void **state)
{
    (void)state;
    for (int reverse = 0; reverse < 2; reverse++) {
        char text[200];
        snprintf(text, sizeof text, "%s Shape \"bilinearmesh\" \"point3 P\" [ -1 -1 6 1 -1 4 -1 1 4 1 1 6 ]",
                 reverse ? "ReverseOrientation" : "");
        struct pt_scene *s = world_scene(text);
        for (int i = 0; i < 25; i++) {
            float x = -0.83f + 0.41f * (float)(i % 5), y = -0.79f + 0.39f * (float)(i / 5);
            struct pt_ray ray = {{x, y, 0}, {0, 0, 1}, 0.0f, INFINITY, 0.0f};
            struct pt_hit hit;
            struct pt_place at;
            assert_true(pt_accel_intersect(s, &ray, &hit));
            pt_place_at_hit(PT_FX_ALL, s, &ray, &hit, &at);
            pt_vec3 n = v3_norm(v3(-y, -x, 1));
            near(v3_len(v3_sub(at.s.n_shading, reverse ? v3_neg(n) : n)), 0, 1e-5);
            assert_true(v3_dot(at.s.n_geometric, at.s.n_shading) > 0);
        }
        pt_scene_destroy(s);
    }
}

/* Surfaces of revolution are smooth, outwards as their triangles are, at the tip too. */
static void revolved_normals(void **state)
{
    (void)state;
    static const char *const shapes[] = {"\"cone\" \"float height\" 2", "\"paraboloid\" \"float zmax\" 2 \"float radius\" 2",
                                         "\"hyperboloid\" \"point3 p1\" [ 1 0 0 ] \"point3 p2\" [ 1 1 1 ]"};
    for (int i = 0; i < 3; i++) {
        char text[200];
        snprintf(text, sizeof text, "Shape %s", shapes[i]);
        struct pt_scene *s = world_scene(text);
        const struct pt_mesh *m = &s->meshes[0];
        for (uint32_t k = 0; k < m->vertex_count; k++) {
            const struct pt_vertex *v = &m->vertices[k];
            const float x = v->p.x, y = v->p.y, z = v->p.z, phi = v->u * 2 * PT_PI;
            /* gradients of their equations: z = 2 - 2r; z = r² / 2; r² - z² = 1 */
            pt_vec3 want = i == 0 ? v3(2 * cosf(phi), 2 * sinf(phi), 1) : i == 1 ? v3(x, y, -1) : v3(x, y, -z);
            near(v3_len(v3_sub(v3_norm(v->n), v3_norm(want))), 0, 1e-5);
        }
        for (uint32_t t = 0; t < m->triangle_count; t++) {
            const struct pt_vertex *a = m->vertices + m->indices[3 * t], *b = m->vertices + m->indices[3 * t + 1],
                                   *c = m->vertices + m->indices[3 * t + 2];
            pt_vec3 n = v3_cross(v3_sub(b->p, a->p), v3_sub(c->p, a->p));
            assert_true(v3_dot(n, a->n) > -1e-6f);
        }
        pt_scene_destroy(s);
    }
}

/* The vertices of ring k of a tube of six sides. */
static pt_vec3 middle_of(const struct pt_mesh *tube, uint32_t ring)
{
    pt_vec3 sum = v3_splat(0.0f);
    for (uint32_t i = 0; i < 6; i++)
        sum = v3_madd(sum, 1.0f / 6.0f, tube->vertices[6 * ring + i].p);
    return sum;
}

/* Tubes keep their width: rings turn with the curve, and no further; control points that coincide turn none. */
static void tubes(void **state)
{
    (void)state;
    static const char *const curves[] = {
        "\"point3 P\" [ -.8 0 -.6 -.8 0 .8 .8 0 .8 .8 0 -.6 ]", /* upwards, then down */
        "\"point3 P\" [ -.8 .1 -.6 -.7 0 .8 .8 .3 .8 .8 0 -.6 ]",
        "\"point3 P\" [ -.6 0 0 -.6 0 0 .6 0 0 .6 0 0 ]",
        "\"point3 P\" [ -.6 0 0 -.6 0 0 -.6 0 0 .6 0 0 ]",
        "\"point3 P\" [ -.6 0 0 .6 0 0 .6 0 0 .6 0 0 ]",
        "\"integer degree\" 2 \"point3 P\" [ -.6 0 0 -.6 0 0 .6 0 0 ]",
        "\"string basis\" \"bspline\" \"point3 P\" [ -.6 0 0 -.6 0 0 -.6 0 0 -.2 .1 .3 .6 0 0 .6 0 0 .6 0 0 ]"};
    const float radius = 0.15f;
    for (size_t i = 0; i < sizeof curves / sizeof *curves; i++) {
        char text[300];
        snprintf(text, sizeof text, "Shape \"curve\" \"float width\" 0.3 %s", curves[i]);
        struct pt_scene *s = world_scene(text);
        const struct pt_mesh *tube = &s->meshes[0];
        for (uint32_t ring = 0; 6 * (ring + 1) < tube->vertex_count; ring++) {
            pt_vec3 a = middle_of(tube, ring), b = middle_of(tube, ring + 1), between = v3_scale(v3_add(a, b), 0.5f);
            for (uint32_t k = 0; k < 6; k++) {
                pt_vec3 p = tube->vertices[6 * ring + k].p, q = tube->vertices[6 * (ring + 1) + k].p;
                near(v3_len(v3_sub(p, a)), (double)radius, 1e-5);
                float half_way = v3_len(v3_sub(v3_scale(v3_add(p, q), 0.5f), between));
                if (!(half_way > 0.85f * radius)) /* cos of half the turn from ring to ring, which is below 60 degrees */
                    fail_msg("%s: %g instead of %g behind ring %u", curves[i], (double)half_way, (double)radius,
                             (unsigned)ring);
            }
        }
        for (uint32_t k = 0; k < tube->vertex_count; k++) { /* u along each segment, v around */
            near(tube->vertices[k].u, k / 6 % 9 / 8.0, 1e-6);
            near(tube->vertices[k].v, k % 6 / 6.0, 1e-6);
        }
        for (uint32_t k = 0; k < tube->vertex_count && i >= 2 && i <= 5; k++)
            assert_true(fabsf(tube->vertices[k].p.x) < 0.6f + 1e-5f);
        pt_scene_destroy(s);
    }
}

static void pixel_bounds(void **state)
{
    (void)state;
    struct pt_scene_defaults d;
    struct pt_scene *s = text_scene(
        "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 100 \"integer pixelbounds\" [ 10 20 30 60 ] "
        "WorldBegin",
        &d, NULL);
    assert_true(d.crop[0] == 10 && d.crop[2] == 20 && d.crop[1] == 30 && d.crop[3] == 60);
    pt_scene_destroy(s);
}

/* A portal is where its corners are in the world, as in pbrt-v4, whatever turns the sky; a constant environment is selected for it
 * alone. */
static void portals(void **state)
{
    (void)state;
    struct pt_scene *s =
        text_scene("LookAt 1 2 3  1 2 13  0 1 0 Camera \"perspective\" WorldBegin AttributeBegin Rotate -90 1 0 0\n"
                   "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ] "
                   "\"point3 portal\" [ -2 1 0.5  -2 1 2.5  -2 -2 2.5  -2 -2 0.5 ]\nAttributeEnd\n"
                   "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]",
                   NULL, NULL);
    const struct pt_light *light = &s->lights[0];
    assert_true(light->has_portal && !s->lights[1].has_portal);
    const float expected[9] = {-3, -1, -2.5f, 0, 0, 2, 0, -3, 0}; /* (1, 2, 3) less where the camera is the origin */
    const float got[9] = {light->portal.x,   light->portal.y,   light->portal.z,   light->portal_u.x, light->portal_u.y,
                          light->portal_u.z, light->portal_v.x, light->portal_v.y, light->portal_v.z};
    for (int i = 0; i < 9; i++)
        near(got[i], (double)expected[i], 1e-6);
    assert_int_equal(s->emitter_count, 1);
    assert_int_equal(s->env_light_count, 2);
    pt_scene_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(film_and_camera),
                                       cmocka_unit_test(far_from_the_origin),
                                       cmocka_unit_test(small_and_far_away),
                                       cmocka_unit_test(normals_at_any_scale),
                                       cmocka_unit_test(orientation),
                                       cmocka_unit_test(a_ball_as_a_floor),
                                       cmocka_unit_test(lights),
                                       cmocka_unit_test(power_of_stretched_lamps),
                                       cmocka_unit_test(materials_of_both_versions),
                                       cmocka_unit_test(textures),
                                       cmocka_unit_test(media),
                                       cmocka_unit_test(instances_and_motion),
                                       cmocka_unit_test(part_of_the_motion),
                                       cmocka_unit_test(the_same_twice_stands_still),
                                       cmocka_unit_test(flattened),
                                       cmocka_unit_test(grows_from_nothing),
                                       cmocka_unit_test(graphics_state),
                                       cmocka_unit_test(interface_lamps_are_dark),
                                       cmocka_unit_test(coloured_shares_are_said),
                                       cmocka_unit_test(tinted_uber_glass_is_said),
                                       cmocka_unit_test(mixed_with_nothing),
                                       cmocka_unit_test(warnings_come_once_and_strict_refuses),
                                       cmocka_unit_test(tessellated),
                                       cmocka_unit_test(a_tip_of_many_triangles),
                                       cmocka_unit_test(patches_of_two_triangles),
                                       cmocka_unit_test(trapezoid),
                                       cmocka_unit_test(saddle),
                                       cmocka_unit_test(revolved_normals),
                                       cmocka_unit_test(tubes),
                                       cmocka_unit_test(presets_of_media),
                                       cmocka_unit_test(grids_of_any_density),
                                       cmocka_unit_test(grids_that_stay),
                                       cmocka_unit_test(glow_of_grids),
                                       cmocka_unit_test(spheres_of_any_limits),
                                       cmocka_unit_test(pixel_bounds),
                                       cmocka_unit_test(portals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
