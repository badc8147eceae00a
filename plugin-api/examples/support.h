/* SPDX-License-Identifier: MIT
 *
 * What the examples with parameters or pixels share: reading parameters, checking what the host passes, reading planes.
 *
 * An example is a rule: a parameter table, the planes it wants and a function that judges one block. The rule has no
 * history; begin_frame copies a few numbers and evaluate only reads the instance, so that calls may overlap.
 * Include it once, in the file that defines `static const struct ex_rule ex_rule`.
 */
#ifndef LULL_EXAMPLES_SUPPORT_H
#define LULL_EXAMPLES_SUPPORT_H

#include <lull/criterion.h>

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EX_PARAM_MAX = 8 };

struct lull_instance {
    const struct lull_host *host; /* borrows until destroy */
    double value[EX_PARAM_MAX];   /* of the rule's parameters, in its order */
    uint32_t block_count;         /* of the open frame, 0 = none is open */
    uint64_t spp_max;             /* 0 = no limit */
    double picture_pixels;        /* of the whole picture */
    double exposure;
    double luminance[3]; /* weights of R, G, B */
};

struct ex_rule {
    const struct lull_param *params;
    uint32_t param_count;
    uint32_t planes_required;
    uint32_t planes_used;
    int32_t first_spp_param; /* index of the parameter that holds first_spp, -1: first_spp is 1 */
    /* Judges one block that has been checked against the view; *decision holds the host's presets. */
    void (*judge)(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision);
};

static const struct ex_rule ex_rule;

__attribute__((format(printf, 3, 4))) static inline int32_t ex_fail(struct lull_error *err, int32_t code, const char *format,
                                                                    ...)
{
    if (err && LULL_HAS(struct lull_error, err, message)) {
        err->code = code;
        va_list args;
        va_start(args, format);
        vsnprintf(err->message, sizeof err->message, format, args);
        va_end(args);
    }
    return code;
}

/* --- parameters ---------------------------------------------------------------------------------------------------- */

/* A decimal number that fills the whole text. Not strtod: that follows the process's locale. */
static inline int ex_number(const char *text, double *out)
{
    double mantissa = 0;
    long exponent = 0, digits = 0;
    int negative = *text == '-';
    text += *text == '-' || *text == '+';
    for (int after_point = 0; (*text >= '0' && *text <= '9') || (*text == '.' && !after_point); text++) {
        if (*text == '.') {
            after_point = 1;
            continue;
        }
        mantissa = 10 * mantissa + (*text - '0');
        exponent -= after_point;
        digits++;
    }
    if (digits == 0 || digits > 300)
        return 0;
    if (*text == 'e' || *text == 'E') {
        text++;
        long e = 0, e_digits = 0, sign = *text == '-' ? -1 : 1;
        for (text += *text == '-' || *text == '+'; *text >= '0' && *text <= '9' && e_digits < 4; text++, e_digits++)
            e = 10 * e + (*text - '0');
        if (e_digits == 0)
            return 0;
        exponent += sign * e;
    }
    /* dividing by a power of ten that is exact gives the nearest double for short numbers such as 0.05 */
    double value = exponent < 0 ? mantissa / pow(10, (double)-exponent) : mantissa * pow(10, (double)exponent);
    *out = negative ? -value : value;
    return *text == '\0' && isfinite(value);
}

static inline int32_t ex_set(double value[EX_PARAM_MAX], const char *key, const char *text, struct lull_error *err)
{
    for (uint32_t i = 0; i < ex_rule.param_count; i++) {
        const struct lull_param *p = &ex_rule.params[i];
        if (strcmp(p->name, key) != 0)
            continue;
        double number;
        if (!ex_number(text, &number) || (p->type != LULL_PARAM_FLOAT && number != floor(number)))
            return ex_fail(err, LULL_E_VALUE, "%s: '%.80s' is not %s", p->name, text,
                           p->type == LULL_PARAM_FLOAT ? "a number" : "an integer");
        double min = p->type == LULL_PARAM_BOOL ? 0 : p->min, max = p->type == LULL_PARAM_BOOL ? 1 : p->max;
        if (number < min || number > max)
            return ex_fail(err, LULL_E_VALUE, "%s: %.80s is not in [%g, %g]", p->name, text, min, max);
        value[i] = number;
        return LULL_OK;
    }
    return ex_fail(err, LULL_E_KEY, "no parameter '%.80s'", key);
}

