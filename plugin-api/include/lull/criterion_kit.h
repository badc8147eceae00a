/* SPDX-License-Identifier: MIT
 *
 * lull/criterion_kit.h - what every criterion (lull/criterion.h) has to do besides judging: read its parameters, check what
 * the host passes, fill errors, and get estimates out of planes of any type, stride and normaliser.
 *
 * Not part of the ABI: functions of the criterion's own, compiled into it. C99 and C++11, nothing but the C library. Use as
 * much of it as you like:
 *
 * - A criterion without history is a table of parameters and a function that judges one block; LULL_KIT_CRITERION makes the
 *   rest (plugin-api/examples).
 * - A criterion with memory of its own begins its struct lull_instance with a struct lull_kit, calls lull_kit_create,
 *   lull_kit_frame_check and lull_kit_frame_open, and lull_kit_evaluate from its own functions, and adds what it keeps.
 *
 * Functions that return int32_t return LULL_OK or a LULL_E_ code with *err (may be NULL) filled, and change nothing when
 * they fail. Nothing here has static state or takes a lock; functions on one instance may overlap as criterion.h says.
 */
#ifndef LULL_CRITERION_KIT_H
#define LULL_CRITERION_KIT_H

#include <lull/criterion.h>

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LULL_KIT_PARAM_MAX = 16 }; /* parameters of one criterion */

/* What a criterion is made of, static. */
struct lull_kit_rule {
    uint32_t planes_required; /* masks of LULL_PLANE_BIT, as in lull_requirements */
    uint32_t planes_used;
    const char *first_spp; /* name of the parameter that holds it; NULL: 1 */

    /* [eval], for different blocks at the same time, each with its own worker < lull_kit_workers(). Answers for one block,
     * which has been checked against frame and view; *decision holds the host's presets. */
    void (*judge)(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision, uint32_t worker);
    /* What the criterion itself demands of a block before any is judged; NULL: nothing. */
    int32_t (*check)(const struct lull_instance *in, const struct lull_block *block, struct lull_error *err);
};

/* Begins every struct lull_instance. */
struct lull_kit {
    const struct lull_kit_rule *rule;
    const struct lull_host *host; /* borrows until destroy; may be NULL */
    /* Of the parameters in the table's order: INT, FLOAT, BOOL the number, CHOICE the index of the choice; NaN where there
     * is neither a value nor a default, and for text. */
    double value[LULL_KIT_PARAM_MAX];
    struct lull_requirements need; /* what requirements answers; the criterion's create may refine it */

    /* Of the open frame. */
    uint32_t block_count; /* 0 = no frame is open */
    int32_t transfer;     /* LULL_TRANSFER_ */
    uint64_t spp_max;     /* 0 = no limit */
    double picture_pixels;
    double exposure; /* 1 if the host gave nonsense */
    double gamma;
    double luminance[3]; /* weights of R, G, B; equal ones if the host gave nonsense */
};

static inline struct lull_kit *lull_kit_of(struct lull_instance *in) { return (struct lull_kit *)(void *)in; }

static inline const struct lull_kit *lull_kit_read_of(const struct lull_instance *in)
{
    return (const struct lull_kit *)(const void *)in;
}

/* Element i of an array whose elements are `stride` bytes apart. */
static inline const void *lull_kit_at(const void *array, uint32_t stride, uint64_t i)
{
    return (const char *)array + i * stride;
}

/* --- errors -------------------------------------------------------------------------------------------------------- */

/* Fills *err, unless it is NULL or too small, and returns code. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
static inline int32_t
lull_kit_fail(struct lull_error *err, int32_t code, const char *format, ...)
{
    if (err && LULL_HAS(struct lull_error, err, message)) {
        va_list args;
        err->code = code;
        va_start(args, format);
        vsnprintf(err->message, sizeof err->message, format, args);
        va_end(args);
    }
    return code;
}

/* --- parameters ---------------------------------------------------------------------------------------------------- */

