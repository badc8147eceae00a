#include "study/prepare.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"
#include "study/plan.h"
#include "study/source.h"
#include "study/token.h"

static int make_dir(const char *path, struct base_err *err)
{
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    return 0;
}

/* The last part of the folder's path, with the kind behind it. */
static int name_view(struct ggn_study *s, int index, const char *folder, struct base_err *err)
{
    struct ggn_study_view *view = &s->views[index];
    const char *slash = strrchr(folder, '/'), *name = slash && slash[1] ? slash + 1 : folder;
    int n = snprintf(view->name, sizeof view->name, "%s%s%s", name, view->kind ? "." : "", ggn_study_kind_names[view->kind]);
    if (n >= (int)sizeof view->name || !ggn_study_plain_name(view->name) || ggn_study_find_view(s, view->name) != index)
        return base_fail(err, BASE_EINVAL,
                         "%s: a view's folder needs a name of its own of letters, digits, '.', '_' and '-'", folder);
    return 0;
}

static int prepare_view(const struct ggn_study_request_views *q, const char *text, int index, struct ggn_study *s,
                        struct base_threads *threads, struct base_err *err)
{
    char path[4096], folder[64];
    struct ggn_study_source source;
    int rc = ggn_study_source_parse(text, &source, err);
    if (!rc)
        rc = name_view(s, index, source.folder, err);
    snprintf(folder, sizeof folder, "stimuli/v%d", index);
    if (!rc)
        rc = base_file_join(path, source.folder, "reference.png", err);
    if (!rc)
        rc = ggn_study_protect(q->dir, path, err);
    if (!rc)
        rc = base_file_join(path, q->dir, folder, err);
    if (!rc)
        rc = make_dir(path, err);
    if (!rc)
        rc = base_file_join(path, source.folder, "manifest.json", err);
    if (rc)
        return rc;
    if (s->task == GGN_STUDY_VALIDATION && source.blocks)
        return base_fail(err, BASE_EINVAL, "%s: a validation shows whole pictures, not blocks", text);
    if (access(path, F_OK) != 0)
        return ggn_study_prepare_pictures(q, &source, index, s, err);
    if (s->task == GGN_STUDY_VALIDATION)
        return base_fail(err, BASE_EINVAL,
                         "%s: a validation takes folders of pictures; `ggn reconstruct` makes them from a sequence",
                         source.folder);
    if (s->views[index].kind)
        return base_fail(err, BASE_EINVAL,
                         "%s: a sequence has no denoised pictures; --kinds takes folders of renders with "
                         "--denoise",
                         source.folder);
    return ggn_study_prepare_sequence(q, &source, index, &s->views[index], threads, err);
}

static int copy_texts(const struct ggn_study_request_views *q, struct base_err *err)
{
    char path[4096], *text = NULL;
    size_t size;
    int rc = base_file_join(path, q->page_dir, "texts.en.json", err);
    if (!rc)
        rc = base_file_read(path, 1 << 20, &text, &size, err);
    if (!rc)
        rc = base_file_join(path, q->dir, "texts.json", err);
    if (!rc && size > 0 && text[size - 1] == '\n')
        text[size - 1] = '\0';
    if (!rc)
        rc = base_file_write_line(path, text, err);
    free(text);
    return rc;
}

int ggn_study_prepare(const struct ggn_study_request_views *q, struct ggn_study *s, struct base_threads *threads,
                      struct base_err *err)
{
    char path[4096];
    int rc = make_dir(q->dir, err);
    if (!rc)
        rc = base_file_join(path, q->dir, "study.json", err);
    if (!rc && access(path, F_OK) == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: there is a study already", q->dir);
    if (!rc)
        rc = base_file_join(path, q->dir, "texts.json", err);
    if (!rc && access(path, F_OK) == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: is there and would be replaced; move it away, and back after init", path);
    if (!rc)
        rc = base_file_join(path, q->dir, "stimuli", err);
    if (!rc)
        rc = make_dir(path, err);
    if (!rc)
        rc = ggn_study_token(s->id, 32, err);
    int kinds = q->n_kinds > 0 ? q->n_kinds : 1, n = q->n_views * kinds;
    if (!rc && n > GGN_STUDY_MAX_VIEWS)
        rc = base_fail(err, BASE_EINVAL, "at most %d views, each kind counted", GGN_STUDY_MAX_VIEWS);
    s->views = calloc((size_t)n, sizeof *s->views);
    if (!rc && !s->views)
        rc = base_fail_nomem(err, q->dir);
    for (int i = 0; i < n && !rc; i++) {
        s->n_views = i + 1;
        s->views[i].frames = 1;
        s->views[i].kind = q->n_kinds > 0 ? q->kinds[i % kinds] : GGN_STUDY_AS_IS;
        rc = prepare_view(q, q->views[i / kinds], i, s, threads, err);
    }
    if (!rc)
        rc = ggn_study_fit_intervals(s, err);
    if (!rc && ggn_study_plan_count(s) > GGN_STUDY_MAX_TRIALS)
        rc = base_fail(err, BASE_EINVAL, "more than %d trials for one person: take fewer views, trials or repeats",
                       GGN_STUDY_MAX_TRIALS);
    if (!rc)
        rc = copy_texts(q, err);
    return !rc ? ggn_study_write(q->dir, s, err) : rc;
}
