/* Every allocation while scene text is read fails once: BASE_ENOMEM, no crash, no leak. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pbrt/build.h"
#include "pbrt/ply.h"
#include "support/fail_alloc.h"
#include "support/pt_memory_source.h"

static const char text[] =
    "Film \"rgb\" \"integer xresolution\" 8 Camera \"perspective\" WorldBegin\n"
    "Texture \"t\" \"spectrum\" \"checkerboard\" MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"texture "
    "reflectance\" \"t\"\n"
    "MakeNamedMedium \"fog\" \"string type\" \"uniformgrid\" \"float density\" [ 1 2 ] \"integer nx\" 2\n"
    "MediumInterface \"fog\" \"\" Attribute \"shape\" \"float alpha\" 0.5 NamedMaterial \"m\"\n"
    "LightSource \"point\" AttributeBegin AreaLightSource \"diffuse\" Shape \"sphere\" AttributeEnd\n"
    "ObjectBegin \"o\" Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"normal N\" "
    "[ 0 0 1 0 0 1 0 0 1 ] "
    "\"point2 uv\" [ 0 0 1 0 0 1 ] ObjectEnd ObjectInstance \"o\"\n"
    "NamedMaterial \"late\" Shape \"disk\" MakeNamedMaterial \"late\" \"string type\" \"conductor\"\n"
    "Shape \"loopsubdiv\" \"integer levels\" 1 \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]\n"
    "Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 1 1 0 0 1 1 ] Shape \"cone\" Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 "
    "0 0 0 1 0 1 1 1 ]\n"
    "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Shape \"disk\" CoordinateSystem \"here\" Material "
    "\"hair\"\n";

/* v3: names end with their block, shapes set parameters of their material. */
static const char v3_text[] =
    "Film \"image\" \"integer xresolution\" 8 Option \"seed\" 5 WorldBegin Material \"matte\" Shape \"disk\" \"rgb Kd\" [ 0 "
    "1 0 ]\n"
    "AttributeBegin MakeNamedMaterial \"m\" \"string type\" \"uber\" \"spectrum Kd\" [ 400 0.1 700 0.2 ] NamedMaterial "
    "\"m\" "
    "Texture \"t\" \"float\" \"constant\" Shape \"disk\" \"rgb opacity\" [ 0.5 0.5 0.5 ] \"texture bumpmap\" \"t\" "
    "AttributeEnd\n"
    "Shape \"sphere\" \"rgb Kr\" [ 1 1 1 ] NamedMaterial \"m\" Material \"mix\" \"string namedmaterial1\" \"x\" "
    "\"string namedmaterial2\" \"y\" Shape \"disk\"\n";

enum { MORE_THAN_IT_TAKES = 20000 };

static int read_once(const char *scene_text, struct base_err *err)
{
    static const struct pt_load_options options;
    struct pt_source_single single = {"t.pbrt", scene_text, strlen(scene_text)};
    struct pt_source source = pt_source_from_memory(&single);
    struct pt_scene_defaults defaults = {0};
    struct pt_scene scene = {0};
    struct pt_builder b;
    pt_builder_init(&b, &scene, &defaults, &options, &source, err);
    int rc = pt_pbrt_read(&b, "t.pbrt");
    pt_builder_release(&b);
    pt_arena_release(&scene.arena);
    return rc;
}

static void fail_each(const char *scene_text)
{
    int failures = 0;
    struct base_err err = {0};
    assert_int_equal(read_once(scene_text, &err), 0);
    for (long k = 1; k < MORE_THAN_IT_TAKES; k++) {
        err = (struct base_err){0};
        fail_arm(k);
        int rc = read_once(scene_text, &err);
        int reached = fail_disarm();
        if (!reached) {
            assert_int_equal(rc, 0);
            break;
        }
        failures++;
        if (rc != BASE_ENOMEM)
            fail_msg("allocation %ld: code %d, \"%s\"", k, rc, err.text);
    }
    assert_true(failures > 50);
}

static void reading(void **state)
{
    (void)state;
    fail_each(text);
}

static void reading_v3(void **state)
{
    (void)state;
    fail_each(v3_text);
}

static void ply(void **state)
{
    (void)state;
    static const char bytes[] =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
        "property float ny\nproperty float nz\nproperty float u\nproperty float v\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0 0 0 1 0 0\n1 0 0 0 0 1 0 0\n0 1 0 0 0 1 0 0\n3 0 1 2\n";
    struct pt_ply out;
    struct base_err err = {0};
    int failures = 0;
    for (long k = 1; k < 100; k++) {
        fail_arm(k);
        int rc = pt_ply_parse("a.ply", bytes, sizeof bytes - 1, &out, &err);
        if (!fail_disarm()) {
            assert_int_equal(rc, 0);
            pt_ply_release(&out);
            break;
        }
        assert_int_equal(rc, BASE_ENOMEM);
        failures++;
    }
    assert_true(failures >= 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(reading), cmocka_unit_test(reading_v3), cmocka_unit_test(ply)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
