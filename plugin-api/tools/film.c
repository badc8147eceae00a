/* SPDX-License-Identifier: MIT
 *
 * Made-up renders: a gradient with noise, and its storage in every form the ABI allows.
 */
#define _DEFAULT_SOURCE 1 /* MAP_ANONYMOUS */
#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/colour.h"
#include "base/bytes.h"

const uint32_t lc_plane_channels[LULL_PLANE_COUNT] = {3, 1, 1, 1, 3, 3, 3, 1};
const char *const lc_plane_names[LULL_PLANE_COUNT] = {"COLOR", "WEIGHT", "SPP",    "MOMENT2",
                                                      "HALF",  "ALBEDO", "NORMAL", "DEPTH"};

void lc_film_init(struct lc_film *f, struct lc *c, const struct lc_manner *manner)
{
    const struct lc_manner plain = {0}, *m = manner ? manner : &plain;
    const struct lull_requirements *req = &c->req;
    const int own_size = m->nominal || !(req->flags & LULL_REQ_FLEXIBLE), sized = m->size.width > 0;
    const int32_t nominal_w = req->block_width > 0 && own_size ? (int32_t)req->block_width : 24;
    const int32_t nominal_h = req->block_height > 0 && own_size ? (int32_t)req->block_height : 16;
    const int32_t block_w = sized ? m->size.block_width : nominal_w, block_h = sized ? m->size.block_height : nominal_h;
    const int32_t width = sized ? m->size.width : 2 * block_w + 1, height = sized ? m->size.height : block_h + 1;
    const int32_t columns = (width + block_w - 1) / block_w, rows = (height + block_h - 1) / block_h;
    *f = (struct lc_film){
        .width = width, .height = height, .seed = 1 + m->seed, .block_count = (uint32_t)(columns * rows), .paint = m->paint};
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        f->sum[p] = lc_need(c, calloc((size_t)width * (size_t)height * lc_plane_channels[p], sizeof(double)));
    for (int32_t i = 0; i < columns * rows; i++) {
        int32_t x0 = i % columns * block_w, y0 = i / columns * block_h;
        int32_t x1 = x0 + block_w < width ? x0 + block_w : width, y1 = y0 + block_h < height ? y0 + block_h : height;
        f->rects[i] = (struct lull_rect){x0, y0, x1, y1};
        f->blocks[i] =
            (struct lull_block){.id = (uint32_t)i, .x0 = x0, .y0 = y0, .x1 = x1, .y1 = y1, .thread_s = (double)NAN};
    }
}

void lc_film_release(struct lc_film *f)
{
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        free(f->sum[p]);
    *f = (struct lc_film){0};
}

/* A hash of several numbers (the finaliser of MurmurHash3). */
static uint32_t hash(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t h = a * 0x9e3779b1u + b * 0x85ebca77u + c * 0xc2b2ae3du + d * 0x27d4eb2fu;
    h = (h ^ (h >> 16)) * 0x85ebca6bu;
    h = (h ^ (h >> 13)) * 0xc2b2ae35u;
    return h ^ (h >> 16);
}

/* About normal with variance 1: the sum of twelve uniform numbers, less 6; from three hashes of four bytes each. */
static double normal(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    double sum = 0;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t h = hash(a + i, b, c, d);
        for (int k = 0; k < 32; k += 8)
            sum += ((double)((h >> k) & 255) + 0.5) / 256;
    }
    return sum - 6;
}

/* The truth at a pixel; returns the relative noise of a sample. */
static double paint(const struct lc_paint *p, int32_t x, int32_t y, double rgb[3])
{
    rgb[0] = p ? x % 24 < 12 ? p->even : p->odd : 0.2 + 0.3 * (x % 32) / 32.0;
    rgb[1] = p ? rgb[0] : 0.4 + 0.2 * (y % 32) / 32.0;
    rgb[2] = p ? rgb[0] : 0.3;
    return p ? p->sigma : 0.4;
}

