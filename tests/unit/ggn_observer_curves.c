/* The model observer's curves: thresholds from them, halves against recorded levels, closed forms. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"
#include "support/ggn_observer_block.h"

#include "base/files.h"
#include "train/views.h"
#include "sight/visibility.h"

/* --- thresholds --- */

static void thresholds(void **state)
{
    (void)state;
    double spp[] = {100, 200, 400, 800}, falling[] = {8, 4, 2, 1}, bumpy[] = {1, 0.5, 4, 1}, zero[] = {8, 0, 0, 0};
    struct ggn_curve c = {4, 4, spp, falling};
    int censored;
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 400, 1e-9);
    assert_near(ggn_curve_threshold(&c, sqrt(8.0), &censored), 200 * sqrt(2.0), 1e-9);
    assert_false(censored);
    assert_near(ggn_curve_threshold(&c, 0.5, &censored), 800, 0);
    assert_true(censored);
    assert_near(ggn_curve_threshold(&c, 10, &censored), 100, 0);
    assert_false(censored);
    c.visible = bumpy; /* below at first, visible again at 400: it must stay below */
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 400 * sqrt(2.0), 1e-9);
    c.visible = zero;
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 100 * sqrt(2.0), 1e-9); /* half way where no line can be drawn */
    c.visible = falling;
    assert_near(ggn_curve_at(&c, 400), 2, 1e-12);
    assert_near(ggn_curve_at(&c, 25), 16, 1e-12); /* twice the noise of 100 samples */
    assert_near(ggn_curve_at(&c, 1e4), 1, 0);
    assert_near(ggn_curve_at(&c, 283), sqrt(8.0), 3e-3);
}

static double threshold_of(const struct seq_block *b, const struct ggn_observer *o, enum ggn_curve_source source)
{
    struct ggn_curve c;
    struct base_err err = {0};
    int censored;
    if (ggn_curve_make(b, source, 1, &c, &err) != 0)
        fail_msg("%s", err.text);
    double t = ggn_curve_threshold(&c, o->level, &censored);
    assert_false(censored);
    ggn_curve_release(&c);
    return t;
}

/* Noise that is sigma/sqrt(n) crosses a fixed visibility at n ~ sigma^2, from either source; texture lowers it. */
static void scaling(void **state)
{
    (void)state;
    struct ggn_observer o = {0.33, 0.4};
    double last = 0.0;
    for (int i = 0; i < 3; i++) {
        double sigma = 0.2 * pow(2.0, i);
        struct seq_block b = make_block(sigma, 0.0, (uint32_t)i + 1, 4096);
        double recorded = threshold_of(&b, &o, GGN_FROM_LEVELS), halves = threshold_of(&b, &o, GGN_FROM_HALVES);
        assert_near(log2(halves / recorded), 0.0,
                    0.25); /* far above the limit, noise scatters into the texture of a smooth block */
        if (i > 0)
            assert_near(log2(recorded / last), 2.0, 0.2); /* twice the noise: four times the samples */
        last = recorded;
        seq_block_release(&b);
    }
    struct seq_block busy = make_block(0.8, 0.1, 3, 4096);
    assert_true(threshold_of(&busy, &o, GGN_FROM_LEVELS) < 0.5 * last);
    seq_block_release(&busy);
}

/* A reference of few samples must not raise the threshold: its own noise is taken out of the difference, and is no
 * texture. */
static void noisy_reference(void **state)
{
    (void)state;
    struct ggn_observer o = {0.25, 0.4};
    struct seq_block good = make_block(0.6, 0.0, 5, 1000000), poor = make_block(0.6, 0.0, 5, 1024);
    double a = threshold_of(&good, &o, GGN_FROM_LEVELS), b = threshold_of(&poor, &o, GGN_FROM_LEVELS);
    assert_true(a > 1024);
    assert_near(log2(b / a), 0.0, 0.15);
    seq_block_release(&good);
    seq_block_release(&poor);
}

/* Recorded to 342 spp only, a threshold beyond is found where the full recording puts it. */
static void beyond_the_last_level(void **state)
{
    (void)state;
    struct ggn_observer o = {0.33, 0.4};
    struct ggn_noise n = {W, H, levels, LEVELS, 4096, 0.6, 0.0, 6, 0}, few = {W, H, levels, 8, 4096, 0.6, 0.0, 6, 0};
    struct seq_block all = ggn_noise_block(&n), head = ggn_noise_block(&few);
    double a = threshold_of(&all, &o, GGN_FROM_LEVELS), b = threshold_of(&head, &o, GGN_FROM_LEVELS);
    assert_true(a > 500);
    assert_near(log2(b / a), 0.0, 0.15);
    seq_block_release(&all);
    seq_block_release(&head);
}

