#include "study/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/json.h"

enum { MAX_TEXT = 1 << 26 };

const char *const ggn_study_task_names[3] = {"adjustment", "2ifc", "validation"};
const char *const ggn_study_kind_names[GGN_STUDY_KINDS] = {"", "noisy", "denoised", "blend"};
const double ggn_study_min_ms[3] = {300.0, 150.0, 500.0};

void ggn_study_release(struct ggn_study *s)
{
    for (int v = 0; v < s->n_views && s->views; v++) {
        for (int b = 0; b < s->views[v].n_blocks && s->views[v].blocks; b++)
            free(s->views[v].blocks[b].levels);
        free(s->views[v].blocks);
    }
    free(s->views);
    free(s->conditions);
    *s = (struct ggn_study){0};
}

int ggn_study_plain_name(const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || n >= GGN_STUDY_NAME || name[0] == '.')
        return 0;
    return strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") == n;
}

int ggn_study_plain_line(const char *text)
{
    size_t n = strlen(text);
    if (n >= GGN_STUDY_LINE || strspn(text, " ") == n)
        return 0;
    for (; *text; text++)
        if ((unsigned char)*text < ' ' || *text == 127)
            return 0;
    return 1;
}

int ggn_study_level(const struct ggn_study_block *block, uint32_t spp)
{
    for (int i = 0; i < block->n_levels; i++)
        if (block->levels[i] == spp)
            return i;
    return -1;
}

/* Bytes of a view's name without its kind; 0: it does not end in it. */
static size_t scene_length(const struct ggn_study_view *v)
{
    const char *kind = ggn_study_kind_names[v->kind];
    size_t n = strlen(v->name), k = v->kind ? strlen(kind) + 1 : 0;
    return n > k && (k == 0 || (v->name[n - k] == '.' && strcmp(v->name + n - k + 1, kind) == 0)) ? n - k : 0;
}

int ggn_study_same_scene(const struct ggn_study_view *a, const struct ggn_study_view *b)
{
    size_t n = scene_length(a);
    return n == scene_length(b) && strncmp(a->name, b->name, n) == 0;
}

int ggn_study_shown_frames(const struct ggn_study *s) { return (int)ceil(s->show_ms * s->fps / 1000.0 - 1e-9); }

int ggn_study_fit_intervals(struct ggn_study *s, struct base_err *err)
{
    enum { STILL_MS = 700, FPS = 24, LOOPS = 2 };
    int longest = 1;
    for (int v = 0; v < s->n_views; v++)
        longest = s->views[v].frames > longest ? s->views[v].frames : longest;
    if (longest == 1) {
        if (s->fps)
            return base_fail(err, BASE_EINVAL, "--fps does nothing: no view is a clip");
        s->show_ms = s->show_ms ? s->show_ms : STILL_MS;
        return 0;
    }
    s->fps = s->fps ? s->fps : FPS;
    s->show_ms = s->show_ms ? s->show_ms : (LOOPS * longest * 1000 + s->fps - 1) / s->fps;
    int shown = ggn_study_shown_frames(s);
    if (shown < longest || shown > GGN_STUDY_MAX_SHOWN)
        return base_fail(err, BASE_EINVAL, "%d ms are %d frames at %d a second, wanted %d (one loop) to %d: change --show",
                         s->show_ms, shown, s->fps, longest, GGN_STUDY_MAX_SHOWN);
    return 0;
}

int ggn_study_find_view(const struct ggn_study *study, const char *name)
{
    for (int i = 0; i < study->n_views; i++)
        if (strcmp(study->views[i].name, name) == 0)
            return i;
    return -1;
}

/* --- reading --- */

struct reader {
    const char *path;
    struct base_err *err;
};

/* A number in [lo, hi]; whole: it must be one. */
static int number(const struct reader *r, const cJSON *o, const char *name, double lo, double hi, int whole, double *out)
{
    if (whole ? base_json_get_whole(o, name, lo, hi, out) : base_json_get(o, name, lo, hi, out))
        return 0;
    return base_fail(r->err, BASE_EINVAL, "%s: '%s' must be a %snumber in %g … %g", r->path, name, whole ? "whole " : "", lo,
                     hi);
}

