/* What a scene file leaves unsaid: the default of every parameter in both versions of the format, the formulas that numbers go
 * through, the ends of their ranges, and what is read over without a word. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/files.h"
#include "picture/png.h"
#include "pt_text_scene.h"

#define V3 "Film \"image\" WorldBegin "
static const double pi = 3.14159265358979323846;

static void near(double a, double b, double relative)
{
    if (!(fabs(a - b) <= relative * fmax(fabs(b), 1e-3)))
        fail_msg("%.9g is not within %g of %.9g", a, relative, b);
}

static void near3(pt_vec3 a, double x, double y, double z)
{
    near((double)a.x, x, 2e-6);
    near((double)a.y, y, 2e-6);
    near((double)a.z, z, 2e-6);
}

static void film_filter_and_sampler(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int width, height, spp, sampler, filter;
        double x, y, sigma, scale;
    } cases[] = {
        {"WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 1},
        {V3, 640, 480, 16, PT_SAMPLER_SOBOL, PT_FILTER_BOX, 0.5, 0.5, 0.5, 1},
        {"PixelFilter \"gaussian\" " V3, 640, 480, 16, PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 2, 2, 0.5, 1},
        {"PixelFilter \"gaussian\" \"float alpha\" 8 \"float ywidth\" 3 " V3, 640, 480, 16, PT_SAMPLER_SOBOL,
         PT_FILTER_GAUSSIAN, 2, 3, 0.25, 1},
        {"PixelFilter \"gaussian\" \"float xradius\" 2.5 \"float sigma\" 0.7 WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL,
         PT_FILTER_GAUSSIAN, 2.5, 1.5, 0.7, 1},
        {"PixelFilter \"triangle\" \"float yradius\" 1 WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL, PT_FILTER_TRIANGLE, 2,
         1, 0.5, 1},
        {"PixelFilter \"mitchell\" \"float B\" 0.3 \"float C\" 0.3 WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL,
         PT_FILTER_GAUSSIAN, 2, 2, 0.5, 1},
        {"PixelFilter \"mitchell\" \"float xradius\" 1.5 \"float yradius\" 1.5 WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL,
         PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.375, 1},
        {"PixelFilter \"sinc\" \"float tau\" 3 WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 2, 2, 0.5,
         1},
        {"Sampler \"stratified\" WorldBegin", 1280, 720, 16, PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 1},
        {"Sampler \"stratified\" \"integer xsamples\" 3 \"integer ysamples\" 5 WorldBegin", 1280, 720, 15, PT_SAMPLER_SOBOL,
         PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 1},
        {"Sampler \"random\" \"integer pixelsamples\" 9 WorldBegin", 1280, 720, 9, PT_SAMPLER_INDEPENDENT,
         PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 1},
        {"Film \"rgb\" \"float iso\" 200 \"float exposuretime\" 0.25 \"float scale\" 7 WorldBegin", 1280, 720, 16,
         PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 0.5},
        {"Film \"rgb\" \"float iso\" 200 Camera \"perspective\" \"float shutteropen\" 0.1 \"float shutterclose\" 0.4 "
         "WorldBegin",
         1280, 720, 16, PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 0.6},
        {"Camera \"perspective\" \"float shutterclose\" 0.5 Film \"rgb\" \"float exposuretime\" 2 WorldBegin", 1280, 720, 16,
         PT_SAMPLER_SOBOL, PT_FILTER_GAUSSIAN, 1.5, 1.5, 0.5, 2},
        {"Film \"image\" Camera \"perspective\" \"float shutterclose\" 0.5 WorldBegin", 640, 480, 16, PT_SAMPLER_SOBOL,
         PT_FILTER_BOX, 0.5, 0.5, 0.5, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct pt_scene_defaults d;
        struct pt_scene *s = text_scene(cases[i].text, &d, NULL);
        assert_int_equal(d.width, cases[i].width);
        assert_int_equal(d.height, cases[i].height);
        assert_int_equal(d.spp, cases[i].spp);
        assert_int_equal(d.integrator.sampler, cases[i].sampler);
        assert_int_equal(d.integrator.filter, cases[i].filter);
        near((double)d.integrator.filter_x, cases[i].x, 1e-6);
        near((double)d.integrator.filter_y, cases[i].y, 1e-6);
        near((double)d.integrator.filter_sigma, cases[i].sigma, 1e-6);
        near((double)s->radiance_scale, cases[i].scale, 1e-6);
        assert_true(d.crop[0] == 0 && d.crop[1] == 0 && d.crop[2] == d.width && d.crop[3] == d.height && !d.film_path[0]);
        assert_true(isinf(d.integrator.max_component) && d.integrator.max_depth == 5 && d.integrator.rr_depth == 3);
        assert_int_equal(d.integrator.strategy, PT_STRATEGY_MIS);
        pt_scene_destroy(s);
    }
    struct pt_scene_defaults d;
    pt_scene_destroy(
        text_scene("Film \"image\" \"float maxsampleluminance\" 12 \"float scale\" 2 \"string filename\" \"x.exr\" Sampler "
                   "\"halton\" \"integer seed\" 77 "
                   "Integrator \"path\" \"integer maxdepth\" -1 WorldBegin",
                   &d, NULL));
    assert_true(d.integrator.max_component == 24 && d.integrator.seed == 77 && d.integrator.max_depth == -1);
    assert_string_equal(d.film_path, "x.exr");
}

static void camera(void **state)
{
    (void)state;
    struct pt_scene *s =
        text_scene("Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" 60 WorldBegin", NULL, NULL);
    const struct pt_camera *c = &s->camera;
    assert_true(c->kind == PT_CAMERA_PERSPECTIVE && c->fov_deg == 90 && c->lens_radius == 0 && c->focal_distance == 1e6f);
    assert_true(c->screen[0] == -1 && c->screen[1] == 1 && c->screen[2] == -2 && c->screen[3] == 2);
    assert_true(!c->animated && c->medium == -1);
    pt_scene_destroy(s);
    s = text_scene("Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" 60 "
                   "Camera \"orthographic\" \"float screenwindow\" [ -3 4 -5 6 ] \"float lensradius\" 2 \"float "
                   "focaldistance\" 7 WorldBegin",
                   NULL, NULL);
    c = &s->camera;
    assert_true(c->kind == PT_CAMERA_ORTHOGRAPHIC && c->fov_deg == 0 && c->lens_radius == 2 && c->focal_distance == 7);
    assert_true(c->screen[0] == -3 && c->screen[1] == 4 && c->screen[2] == -5 && c->screen[3] == 6);
    pt_scene_destroy(s);
    s = text_scene("Camera \"perspective\" \"float frameaspectratio\" 0.25 WorldBegin", NULL, NULL);
    assert_true(s->camera.screen[1] == 1 && s->camera.screen[3] == 4);
    pt_scene_destroy(s);
}

static void lights(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "LightSource \"point\" LightSource \"spot\" LightSource \"distant\" LightSource \"infinite\"\n"
        "LightSource \"spot\" \"float coneangle\" 60 \"float conedeltaangle\" 20 \"float power\" 10 \"rgb I\" [ 2 2 2 ]\n"
        "LightSource \"spot\" \"float conedeltaangle\" 0 \"float coneangle\" 0.001 LightSource \"spot\" \"float "
        "conedeltaangle\" 180 \"float coneangle\" 180\n"
        "LightSource \"distant\" \"rgb L\" [ 1 2 3 ] \"float illuminance\" 5 \"float scale\" 2\n"
        "LightSource \"infinite\" \"rgb L\" [ 3 3 3 ] \"float illuminance\" 6 \"float scale\" .5\n"
        "LightSource \"point\" \"rgb I\" [ 1 2 4 ] \"rgb scale\" [ 3 2 1 ] \"float power\" 8\n"
        "LightSource \"point\" \"spectrum I\" [ 400 3 700 3 ] \"float scale\" 5\n"
        "Translate 1 2 3 Scale 2 2 2 LightSource \"spot\" \"point3 from\" [ 1 1 1 ] \"point3 to\" [ 1 1 0 ]");
    static const float cone = 30, start = 25;
    const struct pt_light *l = s->lights;
    assert_int_equal(s->light_count, 12);
    near3(l[0].emission, 1, 1, 1);
    near3(l[0].position, 0, 0, 0);
    near3(l[1].emission, 1, 1, 1);
    near3(l[1].direction, 0, 0, 1);
    near(l[1].cos_total, cos((double)cone * pi / 180), 1e-6);
    near(l[1].cos_start, cos((double)start * pi / 180), 1e-6);
    near3(l[2].emission, 1, 1, 1);
    near3(l[2].direction, 0, 0, -1 + 2); /* from the origin to (0, 0, 1) */
    assert_int_equal(l[3].kind, PT_LIGHT_ENV_CONSTANT);
    near3(l[3].emission, 1, 1, 1);
    /* Φ = 2π I ((1 - cos 40°) + (cos 40° - cos 60°) / 2); "power" scales "I" */
    double flux = 2 * pi * ((1 - cos(40 * pi / 180)) + (cos(40 * pi / 180) - 0.5) / 2);
    near3(l[4].emission, 2 * 10 / flux, 2 * 10 / flux, 2 * 10 / flux);
    assert_true(l[5].cos_start == l[5].cos_total && l[6].cos_total == -1 && l[6].cos_start == 1);
    near3(l[7].emission, 10, 20, 30);
    near3(l[8].emission, 9 / pi, 9 / pi, 9 / pi); /* of an upward patch: π L; "L" and "scale" are factors of it, as in v4 */
    near3(l[9].emission, 3 * 8 / (4 * pi), 4 * 8 / (4 * pi), 4 * 8 / (4 * pi));
    near((double)v3_luminance(l[10].emission), 5, 1e-4); /* v4: a spectrum of any strength has luminance 1 */
    near3(l[11].position, 3, 4, 5);
    near3(l[11].direction, 0, 0, -1);
    pt_scene_destroy(s);
}

