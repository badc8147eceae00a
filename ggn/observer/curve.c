#include "observer/curve.h"

#include <math.h>
#include <stdlib.h>

#include "model/visibility.h"
#include "sequence/simulate.h"

const char *const ggn_curve_sources[] = {"halves", "levels", NULL};

/* Simulated levels: SEQ_SIMULATED_CAP and quarter octaves below it, down to about 5 spp. */
enum { SIMULATED = 49 };

static double simulated_spp(int i) { return SEQ_SIMULATED_CAP * exp2(0.25 * (i - (SIMULATED - 1))); }

struct planes {
    const struct seq_block *block; /* borrows */
    int width, height;
    size_t pixels;
    float *mean, *difference, *work; /* [3][P], linear; one allocation with the others, `mean` owns it */
    float *lightness[2];             /* [P] */
    double *texture, *scratch;       /* [patches]; one allocation, `texture` owns it */
};

static void planes_release(struct planes *p)
{
    free(p->mean);
    free(p->texture);
    *p = (struct planes){0};
}

static int planes_init(struct planes *p, const struct seq_block *block, struct base_err *err)
{
    const int width = (int)block->width, height = (int)block->height;
    const size_t n = (size_t)block->width * block->height, patches = ggn_visible_patches(width, height);
    *p = (struct planes){.block = block,
                         .width = width,
                         .height = height,
                         .pixels = n,
                         .mean = malloc(11 * n * sizeof *p->mean),
                         .texture = malloc((patches + ggn_visibility_scratch(width)) * sizeof *p->texture)};
    if (!p->mean || !p->texture) {
        planes_release(p);
        return base_fail_nomem(err, "observer");
    }
    p->scratch = p->texture + patches;
    p->difference = p->mean + 3 * n;
    p->work = p->mean + 6 * n;
    for (int i = 0; i < 2; i++)
        p->lightness[i] = p->mean + (9 + (size_t)i) * n;
    return 0;
}

/* L* of mean + scale * difference. */
static void lightness_at(struct planes *p, double scale, float *lightness)
{
    seq_simulate(p->mean, p->difference, 3 * p->pixels, scale, p->work);
    ggn_visible_lightness(p->work, p->pixels, lightness);
}

static void read_halves(struct planes *p, double scale)
{
    lightness_at(p, scale, p->lightness[0]);
    lightness_at(p, -scale, p->lightness[1]);
}

/* Visible noise of factor * (L*[0] - L*[1]), which ends up in place of L*[0]. */
static double visible(struct planes *p, float factor)
{
    for (size_t i = 0; i < p->pixels; i++)
        p->lightness[0][i] = factor * (p->lightness[0][i] - p->lightness[1][i]);
    return ggn_visible_noise(p->lightness[0], p->width, p->height, p->texture, p->scratch, NULL);
}

static void see_texture(struct planes *p)
{
    ggn_visible_texture(p->lightness[0], p->lightness[1], p->width, p->height, p->scratch, p->texture);
}

/* Mean and half difference of the level at spp. */
static int read_level(struct planes *p, uint32_t spp, struct base_err *err)
{
    return seq_halves(p->block, seq_level(p->block, spp), p->mean, p->difference, err);
}

static void append(struct ggn_curve *c, double spp, double seen)
{
    c->spp[c->n] = spp;
    c->visible[c->n++] = seen;
}

/* Levels below the full one, each from its own halves: the full level's noise made stronger would be symmetric, where that
 * of few samples is skewed to bright. */
static int add_recorded_halves(struct ggn_curve *c, struct planes *p, uint32_t full_spp, struct base_err *err)
{
    for (uint32_t i = 0; i < p->block->n_levels; i++) {
        const struct seq_record *r = &p->block->levels[i];
        if (r->spp >= full_spp || !seq_has_halves(r))
            continue;
        int rc = seq_halves(p->block, r, p->mean, p->difference, err);
        if (rc)
            return rc;
        read_halves(p, 1.0);
        append(c, r->spp, visible(p, 0.5f));
    }
    return 0;
}

/* Appends what halves say: recorded levels of a curve that is empty, the full level, and those above it and `beyond` spp
 * that it stands for. */