static void add_samples(struct lc_film *f, int32_t x, int32_t y, uint64_t from, uint64_t count, int half)
{
    size_t at = (size_t)y * (size_t)f->width + (size_t)x;
    double rgb[3], mean_y, n = (double)count;
    const double sigma = paint(f->paint, x, y, rgb);
    for (uint32_t c = 0; c < 3; c++) {
        double noise = sigma == 0 ? 0 : normal(f->seed * 7919u + c * 3u, (uint32_t)at, (uint32_t)from, (uint32_t)half);
        double sum = rgb[c] * (n + sigma * sqrt(n) * noise);
        f->sum[LULL_PLANE_COLOR][at * 3 + c] += sum;
        if (half)
            f->sum[LULL_PLANE_HALF][at * 3 + c] += sum;
        f->sum[LULL_PLANE_ALBEDO][at * 3 + c] += 0.5 * n;
        f->sum[LULL_PLANE_NORMAL][at * 3 + c] += (c == 2 ? -1 : 0) * n;
    }
    mean_y = base_luminance(rgb[0], rgb[1], rgb[2]);
    f->sum[LULL_PLANE_MOMENT2][at] += mean_y * mean_y * (1 + sigma * sigma) * n;
    f->sum[LULL_PLANE_DEPTH][at] += 2.5 * n;
}

void lc_film_advance(struct lc_film *f, uint32_t id, uint64_t spp)
{
    struct lull_block *b = &f->blocks[id];
    if (spp <= b->spp)
        return;
    uint64_t half_spp = spp / 2, half = half_spp - b->half_spp, other = spp - b->spp - half;
    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1; x++) {
            if (half > 0)
                add_samples(f, x, y, b->spp, half, 1);
            if (other > 0)
                add_samples(f, x, y, b->spp, other, 0);
        }
    b->spp = spp;
    b->half_spp = half_spp;
}

static double estimate_in(const struct lc_film *f, const struct lull_block *b, unsigned plane, size_t at, unsigned channel)
{
    if (plane == LULL_PLANE_SPP)
        return (double)b->spp;
    if (plane == LULL_PLANE_WEIGHT)
        return (double)b->spp * (at % 3 == 0 ? 2 : 1);
    double n = (double)(plane == LULL_PLANE_HALF ? b->half_spp : b->spp);
    double value = n > 0 ? f->sum[plane][at * lc_plane_channels[plane] + channel] / n : 0;
    return fmin(fmax(rint(value * 256) / 256, -7), 7);
}

void lc_film_frame(const struct lc_film *f, struct lull_frame *frame, uint32_t planes)
{
    *frame = (struct lull_frame){
        .struct_size = sizeof *frame,
        .flags = LULL_FRAME_DETERMINISTIC | LULL_FRAME_INDEPENDENT,
        .width = (uint32_t)f->width,
        .height = (uint32_t)f->height,
        .blocks = f->rects,
        .block_count = f->block_count,
        .block_stride = sizeof *f->rects,
        .planes = planes,
        .transfer = LULL_TRANSFER_SRGB,
        .gamma = 2.2,
        .exposure = 1,
        .spp_min = 1,
        .spp_max = 1 << 20,
        .seed = f->seed,
        .rgb_to_xyz = BASE_RGB_TO_XYZ,
    };
}

static size_t page_size(void) { return (size_t)sysconf(_SC_PAGESIZE); }

/* Whole pages for so many bytes. */
static size_t pages_of(size_t size) { return (size + page_size() - 1) / page_size() * page_size(); }

