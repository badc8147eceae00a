#include "base/err.h"

#include <stdarg.h>
#include <stdio.h>

int pt_fail(struct pt_err *err, int code, const char *format, ...)
{
    if (err != NULL) {
        va_list args;
        va_start(args, format);
        vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        err->code = code;
    }
    return code;
}

int pt_fail_nomem(struct pt_err *err, const char *what)
{
    return pt_fail(err, PT_ENOMEM, "out of memory (%s)", what);
}
