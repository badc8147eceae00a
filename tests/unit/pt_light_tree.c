#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "sample/rng.h"
#include "scene/settings.h"
#include "shade/light_select.h"
#include "support/pt_scenes.h"
#include "support/pt_mat34.h"
#include "support/pt_sphere.h"

enum { EMITTERS_MAX = 256, SWEEP = 1 << 15, PLACES = 60 };

static float between(struct pt_rng *rng, float low, float high) { return low + (high - low) * pt_rng_float(rng); }

static pt_vec3 somewhere(struct pt_rng *rng, float size)
{
    return v3(between(rng, -size, size), between(rng, -size, size), between(rng, -size, size));
}

static void add_delta_light(struct pt_scene *s, struct pt_rng *rng, int32_t kind)
{
    struct pt_light light = {.kind = kind,
                             .shape = -1,
                             .image = -1,
                             .emission = {3, 2, 1},
                             .position = somewhere(rng, 4.0f),
                             .direction = pt_sample_sphere(pt_rng_float(rng), pt_rng_float(rng)),
                             .cos_total = 0.6f,
                             .cos_start = 0.8f};
    test_add_light(s, &light);
}

/* Every kind of emitter, of many sizes and powers; two of them in one place, two black, one of infinite power. */
static void build_all_kinds(struct pt_scene *s)
{
    struct pt_rng rng = pt_rng_make(3);
    int32_t black = test_add_diffuse(s, v3_splat(0.0f));
    for (int i = 0; i < 40; i++) {
        float size = powf(10.0f, between(&rng, -3.0f, 0.3f));
        pt_vec3 p = somewhere(&rng, 4.0f), a = v3_scale(somewhere(&rng, 1.0f), size),
                b = v3_scale(somewhere(&rng, 1.0f), size);
        float power = i == 7 ? INFINITY : i == 8 ? 0.0f : powf(10.0f, between(&rng, -2.0f, 2.0f));
        int32_t quad = test_add_quad(s, black, p, a, b);
        test_add_area_light(s, quad, v3_splat(power), i % 3 == 0);
        if (i == 5)
            test_add_area_light(s, test_add_quad(s, black, p, a, b), v3_splat(power), 0);
    }
    for (int i = 0; i < 6; i++) {
        int32_t id = test_add_sphere(s, black, somewhere(&rng, 4.0f), between(&rng, 0.01f, 0.6f));
        struct pt_quadric *q = &s->quadrics[s->shapes[id].data];
        if (i == 1)
            *q = (struct pt_quadric){
                .kind = PT_QUADRIC_DISK, .radius = 0.7f, .phi_max = 6.2831853f, .to_render = q->to_render};
        for (int k = 0; k < 3; k++)
            q->to_render.m[4 * k + 2] *= i > 1 ? 1.7f : 1.0f;
        assert_int_equal(pt_mat34_invert(&q->to_render, &q->from_render), 1);
        s->shapes[id].flip_normal = i == 4;
        test_add_area_light(s, id, v3_splat(i == 5 ? 0.0f : 4.0f), i == 3);
    }
    add_delta_light(s, &rng, PT_LIGHT_POINT);
    add_delta_light(s, &rng, PT_LIGHT_SPOT);
    add_delta_light(s, &rng, PT_LIGHT_DISTANT);
    add_delta_light(s, &rng, PT_LIGHT_DISTANT);
}

/* Receivers of every kind, near lamps and far from all of them, on lamps too. */
static struct pt_receiver receiver(const struct pt_scene *s, struct pt_rng *rng, int i)
{
    struct pt_receiver at = {.kind = i % 3};
    at.p = somewhere(rng, i % 5 == 0 ? 100.0f : 5.0f);
    if (i % 7 == 0)
        at.p = s->emitters[i % s->emitter_count].p0;
    if (at.kind != PT_RECEIVER_VOLUME)
        at.n = pt_sample_sphere(pt_rng_float(rng), pt_rng_float(rng));
    return at;
}

static void run(void (*check)(const struct pt_scene *s, const struct pt_receiver *at))
{
    struct pt_scene scene;
    struct pt_rng rng = pt_rng_make(17);
    test_scene_begin(&scene);
    build_all_kinds(&scene);
    test_scene_finish(&scene);
    assert_non_null(scene.light_tree);
    assert_true(scene.emitter_count <= EMITTERS_MAX);
    for (int i = 0; i < PLACES; i++) {
        struct pt_receiver at = receiver(&scene, &rng, i);
        check(&scene, &at);
    }
    test_scene_end(&scene);
}

