#include "render/host_find.h"

#include <lull/loader.h>

#include <string.h>

#include "render/host.h"

struct message_log {
    struct base_log *log;
    int32_t level; /* of what is passed on, LULL_LOG_ */
};

static void log_message(void *context, int32_t level, const char *text)
{
    const struct message_log *t = context;
    if (level <= t->level)
        base_log_note(t->log, "%s", text);
}

int pt_criterion_find(const char *spec, struct base_inputs *inputs, struct base_log *log, const struct lull_criterion **out,
                      struct base_err *err)
{
    struct message_log messages = {log, LULL_LOG_WARNING};
    struct lull_search search = {.log = log_message, .log_context = &messages};
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_found found;
    int32_t code = lull_open(&search, spec, &found, &e);
    if (code != LULL_OK)
        return pt_host_result(code, &e, err);
    int rc = inputs ? base_inputs_add(inputs, found.path, err) : 0;
    if (!rc)
        *out = found.criterion;
    return rc;
}

void pt_criterion_describe(const struct lull_criterion *t, FILE *out)
{
    fprintf(out, "%s %s - %s\n", t->id, t->version, t->name);
    for (const char *line = t->description; *line != '\0';) {
        int n = (int)strcspn(line, "\n");
        fprintf(out, "    %.*s\n", n, line);
        line += n + (line[n] != '\0');
    }
}

struct listing {
    FILE *out;
    int count;
};

static int32_t list_one(void *context, const struct lull_found *found)
{
    struct listing *l = context;
    const struct lull_criterion *t = found->criterion;
    pt_criterion_describe(t, l->out);
    fprintf(l->out, "    from %s\n", found->path);
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        fprintf(l->out, "    -p %s=%s  %s", p->name, p->default_value ? p->default_value : "?", p->help);
        if (p->type == LULL_PARAM_INT || p->type == LULL_PARAM_FLOAT)
            fprintf(l->out, " [%g to %g]", p->min, p->max);
        else if (p->type == LULL_PARAM_CHOICE)
            fprintf(l->out, " [%s]", p->choices);
        fprintf(l->out, "\n");
    }
    l->count++;
    return LULL_OK;
}

int pt_criterion_list(FILE *out, struct base_log *log)
{
    struct message_log messages = {log, LULL_LOG_ERROR}; /* what loading does to this process, nobody asked */
    struct lull_search search = {.log = log_message, .log_context = &messages};
    struct listing listing = {.out = out};
    lull_list(&search, list_one, &listing);
    return listing.count;
}