static int whole(const struct reader *r, const cJSON *o, const char *name, double lo, double hi, int *out)
{
    double value = 0.0;
    int rc = number(r, o, name, lo, hi, 1, &value);
    *out = (int)value;
    return rc;
}

static int pixels(const struct reader *r, const cJSON *o, const char *name, double lo, uint32_t *out)
{
    double value = 0.0;
    int rc = number(r, o, name, lo, 32768.0, 1, &value);
    *out = (uint32_t)value;
    return rc;
}

static int plain_name(const struct reader *r, const cJSON *v, char out[GGN_STUDY_NAME])
{
    if (!cJSON_IsString(v) || !ggn_study_plain_name(v->valuestring))
        return base_fail(r->err, BASE_EINVAL, "%s: a name must be 1 … %d letters, digits, '.', '_' or '-'", r->path,
                         GGN_STUDY_NAME - 1);
    strcpy(out, v->valuestring);
    return 0;
}

/* The array `name` of o, with 1 … max entries; NULL and an error otherwise. */
static const cJSON *list(const struct reader *r, const cJSON *o, const char *name, int max)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    int n = cJSON_IsArray(v) ? cJSON_GetArraySize(v) : 0;
    if (n >= 1 && n <= max)
        return v;
    base_fail(r->err, BASE_EINVAL, "%s: '%s' must be a list of 1 … %d", r->path, name, max);
    return NULL;
}

static int read_block(const struct reader *r, const cJSON *o, const struct ggn_study_view *view, struct ggn_study_block *b)
{
    const cJSON *levels = list(r, o, "levels", GGN_STUDY_MAX_LEVELS), *level;
    static const char *const names[5] = {"id", "x0", "y0", "x1", "y1"};
    uint32_t *const into[5] = {&b->id, &b->x0, &b->y0, &b->x1, &b->y1};
    int rc = levels ? 0 : BASE_EINVAL;
    for (int i = 0; i < 5 && !rc; i++)
        rc = pixels(r, o, names[i], i >= 3, into[i]);
    if (rc)
        return rc;
    if (b->x1 <= b->x0 || b->y1 <= b->y0 || b->x1 > view->width || b->y1 > view->height)
        return base_fail(r->err, BASE_EINVAL, "%s: block %u does not lie inside %s", r->path, b->id, view->name);
    b->levels = malloc((size_t)cJSON_GetArraySize(levels) * sizeof *b->levels);
    if (!b->levels)
        return base_fail_nomem(r->err, r->path);
    cJSON_ArrayForEach (level, levels) {
        double spp = cJSON_IsNumber(level) ? level->valuedouble : 0.0;
        if (!(spp >= 1.0 && spp <= 1e9) || floor(spp) != spp || (b->n_levels > 0 && spp <= b->levels[b->n_levels - 1]))
            return base_fail(r->err, BASE_EINVAL, "%s: levels of block %u must be rising whole numbers from 1", r->path,
                             b->id);
        b->levels[b->n_levels++] = (uint32_t)spp;
    }
    return 0;
}

/* What a view that shows a denoised render has besides. */
static int read_kind(const struct reader *r, const cJSON *o, enum ggn_study_task task, struct ggn_study_view *view)
{
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(o, "kind");
    int k = GGN_STUDY_KINDS - 1;
    if (!kind)
        return 0;
    while (k > 0 && !(cJSON_IsString(kind) && strcmp(kind->valuestring, ggn_study_kind_names[k]) == 0))
        k--;
    view->kind = (enum ggn_study_kind)k;
    if (k > 0 && task == GGN_STUDY_TWO_INTERVAL && scene_length(view) > 0)
        return 0;
    return base_fail(r->err, BASE_EINVAL, "%s: 'kind' must be noisy, denoised or blend, %s end in it, and the task be 2ifc",
                     r->path, view->name);
}

static int read_frames(const struct reader *r, const cJSON *o, enum ggn_study_task task, struct ggn_study_view *view)
{
    view->frames = 1;
    if (!cJSON_HasObjectItem(o, "frames"))
        return 0;
    if (task != GGN_STUDY_TWO_INTERVAL)
        return base_fail(r->err, BASE_EINVAL, "%s: only two intervals show clips, as %s is one", r->path, view->name);
    return whole(r, o, "frames", 2, GGN_STUDY_MAX_FRAMES, &view->frames);
}

