/* The pictures that people are shown of a recorded block: which sample counts there are, and that each picture is what its header says,
 * recomputed from the block. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "sight/preprocess.h"
#include "data/stimuli.h"
#include "support/ggn_near.h"
#include "support/ggn_noise.h"

enum { W = 20, H = 16, P = W * H, MOST = 64 };
static const uint32_t levels[] = {20, 40, 80, 160, 320, 640, 1280};

static struct seq_block block_of(const uint32_t *spp, uint32_t n, uint32_t reference_spp)
{
    struct ggn_noise noise = {W, H, spp, n, reference_spp, 1.5, 0.05, 3, 0};
    return ggn_noise_block(&noise);
}

/* 20, 23, …, each 1.15 times the one before, beyond a count; and the cap. */
static int simulated(double beyond, double *spp)
{
    int n = 0;
    for (int k = 0; 20 * pow(1.15, k) < 10000; k++)
        if (round(20 * pow(1.15, k)) > beyond)
            spp[n++] = round(20 * pow(1.15, k));
    spp[n++] = 10000;
    return n;
}

/* Codes of a + scale b, planar linear floats, against interleaved codes. A value may lie between two codes. */
static void assert_picture(const uint8_t *got, const float *a, double scale, const float *b)
{
    for (int i = 0; i < P; i++)
        for (int c = 0; c < 3; c++) {
            int want = ggn_preprocess((double)a[c * P + i] + scale * (double)b[c * P + i], NULL, NULL);
            if (abs(got[3 * i + c] - want) > 1)
                fail_msg("pixel %d, channel %d: %d instead of %d", i, c, got[3 * i + c], want);
        }
}

static const struct seq_record *full_of(const struct seq_block *b)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (seq_has(&b->levels[i], SEQ_PLANE_HALF_F16))
            return &b->levels[i];
    fail_msg("no full level");
    return NULL;
}

static void recorded_then_simulated(void **state)
{
    (void)state;
    static float reference[3 * P], mean[3 * P], half[3 * P];
    static uint8_t picture[3 * P], shown[3 * P];
    struct seq_block b = block_of(levels, 7, 2000);
    struct ggn_stimuli s;
    double beyond[MOST];
    int more = simulated(1.07 * 1280, beyond);
    assert_int_equal(ggn_stimuli_init(&s, &b, 1, NULL), 0);
    assert_true(s.recorded == 7 && s.n == 7 + more && s.scale && more > 10);
    for (int i = 0; i < s.n; i++)
        assert_near(s.spp[i], i < 7 ? levels[i] : beyond[i - 7], 0);
    assert_int_equal(seq_mean(&b, b.reference, reference, NULL), 0);
    assert_int_equal(seq_display(&b, b.reference, shown, NULL), 0);
    assert_memory_equal(s.converged, shown, sizeof shown);
    const struct seq_record *full = full_of(&b);
    assert_int_equal(seq_half(&b, full, half, NULL), 0);
    assert_near(s.spp0, full->spp, 0);
    int scaled = 0, taken = 0;
    for (int i = 0; i < s.n; i++) {
        assert_int_equal(ggn_stimuli_make(&s, i, picture, NULL), 0);
        if (i >= 7) {
            assert_picture(picture, reference, sqrt((double)full->spp / s.spp[i]), half);
        } else if (seq_has(&b.levels[i], SEQ_PLANE_MEAN_F16) || seq_has(&b.levels[i], SEQ_PLANE_FINE)) {
            assert_int_equal(seq_mean(&b, &b.levels[i], mean, NULL), 0);
            for (int k = 0; k < 3 * P; k++)
                mean[k] -= reference[k];
            assert_picture(picture, reference, sqrt(2000 / (2000 + s.spp[i])), mean);
            scaled++;
        } else {
            assert_int_equal(seq_display(&b, &b.levels[i], shown, NULL), 0);
            assert_memory_equal(picture, shown, sizeof shown);
            taken++;
        }
    }
    assert_true(scaled > 0 && scaled + taken == 7);
    ggn_stimuli_release(&s);
    /* a reference that shares samples: pictures as they are, and none beyond */
    assert_int_equal(ggn_stimuli_init(&s, &b, 0, NULL), 0);
    assert_true(s.n == 7 && !s.scale);
    for (int i = 0; i < s.n; i++) {
        assert_int_equal(ggn_stimuli_make(&s, i, picture, NULL), 0);
        assert_int_equal(seq_display(&b, &b.levels[i], shown, NULL), 0);
        assert_memory_equal(picture, shown, sizeof shown);
    }
    ggn_stimuli_release(&s);
    seq_block_release(&b);
}

static void without_a_reference_all_are_simulated(void **state)
{
    (void)state;
    static float mean[3 * P], half[3 * P], none[3 * P];
    static uint8_t picture[3 * P];
    struct seq_block b = block_of(levels, 7, 0);
    struct ggn_stimuli s;
    double all[MOST];
    assert_int_equal(ggn_stimuli_init(&s, &b, 1, NULL), 0);
    assert_true(s.recorded == 0 && s.n == simulated(0, all));
    const struct seq_record *full = full_of(&b);
    assert_int_equal(seq_mean(&b, full, mean, NULL), 0);
    assert_int_equal(seq_half(&b, full, half, NULL), 0);
    assert_picture(s.converged, mean, 0, none);
    for (int i = 0; i < s.n; i++) {
        assert_near(s.spp[i], all[i], 0);
        assert_int_equal(ggn_stimuli_make(&s, i, picture, NULL), 0);
        assert_picture(picture, mean, sqrt((double)full->spp / s.spp[i]), half);
    }
    ggn_stimuli_release(&s);
    seq_block_release(&b);
}

/* Up to a tenth of an octave below the cap nothing is simulated. */
static void near_the_cap_nothing_is_added(void **state)
{
    (void)state;
    for (uint32_t last = 9300; last <= 9400; last += 100) {
        const uint32_t two[] = {400, last};
        struct seq_block b = block_of(two, 2, 20000);
        struct ggn_stimuli s;
        assert_int_equal(ggn_stimuli_init(&s, &b, 1, NULL), 0);
        assert_int_equal(s.n, last == 9300 ? 3 : 2); /* 1.07 · 9300 < 10000 */
        assert_near(s.spp[s.n - 1], last == 9300 ? 10000 : last, 0);
        ggn_stimuli_release(&s);
        seq_block_release(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(recorded_then_simulated),
                                       cmocka_unit_test(without_a_reference_all_are_simulated),
                                       cmocka_unit_test(near_the_cap_nothing_is_added)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
