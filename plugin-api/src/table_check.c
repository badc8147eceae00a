/* SPDX-License-Identifier: MIT
 *
 * The promises of a criterion's static tables.
 */
#include <lull/loader.h>

#include <math.h>
#include <string.h>

static int is_word(const char *text, const char *extra)
{
    if (!text || *text == '\0' || strlen(text) > 63)
        return 0;
    for (const char *p = text; *p != '\0'; p++)
        if (!(*p >= 'a' && *p <= 'z') && !(*p >= '0' && *p <= '9') && !strchr(extra, *p))
            return 0;
    return 1;
}

static const struct lull_param *param_at(const struct lull_criterion *c, uint32_t i)
{
    return (const struct lull_param *)(const void *)((const char *)c->params + (size_t)i * c->param_stride);
}

static int32_t param_check(const struct lull_criterion *c, uint32_t i, struct lull_error *err)
{
    const struct lull_param *p = param_at(c, i);
    if (!is_word(p->name, "-"))
        return lull_error_set(err, LULL_E_INVALID, "parameter %u has no name of the form [a-z0-9-]+", i);
    for (uint32_t k = 0; k < i; k++)
        if (strcmp(param_at(c, k)->name, p->name) == 0)
            return lull_error_set(err, LULL_E_INVALID, "two parameters have the name %s", p->name);
    if (!p->help)
        return lull_error_set(err, LULL_E_INVALID, "parameter %s has no help", p->name);
    if (p->type < LULL_PARAM_INT || p->type > LULL_PARAM_TEXT)
        return lull_error_set(err, LULL_E_INVALID, "parameter %s has the unknown type %d", p->name, p->type);
    if (p->type <= LULL_PARAM_FLOAT && !(isfinite(p->min) && isfinite(p->max) && p->min <= p->max))
        return lull_error_set(err, LULL_E_INVALID, "parameter %s has no finite range", p->name);
    if ((p->type == LULL_PARAM_CHOICE) != (p->choices != NULL))
        return lull_error_set(err, LULL_E_INVALID, "parameter %s: choices go with the type CHOICE only", p->name);
    return LULL_OK;
}

int32_t lull_table_check(const struct lull_criterion *c, struct lull_error *err)
{
    if (!c)
        return lull_error_set(err, LULL_E_INVALID, "no table");
    if (!LULL_HAS(struct lull_criterion, c, get_extension))
        return lull_error_set(err, LULL_E_VERSION, "its table is smaller than in version 1.0 (%u bytes)", c->struct_size);
    if (!is_word(c->id, ".-"))
        return lull_error_set(err, LULL_E_INVALID, "its id is not of the form [a-z0-9.-]+");
    if (!c->name || !c->version || !c->description)
        return lull_error_set(err, LULL_E_INVALID, "%s: name, version or description is missing", c->id);
    if (!c->create || !c->requirements || !c->begin_frame || !c->evaluate || !c->end_frame || !c->destroy ||
        !c->get_extension)
        return lull_error_set(err, LULL_E_INVALID, "%s: a function is missing", c->id);
    if (c->thread_level < LULL_THREADS_NONE || c->thread_level > LULL_THREADS_FULL)
        return lull_error_set(err, LULL_E_INVALID, "%s: unknown thread level %d", c->id, c->thread_level);
    if (c->param_count > 0 && (!c->params || c->param_stride < sizeof(struct lull_param) || c->param_count > 10000))
        return lull_error_set(err, LULL_E_INVALID, "%s: the parameter table is missing or has a bad stride", c->id);
    for (uint32_t i = 0; i < c->param_count; i++) {
        int32_t status = param_check(c, i, err);
        if (status != LULL_OK)
            return status;
    }
    return LULL_OK;
}
