#define _GNU_SOURCE /* dladdr */
#include "denoise/oidn.h"

#include <dlfcn.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Of the library's C interface, version 2: what is used here. */
enum { DEVICE_CPU = 1, FORMAT_FLOAT3 = 3, ERROR_MEMORY = 4, ERROR_CANCELLED = 6, MAJOR_VERSION = 2 };
typedef void *device_t;
typedef void *filter_t;
typedef bool (*progress_t)(void *data, double share);

struct lull_oidn {
    void *library;
    device_t device;
    char version[32];
    device_t (*new_device)(int type);
    void (*commit_device)(device_t device);
    void (*release_device)(device_t device);
    void (*set_device_int)(device_t device, const char *name, int value);
    void (*set_device_bool)(device_t device, const char *name, bool value);
    int (*get_device_int)(device_t device, const char *name);
    int (*get_device_error)(device_t device, const char **text);
    filter_t (*new_filter)(device_t device, const char *type);
    void (*release_filter)(filter_t filter);
    void (*set_image)(filter_t filter, const char *name, void *data, int format, size_t width, size_t height, size_t offset,
                      size_t pixel_stride, size_t row_stride);
    void (*set_bool)(filter_t filter, const char *name, bool value);
    void (*set_int)(filter_t filter, const char *name, int value);
    void (*set_float)(filter_t filter, const char *name, float value);
    void (*set_progress)(filter_t filter, progress_t progress, void *data);
    void (*commit_filter)(filter_t filter);
    void (*execute_filter)(filter_t filter);
};

static const char *const how_to_get_it =
    "scripts/setup --denoiser puts it into build/oidn; or install Open Image Denoise 2 and name its library by "
    "LULL_OIDN=FILE";

/* --- finding ----------------------------------------------------------------------------------------------------------- */

static const char *const file_name = "libOpenImageDenoise.so.2";

/* path: the library or a folder that holds it, itself or in lib/. */
static void *open_at(const char *path)
{
    static const char *const forms[] = {"%s/%s", "%s/lib/%s"};
    struct stat s;
    char full[4096];
    void *library = NULL;
    if (stat(path, &s) != 0)
        return NULL;
    if (!S_ISDIR(s.st_mode))
        return dlopen(path, RTLD_NOW | RTLD_LOCAL);
    for (size_t i = 0; i < 2 && !library; i++)
        if (snprintf(full, sizeof full, forms[i], path, file_name) < (int)sizeof full && stat(full, &s) == 0)
            library = dlopen(full, RTLD_NOW | RTLD_LOCAL);
    return library;
}

/* The file that this code is in; a program that was found by PATH only knows its own name. 0: no telling. */
static int own_file(char *path, size_t room)
{
    Dl_info here;
    if (dladdr((const void *)&file_name, &here) && here.dli_fname && strchr(here.dli_fname, '/'))
        return snprintf(path, room, "%s", here.dli_fname) < (int)room;
    ssize_t n = readlink("/proc/self/exe", path, room - 1);
    path[n > 0 ? n : 0] = '\0';
    return n > 0;
}

/* oidn/ beside the file that this code is in, or up to three folders above it. */
static void *open_nearby(void)
{
    char folder[4096], path[4200];
    void *library = NULL;
    if (!own_file(folder, sizeof folder))
        return NULL;
    for (int up = 0; up < 4 && !library; up++) {
        char *slash = strrchr(folder, '/');
        if (!slash)
            break;
        *slash = '\0';
        snprintf(path, sizeof path, "%s/oidn", folder);
        library = open_at(path);
    }
    return library;
}

static void *find(const char *path, struct base_err *err)
{
    const char *named = path ? path : getenv("LULL_OIDN");
    if (named && *named) {
        void *library = open_at(named);
        if (!library) {
            const char *why = dlerror();
            base_fail(err, BASE_EINVAL, "%s: no Open Image Denoise 2 there (%s)", named, why ? why : "no such file");
        }
        return library;
    }
    void *library = dlopen(file_name, RTLD_NOW | RTLD_LOCAL);
    library = library ? library : open_nearby();
    if (!library)
        base_fail(err, BASE_EINVAL, "no Open Image Denoise: %s", how_to_get_it);
    return library;
}

