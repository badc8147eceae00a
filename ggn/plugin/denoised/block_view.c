#include "plugin/denoised/block_view.h"

#include "base/colour.h"
#include "denoise/blend.h"
#include "model/visibility.h"
#include "plugin/translate.h"
#include "sequence/simulate.h"

enum { HALF_A, HALF_B, ALBEDO, NORMAL, DENOISED_A, DENOISED_B, BOXES };
enum { TILE = 25, STRATA = 7 };

static const double GAUSSIAN = 15.0; /* sixth moment of a normal distribution over the cube of its second */

/* --- memory ------------------------------------------------------------------------------------------------------------ */

static int32_t most(int32_t a, int32_t b) { return a > b ? a : b; }

static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }

/* A side with what is denoised around it, as far as the frame's blocks and their margin reach: 0 < side <= area. */
static int32_t widened(int32_t side, int32_t area)
{
    const int64_t around = (int64_t)side + GD_REACH + GD_HALO, whole = (int64_t)area + 2 * LULL_OIDN_MARGIN;
    const int64_t wide = around < whole ? around : whole;
    return wide < INT32_MAX ? (int32_t)wide : INT32_MAX; /* there is no memory for it */
}

struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality)
{
    struct gd_form form = {.area = *lull_kit_rect(frame, 0)};
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        form.area = (struct lull_rect){least(form.area.x0, r->x0), least(form.area.y0, r->y0), most(form.area.x1, r->x1),
                                       most(form.area.y1, r->y1)};
        form.width = most(form.width, r->x1 - r->x0);
        form.height = most(form.height, r->y1 - r->y0);
    }
    form.box.width = widened(form.width, form.area.x1 - form.area.x0);
    form.box.height = widened(form.height, form.area.y1 - form.area.y0);
    form.box.albedo = (frame->planes & LULL_PLANE_BIT(LULL_PLANE_ALBEDO)) != 0;
    form.box.normal = form.box.albedo && (frame->planes & LULL_PLANE_BIT(LULL_PLANE_NORMAL)) != 0;
    form.box.quality = (int32_t)quality;
    form.box.threads = 1;
    form.box.exposure = isfinite(frame->exposure) && frame->exposure > 0 ? (float)frame->exposure : 1.0f;
    return form;
}

int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, const char *library, struct base_err *err)
{
    const size_t pixels = (size_t)form->width * (size_t)form->height;
    const size_t patches = ggn_visible_patches(form->width, form->height);
    const size_t box = 3 * (size_t)form->box.width * (size_t)form->box.height, planes = 3 + 4 + 2 + 8;
    const size_t doubles = patches + ggn_visibility_scratch(form->width);
    struct gd_block_view l = {0};
    if (box > PTRDIFF_MAX / 64 / sizeof(double) || form->area.x1 > INT32_MAX / 2 || form->area.y1 > INT32_MAX / 2)
        return base_fail_nomem(err, "the pictures of a block");
    l.memory = malloc(doubles * sizeof(double) + (BOXES * box + planes * pixels) * sizeof(float));
    if (!l.memory)
        return base_fail_nomem(err, "the pictures of a block");
    l.texture = l.memory;
    l.rows = l.texture + patches;
    float *at = (float *)(l.texture + doubles);
    for (int i = 0; i < BOXES; i++, at += box)
        l.box[i] = at;
    l.rgb = at;
    at += 3 * pixels;
    float **const maps[] = {&l.light[0], &l.light[1], &l.light[2], &l.light[3], &l.lightness[0], &l.lightness[1], &l.edges,
                            &l.slope,    &l.crossed,  &l.blurred,  &l.apart,    &l.scratch,      &l.alpha,        &l.blind};
    for (size_t i = 0; i < sizeof maps / sizeof maps[0]; i++, at += pixels)
        *maps[i] = at;
    int rc = lull_oidn_open(library, &l.oidn, err);
    if (!rc)
        rc = lull_oidn_prepare(l.oidn, &form->box, err);
    if (rc)
        gd_block_view_release(&l);
    else
        *seen = l;
    return rc;
}

