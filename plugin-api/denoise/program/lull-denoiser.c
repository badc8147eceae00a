/*
 * lull-denoiser: runs Open Image Denoise for another process of ours, as often as it asks; see denoise/oidn.h, shared.h. The
 * library comes by dlopen: a dozen prototypes of ours, no header of theirs. One thread calls it.
 */
#include "base/module.h"
#include "base/threads.h"
#include "denoise/program/shared.h"

#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/process.h"

/* Of the library's C interface, version 2: what is used here. */
enum { DEVICE_CPU = 1, FORMAT_FLOAT3 = 3, ERROR_MEMORY = 4, MAJOR_VERSION = 2 };
typedef void *device_t;
typedef void *filter_t;

struct library {
    void *handle;
    device_t device;
    int32_t threads; /* of the device; 0: all processors */
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
    void (*commit_filter)(filter_t filter);
    void (*execute_filter)(filter_t filter);
};

static const char *const how_to_get_it = "lull-denoiser-setup fetches it, scripts/setup --denoiser puts it into build/oidn, "
                                         "pip install pyoidn into a Python; or install Open Image Denoise 2 and name its "
                                         "library by LULL_OIDN=FILE";

static const char *const file_name = "libOpenImageDenoise.so.2";

/* path: the library or a folder that holds it, itself or in lib/. *err says why there is none: BASE_EINVAL if nothing is
 * there. */
static void *open_at(const char *path, struct base_err *err)
{
    static const char *const forms[] = {"%s/%s", "%s/lib/%s"};
    struct stat s;
    char full[4200];
    if (stat(path, &s) == 0 && !S_ISDIR(s.st_mode)) {
        snprintf(full, sizeof full, "%s%.4096s", strchr(path, '/') ? "" : "./", path);
        return base_module_open(full, RTLD_NOW | RTLD_LOCAL, err);
    }
    for (size_t i = 0; i < 2; i++)
        if (snprintf(full, sizeof full, forms[i], path, file_name) < (int)sizeof full && stat(full, &s) == 0)
            return base_module_open(full, RTLD_NOW | RTLD_LOCAL, err);
    base_fail(err, BASE_EINVAL, "no such file");
    return NULL;
}

/* oidn/ beside this program, or up to five folders above it. */
static void *open_nearby(struct base_err *err)
{
    char folder[4096], path[4200];
    void *library = NULL;
    ssize_t n = readlink("/proc/self/exe", folder, sizeof folder - 1);
    folder[n > 0 ? n : 0] = '\0';
    for (int up = 0; up < 6 && !library && err->code == BASE_EINVAL; up++) {
        char *slash = strrchr(folder, '/');
        if (!slash)
            break;
        *slash = '\0';
        snprintf(path, sizeof path, "%s/oidn", folder);
        library = open_at(path, err);
    }
    return library;
}

/* Where lull-denoiser-setup puts it. */
static void *open_fetched(struct base_err *err)
{
    const char *data = getenv("XDG_DATA_HOME"), *home = getenv("HOME");
    char path[4200];
    if (data && *data == '/')
        snprintf(path, sizeof path, "%.4000s/lull/oidn", data);
    else
        snprintf(path, sizeof path, "%.4000s/.local/share/lull/oidn", home && *home == '/' ? home : "/nonexistent");
    void *library = open_at(path, err);
    return library || err->code != BASE_EINVAL ? library : open_at("/usr/local/lib/lull/oidn", err);
}

/* At the usual places. The first one that has a file decides, whether or not that can be loaded. */
static void *search(struct base_err *err)
{
    void *library = base_module_open(file_name, RTLD_NOW | RTLD_LOCAL, err);
    if (library || err->code == BASE_ENOMEM)
        return library;
    err->code = BASE_EINVAL; /* the system has none */
    library = open_nearby(err);
    return library || err->code != BASE_EINVAL ? library : open_fetched(err);
}

static void *find(const char *path, struct base_err *err)
{
    const char *from = *path ? path : getenv("LULL_OIDN"), *named = from && *from ? from : NULL;
    struct base_err why = {0};
    void *library = named ? open_at(named, &why) : search(&why);
    if (!library && why.code == BASE_ENOMEM)
        base_fail_nomem(err, "Open Image Denoise");
    else if (!library && named)
        base_fail(err, BASE_EINVAL, "%.200s: no Open Image Denoise 2 there (%.200s)", named, why.text);
    else if (!library)
        base_fail(err, BASE_EINVAL, "no Open Image Denoise: %s", why.code == BASE_EINVAL ? how_to_get_it : why.text);
    return library;
}

