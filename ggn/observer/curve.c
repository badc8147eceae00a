#include "observer/curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "observer/visibility.h"

const char *const ggn_curve_sources[] = {"halves", "levels", NULL};

/* Simulated levels: GGN_CURVE_CAP and quarter octaves below it, down to about 5 spp. */
enum { SIMULATED = 45 };

static double simulated_spp(int i)
{
    return GGN_CURVE_CAP * exp2(0.25 * (i - (SIMULATED - 1)));
}

/* Planes of one block. */
struct planes {
    const struct seq_block *block; /* borrows */
    int x0, y0, width, height;        /* the part of it that is looked at */
    size_t pixels;
    float *mean, *difference, *work;  /* [3][P], linear; one allocation, `mean` owns it */
    float *lightness[3];              /* [P] */
    double *scratch;                  /* owns */
};

static void planes_release(struct planes *p)
{
    free(p->mean);
    free(p->scratch);
    *p = (struct planes){0};
}

/* Room for `across` x `down` such blocks. */
static int planes_init(struct planes *p, const struct seq_block *block, int across, int down, struct base_err *err)
{
    int width = across * (int)block->width, height = down * (int)block->height;
    size_t n = (size_t)width * (size_t)height;
    *p = (struct planes){.block = block, .width = width, .height = height, .pixels = n,
                         .mean = malloc(12 * n * sizeof *p->mean),
                         .scratch = malloc(ggn_visibility_scratch(width) * sizeof *p->scratch)};
    if (!p->mean || !p->scratch) {
        planes_release(p);
        return base_fail_nomem(err, "observer");
    }
    p->difference = p->mean + 3 * n;
    p->work = p->mean + 6 * n;
    for (int i = 0; i < 3; i++)
        p->lightness[i] = p->mean + (9 + (size_t)i) * n;
    return 0;
}

/* Leaves of planes [3][P] of the whole block the part that is looked at. */
static void crop(const struct planes *p, float *planes)
{
    const size_t row = p->block->width, all = row * p->block->height;
    for (size_t c = 0; c < 3; c++)
        for (int y = 0; y < p->height; y++)
            memmove(planes + c * p->pixels + (size_t)y * (size_t)p->width,
                    planes + c * all + (size_t)(p->y0 + y) * row + (size_t)p->x0, (size_t)p->width * sizeof *planes);
}

/* L* of mean + scale * difference. */
static void look(struct planes *p, double scale, float *lightness)
{
    for (size_t i = 0; i < 3 * p->pixels; i++)
        p->work[i] = p->mean[i] + (float)scale * p->difference[i];
    ggn_visible_lightness(p->work, p->pixels, lightness);
}

/* Visible noise of factor * (L*[0] - L*[1]), which ends up in place of L*[0]. */
static double visible(struct planes *p, float factor)
{
    for (size_t i = 0; i < p->pixels; i++)
        p->lightness[0][i] = factor * (p->lightness[0][i] - p->lightness[1][i]);
    return ggn_visible_noise(p->lightness[0], p->width, p->height, p->scratch, NULL);
}

static double texture(struct planes *p)
{
    return ggn_visible_texture(p->lightness[0], p->lightness[1], p->width, p->height, p->scratch);
}

/* The level whose half-buffer difference is kept in full. */
static const struct seq_record *full_level(const struct seq_block *b)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (seq_has(&b->levels[i], SEQ_PLANE_HALF_F16))
            return &b->levels[i];
    return NULL;
}

/* Appends the levels above `beyond` spp that mean and difference at full_spp stand for. */
static void add_simulated(struct ggn_curve *c, struct planes *p, double full_spp, double beyond)
{
    if (c->n == 0) {
        look(p, 1.0, p->lightness[0]);
        look(p, -1.0, p->lightness[1]);
        c->texture = texture(p);
    }
    for (int i = 0; i < SIMULATED; i++) {
        double spp = simulated_spp(i), scale = sqrt(full_spp / spp);
        if (spp <= beyond)
            continue;
        look(p, scale, p->lightness[0]);
        look(p, -scale, p->lightness[1]);
        c->spp[c->n] = spp;
        c->visible[c->n++] = visible(p, 0.5f);
    }
}

