#include "data/shown.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "data/shown_source.h"

static int is_named(const struct ggn_shown *s, int index)
{
    for (int i = 0; i < index; i++)
        if (strcmp(s->views[i].name, s->views[index].name) == 0)
            return 0;
    return ggn_shown_plain_name(s->views[index].name);
}

/* The last part of the folder's path, with the kind behind it. */
static int name_view(struct ggn_shown *s, int index, const char *folder, struct base_err *err)
{
    struct ggn_shown_view *view = &s->views[index];
    int n = snprintf(view->name, sizeof view->name, "%s%s%s", base_file_name(folder), view->kind ? "." : "",
                     ggn_shown_kind_names[view->kind]);
    if (n >= (int)sizeof view->name || !is_named(s, index))
        return base_fail(err, BASE_EINVAL,
                         "%s: a view's folder needs a name of its own of letters, digits, '.', '_' and '-'", folder);
    return 0;
}

/* The folder of a view's pictures. A view must not be one of those that are made. */
static int make_folder(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                       struct base_err *err)
{
    char path[4096], folder[32];
    int rc = base_file_join(path, source->folder, "reference.png", err);
    if (!rc && base_file_is_inside(path, q->dir))
        rc = base_fail(err, BASE_EINVAL, "%s: lies among the pictures that the study shows", path);
    snprintf(folder, sizeof folder, "v%d", index);
    if (!rc)
        rc = base_file_join(path, q->dir, folder, err);
    return !rc ? base_make_folder(path, NULL, err) : rc;
}

static int make_view(const struct ggn_shown_request *q, const char *text, int index, struct ggn_shown *s,
                     struct base_threads *threads, struct base_err *err)
{
    char manifest[4096];
    struct ggn_shown_source source;
    int rc = ggn_shown_source_parse(text, &source, err);
    if (!rc)
        rc = name_view(s, index, source.folder, err);
    if (!rc)
        rc = make_folder(q, &source, index, err);
    if (!rc)
        rc = base_file_join(manifest, source.folder, "manifest.json", err);
    if (rc)
        return rc;
    if (q->task == GGN_SHOWN_VALIDATION && source.blocks)
        return base_fail(err, BASE_EINVAL, "%s: a validation shows whole pictures, not blocks", text);
    if (access(manifest, F_OK) != 0)
        return ggn_shown_pictures(q, &source, index, s, err);
    if (q->task == GGN_SHOWN_VALIDATION)
        return base_fail(err, BASE_EINVAL,
                         "%s: a validation takes folders of pictures; `ggn reconstruct` makes them from a sequence",
                         source.folder);
    if (s->views[index].kind)
        return base_fail(err, BASE_EINVAL,
                         "%s: a sequence has no denoised pictures; --kinds takes folders of renders with "
                         "--denoise",
                         source.folder);
    return ggn_shown_sequence(q, &source, index, &s->views[index], threads, err);
}

int ggn_shown_make(const struct ggn_shown_request *q, struct ggn_shown *s, struct base_threads *threads,
                   struct base_err *err)
{
    int kinds = q->n_kinds > 0 ? q->n_kinds : 1, n = q->n_views * kinds;
    if (n > GGN_SHOWN_MAX_VIEWS)
        return base_fail(err, BASE_EINVAL, "at most %d views, each kind counted", GGN_SHOWN_MAX_VIEWS);
    int rc = base_make_folder(q->dir, NULL, err);
    if (rc)
        return rc;
    s->views = calloc((size_t)n, sizeof *s->views);
    if (!s->views)
        return base_fail_nomem(err, q->dir);
    for (int i = 0; i < n && !rc; i++) {
        s->n_views = i + 1;
        s->views[i].frames = 1;
        s->views[i].kind = q->n_kinds > 0 ? q->kinds[i % kinds] : GGN_SHOWN_AS_IS;
        rc = make_view(q, q->views[i / kinds], i, s, threads, err);
    }
    return rc;
}
