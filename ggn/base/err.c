#include "base/err.h"

#include <stdarg.h>
#include <stdio.h>

int ggn_fail(struct ggn_err *err, int code, const char *format, ...)
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

int ggn_fail_nomem(struct ggn_err *err, const char *what)
{
    return ggn_fail(err, GGN_ENOMEM, "out of memory (%s)", what);
}
