#include "data/shown_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The next A or A-B of a list of them: returns what follows, or NULL where there is none or it is not well formed. It moves
 * no pointer of the caller: GCC 14.2 compiles that wrongly (-ftree-pre), and `0` would be no list of block 0. */
static const char *next_item(const char *at, unsigned long *lo, unsigned long *hi)
{
    char *end;
    if (*at < '0' || *at > '9')
        return NULL;
    *lo = *hi = strtoul(at, &end, 10);
    if (*end == '-' && end[1] >= '0' && end[1] <= '9')
        *hi = strtoul(end + 1, &end, 10);
    if (*end == ',' && end[1] != '\0')
        return end + 1;
    return *end == '\0' ? end : NULL;
}

static int is_list(const char *at)
{
    unsigned long lo, hi;
    do
        at = next_item(at, &lo, &hi);
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
        if ((at = next_item(at, &lo, &hi)) && id >= lo && id <= hi)
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
        if ((at = next_item(at, &lo, &hi)) && (!has_block(view, lo) || !has_block(view, hi)))
            return base_fail(err, BASE_EINVAL, "%s: has no block %lu", s->folder, has_block(view, lo) ? hi : lo);
    return 0;
}
