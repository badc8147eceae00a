/* The instruction sets that kernels are compiled for, and which of them to run. Thread-safe. */
#ifndef GGN_NN_ISA_H
#define GGN_NN_ISA_H

/* Weakest first. */
enum ggn_isa { GGN_ISA_BASE, GGN_ISA_AVX2, GGN_ISA_AVX512, GGN_ISA_COUNT };

const char *ggn_isa_name(enum ggn_isa isa);
/* Whether this build and this processor have it; BASE always is. */
int ggn_isa_available(enum ggn_isa isa);
/* The best one available; the environment variable GGN_ISA=base|avx2|avx512 lowers it. */
enum ggn_isa ggn_isa_best(void);

#endif
