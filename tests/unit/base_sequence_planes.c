/* Planes of a block sequence: codings against an independent oracle, filters, statistics. */
#include <math.h>
#include <string.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "base/colour.h"
#include "base/bytes.h"
#include "sequence/tail.h"
#include "support/ggn_near.h"
#include "support/lseq_oracle.h"

enum { W = 37, H = 21, P = W * H };

static void half_floats(void **state)
{
    (void)state;
    for (int i = 0; i < 65536; i++) {
        double v = (double)base_f16_to_f32((uint16_t)i);
        if ((i >> 10 & 31) == 31)
            continue;
        assert_true(v == oracle_f16_value(i));
        if (seq_half_float(v) != i || base_f32_to_f16((float)v) != i)
            fail_msg("half %04x does not survive", (unsigned)i);
    }
    /* around every 37th half: its value, the middle to the next, and what a double can tell from the middle */
    for (int i = 0; i < 0x7bff; i += 37) {
        double v = oracle_f16_value(i), middle = (v + oracle_f16_value(i + 1)) / 2;
        const double near[] = {v, middle, nextafter(middle, 0), nextafter(middle, 1e9), 0.3 * v + 0.7 * middle};
        for (size_t k = 0; k < sizeof near / sizeof near[0]; k++) {
            assert_int_equal(seq_half_float(near[k]), oracle_f16(near[k]));
            assert_int_equal(seq_half_float(-near[k]), oracle_f16(-near[k]));
        }
    }
    assert_int_equal(seq_half_float(1e9), 0x7bff);
    assert_int_equal(seq_half_float(-HUGE_VAL), 0xfbff);
    assert_int_equal(seq_half_float((double)NAN), 0);
    assert_int_equal(base_f64_to_f16(65519.9), 0x7bff);
    assert_int_equal(base_f64_to_f16(65520.0), 0x7c00);
    assert_int_equal(base_f64_to_f16(-0.0), 0x8000);
}

static void codings(void **state)
{
    (void)state;
    double worst = 0.0;
    for (double x = 1e-6; x < 5e4; x *= 1.0007) {
        uint8_t d = base_srgb_code(x), q = seq_fine_encode(d, x);
        double back = seq_fine_decode(d, q);
        double room = d < 255 ? (oracle_eotf((d + 0.5) / 255) - oracle_eotf(d == 0 ? 0 : (d - 0.5) / 255)) / 16 : x * 0.0219;
        assert_int_equal(d, oracle_display(x));
        assert_int_equal(q, oracle_fine(x));
        worst = fmax(worst, fabs(back - x) / room);
        if (d < 255 && base_srgb_code(back) != d)
            fail_msg("%g: the refined value has another display code", x);
    }
    assert_true(worst <= 1.001);
    for (double x = 2e-7; x < 3e5; x *= 1.003) {
        uint8_t code = seq_half_log_encode(x), minus = seq_half_log_encode(-x);
        assert_int_equal(code, oracle_half_log(x));
        assert_int_equal(minus, oracle_half_log(-x));
        assert_near(seq_half_log_decode(minus), -seq_half_log_decode(code), 0);
        if (x > 2e-6 && x < 3e3)
            assert_true(fabs(seq_half_log_decode(code) / x - 1) < 0.0906);
    }
    assert_int_equal(seq_half_log_encode(0), 0);
    assert_int_equal(seq_half_log_encode(exp2(-19.875)), 1);
    assert_int_equal(seq_half_log_encode((double)NAN), 0);
    assert_int_equal(seq_fine_encode(255, 1e30), 255);
}

static void statistics(void **state)
{
    (void)state;
    const double mean[12] = {1, 0, 1, 1, 1, 0, 1, 1, 2, 0, 1, 1}, half[12] = {1.5, 1, 1, 1, 1, 1, 1, 1, 2, 1, 1, 1};
    const double d[12] = {0, 0.1, 0, -0.3, 0, 0.1, 0, -0.3, 0, 0.1, 0, -0.3}, m2[4] = {2, 1, 1, 1};
    double scratch[4];
    struct seq_stat s[SEQ_STATISTICS];
    seq_statistics(mean, half, d, m2, 4, 5, scratch, s);
    static const char *const names[SEQ_STATISTICS] = {"dammertz",      "half_unsettled", "rse",
                                                      "rse_unsettled", "tail999",        "gini"};
    for (int i = 0; i < SEQ_STATISTICS; i++)
        assert_string_equal(s[i].name, names[i]);
    assert_near(s[SEQ_DAMMERTZ].value, 0.5 / 2.0 / 4.0, 1e-12);
    double y0 = 0.2126729 + 0.7151522 + 0.0721750 * 2, white = 0.2126729 + 0.7151522 + 0.0721750;
    /* Pixel 0: variance of the mean (2 - y0^2)/4; pixel 1 is black with moment 1, so its error counts against the floor 0.02. */
    assert_near(s[SEQ_RSE].value, sqrt(((2 - y0 * y0) / 4.0 / (y0 * y0) + 0.25 / (0.02 * 0.02)) / 4.0), 1e-12);
    assert_true(s[SEQ_RSE_UNSETTLED].value == 0.25 && s[SEQ_HALF_UNSETTLED].value == 0.25);
    assert_near(s[SEQ_TAIL999].value, 0.3 * white / ((y0 + 2.0 * white) / 4.0), 1e-12);
    assert_near(s[SEQ_GINI].value, (1 * 0.1 + 3 * 0.3) / (4 * 0.4), 1e-12);
}

static void filters(void **state)
{
    (void)state;
    static const uint32_t planes[] = {SEQ_PLANE_DISPLAY, SEQ_PLANE_FINE, SEQ_PLANE_MEAN_F16};
    for (size_t k = 0; k < 3; k++)
        for (uint32_t f = 0; f < 8; f++) {
            static uint8_t a[6 * P], b[6 * P];
            if ((f & ~seq_plane_filters(planes[k])) != 0) {
                assert_int_equal(seq_plane_filter(planes[k], f, a, W, H, 0, NULL), BASE_EINVAL);
                continue;
            }
            for (size_t i = 0; i < sizeof a; i++)
                a[i] = (uint8_t)(i * i * 31 + i / 7);
            memcpy(b, a, sizeof a);
            seq_plane_filter(planes[k], f, b, W, H, 0, NULL);
            assert_int_equal(memcmp(a, b, sizeof a) != 0, f != 0);
            seq_plane_filter(planes[k], f, b, W, H, 1, NULL);
            assert_memory_equal(a, b, sizeof a);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_floats),
        cmocka_unit_test(codings),
        cmocka_unit_test(statistics),
        cmocka_unit_test(filters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
