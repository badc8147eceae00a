/* Surfaces at one place: what lets rays through stands on what does not, as if there were a small gap (integ/contact.h). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <math.h>

#include "integ/kernel_sets.h"
#include "support/pt_text_scene.h"

enum { SIZE = 6, SPP = 64, TEXT = 16384 };

/* Straight down on the middle of the plane y = 0; `inverse` undoes the placement of what is seen. */
#define DOWN "LookAt 0 5 0 0 0 0 0 0 1 "
#define UP "LookAt 0 -5 0 0 0 0 0 0 1 "
#define ASLANT "LookAt 3 4 2.5 0 .2 0 0 1 0 "
#define FILM \
    "Film \"rgb\" \"integer xresolution\" 6 \"integer yresolution\" 6 PixelFilter \"box\" Integrator \"path\" \"integer " \
    "maxdepth\" 40\n"
#define SKY "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
#define FLOOR_QUAD \
    "Shape \"trianglemesh\" \"point3 P\" [ -9 0 -9 9 0 -9 9 0 9 -9 0 9 ] \"integer indices\" [ 0 2 1 0 3 2 ]\n"

/* Of chance: a share of .14 of 36 · 256 paths, four standard errors, and of a Sobol sequence less. */
static const double CLOSED_ERROR = 0.015;
/* Of pictures with the same random numbers: a path here and there goes another way. */
static const double GAP_ERROR = 0.006;
/* Where fog ends in the list or on a ray, the numbers are others: four standard errors of 36 · 64 paths. */
static const double FOG_ERROR = 0.02;

static const struct placement {
    const char *name, *forth, *back, *moving; /* moving: at the end of the shutter, of the glass alone */
    int instance;
} placements[] = {
    {"as it is", "", "", "", 0},
    {"moved", "Translate .3 .7 .2", "Translate -.3 -.7 -.2", "", 0},
    {"turned", "Rotate 33 .3 1 .2", "Rotate -33 .3 1 .2", "", 0},
    {"turned far away", "Translate 300 200 -300 Rotate 71 .3 1 .8", "Rotate -71 .3 1 .8 Translate -300 -200 300", "", 0},
    {"an instance", "", "", "", 1},
    {"a turned instance", "Rotate 33 .3 1 .2 Translate .3 .7 .2", "Translate -.3 -.7 -.2 Rotate -33 .3 1 .2", "", 1},
    {"sliding", "", "", "ActiveTransform EndTime Translate .2 0 .3 ActiveTransform All ", 0},
    {"sliding, turned", "Rotate 33 .3 1 .2", "Rotate -33 .3 1 .2",
     "ActiveTransform EndTime Translate .2 0 .3 Rotate 20 0 1 0 ActiveTransform All ", 0},
};
enum { PLACEMENTS = sizeof placements / sizeof *placements };

struct form {
    const char *name, *text; /* %1$g: the height at which it begins */
    int closed;              /* of faces that are parallel to the floor: two, or one that is a sheet; 0: round */
};
#define BOX_CORNERS "\"point3 P\" [ -1 %1$.9g -1  1 %1$.9g -1  1 1 -1  -1 1 -1  -1 %1$.9g 1  1 %1$.9g 1  1 1 1  -1 1 1 ]"
#define SIDE(i) "Shape \"trianglemesh\" " BOX_CORNERS " \"integer indices\" [ " i " ]\n"
#define STANDING "Rotate -90 1 0 0 "
static const struct form forms[] = {
    {"box", SIDE("0 2 1 0 3 2 4 5 6 4 6 7 0 4 7 0 7 3 1 2 6 1 6 5 3 7 6 3 6 2 0 1 5 0 5 4"), 2},
    {"box of six shapes",
     SIDE("0 2 1 0 3 2") SIDE("4 5 6 4 6 7") SIDE("0 4 7 0 7 3") SIDE("1 2 6 1 6 5") SIDE("3 7 6 3 6 2") SIDE("0 1 5 0 5 4"),
     2},
    {"box of patches",
     "Shape \"bilinearmesh\" " BOX_CORNERS " \"integer indices\" [ 0 3 1 2  4 5 7 6  0 4 3 7  1 2 5 6  3 7 2 6  0 1 4 5 ]\n",
     2},
    {"closed cylinder",
     STANDING "Shape \"cylinder\" \"float radius\" 1 \"float zmin\" %1$.9g \"float zmax\" 1\n"
              "Shape \"disk\" \"float height\" 1 \"float radius\" 1\n"
              "ReverseOrientation Shape \"disk\" \"float height\" %1$.9g \"float radius\" 1\n",
     2},
    {"sheet",
     "Shape \"trianglemesh\" \"point3 P\" [ -1 %1$.9g -1 1 %1$.9g -1 1 %1$.9g 1 -1 %1$.9g 1 ] \"integer indices\" "
     "[ 0 2 1 0 3 2 ]\n",
     1},
    {"patch", "Shape \"bilinearmesh\" \"point3 P\" [ -1 %1$.9g -1 1 %1$.9g -1 -1 %1$.9g 1 1 %1$.9g 1 ]\n", 1},
    {"disc", STANDING "Shape \"disk\" \"float height\" %1$.9g \"float radius\" 1\n", 1},
    {"sphere", "Translate 0 %1$.9g 0 Translate 0 .5 0 Shape \"sphere\" \"float radius\" .5\n", 0},
    {"lying cylinder",
     "Translate 0 %1$.9g 0 Translate 0 .5 0 Shape \"cylinder\" \"float radius\" .5 \"float zmin\" -1 "
     "\"float zmax\" 1\n",
     0},
};
enum { FORMS = sizeof forms / sizeof *forms };

