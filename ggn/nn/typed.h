/*
 * One source, two precisions: a file NAME.inc is included with REAL = float or double and TYPED(name) appending the suffix
 * _f32 or _f64.
 */
#ifndef GGN_NN_TYPED_H
#define GGN_NN_TYPED_H

#include <stddef.h>

#define GGN_TYPED_JOIN(name, suffix) name##_##suffix
#define GGN_TYPED(name, suffix) GGN_TYPED_JOIN(name, suffix)

#endif