/* Elements of a parameter table. `preset` is the default's text. */
#define LULL_KIT_OF(name, help, preset, choices, min, max, type) \
    { \
        name, help, preset, choices, min, max, type, 0 \
    }
#define LULL_KIT_INT(name, preset, min, max, help) LULL_KIT_OF(name, help, preset, NULL, min, max, LULL_PARAM_INT)
#define LULL_KIT_FLOAT(name, preset, min, max, help) LULL_KIT_OF(name, help, preset, NULL, min, max, LULL_PARAM_FLOAT)
#define LULL_KIT_BOOL(name, preset, help) LULL_KIT_OF(name, help, preset, NULL, 0, 0, LULL_PARAM_BOOL)
#define LULL_KIT_CHOICE(name, preset, choices, help) LULL_KIT_OF(name, help, preset, choices, 0, 0, LULL_PARAM_CHOICE)
#define LULL_KIT_FILE(name, preset, help) LULL_KIT_OF(name, help, preset, NULL, 0, 0, LULL_PARAM_FILE)

/* A decimal number that fills the whole text; 0 if it is none. Not strtod, which follows the process's locale. */
static inline int lull_kit_number(const char *text, double *out)
{
    double mantissa = 0, power = 0, value;
    int negative = *text == '-', digits = 0, point = 0;
    text += *text == '-' || *text == '+';
    for (; (*text >= '0' && *text <= '9') || (*text == '.' && !point); text++) {
        if (*text == '.') {
            point = 1;
            continue;
        }
        mantissa = 10 * mantissa + (*text - '0');
        power -= point;
        digits++;
    }
    if (digits == 0 || digits > 300)
        return 0;
    if (*text == 'e' || *text == 'E') {
        double exponent = 0;
        int sign = text[1] == '-' ? -1 : 1, n = 0;
        text += 1 + (text[1] == '-' || text[1] == '+');
        for (; *text >= '0' && *text <= '9' && n < 4; text++, n++)
            exponent = 10 * exponent + (*text - '0');
        if (n == 0)
            return 0;
        power += sign * exponent;
    }
    /* Dividing by an exact power of ten rounds short numbers such as 0.05 correctly; multiplying by its inverse does not. */
    value = power < 0 ? mantissa / pow(10, -power) : mantissa * pow(10, power);
    if (*text != '\0' || !isfinite(value))
        return 0;
    *out = negative ? -value : value;
    return 1;
}

/* Index of text among choices joined by '|', -1 if it is none of them. */
static inline int lull_kit_choice(const char *choices, const char *text)
{
    size_t length = strlen(text);
    for (int i = 0; choices; i++) {
        size_t n = strcspn(choices, "|");
        if (n == length && memcmp(choices, text, n) == 0)
            return i;
        choices = choices[n] != '\0' ? choices + n + 1 : NULL;
    }
    return -1;
}

/* Puts text into *value as the parameter's type and range allow. */
static inline int32_t lull_kit_value(const struct lull_param *p, const char *text, double *value, struct lull_error *err)
{
    double min = p->type == LULL_PARAM_BOOL ? 0 : p->min, max = p->type == LULL_PARAM_BOOL ? 1 : p->max, number;
    if (p->type == LULL_PARAM_FILE || p->type == LULL_PARAM_TEXT)
        return LULL_OK;
    if (p->type == LULL_PARAM_CHOICE) {
        number = lull_kit_choice(p->choices, text);
        if (number < 0)
            return lull_kit_fail(err, LULL_E_VALUE, "%s: '%.80s' is none of %s", p->name, text, p->choices);
    } else {
        if (!lull_kit_number(text, &number) || (p->type != LULL_PARAM_FLOAT && number != floor(number)))
            return lull_kit_fail(err, LULL_E_VALUE, "%s: '%.80s' is not %s", p->name, text,
                                 p->type == LULL_PARAM_FLOAT  ? "a number"
                                 : p->type == LULL_PARAM_BOOL ? "0 or 1"
                                                              : "an integer");
        if (number < min || number > max)
            return lull_kit_fail(err, LULL_E_VALUE, "%s: %.80s is not in [%g, %g]", p->name, text, min, max);
    }
    *value = number;
    return LULL_OK;
}

