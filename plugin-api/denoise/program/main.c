/* lull-denoiser: runs Open Image Denoise for another process of ours, as often as it asks. See denoise/oidn.h, shared.h. */
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "denoise/program/library.h"

/* Whoever asks has gone, perhaps in the middle of a run. Not by PR_SET_PDEATHSIG: the thread that started this program may
 * end long before its process. */
static void *end_with_caller(void *unused)
{
    (void)unused;
    struct pollfd caller = {.fd = SHARED_CALLER};
    while (!caller.revents)
        poll(&caller, 1, -1);
    _exit(0);
}

/* Its size changes from run to run. MAP_FAILED: there is none. */
static struct shared *map(size_t *bytes)
{
    struct stat size;
    if (fstat(SHARED_MEMORY, &size) != 0 || (size_t)size.st_size < sizeof(struct shared))
        return MAP_FAILED;
    *bytes = (size_t)size.st_size;
    return mmap(NULL, *bytes, PROT_READ | PROT_WRITE, MAP_SHARED, SHARED_MEMORY, 0);
}

static void serve(struct library **library, const char *path, struct shared *s)
{
    struct base_err err = {0};
    s->code = *library ? 0 : library_open(path, library, &err);
    if (!s->code)
        s->code = library_denoise(*library, s, &err);
    memcpy(s->text, err.text, sizeof s->text);
    s->text[sizeof s->text - 1] = '\0';
}

int main(int argc, char **argv)
{
    struct library *library = NULL;
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
    while (read(SHARED_CALLER, &byte, 1) == 1 && (s = map(&bytes)) != MAP_FAILED) {
        serve(&library, argv[1], s);
        munmap(s, bytes);
        if (write(SHARED_CALLER, &byte, 1) != 1)
            return 1;
    }
    return 0;
}