static int read_view(const struct reader *r, const cJSON *o, enum ggn_study_task task, struct ggn_study_view *view)
{
    int rc = plain_name(r, cJSON_GetObjectItemCaseSensitive(o, "name"), view->name);
    if (!rc)
        rc = pixels(r, o, "width", 1, &view->width);
    if (!rc)
        rc = pixels(r, o, "height", 1, &view->height);
    if (!rc)
        rc = read_kind(r, o, task, view);
    if (!rc)
        rc = read_frames(r, o, task, view);
    if (rc || task == GGN_STUDY_VALIDATION)
        return rc;
    const cJSON *blocks = list(r, o, "blocks", GGN_STUDY_MAX_BLOCKS), *block;
    if (!blocks)
        return BASE_EINVAL;
    view->blocks = calloc((size_t)cJSON_GetArraySize(blocks), sizeof *view->blocks);
    if (!view->blocks)
        return base_fail_nomem(r->err, r->path);
    cJSON_ArrayForEach (block, blocks) {
        struct ggn_study_block *b = &view->blocks[view->n_blocks++];
        rc = read_block(r, block, view, b);
        if (!rc && view->n_blocks > 1 && b->id <= b[-1].id)
            rc = base_fail(r->err, BASE_EINVAL, "%s: ids of blocks must rise", r->path);
        if (rc)
            return rc;
    }
    return 0;
}

static int read_views(const struct reader *r, const cJSON *root, struct ggn_study *s)
{
    const cJSON *views = list(r, root, "views", GGN_STUDY_MAX_VIEWS), *view;
    if (!views)
        return BASE_EINVAL;
    s->views = calloc((size_t)cJSON_GetArraySize(views), sizeof *s->views);
    if (!s->views)
        return base_fail_nomem(r->err, r->path);
    cJSON_ArrayForEach (view, views) {
        struct ggn_study_view *v = &s->views[s->n_views++];
        int rc = read_view(r, view, s->task, v);
        if (!rc && ggn_study_find_view(s, v->name) != s->n_views - 1)
            rc = base_fail(r->err, BASE_EINVAL, "%s: two views are called %s", r->path, v->name);
        if (rc)
            return rc;
    }
    return 0;
}

static int read_conditions(const struct reader *r, const cJSON *root, struct ggn_study *s)
{
    const cJSON *conditions = list(r, root, "conditions", GGN_STUDY_MAX_CONDITIONS), *condition;
    if (!conditions)
        return BASE_EINVAL;
    s->conditions = calloc((size_t)cJSON_GetArraySize(conditions), sizeof *s->conditions);
    if (!s->conditions)
        return base_fail_nomem(r->err, r->path);
    cJSON_ArrayForEach (condition, conditions) {
        int rc = plain_name(r, condition, s->conditions[s->n_conditions]);
        if (rc)
            return rc;
        s->n_conditions++;
    }
    return 0;
}

static int read_head(const struct reader *r, const cJSON *root, struct ggn_study *s)
{
    const cJSON *format = cJSON_GetObjectItemCaseSensitive(root, "format"),
                *id = cJSON_GetObjectItemCaseSensitive(root, "id");
    const cJSON *task = cJSON_GetObjectItemCaseSensitive(root, "task");
    int version, found = 0;
    double seed = 0.0;
    if (!cJSON_IsString(format) || strcmp(format->valuestring, "lull-study") != 0)
        return base_fail(r->err, BASE_EINVAL, "%s: not a study file", r->path);
    if (!cJSON_IsString(id) || strlen(id->valuestring) != 32 || strspn(id->valuestring, "0123456789abcdef") != 32)
        return base_fail(r->err, BASE_EINVAL, "%s: 'id' must be 32 hex digits", r->path);
    strcpy(s->id, id->valuestring);
    for (int i = 0; i < 3 && cJSON_IsString(task) && !found; i++) {
        found = strcmp(task->valuestring, ggn_study_task_names[i]) == 0;
        s->task = (enum ggn_study_task)i;
    }
    if (!found)
        return base_fail(r->err, BASE_EINVAL, "%s: 'task' must be adjustment, 2ifc or validation", r->path);
    int rc = whole(r, root, "version", 1, 1, &version);
    if (!rc)
        rc = number(r, root, "seed", 0, 9007199254740991.0, 1, &seed);
    s->seed = (uint64_t)seed;
    return rc;
}

