/* The kernels in double precision for any processor: vectors of 16 bytes through the compiler's vector extension. */
#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/kernels_tables.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#define REAL_IS_FLOAT 0
#define VW 2
#define TILE_OC 4
#define ISA GGN_ISA_BASE
#define TABLE ggn_kernels_f64_base
#define SQRT(x) sqrt(x)
typedef double vf __attribute__((vector_size(2 * sizeof(double))));
typedef long long vi __attribute__((vector_size(2 * sizeof(double))));
#define SET1(s) ((vf){(s), (s)})
#define FMA(a, b, c) ((a) * (b) + (c))
#define VSUM(v) ((v)[0] + (v)[1])
#define KEEP(v) ((void)(v))

#include "nn/kernels.inc"
