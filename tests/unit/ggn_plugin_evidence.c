/* What second moments and the surroundings of a small block add to the evidence of `observer`, in closed form, and that its unit
 * is that of `ggn visible` and of labels. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <string.h>
#include <lull/criterion.h>

#include "base/colour.h"
#include "sight/visibility.h"
#include "sight/curve.h"
#include "sight/observer.h"
#include "sight/remaining.h"
#include "plugin/criteria.h"
#include "support/ggn_noise.h"

enum { SIDE = 240, BLOCK = 40, ACROSS = SIDE / BLOCK, BLOCKS = ACROSS * ACROSS, SPP = 200 };

static const double TAPS[3] = {0.569912492, 0.205423697, 0.009620057}; /* of the observer's blur */
static const double POOLING = 1.94, AROUND = 3;                        /* as in observer.c and plugin/observer.c */

static float color[SIDE][SIDE][3], half[SIDE][SIDE][3], moment2[SIDE][SIDE];
static struct lull_block blocks[BLOCKS];

static void grey(int x, int y, double mean, double mean_half, double second)
{
    for (int c = 0; c < 3; c++) {
        color[y][x][c] = (float)mean;
        half[y][x][c] = (float)mean_half;
    }
    moment2[y][x] = (float)second;
}

static void fill(double mean)
{
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++)
            grey(x, y, mean, mean, mean * mean);
}

static double lightness_of(double y)
{
    const double v = fmin(fmax(y, 0), 1);
    return v > 216.0 / 24389 ? 116 * cbrt(v) - 16 : v * 24389 / 27;
}

static double error_of(double r, int pixels) { return (1 + POOLING / sqrt(pixels)) * r / ggn_observer_default.level; }

static int held; /* how often the last instance told that blocks wait for light alone */

static void listen(const struct lull_host *host, int32_t level, const char *text)
{
    (void)host;
    held += level == LULL_LOG_INFO && strstr(text, "go on though no noise is seen");
}

/* Asks `observer` twice about block `id` of a frame of small blocks, or of one block that is all of it. */
static struct lull_decision ask(uint32_t id, int moments, int whole)
{
    const struct lull_criterion *c = &ggn_plugin_observer;
    struct lull_rect rects[BLOCKS];
    struct lull_plane planes[LULL_PLANE_COUNT] = {0};
    struct lull_instance *in = NULL;
    struct lull_decision d = {0};
    uint32_t mask = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF);
    const uint32_t count = whole ? 1 : BLOCKS;

    for (int i = 0; i < BLOCKS; i++) {
        const int x = BLOCK * (i % ACROSS), y = BLOCK * (i / ACROSS), side = whole ? SIDE : BLOCK;
        rects[i] = (struct lull_rect){x, y, x + side, y + side};
        blocks[i] = (struct lull_block){.id = (uint32_t)i,
                                        .x0 = x,
                                        .y0 = y,
                                        .x1 = x + side,
                                        .y1 = y + side,
                                        .spp = SPP,
                                        .half_spp = SPP / 2,
                                        .thread_s = (double)NAN};
    }
    const struct lull_plane of = {.scale = 1,
                                  .type = LULL_TYPE_F32,
                                  .normaliser = LULL_NORM_ONE,
                                  .channels = 3,
                                  .stride_x = sizeof color[0][0],
                                  .stride_y = sizeof color[0],
                                  .stride_c = sizeof(float)};
    planes[LULL_PLANE_COLOR] = planes[LULL_PLANE_HALF] = planes[LULL_PLANE_MOMENT2] = of;
    planes[LULL_PLANE_COLOR].data = color;
    planes[LULL_PLANE_HALF].data = half;
    planes[LULL_PLANE_MOMENT2].data = moments ? moment2 : NULL;
    planes[LULL_PLANE_MOMENT2].channels = 1;
    planes[LULL_PLANE_MOMENT2].stride_x = sizeof(float);
    planes[LULL_PLANE_MOMENT2].stride_y = sizeof moment2[0];
    mask |= moments ? LULL_PLANE_BIT(LULL_PLANE_MOMENT2) : 0;
    const struct lull_frame frame = {.struct_size = sizeof frame,
                                     .width = SIDE,
                                     .height = SIDE,
                                     .blocks = rects,
                                     .block_count = count,
                                     .block_stride = sizeof rects[0],
                                     .planes = mask,
                                     .transfer = LULL_TRANSFER_SRGB,
                                     .exposure = 1,
                                     .rgb_to_xyz = {0, 0, 0, 0.2126729, 0.7151522, 0.0721750}};
    const struct lull_view view = {.struct_size = sizeof view,
                                   .x1 = SIDE,
                                   .y1 = SIDE,
                                   .planes = planes,
                                   .plane_count = LULL_PLANE_COUNT,
                                   .plane_stride = sizeof planes[0],
                                   .all = blocks,
                                   .all_count = count,
                                   .all_stride = sizeof blocks[0],
                                   .elapsed_s = (double)NAN};
    static const struct lull_host host = {.struct_size = sizeof host, .max_workers = 1, .log = listen};
    held = 0;
    assert_int_equal(c->create(&host, NULL, 0, 0, &in, NULL), LULL_OK);
    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    for (int i = 0; i < 2; i++)
        assert_int_equal(c->evaluate(in, &view, &blocks[id], sizeof blocks[0], &d, sizeof d, 1, NULL), LULL_OK);
    c->destroy(in);
    return d;
}

