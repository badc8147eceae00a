#include "sight/curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sight/measure.h"
#include "sequence/simulate.h"

const char *const ggn_curve_sources[] = {"halves", "levels", NULL};

/* Simulated levels: SEQ_SIMULATED_CAP and quarter octaves below it, down to about 5 spp. */
enum { SIMULATED = 49 };

/* Of levels whose reference has their samples among its own: noise of more than so many times its samples is not looked for,
 * as people's thresholds against 10,000 samples end at 20,000. */
static const double NESTED_REACH = 2;

static double simulated_spp(int i) { return SEQ_SIMULATED_CAP * exp2(0.25 * (i - (SIMULATED - 1))); }

struct eye {
    const struct seq_block *block; /* borrows */
    float *mean, *difference;      /* [3][P], linear; one allocation, `mean` owns it */
    struct ggn_meter meter;        /* owns */
};

static void eye_release(struct eye *e)
{
    free(e->mean);
    ggn_meter_release(&e->meter);
}

/* The caller releases it, also after a failure. */
static int eye_init(struct eye *e, const struct seq_block *block, struct base_err *err)
{
    const size_t pixels = (size_t)block->width * block->height;
    struct ggn_meter_room room = {0};
    *e = (struct eye){.block = block, .mean = malloc(6 * pixels * sizeof *e->mean)};
    if (!e->mean)
        return base_fail_nomem(err, "observer");
    e->difference = e->mean + 3 * pixels;
    ggn_meter_make_room(&room, (int)block->width, (int)block->height);
    return ggn_meter_init(&e->meter, &room, err);
}

/* Visible noise of the two pictures in the meter; split, keep_texture: see ggn_measure. */
static double see(struct eye *e, double split, int keep_texture)
{
    double lightness;
    return ggn_measure_visible(&e->meter, (int)e->block->width, (int)e->block->height, split, keep_texture, &lightness);
}

/* Puts mean + scale * difference into the meter. */
static void simulate(struct eye *e, double scale, int picture)
{
    seq_simulate(e->mean, e->difference, 3 * (size_t)e->block->width * e->block->height, scale, e->meter.rgb[picture]);
}

/* Of mean +- scale * difference. */
static double see_halves(struct eye *e, double scale, int keep_texture)
{
    simulate(e, scale, 0);
    simulate(e, -scale, 1);
    return see(e, 0.5, keep_texture);
}

static void append(struct ggn_curve *c, double spp, double seen)
{
    c->spp[c->n] = spp;
    c->visible[c->n++] = seen;
}

/* Appends what halves say: recorded levels of a curve that is empty, the full level, and those above it and `beyond` spp
 * that it stands for. Texture is that of the full level, or what there was. */
static int add_halves(struct ggn_curve *c, struct eye *e, double beyond, struct base_err *err)
{
    const struct seq_record *full = seq_full_level(e->block);
    int rc = seq_halves(e->block, full, e->mean, e->difference, err);
    if (!rc && c->n == 0) {
        const double seen = see_halves(e, 1.0, 0);
        /* Levels below, each from its own halves: the full level's noise made stronger would be symmetric, where that of few
         * samples is skewed to bright. */
        for (const struct seq_record *r = e->block->levels; r < full && !rc; r++)
            if (seq_has_halves(r) && !(rc = seq_halves(e->block, r, e->mean, e->difference, err)))
                append(c, r->spp, see_halves(e, 1.0, 1));
        if (!rc)
            rc = seq_halves(e->block, full, e->mean, e->difference, err);
        append(c, full->spp, seen);
        c->recorded = c->n;
    }
    for (int i = 0; i < SIMULATED && !rc; i++) {
        double spp = simulated_spp(i);
        if (spp > full->spp && spp > beyond)
            append(c, spp, see_halves(e, seq_noise_scale(full->spp, spp), 1));
    }
    return rc;
}

/* Texture and noise where the reference, of n_r samples, has those of the levels among its own: a second running mean tells
 * how noisy it is itself, best that of its first half. */
static int add_nested_levels(struct ggn_curve *c, struct eye *e, struct base_err *err)
{
    const struct seq_block *b = e->block;
    const size_t values = 3 * (size_t)b->width * b->height;
    const double n_r = b->reference->spp, most = NESTED_REACH * n_r;
    const struct seq_record *half = b->levels, *end = b->levels + b->n_levels;
    while (half + 1 < end && 2 * half[1].spp <= b->reference->spp)
        half++;
    if (half->spp >= b->reference->spp)
        return base_fail(err, BASE_EINVAL, "block %u has no level below its reference", b->id);
    int rc = seq_mean(b, half, e->difference, err);
    for (size_t i = 0; i < values && !rc; i++)
        e->difference[i] = (float)seq_means_scale(half->spp, n_r) * (e->mean[i] - e->difference[i]);
    if (!rc)
        see_halves(e, 1.0, 0);
    memcpy(e->meter.rgb[1], e->mean, values * sizeof *e->mean);
    for (const struct seq_record *r = b->levels; r < end && r->spp < b->reference->spp && !rc; r++) {
        const double spp = 1.0 / (1.0 / r->spp - 1.0 / n_r);
        if (c->n > 0 && spp > most)
            break;
        rc = seq_mean(b, r, e->meter.rgb[0], err);
        append(c, spp, see(e, 1.0, 1));
    }
    c->recorded = c->n;
    return rc;
}

