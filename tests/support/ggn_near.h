/* cmocka compares floats only; this compares doubles and says what it saw. Include after cmocka.h. */
#ifndef TESTS_GGN_NEAR_H
#define TESTS_GGN_NEAR_H

#include <math.h>

#define assert_near(got, want, tolerance) \
    do { \
        double got_ = (got), want_ = (want); \
        if (!(fabs(got_ - want_) <= (tolerance))) \
            fail_msg("%s = %.12g, expected %.12g", #got, got_, want_); \
    } while (0)

#endif
