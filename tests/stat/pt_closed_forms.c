/* Images whose pixels have a closed form, from the text of a scene to the kernel: where things are, and what light gets through. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>
#include <math.h>

#include "base/pi.h"
#include "integ/integrator.h"
#include "support/pt_text_scene.h"

enum { SIZE = 8, SPP = 4096 };

/* One scene unit is one pixel: pixel (i, j) is x from i - 4 to i - 3 and, downwards, y from 4 - j to 3 - j. The camera looks along +z. */
#define HEAD(filter, more) \
    "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 PixelFilter " filter more \
    " Camera \"orthographic\" \"float screenwindow\" [ -4 4 -4 4 ] \"float shutteropen\" 0 \"float shutterclose\" 1\n" \
    "Integrator \"path\" \"integer maxdepth\" 1\nWorldBegin\n"
#define BOX "\"box\" \"float xradius\" .5 \"float yradius\" .5"
/* A rectangle in the plane z, seen from the camera's side. */
#define QUAD "Shape \"trianglemesh\" \"integer indices\" [ 0 2 1 0 3 2 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ] \"point3 P\" "
#define GLOW "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] "
#define BLACK "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] "
#define WHITE "Material \"diffuse\" \"rgb reflectance\" [ 1 1 1 ] "

/* Of Sobol' points, which a straight edge cuts: the discrepancy of 4096 of them is below 0.003. */
static const double SOBOL_ERROR = 3e-3;
/* Of decisions by chance (alpha, the time of a path): four standard errors of a share. */
static const double CHANCE_ERROR = 4 * 0.5 / 64;

typedef double expected_at(int x, int y);

static double pixel_mean(const struct pt_scene *scene, const struct pt_integrator *settings, int x, int y)
{
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    double sum = 0.0;
    for (uint32_t s = 0; s < SPP; s++) {
        struct pt_path_result r;
        kernel(scene, settings, (uint32_t)x, (uint32_t)y, 1, s, &r);
        sum += (double)r.radiance.y / SPP;
    }
    return sum;
}

/* The row and the column through the middle. */
static void check_image(const char *text, expected_at *expected, double tolerance)
{
    struct pt_scene_defaults defaults;
    struct pt_scene *scene = text_scene(text, &defaults, NULL);
    defaults.integrator.sampler = PT_SAMPLER_SOBOL;
    for (int i = 0; i < 2 * SIZE; i++) {
        int x = i < SIZE ? i : 5, y = i < SIZE ? 2 : i - SIZE;
        double got = pixel_mean(scene, &defaults.integrator, x, y), want = expected(x, y);
        if (!(fabs(got - want) <= tolerance))
            fail_msg("pixel %d, %d is %.5f, not %.5f: %s", x, y, got, want, text);
    }
    pt_scene_destroy(scene);
}

/* --- an edge under each filter ------------------------------------------------------------------------------------------ */

static double box_share(double d, double r) { return fmin(1.0, fmax(0.0, 0.5 + 0.5 * d / r)); }

/* Of the filter's weight, what lies below d pixels beside its centre. */
static double triangle_share(double d, double r)
{
    d = fmin(r, fmax(-r, d)) / r;
    return d < 0.0 ? 0.5 * (1.0 + d) * (1.0 + d) : 1.0 - 0.5 * (1.0 - d) * (1.0 - d);
}

static double gaussian_share(double d, double r, double sigma)
{
    d = fmin(r, fmax(-r, d));
    return 0.5 + 0.5 * erf(d / (sigma * sqrt(2.0))) / erf(r / (sigma * sqrt(2.0)));
}

/* The light ends at x = 0.3, pixel 4.3 from the left, or at y = 0.6, pixel 3.4 from above. */
static const double EDGE_X = 4.3, EDGE_Y = 3.4;
static double box_x(int x, int y) { return (void)y, box_share(EDGE_X - x - 0.5, 0.5); }
static double box_y(int x, int y) { return (void)x, box_share(EDGE_Y - y - 0.5, 1.0); }
static double triangle_x(int x, int y) { return (void)y, triangle_share(EDGE_X - x - 0.5, 2.0); }
static double triangle_y(int x, int y) { return (void)x, triangle_share(EDGE_Y - y - 0.5, 1.0); }
static double gaussian_x(int x, int y) { return (void)y, gaussian_share(EDGE_X - x - 0.5, 1.5, 0.7); }
static double gaussian_y(int x, int y) { return (void)x, gaussian_share(EDGE_Y - y - 0.5, 2.5, 0.7); }