static const struct stuff {
    const char *name, *text;
    double closed
        [3]; /* [form's `closed`]: reflectance before a black floor, of faces of .04: F, 2F/(1+F) and 4F/(1+3F); 0: none */
} stuffs[] = {
    {"glass", "Material \"dielectric\" \"float eta\" 1.5\n", {0, 0.04, 0.08 / 1.04}},
    {"thin glass", "Material \"thindielectric\" \"float eta\" 1.5\n", {0, 0.08 / 1.04, 0.16 / 1.12}},
    {"rough glass", "Material \"dielectric\" \"float eta\" 1.5 \"float roughness\" .2\n", {0, 0, 0}},
    {"paper",
     "Material \"diffusetransmission\" \"rgb reflectance\" [ .2 .2 .2 ] \"rgb transmittance\" [ .6 .6 .6 ]\n",
     {0, 0.2, 0}},
    {"absorbing glass",
     "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [ 0 0 0 ] \"rgb sigma_a\" "
     "[ .3 .3 .3 ] MediumInterface \"m\" \"\" Material \"dielectric\" \"float eta\" 1.5\n",
     {0, 0, 0}},
    {"half glass",
     "MakeNamedMaterial \"g\" \"string type\" \"dielectric\" MakeNamedMaterial \"d\" \"string type\" \"diffuse\" "
     "\"rgb reflectance\" [ .5 .5 .5 ] Material \"mix\" \"string materials\" [ \"g\" \"d\" ] \"float amount\" .5\n",
     {0, 0, 0}},
};
enum { STUFFS = sizeof stuffs / sizeof *stuffs };

/* A view of glass (a form with its material) on a floor, placed together. */
static void write_scene(char *text, const char *view, const char *window, const char *lights, const char *floor,
                        const struct form *form, const struct stuff *stuff, const struct placement *at, double gap)
{
    char glass[TEXT / 2];
    int n = snprintf(glass, sizeof glass, "%s%s", at->moving, stuff->text);
    snprintf(glass + n, sizeof glass - (size_t)n, form->text, gap);
    n = snprintf(text, TEXT,
                 FILM "%s %s Camera \"orthographic\" \"float screenwindow\" [ %s ] \"float shutteropen\" 0 "
                      "\"float shutterclose\" 1\nWorldBegin\n%s AttributeBegin\n%s\n%s\nAttributeBegin ",
                 view, at->back, window, lights, at->forth, floor);
    if (at->instance)
        n += snprintf(text + n, TEXT - (size_t)n,
                      "ObjectBegin \"b\" %s ObjectEnd\nAttributeEnd AttributeEnd\nObjectInstance \"b\"\n", glass);
    else
        n += snprintf(text + n, TEXT - (size_t)n, "%s AttributeEnd AttributeEnd\n", glass);
    assert_true(n < TEXT);
}

