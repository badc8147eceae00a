#define _GNU_SOURCE /* dladdr */
#include "denoise/oidn.h"

#include <dlfcn.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/process.h"
#include "denoise/program/shared.h"

struct lull_oidn {
    struct base_process child;
    char program[PATH_MAX + 64], *library; /* owns library, "": the usual places */
    int prepared;
};

static struct shared *shared_of(const struct lull_oidn *o) { return o->child.memory; }

/* The file that this code is in, as it was loaded or what that links to; a program that was found by PATH only knows its
 * own name. 0: no telling. */
static int own_file(int resolved, char path[PATH_MAX])
{
    static const char here;
    Dl_info info;
    if (dladdr(&here, &info) && info.dli_fname && strchr(info.dli_fname, '/'))
        return resolved ? realpath(info.dli_fname, path) != NULL : snprintf(path, PATH_MAX, "%s", info.dli_fname) < PATH_MAX;
    ssize_t n = readlink("/proc/self/exe", path, PATH_MAX - 1);
    path[n > 0 ? n : 0] = '\0';
    return n > 0;
}

/* From bin/ or the like, and from lib/lull/. */
static int find_program(struct lull_oidn *o, struct base_err *err)
{
    static const char *const places[] = {"%.*s/../lib/lull/modules/lull-denoiser", "%.*s/modules/lull-denoiser"};
    char own[PATH_MAX];
    for (int resolved = 0; resolved < 2; resolved++) {
        const char *slash = own_file(resolved, own) ? strrchr(own, '/') : NULL;
        for (size_t i = 0; slash && i < 2; i++) {
            snprintf(o->program, sizeof o->program, places[i], (int)(slash - own), own);
            if (access(o->program, X_OK) == 0)
                return 0;
        }
    }
    return base_fail(err, BASE_EINVAL,
                     "no program lull-denoiser in lib/lull/modules: is this tree built, or installed, as a whole?");
}

/* The program does what the shared memory says. One that fails is ended. */
static int ask_program(struct lull_oidn *o, int (*cancelled)(void *data), void *data, struct base_err *err)
{
    char *arguments[] = {o->program, o->library, NULL};
    struct shared *s = shared_of(o);
    int rc = base_process_ask(&o->child, arguments, 0, cancelled, data, err);
    s->text[sizeof s->text - 1] = '\0';
    if (!rc && s->code) {
        rc = base_fail(err, s->code, "%s", s->text);
        base_process_end(&o->child);
    }
    return rc;
}

int lull_oidn_prepare(struct lull_oidn *o, const struct lull_oidn_form *form, struct base_err *err)
{
    const size_t around = 2 * (size_t)form->margin;
    const size_t width = (size_t)form->width + around, height = (size_t)form->height + around;
    const size_t pictures = SHARED_PICTURES * 3 * width * height;
    o->prepared = 0;
    if (base_process_resize(&o->child, sizeof(struct shared) + pictures * sizeof(float), NULL) != 0)
        return base_fail_nomem(err, "the denoiser's pictures");
    o->prepared = 1;
    shared_of(o)->form = *form;
    lull_oidn_resize(o, form->width, form->height);
    return 0;
}

void lull_oidn_resize(struct lull_oidn *o, int32_t width, int32_t height)
{
    struct lull_oidn_form *form = &shared_of(o)->form;
    form->width = width + 2 * form->margin;
    form->height = height + 2 * form->margin;
}

int lull_oidn_open(const char *library, struct lull_oidn **out, struct base_err *err)
{
    struct lull_oidn *o = calloc(1, sizeof *o);
    if (!o)
        return base_fail_nomem(err, "Open Image Denoise");
    int rc = base_process_init(&o->child, "Open Image Denoise", err);
    o->library = strdup(library ? library : "");
    if (!rc)
        rc = o->library ? find_program(o, err) : base_fail_nomem(err, "Open Image Denoise");
    if (!rc)
        rc = lull_oidn_prepare(o, &(struct lull_oidn_form){.threads = 1}, err);
    if (!rc)
        rc = ask_program(o, NULL, NULL, err);
    if (rc) {
        lull_oidn_close(o);
        return rc;
    }
    o->prepared = 0;
    *out = o;
    return 0;
}

void lull_oidn_close(struct lull_oidn *o)
{
    if (!o)
        return;
    base_process_release(&o->child);
    free(o->library);
    free(o);
}

/* A copy with its margin, in which everything is finite and inside [lo, hi]; what is no number is 0. form: of the copy. */
static void clean(const float *from, const struct lull_oidn_form *form, float lo, float hi, float *to)
{
    const int32_t width = form->width - 2 * form->margin, height = form->height - 2 * form->margin;
    for (int32_t y = -form->margin; y < height + form->margin; y++) {
        const float *row = from + 3 * (size_t)width * (size_t)lull_oidn_mirrored(y, height);
        for (int32_t x = -form->margin; x < width + form->margin; x++)
            for (int32_t c = 0; c < 3; c++, to++) {
                const float v = row[3 * lull_oidn_mirrored(x, width) + c], finite = isfinite(v) ? v : 0.0f;
                *to = finite < lo ? lo : finite > hi ? hi : finite;
            }
    }
}

/* The picture inside the margin; where the denoiser found no number, what it was given. */
static void take(struct shared *s, int which, float *to)
{
    const int32_t margin = s->form.margin, width = s->form.width - 2 * margin, height = s->form.height - 2 * margin;
    for (int32_t y = 0; y < height; y++) {
        const size_t at = 3 * ((size_t)(y + margin) * (size_t)s->form.width + (size_t)margin);
        const float *in = shared_picture(s, SHARED_COLOR + which) + at, *out = shared_picture(s, SHARED_OUT + which) + at;
        for (size_t i = 0; i < 3 * (size_t)width; i++)
            *to++ = isfinite(out[i]) ? out[i] : in[i];
    }
}

int lull_oidn_run(struct lull_oidn *o, const struct lull_oidn_pictures *p, int (*cancelled)(void *data), void *data,
                  struct base_err *err)
{
    struct shared *s = shared_of(o);
    if (!o->prepared)
        return base_fail(err, BASE_EINVAL, "Open Image Denoise is not prepared");
    for (s->colors = 0; s->colors < LULL_OIDN_COLORS && p->color[s->colors]; s->colors++)
        clean(p->color[s->colors], &s->form, 0.0f, FLT_MAX, shared_picture(s, SHARED_COLOR + s->colors));
    if (s->form.albedo)
        clean(p->albedo, &s->form, 0.0f, 1.0f, shared_picture(s, SHARED_ALBEDO));
    if (s->form.albedo && s->form.normal)
        clean(p->normal, &s->form, -1.0f, 1.0f, shared_picture(s, SHARED_NORMAL));
    s->prefiltered = p->prefiltered;
    int rc = ask_program(o, cancelled, data, err);
    for (int k = 0; k < s->colors && !rc; k++)
        take(s, k, p->out[k]);
    return rc;
}
