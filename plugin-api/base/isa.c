#include "base/isa.h"

#include <stdlib.h>
#include <string.h>

static const char *const names[BASE_ISA_COUNT] = {"base", "avx2", "avx512"};

const char *base_isa_name(enum base_isa isa) { return names[isa]; }

int base_isa_available(enum base_isa isa)
{
    if (isa == BASE_ISA_BASE)
        return 1;
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (isa == BASE_ISA_AVX2)
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (isa == BASE_ISA_AVX512)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("fma");
#endif
    return 0;
}

enum base_isa base_isa_best(void)
{
    const char *wish = getenv("LULL_ISA");
    int top = BASE_ISA_COUNT - 1;

    for (int i = 0; wish && i < BASE_ISA_COUNT; i++)
        if (!strcmp(wish, names[i]))
            top = i;
    while (!base_isa_available((enum base_isa)top))
        top--;
    return (enum base_isa)top;
}
