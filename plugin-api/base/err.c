#include "base/err.h"

#include <stdarg.h>
#include <stdio.h>

int base_fail(struct base_err *err, int code, const char *format, ...)
{
    if (err) {
        va_list args;
        va_start(args, format);
        vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        err->code = code;
    }
    return code;
}

int base_fail_nomem(struct base_err *err, const char *what)
{
    return base_fail(err, BASE_ENOMEM, "out of memory (%s)", what);
}