#define LEFT_OF_EDGE BLACK GLOW QUAD "[ -50 -50 5  .3 -50 5  .3 50 5  -50 50 5 ]"
#define ABOVE_EDGE BLACK GLOW QUAD "[ -50 .6 5  50 .6 5  50 50 5  -50 50 5 ]"
#define BOX_XY "\"box\" \"float xradius\" .5 \"float yradius\" 1"
#define TRIANGLE_XY "\"triangle\" \"float xradius\" 2 \"float yradius\" 1"
#define GAUSSIAN_XY "\"gaussian\" \"float xradius\" 1.5 \"float yradius\" 2.5 \"float sigma\" .7"

static void edges(void **state)
{
    (void)state;
    check_image(HEAD(BOX_XY, "") LEFT_OF_EDGE, box_x, SOBOL_ERROR);
    check_image(HEAD(BOX_XY, "") ABOVE_EDGE, box_y, SOBOL_ERROR);
    check_image(HEAD(TRIANGLE_XY, "") LEFT_OF_EDGE, triangle_x, SOBOL_ERROR);
    check_image(HEAD(TRIANGLE_XY, "") ABOVE_EDGE, triangle_y, SOBOL_ERROR);
    check_image(HEAD(GAUSSIAN_XY, "") LEFT_OF_EDGE, gaussian_x, SOBOL_ERROR);
    check_image(HEAD(GAUSSIAN_XY, "") ABOVE_EDGE, gaussian_y, SOBOL_ERROR);
}

/* --- an edge out of focus, an edge that moves ----------------------------------------------------------------------------- */

/* Of three numbers of the camera at once, two of them drawn as pairs: what 4096 samples leave. */
static const double CAMERA_ERROR = 0.012;

/* Of a disc of radius r, what lies below d beside its centre. */
static double disc_share(double d, double r)
{
    d = fmin(1.0, fmax(-1.0, d / r));
    return 0.5 + (d * sqrt(1.0 - d * d) + asin(d)) / 3.14159265358979;
}

/* The edge is half as far away as the focus: the lens of radius 2 makes a disc of radius 1 of each of its points. */
static double unsharp(int x, int y)
{
    double mean = 0.0;
    (void)y;
    for (int i = 0; i < 1000; i++)
        mean += disc_share(EDGE_X - x - (i + 0.5) / 1000.0, 1.0) / 1000.0;
    return mean;
}

/* A black sheet before a white sky ends at x = 0.3 and goes one pixel to the right: a box over a box. */
static double moving(int x, int y)
{
    double mean = 0.0;
    (void)y;
    for (int i = 0; i < 1000; i++)
        mean += (1.0 - box_share(EDGE_X + (i + 0.5) / 1000.0 - x - 0.5, 0.5)) / 1000.0;
    return mean;
}

/* The same sheet, which stands for a quarter of the time, then goes, then stands again: TransformTimes within the shutter. */
static double moving_between(int x, int y)
{
    double mean = 0.0;
    (void)y;
    for (int i = 0; i < 1000; i++)
        mean += (1.0 - box_share(EDGE_X + fmin(1.0, fmax(0.0, (i + 0.5) / 500.0 - 0.5)) - x - 0.5, 0.5)) / 1000.0;
    return mean;
}

/* A lens or a shutter that shared its numbers with the pixel would have other edges. */
static void unsharp_and_moving_edges(void **state)
{
    (void)state;
    check_image(
        "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 PixelFilter " BOX
        " Camera \"orthographic\" \"float screenwindow\" [ -4 4 -4 4 ] \"float lensradius\" 2 \"float focaldistance\" 10\n"
        "Integrator \"path\" \"integer maxdepth\" 1\nWorldBegin\n" LEFT_OF_EDGE,
        unsharp, CAMERA_ERROR);
    check_image(HEAD(BOX, "") "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
                              "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All " BLACK QUAD
                              "[ -50 -50 5  .3 -50 5  .3 50 5  -50 50 5 ]",
                moving, CAMERA_ERROR);
    check_image(
        HEAD(BOX, " TransformTimes .25 .75") "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
                                             "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All " BLACK QUAD
                                             "[ -50 -50 5  .3 -50 5  .3 50 5  -50 50 5 ]",
        moving_between, CAMERA_ERROR);
}