/* --- device ------------------------------------------------------------------------------------------------------------ */

static int take_symbols(struct lull_oidn *o, struct base_err *err)
{
    const struct {
        const char *name;
        void *to;
    } symbols[] = {{"oidnNewDevice", &o->new_device},
                   {"oidnCommitDevice", &o->commit_device},
                   {"oidnReleaseDevice", &o->release_device},
                   {"oidnSetDeviceInt", &o->set_device_int},
                   {"oidnSetDeviceBool", &o->set_device_bool},
                   {"oidnGetDeviceInt", &o->get_device_int},
                   {"oidnGetDeviceError", &o->get_device_error},
                   {"oidnNewFilter", &o->new_filter},
                   {"oidnReleaseFilter", &o->release_filter},
                   {"oidnSetSharedFilterImage", &o->set_image},
                   {"oidnSetFilterBool", &o->set_bool},
                   {"oidnSetFilterInt", &o->set_int},
                   {"oidnSetFilterFloat", &o->set_float},
                   {"oidnSetFilterProgressMonitorFunction", &o->set_progress},
                   {"oidnCommitFilter", &o->commit_filter},
                   {"oidnExecuteFilter", &o->execute_filter}};
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        void *symbol = dlsym(o->library, symbols[i].name);
        if (!symbol)
            return base_fail(err, BASE_EINVAL, "Open Image Denoise: the library has no %s: version 2 is needed",
                             symbols[i].name);
        memcpy(symbols[i].to, &symbol, sizeof symbol); /* POSIX: a function's address fits a void * */
    }
    return 0;
}

/* The library's last error on this thread, and its words; 0: none. */
static int check(const struct lull_oidn *o, const char *doing, struct base_err *err)
{
    const char *text = NULL;
    int code = o->get_device_error(o->device, &text);
    if (code == 0)
        return 0;
    if (code == ERROR_MEMORY)
        return base_fail_nomem(err, "Open Image Denoise");
    return code == ERROR_CANCELLED ? base_fail(err, BASE_EINVAL, "cancelled")
                                   : base_fail(err, BASE_EINVAL, "Open Image Denoise cannot %s: %s (error %d)", doing,
                                               text && *text ? text : "it says no more", code);
}

static int make_device(struct lull_oidn *o, int threads, struct base_err *err)
{
    o->device = o->new_device(DEVICE_CPU); /* a GPU would give other bits */
    if (!o->device) {
        int why = check(o, "make a device", err);
        return why ? why : base_fail(err, BASE_EINVAL, "Open Image Denoise has no CPU device");
    }
    if (threads > 0)
        o->set_device_int(o->device, "numThreads", threads);
    o->set_device_bool(o->device, "setAffinity", false); /* the threads are the host's guests */
    o->commit_device(o->device);
    int rc = check(o, "make a device", err);
    if (rc)
        return rc;
    int major = o->get_device_int(o->device, "versionMajor");
    snprintf(o->version, sizeof o->version, "%d.%d.%d", major, o->get_device_int(o->device, "versionMinor"),
             o->get_device_int(o->device, "versionPatch"));
    if (major == MAJOR_VERSION)
        return 0;
    return base_fail(err, BASE_EINVAL, "Open Image Denoise is of version %s: version 2 is needed", o->version);
}

int lull_oidn_open(const char *path, int threads, struct lull_oidn **out, struct base_err *err)
{
    struct lull_oidn *o = calloc(1, sizeof *o);
    if (!o)
        return base_fail_nomem(err, "Open Image Denoise");
    o->library = find(path, err);
    int rc = o->library ? take_symbols(o, err) : BASE_EINVAL;
    if (!rc)
        rc = make_device(o, threads, err);
    if (rc)
        lull_oidn_close(o);
    else
        *out = o;
    return rc;
}

/* The library stays loaded: its threads outlive their device for a moment. */
void lull_oidn_close(struct lull_oidn *o)
{
    if (o && o->device)
        o->release_device(o->device);
    free(o);
}

const char *lull_oidn_version(const struct lull_oidn *o)
{
    return o->version;
}

/* --- filter ------------------------------------------------------------------------------------------------------------ */

