/* Reading takes time in proportion to what is read: eight times the input never takes twenty times as long. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/pt_readings.h"

static void nothing_is_read_in_quadratic_time(void **state)
{
    (void)state;
    assert_int_equal(base_reading_check(pt_readings, PT_READINGS), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_is_read_in_quadratic_time)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
