#include "observer/observer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/colour.h"
#include "base/files.h"
#include "data/image.h"
#include "model/preprocess.h"
#include "observer/flip.h"

const struct ggn_observer ggn_observer_default = {
    .map = GGN_MAP_FLIP, .blur_px = 0.0, .masking = 0.2, .window_px = 3, .percentile = 95.0, .tau = 0.041672, .spread = 0.25,
};

static const char *const map_names[] = {[GGN_MAP_FLIP] = "flip", [GGN_MAP_LIGHTNESS] = "lightness"};

void ggn_observer_describe(const struct ggn_observer *o, char *text, size_t room)
{
    snprintf(text, room, "model observer: %s, blur %.2f px, masking %.2f over %d px, percentile %.1f, tau %.5g", map_names[o->map],
             o->blur_px, o->masking, o->window_px, o->percentile, o->tau);
}

static int get(const cJSON *root, const char *name, double lo, double hi, double *out)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(root, name);
    if (!cJSON_IsNumber(v) || !(v->valuedouble >= lo && v->valuedouble <= hi))
        return 0;
    *out = v->valuedouble;
    return 1;
}

int ggn_observer_read(const char *path, struct ggn_observer *out, struct base_err *err)
{
    struct ggn_observer o = {0};
    char *text;
    size_t size;
    double window = 1;
    int rc = base_file_read(path, 1 << 24, &text, &size, err);
    if (rc)
        return rc;
    cJSON *root = cJSON_ParseWithLength(text, size);
    const cJSON *map = cJSON_GetObjectItemCaseSensitive(root, "map");
    if (cJSON_IsString(map) && strcmp(map->valuestring, map_names[GGN_MAP_LIGHTNESS]) == 0)
        o.map = GGN_MAP_LIGHTNESS;
    else if (!cJSON_IsString(map) || strcmp(map->valuestring, map_names[GGN_MAP_FLIP]) != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: map must be \"flip\" or \"lightness\"", path);
    if (!rc && !(get(root, "blur_px", 0, 50, &o.blur_px) && get(root, "masking", 0, 100, &o.masking) &&
                          get(root, "window_px", 1, 99, &window) && get(root, "percentile", 0.1, 100, &o.percentile) &&
                          get(root, "tau", 1e-9, 1e9, &o.tau) && get(root, "spread", 1e-3, 10, &o.spread)))
        rc = base_fail(err, BASE_EINVAL, "%s: blur_px, masking, window_px, percentile, tau or spread is missing or out of range", path);
    if (!rc) {
        o.window_px = (int)window | 1;
        *out = o;
    }
    cJSON_Delete(root);
    free(text);
    return rc;
}

int ggn_observer_write(const char *path, const struct ggn_observer *o, const char *calibration, struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fprintf(out.file, "{\n  \"map\": \"%s\", \"blur_px\": %.6g, \"masking\": %.6g, \"window_px\": %d, \"percentile\": %.6g, \"tau\": %.8g, \"spread\": %.6g",
            map_names[o->map], o->blur_px, o->masking, o->window_px, o->percentile, o->tau, o->spread);
    if (calibration)
        fprintf(out.file, ",\n  \"calibration\": %s", calibration);
    fputs("\n}\n", out.file);
    return base_file_commit(&out, err);
}

/* --- pictures of visibility --- */

/* CIE 1976 lightness of a display image. */
static void lightness(const uint8_t *rgb, size_t n, float *out)
{
    const float *linear = ggn_srgb_table();
    for (size_t i = 0; i < n; i++) {
        double y = base_luminance((double)linear[rgb[3 * i]], (double)linear[rgb[3 * i + 1]], (double)linear[rgb[3 * i + 2]]);
        out[i] = (float)(y > 216.0 / 24389.0 ? 116.0 * cbrt(y) - 16.0 : y * 24389.0 / 27.0);
    }
}

static int clamp_index(int i, int n)
{
    return i < 0 ? 0 : i >= n ? n - 1 : i;
}

