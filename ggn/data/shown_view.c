#include "data/shown_view.h"

#include <stdlib.h>
#include <string.h>

const char *const ggn_shown_kind_names[GGN_SHOWN_KINDS + 1] = {"", "noisy", "denoised", "blend", NULL};

void ggn_shown_release(struct ggn_shown *s)
{
    for (int v = 0; v < s->n_views && s->views; v++) {
        for (int b = 0; b < s->views[v].n_blocks && s->views[v].blocks; b++)
            free(s->views[v].blocks[b].levels);
        free(s->views[v].blocks);
    }
    free(s->views);
    free(s->conditions);
    *s = (struct ggn_shown){0};
}

int ggn_shown_plain_name(const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || n >= GGN_SHOWN_NAME || name[0] == '.')
        return 0;
    return strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") == n;
}