static int take_symbols(struct library *o, struct base_err *err)
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
                   {"oidnCommitFilter", &o->commit_filter},
                   {"oidnExecuteFilter", &o->execute_filter}};
    for (size_t i = 0; i < sizeof symbols / sizeof symbols[0]; i++) {
        void *symbol = dlsym(o->handle, symbols[i].name);
        if (!symbol)
            return base_fail(err, BASE_EINVAL, "Open Image Denoise: the library has no %s: version 2 is needed",
                             symbols[i].name);
        memcpy(symbols[i].to, &symbol, sizeof symbol); /* POSIX: a function's address fits a void * */
    }
    return 0;
}

/* The library's last error on this thread, and its words; 0: none. */
static int check(const struct library *o, const char *doing, struct base_err *err)
{
    const char *text = NULL;
    int code = o->get_device_error(o->device, &text);
    if (code == 0)
        return 0;
    if (code == ERROR_MEMORY)
        return base_fail_nomem(err, "Open Image Denoise");
    return base_fail(err, BASE_EINVAL, "Open Image Denoise cannot %s: %s (error %d)", doing,
                     text && *text ? text : "it says no more", code);
}

static int make_device(struct library *o, struct shared *s, struct base_err *err)
{
    o->device = o->new_device(DEVICE_CPU); /* a GPU would give other bits */
    if (!o->device) {
        int why = check(o, "make a device", err);
        return why ? why : base_fail(err, BASE_EINVAL, "Open Image Denoise has no CPU device");
    }
    if (s->form.threads > 0)
        o->set_device_int(o->device, "numThreads", s->form.threads);
    o->set_device_bool(o->device, "setAffinity", false); /* the threads are the host's guests */
    o->commit_device(o->device);
    int rc = check(o, "make a device", err);
    if (rc)
        return rc;
    int major = o->get_device_int(o->device, "versionMajor");
    if (major == MAJOR_VERSION)
        return 0;
    return base_fail(err, BASE_EINVAL, "Open Image Denoise is of version %d.%d.%d: version 2 is needed", major,
                     o->get_device_int(o->device, "versionMinor"), o->get_device_int(o->device, "versionPatch"));
}

static void give(const struct library *o, filter_t filter, const char *name, struct shared *s, int which)
{
    const size_t width = (size_t)s->form.width, height = (size_t)s->form.height, pixel = 3 * sizeof(float);
    o->set_image(filter, name, shared_picture(s, which), FORMAT_FLOAT3, width, height, 0, pixel, pixel * width);
}

static int execute(const struct library *o, filter_t filter, struct base_err *err)
{
    o->commit_filter(filter);
    int rc = check(o, "prepare its filter", err);
    if (rc)
        return rc;
    o->execute_filter(filter);
    return check(o, "denoise", err);
}

static int make_filter(const struct library *o, filter_t *filter, struct base_err *err)
{
    *filter = o->new_filter(o->device, "RT");
    int rc = check(o, "make its filter", err);
    return rc || *filter ? rc : base_fail(err, BASE_EINVAL, "Open Image Denoise makes no filter");
}

/* An auxiliary picture by itself, in place. The fast network does: by the best one, at 2.5 times the price, what is made
 * of it is up to 2 % less wrong. */
static int prefilter(const struct library *o, const char *name, struct shared *s, int which, struct base_err *err)
{
    filter_t filter;
    int rc = make_filter(o, &filter, err);
    if (rc)
        return rc;
    give(o, filter, name, s, which);
    give(o, filter, "output", s, which);
    o->set_int(filter, "quality", LULL_OIDN_FAST);
    rc = execute(o, filter, err);
    o->release_filter(filter);
    return rc;
}