/* --- a texture's squares ------------------------------------------------------------------------------------------------- */

/* u = (x + 4) / 8 is seen as 4u + 0.3, v = (y + 4) / 8 as 2v - 0.7: squares of 2 by 4 pixels, white where the sum of their numbers
 * is odd. */
static double squares(int x, int y)
{
    enum { FINE = 400 };
    int odd = 0;
    for (int j = 0; j < FINE; j++)
        for (int i = 0; i < FINE; i++) {
            double u = (x + (i + 0.5) / FINE) / 8.0, v = 1.0 - (y + (j + 0.5) / FINE) / 8.0;
            odd += ((int)floor(4.0 * u + 0.3) + (int)floor(2.0 * v - 0.7)) & 1;
        }
    return (double)odd / (FINE * FINE);
}

/* Under a white sky a diffuse plane has its reflectance's radiance, without noise. */
static void texture_offsets(void **state)
{
    (void)state;
    check_image(HEAD(BOX, "") "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
                              "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" 4 \"float udelta\" .3 \"float "
                              "vscale\" 2 \"float vdelta\" -.7 "
                              "\"rgb tex1\" [ 0 0 0 ] \"rgb tex2\" [ 1 1 1 ]\n"
                              "Material \"diffuse\" \"texture reflectance\" \"t\" " QUAD
                              "[ -4 -4 5  4 -4 5  4 4 5  -4 4 5 ]",
                squares, SOBOL_ERROR);
}

/* --- light that gets through --------------------------------------------------------------------------------------------- */

static double glow_through(int x, int y) { return (void)y, x < 4 ? 0.7 : 1.0; }

/* A black sheet of alpha 0.3 over the left half, the light behind it. */
static void half_transparent_to_the_eye(void **state)
{
    (void)state;
    check_image(HEAD(BOX, "") BLACK "AttributeBegin " GLOW QUAD "[ -50 -50 9  50 -50 9  50 50 9  -50 50 9 ] AttributeEnd\n"
                                    "Shape \"trianglemesh\" \"float alpha\" .3 \"integer indices\" [ 0 2 1 0 3 2 ] "
                                    "\"point3 P\" [ -50 -50 5  0 -50 5  0 50 5  -50 50 5 ]",
                glow_through, CHANCE_ERROR);
}

/* Parallel light along +z with the irradiance π: a white plane facing it has the radiance 1. */
#define SUN \
    "LightSource \"distant\" \"point3 from\" [ 0 0 0 ] \"point3 to\" [ 0 0 1 ] \"rgb L\" [ 3.14159265 3.14159265 " \
    "3.14159265 ]\n"
#define FLOOR WHITE QUAD "[ -50 -50 5  50 -50 5  50 50 5  -50 50 5 ]\n"

/* The sheet is behind the camera, so only shadow rays meet it. */
static void half_transparent_to_light(void **state)
{
    (void)state;
    check_image(HEAD(BOX, "") SUN FLOOR "Shape \"trianglemesh\" \"float alpha\" .3 \"integer indices\" [ 0 2 1 0 3 2 ] "
                                        "\"point3 P\" [ -50 -50 -5  0 -50 -5  0 50 -5  -50 50 -5 ]",
                glow_through, CHANCE_ERROR);
}

/* At time t the shadow reaches from the left to x = -3 + 6t: pixel column x is lit while it has not come. */
static double lit_share(int x, int y)
{
    double from = x - 4.0, mean = 0.0;
    (void)y;
    for (int i = 0; i < 1000; i++)
        mean += fmin(1.0, fmax(0.0, (from + (i + 0.5) / 1000.0 + 3.0) / 6.0)) / 1000.0;
    return mean;
}

static void moving_shadow(void **state)
{
    (void)state;
    check_image(
        HEAD(BOX, "") SUN FLOOR BLACK
        "ActiveTransform StartTime Translate -3 0 0 ActiveTransform EndTime Translate 3 0 0 ActiveTransform All " QUAD
        "[ -50 -50 -5  0 -50 -5  0 50 -5  -50 50 -5 ]",
        lit_share, CHANCE_ERROR);
}

/* --- lamps with an alpha mask ----------------------------------------------------------------------------------------------- */

