/* SPDX-License-Identifier: MIT
 *
 * Stops every block at a given number of samples: what a renderer without adaptive sampling does.
 */
#include <lull/criterion_kit.h>

enum { SPP, PARAM_COUNT };

static const struct lull_param params[PARAM_COUNT] = {
    [SPP] = LULL_KIT_INT("spp", "64", 1, 1e15, "samples per pixel at which every block stops"),
};

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision, uint32_t worker)
{
    (void)view, (void)worker;
    uint64_t spp = (uint64_t)lull_kit_of(in)->value[SPP];
    decision->action = block->spp >= spp ? LULL_STOP : LULL_CONTINUE;
    decision->next_spp = block->spp >= spp ? 0 : spp;
    decision->predicted_spp = (double)spp;
}

static const struct lull_kit_rule rule = {.first_spp = "spp", .judge = judge};

LULL_KIT_CRITERION(rule, params, PARAM_COUNT, "fixed", "Fixed number of samples", "1.0",
                   "Stops every block at the same number of samples per pixel, whatever the image looks like.");