static int run_colors(const struct library *o, filter_t filter, struct shared *s, struct base_err *err)
{
    int rc = 0;
    if (s->form.albedo)
        give(o, filter, "albedo", s, SHARED_ALBEDO);
    if (s->form.albedo && s->form.normal)
        give(o, filter, "normal", s, SHARED_NORMAL);
    o->set_bool(filter, "hdr", true);
    o->set_bool(filter, "cleanAux", s->prefiltered != 0);
    o->set_float(filter, "inputScale", s->form.exposure); /* else an exposure of this very crop */
    o->set_int(filter, "quality", s->form.quality);
    for (int i = 0; i < s->colors && !rc; i++) {
        give(o, filter, "color", s, SHARED_COLOR + i);
        give(o, filter, "output", s, SHARED_OUT + i);
        rc = execute(o, filter, err);
    }
    return rc;
}

static int run_all(const struct library *o, struct shared *s, struct base_err *err)
{
    filter_t filter;
    int rc = 0;
    if (s->prefiltered && s->form.albedo)
        rc = prefilter(o, "albedo", s, SHARED_ALBEDO, err);
    if (!rc && s->prefiltered && s->form.albedo && s->form.normal)
        rc = prefilter(o, "normal", s, SHARED_NORMAL, err);
    if (!rc)
        rc = make_filter(o, &filter, err);
    if (rc)
        return rc;
    rc = run_colors(o, filter, s, err);
    o->release_filter(filter);
    return rc;
}

/* Finds the library by path, a file, a folder, or "" for the usual places, unless it is found. Makes a device of as many
 * threads, unless there is one from before. Unless the width is 0, denoises the colors of s, whose pictures are finite, into
 * its outs. After a failure the process is of no more use. */
static int denoise(struct library *o, const char *path, struct shared *s, struct base_err *err)
{
    if (!o->handle) {
        o->handle = find(path, err);
        int rc = o->handle ? take_symbols(o, err) : BASE_EINVAL;
        if (rc)
            return rc;
    }
    if (o->device && o->threads != s->form.threads) {
        o->release_device(o->device);
        o->device = NULL;
    }
    o->threads = s->form.threads;
    int rc = o->device ? 0 : make_device(o, s, err);
    return rc || s->form.width == 0 ? rc : run_all(o, s, err);
}

/* Whoever asks has gone, perhaps in the middle of a run. Not by PR_SET_PDEATHSIG: the thread that started this program may
 * end long before its process. */
static void *end_with_caller(void *unused)
{
    (void)unused;
    struct pollfd caller = {.fd = BASE_PROCESS_CALLER};
    while (!caller.revents)
        poll(&caller, 1, -1);
    _exit(0);
}

/* Its size changes from run to run. MAP_FAILED: there is none. */
static struct shared *map(size_t *bytes)
{
    struct stat size;
    if (fstat(BASE_PROCESS_MEMORY, &size) != 0 || (size_t)size.st_size < sizeof(struct shared))
        return MAP_FAILED;
    *bytes = (size_t)size.st_size;
    return mmap(NULL, *bytes, PROT_READ | PROT_WRITE, MAP_SHARED, BASE_PROCESS_MEMORY, 0);
}

static void serve(struct library *library, const char *path, struct shared *s)
{
    struct base_err err = {0};
    s->code = denoise(library, path, s, &err);
    memcpy(s->text, err.text, sizeof s->text);
    s->text[sizeof s->text - 1] = '\0';
}

static int run_program(int argc, char **argv)
{
    struct library library = {0}; /* to the end: its threads outlive their device for a moment */
    pthread_t watch;
    size_t bytes;
    char byte;
    struct shared *s = argc == 2 ? map(&bytes) : MAP_FAILED;
    if (s == MAP_FAILED || pthread_create(&watch, NULL, end_with_caller, NULL) != 0) {
        fprintf(stderr, "lull-denoiser: programs of Lull run it, with pictures in shared memory\n");
        return 2;
    }
    munmap(s, bytes);
    signal(SIGINT, SIG_IGN); /* whoever runs it is asked to end, and ends it */
    signal(SIGHUP, SIG_IGN);
    signal(SIGTERM, SIG_IGN);
    while (read(BASE_PROCESS_CALLER, &byte, 1) == 1 && (s = map(&bytes)) != MAP_FAILED) {
        serve(&library, argv[1], s);
        munmap(s, bytes);
        if (write(BASE_PROCESS_CALLER, &byte, 1) != 1)
            return 1;
    }
    return 0;
}

int main(int argc, char **argv) { return base_threads_main(argc, argv, run_program); }
