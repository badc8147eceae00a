/* The tables of the sRGB curve against integers: x^2.4 >= a is x^5 >= a^12 for a fraction a, so that nothing is rounded. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/colour.h"

/* --- whole numbers of up to 24 · 32 bits ------------------------------------------------------------------------------- */

enum { LIMBS = 24 };

struct whole {
    uint32_t limb[LIMBS]; /* lowest first */
};

static struct whole whole(uint64_t v) { return (struct whole){{(uint32_t)v, (uint32_t)(v >> 32)}}; }

static struct whole times(struct whole a, uint64_t factor)
{
    const struct whole b = whole(factor);
    struct whole out = {{0}};
    for (size_t j = 0; j < 2; j++) {
        uint64_t carry = 0;
        for (size_t i = 0; i + j < LIMBS; i++) {
            carry += (uint64_t)a.limb[i] * b.limb[j] + out.limb[i + j];
            out.limb[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        assert_true(carry == 0 && (j == 0 || b.limb[1] == 0 || a.limb[LIMBS - 1] == 0));
    }
    return out;
}

static struct whole times_power(struct whole a, uint64_t factor, int power)
{
    for (int i = 0; i < power; i++)
        a = times(a, factor);
    return a;
}

static int compare(const struct whole *a, const struct whole *b)
{
    for (size_t i = LIMBS; i-- > 0;)
        if (a->limb[i] != b->limb[i])
            return a->limb[i] < b->limb[i] ? -1 : 1;
    return 0;
}

/* --- the curve --------------------------------------------------------------------------------------------------------- */

/* Sign of (m / 2^shift)^power - (p / q)^(power == 1 ? 1 : 12). */
static int against(uint64_t m, int shift, int power, uint64_t p, uint64_t q)
{
    const int other = power == 1 ? 1 : 12;
    struct whole left = times_power(times_power(whole(1), m, power), q, other);
    struct whole right = times_power(times_power(whole(1), p, other), 2, power * shift);
    return compare(&left, &right);
}

/* x = m / 2^shift */
static uint64_t parts(double x, int *shift)
{
    int exponent;
    uint64_t m = (uint64_t)ldexp(frexp(x, &exponent), 53);
    *shift = 53 - exponent;
    return m;
}

/* Whether 255 oetf(x) + 0.5 >= code, for 0 < x < 1. */
static int reaches(double x, uint64_t code)
{
    int shift;
    uint64_t m = parts(x, &shift);
    if (x <= 0.0031308) /* 255 · 12.92 x >= code - 1/2 */
        return against(m, shift, 1, 100 * (2 * code - 1), 510 * 1292) >= 0;
    return against(m, shift, 5, 1000 * (2 * code - 1) + 55 * 510, 510 * 1055) >=
           0; /* x^5 >= (((code - 1/2)/255 + 0.055)/1.055)^12 */
}

static void limits_are_exact(void **state)
{
    (void)state;
    assert_true(base_srgb_limit[0] == 0 && isinf(base_srgb_limit[256]));
    for (int code = 1; code < 256; code++) {
        assert_true(reaches(base_srgb_limit[code], (uint64_t)code));
        assert_false(reaches(nextafter(base_srgb_limit[code], 0), (uint64_t)code));
    }
}

/* At each limit, one step of a double and of a float to either side. */
static void codes_change_at_the_limits(void **state)
{
    (void)state;
    for (int code = 1; code < 256; code++) {
        const double limit = base_srgb_limit[code];
        float at = (float)limit;
        if ((double)at < limit)
            at = nextafterf(at, 1);
        assert_int_equal(base_srgb_code(limit), code);
        assert_int_equal(base_srgb_code(nextafter(limit, 0)), code - 1);
        assert_int_equal(base_srgb_code(nextafter(limit, 1)), code);
        assert_int_equal(base_srgb_code((double)at), code);
        assert_int_equal(base_srgb_code((double)nextafterf(at, 0)), code - 1);
        assert_int_equal(base_srgb_code((double)nextafterf(at, 1)), code);
    }
}

/* Every bin of the index leads to the code, and so does what lies beside the bins. */
static void codes_of_all_bins(void **state)
{
    (void)state;
    for (int bin = -2000; bin < BASE_SRGB_BINS + 2000; bin++)
        for (int end = 0; end < 2; end++) {
            uint64_t bits = BASE_SRGB_FIRST_BITS + ((uint64_t)bin << BASE_SRGB_BIN_BITS);
            double x;
            int want = 0;
            if (end)
                bits |= (UINT64_C(1) << BASE_SRGB_BIN_BITS) - 1;
            memcpy(&x, &bits, sizeof x);
            while (want < 255 && x >= base_srgb_limit[want + 1])
                want++;
            assert_int_equal(base_srgb_code(x), want);
            assert_int_equal(base_srgb_code(-x), 0);
        }
    assert_int_equal(base_srgb_code(0), 0);
    assert_int_equal(base_srgb_code(0x1p-1074), 0);
    assert_int_equal(base_srgb_code(1), 255);
    assert_int_equal(base_srgb_code((double)INFINITY), 255);
    assert_int_equal(base_srgb_code(-(double)INFINITY), 0);
    assert_int_equal(base_srgb_code((double)NAN), 0);
    assert_int_equal(base_srgb_code(-(double)NAN), 0);
}

/* No double is nearer to eotf(code / 255), and no float. */
static void light_of_codes_is_exact(void **state)
{
    (void)state;
    assert_true(base_srgb_linear[0] == 0 && base_srgb_linear[255] == 1);
    for (int code = 1; code < 255; code++) {
        int shift;
        const uint64_t m = parts(base_srgb_linear[code], &shift);
        const int linear = code <= 10; /* 0.04045 · 255 = 10.3 */
        const uint64_t p = linear ? 100 * (uint64_t)code : 1000 * (uint64_t)code + 55 * 255,
                       q = linear ? 255 * 1292 : 255 * 1055;
        assert_true(against(2 * m - 1, shift + 1, linear ? 1 : 5, p, q) < 0);
        assert_true(against(2 * m + 1, shift + 1, linear ? 1 : 5, p, q) > 0);
        assert_true(base_srgb_linear_f32[code] == (float)base_srgb_linear[code]);
        assert_true(fabs(base_srgb_linear[code] - base_srgb_eotf(code / 255.0)) < 1e-15);
        assert_int_equal(base_srgb_code((double)base_srgb_linear_f32[code]), code);
    }
    assert_true(base_srgb_linear_f32[0] == 0 && base_srgb_linear_f32[255] == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(limits_are_exact), cmocka_unit_test(codes_change_at_the_limits),
                                       cmocka_unit_test(codes_of_all_bins), cmocka_unit_test(light_of_codes_is_exact)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