static inline int32_t ex_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                                uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err)
{
    if (!instance || (pair_count > 0 && !pairs))
        return ex_fail(err, LULL_E_INVALID, "create: an argument is missing");
    if ((host && !LULL_HAS(struct lull_host, host, get_extension)) ||
        (pair_count > 0 && pair_stride < sizeof *pairs))
        return ex_fail(err, LULL_E_VERSION, "create: the host's structs are older than version 1.0");
    struct lull_instance made = {.host = host};
    for (uint32_t i = 0; i < ex_rule.param_count; i++)
        if (ex_set(made.value, ex_rule.params[i].name, ex_rule.params[i].default_value, err) != LULL_OK)
            return LULL_E_INTERNAL;
    for (uint32_t i = 0; i < pair_count; i++) {
        const void *at = (const char *)pairs + (size_t)i * pair_stride;
        const struct lull_pair *pair = at;
        if (!pair->key || !pair->value)
            return ex_fail(err, LULL_E_INVALID, "create: a key or value is missing");
        int32_t status = ex_set(made.value, pair->key, pair->value, err);
        if (status != LULL_OK)
            return status;
    }
    struct lull_instance *copy = malloc(sizeof *copy);
    if (!copy)
        return ex_fail(err, LULL_E_MEMORY, "out of memory");
    *copy = made;
    *instance = copy;
    return LULL_OK;
}

static inline void ex_destroy(struct lull_instance *in)
{
    free(in);
}

static inline uint64_t ex_first_spp(const struct lull_instance *in)
{
    return ex_rule.first_spp_param < 0 ? 1 : (uint64_t)in->value[ex_rule.first_spp_param];
}

static inline int32_t ex_requirements(const struct lull_instance *in, struct lull_requirements *req, struct lull_error *err)
{
    if (!in || !req)
        return ex_fail(err, LULL_E_INVALID, "requirements: an argument is missing");
    if (!LULL_HAS(struct lull_requirements, req, bytes_per_block))
        return ex_fail(err, LULL_E_VERSION, "requirements: the host's struct is older than version 1.0");
    struct lull_requirements out = {.struct_size = req->struct_size,
                                    .flags = LULL_REQ_FLEXIBLE,
                                    .planes_required = ex_rule.planes_required,
                                    .planes_used = ex_rule.planes_used,
                                    .first_spp = ex_first_spp(in)};
    *req = out; /* no field is newer than 1.0, so that a longer struct of the host's keeps the rest */
    return LULL_OK;
}

/* --- frame ----------------------------------------------------------------------------------------------------------- */

static const char *const ex_plane_names[LULL_PLANE_COUNT] = {"COLOR", "WEIGHT", "SPP",    "MOMENT2",
                                                             "HALF",  "ALBEDO", "NORMAL", "DEPTH"};

static inline int32_t ex_blocks_check(const struct lull_frame *frame, struct lull_error *err)
{
    if (!frame->blocks || frame->block_count == 0 || frame->block_stride < sizeof(struct lull_rect))
        return ex_fail(err, LULL_E_INVALID, "begin_frame: the frame has no blocks");
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const void *at = (const char *)frame->blocks + (size_t)i * frame->block_stride;
        const struct lull_rect *r = at;
        if (r->x0 < 0 || r->y0 < 0 || r->x0 >= r->x1 || r->y0 >= r->y1 || (uint32_t)r->x1 > frame->width ||
            (uint32_t)r->y1 > frame->height)
            return ex_fail(err, LULL_E_INVALID, "begin_frame: block %u is empty or outside the picture", i);
    }
    return LULL_OK;
}

