#include "render/lseq.h"

#include <zlib.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/colour.h"


enum { DISPLAY = 1, FINE = 2, HALF_LOG = 3, MEAN_F16 = 4, HALF_F16 = 5 };
enum { FILTER_SHUFFLE = 1, FILTER_AVERAGE = 2, FILTER_SUBTRACT_GREEN = 4 };
enum { HEADER_BYTES = 64, RECORD_BYTES = 32, PLANE_HEADER_BYTES = 16 };

/* --- codes ---------------------------------------------------------------------------------------------------------- */

uint16_t pt_lseq_half_float(double x)
{
    uint16_t sign = signbit(x) ? 0x8000 : 0;
    double a = fmin(fabs(x), 65504.0);
    if (a < 0x1p-24 / 2.0)
        return sign;
    int exponent;
    frexp(a, &exponent); /* a = m 2^exponent, m in [1/2, 1) */
    if (exponent < -13)
        exponent = -13; /* subnormal: steps of 2^-24 */
    /* nearbyint rounds to even; a carry out of the mantissa runs into the exponent as it should */
    uint32_t steps = (uint32_t)nearbyint(ldexp(a, 11 - exponent));
    uint32_t bits = (uint32_t)(exponent + 13) * 1024u + steps;
    return (uint16_t)(sign | bits);
}

uint8_t pt_lseq_fine(double x, uint8_t d)
{
    double lo = d > 0 ? base_srgb_eotf((d - 0.5) / 255.0) : 0.0;
    double q;
    if (d < 255) {
        double hi = base_srgb_eotf((d + 0.5) / 255.0);
        q = floor(8.0 * (x - lo) / (hi - lo));
        return (uint8_t)fmin(fmax(q, 0.0), 7.0);
    }
    q = round(16.0 * log2(x / lo));
    return (uint8_t)fmin(fmax(q, 0.0), 255.0);
}

uint8_t pt_lseq_half_log(double y)
{
    double a = fabs(y);
    if (!(a >= exp2(-19.875)))
        return 0;
    int code = (int)fmin(fmax(round(4.0 * log2(a)) + 80.0, 1.0), 127.0);
    return (uint8_t)(code | (y < 0.0 ? 0x80 : 0));
}

static double luminance(const double *rgb)
{
    return base_luminance(rgb[0], rgb[1], rgb[2]);
}

/* --- bytes ---------------------------------------------------------------------------------------------------------- */

static void u32le(unsigned char *p, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        p[i] = (unsigned char)(v >> (8 * i));
}

static void u64le(unsigned char *p, uint64_t v)
{
    for (int i = 0; i < 8; i++)
        p[i] = (unsigned char)(v >> (8 * i));
}

static uint32_t crc_of(const unsigned char *data, size_t n)
{
    return (uint32_t)crc32_z(crc32_z(0, NULL, 0), data, n);
}

static int put_bytes(struct pt_lseq *f, const unsigned char *data, size_t n, struct base_err *err)
{
    f->crc = (uint32_t)crc32_z(f->crc, data, n);
    f->bytes += n;
    if (fwrite(data, 1, n, f->out.file) != n)
        return base_fail(err, BASE_EIO, "%s: write failed", f->out.path);
    return 0;
}

/* Room for n more bytes of payload. */
static unsigned char *payload_room(struct pt_lseq *f, size_t n, struct base_err *err)
{
    if (f->payload_used + n > f->payload_room) {
        size_t room = 2 * (f->payload_used + n);
        unsigned char *grown = realloc(f->payload, room);
        if (!grown) {
            base_fail_nomem(err, f->out.path);
            return NULL;
        }
        f->payload = grown;
        f->payload_room = room;
    }
    return f->payload + f->payload_used;
}

/* --- planes --------------------------------------------------------------------------------------------------------- */

static void subtract_green(unsigned char *p, size_t pixels)
{
    for (size_t i = 0; i < pixels; i++) {
        p[i] = (unsigned char)(p[i] - p[pixels + i]);
        p[2 * pixels + i] = (unsigned char)(p[2 * pixels + i] - p[pixels + i]);
    }
}

/* Backwards, so that the neighbours still hold their own values. */
static void subtract_average(unsigned char *p, uint32_t width, uint32_t height)
{
    for (uint32_t y = height; y-- > 0;) {
        for (uint32_t x = width; x-- > 0;) {
            unsigned char *q = p + (size_t)y * width + x;
            int left = x > 0 ? q[-1] : 0, up = y > 0 ? *(q - width) : 0;
            *q = (unsigned char)(*q - (left + up) / 2);
        }
    }
}

/* Deflates raw bytes of f->plane into the payload. */
static int put_plane(struct pt_lseq *f, uint32_t plane, uint32_t filter, size_t raw, struct base_err *err)
{
    uLong bound = compressBound((uLong)raw);
    unsigned char *p = payload_room(f, PLANE_HEADER_BYTES + bound, err);
    if (!p)
        return BASE_ENOMEM;
    if (compress2(p + PLANE_HEADER_BYTES, &bound, f->plane, (uLong)raw, 6) != Z_OK)
        return base_fail_nomem(err, f->out.path);
    u32le(p, plane);
    u32le(p + 4, filter);
    u32le(p + 8, (uint32_t)raw);
    u32le(p + 12, (uint32_t)bound);
    f->payload_used += PLANE_HEADER_BYTES + bound;
    return 0;
}