static void area_lights(void **state)
{
    (void)state;
    /* 10 W from an area of 2 units², on one side and on both; a disk cut out of a disk, half of it; a cylinder; a scaled sphere */
    struct pt_scene *s = world_scene(
        "AttributeBegin AreaLightSource \"diffuse\" \"float power\" 10\n"
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ 0 0 5 2 0 5 2 1 5 0 1 5 ]\n"
        "Shape \"disk\" \"float radius\" 2 \"float innerradius\" 1 \"float phimax\" 180\n"
        "Shape \"cylinder\" \"float radius\" 0.5 \"float zmin\" 3 \"float zmax\" 1\n"
        "Scale 2 2 2 Shape \"sphere\" AttributeEnd\n"
        "AttributeBegin AreaLightSource \"diffuse\" \"float power\" 10 \"bool twosided\" true \"rgb L\" [ 1 2 3 ] "
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ 0 0 5 2 0 5 2 1 5 0 1 5 ] AttributeEnd\n"
        "AreaLightSource \"diffuse\" Shape \"sphere\"");
    const double area[] = {2, 1.5 * pi, 2 * pi, 16 * pi, 4};
    for (int i = 0; i < 5; i++)
        near((double)s->lights[i].emission.x, 10 / (pi * area[i]), 2e-6);
    near((double)s->lights[4].emission.z, 3 * 10 / (pi * 4), 2e-6);
    assert_true(s->lights[4].two_sided && !s->lights[0].two_sided && !s->lights[5].two_sided);
    near3(s->lights[5].emission, 1, 1, 1);
    assert_true(s->quadrics[1].z_min == 1 && s->quadrics[1].z_max == 3);
    pt_scene_destroy(s);
}

