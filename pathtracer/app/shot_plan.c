#include "shot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "actions.h"
#include "quote_output.h"
#include "shot_table.h"

static const double FADE = 0.8408964152537145; /* 2^(-1/4) */

/* What a pilot said of one frame. */
struct pilot {
    size_t at;                            /* index of its frame */
    struct lull_host_quote_block *blocks; /* owns */
};

struct plan {
    struct pt_shot_table table;
    struct pilot *pilots;
    size_t pilot_count;
    uint32_t columns;
    int threads;
    double samples, thread_s; /* of all frames; samples per pixel summed over blocks */
};

/* --- pilots --------------------------------------------------------------------------------------------------------- */

static int keep_answer(struct plan *p, const struct pt_open *o, const struct pt_quote *quote, size_t at,
                       struct base_err *err)
{
    const struct lull_host_quote_row *row = NULL;
    const size_t n = o->render->blocks->count;
    char grid[PT_SHOT_GRID];
    struct pilot *pilot = &p->pilots[p->pilot_count++];
    for (uint32_t i = 0; i < quote->row_count; i++)
        if (quote->rows[i].asked)
            row = &quote->rows[i];
    pt_shot_table_grid(&o->render->config, grid);
    if (p->pilot_count == 1) {
        memcpy(p->table.grid, grid, sizeof grid);
        p->table.block_count = n;
        p->columns = o->render->blocks->list_columns;
        p->threads = base_threads_count(o->threads);
    } else if (strcmp(grid, p->table.grid) != 0)
        return base_fail(err, BASE_EINVAL, "the frames of a shot need the same size: %s here, %s in the first", grid,
                         p->table.grid);
    *pilot = (struct pilot){at, calloc(n, sizeof *pilot->blocks)};
    if (!pilot->blocks)
        return base_fail_nomem(err, "pilots");
    memcpy(pilot->blocks, row->blocks, n * sizeof *pilot->blocks);
    return 0;
}

static int run_pilot(struct plan *p, const struct pt_cli *cli, const struct pt_shot *s, size_t at, struct base_log *log,
                     int *status, struct base_err *err)
{
    struct pt_frame_cli f;
    struct pt_open o = {0};
    struct pt_quote *quote = NULL;
    int rc = pt_frame_cli_init(&f, cli, s, at, err);
    base_log_note(log, "pilot of frame %d", s->frames[at]);
    if (!rc)
        rc = pt_open_scene(&f.cli, NULL, log, &o, err);
    if (!rc)
        rc = pt_open_render(&f.cli, NULL, log, &o, err);
    if (!rc)
        rc = pt_action_pilot(&f.cli, &o, log, &quote, status, err);
    if (!rc && *status == 0)
        rc = keep_answer(p, &o, quote, at, err);
    pt_quote_destroy(quote);
    pt_open_release(&o);
    pt_frame_cli_release(&f);
    return rc;
}

/* --- table ---------------------------------------------------------------------------------------------------------- */

/* A block moves when what it needs has changed by more than the pilots may be wrong. */
static int has_moved(const struct lull_host_stop_at *a, const struct lull_host_stop_at *b)
{
    return a->low > b->high || b->low > a->high;
}

uint32_t pt_shot_need(const struct lull_host_quote_block *a, const struct lull_host_quote_block *b, size_t count,
                      uint32_t columns, size_t block)
{
    const long width = (long)columns, height = (long)count / width, x = (long)block % width, y = (long)block / width;
    const double own = fmax(1.0, fmax(a[block].stop.spp, b[block].stop.spp));
    double most = own;
    for (long v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; v++)
        for (long u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
            const struct lull_host_stop_at *before = &a[v * width + u].stop, *after = &b[v * width + u].stop;
            if (has_moved(before, after))
                most = fmax(most, fmax(before->spp, after->spp));
        }
    return (uint32_t)ceil(sqrt(own * most));
}

/* Samples change by at most a quarter of an octave from frame to frame, so that noise fades instead of jumping; the larger
 * ones stay. */
