#include "actions.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"
#include "base/list.h"
#include "base/options.h"
#include "base/text.h"
#include "image/exr.h"
#include "render/checkpoint.h"
#include "render/output.h"
#include "scene/arena.h"

enum { FRAMES_MAX = 1000000, PATH_BYTES_MAX = 1 << 26, NAME_ROOM = 4096, LINE_ROOM = 512 };

int pt_shot_parse_frames(const char *text, struct pt_shot *s, struct base_err *err)
{
    size_t room = 0;
    unsigned long first, last, step;
    const char *at = text;
    do {
        at = base_list_next(at, &first, &last, &step);
        if (!at || last < first || last > PT_SHOT_LAST_FRAME || step == 0 || step > PT_SHOT_LAST_FRAME ||
            (s->count > 0 && first <= (unsigned long)s->frames[s->count - 1]))
            return base_fail(err, BASE_EINVAL, "--frames %s: expected a rising list like 1-24, 1,5,9 or 1-24:2", text);
        if ((last - first) / step >= FRAMES_MAX - s->count)
            return base_fail(err, BASE_EINVAL, "--frames %s: more than %d frames", text, FRAMES_MAX);
        for (unsigned long frame = first; frame <= last; frame += step) {
            if (!pt_grow((void **)&s->frames, &room, s->count, sizeof *s->frames))
                return base_fail_nomem(err, "frames");
            s->frames[s->count++] = (int)frame;
        }
    } while (*at != '\0');
    return 0;
}

static const char PATH_HEAD[] = "frame;eye;at;up;fov";

/* One line, NUL-terminated, in which ';' becomes a blank. */
static int parse_view(char *line, int *frame, struct pt_view *view, struct base_err *err)
{
    char *field[5] = {line};
    int64_t n;
    for (int i = 1; i < 5; i++) {
        char *separator = strchr(field[i - 1], ';');
        if (!separator)
            return base_fail(err, BASE_EINVAL, "expected five fields with ';' between them");
        *separator = i == 2 || i == 3 ? ' ' : '\0'; /* eye, at and up stay together */
        field[i] = separator + 1;
    }
    if (!base_parse_integer(field[0], 0, PT_SHOT_LAST_FRAME, &n))
        return base_fail(err, BASE_EINVAL, "expected a frame from 0 to %d", PT_SHOT_LAST_FRAME);
    *frame = (int)n;
    field[4] += strspn(field[4], " ");
    if (*field[4] != '\0' && !base_parse_real(field[4], 1e-12, 179.9, &view->fov_deg))
        return base_fail(err, BASE_EINVAL, "expected a field of view from 1e-12 to 179.9 degrees, or nothing");
    return pt_cli_look_at(field[1], view, err);
}

static int parse_line(const struct base_lines *lines, const char *begin, size_t length, struct pt_shot *s,
                      struct base_err *err)
{
    char line[LINE_ROOM];
    struct base_err why = {0};
    struct pt_view view = {0};
    int frame = 0;
    if (length >= sizeof line)
        return base_fail(err, BASE_EINVAL, "%s:%zu: expected a line below %d bytes", lines->name, lines->number, LINE_ROOM);
    memcpy(line, begin, length);
    line[length] = '\0';
    if (lines->number == 1)
        return strcmp(line, PATH_HEAD) == 0 ? 0 : base_fail(err, BASE_EINVAL, "%s:1: expected %s", lines->name, PATH_HEAD);
    int rc = parse_view(line, &frame, &view, &why);
    if (!rc && s->count > 0 && frame <= s->frames[s->count - 1])
        rc = base_fail(&why, BASE_EINVAL, "expected rising frames");
    if (rc)
        return base_fail(err, rc, "%s:%zu: %s", lines->name, lines->number, why.text);
    s->frames[s->count] = frame;
    s->views[s->count++] = view;
    return 0;
}

int pt_shot_parse_path(const char *name, const char *text, size_t size, struct pt_shot *s, struct base_err *err)
{
    struct base_lines lines;
    const char *line;
    size_t length;
    int rc;
    base_lines_init(&lines, name, text, size);
    const size_t room = base_lines_left(&lines) + 1;
    s->frames = calloc(room, sizeof *s->frames);
    s->views = calloc(room, sizeof *s->views);
    if (!s->frames || !s->views)
        return base_fail_nomem(err, "camera path");
    while (!(rc = base_lines_next(&lines, &line, &length, err)) && line)
        if ((rc = parse_line(&lines, line, length, s, err)) != 0)
            break;
    return rc             ? rc
           : s->count > 0 ? 0
                          : base_fail(err, BASE_EINVAL, "%s: expected %s and a line for each frame", name, PATH_HEAD);
}

/* Of the path, the frames that --frames lists. */
static int choose(struct pt_shot *path, const struct pt_shot *list, const char *name, struct base_err *err)
{
    size_t k = 0;
    for (size_t i = 0; i < list->count; i++) {
        while (k < path->count && path->frames[k] < list->frames[i])
            k++;
        if (k == path->count || path->frames[k] != list->frames[i])
            return base_fail(err, BASE_EINVAL, "%s: frame %d is not on this path", name, list->frames[i]);
        path->frames[i] = path->frames[k]; /* i <= k: both rise */
        path->views[i] = path->views[k];
    }
    path->count = list->count;
    return 0;
}