static inline int32_t ex_begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    if (!in || !frame)
        return ex_fail(err, LULL_E_INVALID, "begin_frame: an argument is missing");
    if (!LULL_HAS(struct lull_frame, frame, rgb_to_xyz))
        return ex_fail(err, LULL_E_VERSION, "begin_frame: the host's struct is older than version 1.0");
    if (in->block_count > 0 && !(frame->flags & LULL_FRAME_RESTART))
        return ex_fail(err, LULL_E_STATE, "begin_frame: a frame is open");
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++)
        if (ex_rule.planes_required & ~frame->planes & LULL_PLANE_BIT(i))
            return ex_fail(err, LULL_E_PLANE, "begin_frame: the plane %s is missing", ex_plane_names[i]);
    int32_t status = ex_blocks_check(frame, err);
    if (status != LULL_OK)
        return status;
    in->block_count = frame->block_count;
    in->spp_max = frame->spp_max;
    in->picture_pixels = (double)frame->width * frame->height;
    in->exposure = isfinite(frame->exposure) && frame->exposure > 0 ? frame->exposure : 1;
    for (int c = 0; c < 3; c++) {
        double y = frame->rgb_to_xyz[3 + c];
        in->luminance[c] = isfinite(y) ? y : 1.0 / 3;
    }
    return LULL_OK;
}

static inline void ex_end_frame(struct lull_instance *in)
{
    if (in)
        in->block_count = 0;
}

/* --- pixels ---------------------------------------------------------------------------------------------------------- */

static inline const struct lull_plane *ex_plane(const struct lull_view *view, unsigned index)
{
    if (index >= view->plane_count)
        return NULL;
    const void *at = (const char *)view->planes + (size_t)index * view->plane_stride;
    const struct lull_plane *plane = at;
    return plane->data ? plane : NULL;
}

static inline double ex_half_float(uint16_t h)
{
    int exponent = (h >> 10) & 31, mantissa = h & 1023;
    double value = exponent == 31  ? (mantissa ? (double)NAN : (double)INFINITY)
                   : exponent == 0 ? ldexp(mantissa, -24)
                                   : ldexp(mantissa + 1024, exponent - 25);
    return h & 0x8000 ? -value : value;
}

static inline double ex_stored(const char *at, int32_t type)
{
    switch (type) {
    case LULL_TYPE_F32: {
        float v;
        memcpy(&v, at, sizeof v);
        return (double)v;
    }
    case LULL_TYPE_F16: {
        uint16_t v;
        memcpy(&v, at, sizeof v);
        return ex_half_float(v);
    }
    case LULL_TYPE_F64: {
        double v;
        memcpy(&v, at, sizeof v);
        return v;
    }
    default: {
        uint32_t v;
        memcpy(&v, at, sizeof v);
        return v;
    }
    }
}

static inline const char *ex_address(const struct lull_view *view, const struct lull_plane *plane, int32_t x, int32_t y)
{
    return (const char *)plane->data + ((int64_t)x - view->x0) * plane->stride_x + ((int64_t)y - view->y0) * plane->stride_y;
}

/* Estimates of `count` pixels of a row of the block from (x, y) on: out[pixel][channel]; NaN where N is 0. */
static inline void ex_span(const struct lull_view *view, const struct lull_plane *plane, const struct lull_block *block,
                           int32_t x, int32_t y, int32_t count, int channels, double *out)
{
    const struct lull_plane *weight = plane->normaliser == LULL_NORM_WEIGHT ? ex_plane(view, LULL_PLANE_WEIGHT) : NULL;
    double n = plane->normaliser == LULL_NORM_SPP        ? (double)block->spp
               : plane->normaliser == LULL_NORM_HALF_SPP ? (double)block->half_spp
                                                         : 1;
    const char *at = ex_address(view, plane, x, y);
    for (int32_t i = 0; i < count; i++, at += plane->stride_x) {
        if (weight)
            n = ex_stored(ex_address(view, weight, x + i, y), weight->type) * weight->scale;
        double factor = n != 0 ? plane->scale / n : (double)NAN;
        for (int c = 0; c < channels; c++)
            out[i * channels + c] = ex_stored(at + c * plane->stride_c, plane->type) * factor;
    }
}

/* Displayed luminance before the transfer curve. */
static inline double ex_luminance(const struct lull_instance *in, const double rgb[3])
{
    return in->exposure * (in->luminance[0] * rgb[0] + in->luminance[1] * rgb[1] + in->luminance[2] * rgb[2]);
}

