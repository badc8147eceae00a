/* Large inputs of every kind are read. How their time grows is measured by `make bench`. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "support/pt_readings.h"

static void large_inputs_are_read(void **state)
{
    (void)state;
    assert_int_equal(base_reading_check(pt_readings, PT_READINGS), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(large_inputs_are_read)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