/* Index of the criterion's parameter with this name, -1 if there is none. */
static inline int lull_kit_param(const struct lull_criterion *c, const char *name)
{
    for (uint32_t i = 0; i < c->param_count; i++)
        if (strcmp(c->params[i].name, name) == 0)
            return (int)i;
    return -1;
}

/* Defaults of the table (made of struct lull_param of this header's size), overridden by the pairs. value and text:
 * [LULL_KIT_PARAM_MAX]; text: what each parameter was given or its default, borrowed from the arguments, else NULL. */
static inline int32_t lull_kit_values(const struct lull_criterion *c, const struct lull_pair *pairs, uint32_t pair_count,
                                      uint32_t pair_stride, double *value, const char **text, struct lull_error *err)
{
    if (c->param_count > LULL_KIT_PARAM_MAX)
        return lull_kit_fail(err, LULL_E_INTERNAL, "create: more than %d parameters", LULL_KIT_PARAM_MAX);
    for (uint32_t i = 0; i < LULL_KIT_PARAM_MAX; i++) {
        value[i] = (double)NAN;
        text[i] = i < c->param_count ? c->params[i].default_value : NULL;
        if (text[i] && lull_kit_value(&c->params[i], text[i], &value[i], err) != LULL_OK)
            return LULL_E_INTERNAL;
    }
    for (uint32_t i = 0; i < pair_count; i++) {
        const struct lull_pair *pair = (const struct lull_pair *)lull_kit_at(pairs, pair_stride, i);
        if (!pair->key || !pair->value)
            return lull_kit_fail(err, LULL_E_INVALID, "create: a key or value is missing");
        int k = lull_kit_param(c, pair->key);
        if (k < 0)
            return lull_kit_fail(err, LULL_E_KEY, "no parameter '%.80s'", pair->key);
        int32_t status = lull_kit_value(&c->params[k], pair->value, &value[k], err);
        if (status != LULL_OK)
            return status;
        text[k] = pair->value;
    }
    return LULL_OK;
}

/* --- life ---------------------------------------------------------------------------------------------------------- */

/* Makes an instance of `size` bytes, zero beyond its struct lull_kit, for a criterion of this table; the caller owns it
 * (free). text: see lull_kit_values; may be NULL. */
static inline int32_t lull_kit_create(const struct lull_kit_rule *rule, const struct lull_criterion *c, size_t size,
                                      const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                                      uint32_t pair_stride, const char **text, struct lull_instance **instance,
                                      struct lull_error *err)
{
    double value[LULL_KIT_PARAM_MAX];
    const char *given[LULL_KIT_PARAM_MAX];
    if (!instance || (pair_count > 0 && !pairs))
        return lull_kit_fail(err, LULL_E_INVALID, "create: an argument is missing");
    if ((host && !LULL_HAS(struct lull_host, host, get_extension)) || (pair_count > 0 && pair_stride < sizeof *pairs))
        return lull_kit_fail(err, LULL_E_VERSION, "create: the host's structs are older than version 1.0");
    int32_t status = lull_kit_values(c, pairs, pair_count, pair_stride, value, text ? text : given, err);
    if (status != LULL_OK)
        return status;
    struct lull_kit *kit = (struct lull_kit *)calloc(1, size);
    if (!kit)
        return lull_kit_fail(err, LULL_E_MEMORY, "create: out of memory");
    kit->rule = rule;
    kit->host = host;
    memcpy(kit->value, value, sizeof value);
    kit->need.flags = LULL_REQ_FLEXIBLE;
    kit->need.planes_required = rule->planes_required;
    kit->need.planes_used = rule->planes_used;
    kit->need.first_spp = rule->first_spp ? (uint64_t)value[lull_kit_param(c, rule->first_spp)] : 1;
    *instance = (struct lull_instance *)(void *)kit;
    return LULL_OK;
}

static inline void lull_kit_destroy(struct lull_instance *in) { free(in); }

