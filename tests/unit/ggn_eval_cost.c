/* What accuracy costs, by hand: three blocks whose thresholds, rates and columns are known. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <string.h>

#include "eval/cost.h"
#include "support/ggn_near.h"

enum { B = 3, LEVELS = 4, N = B * LEVELS };
static double spp[N], seconds[N], flip[N], relmse[N];
static struct ggn_eval_block blocks[B];
static struct ggn_eval_set set = {
    .n_blocks = B, .n_scenes = 1, .n = N, .blocks = blocks, .spp = spp, .seconds = seconds, .flip = flip, .relmse = relmse};
static const double thresholds[B] = {100, 400, 1600}, rates[B] = {1e-3, 2e-3, 4e-3}; /* seconds per sample */

static int setup(void **state)
{
    (void)state;
    set.images.width = set.images.height = 10;
    for (int b = 0; b < B; b++) {
        blocks[b] = (struct ggn_eval_block){
            .split = GGN_SPLIT_TEST, .first = (size_t)(b * LEVELS), .end = (size_t)((b + 1) * LEVELS), .cap = 6400};
        blocks[b].label.threshold = thresholds[b];
        for (int i = 0; i < LEVELS; i++) {
            size_t k = (size_t)(b * LEVELS + i);
            spp[k] = 100 << (2 * i);                              /* 100 400 1600 6400 */
            seconds[k] = i < 2 ? rates[b] * spp[k] : (double)NAN; /* recorded that far */
            flip[k] = 1.0 / sqrt(spp[k]);
            relmse[k] = 2.0 / spp[k];
        }
    }
    return 0;
}

/* Stopped exactly at their thresholds: nothing visible, and the time against uniform samples is the limit. */
static void limit(void **state)
{
    (void)state;
    struct ggn_cost c;
    ggn_cost_of(&set, GGN_SPLIT_TEST, -1, thresholds, NULL, &c);
    assert_int_equal(c.blocks, 3);
    assert_near(c.worst, 1.0, 1e-12);
    assert_near(c.noisy, 0.0, 1e-12);
    assert_near(c.uniform_spp, 1600.0, 1e-9);
    assert_near(c.samples_ratio, 700.0 / 1600.0, 1e-12);
    assert_near(c.sampling_s, (0.1 + 0.8 + 6.4) / 3, 1e-12);
    assert_near(c.time_ratio, (0.1 + 0.8 + 6.4) / (1600.0 * 7e-3), 1e-12);
}

static void early(void **state)
{
    (void)state;
    const double stop[B] = {90, 300, 400}; /* above 0.8 of the first; the last shows twice what is visible */
    const double checks[B] = {2, 3, 7};
    struct ggn_cost c;
    ggn_cost_of(&set, GGN_SPLIT_TEST, 0, stop, checks, &c);
    assert_near(c.noisy, 1.0, 1e-12);
    assert_near(c.early, 2.0 / 3.0, 1e-12);
    assert_near(c.worst, 2.0, 1e-12);
    assert_near(c.uniform_spp, 400.0, 1e-9);
    assert_near(c.checks, 4.0, 1e-12);
    assert_near(c.flip, (1 / sqrt(90) + 1 / sqrt(300) + 1.0 / 20) / 3, 1e-12); /* by the law between and before levels */
    assert_near(c.flip_worst, 1 / sqrt(90), 1e-12);
    assert_near(c.relmse, (2.0 / 90 + 2.0 / 300 + 2.0 / 400) / 3, 1e-12);
    ggn_cost_of(&set, GGN_SPLIT_PEOPLE, -1, stop, checks, &c);
    assert_int_equal(c.blocks, 0);
    assert_true(isnan(c.noisy));
    assert_near(1e6 * ggn_cost_path_s(&set, &blocks[2]), 40.0, 1e-9); /* 4 ms for 100 pixels */
}

/* Checks up to the stop. */
static void checks(void **state)
{
    (void)state;
    double asked_about[N], stop[B] = {1600, 100, 6400};
    double made[B];
    struct ggn_method m = {.score = asked_about, .stop = stop};
    for (int i = 0; i < N; i++)
        asked_about[i] = 0.5;
    asked_about[1] = (double)NAN; /* not asked */
    ggn_cost_checks(&m, &set, made);
    assert_true(made[0] == 2 && made[1] == 1 && made[2] == 4);
    double asked[B] = {5, 6, 7};
    m.asked = asked;
    ggn_cost_checks(&m, &set, made);
    assert_true(made[2] == 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(limit), cmocka_unit_test(early), cmocka_unit_test(checks)};
    return cmocka_run_group_tests_name("eval_cost", tests, setup, NULL);
}