/* r of one pixel of lightness l and deviation d in a black block: l sqrt(24) / 25 is the deviation in each of the 25 windows that
 * hold it. */
static double expected_of_one(double l, double d, int side)
{
    double sum = 0;
    for (int y = -2; y <= 2; y++)
        for (int x = -2; x <= 2; x++)
            sum += 15 * pow(d * TAPS[abs(x)] * TAPS[abs(y)], 6);
    return pow(sum / (side * side), 1.0 / 6) / sqrt(2 + l * sqrt(24) / (side * side));
}

/* A lamp of 1 % of a pixel, hit once by each half: the halves are equal, the pixel is a multiple of what it should be. */
static void two_equal_halves(void **state)
{
    const double bright = 50;
    (void)state;
    for (int hits = 2; hits <= 8; hits += 6) { /* of means 0.5 and 2 */
        const double mean = bright * hits / SPP, deviation = sqrt((mean * bright - mean * mean) / (SPP - 1));
        fill(0);
        grey(20, 20, mean, mean, mean * bright);
        const double one = (lightness_of(mean + deviation) - lightness_of(mean - deviation)) / 2;
        const double two = (lightness_of(mean + 2 * deviation) - lightness_of(mean - 2 * deviation)) / 4;
        struct lull_decision d = ask(0, 1, 0);
        assert_true(hits == 2 || (one == 0 && two > 1)); /* eight hits: one deviation less is still white */
        assert_true(fabs(d.error / error_of(expected_of_one(lightness_of(mean), fmax(one, two), BLOCK), BLOCK * BLOCK) - 1) <
                    1e-4);
        assert_int_equal(d.action, LULL_CONTINUE);
        assert_int_equal(d.flags, 0);
    }
    /* without moments nothing tells of the luck */
    assert_true(ask(0, 0, 0).flags & LULL_DECISION_BAD_INPUT);
}

/* Even light: nothing varies, nothing is believed, though sums of squares were rounded. */
static void even_light(void **state)
{
    (void)state;
    fill(0.3);
    moment2[7][9] *= 1.0000004f; /* of weights whose sum is 1.0000001 */
    struct lull_decision d = ask(0, 1, 0);
    assert_int_equal(d.action, LULL_STOP);
    assert_true(d.error == 0 && d.p_noisy == 0);
}

