/*
 * Mirrored scenes: whatever a mirroring transform stands before looks as in a mirror. Outside stays outside, for lamps, glass and media,
 * and a shape that is its own mirror image does not change.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>

#include "geom/accel.h"
#include "integ/surface.h"
#include "sample/rng.h"
#include "shade/light_select.h"
#include "support/pt_sphere.h"
#include "support/pt_text_scene.h"

enum { RAYS = 400 };
/* Distances and directions of order 1 in float, through a transform and back. */
#define ROUNDING 1e-4f

#define OCTAHEDRON \
    "\"point3 P\" [ 1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1 ] " \
    "\"integer indices\" [ 0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5 ]"

/* A whole shape and its own mirror image in x; then shapes that are none. */
static const char *const shapes[] = {
    "Shape \"sphere\"",
    "Shape \"cylinder\"",
    "Shape \"disk\"",
    "Shape \"trianglemesh\" " OCTAHEDRON,
    "Shape \"trianglemesh\" " OCTAHEDRON " \"normal N\" [ 1 0 0 -1 0 0 0 1 0 0 -1 0 0 0 1 0 0 -1 ]",
    "Shape \"loopsubdiv\" \"integer levels\" 2 " OCTAHEDRON,
    "Scale 1 .5 2 Shape \"sphere\"",
    "Shape \"sphere\" \"float zmin\" -.3 \"float zmax\" .8 \"float phimax\" 200",
    "Shape \"cylinder\" \"float zmin\" -.3 \"float phimax\" 130",
    "Shape \"disk\" \"float innerradius\" .4 \"float phimax\" 250 \"float height\" .2",
    "Rotate 40 1 2 3 Scale 1 1 -1.5 Shape \"cylinder\"",
    "Rotate 70 2 1 3 Scale -1 .7 1 Shape \"disk\"",
    "Rotate 70 2 1 3 Scale -1 -1 -1 Shape \"sphere\" \"float zmax\" .5",
    "Translate .3 .2 -.1 ConcatTransform [ .8 .1 0 0 .3 -.9 .2 0 0 0 1.2 0 0 0 0 1 ] Shape \"sphere\"",
    "Translate .3 .2 -.1 Shape \"cone\" \"float radius\" .7 \"float height\" 1",
    "Translate .3 .2 -.1 Shape \"bilinearmesh\" \"point3 P\" [ -1 -1 0 1 -1 .3 -1 1 .2 1 1 0 ]",
};
enum { SHAPES = sizeof shapes / sizeof *shapes, OWN_MIRROR_IMAGES = 7 };

enum place { LAMP, TWO_SIDED_LAMP, IN_OBJECT, INSTANCE, MOVING, PLACES };

static struct pt_scene *scene_of(enum place place, const char *mirror, const char *turn, const char *shape)
{
    static const char *const format[PLACES] = {
        [LAMP] = "AreaLightSource \"diffuse\" %s %s %s",
        [TWO_SIDED_LAMP] = "AreaLightSource \"diffuse\" \"bool twosided\" true %s %s %s",
        [IN_OBJECT] = "ObjectBegin \"o\" %s %s %s ObjectEnd Identity ObjectInstance \"o\"",
        [INSTANCE] = "ObjectBegin \"o\" %s %s ObjectEnd Identity %s ObjectInstance \"o\"",
        [MOVING] = "ActiveTransform EndTime Translate 0 .2 0 ActiveTransform All %s %s %s",
    };
    char text[1200];
    if (place == INSTANCE)
        snprintf(text, sizeof text, format[place], turn, shape, mirror);
    else
        snprintf(text, sizeof text, format[place], mirror, turn, shape);
    return world_scene(text);
}

static pt_vec3 in_mirror(pt_vec3 v) { return v3(-v.x, v.y, v.z); }
static int near(pt_vec3 a, pt_vec3 b) { return v3_len(v3_sub(a, b)) < ROUNDING; }

static int meet(const struct pt_scene *scene, pt_vec3 origin, pt_vec3 direction, struct pt_place *at)
{
    struct pt_ray ray = {origin, direction, 0.0f, INFINITY, 0.5f};
    struct pt_hit hit;
    if (!pt_accel_intersect(scene, &ray, &hit))
        return 0;
    pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, at);
    return 1;
}

