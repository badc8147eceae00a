#include "support/pt_mat34.h"

int pt_mat34_invert(const struct pt_mat34 *t, struct pt_mat34 *inv)
{
    double a[12];
    for (int i = 0; i < 12; i++)
        a[i] = (double)t->m[i];
    double c00 = a[5] * a[10] - a[6] * a[9], c01 = a[6] * a[8] - a[4] * a[10], c02 = a[4] * a[9] - a[5] * a[8];
    double det = a[0] * c00 + a[1] * c01 + a[2] * c02, s = 1.0 / det;
    if (!(det != 0.0) || !isfinite(s))
        return 0;
    double r[9] = {c00 * s, (a[2] * a[9] - a[1] * a[10]) * s, (a[1] * a[6] - a[2] * a[5]) * s,
                   c01 * s, (a[0] * a[10] - a[2] * a[8]) * s, (a[2] * a[4] - a[0] * a[6]) * s,
                   c02 * s, (a[1] * a[8] - a[0] * a[9]) * s,  (a[0] * a[5] - a[1] * a[4]) * s};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            inv->m[4 * i + j] = (float)r[3 * i + j];
        inv->m[4 * i + 3] = (float)-(r[3 * i] * a[3] + r[3 * i + 1] * a[7] + r[3 * i + 2] * a[11]);
    }
    return 1;
}