/* Memory that ends right before a page that cannot be touched; zeroed. */
static void *guard_alloc(struct lc *c, size_t size)
{
    const size_t page = page_size(), inner = pages_of(size);
    char *base = mmap(NULL, inner + 2 * page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (base == MAP_FAILED || mprotect(base + page, inner, PROT_READ | PROT_WRITE) != 0)
        lc_need(c, NULL);
    return base + page + inner - size;
}

static void guard_free(void *memory, size_t size)
{
    const size_t page = page_size(), inner = pages_of(size);
    munmap((char *)memory + size - inner - page, inner + 2 * page);
}

void *lc_place(struct lc *c, const void *from, size_t size)
{
    enum { PIECES = 10, PIECE_SIZE = 8192 };
    static char *pieces[PIECES];
    static unsigned next;
    char **piece = &pieces[next++ % PIECES];
    *piece = *piece ? *piece : guard_alloc(c, PIECE_SIZE);
    size_t room = size < 8 ? 8 : (size + 7) / 8 * 8;
    char *at = *piece + PIECE_SIZE - room;
    memset(at, 0xa5, room);
    if (from && size > 0)
        memcpy(at, from, size);
    return at;
}

void *lc_place_struct(struct lc *c, const void *from, size_t size)
{
    uint32_t struct_size = (uint32_t)size;
    void *at = lc_place(c, from, size);
    memcpy(at, &struct_size, sizeof struct_size);
    return at;
}

void *lc_place_array(struct lc *c, const void *from, size_t size, uint32_t count, uint32_t stride)
{
    char *at = lc_place(c, NULL, (size_t)count * stride);
    for (uint32_t i = 0; i < count && stride >= size; i++)
        memcpy(at + (size_t)i * stride, (const char *)from + i * size, size);
    return at;
}

static size_t type_size(int32_t type) { return type == LULL_TYPE_F64 ? 8 : type == LULL_TYPE_F16 ? 2 : 4; }

static void store(char *at, int32_t type, double v)
{
    uint16_t f16;
    uint32_t u32;
    float f32;
    switch (type) {
    case LULL_TYPE_F16:
        f16 = base_f64_to_f16(v);
        memcpy(at, &f16, sizeof f16);
        break;
    case LULL_TYPE_F64: memcpy(at, &v, sizeof v); break;
    case LULL_TYPE_U32:
        u32 = v > 0 && v < 4294967295.0 ? (uint32_t)llrint(v) : 0;
        memcpy(at, &u32, sizeof u32);
        break;
    default: f32 = (float)v; memcpy(at, &f32, sizeof f32);
    }
}

/* Some planes have one sensible form only: counts are numbers of samples, normals have signs that u32 lacks. */
static struct lc_layout layout_of(const struct lc_layout *wanted, unsigned plane)
{
    struct lc_layout l = *wanted;
    if (plane == LULL_PLANE_SPP || plane == LULL_PLANE_WEIGHT) {
        l.normaliser = LULL_NORM_ONE;
        l.scale = 1;
        l.type = l.type == LULL_TYPE_F16 ? LULL_TYPE_F32 : l.type;
    }
    if (plane == LULL_PLANE_NORMAL && l.type == LULL_TYPE_U32)
        l.type = LULL_TYPE_F32;
    if (plane == LULL_PLANE_HALF && l.normaliser == LULL_NORM_SPP)
        l.normaliser = LULL_NORM_HALF_SPP;
    if (l.scale == 0)
        l.scale = 1;
    return l;
}

static void store_block(const struct lc_film *f, const struct lull_block *b, unsigned plane, const struct lc_layout *l,
                        const struct lull_plane *out)
{
    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1; x++) {
            size_t pixel = (size_t)y * (size_t)f->width + (size_t)x;
            double n = l->normaliser == LULL_NORM_SPP        ? (double)b->spp
                       : l->normaliser == LULL_NORM_HALF_SPP ? (double)b->half_spp
                       : l->normaliser == LULL_NORM_WEIGHT   ? estimate_in(f, b, LULL_PLANE_WEIGHT, pixel, 0)
                                                             : 1;
            char *at = (char *)(uintptr_t)out->data + x * out->stride_x + y * out->stride_y;
            for (unsigned c = 0; c < lc_plane_channels[plane] + (l->padded ? 1u : 0u); c++)
                store(at + c * out->stride_c, l->type,
                      c < lc_plane_channels[plane] ? estimate_in(f, b, plane, pixel, c) * n / l->scale : (double)NAN);
        }
}