/* Both witnesses of one noise: Gaussian, so that they agree, and what decides is their root mean square. */
static void gaussian_noise(void **state)
{
    enum { SIZE = 200 };
    static float noise[SIZE * SIZE], variance[SIZE * SIZE];
    static double scratch[5 * 300], texture[4];
    (void)state;
    for (int i = 0; i < SIZE * SIZE; i++) {
        const double d = i % SIZE < SIZE / 2 ? 1.5 : 0.5;
        noise[i] = (float)(d * ggn_noise_gauss((uint32_t)i, 7));
        variance[i] = (float)(d * d);
    }
    const double by_draw = ggn_visible_noise(noise, SIZE, SIZE, texture, scratch, NULL);
    const double expected = ggn_visible_expected(variance, SIZE, SIZE, texture, scratch);
    assert_true(fabs(by_draw / expected - 1) < 0.04); /* four standard errors of the pooling */
    double taps = TAPS[0] * TAPS[0] + 2 * TAPS[1] * TAPS[1] + 2 * TAPS[2] * TAPS[2];
    for (int i = 0; i < SIZE * SIZE; i++)
        variance[i] = 4;
    assert_true(fabs(ggn_visible_expected(variance, SIZE, SIZE, texture, scratch) / (pow(15, 1.0 / 6) * 2 * taps / sqrt(2)) -
                     1) < 1e-6);
    assert_true(fabs(ggn_visible_together(3, 4) - sqrt(0.8 * 9 + 0.2 * 16)) < 1e-12);
}

/* Hits of a pixel in n samples that each hit with probability p: none of the symmetry that halves assume. */
static int hits_of(uint32_t pixel, uint32_t stream, int n, double p)
{
    int hits = 0;
    for (int k = 0; k < n; k++)
        hits += (double)ggn_noise_hash(pixel * 64u + (uint32_t)k, stream) < p * 4294967296.0;
    return hits;
}

/* Rare bright hits, one in sixteen pixels: the error of the mean is skewed, the difference of its halves is not, and is too
 * kind by an eighth. At the default share half of what they stop is off by more than 1.05, and nothing that both witnesses stop. */
static void skewed_noise(void **state)
{
    enum { SIZE = 100, N = 64, DRAWS = 4 };
    static float noise[SIZE * SIZE], error[SIZE * SIZE], variance[SIZE * SIZE];
    static double scratch[5 * 300], texture[1];
    const double base = 0.2, bright = 8, p = 1e-3,
                 limit = ggn_observer_error_at(&ggn_observer_default, GGN_OBSERVER_VISIBLE);
    int off = 0;
    (void)state;
    for (uint32_t draw = 0; draw < DRAWS; draw++) {
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            const int a = hits_of(i, 10 + 2 * draw, N / 2, p), b = hits_of(i, 11 + 2 * draw, N / 2, p);
            const double share = (double)(a + b) / N, mean = base + bright * share;
            const double v = sqrt(bright * bright * share * (1 - share) / (N - 1));
            const double d = (lightness_of(mean + v) - lightness_of(mean - v)) / 2;
            noise[i] = (float)(lightness_of(base + bright * a / (N / 2)) - lightness_of(base + bright * b / (N / 2))) / 2;
            error[i] = (float)(lightness_of(mean) - lightness_of(base + bright * p));
            variance[i] = (float)(d * d);
        }
        const double halves = ggn_visible_noise(noise, SIZE, SIZE, texture, scratch, NULL);
        const double truth = ggn_visible_noise(error, SIZE, SIZE, texture, scratch, NULL);
        const double expected = ggn_visible_expected(variance, SIZE, SIZE, texture, scratch);
        off += limit * truth > 1.05 * halves;
        assert_true(limit * truth < 1.05 * ggn_visible_together(halves, expected));
    }
    assert_true(2 * off >= DRAWS);
}

/* A calm block amid noise that a hundred times as many samples would show in it, too, stops only when its surroundings are
 * below three times the limit; far from them, and if it is large enough to be its own evidence, it stops. */