/* Means over the pixels; *least and *most of single samples, *effects of the scene. */
static double mean_of(const char *text, float *most, pt_effects *effects)
{
    struct pt_scene_defaults defaults;
    struct pt_scene *scene = text_scene(text, &defaults, NULL);
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    double sum = 0.0;
    float peak = 0.0f;
    for (uint32_t s = 0; s < SPP; s++)
        for (uint32_t y = 0; y < SIZE; y++) {
            struct pt_path_result r[SIZE];
            kernel(scene, &defaults.integrator, 0, y, SIZE, s, r);
            for (int x = 0; x < SIZE; x++) {
                sum += (double)r[x].radiance.y;
                peak = fmaxf(peak, r[x].radiance.y);
            }
        }
    if (most)
        *most = peak;
    if (effects)
        *effects = scene->effects;
    pt_scene_destroy(scene);
    return sum / (SIZE * SIZE * SPP);
}

#define BLACK_FLOOR "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] " FLOOR_QUAD
#define GREY_FLOOR "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ] " FLOOR_QUAD

static void black_floor_adds_nothing(void **state)
{
    (void)state;
    static char text[TEXT];
    int bad = 0;
    for (int f = 0; f < FORMS; f++)
        for (int m = 0; m < STUFFS; m++)
            for (int p = 0; p < PLACEMENTS; p++) {
                double want = stuffs[m].closed[forms[f].closed];
                if (want == 0.0)
                    continue;
                write_scene(text, DOWN, "-.4 .4 -.4 .4", SKY, BLACK_FLOOR, &forms[f], &stuffs[m], &placements[p], 0.0);
                double got = mean_of(text, NULL, NULL);
                if (!(fabs(got - want) <= CLOSED_ERROR)) {
                    bad++;
                    print_error("%s of %s, %s: %.4f, not %.4f\n", forms[f].name, stuffs[m].name, placements[p].name, got,
                                want);
                }
            }
    assert_int_equal(bad, 0);
}

static void compare_with_gap(const char *view, const char *window, const char *floor, int sheets)
{
    static char text[TEXT];
    int bad = 0;
    for (int f = 0; f < FORMS; f++)
        for (int m = 0; m < STUFFS; m++)
            for (int p = 0; p < PLACEMENTS; p++) {
                if (forms[f].closed == 1 && !sheets)
                    continue;
                const int far = strstr(placements[p].name, "far") != NULL;
                pt_effects fx;
                write_scene(text, view, window, SKY, floor, &forms[f], &stuffs[m], &placements[p], 0.0);
                double touching = mean_of(text, NULL, &fx);
                if (!(fx & PT_FX_CONTACT)) {
                    bad++;
                    print_error("%s of %s, %s: not known to touch\n", forms[f].name, stuffs[m].name, placements[p].name);
                }
                write_scene(text, view, window, SKY, floor, &forms[f], &stuffs[m], &placements[p], far ? 1e-3 : 1e-4);
                double apart = mean_of(text, NULL, &fx);
                if (fx & PT_FX_CONTACT && forms[f].closed) {
                    bad++;
                    print_error("%s of %s, %s: touches over the gap\n", forms[f].name, stuffs[m].name, placements[p].name);
                }
                if (!(fabs(touching / apart - 1.0) <= GAP_ERROR)) {
                    bad++;
                    print_error("%s of %s, %s: %.4f, with a gap %.4f\n", forms[f].name, stuffs[m].name, placements[p].name,
                                touching, apart);
                }
            }
    assert_int_equal(bad, 0);
}

static void touching_is_a_gap(void **state)
{
    (void)state;
    compare_with_gap(ASLANT, "-1.4 1.4 -1.4 1.4", GREY_FLOOR, 1);
}

static void from_below_too(void **state)
{
    (void)state;
    compare_with_gap(UP, "-1.4 1.4 -1.4 1.4", GREY_FLOOR, 0);
}

#define LAMP_BELOW \
    "AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 AreaLightSource \"diffuse\" \"rgb L\" [ 1e4 1e4 1e4 ] \"bool " \
    "twosided\" true " \
    "Shape \"disk\" \"float radius\" 1 AttributeEnd LightSource \"point\" \"point3 from\" [ 0 -.3 0 ] \"rgb I\" [ 1e4 1e4 " \
    "1e4 ]\n"

