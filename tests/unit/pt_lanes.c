/* What is worked out in lanes against the functions for single paths, for every instruction set that the processor has: the
 * same bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <string.h>

#include "integ/lanes.h"
#include "sample/sampler.h"

static void expect_same(float got, float want) { assert_memory_equal(&got, &want, sizeof got); }

/* Every dimension of block `block` of `count` paths. */
static void check_numbers(const struct pt_lanes *lanes, int sobol, int count, uint32_t block)
{
    static const struct pt_lane_dims dims = {
        .pairs = 1u << 0 | 1u << 2 | 1u << 14, .singles = 1u << 4 | 1u << 5, .bits = 1u << 6};
    struct pt_sampler samplers[PT_RUN];
    struct pt_lane_keys keys = {.sobol = sobol};
    float u[PT_DIMS_PER_VERTEX][PT_RUN];
    memset(u, 0xa5, sizeof u);
    const float untouched = u[0][0];
    for (int i = 0; i < count; i++) {
        samplers[i] = pt_sampler_make(sobol, 3, 100 + (uint32_t)i, 7, block * 37 + 5);
        pt_sampler_block(&samplers[i], block);
        keys.index_reversed = samplers[i].index_reversed;
        keys.pixel_key[i] = samplers[i].pixel_key;
        keys.path_key[i] = samplers[i].path_key;
    }
    lanes->numbers(&keys, count, block, dims, u);
    for (int i = 0; i < PT_RUN; i++)
        for (uint32_t d = 0; d < PT_DIMS_PER_VERTEX; d++) {
            float want = untouched;
            if (i < count && (dims.pairs >> d & 1))
                want = pt_sampler_2d(&samplers[i], d).x;
            else if (i < count && d > 0 && (dims.pairs >> (d - 1) & 1))
                want = pt_sampler_2d(&samplers[i], d - 1).y;
            else if (i < count && (dims.singles >> d & 1))
                want = pt_sampler_1d(&samplers[i], d);
            else if (i < count && (dims.bits >> d & 1))
                want = pt_bits_to_float(pt_sampler_bits(&samplers[i], d));
            expect_same(u[d][i], want);
        }
}

static void numbers(void **state)
{
    (void)state;
    int found = 0;
    for (int isa = 0; isa < BASE_ISA_COUNT; isa++) {
        const struct pt_lanes *lanes = pt_lanes_for((enum base_isa)isa);
        for (int k = 0; lanes && k < 2 * 5 * PT_RUN; k++)
            check_numbers(lanes, k % 2, 1 + k / 10, (uint32_t)(k / 2 % 5));
        found += lanes != NULL;
    }
    assert_true(found >= 1);
    assert_null(pt_lanes_for(BASE_ISA_COUNT));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(numbers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