static inline double ex_block_pixels(const struct lull_block *block)
{
    return ((double)block->x1 - block->x0) * ((double)block->y1 - block->y0);
}

/* --- evaluate ---------------------------------------------------------------------------------------------------------- */

static inline int32_t ex_plane_check(const struct lull_view *view, unsigned index, struct lull_error *err)
{
    static const uint32_t channels[LULL_PLANE_COUNT] = {3, 1, 1, 1, 3, 3, 3, 1};
    const char *name = ex_plane_names[index];
    const struct lull_plane *p = ex_plane(view, index);
    if (!p && (ex_rule.planes_required & LULL_PLANE_BIT(index)))
        return ex_fail(err, LULL_E_PLANE, "evaluate: the plane %s is missing", name);
    if (!p)
        return LULL_OK;
    if (p->type < LULL_TYPE_F32 || p->type > LULL_TYPE_U32 || p->normaliser < LULL_NORM_ONE ||
        p->normaliser > LULL_NORM_WEIGHT || p->channels < channels[index] || !isfinite(p->scale) || p->scale == 0)
        return ex_fail(err, LULL_E_PLANE, "evaluate: the plane %s has an unknown form", name);
    if (p->normaliser == LULL_NORM_WEIGHT && index != LULL_PLANE_WEIGHT)
        return ex_plane(view, LULL_PLANE_WEIGHT)
                   ? ex_plane_check(view, LULL_PLANE_WEIGHT, err)
                   : ex_fail(err, LULL_E_PLANE, "evaluate: the plane %s needs WEIGHT, which is missing", name);
    return LULL_OK;
}

/* The blocks of one evaluate call. */
struct ex_batch {
    const struct lull_instance *in;
    const struct lull_view *view;
    const char *blocks;
    char *decisions;
    uint32_t block_stride, decision_stride;
};

static inline const struct lull_block *ex_block(const struct ex_batch *batch, uint64_t i)
{
    const void *at = batch->blocks + i * batch->block_stride;
    return at;
}

static inline void ex_judge_task(void *arg, uint64_t task, uint32_t worker)
{
    (void)worker; /* the rules need no scratch memory */
    const struct ex_batch *batch = arg;
    void *decision = batch->decisions + task * batch->decision_stride;
    ex_rule.judge(batch->in, batch->view, ex_block(batch, task), decision);
}

static inline int32_t ex_batch_check(const struct ex_batch *batch, uint32_t count, struct lull_error *err)
{
    const struct lull_view *view = batch->view;
    if (ex_rule.planes_used != 0 && view->plane_count > 0 &&
        (!view->planes || view->plane_stride < sizeof(struct lull_plane)))
        return ex_fail(err, LULL_E_INVALID, "evaluate: the view has no planes");
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++) {
        int32_t status = ex_rule.planes_used & LULL_PLANE_BIT(i) ? ex_plane_check(view, i, err) : LULL_OK;
        if (status != LULL_OK)
            return status;
    }
    for (uint32_t i = 0; i < count; i++) {
        const struct lull_block *b = ex_block(batch, i);
        if (b->id >= batch->in->block_count || b->x0 >= b->x1 || b->y0 >= b->y1 || b->x0 < view->x0 || b->y0 < view->y0 ||
            b->x1 > view->x1 || b->y1 > view->y1)
            return ex_fail(err, LULL_E_INVALID, "evaluate: block %u is not in the frame or not in the view", b->id);
    }
    return LULL_OK;
}

static inline int32_t ex_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                                  uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                                  uint32_t count, struct lull_error *err)
{
    if (!in || !view || (count > 0 && (!blocks || !decisions)))
        return ex_fail(err, LULL_E_INVALID, "evaluate: an argument is missing");
    if (!LULL_HAS(struct lull_view, view, elapsed_s) || block_stride < sizeof *blocks || decision_stride < sizeof *decisions)
        return ex_fail(err, LULL_E_VERSION, "evaluate: the host's structs are older than version 1.0");
    if (in->block_count == 0)
        return ex_fail(err, LULL_E_STATE, "evaluate: no frame is open");
    struct ex_batch batch = {in, view, (const char *)blocks, (char *)decisions, block_stride, decision_stride};
    int32_t status = ex_batch_check(&batch, count, err);
    if (status != LULL_OK)
        return status;
    if (in->host && in->host->parallel_for && count > 1) {
        status = in->host->parallel_for(in->host, count, ex_judge_task, &batch);
        return status == LULL_OK ? LULL_OK : ex_fail(err, status, "evaluate: the host left out blocks");
    }
    for (uint32_t i = 0; i < count; i++)
        ex_judge_task(&batch, i, 0);
    return LULL_OK;
}