static void floor_is_opaque(void **state)
{
    (void)state;
    static char text[TEXT], floor[TEXT];
    int bad = 0;
    for (int f = 0; f < FORMS; f++)
        for (int m = 0; m < STUFFS; m++)
            for (int p = 0; p < PLACEMENTS; p++)
                for (int close = 0; close < 2; close++) {
                    float most;
                    snprintf(floor, sizeof floor, "%s%s", LAMP_BELOW, GREY_FLOOR);
                    write_scene(text, close ? DOWN : ASLANT, close ? "-.02 .02 -.02 .02" : "-1.4 1.4 -1.4 1.4", "", floor,
                                &forms[f], &stuffs[m], &placements[p], 0.0);
                    mean_of(text, &most, NULL);
                    if (most != 0.0f) {
                        bad++;
                        print_error("%s of %s, %s: %g gets through the floor\n", forms[f].name, stuffs[m].name,
                                    placements[p].name, (double)most);
                    }
                }
    assert_int_equal(bad, 0);
}

/* Things in contact that are no form on a floor; %1$g: the gap. */
#define QUAD_XZ(x0, x1, y, z0, z1) \
    "Shape \"trianglemesh\" \"point3 P\" [ " x0 " " y " " z0 "  " x1 " " y " " z0 "  " x1 " " y " " z1 "  " x0 " " y " " z1 \
    " ] \"integer indices\" [ 0 2 1 0 3 2 ]\n"
#define WALL_X(x) \
    "Shape \"trianglemesh\" \"point3 P\" [ " x " 0 -3  " x " 3 -3  " x " 3 3  " x \
    " 0 3 ] \"integer indices\" [ 0 2 1 0 3 2 ]\n"
#define BOX_WITHIN \
    "AttributeBegin Translate 0 .5 0 Scale 2 2 2 Translate 0 -.25 0 Shape \"trianglemesh\" \"point3 P\" [ -%2$.9g %1$.9g " \
    "-%2$.9g  %2$.9g " \
    "%1$.9g -%2$.9g  %2$.9g %2$.9g -%2$.9g  -%2$.9g %2$.9g -%2$.9g  -%2$.9g %1$.9g %2$.9g  %2$.9g %1$.9g %2$.9g  %2$.9g " \
    "%2$.9g " \
    "%2$.9g  -%2$.9g %2$.9g %2$.9g ] \"integer indices\" [ 0 2 1 0 3 2 4 5 6 4 6 7 0 4 7 0 7 3 1 2 6 1 6 5 3 7 6 3 6 2 0 " \
    "1 5 0 " \
    "5 4 ] AttributeEnd\n"
#define GLASS "Material \"dielectric\" \"float eta\" 1.5\n"
#define THIN "Material \"thindielectric\" \"float eta\" 1.5\n"
#define PAPER "Material \"diffusetransmission\" \"rgb reflectance\" [ .2 .2 .2 ] \"rgb transmittance\" [ .6 .6 .6 ]\n"
#define WHITE "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ]\n"
#define TABLE \
    "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 4 4 4 ] " QUAD_XZ( \
        "-1.5", "1.5", "0", "-1.5", "1.5") "AttributeEnd " WHITE QUAD_XZ("-2", "2", "2", "-2", "2")
#define CEILING_VIEW "LookAt 0 1.5 0 0 2 0 0 0 1 "
#define CORNER "LookAt -3 4 -2.5 0 .2 0 0 1 0 "