/* Of a lamp of area 4 and radiance 1e4 π / 4 that is 100 above the floor: cos⁴. */
static double lamp_light(int x, int y)
{
    double dx = x - 3.5, dy = 3.5 - y, cos2 = 1e4 / (1e4 + dx * dx + dy * dy);
    return cos2 * cos2;
}
static double three_tenths_of_it(int x, int y) { return 0.3 * lamp_light(x, y); }
static double half_of_it(int x, int y) { return 0.5 * lamp_light(x, y); }
/* Of a lamp with two sides: the inner far side shines through the near one. */
static double both_sides_of_it(int x, int y) { return (0.3 + 0.7 * 0.3) * lamp_light(x, y); }
static double all(int x, int y) { return (void)x, (void)y, 1.0; }
static double three_tenths(int x, int y) { return (void)x, (void)y, 0.3; }

/* What a mask takes away does not shine; but a lamp of alpha 0 all over is one that shines unseen, as in pbrt-v4. Small lamps are met
 * by samples of the lamp only, a sphere around everything by those of the BSDF, too. */
static void masked_lamps(void **state)
{
    (void)state;
    static const char *const small[] = {
        QUAD "[ -1 -1 -95  1 -1 -95  1 1 -95  -1 1 -95 ]",
        "Translate 0 0 -95 Shape \"disk\" \"float radius\" 1.128379167",
    };
    static const char *const half = "Texture \"half\" \"float\" \"checkerboard\" \"float uscale\" 2 \"float vscale\" 0\n";
    static const struct {
        const char *alpha;
        expected_at *small, *around;
    } masks[] = {{"\"float alpha\" .3", three_tenths_of_it, three_tenths},
                 {"\"float alpha\" 0", lamp_light, all},
                 {"\"texture alpha\" \"half\"", half_of_it, NULL}};
    for (size_t k = 0; k < sizeof masks / sizeof *masks; k++) {
        char text[1500];
        for (size_t i = 0; i < sizeof small / sizeof *small; i++) {
            snprintf(text, sizeof text,
                     HEAD(BOX, "") "%s" FLOOR BLACK "AreaLightSource \"diffuse\" \"rgb L\" [ 7853.98 7853.98 7853.98 ] "
                                   "\"bool twosided\" true %s %s",
                     half, small[i], masks[k].alpha);
            check_image(text, masks[k].small, CHANCE_ERROR);
        }
        snprintf(text, sizeof text,
                 HEAD(BOX, "") FLOOR BLACK "ReverseOrientation " GLOW "Shape \"sphere\" \"float radius\" 100 %s",
                 masks[k].alpha);
        if (masks[k].around)
            check_image(text, masks[k].around, CHANCE_ERROR);
    }
    check_image(HEAD(BOX, "") FLOOR BLACK
                "AreaLightSource \"diffuse\" \"rgb L\" [ 7853.98 7853.98 7853.98 ] \"bool twosided\" true "
                "Translate 0 0 -95 Shape \"sphere\" \"float radius\" 1.128379167 \"float alpha\" .3",
                both_sides_of_it, CHANCE_ERROR);
}

/* --- media around what lets rays through ------------------------------------------------------------------------------- */

#define FOG \
    " MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ .1 .1 .1 ] \"rgb sigma_s\" [ 0 0 0 ] "
#define CARD(z) QUAD "[ -9 -9 " z " 9 -9 " z " 9 9 " z " -9 9 " z " ] "
static double fog_of_8(int x, int y) { return (void)x, (void)y, exp(-0.8); }
static double half(int x, int y) { return (void)x, (void)y, 0.5; }
static double half_of_fog_of_8(int x, int y) { return (void)x, (void)y, 0.5 * exp(-0.8); }
static double half_of_fog_of_3(int x, int y) { return (void)x, (void)y, 0.5 * exp(-0.3); }

/* The medium is also before a card that a ray passes through. What is mixed with an interface borders on another medium where it lets
 * rays through; what an alpha of the shape lets through keeps its medium. */