/* What studies made before these members existed do without. */
static int read_later_members(const struct reader *r, const cJSON *root, struct ggn_study *s)
{
    static const char *const names[2] = {"asked_by", "contact"};
    char *const into[2] = {s->asked_by, s->contact};
    int rc = 0;
    s->max_fast = 1.0;
    if (cJSON_HasObjectItem(root, "fps"))
        rc = whole(r, root, "fps", 1, GGN_STUDY_MAX_FPS, &s->fps);
    if (!rc && cJSON_HasObjectItem(root, "min_ms"))
        rc = number(r, root, "min_ms", 0, 60000, 0, &s->min_ms);
    if (!rc && cJSON_HasObjectItem(root, "max_fast"))
        rc = number(r, root, "max_fast", 0, 1, 0, &s->max_fast);
    for (int i = 0; i < 2 && !rc; i++) {
        const cJSON *v = cJSON_GetObjectItemCaseSensitive(root, names[i]);
        if (v && (!cJSON_IsString(v) || !ggn_study_plain_line(v->valuestring)))
            rc = base_fail(r->err, BASE_EINVAL, "%s: '%s' must be one line of at most %d bytes", r->path, names[i],
                           GGN_STUDY_LINE - 1);
        else if (v)
            strcpy(into[i], v->valuestring);
    }
    return rc;
}

static int read_numbers(const struct reader *r, const cJSON *root, struct ggn_study *s)
{
    const struct {
        const char *name;
        double lo, hi;
        int *whole; /* one of the two */
        double *real;
    } members[] = {{"trials", 1, 1000, &s->trials, NULL},
                   {"repeats", 1, 100, &s->repeats, NULL},
                   {"catch_share", 0, 0.5, NULL, &s->catch_share},
                   {"show_ms", 1, 60000, &s->show_ms, NULL},
                   {"gap_ms", 1, 60000, &s->gap_ms, NULL},
                   {"break_every", 0, 100000, &s->break_every, NULL},
                   {"min_catch_passed", 0, 1, NULL, &s->min_catch_passed},
                   {"max_untouched", 0, 1, NULL, &s->max_untouched}};
    int rc = 0;
    for (size_t i = 0; i < sizeof members / sizeof members[0] && !rc; i++)
        rc = members[i].whole ? whole(r, root, members[i].name, members[i].lo, members[i].hi, members[i].whole)
                              : number(r, root, members[i].name, members[i].lo, members[i].hi, 0, members[i].real);
    return rc;
}

int ggn_study_parse(const char *path, const char *text, size_t size, struct ggn_study *study, struct base_err *err)
{
    struct ggn_study s = {0};
    struct reader r = {path, err};
    struct base_err why = {0};
    cJSON *root = cJSON_ParseWithLength(text, size);
    int rc = cJSON_IsObject(root) ? 0 : base_fail(err, BASE_EINVAL, "%s: not a JSON object", path);
    if (!rc)
        rc = read_head(&r, root, &s);
    if (!rc)
        rc = read_numbers(&r, root, &s);
    if (!rc)
        rc = read_later_members(&r, root, &s);
    if (!rc)
        rc = read_views(&r, root, &s);
    if (!rc && ggn_study_fit_intervals(&s, &why))
        rc = base_fail(err, BASE_EINVAL, "%s: %s", path, why.text);
    if (!rc && s.task == GGN_STUDY_VALIDATION)
        rc = read_conditions(&r, root, &s);
    cJSON_Delete(root);
    if (!rc)
        *study = s;
    else
        ggn_study_release(&s);
    return rc;
}

int ggn_study_read(const char *dir, struct ggn_study *study, struct base_err *err)
{
    char path[4096], *text = NULL;
    size_t size;
    int rc = base_file_join(path, dir, "study.json", err);
    if (!rc)
        rc = base_file_read(path, MAX_TEXT, &text, &size, err);
    if (!rc)
        rc = ggn_study_parse(path, text, size, study, err);
    free(text);
    return rc;
}

/* --- writing --- */

