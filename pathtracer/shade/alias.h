/* Walker's alias method with Vose's linear-time construction (1991). */
#ifndef PT_SHADE_ALIAS_H
#define PT_SHADE_ALIAS_H

#include <stdint.h>

/* From n >= 1 weights (>= 0, finite, sum > 0) to q[n] and alias[n]: pick i = floor(u·n), keep it when frac(u·n) < q[i], else
 * take alias[i]. `work` is scratch of n values. */
void pt_alias_build(const double *weights, int32_t n, float *q, int32_t *alias, int32_t *work);

#endif