static void media_behind_masks(void **state)
{
    (void)state;
    static const char *const in_fog = FOG "MediumInterface \"\" \"fog\"", *const lamp = GLOW CARD("8");
    static const char *const mixed = "MakeNamedMaterial \"none\" \"string type\" \"interface\" "
                                     "MakeNamedMaterial \"black\" \"string type\" \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] "
                                     "Material \"mix\" \"string materials\" [ \"none\" \"black\" ] ";
    static const char *const to_fog = "AttributeBegin MediumInterface \"fog\" \"\" ", *const end = " AttributeEnd ";
    const struct {
        const char *camera, *world[5];
        expected_at *expected;
    } cases[] = {
        {in_fog, {BLACK CARD("3") "\"float alpha\" 0 ", lamp}, fog_of_8},
        {in_fog, {BLACK CARD("3") "\"float alpha\" .5 ", lamp}, half_of_fog_of_8},
        {FOG, {to_fog, mixed, CARD("5"), end, lamp}, half_of_fog_of_3},
        {FOG, {to_fog, BLACK CARD("5"), "\"float alpha\" .5", end, lamp}, half},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[2500];
        int n = snprintf(text, sizeof text, HEAD(BOX, "%s"), cases[i].camera);
        for (int k = 0; k < 5 && cases[i].world[k]; k++)
            n += snprintf(text + n, sizeof text - (size_t)n, "%s", cases[i].world[k]);
        check_image(text, cases[i].expected, CHANCE_ERROR);
    }
}

/* --- surfaces at one place, or nearly -------------------------------------------------------------------------------------- */

#define WIDE(z) QUAD "[ -90 -90 " z " 90 -90 " z " 90 90 " z " -90 90 " z " ] "
#define THICK_FOG \
    " MakeNamedMedium \"thick\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 50 50 50 ] \"rgb sigma_s\" [ 0 0 0 ] "
#define ENTRY(medium, z) "AttributeBegin Material \"interface\" MediumInterface \"" medium "\" \"\" " WIDE(z) "AttributeEnd "
#define EXIT(medium, z) "AttributeBegin Material \"interface\" MediumInterface \"\" \"" medium "\" " WIDE(z) "AttributeEnd "
#define LAMP(z, more) "AttributeBegin " BLACK GLOW WIDE(z) more "AttributeEnd "
static double fog_of_5(int x, int y) { return (void)x, (void)y, exp(-0.5); }
static double fog_of_5_tilted(int x, int y) { return (void)x, (void)y, exp(-0.5 / cos(0.6)); }
static double fog_of_5_twice(int x, int y) { return (void)x, (void)y, exp(-1.0); }
static double quarter(int x, int y) { return (void)x, (void)y, 0.25; }
static double two(int x, int y) { return (void)x, (void)y, 2.0; }

/* Fog ends where a lamp or a floor is, or where other fog begins; masked cards lie on another, and so do unmasked ones. In the file
 * either comes first, and what is thin is far away. */
static void surfaces_at_one_place(void **state)
{
    (void)state;
    static const char *const tilt = "Rotate 34.37746771 1 2 0 "; /* 0.6 */
    const struct {
        const char *world[7];
        expected_at *expected;
    } cases[] = {
        {{ENTRY("fog", "3"), EXIT("fog", "8"), LAMP("8", "")}, fog_of_5},
        {{LAMP("8", ""), ENTRY("fog", "3"), EXIT("fog", "8")}, fog_of_5},
        {{tilt, ENTRY("fog", "3"), EXIT("fog", "8"), LAMP("8", "")}, fog_of_5_tilted},
        {{tilt, LAMP("8", ""), ENTRY("fog", "3"), EXIT("fog", "8")}, fog_of_5_tilted},
        {{ENTRY("fog", "3"), EXIT("fog", "8"), SUN, WHITE, WIDE("8")}, fog_of_5_twice},
        {{SUN, WHITE, WIDE("8"), ENTRY("fog", "3"), EXIT("fog", "8")}, fog_of_5_twice},
        {{ENTRY("fog", "3"), EXIT("fog", "5"), ENTRY("fog", "5"), EXIT("fog", "8"), LAMP("9", "")}, fog_of_5},
        {{EXIT("fog", "8"), ENTRY("fog", "5"), EXIT("fog", "5"), ENTRY("fog", "3"), LAMP("9", "")}, fog_of_5},
        {{ENTRY("fog", "-8"), EXIT("fog", "-5"), ENTRY("fog", "-5"), EXIT("fog", "-3"), SUN, FLOOR}, fog_of_5},
        {{ENTRY("fog", "-5"), EXIT("fog", "-5"), EXIT("fog", "-3"), ENTRY("fog", "-8"), SUN, FLOOR}, fog_of_5},
        {{ENTRY("thick", "1000"), EXIT("thick", "1000.01"), LAMP("1001", "")}, fog_of_5},
        {{BLACK, WIDE("1000") "\"float alpha\" .5 ", WIDE("1000.0005") "\"float alpha\" .5 ", LAMP("1001", "")}, quarter},
        {{LAMP("7", ""), "AttributeBegin " BLACK "AreaLightSource \"diffuse\" \"rgb L\" [ 3 3 3 ] ",
          WIDE("6.999998") "\"float alpha\" .5 AttributeEnd "},
         two},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[5000];
        int n = snprintf(text, sizeof text, HEAD(BOX, FOG THICK_FOG));
        for (int k = 0; k < 7 && cases[i].world[k]; k++)
            n += snprintf(text + n, sizeof text - (size_t)n, "%s", cases[i].world[k]);
        check_image(text, cases[i].expected, 2.0 * CHANCE_ERROR);
    }
}

