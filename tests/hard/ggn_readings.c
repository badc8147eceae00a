/* Reading takes time in proportion to what is read: eight times the input never takes twenty times as long. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/ggn_readings.h"

/* 1 where reading is linear and 2 where it is quadratic; at most 1.14 was seen. */
#define EXPONENT_MAX 1.45

static void nothing_is_read_in_quadratic_time(void **state)
{
    (void)state;
    for (int i = 0; i < GGN_READINGS; i++) {
        double e = base_reading_exponent(&ggn_readings[i], EXPONENT_MAX);
        print_message("%s: exponent %.2f\n", ggn_readings[i].name, e);
        assert_true(e >= 0); /* refused otherwise */
        if (e > EXPONENT_MAX)
            fail_msg("%s: time grows with the power %.2f of the size", ggn_readings[i].name, e);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_is_read_in_quadratic_time)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
