#include "shade/alias.h"

void pt_alias_build(const double *weights, int32_t n, float *q, int32_t *alias, int32_t *work)
{
    double sum = 0.0;
    for (int32_t i = 0; i < n; i++)
        sum += weights[i];
    /* `work` holds the small entries from the front and the large ones from the back */
    int32_t small = 0, large = n;
    for (int32_t i = 0; i < n; i++) {
        q[i] = (float)(weights[i] / sum * n);
        alias[i] = i;
        if (q[i] < 1.0f)
            work[small++] = i;
        else
            work[--large] = i;
    }
    while (small > 0 && large < n) {
        int32_t s = work[--small], l = work[large];
        alias[s] = l;
        q[l] -= 1.0f - q[s];
        if (q[l] < 1.0f) {
            large++;
            work[small++] = l;
        }
    }
    while (large < n)
        q[work[large++]] = 1.0f;
    /* left over by rounding: but an entry of weight 0 must never be kept */
    while (small > 0) {
        int32_t s = work[--small];
        if (weights[s] > 0.0)
            q[s] = 1.0f;
    }
}
