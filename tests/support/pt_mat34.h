/* Transforms that tests make up, inverted: the program gets both ways from its loader. */
#ifndef PT_TEST_MAT34_H
#define PT_TEST_MAT34_H

#include "scene/mat34.h"

/* Inverse in double; 0 and *inv untouched when singular, else 1. */
int pt_mat34_invert(const struct pt_mat34 *t, struct pt_mat34 *inv);

#endif