/* Convolves along x with taps [2r+1] and transposes, so that two calls filter both ways. in [h][w] -> out [w][h]. */
static void filter_transpose(const float *in, float *out, int w, int h, const float *taps, int r)
{
    for (int y = 0; y < h; y++) {
        const float *row = in + (size_t)y * (size_t)w;
        for (int x = 0; x < w; x++) {
            float s = 0.0f;
            if (x >= r && x + r < w)
                for (int k = -r; k <= r; k++)
                    s += taps[k + r] * row[x + k];
            else
                for (int k = -r; k <= r; k++)
                    s += taps[k + r] * row[clamp_index(x + k, w)];
            out[(size_t)x * (size_t)h + (size_t)y] = s;
        }
    }
}

static void filter(float *image, float *tmp, int w, int h, const float *taps, int r)
{
    filter_transpose(image, tmp, w, h, taps, r);
    filter_transpose(tmp, image, h, w, taps, r);
}

static int lightness_map(double blur_px, const uint8_t *reference, const uint8_t *test, int w, int h, float *map, struct base_err *err)
{
    enum { MAX_RADIUS = 200 };
    size_t n = (size_t)w * (size_t)h;
    float *other = malloc(n * sizeof *other), taps[2 * MAX_RADIUS + 1];
    if (!other)
        return base_fail_nomem(err, "observer");
    lightness(reference, n, other);
    lightness(test, n, map);
    for (size_t i = 0; i < n; i++)
        map[i] -= other[i];
    if (blur_px > 0.0) {
        int r = (int)ceil(3.0 * blur_px);
        double sum = 0.0;
        r = r < MAX_RADIUS ? r : MAX_RADIUS;
        for (int i = -r; i <= r; i++)
            sum += exp(-0.5 * i * i / (blur_px * blur_px));
        for (int i = -r; i <= r; i++)
            taps[i + r] = (float)(exp(-0.5 * i * i / (blur_px * blur_px)) / sum);
        filter(map, other, w, h, taps, r);
    }
    for (size_t i = 0; i < n; i++)
        map[i] = fabsf(map[i]);
    free(other);
    return 0;
}

int ggn_observer_error_map(enum ggn_observer_map kind, double blur_px, const uint8_t *reference, const uint8_t *test, int w, int h,
                           float *map, struct base_err *err)
{
    struct ggn_flip_stats stats;
    if (kind == GGN_MAP_LIGHTNESS)
        return lightness_map(blur_px, reference, test, w, h, map, err);
    return ggn_flip(reference, test, w, h, GGN_FLIP_PPD, map, &stats, err);
}

/* Local variance of a plane in a box, in place; room for two planes. */
static void local_variance(float *plane, float *room, int w, int h, int window_px)
{
    enum { MAX_RADIUS = 49 };
    size_t n = (size_t)w * (size_t)h;
    float taps[2 * MAX_RADIUS + 1], *mean = room, *tmp = room + n;
    int r = window_px / 2 < MAX_RADIUS ? window_px / 2 : MAX_RADIUS;
    for (int i = 0; i <= 2 * r; i++)
        taps[i] = 1.0f / (float)(2 * r + 1);
    memcpy(mean, plane, n * sizeof *mean);
    for (size_t i = 0; i < n; i++)
        plane[i] *= plane[i];
    filter(mean, tmp, w, h, taps, r);
    filter(plane, tmp, w, h, taps, r);
    for (size_t i = 0; i < n; i++)
        plane[i] = fmaxf(plane[i] - mean[i] * mean[i], 0.0f);
}

int ggn_observer_deviation(const uint8_t *reference, int w, int h, int window_px, float *deviation, struct base_err *err)
{
    size_t n = (size_t)w * (size_t)h;
    float *room = malloc(2 * n * sizeof *room);
    if (!room)
        return base_fail_nomem(err, "observer");
    lightness(reference, n, deviation);
    local_variance(deviation, room, w, h, window_px);
    for (size_t i = 0; i < n; i++)
        deviation[i] = sqrtf(deviation[i]);
    free(room);
    return 0;
}