static inline int32_t lull_kit_requirements(const struct lull_instance *in, struct lull_requirements *req,
                                            struct lull_error *err)
{
    if (!in || !req)
        return lull_kit_fail(err, LULL_E_INVALID, "requirements: an argument is missing");
    if (!LULL_HAS(struct lull_requirements, req, bytes_per_block))
        return lull_kit_fail(err, LULL_E_VERSION, "requirements: the host's struct is older than version 1.0");
    uint32_t size = req->struct_size; /* a newer host's struct is longer and keeps the rest */
    *req = lull_kit_read_of(in)->need;
    req->struct_size = size;
    return LULL_OK;
}

static inline const void *lull_kit_get_extension(const char *id)
{
    (void)id; /* no history, hence no lull.state/1 */
    return NULL;
}

/* --- a frame ------------------------------------------------------------------------------------------------------- */

static inline const char *lull_kit_plane_name(unsigned plane)
{
    static const char *const names[LULL_PLANE_COUNT] = {"COLOR", "WEIGHT", "SPP",    "MOMENT2",
                                                        "HALF",  "ALBEDO", "NORMAL", "DEPTH"};
    return names[plane];
}

static inline const struct lull_rect *lull_kit_rect(const struct lull_frame *frame, uint32_t id)
{
    return (const struct lull_rect *)lull_kit_at(frame->blocks, frame->block_stride, id);
}

/* begin_frame's arguments: sizes, state, required planes, blocks inside the picture. */
static inline int32_t lull_kit_frame_check(const struct lull_instance *in, const struct lull_frame *frame,
                                           struct lull_error *err)
{
    const struct lull_kit *kit = lull_kit_read_of(in);
    if (!in || !frame)
        return lull_kit_fail(err, LULL_E_INVALID, "begin_frame: an argument is missing");
    if (!LULL_HAS(struct lull_frame, frame, rgb_to_xyz))
        return lull_kit_fail(err, LULL_E_VERSION, "begin_frame: the host's struct is older than version 1.0");
    if (kit->block_count > 0 && !(frame->flags & LULL_FRAME_RESTART))
        return lull_kit_fail(err, LULL_E_STATE, "begin_frame: a frame is open");
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++)
        if (kit->need.planes_required & ~frame->planes & LULL_PLANE_BIT(i))
            return lull_kit_fail(err, LULL_E_PLANE, "begin_frame: the plane %s is missing", lull_kit_plane_name(i));
    if (!frame->blocks || frame->block_count == 0 || frame->block_stride < sizeof(struct lull_rect))
        return lull_kit_fail(err, LULL_E_INVALID, "begin_frame: the frame has no blocks");
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        if (r->x0 < 0 || r->y0 < 0 || r->x0 >= r->x1 || r->y0 >= r->y1 || (uint32_t)r->x1 > frame->width ||
            (uint32_t)r->y1 > frame->height)
            return lull_kit_fail(err, LULL_E_INVALID, "begin_frame: block %u is empty or outside the picture", i);
    }
    return LULL_OK;
}

/* Copies a checked frame's numbers: the frame is open. */
static inline void lull_kit_frame_open(struct lull_instance *in, const struct lull_frame *frame)
{
    struct lull_kit *kit = lull_kit_of(in);
    kit->block_count = frame->block_count;
    kit->transfer = frame->transfer;
    kit->gamma = frame->gamma;
    kit->spp_max = frame->spp_max;
    kit->picture_pixels = (double)frame->width * frame->height;
    kit->exposure = isfinite(frame->exposure) && frame->exposure > 0 ? frame->exposure : 1;
    for (int c = 0; c < 3; c++) {
        double y = frame->rgb_to_xyz[3 + c];
        kit->luminance[c] = isfinite(y) ? y : 1.0 / 3;
    }
}

static inline int32_t lull_kit_begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    int32_t status = lull_kit_frame_check(in, frame, err);
    if (status == LULL_OK)
        lull_kit_frame_open(in, frame);
    return status;
}

