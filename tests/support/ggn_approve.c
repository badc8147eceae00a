#include "support/ggn_approve.h"

#include "support/ggn_cmocka.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "support/base_foreign.h"

static const double SMALL = 0.01;    /* numbers below it are compared as parts of it */
static const double ROUNDING = 1e-6; /* of numbers with decimals, at least: other last bits of pow, exp and sums */

/* Whether a number begins at p, which is not inside of a word. */
static int number_at(const char *text, const char *p)
{
    if (p > text && (isalnum((unsigned char)p[-1]) || p[-1] == '.' || p[-1] == '_'))
        return 0;
    p += *p == '-';
    return isdigit((unsigned char)*p) || (*p == '.' && isdigit((unsigned char)p[1]));
}

static void fail_at(const char *name, const char *text, const char *at, const char *recorded, const char *recorded_at)
{
    int line = 1;

    for (const char *p = text; p < at; p++)
        line += *p == '\n';
    while (at > text && at[-1] != '\n')
        at--;
    while (recorded_at > recorded && recorded_at[-1] != '\n')
        recorded_at--;
    fail_msg("line %d of %s:\n  is       %.*s\n  recorded %.*s", line, name, (int)strcspn(at, "\n"), at,
             (int)strcspn(recorded_at, "\n"), recorded_at);
}

/* How far a number with decimals that ends at `end` may be off at any tolerance: the last of three or more decimals turns with a
 * last bit. */
static double printed(const char *number, const char *end, double value)
{
    const char *point = memchr(number, '.', (size_t)(end - number));
    if (!point)
        return 0;
    const long decimals = (long)strspn(point + 1, "0123456789");
    const double unit = decimals >= 3 && point + 1 + decimals == end ? 1.01 * pow(10, (double)-decimals) : 0;
    return fmax(unit, ROUNDING * fmax(fabs(value), SMALL));
}

static void compare(const char *name, const char *text, const char *recorded, double tolerance)
{
    const char *p = text, *q = recorded;

    while (*p || *q) {
        if (number_at(text, p) && number_at(recorded, q)) {
            char *p_end, *q_end;
            double got = strtod(p, &p_end), want = strtod(q, &q_end);
            double near = fmax(printed(p, p_end, got), printed(q, q_end, want));
            if (!(fabs(got - want) <= fmax(near, tolerance * fmax(fabs(want), SMALL))))
                fail_at(name, text, p, recorded, q);
            p = p_end;
            q = q_end;
        } else if (*p != *q) {
            fail_at(name, text, p, recorded, q);
        } else {
            p++;
            q++;
        }
    }
}

void ggn_approve(const char *name, const char *text, double tolerance)
{
    char path[256], *recorded;
    struct base_err err = {0};
    size_t size;

    snprintf(path, sizeof path, "tests/golden/%s.txt", name);
    if (getenv("RECORD")) {
        FILE *f = fopen(path, "w");
        assert_non_null(f);
        fputs(text, f);
        assert_int_equal(fclose(f), 0);
        return;
    }
    if (base_file_read(path, 1 << 24, &recorded, &size, &err))
        fail_msg("%s", err.text);
    char *told = foreign_as_recorded(text);
    compare(path, told, recorded, tolerance);
    free(told);
    free(recorded);
}