static inline const void *ex_get_extension(const char *id)
{
    (void)id; /* no history, hence no lull.state/1 */
    return NULL;
}

/* The functions of a rule's table. */
#define EX_FUNCTIONS                                                                                                        \
    .create = ex_create, .requirements = ex_requirements, .begin_frame = ex_begin_frame, .evaluate = ex_evaluate,           \
    .end_frame = ex_end_frame, .destroy = ex_destroy, .get_extension = ex_get_extension

/* --- the next check ------------------------------------------------------------------------------------------------------
 */

static inline uint64_t ex_spp(double spp)
{
    return spp >= 1e18 ? UINT64_C(1000000000000000000) : (uint64_t)spp;
}

/* Schedules the next check of a block that continues: where it is expected to stop, but at least a tenth and at most
 * `growth` times more samples than now, so that the checks of a block stay a logarithmic number. predicted_spp may be NaN.
 */
static inline void ex_continue(const struct lull_instance *in, const struct lull_block *block, double growth,
                               double predicted_spp, struct lull_decision *decision)
{
    double spp = (double)block->spp, first = (double)ex_first_spp(in);
    double next = isnan(predicted_spp) ? spp * growth : fmin(fmax(predicted_spp, spp * 1.1), spp * growth);
    decision->action = LULL_CONTINUE;
    decision->predicted_spp = predicted_spp;
    decision->next_spp = ex_spp(ceil(fmax(fmax(next, spp + 1), first)));
    if (in->spp_max > block->spp && decision->next_spp > in->spp_max)
        decision->next_spp = in->spp_max;
}

/* --- what two-number statistics of a block have in common -------------------------------------------------------------- */

/* Gathers over the pixels of a block. */
struct ex_tally {
    double sum;       /* of the rule's error over the valid pixels */
    double valid;     /* pixels with a judgement */
    double early;     /* pixels with too few samples for one */
    double bad;       /* pixels that are NaN or infinite: left out, or one of them would keep the block alive for ever */
    double unsettled; /* valid pixels that hang on few samples, see the tail parameters */
};

/* The verdict that the rules share. A mean over many pixels hides a few that rare bright paths have just hit, hence the
 * second condition: the share of unsettled pixels. */
static inline void ex_verdict(const struct lull_instance *in, const struct lull_block *block, const struct ex_tally *tally,
                              double error, double threshold, double tail_share, double growth,
                              struct lull_decision *decision)
{
    double spp = (double)block->spp, first = (double)ex_first_spp(in);
    decision->flags = tally->bad > 0 ? LULL_DECISION_BAD_INPUT : 0;
    if (block->spp < ex_first_spp(in) || tally->early > 0) {
        decision->flags |= LULL_DECISION_TOO_EARLY;
        ex_continue(in, block, growth, (double)NAN, decision);
        return;
    }
    if (tally->valid == 0) {
        /* Not one usable pixel: nothing that more samples could mend, so it ends some time, flagged as bad input. */
        if (spp >= 64 * first)
            decision->action = LULL_STOP;
        else
            ex_continue(in, block, growth, (double)NAN, decision);
        return;
    }
    decision->error = error;
    int settled = tally->unsettled <= tail_share * tally->valid;
    if (error <= threshold && settled) {
        decision->action = LULL_STOP;
        decision->predicted_spp = spp;
        return;
    }
    /* The error of a mean falls as 1/sqrt(spp); how long a tail takes cannot be told. */
    double ratio = threshold > 0 ? error / threshold : (double)INFINITY;
    double predicted = ratio < 1e6 ? spp * ratio * ratio : (double)NAN;
    ex_continue(in, block, growth, settled ? predicted : (double)NAN, decision);
}

#endif