struct cancel {
    int (*asked)(void *data);
    void *data;
};

static bool go_on(void *data, double share)
{
    const struct cancel *c = data;
    (void)share;
    return !c->asked(c->data);
}

/* A copy in which everything is finite and inside [lo, hi]; what is no number is 0. */
static void clean(const float *from, size_t n, float lo, float hi, float *to)
{
    for (size_t i = 0; i < n; i++) {
        float v = isfinite(from[i]) ? from[i] : 0.0f;
        to[i] = v < lo ? lo : v > hi ? hi : v;
    }
}

static void give(const struct lull_oidn *o, filter_t filter, const char *name, float *data,
                 const struct lull_oidn_picture *p)
{
    o->set_image(filter, name, data, FORMAT_FLOAT3, (size_t)p->width, (size_t)p->height, 0, 3 * sizeof(float),
                 3 * sizeof(float) * (size_t)p->width);
}

/* copies: [3][n], what the filter reads. */
static void set_up(const struct lull_oidn *o, filter_t filter, const struct lull_oidn_picture *p,
                   enum lull_oidn_quality quality, float *copies, float *out)
{
    const size_t n = 3 * (size_t)p->width * (size_t)p->height;
    clean(p->color, n, 0.0f, FLT_MAX, copies);
    give(o, filter, "color", copies, p);
    if (p->albedo) {
        clean(p->albedo, n, 0.0f, 1.0f, copies + n);
        give(o, filter, "albedo", copies + n, p);
    }
    if (p->albedo && p->normal) {
        clean(p->normal, n, -1.0f, 1.0f, copies + 2 * n);
        give(o, filter, "normal", copies + 2 * n, p);
    }
    give(o, filter, "output", out, p);
    o->set_bool(filter, "hdr", true);
    o->set_float(filter, "inputScale", (float)p->exposure); /* else an exposure of this very crop */
    o->set_int(filter, "quality", (int)quality);
}

static int execute(const struct lull_oidn *o, filter_t filter, struct base_err *err)
{
    o->commit_filter(filter);
    int rc = check(o, "prepare its filter", err);
    if (rc)
        return rc;
    o->execute_filter(filter);
    return check(o, "denoise", err);
}

int lull_oidn_run(struct lull_oidn *o, const struct lull_oidn_picture *p, enum lull_oidn_quality quality,
                  int (*cancelled)(void *data), void *data, float *out, struct base_err *err)
{
    const size_t n = 3 * (size_t)p->width * (size_t)p->height;
    struct cancel cancel = {cancelled, data};
    float *copies = malloc(3 * n * sizeof *copies);
    if (!copies)
        return base_fail_nomem(err, "denoising");
    filter_t filter = o->new_filter(o->device, "RT");
    int rc = check(o, "make its filter", err);
    if (!rc && !filter)
        rc = base_fail(err, BASE_EINVAL, "Open Image Denoise makes no filter");
    if (!rc) {
        set_up(o, filter, p, quality, copies, out);
        if (cancelled)
            o->set_progress(filter, go_on, &cancel);
        rc = execute(o, filter, err);
    }
    if (filter)
        o->release_filter(filter);
    for (size_t i = 0; i < n && !rc; i++)
        if (!isfinite(out[i]))
            out[i] = copies[i];
    free(copies);
    return rc;
}

/* --- crops ------------------------------------------------------------------------------------------------------------- */

struct lull_oidn_box lull_oidn_box_of(struct lull_oidn_box core, int halo, struct lull_oidn_box frame)
{
    struct lull_oidn_box b;
    b.x0 = core.x0 - halo < frame.x0 ? frame.x0 : core.x0 - halo;
    b.y0 = core.y0 - halo < frame.y0 ? frame.y0 : core.y0 - halo;
    b.x0 -= (b.x0 - frame.x0) % LULL_OIDN_GRID;
    b.y0 -= (b.y0 - frame.y0) % LULL_OIDN_GRID;
    b.x1 = frame.x1 - core.x1 < halo ? frame.x1 : core.x1 + halo;
    b.y1 = frame.y1 - core.y1 < halo ? frame.y1 : core.y1 + halo;
    return b;
}