/* Appends the levels that the block's halves stand for above `beyond` spp. */
static int add_halves(struct ggn_curve *c, struct planes *p, double beyond, struct base_err *err)
{
    const struct seq_record *full = full_level(p->block);
    int rc = seq_mean(p->block, full, p->mean, err);
    if (!rc)
        rc = seq_half(p->block, full, p->difference, err);
    if (rc)
        return rc;
    crop(p, p->mean);
    crop(p, p->difference);
    add_simulated(c, p, full->spp, beyond);
    return 0;
}

static int add_levels(struct ggn_curve *c, struct planes *p, int independent, struct base_err *err)
{
    const struct seq_block *b = p->block;
    double n_r = b->reference->spp;
    int rc = seq_mean(b, b->reference, p->mean, err);
    if (rc)
        return rc;
    ggn_visible_lightness(p->mean, p->pixels, p->lightness[2]);
    for (uint32_t level = 0; level < b->n_levels; level++) {
        const struct seq_record *r = &b->levels[level];
        rc = seq_mean(b, r, p->difference, err);
        if (rc)
            return rc;
        if (level + 1 == b->n_levels) {
            ggn_visible_lightness(independent ? p->difference : p->mean, p->pixels, p->lightness[0]);
            ggn_visible_lightness(p->mean, p->pixels, p->lightness[1]);
            c->texture = texture(p);
        }
        for (size_t i = 0; i < 3 * p->pixels; i++)
            p->difference[i] -= p->mean[i];
        look(p, independent ? sqrt(n_r / (n_r + r->spp)) : 1.0, p->lightness[0]);
        for (size_t i = 0; i < p->pixels; i++)
            p->lightness[1][i] = p->lightness[2][i];
        c->spp[c->n] = r->spp;
        c->visible[c->n++] = visible(p, 1.0f);
    }
    c->recorded = c->n;
    return 0;
}

int ggn_curve_make(const struct seq_block *block, enum ggn_curve_source source, int reference_independent,
                   struct ggn_curve *curve, struct base_err *err)
{
    if (source == GGN_FROM_HALVES && !full_level(block))
        return base_fail(err, BASE_EINVAL,
                         "block %u has no full level with a half-buffer difference: record one, or use --source levels",
                         block->id);
    if (source == GGN_FROM_LEVELS && !block->reference)
        return base_fail(err, BASE_EINVAL, "block %u has no reference: record one, or use --source halves", block->id);
    size_t room = SIMULATED + block->n_levels;
    struct ggn_curve c = {.spp = malloc(room * sizeof *c.spp), .visible = malloc(room * sizeof *c.visible)};
    struct planes p = {0};
    int rc = !c.spp || !c.visible ? base_fail_nomem(err, "observer") : planes_init(&p, block, 1, 1, err);
    if (!rc && source == GGN_FROM_LEVELS)
        rc = add_levels(&c, &p, reference_independent, err);
    if (!rc && (source == GGN_FROM_HALVES || (reference_independent && full_level(block))))
        rc = add_halves(&c, &p, c.n > 0 ? 1.07 * c.spp[c.n - 1] : 0.0, err);
    if (rc)
        ggn_curve_release(&c);
    else
        *curve = c;
    planes_release(&p);
    return rc;
}

int ggn_curve_part(const struct seq_block *block, int x0, int y0, int width, int height, struct ggn_curve *curve,
                   struct base_err *err)
{
    if (x0 < 0 || y0 < 0 || width < 1 || height < 1 || x0 + width > (int)block->width || y0 + height > (int)block->height)
        return base_fail(err, BASE_EINVAL, "block %u has no part %dx%d at %d, %d", block->id, width, height, x0, y0);
    if (!full_level(block))
        return base_fail(err, BASE_EINVAL, "block %u has no full level with a half-buffer difference", block->id);
    struct ggn_curve c = {.spp = malloc(SIMULATED * sizeof *c.spp), .visible = malloc(SIMULATED * sizeof *c.visible)};
    struct planes p = {0};
    int rc = !c.spp || !c.visible ? base_fail_nomem(err, "observer") : planes_init(&p, block, 1, 1, err);
    if (!rc) {
        p.x0 = x0;
        p.y0 = y0;
        p.width = width;
        p.height = height;
        p.pixels = (size_t)width * (size_t)height;
        rc = add_halves(&c, &p, 0.0, err);
    }
    if (rc)
        ggn_curve_release(&c);
    else
        *curve = c;
    planes_release(&p);
    return rc;
}

