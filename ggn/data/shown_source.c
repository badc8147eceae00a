#include "data/shown_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The next A or A-B of a list of them. 0: there is none, or it is not well formed; then **at is what is left. */
static int next_item(const char **at, unsigned long *lo, unsigned long *hi)
{
    char *end;
    if (**at < '0' || **at > '9')
        return 0;
    *lo = *hi = strtoul(*at, &end, 10);
    if (*end == '-' && end[1] >= '0' && end[1] <= '9')
        *hi = strtoul(end + 1, &end, 10);
    *at = *end == ',' && end[1] != '\0' ? end + 1 : end;
    return 1;
}

static int is_list(const char *text)
{
    unsigned long lo, hi;
    int items = 0;
    while (next_item(&text, &lo, &hi))
        items++;
    return items > 0 && *text == '\0';
}

int ggn_shown_source_parse(const char *text, struct ggn_shown_source *s, struct base_err *err)
{
    const char *colon = strrchr(text, ':');
    size_t n = strlen(text);
    s->blocks = NULL;
    if (colon && is_list(colon + 1)) {
        s->blocks = colon + 1;
        n = (size_t)(colon - text);
    }
    while (n > 1 && text[n - 1] == '/')
        n--;
    if (n >= sizeof s->folder)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", text);
    memcpy(s->folder, text, n);
    s->folder[n] = '\0';
    return 0;
}

int ggn_shown_source_has(const struct ggn_shown_source *s, uint32_t id)
{
    const char *at = s->blocks;
    unsigned long lo, hi;
    while (at && next_item(&at, &lo, &hi))
        if (id >= lo && id <= hi)
            return 1;
    return !s->blocks;
}

static int has_block(const struct ggn_shown_view *view, unsigned long id)
{
    for (int i = 0; i < view->n_blocks; i++)
        if (view->blocks[i].id == id)
            return 1;
    return 0;
}

int ggn_shown_source_check(const struct ggn_shown_source *s, const struct ggn_shown_view *view, struct base_err *err)
{
    const char *at = s->blocks;
    unsigned long lo, hi;
    while (at && next_item(&at, &lo, &hi))
        if (!has_block(view, lo) || !has_block(view, hi))
            return base_fail(err, BASE_EINVAL, "%s: has no block %lu", s->folder, has_block(view, lo) ? hi : lo);
    return 0;
}
