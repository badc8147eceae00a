#include "pbrt/diag.h"

#include <stdarg.h>
#include <stdio.h>

enum { TEXT_MAX = 400 };

/* Input text may hold anything; a message is one printable line. */
static void make_one_line(char *text)
{
    for (unsigned char *c = (unsigned char *)text; *c != '\0'; c++)
        if (*c < 0x20 || *c == 0x7f)
            *c = '?';
}

int pt_diag_fail_code(struct pt_diag *diag, int code, struct pt_loc loc, const char *format, ...)
{
    if (diag->rc)
        return diag->rc;
    char text[TEXT_MAX], file[160];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    make_one_line(text);
    snprintf(file, sizeof file, "%s", loc.file ? loc.file : "");
    make_one_line(file);
    diag->rc = code;
    if (loc.line > 0)
        base_fail(diag->err, code, "%s:%d:%d: %s", file, loc.line, loc.column, text);
    else if (loc.file)
        base_fail(diag->err, code, "%s: %s", file, text);
    else
        base_fail(diag->err, code, "%s", text);
    return code;
}

int pt_diag_fail_read(struct pt_diag *diag, struct pt_loc loc, const struct base_err *why)
{
    const int lacks_memory = why->code == BASE_ENOMEM;
    return pt_diag_fail_code(diag, lacks_memory ? BASE_ENOMEM : BASE_EINVAL, loc, "%s%s", lacks_memory ? "" : "cannot read ",
                             why->text);
}

int pt_diag_nomem(struct pt_diag *diag, const char *what)
{
    if (!diag->rc)
        diag->rc = base_fail_nomem(diag->err, what);
    return diag->rc;
}

void pt_diag_warn(struct pt_diag *diag, struct pt_loc loc, const char *format, ...)
{
    char text[TEXT_MAX];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    make_one_line(text);
    if (diag->strict) {
        pt_diag_fail(diag, loc, "%s (an error because of --strict)", text);
        return;
    }
    if (pt_names_get(&diag->reported, text) >= 0)
        return;
    if (pt_names_set(&diag->reported, text, 0) != 0) {
        pt_diag_nomem(diag, "warnings");
        return;
    }
    char file[200];
    snprintf(file, sizeof file, "%s", loc.file ? loc.file : "scene");
    make_one_line(file);
    if (loc.line > 0)
        base_log_note(diag->log, "%s:%d: warning: %s", file, loc.line, text);
    else
        base_log_note(diag->log, "%s: warning: %s", file, text);
}

int pt_diag_unknown(struct pt_diag *diag, struct pt_loc loc, const char *what, const char *name, const char *known,
                    const char *instead)
{
    if (!diag->is_v3)
        return pt_diag_fail(diag, loc, "unknown %s \"%s\" (expected %s)", what, name, known);
    pt_diag_warn(diag, loc, "unknown %s \"%s\": %s", what, name, instead);
    return diag->rc;
}

void pt_diag_release(struct pt_diag *diag) { pt_names_release(&diag->reported); }