static pt_vec3 in_ball(struct pt_rng *rng, float radius)
{
    return v3_scale(pt_sample_sphere(pt_rng_float(rng), pt_rng_float(rng)), radius * pt_rng_float(rng));
}

/* Rays and their mirror images meet a shape and its mirror image at the same distance and from the same side. */
static void compare_hits(const struct pt_scene *plain, const struct pt_scene *mirrored, int own_image, const char *what)
{
    struct pt_rng rng = pt_rng_make(1);
    int met = 0, lost = 0;
    for (int i = 0; i < RAYS; i++) {
        pt_vec3 from = in_ball(&rng, 4.0f), to = in_ball(&rng, 1.0f), d = v3_norm(v3_sub(to, from));
        struct pt_place a, b;
        int found = meet(plain, from, d, &a);
        met += found;
        if (found != meet(mirrored, in_mirror(from), in_mirror(d), &b))
            lost++;
        else if (found && v3_len(v3_sub(a.p, in_mirror(b.p))) > ROUNDING)
            lost++; /* of two surfaces one was missed at its rim */
        else if (found &&
                 (!near(a.s.n_geometric, in_mirror(b.s.n_geometric)) || !near(a.s.n_shading, in_mirror(b.s.n_shading))))
            fail_msg("%s: ray %d meets another side in the mirror", what, i);
        if (own_image && found && meet(mirrored, from, d, &b) && near(a.p, b.p) && !near(a.s.n_geometric, b.s.n_geometric))
            fail_msg("%s: ray %d meets another side of what is its own mirror image", what, i);
    }
    if (met <= RAYS / 20 || lost > RAYS / 50) /* rims and edges */
        fail_msg("%s: %d rays meet it, %d something else in the mirror", what, met, lost);
}

/* The same numbers choose a place on the lamp that is lit or not, from a point and from its mirror image. */
static void compare_lamps(const struct pt_scene *plain, const struct pt_scene *mirrored, const char *what)
{
    struct pt_rng rng = pt_rng_make(2);
    int lit = 0;
    for (int i = 0; i < RAYS; i++) {
        struct pt_light_sample a, b;
        pt_vec3 p = in_ball(&rng, 4.0f);
        const struct pt_receiver at = {p, {0, 0, 0}, PT_RECEIVER_VOLUME},
                                 image = {in_mirror(p), {0, 0, 0}, PT_RECEIVER_VOLUME};
        float pick = pt_rng_float(&rng), u0 = pt_rng_float(&rng), u1 = pt_rng_float(&rng);
        int found = pt_light_sample(PT_FX_ALL, plain, &at, pick, u0, u1, &a);
        lit += found;
        if (found != pt_light_sample(PT_FX_ALL, mirrored, &image, pick, u0, u1, &b))
            fail_msg("%s: sample %d lights one side only of the mirror", what, i);
        if (found && !(fabsf(a.inv_pdf_solid - b.inv_pdf_solid) <= 1e-3f * a.inv_pdf_solid + ROUNDING))
            fail_msg("%s: sample %d has 1/pdf %g and %g", what, i, (double)a.inv_pdf_solid, (double)b.inv_pdf_solid);
    }
    assert_true(lit > RAYS / 20);
}

static void mirrored_shapes(void **state)
{
    (void)state;
    static const char *const turns[] = {"", "ReverseOrientation"};
    for (int shape = 0; shape < SHAPES; shape++)
        for (int turn = 0; turn < 2; turn++)
            for (enum place place = LAMP; place < PLACES; place++) {
                char what[400];
                snprintf(what, sizeof what, "%s %s, place %d", turns[turn], shapes[shape], (int)place);
                struct pt_scene *plain = scene_of(place, "", turns[turn], shapes[shape]),
                                *mirrored = scene_of(place, "Scale -1 1 1", turns[turn], shapes[shape]);
                compare_hits(plain, mirrored, shape < OWN_MIRROR_IMAGES, what);
                if (plain->light_count > 0)
                    compare_lamps(plain, mirrored, what);
                pt_scene_destroy(plain);
                pt_scene_destroy(mirrored);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(mirrored_shapes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
