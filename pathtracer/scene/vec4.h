/*
 * Four floats side by side, for what is worked out four times at once: GNU C's vectors (gcc, clang), which become the
 * machine's own where it has such and the same numbers anywhere else. + - * / act on each; comparisons give masks.
 */
#ifndef PT_SCENE_VEC4_H
#define PT_SCENE_VEC4_H

#include <math.h>
#include <stdint.h>
#include <string.h>

typedef float pt_f4 __attribute__((vector_size(16)));
typedef int32_t pt_mask4 __attribute__((vector_size(16)));

static inline pt_f4 f4_splat(float x) { return (pt_f4){x, x, x, x}; }
static inline pt_f4 f4_load(const float *x)
{
    pt_f4 v;
    memcpy(&v, x, sizeof v);
    return v;
}
static inline pt_mask4 f4_load_mask(const int32_t *x)
{
    pt_mask4 m;
    memcpy(&m, x, sizeof m);
    return m;
}
/* yes where the mask is set, no elsewhere */
static inline pt_f4 f4_select(pt_mask4 mask, pt_f4 yes, pt_f4 no)
{
    return (pt_f4)((mask & (pt_mask4)yes) | (~mask & (pt_mask4)no));
}
static inline pt_f4 f4_max(pt_f4 a, pt_f4 b) { return f4_select(a > b, a, b); }
static inline pt_f4 f4_abs(pt_f4 a) { return (pt_f4)((pt_mask4)a & 0x7fffffff); }
static inline pt_f4 f4_sqrt(pt_f4 a) { return (pt_f4){sqrtf(a[0]), sqrtf(a[1]), sqrtf(a[2]), sqrtf(a[3])}; }

#endif
