#include "picture/primaries.h"

#include <math.h>

static const double least_area = 1e-6; /* of a triangle that is no rounding error */

static double det3(const double a[3], const double b[3], const double c[3])
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) + c[0] * (a[1] * b[2] - a[2] * b[1]);
}

/* columns · out = v, by Cramer's rule. */
static void solve3(double columns[3][3], const double v[3], double out[3])
{
    const double det = det3(columns[0], columns[1], columns[2]);
    out[0] = det3(v, columns[1], columns[2]) / det;
    out[1] = det3(columns[0], v, columns[2]) / det;
    out[2] = det3(columns[0], columns[1], v) / det;
}

/* columns: XYZ of red, green and blue, which add up to the white of luminance 1 (SMPTE RP 177). */
static int find_xyz(const float primaries[8], double columns[3][3])
{
    double p[4][3], weight[3];
    for (int i = 0; i < 4; i++) {
        const double x = (double)primaries[2 * i], y = (double)primaries[2 * i + 1];
        if (!isfinite(x) || !isfinite(y))
            return 0;
        p[i][0] = x;
        p[i][1] = y;
        p[i][2] = 1 - x - y;
    }
    if (!(p[3][1] > 0) || !(fabs(det3(p[0], p[1], p[2])) > least_area))
        return 0;
    solve3(p, p[3], weight);
    for (int i = 0; i < 3; i++) {
        if (!(weight[i] > 0))
            return 0;
        for (int k = 0; k < 3; k++)
            columns[i][k] = p[i][k] * weight[i] / p[3][1];
    }
    return 1;
}

int pic_primaries_to_rec709(const float primaries[8], double m[3][3])
{
    static const float rec709[8] = PIC_REC709_PRIMARIES;
    double from[3][3], to[3][3];
    if (!find_xyz(primaries, from) || !find_xyz(rec709, to))
        return 0;
    for (int i = 0; i < 3; i++) {
        double column[3];
        solve3(to, from[i], column);
        for (int k = 0; k < 3; k++)
            m[k][i] = column[k];
    }
    return 1;
}