static void environment_map(void **state)
{
    (void)state;
    /* display codes 0, 128 and 255 of a PNG are linear light 0, 0.2159 and 1; grey images are grey */
    static const uint8_t wide[] = {0,  128, 255, 255, 128, 0,   128, 128, 128, 0,   0, 0,
                                   10, 10,  10,  255, 255, 255, 1,   2,   3,   128, 0, 255};
    static const uint8_t grey[] = {128, 0, 255, 10};
    char dir[] = "/tmp/pt_parameters_XXXXXX", path[64], file[64], text[256];
    struct base_err err = {0};
    assert_non_null(mkdtemp(dir));
    for (int k = 0; k < 2; k++) {
        snprintf(path, sizeof path, "%s/%d.png", dir, k);
        assert_int_equal(k ? pic_write_png(path, 2, 2, 1, grey, &err) : pic_write_png(path, 4, 2, 3, wide, &err), 0);
        snprintf(text, sizeof text, "WorldBegin LightSource \"infinite\" \"string filename\" \"%d.png\" \"float scale\" 3",
                 k);
        snprintf(file, sizeof file, "%s/s.pbrt", dir);
        assert_int_equal(base_file_write_line(file, text, &err), 0);
        struct pt_scene *s = NULL;
        struct pt_scene_defaults d;
        assert_int_equal(pt_scene_load(file, NULL, &s, &d, &err), 0);
        unlink(path);
        unlink(file);
        const struct pt_image_map *map = &s->images[s->lights[0].image];
        assert_true(s->lights[0].kind == PT_LIGHT_ENV_IMAGE && map->type == PT_PIXEL_FLOAT && map->channels == 3);
        assert_int_equal(s->lights[0].mapping, k ? PT_ENV_EQUAL_AREA : PT_ENV_LATLONG);
        near3(s->lights[0].emission, 3, 3, 3);
        const float *px = map->pixels;
        const double half = pow((128 / 255.0 + 0.055) / 1.055, 2.4);
        if (k) {
            near3(v3(px[0], px[1], px[2]), half, half, half);
            near3(v3(px[6], px[7], px[8]), 1, 1, 1);
        } else {
            near3(v3(px[0], px[1], px[2]), 0, half, 1);
            near3(v3(px[3], px[4], px[5]), 1, half, 0);
        }
        pt_scene_destroy(s);
    }
    rmdir(dir);
}

