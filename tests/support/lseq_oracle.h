/*
 * The codes of plugin-api/sequence/FORMAT.md, written from its text alone and as plainly as can be: by trying every code and
 * taking the one that is read back nearest, or whose bin holds the value. Slow, and none of the product's code.
 */
#ifndef TESTS_SUPPORT_LSEQ_ORACLE_H
#define TESTS_SUPPORT_LSEQ_ORACLE_H

#include <math.h>
#include <stdint.h>

static inline double oracle_eotf(double v) { return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4); }

/* Display code: the bin [eotf((d - 1/2)/255), eotf((d + 1/2)/255)) that x is in. */
static inline int oracle_display(double x)
{
    int d = 0;
    while (d < 255 && x >= oracle_eotf((d + 0.5) / 255.0))
        d++;
    return d;
}

/* Eighth of the bin, or for code 255 the step of 1/16 octave that is nearest. */
static inline int oracle_fine(double x)
{
    int d = oracle_display(x), q = 0;
    double lo = d > 0 ? oracle_eotf((d - 0.5) / 255.0) : 0.0;
    if (d < 255) {
        double hi = oracle_eotf((d + 0.5) / 255.0);
        while (q < 7 && x >= lo + (q + 1) / 8.0 * (hi - lo))
            q++;
        return q;
    }
    while (q < 255 && log2(x) >= log2(lo) + (q + 0.5) / 16.0)
        q++;
    return q;
}

/* Sign and quarter octaves: the m from 1 to 127 whose 2^((m - 80)/4) is nearest on a logarithmic scale; 0 below 2^-19.875. */
static inline int oracle_half_log(double y)
{
    int m = 1;
    if (!(fabs(y) >= pow(2.0, -19.875)))
        return 0;
    while (m < 127 && log2(fabs(y)) >= (m + 0.5 - 80.0) / 4.0)
        m++;
    return m + (y < 0 ? 128 : 0);
}

static inline double oracle_f16_value(int h)
{
    int e = h >> 10 & 31, m = h & 1023;
    return (h & 0x8000 ? -1 : 1) * (e > 0 ? pow(2.0, e - 15) * (1 + m / 1024.0) : pow(2.0, -14) * (m / 1024.0));
}

/* The finite half float nearest to x, ties to the even one. Finite halves of one sign rise with their bits. */
static inline int oracle_f16(double x)
{
    int low = 0, high = 0x7bff, sign = signbit(x) ? 0x8000 : 0;
    double a = fabs(x);
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (oracle_f16_value(middle) <= a)
            low = middle;
        else
            high = middle;
    }
    double below = a - oracle_f16_value(low), above = oracle_f16_value(high) - a;
    return sign | (below < above || (below == above && low % 2 == 0) ? low : high);
}

#endif