/* Thresholds against the block's own level 1730, whose samples are those of the levels: noise of variance sigma^2/n is as
 * visible at k^2 n samples as k sigma at n, whatever the reference. What 2 * 1730 samples would still show is censored. */
static void reference_of_the_same_samples(void **state)
{
    enum { LAST = 11 };
    static const double sigmas[] = {0.15, 0.3, 0.6, 1.2};
    const double least = 1 / (1.0 / levels[LAST - 1] - 1.0 / levels[LAST]);
    struct ggn_observer o = {0.33, 0.4};
    double found[4];
    int censored[4];
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct seq_block b = make_block(sigmas[i], 0.0, 8, 0);
        const struct seq_block whole = b;
        struct seq_record own = b.levels[LAST];
        struct ggn_curve c;
        const double halves = threshold_of(&b, &o, GGN_FROM_HALVES);
        b.reference = &own;
        b.n_levels = LAST + 1;
        assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 0, &c, NULL), 0);
        assert_near(c.spp[c.n - 1], least, 1e-9); /* 1153 and 1730 */
        found[i] = ggn_curve_threshold(&c, o.level, &censored[i]);
        if (censored[i])
            assert_true(found[i] == c.spp[c.n - 1] && halves > 0.8 * least);
        else
            assert_near(log2(found[i] / halves), 0.0, 0.25);
        ggn_curve_release(&c);
        b.n_levels = 1; /* the reference's own */
        b.levels += LAST;
        assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 0, &c, NULL), BASE_EINVAL);
        b = whole;
        seq_block_release(&b);
    }
    assert_true(!censored[0] && !censored[1] && !censored[2] && censored[3]);
    for (int i = 1; i < 3; i++)
        assert_near(log2(found[i] / found[i - 1]), 2.0, 0.25);
}

static void needs(void **state)
{
    (void)state;
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.0, 7, 0);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 1, &c, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "no reference"));
    for (uint32_t l = 0; l < b.n_levels; l++)
        for (uint32_t p = 0; p < b.levels[l].n_planes; p++)
            if (b.levels[l].planes[p].plane == SEQ_PLANE_HALF_F16)
                b.levels[l].n_planes = p;
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "no full level"));
    seq_block_release(&b);
}

/* Visible noise of mean +- scale * d, [3][h][w], in the texture of mean +- d. */
static double seen_by_hand(const float *mean, const float *d, int w, int h, double scale)
{
    const size_t n = (size_t)(w * h);
    float *rgb = malloc(3 * n * sizeof *rgb), *l = malloc(2 * n * sizeof *l);
    double *scratch = malloc(ggn_visibility_scratch(w) * sizeof *scratch), texture[16];
    for (int pass = 0; pass < 2; pass++) {
        for (int side = 0; side < 2; side++) {
            float factor = (float)((side ? -1.0 : 1.0) * (pass ? scale : 1.0));
            for (size_t i = 0; i < 3 * n; i++)
                rgb[i] = mean[i] + factor * d[i];
            ggn_visible_lightness(rgb, n, l + (size_t)side * n);
        }
        if (pass == 0)
            ggn_visible_texture(l, l + n, w, h, scratch, texture);
    }
    for (size_t i = 0; i < n; i++)
        l[i] = 0.5f * (l[i] - l[n + i]);
    double seen = ggn_visible_noise(l, w, h, texture, scratch, NULL);
    free(scratch);
    free(l);
    free(rgb);
    return seen;
}

static const struct seq_record *full_of(const struct seq_block *b)
{
    const struct seq_record *r = b->levels;
    while (!seq_has(r, SEQ_PLANE_HALF_F16))
        r++;
    return r;
}

/* A level that halves stand for, by hand from their planes. */
static void simulated_by_hand(void **state)
{
    (void)state;
    enum { AT = 20 };
    static float mean[3 * P], d[3 * P];
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.2, 11, 0);
    const struct seq_record *full = full_of(&b);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), 0);
    assert_int_equal(seq_mean(&b, full, mean, &err), 0);
    assert_int_equal(seq_half(&b, full, d, &err), 0);
    assert_true(c.spp[AT] > full->spp);
    assert_near(seen_by_hand(mean, d, W, H, sqrt(full->spp / c.spp[AT])), c.visible[AT], 1e-5 * c.visible[AT]);
    ggn_curve_release(&c);
    seq_block_release(&b);
}

