/* SPDX-License-Identifier: MIT
 *
 * The smallest criterion: never stops a block. Copy this file to begin your own.
 *
 *     cc -shared -fPIC -fvisibility=hidden -Wl,--version-script=plugin.map null.c -o null.so -lm
 *     lull-check ./null.so
 */
#include <lull/criterion_kit.h>

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision, uint32_t worker)
{
    (void)in, (void)view, (void)block, (void)worker;
    decision->action = LULL_CONTINUE;
    decision->next_spp = 0; /* the host chooses when to ask again */
}

static const struct lull_kit_rule rule = {.judge = judge}; /* no planes: it looks at nothing */

LULL_KIT_CRITERION(rule, NULL, 0, "null", "Never stop", "1.0",
                   "Continues every block for ever: the host's own limit ends the render.");
