/* SPDX-License-Identifier: MIT
 *
 * Stops every block at a given number of samples: what a renderer without adaptive sampling does.
 */
#include "support.h"

enum { SPP };

static const struct lull_param params[] = {
    [SPP] = {.name = "spp",
             .help = "samples per pixel at which every block stops",
             .default_value = "64",
             .min = 1,
             .max = 1e15,
             .type = LULL_PARAM_INT},
};

static void judge(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision)
{
    (void)view;
    uint64_t spp = (uint64_t)in->value[SPP];
    decision->action = block->spp >= spp ? LULL_STOP : LULL_CONTINUE;
    decision->next_spp = block->spp >= spp ? 0 : spp;
    decision->predicted_spp = in->value[SPP];
}

static const struct ex_rule ex_rule = {.params = params, .param_count = 1, .first_spp_param = SPP, .judge = judge};

static const struct lull_criterion fixed_criterion = {
    .struct_size = sizeof(struct lull_criterion),
    .api_minor = LULL_API_MINOR,
    .id = "fixed",
    .name = "Fixed number of samples",
    .version = "1.0",
    .description = "Stops every block at the same number of samples per pixel, whatever the image looks like.",
    .params = params,
    .param_count = 1,
    .param_stride = sizeof(struct lull_param),
    .thread_level = LULL_THREADS_FULL,
    .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
    EX_FUNCTIONS,
};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    return index == 0 ? &fixed_criterion : NULL;
}