static void media(void **state)
{
    (void)state;
    struct pt_scene *s =
        world_scene("MakeNamedMedium \"milk\" MakeNamedMedium \"skin\" \"string preset\" \"Skin2\" \"float scale\" 2 "
                    "\"float g\" -0.9999\n"
                    "MakeNamedMedium \"grid\" \"string type\" \"uniformgrid\" \"float density\" 5\n"
                    "MakeNamedMedium \"fire\" \"rgb sigma_a\" [ 1 2 3 ] \"rgb sigma_s\" [ 4 5 6 ] \"float scale\" 0.5 \"rgb "
                    "Le\" [ 2 2 1 ] \"float Lescale\" 3\n"
                    "MediumInterface \"milk\" \"skin\" Shape \"sphere\" MediumInterface \"grid\" \"fire\" Shape \"sphere\"");
    const struct pt_medium *m = s->media;
    near3(m[0].sigma_a, 0.0011, 0.0024, 0.014);
    near3(m[0].sigma_s, 2.55, 3.21, 3.77);
    near3(m[0].emission, 0, 0, 0);
    assert_true(m[0].g == 0 && m[1].g == -0.9999f);
    near3(m[1].sigma_s, 2 * 1.09, 2 * 1.59, 2 * 1.79);
    near3(m[1].sigma_a, 2 * 0.013, 2 * 0.070, 2 * 0.145);
    near3(m[2].sigma_a, 1, 1, 1);
    near3(m[2].sigma_s, 1, 1, 1);
    near3(pt_mat34_point(&m[2].from_render, v3(0.25f, 0.5f, 1)), 0.25, 0.5, 1);
    near3(m[3].sigma_a, 0.5, 1, 1.5);
    near3(m[3].sigma_s, 2, 2.5, 3);
    near3(m[3].emission, 0.5 * 6, 1 * 6, 1.5 * 3); /* σa · Le */
    pt_scene_destroy(s);
}

/* Jensen, Marschner, Levoy and Hanrahan 2001, table 1, as printed: σs' and σa in 1/mm for red, green and blue. */
static void media_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double s[3], a[3];
    } table[] = {
        {"Apple", {2.29, 2.39, 1.97}, {0.0030, 0.0034, 0.046}},  {"Chicken1", {0.15, 0.21, 0.38}, {0.015, 0.077, 0.19}},
        {"Chicken2", {0.19, 0.25, 0.32}, {0.018, 0.088, 0.20}},  {"Cream", {7.38, 5.47, 3.15}, {0.0002, 0.0028, 0.0163}},
        {"Ketchup", {0.18, 0.07, 0.03}, {0.061, 0.97, 1.45}},    {"Marble", {2.19, 2.62, 3.00}, {0.0021, 0.0041, 0.0071}},
        {"Potato", {0.68, 0.70, 0.55}, {0.0024, 0.0090, 0.12}},  {"Skimmilk", {0.70, 1.22, 1.90}, {0.0014, 0.0025, 0.0142}},
        {"Skin1", {0.74, 0.88, 1.01}, {0.032, 0.17, 0.48}},      {"Skin2", {1.09, 1.59, 1.79}, {0.013, 0.070, 0.145}},
        {"Spectralon", {11.6, 20.4, 14.9}, {0, 0, 0}},           {"Wholemilk", {2.55, 3.21, 3.77}, {0.0011, 0.0024, 0.014}},
        {"unknown", {2.55, 3.21, 3.77}, {0.0011, 0.0024, 0.014}}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        char text[160];
        int warnings = 0;
        snprintf(text, sizeof text, "WorldBegin MakeNamedMedium \"m\" \"string preset\" \"%s\"", table[i].name);
        struct pt_scene *s = text_scene(text, NULL, &warnings);
        near3(s->media[0].sigma_s, table[i].s[0], table[i].s[1], table[i].s[2]);
        near3(s->media[0].sigma_a, table[i].a[0], table[i].a[1], table[i].a[2]);
        assert_int_equal(warnings, i == 12);
        pt_scene_destroy(s);
    }
}

