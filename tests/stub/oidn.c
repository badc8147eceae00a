/*
 * Stands in for Open Image Denoise where tests need a denoiser whose answers are known: the few functions that
 * plugin-api/denoise calls, with the library's names and types. OIDN_STUB, read when a device is made, says what it does:
 *
 *     identity (also if not set), box (mean of 5x5 pixels), constant (0.5), nan (every third value), version (3.0.1),
 *     no-device, commit (fails when a filter is committed), crash (there), memory (fails when one is executed), endless,
 *     auxiliary (albedo + normal), despeckle (the box where a value is more than four times its mean)
 *
 * endless makes the file OIDN_STUB_BEGUN first, if that is set. Albedo or normal alone become their box: clean auxiliaries.
 *
 * It also refuses what the real library would take in silence and get wrong: pictures that are not finite, no inputScale.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    IDENTITY,
    BOX,
    CONSTANT,
    BAD_NUMBERS,
    VERSION,
    NO_DEVICE,
    COMMIT,
    MEMORY,
    ENDLESS,
    CRASH,
    AUXILIARY,
    DESPECKLE,
    KINDS
};
enum { INVALID_ARGUMENT = 2, INVALID_OPERATION = 3, OUT_OF_MEMORY = 4 };
static const char *const kinds[KINDS] = {"identity", "box",    "constant", "nan",   "version",   "no-device",
                                         "commit",   "memory", "endless",  "crash", "auxiliary", "despeckle"};

struct device {
    int kind, error;
    const char *text;
};
struct image {
    float *data;
    size_t width, height;
};
struct filter {
    struct device *device;
    struct image color, albedo, normal, output;
    bool hdr, clean;
    float scale;
};

#define STUB __attribute__((visibility("default")))
STUB void *oidnNewDevice(int type);
STUB void oidnCommitDevice(void *device);
STUB void oidnReleaseDevice(void *device);
STUB void oidnSetDeviceInt(void *device, const char *name, int value);
STUB void oidnSetDeviceBool(void *device, const char *name, bool value);
STUB int oidnGetDeviceInt(void *device, const char *name);
STUB int oidnGetDeviceError(void *device, const char **text);
STUB void *oidnNewFilter(void *device, const char *type);
STUB void oidnReleaseFilter(void *filter);
STUB void oidnSetSharedFilterImage(void *filter, const char *name, void *data, int format, size_t width, size_t height,
                                   size_t offset, size_t pixel_stride, size_t row_stride);
STUB void oidnSetFilterBool(void *filter, const char *name, bool value);
STUB void oidnSetFilterInt(void *filter, const char *name, int value);
STUB void oidnSetFilterFloat(void *filter, const char *name, float value);
STUB void oidnCommitFilter(void *filter);
STUB void oidnExecuteFilter(void *filter);

static void fail(struct device *d, int error, const char *text)
{
    d->error = d->error ? d->error : error;
    d->text = text;
}

/* --- device --- */

void *oidnNewDevice(int type)
{
    const char *name = getenv("OIDN_STUB");
    struct device *d = type == 1 ? calloc(1, sizeof *d) : NULL;
    for (int k = 0; d && name && k < KINDS; k++)
        if (!strcmp(name, kinds[k]))
            d->kind = k;
    if (!d || d->kind != NO_DEVICE)
        return d;
    free(d);
    return NULL;
}

void oidnCommitDevice(void *device) { (void)device; }

void oidnReleaseDevice(void *device) { free(device); }

void oidnSetDeviceInt(void *device, const char *name, int value)
{
    if (strcmp(name, "numThreads") != 0 || value < 1)
        fail(device, INVALID_ARGUMENT, "a number that no device has");
}

void oidnSetDeviceBool(void *device, const char *name, bool value)
{
    if (strcmp(name, "setAffinity") != 0 || value)
        fail(device, INVALID_ARGUMENT, "the threads are the host's");
}

int oidnGetDeviceInt(void *device, const char *name)
{
    const struct device *d = device;
    const int newer = d->kind == VERSION;
    return !strcmp(name, "versionMajor") ? (newer ? 3 : 2) : !strcmp(name, "versionMinor") ? (newer ? 0 : 5) : 1;
}

int oidnGetDeviceError(void *device, const char **text)
{
    struct device *d = device;
    int error = d ? d->error : INVALID_OPERATION;
    *text = d ? d->text : "the stub was told to have none";
    if (d)
        d->error = 0;
    return error;
}

/* --- filter --- */

void *oidnNewFilter(void *device, const char *type)
{
    struct filter *f = strcmp(type, "RT") ? NULL : calloc(1, sizeof *f);
    if (f)
        *f = (struct filter){.device = device, .scale = NAN};
    return f;
}

void oidnReleaseFilter(void *filter) { free(filter); }

