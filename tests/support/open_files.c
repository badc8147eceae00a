/*
 * Linked into every test program: no file stays open. What the product opens for a call it closes, also when it fails; a leak of
 * descriptors is seen by no sanitizer and ends a long render.
 */
#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

enum { SEEN = 256 }; /* descriptors looked at */
static int at_start;
static pid_t who;

static int open_files(void)
{
    int n = 0;
    for (int fd = 0; fd < SEEN; fd++)
        n += fcntl(fd, F_GETFD) != -1;
    return n;
}

__attribute__((constructor)) static void begin(void)
{
    at_start = open_files();
    who = getpid();
}

__attribute__((destructor)) static void end(void)
{
    if (getpid() != who || open_files() <= at_start) /* a child has what it was given */
        return;
    for (int fd = 3; fd < SEEN; fd++) {
        char link[32], name[200];
        snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
        ssize_t n = readlink(link, name, sizeof name - 1);
        if (n > 0)
            fprintf(stderr, "left open: %d, %.*s\n", fd, (int)n, name);
    }
    _exit(1);
}