/* --- normals of sheared instances ---------------------------------------------------------------------------------------- */

/* z' = z + x / 2 tilts the plane: its normal is (-1/2, 0, 1) whatever the matrix does to other vectors, so cos² = 4/5. The same with
 * the normal given at the vertices. */
static double tilted(int x, int y) { return (void)x, (void)y, sqrt(0.8); }

static void sheared_instances(void **state)
{
    (void)state;
    static const char *const normals[2] = {"", "\"normal N\" [ 0 0 -1  0 0 -1  0 0 -1  0 0 -1 ]"};
    for (int i = 0; i < 2; i++) {
        char text[1500];
        snprintf(text, sizeof text,
                 HEAD(BOX, "") SUN WHITE
                 "ObjectBegin \"o\" Shape \"trianglemesh\" %s \"integer indices\" [ 0 2 1 0 3 2 ] "
                 "\"point3 P\" [ -6 -6 0  6 -6 0  6 6 0  -6 6 0 ] ObjectEnd\n"
                 "Translate 0 0 9 Transform [ 1 0 .5 0  0 1 0 0  0 0 1 0  0 0 9 1 ] ObjectInstance \"o\"",
                 normals[i]);
        check_image(text, tilted, 1e-4);
    }
}

/* --- shadow rays reach their light --------------------------------------------------------------------------------------- */

static double dark(int x, int y) { return (void)x, (void)y, 0.0; }

/* A shutter five millionths of the way before the light keeps all of it back: from a point 100 above the floor and from a lamp there,
 * and a sun's however far away it is. */
static void shadows_of_what_is_close_to_the_light(void **state)
{
    (void)state;
#define SHUTTER(z) BLACK QUAD "[ -50 -50 " z "  50 -50 " z "  50 50 " z "  -50 50 " z " ]\n"
    check_image(HEAD(BOX, "")
                    FLOOR SHUTTER("-94.9995") "LightSource \"point\" \"rgb I\" [ 1e4 1e4 1e4 ] \"point3 from\" [ 0 0 -95 ]",
                dark, 0.0);
    check_image(HEAD(BOX, "") FLOOR SHUTTER("-94.9995") BLACK
                "AreaLightSource \"diffuse\" \"rgb L\" [ 1e4 1e4 1e4 ] \"bool twosided\" true " QUAD
                "[ -1 -1 -95  1 -1 -95  1 1 -95  -1 1 -95 ]",
                dark, 0.0);
    check_image(HEAD(BOX, "") FLOOR SUN SHUTTER("-1e6"), dark, 0.0);
}

/* The image of a stretched sky where pbrt-v4 looks it up: at the direction that the inverse transform gives. */
static double sky_at(const struct pt_image_map *map, double x, double y, double z)
{
    const double l[3] = {x, y - 0.5 * z, z / 3}, len = sqrt(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]);
    double turn = atan2(l[1], l[0]) / (2 * BASE_PI);
    int32_t column = (int32_t)((turn < 0 ? turn + 1 : turn) * map->width),
            row = (int32_t)(acos(l[2] / len) / BASE_PI * map->height);
    column = column < map->width ? column : map->width - 1;
    row = row < map->height ? row : map->height - 1;
    return (double)((const float *)map->pixels)[3 * (row * map->width + column) + 1];
}

