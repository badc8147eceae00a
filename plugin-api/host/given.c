/* What a renderer hands in, before anything is done with it: a number or a pointer that makes no sense is named.
 * Beside it how any call of the library fails. */
#include "host/frame.h"

#include <lull/criterion_kit.h>

#include <math.h>
#include <stdarg.h>

/* More threads are a mistake; the operating system's own limit is lower. */
enum { MOST_THREADS = 1 << 20 };

int32_t lull_host_given(struct lull_error *err, ...)
{
    const char *missing = NULL;
    va_list args;
    va_start(args, err);
    for (const char *name; !missing && (name = va_arg(args, const char *));)
        missing = va_arg(args, const void *) ? NULL : name;
    va_end(args);
    return missing ? lull_error_set(err, LULL_E_INVALID, "%s is NULL", missing) : LULL_OK;
}

int32_t lull_host_translate(const struct base_err *why, struct lull_error *err)
{
    int32_t code = why->code == BASE_ENOMEM ? LULL_E_MEMORY : why->code == BASE_EIO ? LULL_E_IO : LULL_E_INVALID;
    return lull_error_set(err, code, "%s", why->text);
}

int32_t lull_host_no_memory(struct lull_error *err, const char *what)
{
    return lull_error_set(err, LULL_E_MEMORY, "out of memory (%s)", what);
}

int32_t lull_host_check_pairs(const struct lull_pair *pairs, uint32_t count, struct lull_error *err)
{
    if (count > 0 && !pairs)
        return lull_error_set(err, LULL_E_INVALID, "pairs is NULL, pair_count is %u", count);
    for (uint32_t i = 0; i < count; i++) {
        if (!pairs[i].key)
            return lull_error_set(err, LULL_E_KEY, "pairs[%u]: key is NULL", i);
        if (!pairs[i].value)
            return lull_error_set(err, LULL_E_VALUE, "pairs[%u]: the value of '%.80s' is NULL", i, pairs[i].key);
    }
    return LULL_OK;
}

int32_t lull_host_check_services(const struct lull_host_services *s, struct lull_error *err)
{
    if (s && s->struct_size < sizeof *s)
        return lull_error_set(err, LULL_E_VERSION, "the services are smaller than in version 1.0");
    if (s && s->threads > MOST_THREADS)
        return lull_error_set(err, LULL_E_INVALID, "%u threads are too many: expected at most %d", s->threads, MOST_THREADS);
    return LULL_OK;
}

static int32_t check_numbers(const struct lull_host_config *g, struct lull_error *err)
{
    const struct {
        const char *name;
        double value, least, most; /* beside 0 */
    } numbers[] = {{"gamma", g->gamma, 0.0, HUGE_VAL},
                   {"exposure", g->exposure, 0.0, HUGE_VAL},
                   {"sample_clamp", g->sample_clamp, 0.0, HUGE_VAL},
                   {"time_budget_s", g->time_budget_s, 0.0, HUGE_VAL},
                   {"max_check_overhead", g->max_check_overhead, 0.0, 1.0},
                   {"max_seam", g->max_seam, 1.0, HUGE_VAL}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        const double v = numbers[i].value;
        if (v == 0.0 || (isfinite(v) && v >= numbers[i].least && v <= numbers[i].most))
            continue;
        if (isfinite(numbers[i].most))
            return lull_error_set(err, LULL_E_INVALID, "%s %g: expected a number from 0 to %g", numbers[i].name, v,
                                  numbers[i].most);
        return lull_error_set(err, LULL_E_INVALID, "%s %g: expected 0 or %s", numbers[i].name, v,
                              numbers[i].least > 0.0 ? "at least 1" : "a finite number above");
    }
    return LULL_OK;
}

static int32_t check_colour(const struct lull_host_config *g, struct lull_error *err)
{
    double luminance = 0.0;
    int given = 0;
    if (g->transfer < LULL_TRANSFER_UNKNOWN || g->transfer > LULL_TRANSFER_GAMMA)
        return lull_error_set(err, LULL_E_INVALID, "transfer %d: expected a LULL_TRANSFER_, %d to %d", g->transfer,
                              LULL_TRANSFER_UNKNOWN, LULL_TRANSFER_GAMMA);
    if (g->transfer == LULL_TRANSFER_GAMMA && g->gamma == 0.0)
        return lull_error_set(err, LULL_E_INVALID, "gamma 0: LULL_TRANSFER_GAMMA needs a number above 0");
    for (int i = 0; i < 9; i++) {
        const double v = g->rgb_to_xyz[i];
        if (!isfinite(v))
            return lull_error_set(err, LULL_E_INVALID, "rgb_to_xyz[%d] %g: expected a finite number", i, v);
        given |= v != 0.0;
        luminance += i / 3 == 1 ? v : 0.0;
    }
    if (given && !(luminance > 0.0))
        return lull_error_set(err, LULL_E_INVALID, "rgb_to_xyz: its second row gives white the luminance %g", luminance);
    return LULL_OK;
}