/* The picture at each recorded level against the reference. */
static int add_levels(struct ggn_curve *c, struct eye *e, int independent, struct base_err *err)
{
    const struct seq_block *b = e->block;
    const struct seq_record *last = &b->levels[b->n_levels - 1];
    const size_t values = 3 * (size_t)b->width * b->height;
    double n_r = b->reference->spp;
    int rc = seq_mean(b, b->reference, e->mean, err);
    if (!rc && !independent)
        return add_nested_levels(c, e, err);
    if (!rc)
        rc = seq_mean(b, last, e->meter.rgb[0], err);
    if (rc)
        return rc;
    memcpy(e->meter.rgb[1], e->mean, values * sizeof *e->mean);
    see(e, 1.0, 0);
    for (const struct seq_record *r = b->levels; r <= last; r++) {
        rc = seq_mean(b, r, e->difference, err);
        if (rc)
            return rc;
        for (size_t i = 0; i < values; i++)
            e->difference[i] -= e->mean[i];
        simulate(e, seq_reference_scale(n_r, r->spp), 0);
        append(c, r->spp, see(e, 1.0, 1));
    }
    c->recorded = c->n;
    return 0;
}

int ggn_curve_make(const struct seq_block *block, enum ggn_curve_source source, int reference_independent,
                   struct ggn_curve *curve, struct base_err *err)
{
    const size_t room = SIMULATED + 1 + block->n_levels; /* for every level that a curve of this block can have */
    struct eye e = {0};
    if (source == GGN_FROM_HALVES && !seq_full_level(block))
        return base_fail(err, BASE_EINVAL,
                         "block %u has no full level with a half-buffer difference: record one, or use --source levels",
                         block->id);
    if (source == GGN_FROM_LEVELS && !block->reference)
        return base_fail(err, BASE_EINVAL, "block %u has no reference: record one, or use --source halves", block->id);
    struct ggn_curve c = {.spp = malloc(room * sizeof *c.spp), .visible = malloc(room * sizeof *c.visible)};
    int rc = c.spp && c.visible ? eye_init(&e, block, err) : base_fail_nomem(err, "observer");
    if (!rc && source == GGN_FROM_LEVELS)
        rc = add_levels(&c, &e, reference_independent, err);
    if (!rc && (source == GGN_FROM_HALVES || (reference_independent && seq_full_level(block))))
        rc = add_halves(&c, &e, c.n > 0 ? 1.07 * c.spp[c.n - 1] : 0.0, err);
    eye_release(&e);
    if (rc)
        ggn_curve_release(&c);
    else
        *curve = c;
    return rc;
}

int ggn_curve_level(const struct seq_block *block, const struct seq_record *earlier, const struct seq_record *level,
                    double *visible_out, struct base_err *err)
{
    struct eye e;
    int rc = eye_init(&e, block, err);
    if (!rc && !earlier)
        rc = seq_halves(block, level, e.mean, e.difference, err);
    else if (!rc && !(rc = seq_mean(block, earlier, e.difference, err)))
        rc = seq_mean(block, level, e.mean, err);
    for (size_t i = 0; earlier && i < 3 * (size_t)block->width * block->height && !rc; i++)
        e.difference[i] = (float)seq_means_scale(earlier->spp, level->spp) * (e.mean[i] - e.difference[i]);
    if (!rc)
        *visible_out = see_halves(&e, 1.0, 0);
    eye_release(&e);
    return rc;
}

void ggn_curve_release(struct ggn_curve *c)
{
    free(c->spp);
    free(c->visible);
    *c = (struct ggn_curve){0};
}

/* Where the line through two points crosses y in log-log; half way where a point cannot be drawn. */
static double log_cross(double x0, double y0, double x1, double y1, double y)
{
    double t = y0 > 0.0 && y1 > 0.0 && y0 != y1 ? log(y / y0) / log(y1 / y0) : 0.5;
    t = t > 0.0 ? (t < 1.0 ? t : 1.0) : 0.0;
    return x0 * pow(x1 / x0, t);
}

double ggn_curve_threshold(const struct ggn_curve *c, double limit, int *censored)
{
    int last = c->n - 1;
    while (last >= 0 && !(c->visible[last] > limit))
        last--;
    *censored = last == c->n - 1;
    if (last < 0)
        return c->spp[0];
    if (*censored)
        return c->spp[last];
    return log_cross(c->spp[last], c->visible[last], c->spp[last + 1], c->visible[last + 1], limit);
}

/* y at x on the line through two points in log-log, in plain scales where a point has no place there; beyond the points the
 * nearer y. */
static double between(double x0, double y0, double x1, double y1, double x)
{
    double t = x <= x0 ? 0.0 : x >= x1 ? 1.0 : log(x / x0) / log(x1 / x0);
    return y0 > 0.0 && y1 > 0.0 ? y0 * pow(y1 / y0, t) : y0 + t * (y1 - y0);
}

double ggn_curve_at(const struct ggn_curve *c, double spp)
{
    int i = 0;
    if (spp <= c->spp[0])
        return c->visible[0] * seq_noise_scale(c->spp[0], spp);
    if (spp >= c->spp[c->n - 1])
        return c->visible[c->n - 1];
    while (c->spp[i + 1] < spp)
        i++;
    return between(c->spp[i], c->visible[i], c->spp[i + 1], c->visible[i + 1], spp);
}