static void surroundings(void **state)
{
    const uint32_t beside = 0, far = BLOCKS - 1;
    (void)state;
    for (int strong = 0; strong < 2; strong++) {
        fill(0.2);
        for (int y = BLOCK; y < BLOCK + 30; y++)
            for (int x = BLOCK; x < BLOCK + 30; x++) {
                const double luck = (strong ? 0.8 : 0.002) * ((x + y) % 2 ? 1 : -1);
                grey(x, y, 0.2, 0.2 + luck * 0.4, 0.04);
            }
        struct lull_decision near = ask(beside, 0, 0), own = ask(far, 0, 0), whole = ask(0, 0, 1);
        assert_true(own.action == LULL_STOP && own.error == 0);
        assert_int_equal(near.action, strong ? LULL_CONTINUE : LULL_STOP);
        assert_int_equal(whole.action, strong ? LULL_CONTINUE : LULL_STOP);
        assert_true(near.error > 0);
        struct lull_decision noisy = ask(ACROSS + 1, 0, 0);
        assert_true(noisy.error > AROUND * near.error); /* its own, not that of its surroundings */
    }
}

/* Light that may not have been met, in closed form: a small block with a pixel that is white whatever its luck is, since one
 * sample made it 400 times white, waits until such a sample more or less no longer moves the block's mean by a sixth of one
 * L*, and tells so once. A large block, and a host without moments, do not wait. */
static void one_bright_sample(void **state)
{
    const double mean = 0.2, bright = 400, at = 10, pixels = BLOCK * BLOCK;
    (void)state;
    fill(mean);
    grey(5, 5, mean, mean + 1e-3, mean * mean + 1e-5); /* halves that differ */
    grey(20, 20, at, at, at * at + bright * bright / SPP);
    const double shown = (mean * (pixels - 1) + 1) / pixels, slope = 116 / 3.0 * pow(shown, -2.0 / 3);
    const double wanted = sqrt(2.4 * bright / (pixels * (1.0 / 6 / slope) * SPP));
    const struct lull_decision small = ask(0, 1, 0);
    assert_int_equal(held, 1);
    const struct lull_decision whole = ask(0, 1, 1), blind = ask(0, 0, 0);
    assert_int_equal(held, 0);
    assert_int_equal(small.action, LULL_CONTINUE);
    assert_true(fabs(small.error / wanted - 1) < 1e-3);
    assert_true(whole.action == LULL_STOP && whole.error < 0.1);
    assert_true(blind.action == LULL_STOP && blind.error < 0.1);
    grey(20, 20, at, at, at * at + bright / 10 * bright / 10 / SPP); /* a tenth as bright */
    assert_int_equal(ask(0, 1, 0).action, LULL_STOP);
    assert_int_equal(held, 0);
}

/* A pixel with light in one of ten samples touches a black block from outside. The block waits, since its samples may have missed
 * what is left of that light on its side. It does not where it has met some, where it is white anyway, where such noise would
 * not be seen in it, and where the pixel stands further away. */
static void light_beyond_an_edge(void **state)
{
    const double bright = 9, mean = 0.9;
    static const struct {
        int x;
        double strength, inside, second; /* of the pixel beyond the edge; the block's pixels at the edge */
        int action;
    } cases[] = {{BLOCK, 1, 0, 0, LULL_CONTINUE},
                 {BLOCK + 1, 1, 0, 0, LULL_STOP},
                 {BLOCK, 1, 0.01, 1.1e-4, LULL_STOP},
                 {BLOCK, 1, 1.5, 2.25, LULL_STOP},
                 {BLOCK, 0.01, 0.2, 0.04, LULL_STOP}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const double strength = cases[i].strength;
        fill(0);
        for (int y = 0; y < BLOCK; y++)
            grey(BLOCK - 1, y, cases[i].inside, cases[i].inside, cases[i].second);
        grey(5, 5, 0.2, 0.2001, 0.04); /* halves that differ */
        grey(cases[i].x, 20, strength * mean, 0.8 * strength * mean, strength * strength * mean * bright);
        const struct lull_decision d = ask(0, 1, 0);
        assert_int_equal(d.action, cases[i].action);
        assert_true(d.action == LULL_STOP || (d.error > 1.2 && d.error < 3)); /* its own and that beyond */
    }
}