static void build_plane(struct lc_image *image, struct lc *c, const struct lc_film *f, unsigned plane,
                        const struct lc_layout *wanted)
{
    struct lc_layout l = layout_of(wanted, plane);
    int64_t size = (int64_t)type_size(l.type), channels = lc_plane_channels[plane] + (l.padded ? 1 : 0);
    int64_t pixels = (int64_t)f->width * f->height;
    size_t bytes = (size_t)(size * channels * pixels);
    char *memory = l.guard ? guard_alloc(c, bytes) : lc_need(c, malloc(bytes));
    image->memory[plane] = memory;
    image->guarded[plane] = l.guard ? bytes : 0;
    struct lull_plane *p = lc_image_plane(image, plane);
    *p = (struct lull_plane){.stride_x = l.planar ? size : size * channels,
                             .stride_c = l.planar ? size * pixels : size,
                             .scale = l.scale,
                             .type = l.type,
                             .normaliser = l.normaliser,
                             .channels = (uint32_t)channels};
    p->stride_y = p->stride_x * f->width;
    if (l.bottom_up) {
        memory += p->stride_y * (f->height - 1);
        p->stride_y = -p->stride_y;
    }
    if (l.right_left) {
        memory += p->stride_x * (f->width - 1);
        p->stride_x = -p->stride_x;
    }
    p->data = memory;
    for (uint32_t i = 0; i < f->block_count; i++)
        store_block(f, &f->blocks[i], plane, &l, p);
}

void lc_image_build(struct lc_image *image, struct lc *c, const struct lc_film *f, const struct lc_layout *layout,
                    uint32_t planes)
{
    uint32_t count = LULL_PLANE_COUNT + layout->extra_planes;
    uint32_t stride = (uint32_t)sizeof(struct lull_plane) + layout->plane_slack;
    if (layout->normaliser == LULL_NORM_WEIGHT)
        planes |= LULL_PLANE_BIT(LULL_PLANE_WEIGHT);
    *image = (struct lc_image){.descriptors = lc_need(c, malloc((size_t)count * stride))};
    memset(image->descriptors, 0xa5, (size_t)count * stride); /* garbage between, and in planes from the future */
    image->view = (struct lull_view){.struct_size = sizeof image->view,
                                     .x1 = f->width,
                                     .y1 = f->height,
                                     .planes = (const struct lull_plane *)(const void *)image->descriptors,
                                     .plane_count = count,
                                     .plane_stride = stride,
                                     .all = f->blocks,
                                     .all_count = f->block_count,
                                     .all_stride = sizeof *f->blocks,
                                     .elapsed_s = (double)NAN};
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++) {
        *lc_image_plane(image, p) = (struct lull_plane){.scale = 1};
        if (planes & LULL_PLANE_BIT(p))
            build_plane(image, c, f, p, layout);
    }
}

void lc_image_release(struct lc_image *image)
{
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        if (image->guarded[p] > 0)
            guard_free(image->memory[p], image->guarded[p]);
        else
            free(image->memory[p]);
    free(image->descriptors);
    *image = (struct lc_image){0};
}

struct lull_plane *lc_image_plane(struct lc_image *image, unsigned plane)
{
    size_t stride = image->view.plane_stride > 0 ? image->view.plane_stride : sizeof(struct lull_plane);
    return (struct lull_plane *)(void *)(image->descriptors + plane * stride);
}

void lc_image_poke_plane(struct lc_image *image, unsigned plane, int32_t x, int32_t y, float value)
{
    const struct lull_plane *p = lc_image_plane(image, plane);
    if (!p->data)
        return;
    char *at = (char *)(uintptr_t)p->data + x * p->stride_x + y * p->stride_y;
    for (uint32_t c = 0; c < lc_plane_channels[plane]; c++)
        memcpy(at + c * p->stride_c, &value, sizeof value);
}

void lc_image_poke(struct lc_image *image, int32_t x, int32_t y, float value)
{
    static const unsigned planes[] = {LULL_PLANE_COLOR,  LULL_PLANE_MOMENT2, LULL_PLANE_HALF,
                                      LULL_PLANE_ALBEDO, LULL_PLANE_NORMAL,  LULL_PLANE_DEPTH};
    for (size_t i = 0; i < sizeof planes / sizeof *planes; i++)
        lc_image_poke_plane(image, planes[i], x, y, value);
}