void gd_block_view_release(struct gd_block_view *seen)
{
    lull_oidn_close(seen->oidn);
    free(seen->memory);
    *seen = (struct gd_block_view){0};
}

/* --- reading ----------------------------------------------------------------------------------------------------------- */

/* Where along one side a box begins: its corner is on the denoiser's grid, and it holds the block and its halo as far as the
 * margin of the frame, where the picture that is kept ends, too. */
static int32_t corner(int32_t area0, int32_t area1, int32_t box, int32_t block0)
{
    const int32_t from = least(block0 - GD_HALO, area1 + LULL_OIDN_MARGIN - box) - (area0 - LULL_OIDN_MARGIN);
    return area0 - LULL_OIDN_MARGIN + (from > 0 ? from / LULL_OIDN_GRID * LULL_OIDN_GRID : 0);
}

static struct lull_rect box_of(const struct gd_form *form, const struct lull_block *b)
{
    const int32_t x0 = corner(form->area.x0, form->area.x1, form->box.width, b->x0);
    const int32_t y0 = corner(form->area.y0, form->area.y1, form->box.height, b->y0);
    return (struct lull_rect){x0, y0, x0 + form->box.width, y0 + form->box.height};
}

static struct lull_rect common(struct lull_rect a, struct lull_rect b)
{
    return (struct lull_rect){most(a.x0, b.x0), most(a.y0, b.y0), least(a.x1, b.x1), least(a.y1, b.y1)};
}

static int finite3(const float v[3]) { return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]); }

/* The pixels of `rect`, which are of block b, go into the box. What is no number is as the pixel to the left. */
static int read_part(struct gd_block_view *seen, struct lull_rect box, struct lull_rect rect, const struct lull_view *view,
                     const struct lull_block *b, uint32_t planes, struct lull_kit_tally *tally)
{
    const double n = (double)b->spp, h = (double)b->half_spp;
    const int split = gp_has_halves(b);
    struct lull_block part = *b;
    struct lull_kit_span s;
    int differ = 0;
    part.x0 = rect.x0, part.y0 = rect.y0, part.x1 = rect.x1, part.y1 = rect.y1;
    if (rect.x0 >= rect.x1 || rect.y0 >= rect.y1)
        return 0;
    for (lull_kit_span_begin(&s, view, &part, planes); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            const size_t at = 3 * ((size_t)(s.y - box.y0) * (size_t)(box.x1 - box.x0) + (size_t)(s.x + i - box.x0));
            const double *m = s.value[LULL_PLANE_COLOR][i], *half = s.value[LULL_PLANE_HALF][i];
            float a[3], rest[3];
            for (int c = 0; c < 3; c++) {
                a[c] = (float)(split ? half[c] : m[c]);
                rest[c] = (float)(split ? (n * m[c] - h * half[c]) / (n - h) : m[c]);
                differ |= split && half[c] != m[c] && isfinite(half[c]) && isfinite(m[c]);
            }
            const int good = finite3(a) && finite3(rest), before = s.x + i > rect.x0;
            tally->valid += good;
            tally->bad += !good;
            for (size_t c = 0; c < 3; c++) {
                seen->box[HALF_A][at + c] = good ? a[c] : before ? seen->box[HALF_A][at + c - 3] : 0.0f;
                seen->box[HALF_B][at + c] = good ? rest[c] : before ? seen->box[HALF_B][at + c - 3] : 0.0f;
                if (s.planes & LULL_PLANE_BIT(LULL_PLANE_ALBEDO))
                    seen->box[ALBEDO][at + c] = (float)s.value[LULL_PLANE_ALBEDO][i][c];
                if (s.planes & LULL_PLANE_BIT(LULL_PLANE_NORMAL))
                    seen->box[NORMAL][at + c] = (float)s.value[LULL_PLANE_NORMAL][i][c];
            }
        }
    return differ;
}