int32_t lull_host_check_config(const struct lull_host_config *g, const struct lull_host_criterion *c, struct lull_error *err)
{
    const uint32_t flags = LULL_HOST_UNIFORM | LULL_HOST_HALF_KNOWN | LULL_HOST_OPEN_ENDED | LULL_FRAME_DETERMINISTIC |
                           LULL_FRAME_INDEPENDENT | LULL_FRAME_SHARED,
                   planes = LULL_PLANE_BIT(LULL_PLANE_COUNT) - 1;
    if (g->struct_size < sizeof *g)
        return lull_error_set(err, LULL_E_VERSION, "the config is smaller than in version 1.0");
    if (!(1 <= g->spp_min && g->spp_min <= g->spp_max && g->spp_max <= LULL_HOST_MOST_SPP))
        return lull_error_set(err, LULL_E_INVALID, "spp_min %llu, spp_max %llu: expected 1 <= spp_min <= spp_max < 2^31",
                              (unsigned long long)g->spp_min, (unsigned long long)g->spp_max);
    int32_t code = check_numbers(g, err);
    if (code == LULL_OK)
        code = check_colour(g, err);
    if (code != LULL_OK)
        return code;
    if (g->flags & ~flags)
        return lull_error_set(err, LULL_E_INVALID, "flags %#x: %#x is unknown", g->flags, g->flags & ~flags);
    if (g->planes & ~planes)
        return lull_error_set(err, LULL_E_INVALID, "planes %#x: %#x is unknown", g->planes, g->planes & ~planes);
    if (!c && !(g->flags & LULL_HOST_UNIFORM))
        return lull_error_set(err, LULL_E_INVALID,
                              "without a criterion every block gets the same samples: UNIFORM is missing");
    if (g->mask && (!c || (g->flags & LULL_HOST_UNIFORM)))
        return lull_error_set(err, LULL_E_INVALID, "a mask has no effect where every block gets the same samples");
    return LULL_OK;
}

int32_t lull_host_check_plane(const char *name, const struct lull_plane *p, uint32_t channels, struct lull_error *err)
{
    static const int64_t sizes[] = {4, 2, 8, 4}; /* bytes of a LULL_TYPE_ */
    if (p->type < LULL_TYPE_F32 || p->type > LULL_TYPE_U32)
        return lull_error_set(err, LULL_E_PLANE, "%s: type %d: expected a LULL_TYPE_, %d to %d", name, p->type,
                              LULL_TYPE_F32, LULL_TYPE_U32);
    if (p->normaliser < LULL_NORM_ONE || p->normaliser > LULL_NORM_WEIGHT)
        return lull_error_set(err, LULL_E_PLANE, "%s: normaliser %d: expected a LULL_NORM_, %d to %d", name, p->normaliser,
                              LULL_NORM_ONE, LULL_NORM_WEIGHT);
    if (p->channels < channels)
        return lull_error_set(err, LULL_E_PLANE, "%s: channels %u: expected at least %u", name, p->channels, channels);
    if (!isfinite(p->scale) || p->scale == 0.0)
        return lull_error_set(err, LULL_E_PLANE, "%s: scale %g: expected a finite number that is not 0", name, p->scale);
    const int64_t size = sizes[p->type], stride[4] = {p->stride_x, p->stride_y, p->channels > 1 ? p->stride_c : 0,
                                                      (int64_t)((uintptr_t)p->data % (uintptr_t)size)};
    static const char *const what[4] = {"stride_x", "stride_y", "stride_c", "data"};
    for (int i = 0; i < 4; i++)
        if (stride[i] % size != 0)
            return lull_error_set(err, LULL_E_PLANE, "%s: %s is not aligned to elements of %d bytes", name, what[i],
                                  (int)size);
    return LULL_OK;
}