/* Everything a material may say and does not. */
static void materials(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" MakeNamedMaterial \"b\" \"string type\" \"coateddiffuse\"\n"
        "MakeNamedMaterial \"c\" \"string type\" \"conductor\" MakeNamedMaterial \"d\" \"string type\" \"dielectric\"\n"
        "MakeNamedMaterial \"e\" \"string type\" \"thindielectric\" MakeNamedMaterial \"f\" \"string type\" "
        "\"diffusetransmission\"\n"
        "MakeNamedMaterial \"g\" \"string type\" \"coatedconductor\" MakeNamedMaterial \"h\" \"string type\" \"mix\" "
        "\"string materials\" [ \"a\" \"b\" ]\n"
        "MakeNamedMaterial \"i\" \"string type\" \"diffusetransmission\" \"rgb reflectance\" [ 0.1 0.2 0.3 ] \"float "
        "scale\" 2\n"
        "MakeNamedMaterial \"j\" \"string type\" \"dielectric\" \"spectrum eta\" \"glass-F11\" \"float uroughness\" 0.2 "
        "\"float roughness\" 0.3\n"
        "MakeNamedMaterial \"k\" \"string type\" \"dielectric\" \"rgb eta\" [ 1.1 1.2 1.3 ]\n"
        "MakeNamedMaterial \"l\" \"string type\" \"dielectric\" \"spectrum eta\" [ 300 1.4 900 1.4 ]\n"
        "MakeNamedMaterial \"m\" \"string type\" \"coatedconductor\" \"float interface.roughness\" 0.4 \"float "
        "conductor.vroughness\" 0.2 "
        "\"float interface.eta\" 1.3 \"rgb reflectance\" [ 0.1 0.2 0.3 ] \"float thickness\" 0.5 \"float g\" 0.25 \"rgb "
        "albedo\" [ 0.1 0.2 0.3 ]\n"
        "MakeNamedMaterial \"n\" \"string type\" \"dielectric\" \"float eta\" 1\n");
    const struct pt_material *m = s->materials;
    static const int kinds[] = {PT_BSDF_DIFFUSE,         PT_BSDF_COATED_DIFFUSE,  PT_BSDF_CONDUCTOR,
                                PT_BSDF_DIELECTRIC,      PT_BSDF_THIN_DIELECTRIC, PT_BSDF_DIFFUSE_TRANSMISSION,
                                PT_BSDF_COATED_CONDUCTOR};
    for (int i = 0; i < 7; i++)
        assert_int_equal(m[i].kind, kinds[i]);
    near3(m[0].reflectance.value, 0.5, 0.5, 0.5);
    near3(m[1].reflectance.value, 0.5, 0.5, 0.5);
    for (int i = 1; i < 7; i += 5) { /* the coats */
        near((double)m[i].thickness.value.x, 0.01, 1e-6);
        assert_true(m[i].g.value.x == 0 && v3_is_black(m[i].albedo.value) && m[i].remap_roughness && m[i].eta == 1.5f);
        assert_true(m[i].roughness_u.value.x == 0 && m[i].roughness_v.value.x == 0);
    }
    assert_true(m[6].base_roughness_u.value.x == 0 && m[6].base_roughness_v.value.x == 0);
    assert_true(!m[2].conductor_by_colour && m[2].remap_roughness && m[2].roughness_u.value.x == 0);
    /* copper: red is reflected, blue is not */
    assert_true(m[2].eta_rgb.value.x < 0.5f && m[2].eta_rgb.value.z > 1 && m[2].k_rgb.value.x > 3);
    assert_true(m[3].eta == 1.5f && m[4].eta == 1.5f && m[3].remap_roughness);
    near3(m[5].reflectance.value, 0.25, 0.25, 0.25);
    near3(m[5].transmittance.value, 0.25, 0.25, 0.25);
    near((double)m[7].mix_amount.value.x, 0.5, 0);
    near3(m[8].reflectance.value, 0.2, 0.4, 0.6);
    near3(m[8].transmittance.value, 0.5, 0.5, 0.5);
    near((double)m[9].eta, 1.7847, 1e-3); /* pbrt's F11 is the catalogue's SF11 */
    near((double)m[9].roughness_u.value.x, 0.2, 1e-6);
    near((double)m[9].roughness_v.value.x, 0.3, 1e-6);
    assert_true(m[10].eta == 1.2f);
    near((double)m[11].eta, 1.4, 1e-4);
    near((double)m[12].roughness_v.value.x, 0.4, 1e-6);
    assert_true(m[12].base_roughness_u.value.x == 0 && m[12].base_roughness_v.value.x == 0.2f);
    assert_true(m[12].eta == 1.3f && m[12].conductor_by_colour && m[12].thickness.value.x == 0.5f &&
                m[12].g.value.x == 0.25f);
    near3(m[12].albedo.value, 0.1, 0.2, 0.3);
    near3(m[12].reflectance.value, 0.1, 0.2, 0.3);
    assert_int_equal(m[13].kind, PT_MATERIAL_INTERFACE);
    pt_scene_destroy(s);
}

/* v3's fit from perceived roughness to alpha, as that version's sources have it. */
static double v3_alpha(double roughness)
{
    double x = log(roughness);
    return 1.62142 + 0.819955 * x + 0.1734 * x * x + 0.0171201 * x * x * x + 0.000640711 * x * x * x * x;
}