/* From a file: pictures are read from the disk only. `format` has a %s for the folder of this tree. */
static struct pt_scene *scene_of_file(const char *format, struct pt_scene_defaults *defaults)
{
    char path[] = "/tmp/pt_closed_forms_XXXXXX", here[2048];
    int fd = mkstemp(path);
    FILE *file = fd >= 0 ? fdopen(fd, "w") : NULL;
    struct base_err err = {0};
    struct pt_scene *scene = NULL;
    assert_true(file && getcwd(here, sizeof here));
    fprintf(file, format, here);
    assert_int_equal(fclose(file), 0);
    int rc = pt_scene_load(path, NULL, &scene, defaults, &err);
    unlink(path);
    if (rc)
        fail_msg("%s", err.text);
    return scene;
}

/* A white floor under a sky that is stretched and sheared: ∫ L cos θ / π over the half of directions before it. */
static void stretched_sky(void **state)
{
    (void)state;
    enum { STEPS = 1000 };
    struct pt_scene_defaults defaults;
    struct pt_scene *scene = scene_of_file(
        HEAD(BOX, "") "AttributeBegin ConcatTransform [ 1 0 0 0 0 1 0 0 0 1.5 3 0 0 0 0 1 ] LightSource \"infinite\" "
                      "\"string filename\" \"%s/scenes/textures/evening.pfm\" AttributeEnd " WHITE QUAD
                      "[ -9 -9 1 9 -9 1 9 9 1 -9 9 1 ]",
        &defaults);
    double want = 0.0;
    for (int i = 0; i < STEPS; i++)
        for (int k = 0; k < STEPS; k++) { /* even over the disk that the floor sees */
            double r2 = (i + 0.5) / STEPS, phi = 2 * BASE_PI * (k + 0.5) / STEPS;
            want += sky_at(&scene->images[scene->lights[0].image], sqrt(r2) * cos(phi), sqrt(r2) * sin(phi), -sqrt(1 - r2)) /
                    STEPS / STEPS;
        }
    defaults.integrator.sampler = PT_SAMPLER_SOBOL;
    double got = pixel_mean(scene, &defaults.integrator, 3, 3);
    printf("# figure stretched sky: %.5f instead of %.5f\n", got, want);
    assert_true(fabs(got - want) < 0.01 * want); /* of 4096 points, half of them chosen by the image */
    pt_scene_destroy(scene);
}

/* Of a lamp with an image, which is not followed, the light is that of all of it: its mean, and its "power". */
static void lamps_with_images(void **state)
{
    (void)state;
#define PICTURED(more) \
    HEAD(BOX, "") \
    "AreaLightSource \"diffuse\" \"float scale\" 3 \"string filename\" \"%s/scenes/textures/evening.pfm\" " more QUAD \
    "[ -9 -9 1 9 -9 1 9 9 1 -9 9 1 ]"
    struct pt_scene_defaults defaults;
    struct pt_scene *scene = scene_of_file(PICTURED(""), &defaults);
    const struct pt_image_map *map = &scene->images[0];
    double mean[3] = {0};
    for (int32_t i = 0; i < 3 * map->width * map->height; i++)
        mean[i % 3] += 3 * (double)((const float *)map->pixels)[i] / map->width / map->height;
    pt_vec3 light = scene->lights[0].emission;
    assert_true(fabs((double)light.x / mean[0] - 1) < 1e-5 && fabs((double)light.z / mean[2] - 1) < 1e-5);
    pt_scene_destroy(scene);
    scene = scene_of_file(PICTURED("\"float power\" 50 "), &defaults);
    pt_vec3 powered = scene->lights[0].emission;
    assert_true(fabs((double)v3_luminance(powered) * BASE_PI * 18 * 18 / (3 * 50) - 1) < 1e-5);
    assert_true(fabs((double)(powered.x / powered.z) / (mean[0] / mean[2]) - 1) < 1e-5);
    pt_scene_destroy(scene);
}

/* --- bent normals ---------------------------------------------------------------------------------------------------------- */

static double white(int x, int y) { return (void)x, (void)y, 1.0; }

/* Whatever the normals say, lamps behind an opaque floor do not shine on its front, and of a sky all around nothing is lost: by the
 * general kernel and by that of diffuse scenes, which give the same bits. */
