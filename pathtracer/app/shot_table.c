#include "frame.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/text.h"

static const char FIRST_LINE[] = "lull-shot-table 1";
enum { MAX_BYTES = 1 << 28 };

static int bad(const char *name, size_t line, const char *what, struct base_err *err)
{
    return base_fail(err, BASE_EINVAL, "%s:%zu: expected %s", name, line, what);
}

/* An integer in [low, high] and the character behind it, which is passed; '\0' at the end. */
static int take(const char **at, const char *end, int64_t low, int64_t high, char *behind, int64_t *out)
{
    int64_t value = 0;
    const char *p = *at;
    for (; p < end && *p >= '0' && *p <= '9'; p++)
        if ((value = 10 * value + (*p - '0')) > high)
            return 0;
    if (p == *at || value < low)
        return 0;
    *out = value;
    *behind = p < end ? *p : '\0';
    *at = p + (p < end);
    return 1;
}

static size_t count_in(const char *p, const char *end, char c)
{
    size_t n = 0;
    for (; p < end; p++)
        n += *p == c;
    return n;
}

/* FRAME;SPP;…;SPP. */
static int parse_frame(const struct base_lines *lines, const char *at, size_t length, struct pt_shot_table *t,
                       struct base_err *err)
{
    const size_t f = t->frame_count;
    const char *end = at + length;
    int64_t value;
    char behind;
    if (!take(&at, end, 0, PT_SHOT_LAST_FRAME, &behind, &value) || behind != ';' || (f > 0 && value <= t->frames[f - 1]))
        return bad(lines->name, lines->number, "FRAME;SPP;SPP;... with rising frames", err);
    t->frames[f] = (int)value;
    for (size_t i = 0; i < t->block_count; i++) {
        if (!take(&at, end, 1, INT32_MAX, &behind, &value) || behind != (i + 1 < t->block_count ? ';' : '\0'))
            return bad(lines->name, lines->number,
                       "as many samples per pixel as in the first frame, each from 1 to 2147483647", err);
        t->spp[f * t->block_count + i] = (uint32_t)value;
    }
    t->frame_count++;
    return 0;
}

/* The first two lines: what it is, and the grid of its frames. */
static int parse_head(struct base_lines *lines, struct pt_shot_table *t, struct base_err *err)
{
    const char *line;
    size_t length;
    int rc = base_lines_next(lines, &line, &length, err);
    if (!rc && !(line && length == sizeof FIRST_LINE - 1 && memcmp(line, FIRST_LINE, length) == 0))
        rc = bad(lines->name, 1, "lull-shot-table 1 (made by --plan-shot)", err);
    if (!rc)
        rc = base_lines_next(lines, &line, &length, err);
    if (!rc && !(line && length < PT_SHOT_GRID))
        rc = bad(lines->name, 2, "size, crop and block of the frames", err);
    if (!rc)
        memcpy(t->grid, line, length);
    return rc;
}

int pt_shot_table_parse(const char *name, const char *text, size_t size, struct pt_shot_table *t, struct base_err *err)
{
    struct base_lines lines;
    const char *line;
    size_t length;
    *t = (struct pt_shot_table){0};
    base_lines_init(&lines, name, text, size);
    int rc = parse_head(&lines, t, err);
    const size_t frames = base_lines_left(&lines), all = count_in(lines.at, lines.end, ';');
    if (!rc)
        rc = base_lines_next(&lines, &line, &length, err);
    if (rc)
        return rc;
    t->block_count = line ? count_in(line, line + length, ';') : 0;
    if (t->block_count == 0)
        return bad(name, 3, "FRAME;SPP;SPP;... with rising frames", err);
    if (all != frames * t->block_count) /* else memory would be asked for that the text does not fill */
        return base_fail(err, BASE_EINVAL, "%s: expected as many samples in every frame, ending with a line", name);
    t->frames = calloc(frames, sizeof *t->frames);
    t->spp = calloc(all, sizeof *t->spp);
    rc = t->frames && t->spp ? 0 : base_fail_nomem(err, "shot table");
    while (!rc && line) {
        rc = parse_frame(&lines, line, length, t, err);
        if (!rc && !lines.is_ended)
            rc = bad(name, lines.number, "a line break at the end", err);
        if (!rc)
            rc = base_lines_next(&lines, &line, &length, err);
    }
    return rc;
}

int pt_shot_table_read(const char *path, struct pt_shot_table *t, struct base_err *err)
{
    char *text;
    size_t size;
    *t = (struct pt_shot_table){0};
    int rc = base_file_read(path, MAX_BYTES, &text, &size, err);
    if (rc)
        return rc;
    rc = pt_shot_table_parse(path, text, size, t, err);
    free(text);
    return rc;
}

int pt_shot_table_write(const char *path, const struct pt_shot_table *t, struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fprintf(out.file, "%s\n%s\n", FIRST_LINE, t->grid);
    for (size_t f = 0; f < t->frame_count; f++) {
        fprintf(out.file, "%d", t->frames[f]);
        for (size_t i = 0; i < t->block_count; i++)
            fprintf(out.file, ";%u", t->spp[f * t->block_count + i]);
        fputc('\n', out.file);
    }
    return base_file_commit(&out, err);
}

void pt_shot_table_release(struct pt_shot_table *t)
{
    free(t->frames);
    free(t->spp);
    *t = (struct pt_shot_table){0};
}

const uint32_t *pt_shot_table_frame(const struct pt_shot_table *t, int frame)
{
    for (size_t f = 0; f < t->frame_count; f++)
        if (t->frames[f] == frame)
            return &t->spp[f * t->block_count];
    return NULL;
}

void pt_shot_table_grid(const struct pt_render_config *c, char grid[PT_SHOT_GRID])
{
    snprintf(grid, PT_SHOT_GRID, "size=%dx%d crop=%d,%d,%d,%d block=%dx%d", c->width, c->height, c->crop[0], c->crop[1],
             c->crop[2], c->crop[3], c->block_width, c->block_height);
}