/* The interval of numbers that select an emitter is as long as its probability. */
static void check_frequencies(const struct pt_scene *s, const struct pt_receiver *at)
{
    int count[EMITTERS_MAX] = {0}, none = 0;
    for (int i = 0; i < SWEEP; i++) {
        float pmf;
        int32_t e = pt_light_tree_pick(s, at, ((float)i + 0.5f) / SWEEP, &pmf);
        none += e < 0;
        if (e < 0)
            continue;
        int far = s->lights[s->emitters[e].light].kind == PT_LIGHT_DISTANT;
        count[e]++;
        assert_true(pmf > 0.0f);
        assert_true(far ? fabsf(pmf / s->emitters[e].pmf - 1.0f) < 1e-5f
                        : fabsf(pt_light_tree_pmf(s, at, e) / pmf - 1.0f) < 1e-5f);
    }
    for (int e = 0; e < s->emitter_count && !none; e++) {
        int far = s->lights[s->emitters[e].light].kind == PT_LIGHT_DISTANT;
        float p = far ? s->emitters[e].pmf : pt_light_tree_pmf(s, at, e);
        if (fabsf((float)count[e] / SWEEP - p) > 1.5f / SWEEP + 1e-5f)
            fail_msg("emitter %d: %d of %d, probability %g", e, count[e], SWEEP, (double)p);
    }
}

/* What arrives at a receiver can be selected. */
static void check_support(const struct pt_scene *s, const struct pt_receiver *at)
{
    struct pt_rng rng = pt_rng_make(23);
    for (int e = 0; e < s->emitter_count; e++)
        for (int i = 0; i < 50; i++) {
            struct pt_light_sample sample;
            if (!pt_light_sample_emitter(PT_FX_ALL, s, &s->emitters[e], at->p, pt_rng_float(&rng), pt_rng_float(&rng),
                                         &sample))
                continue;
            float cosine = v3_dot(at->n, sample.wi);
            int arrives =
                at->kind == PT_RECEIVER_VOLUME || (at->kind == PT_RECEIVER_SURFACE ? cosine > 0.0f : cosine != 0.0f);
            if (sample.finite && arrives && !v3_is_black(sample.radiance) && !(pt_light_tree_pmf(s, at, e) > 0.0f))
                fail_msg("emitter %d (light of kind %d) is cut off at cosine %g", e, s->lights[s->emitters[e].light].kind,
                         (double)cosine);
        }
}

/* A sheet that faces away and one below the horizon are not selected, the others in proportion to what they send. */
static void lights_are_weighed(void **state)
{
    (void)state;
    struct pt_scene s;
    test_scene_begin(&s);
    int32_t black = test_add_diffuse(&s, v3_splat(0.0f));
    const pt_vec3 places[4] = {{0, 0, 10}, {0, 0, 20}, {0.5f, 0, 10}, {0, 0, -10}};
    for (int i = 0; i < 4; i++) { /* normals towards -z, but for the third */
        pt_vec3 a = v3(0.01f, 0, 0), b = v3(0, 0.01f, 0);
        test_add_area_light(&s, test_add_quad(&s, black, places[i], i == 2 ? a : b, i == 2 ? b : a), v3_splat(1.0f), 0);
    }
    test_scene_finish(&s);
    const struct pt_receiver at = {{0, 0, 0}, {0, 0, 1}, PT_RECEIVER_SURFACE};
    float p[4] = {0};
    for (int e = 0; e < s.emitter_count; e++)
        p[s.emitters[e].light] += pt_light_tree_pmf(&s, &at, e);
    assert_true(p[0] + p[1] > 0.99f && p[2] < 0.01f && p[3] < 0.01f);
    assert_true(p[0] > 2.0f * p[1] && p[0] < 4.5f * p[1]);
    test_scene_end(&s);
}

/* Spots that fade over more than a right angle shine behind themselves, too. */
static void wide_spots_shine_backwards(void **state)
{
    (void)state;
    struct pt_scene s;
    test_scene_begin(&s);
    for (int i = 0; i < 3; i++) {
        struct pt_light spot = {.kind = PT_LIGHT_SPOT,
                                .shape = -1,
                                .image = -1,
                                .emission = {3, 2, 1},
                                .direction = {0, 0, -1},
                                .position = {(float)i, 0, 0},
                                .cos_total = cosf(2.6f),
                                .cos_start = 1.0f};
        test_add_light(&s, &spot);
    }
    test_scene_finish(&s);
    for (float a = 0; a < 2.55f; a += 0.05f) {
        struct pt_receiver at = {{1000 * sinf(a), 0, -1000 * cosf(a)}, {0, 0, 0}, PT_RECEIVER_VOLUME};
        check_support(&s, &at);
    }
    test_scene_end(&s);
}

/* Nine spots, side by side and down: outside of their cones the lamp far above is all that is left, at every level of the
 * hierarchy; inside they are selected. An area light sends as far as a quarter turn from its normal. */
