#include "host/frame.h"

int32_t lull_host_blame(const struct lull_host_criterion *c, const char *what, int32_t code, const struct lull_error *why,
                        struct lull_error *err)
{
    return lull_error_set(err, code, "criterion %s: %s%s", c->table->id, what, why->message);
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