/* Beyond `known` a box is mirrored. */
static void mirror_edges(float *picture, struct lull_rect box, struct lull_rect known)
{
    const size_t width = (size_t)(box.x1 - box.x0);
    for (int32_t y = box.y0; y < box.y1; y++)
        for (int32_t x = box.x0; x < box.x1; x++) {
            const int32_t u = known.x0 + lull_oidn_mirrored(x - known.x0, known.x1 - known.x0);
            const int32_t v = known.y0 + lull_oidn_mirrored(y - known.y0, known.y1 - known.y0);
            if (u != x || v != y)
                memcpy(picture + 3 * ((size_t)(y - box.y0) * width + (size_t)(x - box.x0)),
                       picture + 3 * ((size_t)(v - box.y0) * width + (size_t)(u - box.x0)), 3 * sizeof *picture);
        }
}

int gd_block_view_read(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                       const struct lull_view *view, const struct lull_block *b, struct lull_kit_tally *tally)
{
    const struct lull_rect box = box_of(form, b), core = {b->x0, b->y0, b->x1, b->y1};
    const uint32_t planes = kit->need.planes_required | (form->box.albedo ? LULL_PLANE_BIT(LULL_PLANE_ALBEDO) : 0) |
                            (form->box.normal ? LULL_PLANE_BIT(LULL_PLANE_NORMAL) : 0);
    struct lull_rect known = core;
    struct lull_kit_tally around = {0};
    memset(seen->box[0], 0, 4 * 3 * (size_t)form->box.width * (size_t)form->box.height * sizeof(float));
    if (view->all) {
        known = (struct lull_rect){b->x0 - GD_REACH, b->y0 - GD_REACH, b->x1 + GD_REACH, b->y1 + GD_REACH};
        known = common(common(known, form->area), box);
    }
    for (uint32_t i = 0; view->all && i < view->all_count; i++) {
        const struct lull_block *other = lull_kit_at(view->all, view->all_stride, i);
        const struct lull_rect r = {other->x0, other->y0, other->x1, other->y1};
        if (other->id != b->id && other->spp > 0)
            read_part(seen, box, common(r, known), view, other, planes, &around);
    }
    int differ = read_part(seen, box, core, view, b, planes, tally);
    for (int i = HALF_A; i <= NORMAL; i++)
        mirror_edges(seen->box[i], box, known);
    return differ;
}

/* The block's part of a box as a display shows it; its luminance and L*, [P]. alpha, or NULL: of a denoised half, how much
 * of the noisy one is mixed in. */
static void show(struct gd_block_view *seen, int which, const float *alpha, struct lull_rect box, const struct lull_block *b,
                 const struct lull_kit *kit, float *light, float *lightness)
{
    const size_t width = (size_t)(b->x1 - b->x0), pixels = (size_t)lull_kit_pixels(b), row = (size_t)(box.x1 - box.x0);
    for (size_t y = 0, at = 0; y < pixels / width; y++) {
        const size_t first = 3 * ((y + (size_t)(b->y0 - box.y0)) * row + (size_t)(b->x0 - box.x0));
        for (size_t x = 0; x < width; x++, at++) {
            float rgb[3];
            memcpy(rgb, seen->box[which] + first + 3 * x, sizeof rgb);
            if (alpha)
                lull_blend(seen->box[which - DENOISED_A + HALF_A] + first + 3 * x, rgb, &alpha[at], 1, rgb);
            for (size_t c = 0; c < 3; c++)
                seen->rgb[c * pixels + at] = gp_shown(kit, (double)rgb[c]);
            light[at] = (float)base_luminance((double)seen->rgb[at], (double)seen->rgb[pixels + at],
                                              (double)seen->rgb[2 * pixels + at]);
        }
    }
    ggn_visible_lightness(seen->rgb, pixels, lightness);
}