/* Every place of a curve: which levels there are, and what lies between them. */
static void levels_of_curves(void **state)
{
    (void)state;
    enum { BELOW = 7, FULL = 342, FIRST = 25, LAST = BELOW + 48 - FIRST + 1 }; /* of the simulated levels 0 ... 48 */
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.1, 3, 4096);
    assert_int_equal(full_of(&b)->spp, FULL);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), 0);
    assert_true(c.n == LAST + 1 && c.recorded == BELOW + 1);
    for (int i = 0; i <= BELOW; i++) { /* levels up to the full one by their own halves: nothing is simulated there */
        double seen;
        assert_near(c.spp[i], levels[i], 0);
        assert_int_equal(ggn_curve_level(&b, NULL, &b.levels[i], &seen, &err), 0);
        assert_near(log2(seen / c.visible[i]), 0, i == BELOW ? 1e-9 : 0.2); /* its own texture or the full level's */
    }
    for (int i = BELOW + 1; i <= LAST; i++)
        assert_near(c.spp[i], 20000 * exp2(0.25 * (i - LAST)), 1e-9);
    assert_near(ggn_curve_at(&c, 20000), c.visible[LAST], 0);
    assert_near(ggn_curve_at(&c, 1e6), c.visible[LAST], 0);
    assert_near(ggn_curve_at(&c, sqrt(c.spp[20] * c.spp[21])), sqrt(c.visible[20] * c.visible[21]), 1e-12);
    assert_near(ggn_curve_at(&c, c.spp[0]), c.visible[0], 0);
    double keep = c.visible[21];
    c.visible[21] = 0; /* no logarithm of it: along the line */
    assert_near(ggn_curve_at(&c, sqrt(c.spp[20] * c.spp[21])), 0.5 * c.visible[20], 1e-12);
    c.visible[21] = keep;
    ggn_curve_release(&c);
    assert_true(!c.spp && !c.visible && c.n == 0);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 1, &c, &err), 0);
    assert_int_equal(c.recorded, LEVELS);
    assert_int_equal(c.n, LEVELS + 5); /* 8758 * 1.07 < 10000, 11892, 14142, 16818, 20000 */
    for (int i = 0; i < LEVELS; i++)
        assert_near(c.spp[i], levels[i], 0);
    assert_near(c.spp[LEVELS + 4], 20000, 0);
    ggn_curve_release(&c);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 0, &c, &err), 0); /* below 4096 samples, in noise of at most 8192 */
    assert_true(c.n == 13 && c.recorded == 13);
    for (int i = 0; i < c.n; i++)
        assert_near(c.spp[i], levels[i] * 4096.0 / (4096 - levels[i]), 1e-9 * c.spp[i]);
    ggn_curve_release(&c);
    double grey[2];
    for (int k = 0; k < 2; k++) /* luminance alone is kept of other levels: as visible as their samples say */
        assert_int_equal(ggn_curve_level(&b, NULL, full_of(&b) - 2 * k, &grey[k], &err), 0);
    assert_near(log2(grey[1] / grey[0]), 0.5 * log2(342.0 / 152), 0.1);
    seq_block_release(&b);
}

/* Where the noise of one level is, of a block seen through its reference of other samples: by hand. */
static void levels_by_hand(void **state)
{
    (void)state;
    static float mean[3 * P], reference[3 * P], work[3 * P], l[3][P];
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.2, 3, 1024);
    double *scratch = malloc(ggn_visibility_scratch(W) * sizeof *scratch), texture;
    assert_int_equal(seq_mean(&b, b.reference, reference, &err), 0);
    ggn_visible_lightness(reference, P, l[2]);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 1, &c, &err), 0);
    assert_int_equal(seq_mean(&b, &b.levels[LEVELS - 1], mean, &err), 0);
    ggn_visible_lightness(mean, P, l[1]);
    ggn_visible_texture(l[1], l[2], W, H, scratch, &texture);
    for (int k = 0; k < LEVELS; k += LEVELS - 1) {
        assert_int_equal(seq_mean(&b, &b.levels[k], mean, &err), 0);
        for (int i = 0; i < 3 * P; i++)
            work[i] = reference[i] + (float)sqrt(1024 / (1024.0 + levels[k])) * (mean[i] - reference[i]);
        ggn_visible_lightness(work, P, l[0]);
        for (int i = 0; i < P; i++)
            l[0][i] -= l[2][i];
        assert_near(c.visible[k], ggn_visible_noise(l[0], W, H, &texture, scratch, NULL), 1e-6);
    }
    ggn_curve_release(&c);
    free(scratch);
    seq_block_release(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(thresholds),
        cmocka_unit_test(scaling),
        cmocka_unit_test(noisy_reference),
        cmocka_unit_test(beyond_the_last_level),
        cmocka_unit_test(reference_of_the_same_samples),
        cmocka_unit_test(needs),
        cmocka_unit_test(simulated_by_hand),
        cmocka_unit_test(levels_of_curves),
        cmocka_unit_test(levels_by_hand),
    };
    return cmocka_run_group_tests_name("observer curves", tests, NULL, NULL);
}