static void materials_of_version_3(void **state)
{
    (void)state;
    struct pt_scene *s = text_scene(
        V3
        "MakeNamedMaterial \"a\" \"string type\" \"matte\" MakeNamedMaterial \"b\" \"string type\" \"plastic\"\n"
        "MakeNamedMaterial \"c\" \"string type\" \"substrate\" MakeNamedMaterial \"d\" \"string type\" \"uber\"\n"
        "MakeNamedMaterial \"e\" \"string type\" \"metal\" MakeNamedMaterial \"f\" \"string type\" \"mirror\"\n"
        "MakeNamedMaterial \"g\" \"string type\" \"shinymetal\" MakeNamedMaterial \"h\" \"string type\" \"glass\"\n"
        "MakeNamedMaterial \"i\" \"string type\" \"translucent\" \"rgb Kd\" [ .8 .6 .4 ] \"rgb transmit\" [ .5 .25 1 ] "
        "\"rgb Ks\" [ 0 0 0 ]\n"
        "MakeNamedMaterial \"j\" \"string type\" \"plastic\" \"rgb Ks\" [ 0 0 0 ]\n"
        "MakeNamedMaterial \"k\" \"string type\" \"uber\" \"rgb Kd\" [ 0 0 0 ] \"rgb Kt\" [ 1 1 1 ] \"float index\" 1.25\n"
        "MakeNamedMaterial \"l\" \"string type\" \"uber\" \"rgb Kd\" [ 0 0 0 ] \"rgb Ks\" [ 0 0 0 ] \"rgb Kr\" [ .1 .2 .3 "
        "]\n"
        "MakeNamedMaterial \"m\" \"string type\" \"glass\" \"float uroughness\" 0.2 \"float vroughness\" 0.05 \"float eta\" "
        "1.7\n",
        NULL, NULL);
    const struct pt_material *m = s->materials;
    const double rough = v3_alpha(0.1);
    near3(m[0].reflectance.value, 0.5, 0.5, 0.5);
    near3(m[1].reflectance.value, 0.25, 0.25, 0.25);
    near3(m[2].reflectance.value, 0.5, 0.5, 0.5);
    near3(m[3].reflectance.value, 0.25, 0.25, 0.25);
    for (int i = 1; i < 4; i++) {
        assert_true(m[i].kind == PT_BSDF_COATED_DIFFUSE && m[i].eta == 1.5f && !m[i].remap_roughness);
        near((double)m[i].thickness.value.x, 0.01, 1e-6);
        near((double)m[i].roughness_u.value.x, rough, 1e-6);
        near((double)m[i].roughness_v.value.x, rough, 1e-6);
    }
    near((double)m[4].roughness_u.value.x, v3_alpha(0.01), 1e-6);
    near3(m[5].reflectance.value, 0.9, 0.9, 0.9);
    near3(m[6].reflectance.value, 1, 1, 1);
    near((double)m[6].roughness_u.value.x, rough, 1e-6);
    assert_true(m[5].conductor_by_colour && m[6].conductor_by_colour && m[5].roughness_u.value.x == 0);
    assert_true(m[7].kind == PT_BSDF_DIELECTRIC && m[7].eta == 1.5f && m[7].roughness_u.value.x == 0);
    near3(m[8].reflectance.value, 0.4, 0.3, 0.2);
    near3(m[8].transmittance.value, 0.4, 0.15, 0.4);
    assert_int_equal(m[9].kind, PT_BSDF_DIFFUSE);
    assert_true(m[10].kind == PT_BSDF_DIELECTRIC && m[10].eta == 1.25f && m[10].roughness_u.value.x == 0);
    assert_true(m[11].kind == PT_BSDF_CONDUCTOR && m[11].conductor_by_colour);
    near3(m[11].reflectance.value, 0.1, 0.2, 0.3);
    near((double)m[12].roughness_u.value.x, v3_alpha(0.2), 1e-6);
    near((double)m[12].roughness_v.value.x, v3_alpha(0.05), 1e-6);
    assert_true(m[12].eta == 1.7f);
    pt_scene_destroy(s);
}

static void shapes(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "Shape \"sphere\" Shape \"disk\" Shape \"cylinder\" Shape \"sphere\" \"float radius\" 2 \"float zmin\" -9 "
        "\"float zmax\" 1 \"float phimax\" 90 Shape \"disk\" \"float height\" 3\n"
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 1  1 0 1  0 1 1 ] \"point2 uv\" [ 0 0 1 0 .5 1 ]\n"
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 1  1 0 1  0 1 1 ] \"float st\" [ 0 0 1 0 .25 1 ]");
    const struct pt_quadric *q = s->quadrics;
    assert_true(q[0].radius == 1 && q[0].z_min == -1 && q[0].z_max == 1 && q[1].radius == 1 && q[1].inner_radius == 0 &&
                q[1].z_min == 0);
    assert_true(q[2].radius == 1 && q[2].z_min == -1 && q[2].z_max == 1);
    assert_true(q[3].z_min == -2 && q[3].z_max == 1 && q[4].z_min == 3);
    near((double)q[0].phi_max, 2 * pi, 1e-6);
    near((double)q[3].phi_max, pi / 2, 1e-6);
    assert_true(s->meshes[0].triangle_count == 1 && s->meshes[0].has_uvs && s->meshes[0].vertices[2].u == 0.5f &&
                s->meshes[1].vertices[2].u == 0.25f);
    near3(s->materials[s->shapes[0].material].reflectance.value, 0.5, 0.5, 0.5);
    pt_scene_destroy(s);
}