static void fade(struct pt_shot_table *t, size_t frame, size_t beside)
{
    const size_t n = t->block_count;
    for (size_t i = 0; i < n; i++) {
        const uint32_t least = (uint32_t)ceil(FADE * t->spp[beside * n + i]);
        if (t->spp[frame * n + i] < least)
            t->spp[frame * n + i] = least;
    }
}

/* The last pilot at or before a frame. */
static size_t pilot_of(const struct plan *p, size_t frame)
{
    size_t k = 0;
    while (k + 1 < p->pilot_count && frame >= p->pilots[k + 1].at)
        k++;
    return k;
}

static int fill_table(struct plan *p, const struct pt_shot *s, struct base_err *err)
{
    struct pt_shot_table *t = &p->table;
    const size_t n = t->block_count, count = s->count;
    t->frames = calloc(count, sizeof *t->frames);
    t->spp = calloc(count * n, sizeof *t->spp);
    if (!t->frames || !t->spp)
        return base_fail_nomem(err, "shot table");
    for (size_t f = 0; f < count; f++) {
        const size_t k = pilot_of(p, f), after = k + 1 < p->pilot_count ? k + 1 : k; /* the last frame is a pilot */
        t->frames[f] = s->frames[f];
        for (size_t i = 0; i < n; i++)
            t->spp[f * n + i] = pt_shot_need(p->pilots[k].blocks, p->pilots[after].blocks, n, p->columns, i);
    }
    for (size_t f = 1; f < count; f++)
        fade(t, f, f - 1);
    for (size_t f = count - 1; f > 0; f--)
        fade(t, f - 1, f);
    t->frame_count = count;
    return 0;
}

static void add_up(struct plan *p)
{
    const struct pt_shot_table *t = &p->table;
    for (size_t f = 0; f < t->frame_count; f++)
        for (size_t i = 0, k = pilot_of(p, f); i < t->block_count; i++) {
            const uint32_t spp = t->spp[f * t->block_count + i];
            const struct pilot *a = &p->pilots[k], *b = k + 1 < p->pilot_count ? a + 1 : a;
            p->samples += spp;
            p->thread_s += spp * 0.5 * (a->blocks[i].sample_s + b->blocks[i].sample_s);
        }
}

static void print_price(const struct plan *p)
{
    const struct pt_shot_table *t = &p->table;
    const double blocks = (double)t->block_count, frames = (double)t->frame_count;
    char thread[32], wall[32];
    uint32_t most = 0;
    for (size_t i = 0; i < t->frame_count * t->block_count; i++)
        most = t->spp[i] > most ? t->spp[i] : most;
    printf("%zu frames of %zu blocks, by %zu pilots: %.0f spp on average, %u for the dearest block\n", t->frame_count,
           t->block_count, p->pilot_count, p->samples / (blocks * frames), most);
    printf("%s of thread time, %s on %d threads that are free; %.1f x for the dearest block's samples everywhere\n",
           pt_quote_duration(p->thread_s, thread), pt_quote_duration(p->thread_s / p->threads, wall), p->threads,
           most * blocks * frames / p->samples);
}

int pt_shot_plan(const struct pt_cli *cli, const struct pt_shot *s, struct base_log *log, int *status, struct base_err *err)
{
    const size_t every = (size_t)cli->shot.plan_every;
    struct pt_cli own = *cli;
    struct plan p = {.pilots = calloc(s->count, sizeof *p.pilots)};
    int rc = p.pilots ? 0 : base_fail_nomem(err, "pilots");
    own.action = PT_CLI_QUOTE;
    for (size_t at = 0, last = s->count - 1; at <= last && !rc && *status == 0;) {
        rc = run_pilot(&p, &own, s, at, log, status, err);
        at = at < last && at + every > last ? last : at + every;
    }
    if (!rc && *status == 0)
        rc = fill_table(&p, s, err);
    if (!rc && *status == 0)
        rc = pt_shot_table_write(cli->shot.plan, &p.table, err);
    if (!rc && *status == 0) {
        add_up(&p);
        print_price(&p);
    }
    for (size_t i = 0; i < p.pilot_count; i++)
        free(p.pilots[i].blocks);
    free(p.pilots);
    pt_shot_table_release(&p.table);
    return rc;
}