void oidnSetSharedFilterImage(void *filter, const char *name, void *data, int format, size_t width, size_t height,
                              size_t offset, size_t pixel_stride, size_t row_stride)
{
    struct filter *f = filter;
    struct image image = {data, width, height};
    if (format != 3 || offset || pixel_stride != 12 || row_stride != 12 * width)
        fail(f->device, INVALID_ARGUMENT, "an image of another form");
    *(!strcmp(name, "color")    ? &f->color
      : !strcmp(name, "albedo") ? &f->albedo
      : !strcmp(name, "normal") ? &f->normal
                                : &f->output) = image;
}

void oidnSetFilterBool(void *filter, const char *name, bool value)
{
    if (!strcmp(name, "hdr"))
        ((struct filter *)filter)->hdr = value;
    if (!strcmp(name, "cleanAux"))
        ((struct filter *)filter)->clean = value;
}

void oidnSetFilterInt(void *filter, const char *name, int value)
{
    if (!strcmp(name, "quality") && (value < 4 || value > 6))
        fail(((struct filter *)filter)->device, INVALID_ARGUMENT, "a quality that there is not");
}

void oidnSetFilterFloat(void *filter, const char *name, float value)
{
    if (!strcmp(name, "inputScale"))
        ((struct filter *)filter)->scale = value;
}

static int within(const struct image *i, float lo, float hi)
{
    for (size_t k = 0; i->data && k < 3 * i->width * i->height; k++)
        if (!(i->data[k] >= lo && i->data[k] <= hi) || !isfinite(i->data[k]))
            return 0;
    return 1;
}

/* The picture that a filter is about. */
static const struct image *main_of(const struct filter *f)
{
    return f->color.data ? &f->color : f->albedo.data ? &f->albedo : &f->normal;
}

void oidnCommitFilter(void *filter)
{
    const struct filter *f = filter;
    if (f->device->kind == CRASH)
        abort();
    if (f->device->kind == COMMIT)
        fail(f->device, INVALID_OPERATION, "the stub was told to refuse");
    else if (f->color.data && (!f->hdr || !(f->scale > 0)))
        fail(f->device, INVALID_OPERATION, "hdr and inputScale are missing");
    else if (!main_of(f)->data || !f->output.data || (f->color.data && f->normal.data && !f->albedo.data))
        fail(f->device, INVALID_OPERATION, "an image is missing");
    else if (f->clean && !f->albedo.data)
        fail(f->device, INVALID_OPERATION, "no auxiliary is clean");
}

static float mean_at(const struct image *i, size_t x, size_t y, size_t c)
{
    float sum = 0, count = 0;
    for (size_t v = y < 2 ? 0 : y - 2; v <= y + 2 && v < i->height; v++)
        for (size_t u = x < 2 ? 0 : x - 2; u <= x + 2 && u < i->width; u++, count++)
            sum += i->data[3 * (v * i->width + u) + c];
    return sum / count;
}

static float despeckled_at(const struct image *i, size_t k, size_t x, size_t y, size_t c)
{
    const float mean = mean_at(i, x, y, c);
    return i->data[k] > 4.0f * mean ? mean : i->data[k];
}

static float value_of(const struct image *i, size_t k) { return i->data ? i->data[k] : 0.0f; }

/* In place. */
static void clean(const struct image *i)
{
    const size_t bytes = 3 * i->width * i->height * sizeof(float);
    float *copy = malloc(bytes);
    if (!copy)
        abort();
    memcpy(copy, i->data, bytes);
    const struct image from = {copy, i->width, i->height};
    for (size_t y = 0, k = 0; y < i->height; y++)
        for (size_t x = 0; x < i->width; x++)
            for (size_t c = 0; c < 3; c++, k++)
                i->data[k] = mean_at(&from, x, y, c);
    free(copy);
}

void oidnExecuteFilter(void *filter)
{
    const struct filter *f = filter;
    const struct image *in = &f->color;
    const int kind = f->device->kind;
    if (!in->data) {
        clean(main_of(f));
        return;
    }
    if (!within(in, 0, INFINITY) || !within(&f->albedo, 0, 1) || !within(&f->normal, -1, 1))
        fail(f->device, INVALID_ARGUMENT, "a picture is not finite or out of its range");
    if (kind == MEMORY)
        fail(f->device, OUT_OF_MEMORY, "the stub was told to have none");
    const char *begun = getenv("OIDN_STUB_BEGUN");
    if (kind == ENDLESS && begun)
        fclose(fopen(begun, "w"));
    while (kind == ENDLESS)
        pause();
    for (size_t y = 0, k = 0; y < in->height && !f->device->error; y++)
        for (size_t x = 0; x < in->width; x++)
            for (size_t c = 0; c < 3; c++, k++)
                f->output.data[k] = kind == BOX                         ? mean_at(in, x, y, c)
                                    : kind == CONSTANT                  ? 0.5f
                                    : kind == BAD_NUMBERS && k % 3 == 0 ? NAN
                                    : kind == DESPECKLE                 ? despeckled_at(in, k, x, y, c)
                                    : kind == AUXILIARY                 ? value_of(&f->albedo, k) + value_of(&f->normal, k)
                                                                        : in->data[k];
}
