/* cmocka with what it needs before it. */
#ifndef TESTS_SUPPORT_GGN_CMOCKA_H
#define TESTS_SUPPORT_GGN_CMOCKA_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#endif
