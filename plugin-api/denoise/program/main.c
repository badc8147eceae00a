/* lull-denoiser: one run of Open Image Denoise for another process of ours. See denoise/oidn.h and shared.h. */
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>

#include "denoise/program/library.h"

int main(int argc, char **argv)
{
    struct base_err err = {0};
    struct stat size;
    struct shared *s = MAP_FAILED;
    if (argc == 2 && fstat(SHARED_MEMORY, &size) == 0 && (size_t)size.st_size >= sizeof *s)
        s = mmap(NULL, (size_t)size.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, SHARED_MEMORY, 0);
    if (s == MAP_FAILED) {
        fprintf(stderr, "lull-denoiser: programs of Lull run it, with pictures in shared memory\n");
        return 2;
    }
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGINT, SIG_IGN); /* whoever runs it is asked to end, and ends it */
    signal(SIGHUP, SIG_IGN);
    signal(SIGTERM, SIG_IGN);
    s->code = library_denoise(argv[1], s, &err);
    memcpy(s->text, err.text, sizeof s->text);
    s->text[sizeof s->text - 1] = '\0';
    s->done = 1;
    return 0;
}