int gd_block_view_structure(const struct gd_block_view *seen, const struct gd_form *form, const struct lull_block *b)
{
    const struct lull_rect box = box_of(form, b);
    const size_t row = 3 * (size_t)(box.x1 - box.x0), bytes = 3 * sizeof(float);
    const float *first = seen->box[HALF_A] + (size_t)(b->y0 - box.y0) * row + 3 * (size_t)(b->x0 - box.x0);
    for (int32_t y = 0; y < b->y1 - b->y0; y++)
        for (int32_t x = 0; x < b->x1 - b->x0; x++)
            if (memcmp(first, first + (size_t)y * row + 3 * (size_t)x, bytes) != 0)
                return 1;
    return 0;
}

/* --- judging ----------------------------------------------------------------------------------------------------------- */

/* Over [x0, x1) x [y0, y1), of visible errors in units of what texture hides: pixels, sums of the crossed square and of its
 * square, of the second and sixth power of the halves' difference. */
struct sums {
    double n, q, qq, second, sixth;
};

static void add(struct sums *s, const struct gd_block_view *l, size_t i)
{
    const double q = (double)l->crossed[i], h = (double)l->apart[i] * (double)l->apart[i];
    s->n += 1.0;
    s->q += q;
    s->qq += q * q;
    s->second += h;
    s->sixth += h * h * h;
}

/* Of the mean crossed square. Blurred pixels are not independent: about a third of them are. */
static double standard_error(const struct sums *s)
{
    const double mean = s->q / s->n;
    return s->n > 3.0 ? sqrt(3.0 * fmax(0.0, s->qq / s->n - mean * mean) / s->n) : fabs(mean);
}

static double cube(double v) { return v > 0.0 ? v * v * v : 0.0; }

/* Sum of sixth powers of errors that are Gaussian, so many standard errors below what was found. */
static double sixth_of(const struct sums *s, double less)
{
    return GAUSSIAN * s->n * cube(fabs(s->q / s->n) - less * standard_error(s));
}

/* Strength of the edge at a pixel of the denoised picture, in octaves of L*: 0 for less than one. */
static int edge(const struct gd_block_view *l, int width, int height, int x, int y)
{
    const float *row = l->edges + (size_t)y * (size_t)width;
    const int left = x > 0 ? x - 1 : 0, right = least(x + 1, width - 1);
    const float *above = y > 0 ? row - width : row, *below = y + 1 < height ? row + width : row;
    double step = fabs((double)(row[right] - row[left])) + fabs((double)(below[x] - above[x]));
    int octave = 0;
    for (; step >= 1.0 && octave + 1 < STRATA; step *= 0.5)
        octave++;
    return octave;
}

/* Mean of sixth powers of the error over a patch. */
static double sixth_moment(const struct gd_block_view *l, int width, int height, const int patch[4])
{
    struct sums whole = {0}, strata[STRATA] = {{0}};
    double tiles = 0.0, edges = 0.0;
    for (int top = patch[1]; top < patch[3]; top += TILE)
        for (int left = patch[0]; left < patch[2]; left += TILE) {
            struct sums tile = {0};
            for (int y = top; y < least(top + TILE, patch[3]); y++)
                for (int x = left; x < least(left + TILE, patch[2]); x++) {
                    const size_t i = (size_t)y * (size_t)width + (size_t)x;
                    add(&whole, l, i);
                    add(&tile, l, i);
                    add(&strata[edge(l, width, height, x, y)], l, i);
                }
            tiles += sixth_of(&tile, 2.0);
        }
    for (int k = 0; k < STRATA; k++)
        edges += strata[k].n > 0.0 ? sixth_of(&strata[k], 1.0) : 0.0;
    const double halves = whole.second / whole.n, shape = halves > 0.0 ? whole.sixth / whole.n / cube(halves) : 0.0;
    const double mean = whole.q / whole.n, doubt = standard_error(&whole);
    const double square = fmax(fmax(mean + 0.5 * doubt, -mean - doubt), halves);
    return fmax(fmax(GAUSSIAN, shape) * cube(square), fmax(tiles, edges) / whole.n);
}

