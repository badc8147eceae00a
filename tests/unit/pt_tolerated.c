/* What pbrt goes on after: the scene is that of the plain text beside it, and what was passed over is warned of. */
#define _GNU_SOURCE /* asprintf */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pt_text_scene.h"
#include "support/pt_dump.h"

#define MESH "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] "
#define OBJECT "ObjectBegin \"a\" Shape \"sphere\" ObjectEnd "

/* The words of the world, after `head`. malloc'ed */
static char *dumped(const char *head, const char *world, int *warnings)
{
    char *text = NULL, *scene_text = NULL;
    size_t size = 0;
    assert_true(asprintf(&scene_text, "%sWorldBegin %s", head, world) > 0);
    struct pt_scene *scene = text_scene(scene_text, NULL, warnings);
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    pt_dump_world(out, scene);
    assert_int_equal(fclose(out), 0);
    pt_scene_destroy(scene);
    free(scene_text);
    return text;
}

struct tolerated {
    const char *text, *plain;
    int warnings;
};

static void expect_same(const char *head, const struct tolerated *list, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        int warnings = 0, none = 0;
        char *got = dumped(head, list[i].text, &warnings), *plain = dumped(head, list[i].plain, &none);
        if (strcmp(got, plain) != 0)
            fail_msg("%s\n%s\nbut %s\n%s", list[i].text, got, list[i].plain, plain);
        if (warnings != list[i].warnings || none != 0)
            fail_msg("%d warnings of %s", warnings + none, list[i].text);
        free(got);
        free(plain);
    }
}

static void of_both(void **state)
{
    static const struct tolerated list[] = {
        {"Shape \"sphere\" \"float radius\" 1 \"float radius\" 2", "Shape \"sphere\" \"float radius\" 2", 1},
        {"CoordSysTransform \"moon\" Shape \"sphere\"", "Shape \"sphere\"", 1},
        {"AttributeBegin Scale 0 0 0 Shape \"sphere\" AttributeEnd Shape \"disk\"", "Shape \"disk\"", 1},
        {OBJECT "AttributeBegin Scale 0 0 0 ObjectInstance \"a\" AttributeEnd", OBJECT, 1},
        {OBJECT "AttributeBegin Scale 1e-13 1 1 ObjectInstance \"a\" AttributeEnd", OBJECT, 1},
        {OBJECT "AttributeBegin Translate 0 0 1e8 Scale 1e-10 1 1 ObjectInstance \"a\" AttributeEnd", OBJECT, 1},
        {"Scale 1 1 0 Shape \"trianglemesh\" \"point3 P\" [ 0 0 3 1 0 4 0 1 5 ]", MESH, 0},
        {"Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"integer indices\" [ ] Shape \"disk\"",
         "Shape \"disk\"", 1},
        {"Shape \"trianglemesh\" \"point3 P\" [ ] \"integer indices\" [ ] Shape \"disk\"", "Shape \"disk\"", 1},
        {"LightSource \"point\" \"rgb I\" [ -1 2 3 ]", "LightSource \"point\" \"rgb I\" [ 0 2 3 ]", 1},
        {"Shape \"sphere\" \"float phimax\" 360.00001", "Shape \"sphere\"", 0},
    };
    (void)state;
    expect_same("", list, sizeof list / sizeof list[0]);
    expect_same("Film \"image\" ", list, sizeof list / sizeof list[0]);
}

static void of_v4(void **state)
{
    static const struct tolerated list[] = {
        {"Translate 0 0 5 ObjectInstance \"a\" Identity " OBJECT, OBJECT "Translate 0 0 5 ObjectInstance \"a\"", 0},
    };
    (void)state;
    expect_same("", list, sizeof list / sizeof list[0]);
}

static void of_v3(void **state)
{
    static const struct tolerated list[] = {
        {"AttributeBegin ObjectBegin \"a\" Shape \"sphere\" AttributeEnd ObjectEnd Shape \"disk\"", OBJECT "Shape \"disk\"",
         0},
        {"Shape \"sphere\" AttributeEnd WorldEnd", "Shape \"sphere\"", 1},
        {"AttributeBegin Shape \"sphere\" WorldEnd", "Shape \"sphere\"", 1},
        {"ObjectInstance \"a\" " OBJECT, OBJECT, 1},
        {MESH "\"integer indices\" [ ] Shape \"disk\"", "Shape \"disk\"", 1},
        {"Shape \"blob\" \"float size\" 2 Shape \"disk\"", "Shape \"disk\"", 1},
        {"LightSource \"sun\" Shape \"disk\"", "Shape \"disk\"", 1},
        {"AreaLightSource \"diffuse\" AreaLightSource \"lamp\" \"rgb L\" [ 1 2 3 ] Shape \"disk\"", "Shape \"disk\"", 1},
        {"Texture \"t\" \"spectrum\" \"lace\" Material \"matte\" \"texture Kd\" \"t\" Shape \"disk\"",
         "Material \"matte\" Shape \"disk\"", 2},
        {"Material \"carpaint\" \"rgb Kd\" [ .1 .2 .3 ] Shape \"disk\"",
         "Material \"matte\" \"rgb Kd\" [ .1 .2 .3 ] Shape \"disk\"", 1},
        {"Material \"matte\" \"spectrum Kd\" [ 700 .2 400 .4 ] Shape \"disk\"",
         "Material \"matte\" \"spectrum Kd\" [ 400 .4 700 .2 ] Shape \"disk\"", 0},
        {"Shape \"sphere\" \"float raduis\" 2", "Shape \"sphere\"", 1},
        {"Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [ .2 .3 .4 ] "
         "Material \"matte\" \"texture Kd\" \"t\" \"rgb Kd\" [ .5 .5 .5 ] Shape \"disk\"",
         "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [ .2 .3 .4 ] "
         "Material \"matte\" \"texture Kd\" \"t\" Shape \"disk\"",
         1},
    };
    (void)state;
    expect_same("Film \"image\" ", list, sizeof list / sizeof list[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(of_both), cmocka_unit_test(of_v4), cmocka_unit_test(of_v3)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