/* The k-th smallest value; x is reordered (Hoare's FIND). */
static float select_kth(float *x, size_t n, size_t k)
{
    ptrdiff_t lo = 0, hi = (ptrdiff_t)n - 1, at = (ptrdiff_t)k;
    while (lo < hi) {
        float pivot = x[at];
        ptrdiff_t i = lo, j = hi;
        while (i <= j) {
            while (x[i] < pivot)
                i++;
            while (x[j] > pivot)
                j--;
            if (i <= j) {
                float t = x[i];
                x[i++] = x[j];
                x[j--] = t;
            }
        }
        if (j < at)
            lo = i;
        if (i > at)
            hi = j;
    }
    return x[k];
}

double ggn_observer_pool(const float *map, const float *deviation, size_t n, double masking, double percentile, float *scratch)
{
    float k = (float)masking;
    for (size_t i = 0; i < n; i++)
        scratch[i] = map[i] / (1.0f + k * deviation[i]);
    double at = ceil(percentile / 100.0 * (double)n) - 1.0;
    size_t index = at > 0.0 ? (size_t)at : 0;
    return (double)select_kth(scratch, n, index < n ? index : n - 1);
}

/* --- stimuli --- */

void ggn_stimuli_release(struct ggn_stimuli *s)
{
    free(s->spp);
    free(s->base);
    free(s->difference);
    free(s->work);
    free(s->converged);
    *s = (struct ggn_stimuli){0};
}

static void encode(const float *linear, size_t pixels, uint8_t *rgb)
{
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = ggn_preprocess((double)linear[c * pixels + i], NULL, NULL);
}

/* Sample counts above `beyond` that halves stand for. spp may be NULL; returns their number. */
static int simulated_levels(double beyond, double *spp)
{
    int n = 0;
    for (double v = 20.0; v < GGN_SIMULATED_CAP; v *= 1.15)
        if (round(v) > beyond) {
            if (spp)
                spp[n] = round(v);
            n++;
        }
    if (spp)
        spp[n] = GGN_SIMULATED_CAP;
    return n + 1;
}

/* The level whose half-buffer difference is kept in full. */
static const struct ggn_seq_record *full_level(const struct ggn_seq_block *b)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (ggn_seq_has(&b->levels[i], GGN_PLANE_HALF_F16))
            return &b->levels[i];
    return NULL;
}

int ggn_stimuli_extend(const struct ggn_seq_block *b, int reference_independent)
{
    /* Up to a tenth of an octave is not worth simulating. */
    return reference_independent && b->reference && full_level(b) && 1.07 * b->levels[b->n_levels - 1].spp < GGN_SIMULATED_CAP &&
           ggn_seq_has(b->reference, GGN_PLANE_MEAN_F16);
}

static int init_halves(struct ggn_stimuli *s, int reference_independent, struct base_err *err)
{
    const struct ggn_seq_block *b = s->block;
    const struct ggn_seq_record *full = full_level(b);
    if (!full)
        return base_fail(err, BASE_EINVAL, "block %u has no full level with a half-buffer difference", b->id);
    const struct ggn_seq_record *base = b->reference && reference_independent && b->reference->spp >= full->spp ? b->reference : full;
    s->spp0 = full->spp;
    s->noisy_base = base == full;
    int rc = ggn_seq_half(b, full, s->difference, err);
    if (!rc)
        rc = ggn_seq_mean(b, base, s->base, err);
    if (!rc)
        encode(s->base, (size_t)b->width * b->height, s->converged);
    return rc;
}

static int init_rendered(struct ggn_stimuli *s, int reference_independent, int extend, struct base_err *err)
{
    const struct ggn_seq_block *b = s->block;
    if (!b->reference)
        return base_fail(err, BASE_EINVAL, "block %u has no reference", b->id);
    s->scale = reference_independent && ggn_seq_has(b->reference, GGN_PLANE_MEAN_F16);
    int rc = s->scale ? ggn_seq_mean(b, b->reference, s->base, err) : 0;
    if (!rc && extend) {
        s->spp0 = full_level(b)->spp;
        rc = ggn_seq_half(b, full_level(b), s->difference, err);
    }
    return !rc ? ggn_seq_display(b, b->reference, s->converged, err) : rc;
}

