/*
 * Loaded in front of Embree (LD_PRELOAD), holds it to the instruction set that EMBREE_ISA names (sse4.2, avx, avx2, avx512):
 * Embree itself takes that only from the program. The program's own configuration has to be empty, as ours is.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include <embree3/rtcore.h>

RTC_API RTCDevice rtcNewDevice(const char *config)
{
    static RTCDevice (*embree)(const char *config);
    const char *isa = getenv("EMBREE_ISA");
    char held[64];
    *(void **)&embree = dlsym(RTLD_NEXT, "rtcNewDevice");
    if (!embree || config || !isa || snprintf(held, sizeof held, "isa=%s", isa) >= (int)sizeof held) {
        fprintf(stderr, "embree_isa.so: no Embree, a configuration of the program's own, or no EMBREE_ISA\n");
        abort();
    }
    return embree(held);
}