static inline void lull_kit_end_frame(struct lull_instance *in)
{
    if (in)
        lull_kit_of(in)->block_count = 0;
}

/* Workers that judge may be called with: scratch memory for so many. */
static inline uint32_t lull_kit_workers(const struct lull_kit *kit)
{
    return kit->host && kit->host->parallel_for && kit->host->max_workers > 1 ? kit->host->max_workers : 1;
}

/* --- pixels -------------------------------------------------------------------------------------------------------- */

/* NULL if the view does not have it. */
static inline const struct lull_plane *lull_kit_plane(const struct lull_view *view, unsigned plane)
{
    if (plane >= view->plane_count)
        return NULL;
    const struct lull_plane *p = (const struct lull_plane *)lull_kit_at(view->planes, view->plane_stride, plane);
    return p->data ? p : NULL;
}

static inline uint32_t lull_kit_channels(unsigned plane)
{
    return plane == LULL_PLANE_COLOR || (plane >= LULL_PLANE_HALF && plane <= LULL_PLANE_NORMAL) ? 3 : 1;
}

static inline double lull_kit_half_float(uint16_t h)
{
    int exponent = (h >> 10) & 31, mantissa = h & 1023;
    double value = exponent == 31  ? (mantissa ? (double)NAN : (double)INFINITY)
                   : exponent == 0 ? ldexp(mantissa, -24)
                                   : ldexp(mantissa + 1024, exponent - 25);
    return h & 0x8000 ? -value : value;
}

/* The stored number at this address. */
static inline double lull_kit_stored(const char *at, int32_t type)
{
    float f32;
    uint16_t f16;
    double f64;
    uint32_t u32;
    switch (type) {
    case LULL_TYPE_F32: memcpy(&f32, at, sizeof f32); return (double)f32;
    case LULL_TYPE_F16: memcpy(&f16, at, sizeof f16); return lull_kit_half_float(f16);
    case LULL_TYPE_F64: memcpy(&f64, at, sizeof f64); return f64;
    default: memcpy(&u32, at, sizeof u32); return u32;
    }
}

static inline const char *lull_kit_address(const struct lull_view *view, const struct lull_plane *plane, int32_t x,
                                           int32_t y)
{
    return (const char *)plane->data + ((int64_t)x - view->x0) * plane->stride_x + ((int64_t)y - view->y0) * plane->stride_y;
}

/* Estimates of `count` pixels of row y from x on, all inside the view and, for their N, of this block: out[pixel][channel].
 * Where there is no estimate (N = 0) comes NaN; where the host stored NaN or an infinity, that. */
static inline void lull_kit_read(const struct lull_view *view, const struct lull_plane *plane,
                                 const struct lull_block *block, int32_t x, int32_t y, int32_t count, uint32_t channels,
                                 double (*out)[3])
{
    const struct lull_plane *weight = plane->normaliser == LULL_NORM_WEIGHT ? lull_kit_plane(view, LULL_PLANE_WEIGHT) : NULL;
    double n = plane->normaliser == LULL_NORM_SPP        ? (double)block->spp
               : plane->normaliser == LULL_NORM_HALF_SPP ? (double)block->half_spp
                                                         : 1;
    const char *at = lull_kit_address(view, plane, x, y);
    for (int32_t i = 0; i < count; i++, at += plane->stride_x) {
        if (weight)
            n = lull_kit_stored(lull_kit_address(view, weight, x + i, y), weight->type) * weight->scale;
        double factor = n != 0 ? plane->scale / n : (double)NAN;
        for (uint32_t c = 0; c < channels; c++)
            out[i][c] = lull_kit_stored(at + (int64_t)c * plane->stride_c, plane->type) * factor;
    }
}

enum { LULL_KIT_SPAN_MAX = 128 };

/* Walks a block's pixels, a piece of a row at a time:
 *     struct lull_kit_span s;
 *     for (lull_kit_span_begin(&s, view, block, planes); lull_kit_span_next(&s);)
 *         for (int32_t i = 0; i < s.count; i++)
 *             … s.value[LULL_PLANE_COLOR][i] … at (s.x + i, s.y)
 */