static const struct arrangement {
    const char *name, *view, *text;
} arrangements[] = {
    {"two sheets on a floor", ASLANT,
     SKY WHITE FLOOR_QUAD THIN QUAD_XZ("-1", "1", "%1$.9g", "-1", "1") PAPER QUAD_XZ("-1", "1", "%3$.9g", "-1", "1")},
    {"glass between walls", ASLANT, SKY WHITE WALL_X("-1") WALL_X("1") GLASS BOX_WITHIN},
    {"glass in a corner", CORNER,
     SKY WHITE FLOOR_QUAD WALL_X("1") "Rotate 90 0 1 0 " WALL_X("-1") "Rotate -90 0 1 0 " GLASS BOX_WITHIN},
    {"glass under a ceiling", UP, SKY WHITE QUAD_XZ("-9", "9", "1", "-9", "9") GLASS BOX_WITHIN},
    {"a block in glass on a floor, from below", UP,
     SKY WHITE FLOOR_QUAD "AttributeBegin " GLASS BOX_WITHIN
                          "AttributeEnd Material \"diffuse\" Translate 0 .05 0 Scale .99 .9 .99 " BOX_WITHIN},
    {"glass that fills a pot", ASLANT,
     SKY WHITE FLOOR_QUAD STANDING
     "Shape \"cylinder\" \"float radius\" .5 \"float zmin\" 0 \"float zmax\" 1.3 " GLASS
     "Translate 0 0 %1$.9g Shape \"cylinder\" \"float radius\" %2$.9g \"float zmin\" 0 \"float zmax\" 1 "
     "Shape \"disk\" \"float height\" 1 \"float radius\" %2$.9g ReverseOrientation "
     "Shape \"disk\" \"float radius\" %2$.9g\n"},
    {"glass on a table that shines", CEILING_VIEW, TABLE GLASS "Scale .5 1 .5 " BOX_WITHIN},
    {"the table itself", ASLANT, TABLE GLASS "Scale .5 1 .5 " BOX_WITHIN},
    {"paper on a table that shines", CEILING_VIEW, TABLE PAPER QUAD_XZ("-1", "1", "%1$.9g", "-1", "1")},
    {"glass on glass on a floor", ASLANT,
     SKY WHITE FLOOR_QUAD GLASS BOX_WITHIN "Material \"dielectric\" \"float eta\" 1.3 "
                                           "Translate 0 1 0 Scale .6 .6 .6 " BOX_WITHIN},
    {"a card with holes on a floor", ASLANT,
     SKY WHITE FLOOR_QUAD "Material \"diffuse\" \"rgb reflectance\" [ .1 .1 .1 ] Shape "
                          "\"trianglemesh\" \"float alpha\" .5 \"point3 P\" [ -1 %1$.9g -1  1 %1$.9g -1  1 %1$.9g 1  -1 "
                          "%1$.9g 1 ] \"integer indices\" "
                          "[ 0 2 1 0 3 2 ]\n"},
    {"paper with holes on a floor", ASLANT,
     SKY WHITE FLOOR_QUAD PAPER "Shape \"trianglemesh\" \"float alpha\" .5 \"point3 P\" [ -1 "
                                "%1$.9g -1  1 %1$.9g -1  1 %1$.9g 1  -1 %1$.9g 1 ] \"integer indices\" [ 0 2 1 0 3 2 ]\n"},
    {"glass in fog on a floor", ASLANT,
     "MakeNamedMedium \"f\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [ 0 0 0 ] \"rgb "
     "sigma_a\" [ .3 .3 .3 ]\n" SKY WHITE FLOOR_QUAD
     "AttributeBegin MediumInterface \"f\" \"\" Material \"interface\" Shape "
     "\"trianglemesh\" \"point3 P\" [ -1.3 0 -1.3  1.3 0 -1.3  1.3 1.4 -1.3  -1.3 1.4 -1.3  -1.3 0 1.3  1.3 0 1.3  1.3 1.4 "
     "1.3  -1.3 1.4 "
     "1.3 ] \"integer indices\" [ 0 2 1 0 3 2 4 5 6 4 6 7 0 4 7 0 7 3 1 2 6 1 6 5 3 7 6 3 6 2 0 1 5 0 5 4 ] AttributeEnd\n"
     "MediumInterface \"\" \"f\" " GLASS BOX_WITHIN},
};
enum { ARRANGEMENTS = sizeof arrangements / sizeof *arrangements };

static void arrangements_are_gaps(void **state)
{
    (void)state;
    static char text[TEXT], format[TEXT];
    int bad = 0;
    for (int k = 0; k < ARRANGEMENTS; k++)
        for (int turned = 0; turned < 2; turned++) {
            const struct placement *at = &placements[turned ? 2 : 0];
            double mean[2];
            pt_effects fx[2];
            for (int apart = 0; apart < 2; apart++) {
                double gap = apart ? 1e-4 : 0.0;
                snprintf(format, sizeof format,
                         FILM "%s %s Camera \"orthographic\" \"float screenwindow\" [ -1.4 1.4 -1.4 1.4 ]\n"
                              "WorldBegin %s\n%s",
                         arrangements[k].view, at->back, at->forth, arrangements[k].text);
                snprintf(text, sizeof text, format, gap, 0.5 - gap, 2.0 * gap);
                mean[apart] = mean_of(text, NULL, &fx[apart]);
            }
            double error = strstr(arrangements[k].text, "interface") ? FOG_ERROR : GAP_ERROR;
            if (!(fabs(mean[0] / mean[1] - 1.0) <= error) || !(fx[0] & PT_FX_CONTACT)) {
                bad++;
                print_error("%s, %s: %.4f, with a gap %.4f\n", arrangements[k].name, at->name, mean[0], mean[1]);
            }
        }
    assert_int_equal(bad, 0);
}

