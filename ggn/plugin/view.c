#include "plugin/view.h"

#include <math.h>
#include <string.h>

#include "plugin/text.h"

static const char *const plane_names[LULL_PLANE_COUNT] = {"COLOR", "WEIGHT", "SPP",    "MOMENT2",
                                                          "HALF",  "ALBEDO", "NORMAL", "DEPTH"};
static const uint32_t plane_channels[LULL_PLANE_COUNT] = {3, 1, 1, 1, 3, 3, 3, 1};

struct ggn_display gp_display_of(const struct lull_frame *frame)
{
    struct ggn_display d = {GGN_TRANSFER_SRGB, frame->gamma, frame->exposure};

    if (!isfinite(d.exposure) || d.exposure <= 0)
        d.exposure = 1;
    if (frame->transfer == LULL_TRANSFER_LINEAR)
        d.transfer = GGN_TRANSFER_LINEAR;
    else if (frame->transfer == LULL_TRANSFER_GAMMA && isfinite(d.gamma) && d.gamma > 0)
        d.transfer = GGN_TRANSFER_GAMMA;
    return d;
}

const struct lull_rect *gp_frame_block(const struct lull_frame *frame, uint32_t id)
{
    const void *at = (const char *)frame->blocks + (size_t)id * frame->block_stride;

    return at;
}

int32_t gp_frame_check(const struct lull_frame *frame, uint32_t planes_required, struct lull_error *err)
{
    if (!LULL_HAS(struct lull_frame, frame, rgb_to_xyz))
        return gp_fail(err, LULL_E_VERSION, "begin_frame: the host's struct is older than version 1.0");
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++)
        if (planes_required & ~frame->planes & LULL_PLANE_BIT(i))
            return gp_fail(err, LULL_E_PLANE, "begin_frame: the plane %s is missing", plane_names[i]);
    if (!frame->blocks || !frame->block_count || frame->block_stride < sizeof(struct lull_rect))
        return gp_fail(err, LULL_E_INVALID, "begin_frame: the frame has no blocks");
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = gp_frame_block(frame, i);
        if (r->x0 < 0 || r->y0 < 0 || r->x0 >= r->x1 || r->y0 >= r->y1 || (uint32_t)r->x1 > frame->width ||
            (uint32_t)r->y1 > frame->height)
            return gp_fail(err, LULL_E_INVALID, "begin_frame: block %u is empty or outside the picture", i);
    }
    return LULL_OK;
}

const struct lull_plane *gp_view_plane(const struct lull_view *view, unsigned index)
{
    if (index >= view->plane_count)
        return NULL;
    const void *at = (const char *)view->planes + (size_t)index * view->plane_stride;
    const struct lull_plane *plane = at;
    return plane->data ? plane : NULL;
}

static int known_form(const struct lull_plane *p, unsigned index)
{
    return p->type >= LULL_TYPE_F32 && p->type <= LULL_TYPE_U32 && p->normaliser >= LULL_NORM_ONE &&
           p->normaliser <= LULL_NORM_WEIGHT && p->channels >= plane_channels[index] && isfinite(p->scale) && p->scale != 0;
}

int32_t gp_view_check(const struct lull_view *view, uint32_t planes_used, uint32_t planes_required, struct lull_error *err)
{
    if (!LULL_HAS(struct lull_view, view, elapsed_s))
        return gp_fail(err, LULL_E_VERSION, "evaluate: the host's view is older than version 1.0");
    if (view->plane_count && (!view->planes || view->plane_stride < sizeof(struct lull_plane)))
        return gp_fail(err, LULL_E_INVALID, "evaluate: the view has no planes");

    const struct lull_plane *weight = gp_view_plane(view, LULL_PLANE_WEIGHT);
    int weight_ok = weight && known_form(weight, LULL_PLANE_WEIGHT);
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++) {
        const struct lull_plane *p = gp_view_plane(view, i);
        if (!p && (planes_required & LULL_PLANE_BIT(i)))
            return gp_fail(err, LULL_E_PLANE, "evaluate: the plane %s is missing", plane_names[i]);
        if (!p || !(planes_used & LULL_PLANE_BIT(i)))
            continue;
        if (!known_form(p, i))
            return gp_fail(err, LULL_E_PLANE, "evaluate: the plane %s has an unknown form", plane_names[i]);
        if (p->normaliser == LULL_NORM_WEIGHT && i != LULL_PLANE_WEIGHT && !weight_ok)
            return gp_fail(err, LULL_E_PLANE, "evaluate: the plane %s needs WEIGHT, which is missing or unknown", plane_names[i]);
    }
    return LULL_OK;
}

static double half_float(uint16_t h)
{
    int exponent = h >> 10 & 31, mantissa = h & 1023;
    double value = exponent == 31 ? (mantissa ? (double)NAN : (double)INFINITY)
                 : exponent       ? ldexp(mantissa + 1024, exponent - 25)
                                  : ldexp(mantissa, -24);
    return h & 0x8000 ? -value : value;
}

static double stored(const char *at, int32_t type)
{
    union {
        float f32;
        uint16_t f16;
        double f64;
        uint32_t u32;
    } v;

    switch (type) {
    case LULL_TYPE_F32:
        memcpy(&v.f32, at, sizeof v.f32);
        return (double)v.f32;
    case LULL_TYPE_F16:
        memcpy(&v.f16, at, sizeof v.f16);
        return half_float(v.f16);
    case LULL_TYPE_F64:
        memcpy(&v.f64, at, sizeof v.f64);
        return v.f64;
    default:
        memcpy(&v.u32, at, sizeof v.u32);
        return v.u32;
    }
}

static const char *address(const struct lull_view *view, const struct lull_plane *plane, int32_t x, int32_t y)
{
    return (const char *)plane->data + ((int64_t)x - view->x0) * plane->stride_x + ((int64_t)y - view->y0) * plane->stride_y;
}

void gp_view_span(const struct lull_view *view, const struct lull_plane *plane, const struct lull_block *block, int32_t x,
                  int32_t y, int32_t count, int channels, double *out)
{
    const struct lull_plane *weight = plane->normaliser == LULL_NORM_WEIGHT ? gp_view_plane(view, LULL_PLANE_WEIGHT) : NULL;
    double n = plane->normaliser == LULL_NORM_SPP      ? (double)block->spp
             : plane->normaliser == LULL_NORM_HALF_SPP ? (double)block->half_spp
                                                       : 1;
    const char *at = address(view, plane, x, y);

    for (int32_t i = 0; i < count; i++, at += plane->stride_x) {
        if (weight)
            n = stored(address(view, weight, x + i, y), weight->type) * weight->scale;
        double factor = n != 0 ? plane->scale / n : (double)NAN;
        for (int c = 0; c < channels; c++)
            out[i * channels + c] = stored(at + c * plane->stride_c, plane->type) * factor;
    }
}