static double crossed_error(const struct gd_block_view *l, int width, int height)
{
    const size_t patches = ggn_visible_patches(width, height);
    double sum = 0.0;
    for (size_t k = 0; k < patches; k++) {
        int patch[4];
        ggn_visible_patch(width, height, k, l->texture, patch);
        sum += cbrt(sixth_moment(l, width, height, patch)); /* the square of what is seen */
    }
    return sqrt(sum / (double)patches);
}

static int cancelled(void *data)
{
    const struct lull_host *host = *(const struct lull_host **)data;
    return host->cancelled(host);
}

static int denoise(struct gd_block_view *seen, const struct lull_kit *kit)
{
    const struct lull_host *host = kit->host;
    const struct lull_oidn_pictures p = {{seen->box[HALF_A], seen->box[HALF_B]},
                                         seen->box[ALBEDO],
                                         seen->box[NORMAL],
                                         {seen->box[DENOISED_A], seen->box[DENOISED_B]}};
    return lull_oidn_run(seen->oidn, &p, host && host->cancelled ? cancelled : NULL, &host, &seen->err);
}

/* Where pixel i of the block lies in a box. */
static float *pixel_of(struct gd_block_view *l, int which, struct lull_rect box, const struct lull_block *b, size_t i)
{
    const size_t width = (size_t)(b->x1 - b->x0), x = i % width, y = i / width;
    return l->box[which] + 3 * ((y + (size_t)(b->y0 - box.y0)) * (size_t)(box.x1 - box.x0) + x + (size_t)(b->x0 - box.x0));
}

static void despeckle(struct gd_block_view *l, struct lull_rect box, const struct lull_block *b, size_t pixels)
{
    for (size_t i = 0; i < pixels; i++)
        lull_blend_despeckle(&l->apart[i], 1, pixel_of(l, DENOISED_A, box, b, i), pixel_of(l, DENOISED_B, box, b, i));
}

/* Each denoised half becomes that of the blend. */
static void keep(struct gd_block_view *l, struct lull_rect box, const struct lull_block *b, size_t pixels)
{
    for (size_t i = 0; i < pixels; i++)
        for (int k = 0; k < 2; k++) {
            float *denoised = pixel_of(l, DENOISED_A + k, box, b, i);
            lull_blend(pixel_of(l, HALF_A + k, box, b, i), denoised, &l->alpha[i], 1, denoised);
        }
}

/* How far apart the kept halves are, at the strength of the mean: L* of the mean less that of the darker half. A speck that
 * one sample made is in one half alone; half the difference of L* of the halves would be too little, L* being concave. */
static void tell_apart(struct gd_block_view *l, struct lull_rect box, const struct lull_block *b, const struct lull_kit *kit,
                       size_t pixels, double split)
{
    for (size_t i = 0; i < pixels; i++) {
        const int darker = l->light[2][i] > l->light[3][i];
        const float *low = pixel_of(l, DENOISED_A + darker, box, b, i);
        float *high = pixel_of(l, DENOISED_A + !darker, box, b, i);
        for (int c = 0; c < 3; c++)
            high[c] = (float)((1.0 - split) * (double)low[c] + split * (double)high[c]);
    }
    float *shown[2] = {l->lightness[0], l->lightness[1]};
    for (int k = 0; k < 2; k++)
        show(l, DENOISED_A + k, NULL, box, b, kit, l->scratch, shown[k]);
    for (size_t i = 0; i < pixels; i++)
        l->apart[i] = l->lightness[0][i] - l->lightness[1][i];
}

/* The difference of two pictures in luminance times the slope of L*, blurred as the eye does. */
static void difference(struct gd_block_view *l, int first, int second, int width, int height, float *to)
{
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++)
        l->scratch[i] = l->slope[i] * (l->light[first][i] - l->light[second][i]);
    ggn_visible_noise(l->scratch, width, height, l->texture, l->rows, to);
}