static int read_path(const struct pt_shot_plan *plan, struct pt_shot *s, struct base_err *err)
{
    char *text;
    size_t size;
    int rc = base_file_read(plan->camera_path, PATH_BYTES_MAX, &text, &size, err);
    if (rc)
        return rc;
    rc = pt_shot_parse_path(plan->camera_path, text, size, s, err);
    free(text);
    if (rc || !plan->frames)
        return rc;
    struct pt_shot list = {0};
    rc = pt_shot_parse_frames(plan->frames, &list, err);
    if (!rc)
        rc = choose(s, &list, plan->camera_path, err);
    pt_shot_release(&list);
    return rc;
}

/* Frames would replace each other's files. */
static int check_names(const struct pt_cli *cli, const struct pt_shot *s, struct base_err *err)
{
    for (int i = 0; i < cli->outputs.count && s->count > 1; i++)
        if (cli->outputs.list[i].path != cli->shot.plan && !pt_frame_has_number(cli->outputs.list[i].path))
            return base_fail(err, BASE_EINVAL, "--%s %s: several frames need a number in the name, as in out_%%04d.exr",
                             cli->outputs.list[i].option, cli->outputs.list[i].path);
    for (size_t i = 0; i < s->count; i++) {
        char name[NAME_ROOM];
        int rc = pt_frame_name(cli->paths[PT_SCENE], s->frames[i], name, sizeof name, err);
        if (!rc && base_file_check_input(name, err) != 0)
            rc = err->code = BASE_EINVAL;
        if (rc)
            return rc;
    }
    return 0;
}

void pt_shot_release(struct pt_shot *s)
{
    free(s->frames);
    free(s->views);
    *s = (struct pt_shot){0};
}

static int render_frame(struct pt_open *o, struct pt_shot_frame *f, const struct pt_shot_table *table, const char *place,
                        int *status, struct base_err *err)
{
    const char *output = f->paths[PT_OUTPUT], *checkpoint = f->paths[PT_CHECKPOINT];
    struct stat st;
    int rc = 0;
    if (pt_output_is_ours(output) && pt_exr_is_whole(output)) {
        base_log_note(o->log, "frame %d: %s is there", f->number, output);
        return 0;
    }
    if (table && !(f->block_spp = pt_shot_table_frame(table, f->number)))
        rc = base_fail(err, BASE_EINVAL, "%s: frame %d is not in it", o->cli->shot.table, f->number);
    f->table = table;
    if (!rc)
        rc = base_file_check_kind(checkpoint, &pt_checkpoint_kind, err);
    if (rc)
        return rc;
    base_log_note(o->log, "frame %d (%s)", f->number, place);
    f->resume = checkpoint && stat(checkpoint, &st) == 0 && st.st_size > 0; /* an empty one is what a full disk left */
    rc = pt_action_frame(o, f, NULL, status, err);
    if (!rc && *status == 0 && checkpoint && unlink(checkpoint) != 0 && errno != ENOENT)
        base_log_say(o->log, "%s: cannot be removed, though its frame is done", checkpoint);
    return rc;
}

static int render_all(struct pt_open *o, const struct pt_shot *s, size_t first, size_t step, int *status,
                      struct base_err *err)
{
    const char *name = o->cli->shot.table;
    struct pt_shot_table table = {0};
    int rc = name ? pt_shot_table_read(name, &table, err) : 0;
    for (size_t i = first; i < s->count && !rc && *status == 0; i += step) {
        struct pt_shot_frame f;
        char place[64];
        snprintf(place, sizeof place, "%zu of %zu", i + 1, s->count);
        rc = pt_frame_init(&f, o->cli, s->frames[i], s->views ? &s->views[i] : NULL, err);
        if (!rc)
            rc = render_frame(o, &f, name ? &table : NULL, place, status, err);
        pt_frame_release(&f);
    }
    pt_shot_table_release(&table);
    return rc;
}

int pt_shot_run(const struct pt_cli *cli, struct job *job, struct base_log *log, int *status, struct base_err *err)
{
    struct pt_shot s = {0};
    struct pt_open open = {0};
    int rc = cli->shot.camera_path ? read_path(&cli->shot, &s, err) : pt_shot_parse_frames(cli->shot.frames, &s, err);
    if (!rc)
        rc = check_names(cli, &s, err);
    if (!rc && cli->shot.plan && job)
        rc = base_fail(err, BASE_EINVAL, "--plan-shot is the work of one process: leave out mpirun");
    if (!rc)
        rc = pt_open_init(&open, cli, job, log, err);
    if (!rc)
        rc = cli->shot.plan ? pt_shot_plan(&s, &open, status, err)
                            : render_all(&open, &s, (size_t)job_rank(job), (size_t)job_count(job), status, err);
    pt_open_release(&open);
    pt_shot_release(&s);
    return rc;
}