struct lull_kit_span {
    const struct lull_view *view;
    const struct lull_block *block;
    uint32_t planes; /* those asked for that the view has */
    int32_t x, y, count;
    double value[LULL_PLANE_COUNT][LULL_KIT_SPAN_MAX][3]; /* [plane][pixel][channel], see lull_kit_read */
};

static inline void lull_kit_span_begin(struct lull_kit_span *s, const struct lull_view *view, const struct lull_block *block,
                                       uint32_t planes)
{
    s->view = view;
    s->block = block;
    s->planes = 0;
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++)
        if ((planes & LULL_PLANE_BIT(i)) && lull_kit_plane(view, i))
            s->planes |= LULL_PLANE_BIT(i);
    s->x = block->x0;
    s->y = block->y0;
    s->count = 0;
}

/* 0 at the block's end. */
static inline int lull_kit_span_next(struct lull_kit_span *s)
{
    s->x += s->count;
    if (s->x >= s->block->x1) {
        s->x = s->block->x0;
        s->y++;
    }
    if (s->y >= s->block->y1)
        return 0;
    s->count = s->block->x1 - s->x < LULL_KIT_SPAN_MAX ? s->block->x1 - s->x : LULL_KIT_SPAN_MAX;
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++)
        if (s->planes & LULL_PLANE_BIT(i))
            lull_kit_read(s->view, lull_kit_plane(s->view, i), s->block, s->x, s->y, s->count, lull_kit_channels(i),
                          s->value[i]);
    return 1;
}

/* Scene luminance; times kit->exposure what is displayed, before the transfer curve. */
static inline double lull_kit_luminance(const struct lull_kit *kit, const double rgb[3])
{
    return kit->luminance[0] * rgb[0] + kit->luminance[1] * rgb[1] + kit->luminance[2] * rgb[2];
}

static inline double lull_kit_pixels(const struct lull_block *block)
{
    return ((double)block->x1 - block->x0) * ((double)block->y1 - block->y0);
}

/* --- evaluate ------------------------------------------------------------------------------------------------------ */

static inline int lull_kit_form_known(const struct lull_plane *p, unsigned plane)
{
    return p->type >= LULL_TYPE_F32 && p->type <= LULL_TYPE_U32 && p->normaliser >= LULL_NORM_ONE &&
           p->normaliser <= LULL_NORM_WEIGHT && p->channels >= lull_kit_channels(plane) && isfinite(p->scale) &&
           p->scale != 0;
}

static inline int32_t lull_kit_plane_check(const struct lull_kit *kit, const struct lull_view *view, unsigned plane,
                                           struct lull_error *err)
{
    const struct lull_plane *p = lull_kit_plane(view, plane), *weight = lull_kit_plane(view, LULL_PLANE_WEIGHT);
    const char *name = lull_kit_plane_name(plane);
    if (!p)
        return kit->need.planes_required & LULL_PLANE_BIT(plane)
                   ? lull_kit_fail(err, LULL_E_PLANE, "evaluate: the plane %s is missing", name)
                   : LULL_OK;
    if (!lull_kit_form_known(p, plane))
        return lull_kit_fail(err, LULL_E_PLANE, "evaluate: the plane %s has an unknown form", name);
    if (p->normaliser == LULL_NORM_WEIGHT && plane != LULL_PLANE_WEIGHT &&
        (!weight || !lull_kit_form_known(weight, LULL_PLANE_WEIGHT)))
        return lull_kit_fail(err, LULL_E_PLANE, "evaluate: the plane %s needs WEIGHT, which is missing or unknown", name);
    return LULL_OK;
}

static inline int32_t lull_kit_view_check(const struct lull_kit *kit, const struct lull_view *view, struct lull_error *err)
{
    if (kit->need.planes_used != 0 && view->plane_count > 0 &&
        (!view->planes || view->plane_stride < sizeof(struct lull_plane)))
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: the view has no planes");
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++) {
        int32_t status = kit->need.planes_used & LULL_PLANE_BIT(i) ? lull_kit_plane_check(kit, view, i, err) : LULL_OK;
        if (status != LULL_OK)
            return status;
    }
    return LULL_OK;
}

