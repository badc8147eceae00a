/*
 * Floors, walls and skies made of triangles that are huge against what stands by them: the light at a place under a black ball,
 * beside a black wall, under a card that glows all over, by closed form.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include "integ/integrator.h"
#include "support/pt_text_scene.h"

enum { SPP = 4096 };

/* What is promised, of the light; 4096 Sobol' points leave 0.3 % at most. */
static const double MOST_OFF = 0.01;

/* Half sizes. */
static const double sizes[] = {1e3, 1e5, 1e7, 1e9, 1e12};

/* How a floor y = 0 of half size @ is made; the last two are as large as their scale makes them. */
#define QUAD(size) \
    "Shape \"trianglemesh\" \"integer indices\" [ 0 2 1 0 3 2 ] \"point3 P\" [ -" size " 0 -" size " " size " 0 -" size \
    " " size " 0 " size " -" size " 0 " size " ] "
static const char *const floors[] = {
    QUAD("@"),
    "Shape \"bilinearmesh\" \"point3 P\" [ -@ 0 -@ @ 0 -@ -@ 0 @ @ 0 @ ] ",
    "Shape \"trianglemesh\" \"point3 P\" [ -@ 0 -@ 0 0 @ @ 0 -@ ] \"point2 uv\" [ 0 0 1 1 1 0 ] \"normal N\" "
    "[ 0 1 0 0 1 0 0 1 0 ] ",
    "AttributeBegin Scale @ 1 @ ObjectInstance \"floor\" AttributeEnd ",
    "AttributeBegin Scale @ @ @ ObjectInstance \"floor\" AttributeEnd ",
};
enum { FLOORS = sizeof floors / sizeof *floors };

/* The world turned and moved. */
static const char *const worlds[] = {"", "Rotate 31 1 .4 .3", "Translate 3e4 -7e3 1e4 Rotate 70 .2 1 1"};
enum { WORLDS = sizeof worlds / sizeof *worlds };

#define EYE "LookAt 0 3 -6 0 0 0 0 1 0 "
#define GREY "Material \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ] "
#define BLACK "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] "
#define SKY "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ] "

/* The radiance of the origin, by a camera that sees nothing else, through a window of 1/50. */
static void check(const char *world, const char *what, double want, const char *told)
{
    char text[6000];
    struct pt_scene_defaults defaults;
    int warnings = 0;
    snprintf(
        text, sizeof text,
        "Film \"rgb\" \"integer xresolution\" 1 \"integer yresolution\" 1 PixelFilter \"box\" Integrator \"path\" \"integer "
        "maxdepth\" 1 " EYE
        "%s Camera \"orthographic\" \"float screenwindow\" [ -.01 .01 -.01 .01 ]\nWorldBegin ObjectBegin "
        "\"floor\" " GREY QUAD("1") "ObjectEnd\nCoordSysTransform \"camera\" " EYE "%s",
        world, what);
    struct pt_scene *scene = text_scene(text, &defaults, &warnings);
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    double sum = 0.0;
    defaults.integrator.sampler = PT_SAMPLER_SOBOL;
    for (uint32_t s = 0; s < SPP; s++) {
        struct pt_path_result r;
        kernel(scene, &defaults.integrator, 0, 0, 1, s, &r);
        sum += (double)r.radiance.y / SPP;
    }
    pt_scene_destroy(scene);
    assert_int_equal(warnings, 0);
    if (!(fabs(sum - want) <= MOST_OFF * want))
        fail_msg("%s: %.5f, not %.5f: %s", told, sum, want, text);
}

/* `format` with the half size for each @ and the floor for each #. */
static void fill(const char *format, double size, const char *floor, char *out)
{
    for (; *format; format++)
        if (*format == '@')
            out += sprintf(out, "%g", size);
        else if (*format == '#')
            out += sprintf(out, "%s", floor);
        else
            *out++ = *format;
    *out = 0;
}

/* Everything on every floor in every world. */
static void check_all(const char *format, double want, const char *told)
{
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int f = 0; f < FLOORS; f++)
            for (int w = 0; w < WORLDS; w++) {
                char floor[1000], what[3000];
                fill(floors[f], sizes[i], "", floor);
                fill(format, sizes[i], floor, what);
                check(worlds[w], what, want, told);
            }
}

/* A ball of radius r with its centre at height c takes (r/c)² of the light of an even sky from the floor below it. */
static void under_a_ball(void **state)
{
    (void)state;
    check_all(GREY "# " BLACK "Translate 0 1.25 0 Shape \"sphere\" \"float radius\" .75 " SKY, 0.5 * (1 - 0.36),
              "under a ball");
}

/* A wall without end takes half of it, at any distance; one of this size, all but 1 / (2 · size). */
static void beside_a_wall(void **state)
{
    (void)state;
    check_all(GREY "# " BLACK "Translate .3 0 0 Rotate 90 0 0 1 " QUAD("@") SKY, 0.5 * 0.5, "beside a wall");
}

/* Under a card that glows, the sky is that card. */
static void under_a_card(void **state)
{
    (void)state;
    check_all(GREY "# AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true Translate 0 9 0 " QUAD("@"),
              0.5, "under a card");
}

/* As under a ball, while the floor moves sideways. */
static void on_a_moving_floor(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char what[3000];
        fill(BLACK "AttributeBegin Translate 0 1.25 0 Shape \"sphere\" \"float radius\" .75 AttributeEnd " SKY GREY
                   "ActiveTransform EndTime Translate 1 0 .5 ActiveTransform All " QUAD("@"),
             sizes[i], "", what);
        check("", what, 0.5 * (1 - 0.36), "on a moving floor");
    }
}

/* Beyond that a line says so, with the place; what stands elsewhere is none of its business. */
static void what_floats_do_not_hold_is_said(void **state)
{
    (void)state;
    static const char head[] = "Film \"rgb\" Camera \"perspective\" WorldBegin Translate 0 -2 0\n";
    static const char *const sizes_told[] = {"1e10", "1e16"};
    for (int i = 0; i < 2; i++) {
        char text[2000], floor[1000];
        int warnings = 0;
        struct base_err err;
        fill(QUAD("@"), i ? 1e16 : 1e10, "", floor);
        snprintf(text, sizeof text, "%s%s", head, floor);
        pt_scene_destroy(text_scene(text, NULL, &warnings));
        if (warnings != i)
            fail_msg("%d warnings of a floor of %s", warnings, sizes_told[i]);
        assert_int_equal(text_scene_error(text, 1, &err) != 0, i);
        if (i && !strstr(err.text, "t.pbrt:2"))
            fail_msg("%s", err.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(under_a_ball),
        cmocka_unit_test(beside_a_wall),
        cmocka_unit_test(under_a_card),
        cmocka_unit_test(on_a_moving_floor),
        cmocka_unit_test(what_floats_do_not_hold_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