static void floors_with_bent_normals_are_opaque(void **state)
{
    (void)state;
#define BENT \
    WHITE "Shape \"trianglemesh\" \"integer indices\" [ 0 2 1 0 3 2 ] \"point3 P\" [ -50 -50 5  50 -50 5  50 50 5  -50 50 " \
          "5 ] " \
          "\"normal N\" [ 0 .8660254 -.5  0 .8660254 -.5  0 .8660254 -.5  0 .8660254 -.5 ]\n"
#define LAMP_OF(shape) "AttributeBegin " BLACK GLOW "\"bool twosided\" true " shape " AttributeEnd\n"
    static const struct {
        const char *text;
        expected_at *expected;
        double tolerance;
    } cases[] = {
        {HEAD(BOX, "") BENT "LightSource \"point\" \"point3 from\" [ 0 3 9 ] \"rgb I\" [ 99 99 99 ]", dark, 0.0},
        {HEAD(BOX, "") BENT LAMP_OF(QUAD "[ -9 -9 9  9 -9 9  9 9 9  -9 9 9 ]"), dark, 0.0},
        {HEAD(BOX, "") BENT "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]", white, CHANCE_ERROR},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct pt_scene_defaults defaults;
        check_image(cases[k].text, cases[k].expected, cases[k].tolerance);
        struct pt_scene *scene = text_scene(cases[k].text, &defaults, NULL);
        for (uint32_t s = 0; s < 64; s++) {
            struct pt_path_result one[SIZE], other[SIZE];
            pt_kernel_select(scene->effects, NULL, NULL)(scene, &defaults.integrator, 0, s % SIZE, SIZE, s, one);
            pt_kernel_select(PT_FX_ALL, NULL, NULL)(scene, &defaults.integrator, 0, s % SIZE, SIZE, s, other);
            for (int x = 0; x < SIZE; x++)
                assert_memory_equal(&one[x].radiance, &other[x].radiance, sizeof one[x].radiance);
        }
        pt_scene_destroy(scene);
    }
}

/* --- coats --------------------------------------------------------------------------------------------------------------- */

/* Before a white sky: a coat whose thickness is a texture is as one whose thickness is that number, and a clear one over white, in
 * which light may be reflected as often as it likes, loses nothing. */
static void coats_by_texture_and_depth(void **state)
{
    (void)state;
#define ONES "\"float v00\" 1 \"float v01\" 1 \"float v10\" 1 \"float v11\" 1 "
#define COAT \
    "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ] Texture \"one\" \"float\" \"bilerp\" " ONES \
    "Material \"coateddiffuse\" \"rgb reflectance\" [ 1 1 1 ] "
#define SHEET QUAD "[ -50 -50 5  50 -50 5  50 50 5  -50 50 5 ]"
    static const char *const thick[2][2] = {
        {HEAD(BOX, "") COAT "\"float roughness\" .3 \"float thickness\" 1 " SHEET,
         HEAD(BOX, "") COAT "\"float roughness\" .3 \"texture thickness\" \"one\" " SHEET},
        {HEAD(BOX, "") COAT "\"float thickness\" 1 " SHEET, HEAD(BOX, "") COAT "\"texture thickness\" \"one\" " SHEET}};
    for (int i = 0; i < 2; i++) {
        double mean[2];
        for (int k = 0; k < 2; k++) {
            struct pt_scene_defaults defaults;
            struct pt_scene *scene = text_scene(thick[i][k], &defaults, NULL);
            mean[k] = pixel_mean(scene, &defaults.integrator, 3, 3);
            pt_scene_destroy(scene);
        }
        if (!(fabs(mean[0] - mean[1]) < CHANCE_ERROR))
            fail_msg("thickness by number: %g, by texture: %g (%d)", mean[0], mean[1], i);
    }
    check_image(HEAD(BOX, "") COAT "\"float thickness\" 0 \"integer maxdepth\" 1000 " SHEET, white, CHANCE_ERROR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edges),
        cmocka_unit_test(unsharp_and_moving_edges),
        cmocka_unit_test(texture_offsets),
        cmocka_unit_test(half_transparent_to_the_eye),
        cmocka_unit_test(half_transparent_to_light),
        cmocka_unit_test(moving_shadow),
        cmocka_unit_test(masked_lamps),
        cmocka_unit_test(media_behind_masks),
        cmocka_unit_test(surfaces_at_one_place),
        cmocka_unit_test(sheared_instances),
        cmocka_unit_test(shadows_of_what_is_close_to_the_light),
        cmocka_unit_test(lamps_with_images),
        cmocka_unit_test(coats_by_texture_and_depth),
        cmocka_unit_test(floors_with_bent_normals_are_opaque),
        cmocka_unit_test(stretched_sky),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