/* Planes of one of several blocks of n pixels, at (x, y) of the joined ones. */
static void paste(const struct planes *p, const float *from, size_t x, size_t y, float *to)
{
    size_t w = p->block->width, h = p->block->height, row = (size_t)p->width;
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < h; k++)
            memcpy(to + c * p->pixels + (y + k) * row + x, from + (c * h + k) * w, w * sizeof *to);
}

static int read_joined(struct planes *p, const struct seq_block *blocks, int across, int down, struct base_err *err)
{
    const size_t w = blocks->width, h = blocks->height;
    float *one = malloc(3 * w * h * sizeof *one);
    int rc = one ? 0 : base_fail_nomem(err, "observer");
    for (int k = 0; k < across * down && !rc; k++) {
        size_t x = w * (size_t)(k % across), y = h * (size_t)(k / across);
        const struct seq_record *full = full_level(&blocks[k]);
        rc = seq_mean(&blocks[k], full, one, err);
        if (!rc)
            paste(p, one, x, y, p->mean);
        if (!rc)
            rc = seq_half(&blocks[k], full, one, err);
        if (!rc)
            paste(p, one, x, y, p->difference);
    }
    free(one);
    return rc;
}

int ggn_curve_joined(const struct seq_block *blocks, int across, int down, struct ggn_curve *curve, struct base_err *err)
{
    for (int k = 0; k < across * down; k++) {
        const struct seq_record *full = full_level(&blocks[k]), *first = full_level(&blocks[0]);
        if (!full || full->spp != first->spp || blocks[k].width != blocks->width || blocks[k].height != blocks->height)
            return base_fail(err, BASE_EINVAL, "blocks %u and %u have no full levels of the same size and samples",
                             blocks[0].id, blocks[k].id);
    }
    struct ggn_curve c = {.spp = malloc(SIMULATED * sizeof *c.spp), .visible = malloc(SIMULATED * sizeof *c.visible)};
    struct planes p = {0};
    int rc = !c.spp || !c.visible ? base_fail_nomem(err, "observer") : planes_init(&p, blocks, across, down, err);
    if (!rc)
        rc = read_joined(&p, blocks, across, down, err);
    if (!rc)
        add_simulated(&c, &p, full_level(blocks)->spp, 0.0);
    if (rc)
        ggn_curve_release(&c);
    else
        *curve = c;
    planes_release(&p);
    return rc;
}

int ggn_curve_level(const struct seq_block *block, const struct seq_record *level, double *visible_out, double *texture_out,
                    struct base_err *err)
{
    struct planes p;
    int rc = planes_init(&p, block, 1, 1, err);
    if (rc)
        return rc;
    rc = seq_mean(block, level, p.mean, err);
    if (!rc && seq_has(level, SEQ_PLANE_HALF_F16)) {
        rc = seq_half(block, level, p.difference, err);
    } else if (!rc) {
        rc = seq_half_luminance(block, level, p.difference, err);
        memcpy(p.difference + p.pixels, p.difference, p.pixels * sizeof(float));
        memcpy(p.difference + 2 * p.pixels, p.difference, p.pixels * sizeof(float));
    }
    if (!rc) {
        look(&p, 1.0, p.lightness[0]);
        look(&p, -1.0, p.lightness[1]);
        *texture_out = texture(&p);
        *visible_out = visible(&p, 0.5f);
    }
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

double ggn_curve_at(const struct ggn_curve *c, double spp)
{
    int i = 0;
    if (spp <= c->spp[0])
        return c->visible[0];
    if (spp >= c->spp[c->n - 1])
        return c->visible[c->n - 1];
    while (c->spp[i + 1] < spp)
        i++;
    double t = log(spp / c->spp[i]) / log(c->spp[i + 1] / c->spp[i]), a = c->visible[i], b = c->visible[i + 1];
    return a > 0.0 && b > 0.0 ? a * pow(b / a, t) : a + t * (b - a);
}