static int put_display(struct pt_lseq *f, const double *mean, struct base_err *err)
{
    size_t pixels = (size_t)f->width * f->height;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            f->plane[c * pixels + i] = base_srgb_code(mean[3 * i + c]);
    subtract_green(f->plane, pixels);
    for (size_t c = 0; c < 3; c++)
        subtract_average(f->plane + c * pixels, f->width, f->height);
    return put_plane(f, DISPLAY, FILTER_AVERAGE | FILTER_SUBTRACT_GREEN, 3 * pixels, err);
}

static int put_fine(struct pt_lseq *f, const double *mean, struct base_err *err)
{
    size_t pixels = (size_t)f->width * f->height;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            f->plane[c * pixels + i] = pt_lseq_fine(mean[3 * i + c], base_srgb_code(mean[3 * i + c]));
    return put_plane(f, FINE, 0, 3 * pixels, err);
}

static int put_half_log(struct pt_lseq *f, const double *difference, struct base_err *err)
{
    size_t pixels = (size_t)f->width * f->height;
    for (size_t i = 0; i < pixels; i++)
        f->plane[i] = pt_lseq_half_log(luminance(difference + 3 * i));
    return put_plane(f, HALF_LOG, 0, pixels, err);
}

static int put_f16(struct pt_lseq *f, uint32_t plane, const double *rgb, struct base_err *err)
{
    size_t pixels = (size_t)f->width * f->height, values = 3 * pixels;
    for (size_t i = 0; i < pixels; i++) {
        for (size_t c = 0; c < 3; c++) {
            uint16_t h = pt_lseq_half_float(rgb[3 * i + c]);
            f->plane[c * pixels + i] = (unsigned char)(h & 0xff);
            f->plane[values + c * pixels + i] = (unsigned char)(h >> 8);
        }
    }
    return put_plane(f, plane, FILTER_SHUFFLE, 2 * values, err);
}

/* --- the file ------------------------------------------------------------------------------------------------------- */

int pt_lseq_begin(struct pt_lseq *f, const char *path, uint32_t width, uint32_t height, int32_t x0, int32_t y0, uint32_t id,
                  uint32_t records, uint64_t seed, struct base_err *err)
{
    unsigned char h[HEADER_BYTES] = {'L', 'U', 'L', 'L', 'S', 'E', 'Q', '1'};
    memset(f, 0, sizeof *f);
    f->width = width;
    f->height = height;
    f->crc = (uint32_t)crc32_z(0, NULL, 0);
    f->plane = malloc((size_t)width * height * 6);
    if (!f->plane)
        return base_fail_nomem(err, path);
    int rc = base_file_begin(&f->out, path, err);
    if (!rc) {
        u32le(h + 8, 1);
        u32le(h + 12, HEADER_BYTES);
        u32le(h + 16, width);
        u32le(h + 20, height);
        u32le(h + 24, (uint32_t)x0);
        u32le(h + 28, (uint32_t)y0);
        u32le(h + 32, id);
        u32le(h + 36, records);
        u64le(h + 40, seed);
        u32le(h + 60, crc_of(h, 60));
        rc = put_bytes(f, h, sizeof h, err);
    }
    if (rc)
        pt_lseq_abort(f);
    return rc;
}

static int put_planes(struct pt_lseq *f, const struct pt_lseq_record *r, struct base_err *err)
{
    int rc = put_display(f, r->mean, err);
    if (r->form == PT_LSEQ_FULL) {
        if (!rc)
            rc = put_f16(f, MEAN_F16, r->mean, err);
        return !rc ? put_f16(f, HALF_F16, r->difference, err) : rc;
    }
    if (!rc)
        rc = put_fine(f, r->mean, err);
    return !rc ? put_half_log(f, r->difference, err) : rc;
}

int pt_lseq_put(struct pt_lseq *f, const struct pt_lseq_record *r, struct base_err *err)
{
    unsigned char h[RECORD_BYTES] = {0};
    f->payload_used = 0;
    for (uint32_t i = 0; i < r->statistic_count; i++) {
        unsigned char *p = payload_room(f, 32, err);
        if (!p)
            return BASE_ENOMEM;
        uint64_t bits;
        memcpy(&bits, &r->statistics[i].value, sizeof bits);
        memcpy(p, r->statistics[i].name, 24);
        u64le(p + 24, bits);
        f->payload_used += 32;
    }
    int rc = put_planes(f, r, err);
    if (rc)
        return rc;
    u32le(h, r->kind);
    u32le(h + 4, r->spp);
    u32le(h + 8, r->half_spp);
    u32le(h + 12, r->statistic_count);
    u32le(h + 16, 3);
    u32le(h + 20, (uint32_t)f->payload_used);
    u32le(h + 24, crc_of(f->payload, f->payload_used));
    u32le(h + 28, crc_of(h, 28));
    rc = put_bytes(f, h, sizeof h, err);
    return !rc ? put_bytes(f, f->payload, f->payload_used, err) : rc;
}

static void release(struct pt_lseq *f)
{
    free(f->payload);
    free(f->plane);
    f->payload = f->plane = NULL;
}

int pt_lseq_commit(struct pt_lseq *f, struct base_err *err)
{
    release(f);
    return base_file_commit(&f->out, err);
}

void pt_lseq_abort(struct pt_lseq *f)
{
    release(f);
    base_file_abort(&f->out);
}