/* Dropped samples of each pixel; NULL: none. */
static int32_t check_dropped(const char *name, const struct lull_plane *p, struct lull_error *err)
{
    if (!p)
        return LULL_OK;
    if (!p->data || p->type != LULL_TYPE_U32 || p->normaliser != LULL_NORM_ONE)
        return lull_error_set(err, LULL_E_PLANE, "%s: expected a plane of u32, LULL_NORM_ONE", name);
    return lull_host_check_plane(name, p, 1, err);
}

int32_t lull_host_check_view(const struct lull_host_blocks *b, const struct lull_host_view *v, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "view", v, NULL);
    if (code != LULL_OK)
        return code;
    if (v->struct_size < sizeof *v)
        return lull_error_set(err, LULL_E_VERSION, "the view is smaller than in version 1.0");
    if (v->x0 > b->x0 || v->y0 > b->y0 || v->x1 < b->x1 || v->y1 < b->y1)
        return lull_error_set(err, LULL_E_INVALID, "the view %d,%d,%d,%d does not hold the blocks, %d,%d,%d,%d", v->x0,
                              v->y0, v->x1, v->y1, b->x0, b->y0, b->x1, b->y1);
    if ((int64_t)v->x1 - v->x0 > INT32_MAX || (int64_t)v->y1 - v->y0 > INT32_MAX)
        return lull_error_set(err, LULL_E_INVALID, "the view %d,%d,%d,%d is too large", v->x0, v->y0, v->x1, v->y1);
    if (v->plane_count > 0 && !v->planes)
        return lull_error_set(err, LULL_E_INVALID, "the view: planes is NULL, plane_count is %u", v->plane_count);
    for (uint32_t i = 0; i < v->plane_count && i < LULL_PLANE_COUNT && code == LULL_OK; i++)
        if (v->planes[i].data)
            code = lull_host_check_plane(lull_kit_plane_name(i), &v->planes[i], lull_kit_channels(i), err);
    if (code == LULL_OK)
        code = check_dropped("dropped", v->dropped, err);
    if (code == LULL_OK)
        code = check_dropped("dropped_half", v->dropped_half, err);
    if (code != LULL_OK)
        return code;
    if (v->dropped && v->plane_count > LULL_PLANE_WEIGHT && v->planes[LULL_PLANE_WEIGHT].data)
        return lull_error_set(err, LULL_E_INVALID, "a view with a plane WEIGHT counts no dropped samples");
    return LULL_OK;
}

static int32_t check_block(const struct lull_host_block *b, uint32_t index, struct lull_error *err)
{
    const uint64_t pixels = (uint64_t)(b->x1 - b->x0) * (uint64_t)(b->y1 - b->y0);
    const unsigned long long spp = b->spp, half_spp = b->half_spp, asked_spp = b->asked_spp, dropped = b->dropped;
    if (b->spp > LULL_HOST_MOST_SPP)
        return lull_error_set(err, LULL_E_INVALID, "block %u: spp %llu: expected less than 2^31", index, spp);
    if (b->half_spp > b->spp)
        return lull_error_set(err, LULL_E_INVALID, "block %u: half_spp %llu, but spp is %llu", index, half_spp, spp);
    if (b->asked && b->spp < b->asked_spp)
        return lull_error_set(err, LULL_E_INVALID, "block %u: spp fell from %llu to %llu", index, asked_spp, spp);
    if (b->dropped > b->spp * pixels)
        return lull_error_set(err, LULL_E_INVALID, "block %u: dropped %llu, but it has %llu samples", index, dropped,
                              (unsigned long long)(b->spp * pixels));
    if (b->thread_s < 0.0 || isinf(b->thread_s))
        return lull_error_set(err, LULL_E_INVALID, "block %u: thread_s %g: expected a finite number from 0", index,
                              b->thread_s);
    return LULL_OK;
}

int32_t lull_host_check_samples(const struct lull_host_frame *f, struct lull_error *err)
{
    int32_t code = LULL_OK;
    for (uint32_t i = 0; i < f->blocks.count && code == LULL_OK; i++)
        code = check_block(&f->blocks.list[i], i, err);
    if (code == LULL_OK && !(isfinite(f->totals.render_s) && f->totals.render_s >= 0.0))
        code = lull_error_set(err, LULL_E_INVALID, "render_s %g of the totals: expected a finite number from 0",
                              f->totals.render_s);
    return code;
}
