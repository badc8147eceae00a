/* The instruction sets that kernels are compiled for, and which of them to run. Thread-safe. */
#ifndef BASE_ISA_H
#define BASE_ISA_H

/* Weakest first. */
enum base_isa { BASE_ISA_BASE, BASE_ISA_AVX2, BASE_ISA_AVX512, BASE_ISA_COUNT };

const char *base_isa_name(enum base_isa isa);
/* Whether this build and this processor have it; BASE always is. */
int base_isa_available(enum base_isa isa);
/* The best one available; the environment variable LULL_ISA=base|avx2|avx512 lowers it. */
enum base_isa base_isa_best(void);

#endif
