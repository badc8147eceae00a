/*
 * Views from afar: a window of 8 units, looked through from any distance, shows what is there to its edges. What is seen is a
 * rectangle that glows, so that a pixel has the share of it that the rectangle covers.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include "base/pi.h"
#include "integ/integrator.h"
#include "support/pt_text_scene.h"

enum { SIZE = 8, SPP = 1024 };

/* Of Sobol' points, which a straight edge cuts: the discrepancy of 1024 of them. */
static const double SOBOL_ERROR = 8e-3;
/* Of decisions by chance (time, lens): four standard errors of a share. */
static const double CHANCE_ERROR = 4 * 0.5 / 32;
/* What a window at distance D looks like from 1/D aside. */
static const double distances[] = {1e4, 1e6, 1e8, 1e10, 1e12};

static const double edge[2][2] = {{-1.7, 2.3}, {-2.6, 0.45}}; /* of the rectangle: x, y */

#define FILM \
    "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 PixelFilter \"box\" \"float xradius\" .5 \"float " \
    "yradius\" " \
    ".5 Integrator \"path\" \"integer maxdepth\" 1 "
#define GLOW \
    "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true Shape \"trianglemesh\" \"integer indices\" [ " \
    "0 1 2 0 2 3 ] " \
    "\"point3 P\" [ -1.7 -2.6 0 2.3 -2.6 0 2.3 .45 0 -1.7 .45 0 ] "
#define WINDOW "\"float screenwindow\" [ -4 4 -4 4 ] "

/* The share of [at, at + 1] that lies within an edge, while both move by `way`. */
static double share(const double from_to[2], double at, double way)
{
    enum { STEPS = 400 };
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        double by = at + way * (i + 0.5) / STEPS;
        sum += fmax(0, fmin(from_to[1], by + 1) - fmax(from_to[0], by)) / STEPS;
    }
    return sum;
}

static void check(const char *text, double distance, double way, double tolerance)
{
    struct pt_scene_defaults defaults;
    int warnings = 0;
    struct pt_scene *scene = text_scene(text, &defaults, &warnings);
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    defaults.integrator.sampler = PT_SAMPLER_SOBOL;
    defaults.integrator.want_aux = 1;
    assert_int_equal(warnings, 0);
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        const double want = share(edge[0], i % SIZE - 4.0, way) * share(edge[1], 3.0 - i / SIZE, 0);
        double got = 0;
        for (uint32_t s = 0; s < SPP; s++) {
            struct pt_path_result r;
            kernel(scene, &defaults.integrator, i % SIZE, i / SIZE, 1, s, &r);
            got += (double)r.radiance.y / SPP;
            if (isfinite(r.depth) && fabs((double)r.depth / distance - 1) > 0.1)
                fail_msg("the depth is %g, not %g: %s", (double)r.depth, distance, text);
        }
        if (!(fabs(got - want) <= tolerance))
            fail_msg("pixel %u, %u is %.5f, not %.5f: %s", i % SIZE, i / SIZE, got, want, text);
    }
    pt_scene_destroy(scene);
}

/* The scene stands in the camera's space, at its distance; of its units so many are one in the world. */
static void check_camera(const char *place, const char *camera, double distance, double unit, double tolerance)
{
    char text[3000];
    snprintf(text, sizeof text, FILM "%s Camera %s WorldBegin CoordSysTransform \"camera\" Translate 0 0 %.17g " GLOW, place,
             camera, distance);
    check(text, distance / unit, 0, tolerance);
}

static double fov_deg(double half, double distance) { return 2 * atan(half / distance) * 180 / BASE_PI; }

static void still_cameras(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        const double d = distances[i];
        char camera[300], place[300];
        snprintf(camera, sizeof camera, "\"perspective\" \"float fov\" %.17g", fov_deg(4, d));
        check_camera("", "\"orthographic\" " WINDOW, d, 1, SOBOL_ERROR);
        check_camera("", camera, d, 1, SOBOL_ERROR);
        snprintf(place, sizeof place, "LookAt %.17g %.17g %.17g 0 0 0 0 1 0", 0.48 * d, 0.6 * d, 0.64 * d);
        check_camera(place, "\"orthographic\" " WINDOW, d, 1, SOBOL_ERROR);
        check_camera(place, camera, d, 1, SOBOL_ERROR);
        /* ... that are given as numbers, far from the world's origin, mirrored, in other units */
        check_camera("Transform [ .8 .36 .48 0 0 .8 -.6 0 -.6 .48 .64 0 3e5 -2e4 1e6 1 ]", camera, d, 1, SOBOL_ERROR);
        check_camera("Scale -3 3 3 Translate 1e5 70 -1e6 Rotate 40 1 2 3", camera, d, 3, SOBOL_ERROR);
    }
}

