/* Random directions, for tests. */
#ifndef TESTS_SUPPORT_PT_SPHERE_H
#define TESTS_SUPPORT_PT_SPHERE_H

#include "shade/warp.h"

/* Uniform on the sphere; pdf_solid = 1/(4π). */
static inline pt_vec3 pt_sample_sphere(float u0, float u1)
{
    float z = 1.0f - 2.0f * u0, r = sqrtf(fmaxf(0.0f, 1.0f - z * z)), s, c;
    pt_sincos_turn(u1, &s, &c);
    return v3(r * c, r * s, z);
}

#endif
