/*
 * Loaded in front of Embree (LD_PRELOAD), holds it to the instruction set that EMBREE_ISA names (sse4.2, avx, avx2, avx512):
 * Embree itself takes that only from the program, whose own configuration has to be empty, as ours is. A program that has made
 * no device through here fails, so that a test is never run in vain.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static int held_devices;

/* As Embree 3 and 4 declare it, whose device is a pointer. */
__attribute__((visibility("default"))) void *rtcNewDevice(const char *config);

void *rtcNewDevice(const char *config)
{
    void *(*embree)(const char *config);
    const char *isa = getenv("EMBREE_ISA");
    char held[64];
    *(void **)&embree = dlsym(RTLD_NEXT, "rtcNewDevice");
    if (!embree || config || !isa || snprintf(held, sizeof held, "isa=%s", isa) >= (int)sizeof held)
        return NULL;
    held_devices++;
    return embree(held);
}

__attribute__((destructor)) static void say(void)
{
    if (held_devices > 0)
        return;
    puts("not ok - Embree was not held to an instruction set");
    fflush(stdout);
    _exit(1);
}