static int add_halves(struct ggn_curve *c, struct planes *p, double beyond, struct base_err *err)
{
    const uint32_t full = seq_full_level(p->block)->spp;
    const int first = c->n == 0;
    int rc = read_level(p, full, err);
    if (!rc && first) {
        read_halves(p, 1.0);
        see_texture(p);
        rc = add_recorded_halves(c, p, full, err);
        if (!rc)
            rc = read_level(p, full, err);
        read_halves(p, 1.0);
        append(c, full, visible(p, 0.5f));
        c->recorded = c->n;
    }
    for (int i = 0; i < SIMULATED && !rc; i++) {
        double spp = simulated_spp(i);
        if (spp <= full || spp <= beyond)
            continue;
        read_halves(p, seq_noise_scale(full, spp));
        append(c, spp, visible(p, 0.5f));
    }
    return rc;
}

/* The picture at each recorded level against the reference. */
static int add_levels(struct ggn_curve *c, struct planes *p, int independent, struct base_err *err)
{
    const struct seq_block *b = p->block;
    const struct seq_record *last = &b->levels[b->n_levels - 1];
    double n_r = b->reference->spp;
    int rc = seq_mean(b, b->reference, p->mean, err);
    if (!rc)
        rc = seq_mean(b, last, p->difference, err);
    if (rc)
        return rc;
    ggn_visible_lightness(p->mean, p->pixels, p->lightness[1]);
    ggn_visible_lightness(independent ? p->difference : p->mean, p->pixels, p->lightness[0]);
    see_texture(p);
    for (const struct seq_record *r = b->levels; r <= last; r++) {
        rc = seq_mean(b, r, p->difference, err);
        if (rc)
            return rc;
        for (size_t i = 0; i < 3 * p->pixels; i++)
            p->difference[i] -= p->mean[i];
        lightness_at(p, independent ? seq_reference_scale(n_r, r->spp) : 1.0, p->lightness[0]);
        append(c, r->spp, visible(p, 1.0f));
    }
    c->recorded = c->n;
    return 0;
}

/* Room for every level that a curve of this block can have. */
static int curve_init(struct ggn_curve *c, const struct seq_block *block, struct base_err *err)
{
    size_t room = SIMULATED + 1 + block->n_levels;
    *c = (struct ggn_curve){.spp = malloc(room * sizeof *c->spp), .visible = malloc(room * sizeof *c->visible)};
    return c->spp && c->visible ? 0 : base_fail_nomem(err, "observer");
}

int ggn_curve_make(const struct seq_block *block, enum ggn_curve_source source, int reference_independent,
                   struct ggn_curve *curve, struct base_err *err)
{
    struct ggn_curve c;
    struct planes p = {0};
    if (source == GGN_FROM_HALVES && !seq_full_level(block))
        return base_fail(err, BASE_EINVAL,
                         "block %u has no full level with a half-buffer difference: record one, or use --source levels",
                         block->id);
    if (source == GGN_FROM_LEVELS && !block->reference)
        return base_fail(err, BASE_EINVAL, "block %u has no reference: record one, or use --source halves", block->id);
    int rc = curve_init(&c, block, err);
    if (!rc)
        rc = planes_init(&p, block, err);
    if (!rc && source == GGN_FROM_LEVELS)
        rc = add_levels(&c, &p, reference_independent, err);
    if (!rc && (source == GGN_FROM_HALVES || (reference_independent && seq_full_level(block))))
        rc = add_halves(&c, &p, c.n > 0 ? 1.07 * c.spp[c.n - 1] : 0.0, err);
    planes_release(&p);
    if (rc)
        ggn_curve_release(&c);
    else
        *curve = c;
    return rc;
}

/* What is seen of mean +- difference. */
static double see_both(struct planes *p)
{
    read_halves(p, 1.0);
    see_texture(p);
    return visible(p, 0.5f);
}

int ggn_curve_level(const struct seq_block *block, const struct seq_record *level, double *visible_out, struct base_err *err)
{
    struct planes p;
    int rc = planes_init(&p, block, err);
    if (!rc)
        rc = read_level(&p, level->spp, err);
    if (!rc)
        *visible_out = see_both(&p);
    planes_release(&p);
    return rc;
}

int ggn_curve_means(const struct seq_block *block, const struct seq_record *earlier, const struct seq_record *level,
                    double *visible_out, struct base_err *err)
{
    struct planes p;
    int rc = planes_init(&p, block, err);
    if (!rc)
        rc = seq_mean(block, earlier, p.difference, err);
    if (!rc)
        rc = seq_mean(block, level, p.mean, err);
    for (size_t i = 0; i < 3 * p.pixels && !rc; i++)
        p.difference[i] = (float)seq_means_scale(earlier->spp, level->spp) * (p.mean[i] - p.difference[i]);
    if (!rc)
        *visible_out = see_both(&p);
    planes_release(&p);
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
