/* The version of the whole project: programs, packages, Python. The criteria's ABI and the host library count for themselves
 * (lull/criterion.h, lull/host.h). What says a version takes it from these headers; tests/cli/versions.sh compares. */
#ifndef BASE_VERSION_H
#define BASE_VERSION_H

#define BASE_VERSION "1.0.0"

#endif
