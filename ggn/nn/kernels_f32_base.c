/* The kernels in single precision for any processor: vectors of 16 bytes through the compiler's vector extension. */
#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/kernels_tables.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#define REAL_IS_FLOAT 1
#define VW 4
#define TILE_OC 4
#define ISA GGN_ISA_BASE
#define TABLE ggn_kernels_f32_base
#define SQRT(x) sqrtf(x)
typedef float vf __attribute__((vector_size(4 * sizeof(float))));
typedef int vi __attribute__((vector_size(4 * sizeof(float))));
#define SET1(s) ((vf){(s), (s), (s), (s)})
#define FMA(a, b, c) ((a) * (b) + (c))
#define VSUM(v) (((v)[0] + (v)[2]) + ((v)[1] + (v)[3]))
#define KEEP(v) ((void)(v))

#include "nn/kernels.inc"
