/* Every allocation of a block's pictures fails once: an error, no crash, no leak. */
#include "support/ggn_cmocka.h"

#include <stdlib.h>

#include "data/stimuli.h"
#include "support/fail_alloc.h"
#include "support/ggn_noise.h"

static struct seq_block recording;

static int pictures(struct base_err *err)
{
    struct ggn_stimuli s;
    int rc = ggn_stimuli_init(&s, &recording, 1, err);
    if (rc)
        return rc;
    uint8_t *rgb = malloc((size_t)3 * recording.width * recording.height);
    rc = rgb ? ggn_stimuli_make(&s, s.n - 1, rgb, err) : base_fail_nomem(err, "t");
    free(rgb);
    ggn_stimuli_release(&s);
    return rc;
}

static void a_block(void **state)
{
    static const uint32_t levels[] = {20, 400};
    enum { MANY = 20000 };
    (void)state;
    for (uint32_t reference_spp = 0; reference_spp <= 800; reference_spp += 800) {
        const struct ggn_noise noise = {12, 10, levels, 2, reference_spp, 1, 0, 1, 0};
        long k = 1;
        recording = ggn_noise_block(&noise);
        assert_int_equal(pictures(NULL), 0);
        for (; k < MANY; k++) {
            struct base_err err = {0};
            fail_arm(k);
            int rc = pictures(&err), failed = fail_disarm();
            if (!failed)
                break;
            if (!rc || err.text[0] == '\0')
                fail_msg("allocation %ld failed and nothing was said", k);
        }
        assert_true(k > 2 && k < MANY);
        assert_int_equal(pictures(NULL), 0);
        seq_block_release(&recording);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_block)};
    return cmocka_run_group_tests_name("oom_stimuli", tests, NULL, NULL);
}
