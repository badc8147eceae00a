#include "host/frame.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

void lull_host_line(char *to, size_t room, const char *text)
{
    snprintf(to, room, "%s", text);
    for (char *at = to; *at; at++)
        *at = iscntrl((unsigned char)*at) ? ' ' : *at;
}

int32_t lull_host_blame(const struct lull_host_criterion *c, const char *what, int32_t code, const struct lull_error *why,
                        struct lull_error *err)
{
    char whole[sizeof why->message + 1], text[sizeof whole];
    memcpy(whole, why->message, sizeof why->message);
    whole[sizeof why->message] = '\0'; /* it may have forgotten that */
    lull_host_line(text, sizeof text, whole);
    return lull_error_set(err, code < LULL_OK ? code : LULL_E_INTERNAL, "criterion %s: %s%s", c->table->id, what, text);
}

int32_t lull_host_translate(const struct base_err *why, struct lull_error *err)
{
    int32_t code = why->code == BASE_ENOMEM ? LULL_E_MEMORY : why->code == BASE_EIO ? LULL_E_IO : LULL_E_INVALID;
    return lull_error_set(err, code, "%s", why->text);
}

int32_t lull_host_no_memory(struct lull_error *err, const char *what)
{
    return lull_error_set(err, LULL_E_MEMORY, "out of memory (%s)", what);
}