static void add_view(cJSON *views, const struct ggn_study *s, const struct ggn_study_view *v, int *failed)
{
    cJSON *o = base_json_object(views, NULL, failed), *blocks = NULL;
    base_json_text(o, "name", v->name, failed);
    base_json_number(o, "width", v->width, failed);
    base_json_number(o, "height", v->height, failed);
    if (v->kind)
        base_json_text(o, "kind", ggn_study_kind_names[v->kind], failed);
    if (v->frames > 1)
        base_json_number(o, "frames", v->frames, failed);
    if (s->task != GGN_STUDY_VALIDATION)
        blocks = base_json_array(o, "blocks", failed);
    for (int i = 0; i < v->n_blocks; i++) {
        const struct ggn_study_block *b = &v->blocks[i];
        cJSON *block = base_json_object(blocks, NULL, failed);
        base_json_number(block, "id", b->id, failed);
        base_json_number(block, "x0", b->x0, failed);
        base_json_number(block, "y0", b->y0, failed);
        base_json_number(block, "x1", b->x1, failed);
        base_json_number(block, "y1", b->y1, failed);
        cJSON *levels = base_json_array(block, "levels", failed);
        for (int l = 0; l < b->n_levels; l++)
            base_json_number(levels, NULL, b->levels[l], failed);
    }
}

char *ggn_study_print(const struct ggn_study *s)
{
    int failed = 0;
    cJSON *root = cJSON_CreateObject(), *conditions = NULL;
    base_json_text(root, "format", "lull-study", &failed);
    base_json_number(root, "version", 1, &failed);
    base_json_text(root, "id", s->id, &failed);
    base_json_text(root, "task", ggn_study_task_names[s->task], &failed);
    base_json_number(root, "seed", (double)s->seed, &failed);
    base_json_number(root, "trials", s->trials, &failed);
    base_json_number(root, "repeats", s->repeats, &failed);
    base_json_number(root, "catch_share", s->catch_share, &failed);
    base_json_number(root, "show_ms", s->show_ms, &failed);
    base_json_number(root, "gap_ms", s->gap_ms, &failed);
    if (s->fps)
        base_json_number(root, "fps", s->fps, &failed);
    base_json_number(root, "break_every", s->break_every, &failed);
    base_json_number(root, "min_catch_passed", s->min_catch_passed, &failed);
    base_json_number(root, "max_untouched", s->max_untouched, &failed);
    base_json_number(root, "min_ms", s->min_ms, &failed);
    base_json_number(root, "max_fast", s->max_fast, &failed);
    if (*s->asked_by)
        base_json_text(root, "asked_by", s->asked_by, &failed);
    if (*s->contact)
        base_json_text(root, "contact", s->contact, &failed);
    if (s->task == GGN_STUDY_VALIDATION)
        conditions = base_json_array(root, "conditions", &failed);
    for (int i = 0; i < s->n_conditions; i++)
        base_json_text(conditions, NULL, s->conditions[i], &failed);
    cJSON *views = base_json_array(root, "views", &failed);
    for (int i = 0; i < s->n_views; i++)
        add_view(views, s, &s->views[i], &failed);
    char *text = root && !failed ? cJSON_Print(root) : NULL;
    cJSON_Delete(root);
    return text;
}

int ggn_study_write(const char *dir, const struct ggn_study *s, struct base_err *err)
{
    char path[4096], *text = ggn_study_print(s);
    int rc = text ? base_file_join(path, dir, "study.json", err) : base_fail_nomem(err, dir);
    if (!rc)
        rc = base_file_write_line(path, text, err);
    free(text);
    return rc;
}

/* --- what nothing may be written onto --- */

int ggn_study_protect(const char *dir, const char *output, struct base_err *err)
{
    static const char *const own[] = {"study.json", "texts.json", "token", "study.db", "study.db-wal", "study.db-shm"};
    char path[4096];
    int rc = base_file_join(path, dir, "stimuli", err);
    if (!rc && base_file_is_inside(output, path))
        rc = base_fail(err, BASE_EINVAL, "%s: lies among the pictures that the study shows", output);
    for (size_t i = 0; i < sizeof own / sizeof own[0] && !rc; i++) {
        rc = base_file_join(path, dir, own[i], err);
        if (!rc && base_file_is_same(output, path))
            rc = base_fail(err, BASE_EINVAL, "%s: this is the study's own %s, it would be lost", output, own[i]);
    }
    return rc;
}
