#include "nn/isa.h"

#include <stdlib.h>
#include <string.h>

static const char *const names[GGN_ISA_COUNT] = {"base", "avx2", "avx512"};

const char *ggn_isa_name(enum ggn_isa isa) { return names[isa]; }

int ggn_isa_available(enum ggn_isa isa)
{
    if (isa == GGN_ISA_BASE)
        return 1;
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (isa == GGN_ISA_AVX2)
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (isa == GGN_ISA_AVX512)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("fma");
#endif
    return 0;
}

enum ggn_isa ggn_isa_best(void)
{
    const char *wish = getenv("GGN_ISA");
    int top = GGN_ISA_COUNT - 1;

    for (int i = 0; wish && i < GGN_ISA_COUNT; i++)
        if (!strcmp(wish, names[i]))
            top = i;
    while (!ggn_isa_available((enum ggn_isa)top))
        top--;
    return (enum ggn_isa)top;
}