static void cones_end(void **state)
{
    (void)state;
    enum { SPOTS = 9 };
    struct pt_scene s;
    test_scene_begin(&s);
    for (int i = 0; i < SPOTS; i++) {
        struct pt_light spot = {.kind = PT_LIGHT_SPOT,
                                .shape = -1,
                                .image = -1,
                                .emission = {3, 2, 1},
                                .direction = {0, 0, -1},
                                .position = {0.001f * (float)i, 0, 0},
                                .cos_total = cosf(0.6f),
                                .cos_start = cosf(0.2f)};
        test_add_light(&s, &spot);
    }
    struct pt_light lamp = {.kind = PT_LIGHT_POINT, .shape = -1, .image = -1, .emission = {1, 1, 1}, .position = {0, 0, 50}};
    test_add_light(&s, &lamp);
    test_scene_finish(&s);
    for (int degree = 0; degree < 180; degree += 3) {
        float a = (float)degree * PT_PI / 180.0f, spots = 0;
        struct pt_receiver at = {{5 * sinf(a), 0, -5 * cosf(a)}, {0, 0, 0}, PT_RECEIVER_VOLUME};
        for (int e = 0; e < s.emitter_count; e++)
            spots += s.lights[s.emitters[e].light].kind == PT_LIGHT_SPOT ? pt_light_tree_pmf(&s, &at, e) : 0;
        if (fabsf(a - 0.6f) < 0.02f) /* where they end, some slack is allowed */
            continue;
        assert_true(a < 0.6f ? spots > 0.9f : spots == 0.0f);
        for (int i = 0; i < 64; i++) {
            float pmf;
            int32_t e = pt_light_tree_pick(&s, &at, ((float)i + 0.5f) / 64, &pmf);
            assert_true(e >= 0); /* nobody goes where nothing is left */
        }
    }
    test_scene_end(&s);

    test_scene_begin(&s);
    int32_t black = test_add_diffuse(&s, v3_splat(0.0f));
    for (int i = 0; i < 2; i++) /* towards +z */
        test_add_area_light(&s, test_add_quad(&s, black, v3((float)i, 0, 0), v3(0.01f, 0, 0), v3(0, 0.01f, 0)),
                            v3_splat(1.0f), 0);
    test_scene_finish(&s);
    for (int degree = 0; degree < 180; degree += 7) {
        float a = (float)degree * PT_PI / 180.0f, sum = 0;
        struct pt_receiver at = {{50 * sinf(a), 0, 50 * cosf(a)}, {0, 0, 0}, PT_RECEIVER_VOLUME};
        for (int e = 0; e < s.emitter_count; e++)
            sum += pt_light_tree_pmf(&s, &at, e);
        assert_true(degree < 90 ? fabsf(sum - 1.0f) < 1e-5f : sum == 0.0f);
    }
    test_scene_end(&s);

    test_scene_begin(&s); /* narrow and wide in one node: it is as wide as the widest */
    black = test_add_diffuse(&s, v3_splat(0.0f));
    for (int i = 0; i < 12; i++) {
        pt_vec3 p = v3(0.001f * (float)i, 0, 0);
        struct pt_light spot = {.kind = PT_LIGHT_SPOT,
                                .shape = -1,
                                .image = -1,
                                .emission = {3, 2, 1},
                                .direction = {0, 0, 1},
                                .position = p,
                                .cos_total = 0.99f,
                                .cos_start = 0.999f};
        if (i % 2)
            test_add_light(&s, &spot);
        else
            test_add_area_light(&s, test_add_quad(&s, black, p, v3(1e-4f, 0, 0), v3(0, 1e-4f, 0)), v3_splat(1.0f), 0);
    }
    test_scene_finish(&s);
    const struct pt_receiver aside = {{5, 0, 2}, {0, 0, 0}, PT_RECEIVER_VOLUME};
    for (int e = 0; e < s.emitter_count; e++)
        assert_true((pt_light_tree_pmf(&s, &aside, e) > 0.0f) == (s.lights[s.emitters[e].light].kind == PT_LIGHT_AREA));
    test_scene_end(&s);
}

static void power_has_no_hierarchy(void **state)
{
    (void)state;
    struct pt_scene s;
    test_scene_begin(&s);
    build_all_kinds(&s);
    s.light_selection = PT_LIGHT_SELECTION_POWER;
    test_scene_finish(&s);
    assert_null(s.light_tree);
    test_scene_end(&s);
}

static void frequencies_are_probabilities(void **state)
{
    (void)state;
    run(check_frequencies);
}
static void nothing_that_arrives_is_cut_off(void **state)
{
    (void)state;
    run(check_support);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frequencies_are_probabilities),
        cmocka_unit_test(nothing_that_arrives_is_cut_off),
        cmocka_unit_test(lights_are_weighed),
        cmocka_unit_test(wide_spots_shine_backwards),
        cmocka_unit_test(cones_end),
        cmocka_unit_test(power_has_no_hierarchy),
    };
    print_message("seeds 3, 17, 23\n");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