/* crossed: mse of what is kept of all samples, estimate.h's formula of blurred differences. light: A, B, and the kept
 * halves. */
static void cross(struct gd_block_view *l, int width, int height)
{
    static const struct {
        int first, second;
        float weight;
    } terms[] = {{2, 1, 0.5f}, {3, 0, 0.5f}, {0, 1, -0.5f}, {2, 3, -0.25f}};
    const size_t pixels = (size_t)width * (size_t)height;
    memset(l->crossed, 0, pixels * sizeof *l->crossed);
    for (size_t k = 0; k < sizeof terms / sizeof terms[0]; k++) {
        difference(l, terms[k].first, terms[k].second, width, height, l->blurred);
        for (size_t i = 0; i < pixels; i++)
            l->crossed[i] += terms[k].weight * l->blurred[i] * l->blurred[i];
    }
}

/* The halves' difference is noise; what else the crossed error has is bias. Both add in squares. */
static void set_moving(struct gd_errors *e, double gain)
{
    const double bias_squared = fmax(0.0, e->crossed * e->crossed - e->halves * e->halves);
    e->halves *= gain;
    e->crossed = sqrt(bias_squared + e->halves * e->halves);
}

int gd_block_view_errors(struct gd_block_view *l, const struct gd_form *form, const struct lull_kit *kit,
                         const struct lull_block *b, int blend, const struct ggn_temporal *temporal,
                         struct gd_errors *errors)
{
    static const int shown[] = {HALF_A, HALF_B, DENOISED_A, DENOISED_B};
    const struct lull_rect box = box_of(form, b);
    const int width = b->x1 - b->x0, height = b->y1 - b->y0;
    const size_t pixels = (size_t)lull_kit_pixels(b);
    const double n = (double)b->spp, h = (double)b->half_spp;
    const double split = 0.5 * seq_half_scale(n, h); /* to noise as strong as the mean's */
    const struct lull_estimate estimate = {l->slope, l->crossed, l->blurred};

    l->err = (struct base_err){0};
    if (denoise(l, kit))
        return l->err.code;
    for (size_t k = 0; k < 4; k++)
        show(l, shown[k], NULL, box, b, kit, l->light[k], l->lightness[k % 2]);
    ggn_visible_texture(l->lightness[0], l->lightness[1], width, height, l->rows, l->texture);
    struct lull_estimate_in in = {l->light[0], l->light[1], l->light[2], l->light[3], h / n};
    lull_estimate_pixels(&in, pixels, &estimate);
    if (blend)
        lull_blend_weights_blind(&estimate, width, height, l->rgb, l->blind);
    lull_blend_weights(&estimate, width, height, l->scratch, l->alpha, l->apart);
    for (size_t i = 0; i < pixels; i++) {
        l->slope[i] = (float)lull_lightness_slope(0.5 * ((double)l->light[2][i] + (double)l->light[3][i]));
        l->edges[i] = 0.5f * (l->lightness[0][i] + l->lightness[1][i]);
    }
    if (blend)
        despeckle(l, box, b, pixels);
    for (size_t k = 2; k < 4; k++)
        show(l, shown[k], blend ? l->blind : NULL, box, b, kit, l->light[k], l->lightness[0]);
    cross(l, width, height);
    if (blend)
        keep(l, box, b, pixels);
    for (size_t k = 2; k < 4; k++)
        show(l, shown[k], NULL, box, b, kit, l->light[k], l->lightness[0]);
    tell_apart(l, box, b, kit, pixels, split);
    errors->halves = ggn_visible_noise(l->apart, width, height, l->texture, l->rows, l->scratch);
    memcpy(l->apart, l->scratch, pixels * sizeof *l->apart);
    errors->crossed = crossed_error(l, width, height);
    if (temporal)
        set_moving(errors, ggn_temporal_gain(temporal, l->apart, width, height));
    return 0;
}