int ggn_stimuli_init(struct ggn_stimuli *out, const struct ggn_seq_block *block, enum ggn_observer_source source,
                     int reference_independent, struct base_err *err)
{
    size_t pixels = (size_t)block->width * block->height;
    if (source == GGN_SOURCE_AUTO && !block->reference)
        source = GGN_SOURCE_HALVES;
    struct ggn_stimuli s = {.block = block, .recorded = source == GGN_SOURCE_HALVES ? 0 : (int)block->n_levels};
    int extend = source == GGN_SOURCE_AUTO && ggn_stimuli_extend(block, reference_independent);
    double beyond = s.recorded > 0 ? 1.07 * block->levels[s.recorded - 1].spp : 0.0;
    s.n = s.recorded + (extend || s.recorded == 0 ? simulated_levels(beyond, NULL) : 0);
    s.spp = malloc((size_t)s.n * sizeof *s.spp);
    s.base = malloc(3 * pixels * sizeof(float));
    s.difference = malloc(3 * pixels * sizeof(float));
    s.work = malloc(3 * pixels * sizeof(float));
    s.converged = malloc(3 * pixels);
    int rc = 0;
    if (!s.spp || !s.base || !s.difference || !s.work || !s.converged)
        rc = base_fail_nomem(err, "observer");
    else if (source == GGN_SOURCE_HALVES)
        rc = init_halves(&s, reference_independent, err);
    else
        rc = init_rendered(&s, reference_independent, extend, err);
    if (rc) {
        ggn_stimuli_release(&s);
        return rc;
    }
    for (int i = 0; i < s.recorded; i++)
        s.spp[i] = block->levels[i].spp;
    if (s.n > s.recorded)
        simulated_levels(beyond, s.spp + s.recorded);
    *out = s;
    return 0;
}

int ggn_stimuli_deviation(struct ggn_stimuli *s, int window_px, float *deviation, struct base_err *err)
{
    int w = (int)s->block->width, h = (int)s->block->height;
    size_t n = (size_t)w * (size_t)h;
    if (!s->noisy_base)
        return ggn_observer_deviation(s->converged, w, h, window_px, deviation, err);
    uint8_t *rgb = malloc(3 * n);
    float *room = malloc(4 * n * sizeof *room);
    int rc = !rgb || !room ? base_fail_nomem(err, "observer") : 0;
    if (!rc) {
        float *noise = room + 2 * n, *other = room + 3 * n;
        for (int side = 0; side < 2; side++) { /* M + D and M - D: half of their difference is noise as strong as M's own */
            for (size_t i = 0; i < 3 * n; i++)
                s->work[i] = s->base[i] + (side == 0 ? s->difference[i] : -s->difference[i]);
            encode(s->work, n, rgb);
            lightness(rgb, n, side == 0 ? noise : other);
        }
        for (size_t i = 0; i < n; i++)
            noise[i] = 0.5f * (noise[i] - other[i]);
        local_variance(noise, room, w, h, window_px);
        lightness(s->converged, n, deviation);
        local_variance(deviation, room, w, h, window_px);
        for (size_t i = 0; i < n; i++)
            deviation[i] = sqrtf(fmaxf(deviation[i] - noise[i], 0.0f));
    }
    free(room);
    free(rgb);
    return rc;
}