/* What other renderers' files carry along and changes nothing here is neither refused nor warned of. */
static void read_over(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int warnings;
    } texts[] = {
        {"Film \"rgb\" \"float diagonal\" 50 \"bool savefp16\" true \"string type\" \"x\" WorldBegin", 0},
        {"Film \"rgb\" \"string sensor\" \"cie1931\" \"float whitebalance\" 0 WorldBegin", 0},
        {"Sampler \"halton\" \"string randomization\" \"owen\" \"integer dimensions\" 4 \"bool jitter\" true WorldBegin", 0},
        {"Integrator \"path\" \"string lightsampler\" \"bvh\" \"float rrthreshold\" 1 \"bool regularize\" false WorldBegin",
         0},
        {"WorldBegin LightSource \"point\" \"integer nsamples\" 4 \"integer samples\" 4", 0},
        {"WorldBegin AreaLightSource \"diffuse\" \"integer nsamples\" 4 \"integer samples\" 4", 0},
        {"WorldBegin Material \"coateddiffuse\" \"integer maxdepth\" 10 \"integer nsamples\" 1", 0},
        {"WorldBegin Material \"thindielectric\" \"float roughness\" 0 \"bool remaproughness\" true", 0},
        {"WorldBegin Material \"diffuse\" \"float sigma\" 0 \"string type\" \"diffuse\"", 0},
        {"WorldBegin MakeNamedMedium \"m\" \"float Lescale\" 2", 0},
        {"WorldBegin MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"float density\" 1 \"float temperaturescale\" 1",
         0},
        {"WorldBegin Shape \"trianglemesh\" \"point3 P\" [ 0 0 1  1 0 1  0 1 1 ] \"vector3 S\" [ 1 0 0 1 0 0 1 0 0 ] "
         "\"integer faceIndices\" 0",
         0},
        {"WorldBegin Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 ] \"string type\" \"flat\" \"normal N\" [ 0 0 1 "
         "0 0 1 ] \"integer splitdepth\" 3",
         1},
        {V3 "Material \"mirror\" \"float roughness\" 0 \"bool remaproughness\" true", 0},
        {V3 "Material \"shinymetal\" \"rgb Ks\" [ 1 1 1 ]", 0},
    };
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        int warnings = 0;
        pt_scene_destroy(text_scene(texts[i].text, NULL, &warnings));
        if (warnings != texts[i].warnings) /* curves are tubes, and that is said */
            fail_msg("%d warnings of %s", warnings, texts[i].text);
    }
}