/* What is seen is far beside the axis: the window is not about it. */
static void windows_beside_the_axis(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        const double d = distances[i];
        char text[3000];
        snprintf(
            text, sizeof text,
            FILM
            "Camera \"orthographic\" \"float screenwindow\" [ %.17g %.17g -4 4 ] WorldBegin Translate %.17g 0 %.17g " GLOW,
            0.3 * d - 4, 0.3 * d + 4, 0.3 * d, d);
        check(text, d, 0, SOBOL_ERROR);
        snprintf(text, sizeof text,
                 FILM
                 "Camera \"perspective\" \"float fov\" 90 \"float screenwindow\" [ %.17g %.17g %.17g %.17g ] WorldBegin "
                 "Translate %.17g 0 %.17g " GLOW,
                 0.3 - 4 / d, 0.3 + 4 / d, -4 / d, 4 / d, 0.3 * d, d);
        check(text, d * sqrt(1 + 0.3 * 0.3), 0, SOBOL_ERROR);
    }
}

static void lenses(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++) {
        char camera[300];
        snprintf(camera, sizeof camera, "\"orthographic\" " WINDOW "\"float lensradius\" %g \"float focaldistance\" %.17g",
                 fmin(0.1 * distances[i], 1e9), distances[i]);
        check_camera("LookAt 3 2 5 -1 0 2 0 1 0", camera, distances[i], 1, CHANCE_ERROR);
        snprintf(camera, sizeof camera,
                 "\"perspective\" \"float fov\" %.17g \"float lensradius\" %g \"float focaldistance\" %.17g",
                 fov_deg(4, distances[i]), fmin(0.1 * distances[i], 1e9), distances[i]);
        check_camera("LookAt 3 2 5 -1 0 2 0 1 0", camera, distances[i], 1, CHANCE_ERROR);
    }
}

static void moving_cameras(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof distances / sizeof *distances; i++)
        for (int perspective = 0; perspective < 2; perspective++) {
            const double d = distances[i];
            char text[3000], lens[300] = "\"orthographic\" " WINDOW;
            if (perspective)
                snprintf(lens, sizeof lens, "\"perspective\" \"float fov\" %.17g", fov_deg(4, d));
            snprintf(text, sizeof text,
                     FILM
                     "TransformTimes 0 1 ActiveTransform EndTime Translate -1.5 0 0 ActiveTransform All LookAt %.17g %.17g "
                     "%.17g 0 0 0 0 1 0 Camera %s \"float shutteropen\" 0 \"float shutterclose\" 1 WorldBegin "
                     "Transform [ -.8 0 .6 0 -.36 .8 -.48 0 -.48 -.6 -.64 0 0 0 0 1 ] " GLOW,
                     .48 * d, .6 * d, .64 * d, lens);
            check(text, d, 1.5, CHANCE_ERROR);
        }
}

/* A floor that the camera stands on, too, a wall of cards, a ball and a pipe around all: nothing but what the window shows counts. */
static void large_surroundings(void **state)
{
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        const double d = distances[i];
        char text[3000];
        snprintf(
            text, sizeof text,
            FILM
            "LookAt 0 %.17g %.17g 0 0 0 0 0 1 Camera \"orthographic\" " WINDOW
            "WorldBegin AttributeBegin CoordSysTransform \"camera\" Translate 0 0 %.17g " GLOW
            "AttributeEnd Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] AttributeBegin CoordSysTransform \"camera\" "
            "Shape \"cylinder\" \"float radius\" 1e5 \"float zmin\" -1e5 \"float zmax\" 1e7 Translate 0 0 %.17g "
            "Shape \"sphere\" \"float radius\" %.17g AttributeEnd Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] Shape "
            "\"bilinearmesh\" \"point3 P\" [ "
            "-1e8 -9 -1e8 1e8 -9 -1e8 "
            "-1e8 -9 1e8 1e8 -9 1e8 ] Shape \"disk\" \"float radius\" 1e7 \"float height\" 200 Translate 0 0 9e6 Shape "
            "\"sphere\" \"float radius\" 1e4",
            0.6 * d, -0.8 * d, d, (d + 1.9e6) / 2, (d + 2.1e6) / 2);
        check(text, d, 0, SOBOL_ERROR);
    }
}

/* Where no float tells one pixel from the next, a line says so: the camera stands in what it looks through. */
static void what_floats_do_not_hold_is_said(void **state)
{
    (void)state;
    static const char format[] = FILM "MakeNamedMedium \"air\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 1e-9 1e-9 "
                                      "1e-9 ] \"rgb sigma_s\" [ 0 0 0 ]\n"
                                      "MediumInterface \"\" \"air\" Camera \"orthographic\" " WINDOW
                                      "\nWorldBegin Translate 0 0 %g MediumInterface \"\" \"\" " GLOW;
    for (int i = 0; i < 2; i++) {
        char text[3000];
        int warnings = 0;
        struct base_err err;
        snprintf(text, sizeof text, format, i ? 1e9 : 1e5);
        pt_scene_destroy(text_scene(text, NULL, &warnings));
        assert_int_equal(warnings, i);
        assert_int_equal(text_scene_error(text, 1, &err) != 0, i);
        if (i && !strstr(err.text, "t.pbrt:2:"))
            fail_msg("%s", err.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(still_cameras),
        cmocka_unit_test(windows_beside_the_axis),
        cmocka_unit_test(lenses),
        cmocka_unit_test(moving_cameras),
        cmocka_unit_test(large_surroundings),
        cmocka_unit_test(what_floats_do_not_hold_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