int ggn_stimuli_make(struct ggn_stimuli *s, int level, uint8_t *test, struct base_err *err)
{
    const struct ggn_seq_block *b = s->block;
    size_t pixels = (size_t)b->width * b->height;
    if (level >= s->recorded) {
        float scale = (float)sqrt(s->spp0 / s->spp[level]);
        for (size_t i = 0; i < 3 * pixels; i++)
            s->work[i] = s->base[i] + scale * s->difference[i];
        encode(s->work, pixels, test);
        return 0;
    }
    const struct ggn_seq_record *r = &b->levels[level];
    if (s->scale && (ggn_seq_has(r, GGN_PLANE_MEAN_F16) || ggn_seq_has(r, GGN_PLANE_FINE))) {
        float scale = (float)sqrt((double)b->reference->spp / ((double)b->reference->spp + r->spp));
        int rc = ggn_seq_mean(b, r, s->work, err);
        if (rc)
            return rc;
        for (size_t i = 0; i < 3 * pixels; i++)
            s->work[i] = s->base[i] + scale * (s->work[i] - s->base[i]);
    } else {
        return ggn_seq_display(b, r, test, err);
    }
    encode(s->work, pixels, test);
    return 0;
}

/* --- curves --- */

void ggn_curve_release(struct ggn_curve *c)
{
    free(c->spp);
    free(c->score);
    *c = (struct ggn_curve){0};
}

int ggn_observer_curve(const struct ggn_observer *o, const struct ggn_seq_block *block, enum ggn_observer_source source,
                       int reference_independent, struct ggn_curve *curve, struct base_err *err)
{
    struct ggn_stimuli s;
    int w = (int)block->width, h = (int)block->height;
    size_t n = (size_t)w * (size_t)h;
    int rc = ggn_stimuli_init(&s, block, source, reference_independent, err);
    if (rc)
        return rc;
    struct ggn_curve c = {.n = s.n};
    c.spp = malloc((size_t)s.n * sizeof *c.spp);
    c.score = malloc((size_t)s.n * sizeof *c.score);
    uint8_t *test = malloc(3 * n);
    float *map = malloc(3 * n * sizeof *map);
    if (!c.spp || !c.score || !test || !map)
        rc = base_fail_nomem(err, "observer");
    else
        rc = ggn_stimuli_deviation(&s, o->window_px, map + n, err);
    for (int i = 0; i < s.n && !rc; i++) {
        rc = ggn_stimuli_make(&s, i, test, err);
        if (!rc)
            rc = ggn_observer_error_map(o->map, o->blur_px, s.converged, test, w, h, map, err);
        if (!rc) {
            c.spp[i] = s.spp[i];
            c.score[i] = ggn_observer_pool(map, map + n, n, o->masking, o->percentile, map + 2 * n);
        }
    }
    free(map);
    free(test);
    ggn_stimuli_release(&s);
    if (rc)
        ggn_curve_release(&c);
    else
        *curve = c;
    return rc;
}

/* Where the line through two points crosses y in log-log; half way where a point cannot be drawn. */
static double log_cross(double x0, double y0, double x1, double y1, double y)
{
    double t = y0 > 0.0 && y1 > 0.0 && y0 != y1 ? log(y / y0) / log(y1 / y0) : 0.5;
    t = t > 0.0 ? (t < 1.0 ? t : 1.0) : 0.0;
    return x0 * pow(x1 / x0, t);
}

double ggn_curve_threshold(const struct ggn_curve *c, double tau, int *censored)
{
    int last = c->n - 1;
    while (last >= 0 && !(c->score[last] > tau))
        last--;
    *censored = last == c->n - 1;
    if (last < 0)
        return c->spp[0];
    if (*censored)
        return c->spp[last];
    return log_cross(c->spp[last], c->score[last], c->spp[last + 1], c->score[last + 1], tau);
}

double ggn_curve_at(const struct ggn_curve *c, double spp)
{
    int i = 0;
    if (spp <= c->spp[0])
        return c->score[0];
    if (spp >= c->spp[c->n - 1])
        return c->score[c->n - 1];
    while (c->spp[i + 1] < spp)
        i++;
    double t = log(spp / c->spp[i]) / log(c->spp[i + 1] / c->spp[i]), a = c->score[i], b = c->score[i + 1];
    return a > 0.0 && b > 0.0 ? a * pow(b / a, t) : a + t * (b - a);
}