/* The last value that is taken and the first that is not. */
static void ends_of_ranges(void **state)
{
    (void)state;
    static const struct {
        const char *format, *good, *bad;
    } cases[] = {
        {"Film \"rgb\" \"integer xresolution\" %s \"integer yresolution\" 2 WorldBegin", "65536", "65537"},
        {"Film \"rgb\" \"integer xresolution\" %s \"integer yresolution\" 2 WorldBegin", "1", "0"},
        {"Film \"rgb\" \"integer yresolution\" %s WorldBegin", "1", "0"},
        {"Sampler \"halton\" \"integer pixelsamples\" %s WorldBegin", "1", "0"},
        {"Sampler \"stratified\" \"integer xsamples\" %s WorldBegin", "1", "0"},
        {"Sampler \"halton\" \"integer seed\" %s WorldBegin", "0", "-1"},
        {"Integrator \"path\" \"integer maxdepth\" %s WorldBegin", "-1", "-2"},
        {"PixelFilter \"box\" \"float xradius\" %s WorldBegin", "0.001", "0.0009"},
        {"PixelFilter \"box\" \"float ywidth\" %s WorldBegin", "100", "101"},
        {"Camera \"perspective\" \"float fov\" %s WorldBegin", "179.9", "180"},
        {"Camera \"perspective\" \"float lensradius\" %s WorldBegin", "0", "-0.1"},
        {"Camera \"perspective\" \"float shutterclose\" %s WorldBegin", "1e-9", "0"},
        {"Camera \"perspective\" \"float shutterclose\" %s WorldBegin", "1e6", "1.1e6"},
        {"Film \"image\" Camera \"perspective\" \"float shutterclose\" %s WorldBegin", "0", "-0.1"},
        {"Film \"rgb\" \"float exposuretime\" 1 Camera \"perspective\" \"float shutterclose\" %s WorldBegin", "0", "-0.1"},
        {"WorldBegin LightSource \"spot\" \"float coneangle\" %s", "180", "181"},
        {"WorldBegin LightSource \"spot\" \"float conedeltaangle\" %s", "0", "-1"},
        {"WorldBegin LightSource \"point\" \"float scale\" %s", "0", "-1"},
        {"WorldBegin MakeNamedMedium \"m\" \"float g\" %s", "0.9999", "1"},
        {"WorldBegin MakeNamedMedium \"m\" \"float scale\" %s", "0", "-1"},
        {"WorldBegin MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"float density\" %s", "0", "-1"},
        {"WorldBegin Material \"dielectric\" \"float eta\" %s", "10", "10.1"},
        {"WorldBegin Material \"dielectric\" \"float eta\" %s", "0.1", "0.09"},
        {"WorldBegin Material \"conductor\" \"float roughness\" %s", "0", "-0.1"},
        {"WorldBegin Shape \"disk\" \"float innerradius\" %s", "0.99", "1"},
        {"WorldBegin Shape \"sphere\" \"float zmin\" %s", "0.99", "1"},
        {"WorldBegin Shape \"sphere\" \"float phimax\" %s", "361", "0"},
        {"WorldBegin Shape \"cylinder\" \"float zmin\" %s", "0.99", "1"},
        {"WorldBegin Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 ] \"float width0\" %s", "0", "-1"},
        {"WorldBegin LightSource \"point\" \"blackbody I\" %s", "100", "99"},
        {"WorldBegin LightSource \"point\" \"blackbody I\" %s", "1e6", "1.1e6"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[256];
        struct base_err err;
        snprintf(text, sizeof text, cases[i].format, cases[i].good);
        pt_scene_destroy(text_scene(text, NULL, NULL));
        snprintf(text, sizeof text, cases[i].format, cases[i].bad);
        if (text_scene_error(text, 0, &err) != BASE_EINVAL)
            fail_msg("accepted: %s", text);
    }
}

/* What --explain and the report say of a scene. */
static void counted(void **state)
{
    (void)state;
    struct pt_scene *s = world_scene(
        "Texture \"t\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"t\"\n"
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ 0 0 5 2 0 5 2 1 5 0 1 5 ]\n"
        "Material \"conductor\" Shape \"trianglemesh\" \"point3 P\" [ 0 0 1  1 0 1  0 1 1 ] Shape \"sphere\" Shape \"disk\" "
        "Shape \"disk\"\n"
        "ObjectBegin \"o\" Shape \"sphere\" ObjectEnd ObjectInstance \"o\" ObjectInstance \"o\" LightSource \"point\"");
    assert_true(s->stats.triangles == 3 && s->quadric_count == 4 && s->instance_count == 2 && s->light_count == 1 &&
                s->material_count == 2 && s->texture_count == 1);
    assert_true(s->stats.bytes > 1000);
    pt_scene_destroy(s);
}

/* The times of loading are parts of it: none is counted twice. */
static void times_add_up(void **state)
{
    (void)state;
    enum { VERTICES = 60000 };
    static char text[VERTICES * 12 + 200];
    struct pt_scene *s = NULL;
    size_t at = (size_t)sprintf(text, "WorldBegin Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [");
    for (int i = 0; i < VERTICES; i++)
        at += (size_t)sprintf(text + at, " %d %d %d", i % 100, i % 7, i % 3);
    strcpy(text + at, " ]");
    double start_s = base_clock_wall_s();
    s = text_scene(text, NULL, NULL);
    double all_s = base_clock_wall_s() - start_s;
    const struct pt_scene_stats *t = &s->stats;
    assert_true(t->parse_s > 0 && t->build_s >= 0 && t->accel_s >= 0 && t->texture_s >= 0);
    assert_true(t->parse_s + t->build_s + t->accel_s + t->texture_s <= all_s);
    pt_scene_destroy(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(film_filter_and_sampler),
                                       cmocka_unit_test(camera),
                                       cmocka_unit_test(lights),
                                       cmocka_unit_test(area_lights),
                                       cmocka_unit_test(environment_map),
                                       cmocka_unit_test(media),
                                       cmocka_unit_test(media_by_name),
                                       cmocka_unit_test(materials),
                                       cmocka_unit_test(materials_of_version_3),
                                       cmocka_unit_test(shapes),
                                       cmocka_unit_test(read_over),
                                       cmocka_unit_test(ends_of_ranges),
                                       cmocka_unit_test(counted),
                                       cmocka_unit_test(times_add_up)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