/* One evaluate call. */
struct lull_kit_batch {
    struct lull_instance *in;
    const struct lull_view *view;
    const struct lull_block *blocks;
    struct lull_decision *decisions;
    uint32_t block_stride, decision_stride, count;
};

static inline int32_t lull_kit_batch_check(const struct lull_kit_batch *b, struct lull_error *err)
{
    const struct lull_kit *kit = lull_kit_read_of(b->in);
    const struct lull_view *view = b->view;
    if (!kit || !view || (b->count > 0 && (!b->blocks || !b->decisions)))
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: an argument is missing");
    if (!LULL_HAS(struct lull_view, view, elapsed_s) ||
        (b->count > 0 && (b->block_stride < sizeof *b->blocks || b->decision_stride < sizeof *b->decisions)))
        return lull_kit_fail(err, LULL_E_VERSION, "evaluate: the host's structs are older than version 1.0");
    if (kit->block_count == 0)
        return lull_kit_fail(err, LULL_E_STATE, "evaluate: no frame is open");
    int32_t status = lull_kit_view_check(kit, view, err);
    for (uint32_t i = 0; i < b->count && status == LULL_OK; i++) {
        const struct lull_block *block = (const struct lull_block *)lull_kit_at(b->blocks, b->block_stride, i);
        if (block->id >= kit->block_count || block->x0 >= block->x1 || block->y0 >= block->y1 || block->x0 < view->x0 ||
            block->y0 < view->y0 || block->x1 > view->x1 || block->y1 > view->y1)
            return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u is not in the frame or not in the view",
                                 block->id);
        if (kit->rule->check)
            status = kit->rule->check(b->in, block, err);
    }
    return status;
}

static inline void lull_kit_task(void *arg, uint64_t task, uint32_t worker)
{
    const struct lull_kit_batch *b = (const struct lull_kit_batch *)arg;
    struct lull_decision *decision = (struct lull_decision *)(void *)((char *)b->decisions + task * b->decision_stride);
    lull_kit_read_of(b->in)->rule->judge(
        b->in, b->view, (const struct lull_block *)lull_kit_at(b->blocks, b->block_stride, task), decision, worker);
}

/* Checks everything, then judges block by block, on the host's workers if it has any. */
static inline int32_t lull_kit_evaluate(struct lull_instance *in, const struct lull_view *view,
                                        const struct lull_block *blocks, uint32_t block_stride,
                                        struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                                        struct lull_error *err)
{
    struct lull_kit_batch batch = {in, view, blocks, decisions, block_stride, decision_stride, count};
    int32_t status = lull_kit_batch_check(&batch, err);
    if (status != LULL_OK)
        return status;
    const struct lull_host *host = lull_kit_read_of(in)->host;
    if (host && host->parallel_for && count > 0) { /* for one block too: only the host knows which worker is free */
        status = host->parallel_for(host, count, lull_kit_task, &batch);
        return status == LULL_OK ? LULL_OK : lull_kit_fail(err, status, "evaluate: the host left out blocks");
    }
    for (uint32_t i = 0; i < count; i++)
        lull_kit_task(&batch, i, 0);
    return LULL_OK;
}

/* --- answers ------------------------------------------------------------------------------------------------------- */

static inline uint64_t lull_kit_spp(double spp) { return spp >= 1e18 ? UINT64_C(1000000000000000000) : (uint64_t)spp; }

/* CONTINUE, next check at `next` samples: rounded up, later than now; the host minds its limit. More samples than a double
 * or lull_kit_spp can count: when the host likes. */
static inline void lull_kit_continue(const struct lull_kit *kit, const struct lull_block *block, double next,
                                     struct lull_decision *decision)
{
    double first = fmax((double)block->spp + 1, (double)kit->need.first_spp);
    decision->action = LULL_CONTINUE;
    decision->next_spp = lull_kit_spp(ceil(fmax(next, first)));
    if (decision->next_spp <= block->spp)
        decision->next_spp = 0;
}

