#define _GNU_SOURCE /* dladdr, memfd_create */
#include "denoise/oidn.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "denoise/program/shared.h"

enum { ASK_EVERY_MS = 20 };

extern char **environ;

struct lull_oidn {
    char program[PATH_MAX + 64], *library; /* owns library, "": the usual places */
    int memory_fd;
    struct shared *shared; /* NULL: nothing is prepared */
    size_t bytes;
    pid_t pid;      /* of the program; 0: it does not run */
    int program_fd; /* the connection to it, or -1 */
};

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

static void end_program(struct lull_oidn *o)
{
    int status;
    if (o->program_fd >= 0)
        close(o->program_fd);
    if (o->pid > 0 && waitpid(o->pid, &status, WNOHANG) == 0) { /* else it has ended, and its number may be another's */
        kill(o->pid, SIGKILL);
        waitpid(o->pid, &status, 0);
    }
    o->program_fd = -1;
    o->pid = 0;
}

/* `caller` is the program's end of the connection. Returns an errno. The memory's descriptor is neither of those that the
 * program finds. */
static int spawn(struct lull_oidn *o, int caller)
{
    char *arguments[] = {o->program, o->library, NULL};
    posix_spawn_file_actions_t actions;
    int why = posix_spawn_file_actions_init(&actions);
    if (why)
        return why;
    why = posix_spawn_file_actions_adddup2(&actions, caller, SHARED_CALLER);
    if (!why)
        why = posix_spawn_file_actions_adddup2(&actions, o->memory_fd, SHARED_MEMORY);
    if (!why)
        why = posix_spawn(&o->pid, o->program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    return why;
}

static int start_program(struct lull_oidn *o, struct base_err *err)
{
    int ends[2];
    int why = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0 ? 0 : errno;
    if (!why) {
        o->program_fd = ends[0];
        why = spawn(o, ends[1]);
        close(ends[1]);
    }
    if (!why)
        return 0;
    o->pid = 0;
    end_program(o);
    return why == ENOMEM ? base_fail_nomem(err, "lull-denoiser")
                         : base_fail(err, BASE_EIO, "cannot run %s: %s", o->program, strerror(why));
}

/* Waits for the program's answer, or until it is no longer wanted. */
static int wait_for(const struct lull_oidn *o, int (*cancelled)(void *data), void *data, struct base_err *err)
{
    struct pollfd answer = {.fd = o->program_fd, .events = POLLIN};
    char byte;
    while (poll(&answer, 1, ASK_EVERY_MS) <= 0)
        if (cancelled && cancelled(data))
            return base_fail(err, BASE_ECANCELLED, "cancelled");
    if (recv(o->program_fd, &byte, 1, 0) == 1)
        return 0;
    return base_fail(err, BASE_EINVAL, "Open Image Denoise ended its process: a crash, or no memory");
}

/* The program does what the shared memory says. One that has ended is started anew, one that fails is ended. */
static int ask_program(struct lull_oidn *o, int (*cancelled)(void *data), void *data, struct base_err *err)
{
    int status;
    struct shared *s = o->shared;
    if (o->pid > 0 && waitpid(o->pid, &status, WNOHANG) != 0)
        end_program(o);
    int rc = o->pid > 0 ? 0 : start_program(o, err);
    if (rc)
        return rc;
    send(o->program_fd, "", 1, MSG_NOSIGNAL); /* that it is gone is seen by waiting */
    rc = wait_for(o, cancelled, data, err);
    s->text[sizeof s->text - 1] = '\0';
    if (!rc && s->code)
        rc = base_fail(err, s->code, "%s", s->text);
    if (rc)
        end_program(o);
    return rc;
}

static void drop_memory(struct lull_oidn *o)
{
    if (o->shared)
        munmap(o->shared, o->bytes);
    o->shared = NULL;
}

/* The program finds its own descriptors below 10. */
static int create_memory(void)
{
    int low = memfd_create("lull-denoiser", MFD_CLOEXEC), fd = low < 0 ? -1 : fcntl(low, F_DUPFD_CLOEXEC, 10);
    if (low >= 0)
        close(low);
    return fd;
}

int lull_oidn_prepare(struct lull_oidn *o, const struct lull_oidn_form *form, struct base_err *err)
{
    const size_t around = 2 * (size_t)form->margin;
    const size_t width = (size_t)form->width + around, height = (size_t)form->height + around;
    const size_t pictures = SHARED_PICTURES * 3 * width * height;
    void *memory = MAP_FAILED;
    drop_memory(o);
    o->bytes = sizeof *o->shared + pictures * sizeof(float);
    if (ftruncate(o->memory_fd, 0) == 0 && posix_fallocate(o->memory_fd, 0, (off_t)o->bytes) == 0)
        memory = mmap(NULL, o->bytes, PROT_READ | PROT_WRITE, MAP_SHARED, o->memory_fd, 0);
    if (memory == MAP_FAILED)
        return base_fail_nomem(err, "the denoiser's pictures");
    o->shared = memory;
    o->shared->form = *form;
    o->shared->form.width = (int32_t)width;
    o->shared->form.height = (int32_t)height;
    return 0;
}

void lull_oidn_resize(struct lull_oidn *o, int32_t width, int32_t height)
{
    o->shared->form.width = width + 2 * o->shared->form.margin;
    o->shared->form.height = height + 2 * o->shared->form.margin;
}

int lull_oidn_open(const char *library, struct lull_oidn **out, struct base_err *err)
{
    struct lull_oidn *o = calloc(1, sizeof *o);
    if (!o)
        return base_fail_nomem(err, "Open Image Denoise");
    o->program_fd = -1;
    o->memory_fd = create_memory();
    o->library = strdup(library ? library : "");
    int rc = o->library && o->memory_fd >= 0 ? find_program(o, err) : base_fail_nomem(err, "Open Image Denoise");
    if (!rc)
        rc = lull_oidn_prepare(o, &(struct lull_oidn_form){.threads = 1}, err);
    if (!rc)
        rc = ask_program(o, NULL, NULL, err);
    if (rc) {
        lull_oidn_close(o);
        return rc;
    }
    drop_memory(o);
    *out = o;
    return 0;
}

void lull_oidn_close(struct lull_oidn *o)
{
    if (!o)
        return;
    end_program(o);
    drop_memory(o);
    if (o->memory_fd >= 0)
        close(o->memory_fd);
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
    struct shared *s = o->shared;
    if (!s)
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
