#include "pbrt/number.h"

#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Powers of ten that are exact in double. */
static const double exact_pow10[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                     1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

struct decimal {
    uint64_t mantissa;   /* the first 19 significant digits */
    int exponent;        /* value = mantissa · 10^exponent */
    int negative, exact; /* exact: no digit was dropped */
};

static int is_digit(char c) { return c >= '0' && c <= '9'; }

/* 1 when text[0, n) is a decimal number and nothing else. */
static int scan(const char *text, size_t n, struct decimal *d)
{
    size_t i = 0;
    int digits = 0, significant = 0, point = 0;
    *d = (struct decimal){.exact = 1};
    if (i < n && (text[i] == '-' || text[i] == '+'))
        d->negative = text[i++] == '-';
    for (; i < n && (is_digit(text[i]) || (text[i] == '.' && !point)); i++) {
        if (text[i] == '.') {
            point = 1;
            continue;
        }
        digits++;
        if (significant < 19) {
            d->mantissa = d->mantissa * 10 + (uint64_t)(text[i] - '0');
            significant += d->mantissa > 0;
            d->exponent -= point;
        } else {
            d->exact &= text[i] == '0';
            d->exponent += !point;
        }
    }
    if (digits == 0)
        return 0;
    if (i < n && (text[i] == 'e' || text[i] == 'E')) {
        int sign = 1, value = 0, exponent_digits = 0;
        i++;
        if (i < n && (text[i] == '-' || text[i] == '+'))
            sign = text[i++] == '-' ? -1 : 1;
        for (; i < n && is_digit(text[i]); i++, exponent_digits++)
            value = value < 100000 ? value * 10 + (text[i] - '0') : value;
        if (exponent_digits == 0)
            return 0;
        d->exponent += sign * value;
    }
    return i == n;
}

/* The rare long or extreme ones: the C library, with the C locale whatever the process has. */
static int parse_slowly(const char *text, size_t n, double *out)
{
    char buffer[512];
    if (n >= sizeof buffer)
        return 0;
    memcpy(buffer, text, n);
    buffer[n] = '\0';
    char *point = strchr(buffer, '.');
    const struct lconv *conv = localeconv();
    if (point && conv->decimal_point[0] != '\0' && conv->decimal_point[1] == '\0')
        *point = conv->decimal_point[0];
    *out = strtod(buffer, NULL);
    return isfinite(*out);
}

int pt_number_parse(const char *text, size_t n, double *out)
{
    struct decimal d;
    if (!scan(text, n, &d))
        return 0;
    /* Both factors exact in double, one rounding: Clinger 1990, "How to read floating point numbers accurately". */
    if (d.exact && d.mantissa <= (1ull << 53) && d.exponent >= -22 && d.exponent <= 22) {
        double v = (double)d.mantissa;
        v = d.exponent < 0 ? v / exact_pow10[-d.exponent] : v * exact_pow10[d.exponent];
        *out = d.negative ? -v : v;
        return 1;
    }
    return parse_slowly(text, n, out);
}
