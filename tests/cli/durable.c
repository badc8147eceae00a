/* Preloaded: writes each fsync, fdatasync, rename and unlink of a program into the file that CALLS names; FAIL=fsync or FAIL=rename
 * makes that call fail with EIO. While there is a file that HOLD names, fsync and fdatasync wait; where it has text in it, they fail. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static int fails(const char *call)
{
    const char *one = getenv("FAIL");
    if (!one || strcmp(one, call) != 0)
        return 0;
    errno = EIO;
    return 1;
}

static void tell(const char *format, ...)
{
    const char *path = getenv("CALLS");
    FILE *f = path ? fopen(path, "a") : NULL;
    va_list args;
    if (!f)
        return;
    va_start(args, format);
    vfprintf(f, format, args);
    va_end(args);
    fclose(f);
}

/* The last part of what a descriptor is of, "." in the current folder's place. */
static const char *name_of(int fd)
{
    static char path[4096], here[4096];
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, path, sizeof path - 1);
    path[n > 0 ? n : 0] = '\0';
    if (getcwd(here, sizeof here) && strcmp(here, path) == 0)
        return ".";
    return strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
}

static int sync_as(const char *call, int fd)
{
    int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, call);
    const char *hold = getenv("HOLD");
    struct stat info;
    int held = hold && stat(hold, &info) == 0, bad = fails(call) || (held && info.st_size > 0);
    tell("%s %s%s\n", call, name_of(fd), bad ? " fails" : held ? " waits" : "");
    while (held && !bad && stat(hold, &info) == 0)
        usleep(10000);
    if (bad)
        errno = EIO;
    return bad ? -1 : real(fd);
}

int fsync(int fd) { return sync_as("fsync", fd); }

int fdatasync(int fd) { return sync_as("fdatasync", fd); }

int rename(const char *from, const char *to)
{
    int (*real)(const char *, const char *) = (int (*)(const char *, const char *))dlsym(RTLD_NEXT, "rename");
    int bad = fails("rename");
    tell("rename %s %s%s\n", from, to, bad ? " fails" : "");
    if (bad)
        errno = EIO;
    return bad ? -1 : real(from, to);
}

int unlink(const char *path)
{
    int (*real)(const char *) = (int (*)(const char *))dlsym(RTLD_NEXT, "unlink");
    tell("unlink %s\n", path);
    return real(path);
}
