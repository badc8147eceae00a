#include "data/shown_source.h"

#include <string.h>

#include "base/list.h"

static int is_list(const char *at)
{
    unsigned long lo, hi;
    do
        at = base_list_next(at, &lo, &hi, NULL);
    while (at && *at != '\0');
    return at != NULL;
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
    unsigned long lo, hi;
    for (const char *at = s->blocks; at && *at != '\0';)
        if ((at = base_list_next(at, &lo, &hi, NULL)) && id >= lo && id <= hi)
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
    unsigned long lo, hi;
    for (const char *at = s->blocks; at && *at != '\0';)
        if ((at = base_list_next(at, &lo, &hi, NULL)) && (!has_block(view, lo) || !has_block(view, hi)))
            return base_fail(err, BASE_EINVAL, "%s: has no block %lu", s->folder, has_block(view, lo) ? hi : lo);
    return 0;
}