static uint8_t *codes_of(const struct seq_block *b, const struct seq_record *r, struct pic_image *image)
{
    uint8_t *codes = malloc(3 * (size_t)SIDE * SIDE);
    assert_int_equal(seq_display(b, r, codes, NULL), 0);
    *image = (struct pic_image){.width = SIDE, .height = SIDE, .channels = 3, .u8 = codes};
    return codes;
}

/* The planes that a host would show of a recorded level with `variance` of the mean's luminance. */
static void show(const struct seq_block *b, const struct seq_record *level, double variance)
{
    static float mean[3 * SIDE * SIDE], difference[3 * SIDE * SIDE];
    assert_int_equal(seq_halves(b, level, mean, difference, NULL), 0);
    for (size_t i = 0; i < SIDE * SIDE; i++) {
        float *of = color[i / SIDE][i % SIDE];
        for (size_t c = 0; c < 3; c++) {
            of[c] = mean[c * SIDE * SIDE + i];
            half[i / SIDE][i % SIDE][c] = of[c] + difference[c * SIDE * SIDE + i];
        }
        const double y = base_luminance((double)of[0], (double)of[1], (double)of[2]);
        moment2[i / SIDE][i % SIDE] = (float)(y * y + (SPP - 1) * variance);
    }
}

/* One noise in one unit: what two references show of a picture, what the criterion believes of it with either witness, and how
 * many more samples its label asks for, which is the square. */
static void one_unit(void **state)
{
    static const uint32_t level[1] = {SPP};
    struct ggn_noise noise = {SIDE, SIDE, level, 1, 16 * SPP, 0.5, 0.05, 1, 0};
    struct seq_block seen = ggn_noise_block(&noise), other;
    struct pic_image image, reference[2];
    struct ggn_remaining shown;
    struct ggn_curve curve;
    int censored;
    (void)state;
    noise.seed = 2;
    other = ggn_noise_block(&noise);
    uint8_t *codes[3] = {codes_of(&seen, seen.levels, &image), codes_of(&seen, seen.reference, &reference[0]),
                         codes_of(&other, other.reference, &reference[1])};
    const struct pic_image *const references[2] = {&reference[0], &reference[1]};
    assert_int_equal(ggn_remaining(&ggn_observer_default, references, &image, SIDE, &shown, NULL, NULL), 0);
    assert_true(shown.error > 2 && shown.error < 3);
    show(&seen, seen.levels, noise.sigma * noise.sigma / SPP);
    for (int moments = 0; moments < 2; moments++)
        assert_true(fabs(ask(0, moments, 1).error / (1 + POOLING / SIDE) / shown.error - 1) < 0.03); /* of 1 % each */
    assert_int_equal(ggn_curve_make(&seen, GGN_FROM_HALVES, 1, &curve, NULL), 0);
    const double threshold = ggn_curve_threshold(&curve, ggn_observer_default.level, &censored);
    assert_true(!censored && fabs(sqrt(threshold / SPP) / shown.error - 1) < 0.03);
    ggn_curve_release(&curve);
    for (int k = 0; k < 3; k++)
        free(codes[k]);
    seq_block_release(&seen);
    seq_block_release(&other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_equal_halves),     cmocka_unit_test(even_light),   cmocka_unit_test(gaussian_noise),
        cmocka_unit_test(skewed_noise),         cmocka_unit_test(surroundings), cmocka_unit_test(one_bright_sample),
        cmocka_unit_test(light_beyond_an_edge), cmocka_unit_test(one_unit),
    };
    return cmocka_run_group_tests_name("evidence", tests, NULL, NULL);
}