/* What a mean over a block's pixels is made of. */
struct lull_kit_tally {
    double sum;       /* of an error over the valid pixels */
    double valid;     /* pixels with a judgement */
    double early;     /* pixels with too few samples for one */
    double bad;       /* pixels that are NaN or infinite: left out, or one of them would keep the block alive for ever */
    double unsettled; /* valid pixels that hang on few samples */
};

/* The verdict on an error that falls as 1/sqrt(spp), as that of a mean does: stops at or below `threshold`, unless more than
 * tail_share of the pixels are unsettled (a mean over many pixels hides a few that rare bright paths have just hit). The
 * next check is where the block is expected to stop, but at least a tenth and at most `growth` times more samples than now,
 * so that the checks of a block stay a logarithmic number. */
static inline void lull_kit_verdict(const struct lull_kit *kit, const struct lull_block *block,
                                    const struct lull_kit_tally *tally, double error, double threshold, double tail_share,
                                    double growth, struct lull_decision *decision)
{
    double spp = (double)block->spp, predicted = (double)NAN;
    decision->flags = tally->bad > 0 ? LULL_DECISION_BAD_INPUT : 0;
    if (block->spp < kit->need.first_spp || tally->early > 0) {
        decision->flags |= LULL_DECISION_TOO_EARLY;
    } else if (tally->valid == 0) {
        /* Not one usable pixel: nothing that more samples could mend, so it ends some time, flagged as bad input. */
        if (spp >= 64 * (double)kit->need.first_spp) {
            decision->action = LULL_STOP;
            return;
        }
    } else {
        int settled = tally->unsettled <= tail_share * tally->valid;
        double ratio = threshold > 0 ? error / threshold : (double)INFINITY;
        decision->error = error;
        if (error <= threshold && settled) {
            decision->action = LULL_STOP;
            decision->predicted_spp = spp;
            return;
        }
        predicted = settled && ratio < 1e6 ? spp * ratio * ratio : (double)NAN; /* how long a tail takes cannot be told */
    }
    decision->predicted_spp = predicted;
    lull_kit_continue(kit, block, isnan(predicted) ? spp * growth : fmin(fmax(predicted, spp * 1.1), spp * growth),
                      decision);
}

/* --- a whole criterion --------------------------------------------------------------------------------------------- */

/* A library of one criterion without history: everything but its parameters, its struct lull_kit_rule and its judge. Its
 * instance is a struct lull_kit (lull_kit_of). `params` is the table and `count` its length (NULL, 0 without). */
#define LULL_KIT_CRITERION(rule, params, count, id, name, version, description) \
    static int32_t lull_kit_own_create(const struct lull_host *, const struct lull_pair *, uint32_t, uint32_t, \
                                       struct lull_instance **, struct lull_error *); \
    static const struct lull_criterion lull_kit_own_table = {sizeof(struct lull_criterion), \
                                                             LULL_API_MINOR, \
                                                             id, \
                                                             name, \
                                                             version, \
                                                             description, \
                                                             params, \
                                                             count, \
                                                             sizeof(struct lull_param), \
                                                             LULL_THREADS_FULL, \
                                                             LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT, \
                                                             lull_kit_own_create, \
                                                             lull_kit_requirements, \
                                                             lull_kit_begin_frame, \
                                                             lull_kit_evaluate, \
                                                             lull_kit_end_frame, \
                                                             lull_kit_destroy, \
                                                             lull_kit_get_extension}; \
    static int32_t lull_kit_own_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, \
                                       uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err) \
    { \
        return lull_kit_create(&(rule), &lull_kit_own_table, sizeof(struct lull_kit), host, pairs, pair_count, pair_stride, \
                               NULL, instance, err); \
    } \
    const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) \
    { \
        return index == 0 ? &lull_kit_own_table : NULL; \
    } \
    struct lull_instance

#endif
