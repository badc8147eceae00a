#include "actions.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The responses of a pilot about one frame. */
struct pilot {
    size_t at;                            /* index of its frame */
    struct lull_host_quote_block *blocks; /* owns */
};

struct plan {
    struct pt_shot_table table;
    struct pilot *pilots;
    size_t pilot_count;
    size_t untold_count; /* of the pilots, those that have met too little */
    uint32_t columns;
    int threads;
};

static int keep_answer(struct plan *p, const struct pt_open *o, const struct pt_quote *quote, size_t at,
                       struct base_err *err)
{
    const struct lull_host_quote_row *row = pt_quote_asked(quote);
    const size_t n = o->render->blocks->count;
    char grid[PT_SHOT_GRID];
    struct pilot *pilot = &p->pilots[p->pilot_count++];
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
    p->untold_count += row->told == 0;
    return 0;
}

static int run_pilot(struct plan *p, struct pt_open *o, const struct pt_shot *s, size_t at, int *status,
                     struct base_err *err)
{
    struct pt_shot_frame f;
    struct pt_quote *quote = NULL;
    int rc = pt_frame_init(&f, o->cli, s->frames[at], s->views ? &s->views[at] : NULL, err);
    base_log_note(o->log, "pilot of frame %d", s->frames[at]);
    if (!rc)
        rc = pt_open_scene(o, &f, err);
    if (!rc)
        rc = pt_open_frame(o, NULL, err);
    if (!rc)
        rc = pt_action_pilot(o, &quote, status, err);
    if (!rc && *status == 0)
        rc = keep_answer(p, o, quote, at, err);
    pt_quote_destroy(quote);
    pt_open_end_frame(o);
    pt_frame_release(&f);
    return rc;
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
            t->spp[f * n + i] =
                lull_host_quote_between(p->pilots[k].blocks, p->pilots[after].blocks, (uint32_t)n, p->columns, (uint32_t)i);
    }
    for (size_t f = 1; f < count; f++)
        lull_host_quote_fade(&t->spp[f * n], &t->spp[(f - 1) * n], (uint32_t)n);
    for (size_t f = count - 1; f > 0; f--)
        lull_host_quote_fade(&t->spp[(f - 1) * n], &t->spp[f * n], (uint32_t)n);
    t->frame_count = count;
    return 0;
}

static void print_price(const struct plan *p)
{
    const struct pt_shot_table *t = &p->table;
    const double all = (double)t->block_count * (double)t->frame_count;
    double samples = 0.0, thread_s = 0.0; /* samples per pixel summed over blocks */
    uint32_t most = 0;
    char thread[32], wall[32];
    for (size_t f = 0; f < t->frame_count; f++)
        for (size_t i = 0, k = pilot_of(p, f); i < t->block_count; i++) {
            const uint32_t spp = t->spp[f * t->block_count + i];
            const struct pilot *a = &p->pilots[k], *b = k + 1 < p->pilot_count ? a + 1 : a;
            samples += spp;
            thread_s += spp * 0.5 * (a->blocks[i].sample_s + b->blocks[i].sample_s);
            most = spp > most ? spp : most;
        }
    printf("%zu frames of %zu blocks, by %zu pilots: %.0f spp on average, %u for the most expensive block\n", t->frame_count,
           t->block_count, p->pilot_count, samples / all, most);
    printf("%s of thread time, %s on %d threads that are free; %.1f x for the most expensive block's samples everywhere\n",
           pt_quote_duration(thread_s, thread), pt_quote_duration(thread_s / p->threads, wall), p->threads,
           most * all / samples);
    if (p->untold_count > 0)
        printf("%zu of %zu pilots have met too little: what their frames need is not known (a longer --quote-pilot says "
               "more)\n",
               p->untold_count, p->pilot_count);
}

int pt_shot_plan(const struct pt_shot *s, struct pt_open *o, int *status, struct base_err *err)
{
    const size_t every = (size_t)o->cli->shot.plan_every;
    struct plan p = {.pilots = calloc(s->count, sizeof *p.pilots)};
    int rc = p.pilots ? 0 : base_fail_nomem(err, "pilots");
    for (size_t at = 0, last = s->count - 1; at <= last && !rc && *status == 0;) {
        rc = run_pilot(&p, o, s, at, status, err);
        at = at < last && at + every > last ? last : at + every;
    }
    if (!rc && *status == 0)
        rc = fill_table(&p, s, err);
    if (!rc && *status == 0)
        rc = pt_shot_table_write(o->cli->shot.plan, &p.table, err);
    if (!rc && *status == 0)
        print_price(&p);
    for (size_t i = 0; i < p.pilot_count; i++)
        free(p.pilots[i].blocks);
    free(p.pilots);
    pt_shot_table_release(&p.table);
    return rc;
}
