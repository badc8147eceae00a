#define _GNU_SOURCE /* memfd_create, pipe2 */
#include "base/process.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"

enum { ASK_EVERY_MS = 20, ITS_END_MS = 1000 };

extern char **environ;

/* The program finds its own descriptors below 10; and where standard streams are closed, nothing else is to be one. */
static int above_those(int low)
{
    int fd = low < 0 ? -1 : fcntl(low, F_DUPFD_CLOEXEC, 10);
    if (low >= 0)
        close(low);
    return fd;
}

int base_process_init(struct base_process *c, const char *name, struct base_err *err)
{
    *c = (struct base_process){.name = name, .caller_fd = -1, .life_fd = -1};
    c->memory_fd = above_those(memfd_create(name, MFD_CLOEXEC));
    return c->memory_fd >= 0 ? 0 : base_fail_nomem(err, name);
}

int base_process_resize(struct base_process *c, size_t bytes, struct base_err *err)
{
    void *memory = MAP_FAILED;
    if (posix_fallocate(c->memory_fd, 0, (off_t)bytes) == 0)
        memory = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, c->memory_fd, 0);
    if (memory != MAP_FAILED) {
        if (c->memory)
            munmap(c->memory, c->bytes);
        c->memory = memory;
        c->bytes = bytes;
    }
    if (ftruncate(c->memory_fd, (off_t)c->bytes) == 0 && memory != MAP_FAILED)
        return 0;
    return base_fail_nomem(err, c->name);
}

/* Whether it is ours and how it ended; its number stays its own. */
static int has_ended(const struct base_process *c, siginfo_t *how)
{
    how->si_pid = 0;
    return waitid(P_PID, (id_t)c->pid, how, WEXITED | WNOHANG | WNOWAIT) != 0 || how->si_pid != 0;
}

void base_process_end(struct base_process *c)
{
    siginfo_t how;
    if (c->caller_fd >= 0)
        close(c->caller_fd);
    if (c->life_fd >= 0)
        close(c->life_fd);
    if (c->pid > 0 &&
        waitid(P_PID, (id_t)c->pid, &how, WEXITED | WNOHANG | WNOWAIT) == 0) { /* else its number is another's */
        kill(-c->pid, SIGKILL);
        kill(c->pid, SIGKILL);
        while (waitpid(c->pid, NULL, 0) < 0 && errno == EINTR)
            ;
    }
    c->caller_fd = c->life_fd = -1;
    c->pid = 0;
}

int base_process_runs(struct base_process *c)
{
    siginfo_t how;
    if (c->pid > 0 && has_ended(c, &how))
        base_process_end(c);
    return c->pid > 0;
}

/* Returns an errno. */
static int spawn_with(struct base_process *c, char *const *arguments, const int ends[2], posix_spawn_file_actions_t *actions)
{
    posix_spawnattr_t attributes;
    sigset_t none;
    int why = posix_spawnattr_init(&attributes);
    if (why)
        return why;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setpgroup(&attributes, 0);
    why = posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
    if (!why)
        why = posix_spawn_file_actions_adddup2(actions, ends[0], BASE_PROCESS_CALLER);
    if (!why)
        why = posix_spawn_file_actions_adddup2(actions, ends[1], BASE_PROCESS_LIFE);
    if (!why)
        why = posix_spawn_file_actions_adddup2(actions, c->memory_fd, BASE_PROCESS_MEMORY);
    if (!why)
        why = posix_spawnp(&c->pid, arguments[0], actions, &attributes, arguments, environ);
    posix_spawnattr_destroy(&attributes);
    return why;
}

/* ends: the program's. Returns an errno. */
static int connect_both(struct base_process *c, int ends[2])
{
    int sockets[2], pipes[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
        return errno;
    c->caller_fd = above_those(sockets[0]);
    ends[0] = above_those(sockets[1]);
    if (c->caller_fd < 0 || ends[0] < 0 || pipe2(pipes, O_CLOEXEC) != 0)
        return errno;
    c->life_fd = above_those(pipes[1]);
    ends[1] = above_those(pipes[0]);
    return c->life_fd < 0 || ends[1] < 0 ? errno : 0;
}

static int start(struct base_process *c, char *const *arguments, struct base_err *err)
{
    posix_spawn_file_actions_t actions;
    int ends[2] = {-1, -1}, why = posix_spawn_file_actions_init(&actions);
    if (!why) {
        why = connect_both(c, ends);
        if (!why)
            why = spawn_with(c, arguments, ends, &actions);
        posix_spawn_file_actions_destroy(&actions);
    }
    for (int i = 0; i < 2; i++)
        if (ends[i] >= 0)
            close(ends[i]);
    if (!why)
        return 0;
    c->pid = 0;
    base_process_end(c);
    return why == ENOMEM ? base_fail_nomem(err, c->name)
                         : base_fail(err, BASE_EIO, "cannot run %s: %s", arguments[0], strerror(why));
}

/* It has hung up; how it ended is known a moment later. */
static int say_end(const struct base_process *c, struct base_err *err)
{
    siginfo_t how = {0};
    for (int ms = 0; ms < ITS_END_MS && !has_ended(c, &how); ms += ASK_EVERY_MS)
        poll(NULL, 0, ASK_EVERY_MS);
    if (how.si_pid == 0)
        return base_fail(err, BASE_EINVAL, "%s has closed its connection", c->name);
    return base_fail(err, BASE_EINVAL, "%s ended its process: %s %d%s%s", c->name,
                     how.si_code == CLD_EXITED ? "exit status" : "signal", how.si_status,
                     how.si_code == CLD_EXITED ? "" : ", ", how.si_code == CLD_EXITED ? "" : strsignal(how.si_status));
}

static int wait_for(const struct base_process *c, double limit_s, int (*cancelled)(void *data), void *data,
                    struct base_err *err)
{
    const double begin_s = base_clock_wall_s();
    struct pollfd answer = {.fd = c->caller_fd, .events = POLLIN};
    siginfo_t how;
    unsigned char byte;
    while (poll(&answer, 1, ASK_EVERY_MS) <= 0) {
        if (cancelled && cancelled(data))
            return base_fail(err, BASE_ECANCELLED, "cancelled");
        if (has_ended(c, &how)) /* what it has started may hold the connection */
            break;
        if (limit_s > 0 && base_clock_wall_s() - begin_s > limit_s)
            return base_fail(err, BASE_EINVAL, "%s has not answered for %.0f s", c->name, limit_s);
    }
    if (recv(c->caller_fd, &byte, 1, MSG_DONTWAIT) != 1)
        return say_end(c, err);
    return byte == c->asked ? 0 : base_fail(err, BASE_EINVAL, "%s gave an answer that nobody had asked for", c->name);
}

int base_process_ask(struct base_process *c, char *const *arguments, double limit_s, int (*cancelled)(void *data),
                     void *data, struct base_err *err)
{
    int rc = base_process_runs(c) ? 0 : start(c, arguments, err);
    if (rc)
        return rc;
    c->asked++;
    send(c->caller_fd, &c->asked, 1, MSG_NOSIGNAL); /* that it is gone is seen by waiting */
    rc = wait_for(c, limit_s, cancelled, data, err);
    if (rc)
        base_process_end(c);
    return rc;
}

void base_process_release(struct base_process *c)
{
    base_process_end(c);
    if (c->memory)
        munmap(c->memory, c->bytes);
    if (c->memory_fd >= 0)
        close(c->memory_fd);
    *c = (struct base_process)BASE_PROCESS_NONE;
}