/* What lies side by side, or stands alone, is no contact. */
static void beside_is_not_touching(void **state)
{
    (void)state;
    static const char *const bodies[] = {
        GLASS QUAD_XZ("-1", "1", "0", "-1", "1") WHITE QUAD_XZ("1", "2", "0", "-1", "1"),
        GLASS STANDING
        "Shape \"cylinder\" Shape \"disk\" \"float height\" 1 ReverseOrientation Shape \"disk\" \"float height\" -1\n",
        GLASS "Shape \"sphere\" \"float radius\" .5\n" WHITE QUAD_XZ("-1", "1", "-.6", "-1",
                                                                     "1") "Shape \"sphere\" \"float radius\" 5\n",
        GLASS QUAD_XZ("-1", "1", "0", "-1", "1") WHITE WALL_X("0") WALL_X("1"),
        WHITE QUAD_XZ("-1", "1", "0", "-1", "1") QUAD_XZ("-1", "1", "0", "-1", "1"),
    };
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
        struct pt_scene *scene = world_scene(bodies[i]);
        if (scene->effects & PT_FX_CONTACT)
            fail_msg("touches: %s", bodies[i]);
        pt_scene_destroy(scene);
    }
}

/* Of a mesh whose triangles all overlap, each is near all others: 1e10 pairs. A search of them all ends after minutes. */
static void search_ends(void **state)
{
    (void)state;
    enum { TRIANGLES = 100000, LINE = 80 };
    char *text = malloc((size_t)TRIANGLES * LINE);
    assert_non_null(text);
    int n = sprintf(text, "Material \"diffuse\" Shape \"trianglemesh\" \"float alpha\" .5 \"point3 P\" [");
    for (int i = 0; i < TRIANGLES; i++) {
        const double x = i % 100 * 1e-3, y = i / 100 * 1e-4;
        n += sprintf(text + n, "%g -1 %g 1 %g 0 %g 1 .5\n", x, y, x, y);
    }
    n += sprintf(text + n, "] \"integer indices\" [");
    for (int i = 0; i < 3 * TRIANGLES; i++)
        n += sprintf(text + n, "%d ", i);
    sprintf(text + n, "]");
    alarm(120);
    pt_scene_destroy(world_scene(text));
    alarm(0);
    free(text);
}

static void kernels_agree(void **state)
{
    (void)state;
    static char text[TEXT];
    for (int f = 0; f < FORMS; f++) {
        write_scene(text, ASLANT, "-1.4 1.4 -1.4 1.4", SKY, GREY_FLOOR, &forms[f], &stuffs[f % STUFFS], &placements[2], 0.0);
        struct pt_scene_defaults defaults;
        struct pt_scene *scene = text_scene(text, &defaults, NULL);
        const char *name;
        pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, &name);
        for (uint32_t s = 0; s < SPP; s++) {
            struct pt_path_result a[SIZE], b[SIZE], alone;
            kernel(scene, &defaults.integrator, 0, s % SIZE, SIZE, s, a);
            pt_kernel_all(scene, &defaults.integrator, 0, s % SIZE, SIZE, s, b);
            kernel(scene, &defaults.integrator, s % 5, s % SIZE, 1, s, &alone);
            for (int x = 0; x < SIZE; x++)
                assert_memory_equal(&a[x].radiance, &b[x].radiance, sizeof a[x].radiance);
            assert_memory_equal(&a[s % 5].radiance, &alone.radiance, sizeof alone.radiance);
        }
        pt_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(black_floor_adds_nothing),
        cmocka_unit_test(touching_is_a_gap),
        cmocka_unit_test(from_below_too),
        cmocka_unit_test(floor_is_opaque),
        cmocka_unit_test(arrangements_are_gaps),
        cmocka_unit_test(beside_is_not_touching),
        cmocka_unit_test(search_ends),
        cmocka_unit_test(kernels_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
