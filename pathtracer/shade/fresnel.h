/*
 * Fresnel reflectance of smooth interfaces for unpolarised light: dielectric (real index) and conductor (complex index).
 */
#ifndef PT_SHADE_FRESNEL_H
#define PT_SHADE_FRESNEL_H

#include "scene/vec.h"

/*
 * Reflectance in [0, 1] seen by a ray whose cosine with the normal is cos_i (> 0 outside, < 0 inside); eta = inside /
 * outside.
 * *cos_t gets the magnitude of the refracted cosine, 0 in total internal reflection. Born and Wolf 1999, §1.5.2.
 */
static inline float pt_fresnel_dielectric_t(float cos_i, float eta, float *cos_t)
{
    float etap = cos_i < 0.0f ? 1.0f / eta : eta;
    float ci = fminf(fabsf(cos_i), 1.0f);
    if (eta == 1.0f) { /* exactly nothing, whatever the square roots below would round to */
        *cos_t = ci;
        return 0.0f;
    }
    float sin2_t = (1.0f - ci * ci) / (etap * etap);
    if (sin2_t >= 1.0f) {
        *cos_t = 0.0f;
        return 1.0f;
    }
    float ct = sqrtf(1.0f - sin2_t);
    *cos_t = ct;
    float num_p = etap * ci - ct, den_p = etap * ci + ct, num_s = ci - etap * ct, den_s = ci + etap * ct;
    if (!(den_p > 0.0f && den_s > 0.0f))
        return 1.0f;
    float r_p = num_p / den_p, r_s = num_s / den_s;
    return 0.5f * (r_p * r_p + r_s * r_s);
}

static inline float pt_fresnel_dielectric(float cos_i, float eta)
{
    float cos_t;
    return pt_fresnel_dielectric_t(cos_i, eta, &cos_t);
}

/* One channel of a conductor of complex index eta + i k relative to the outside, cos_i in [0, 1]. Born and Wolf §14.2 with
 * the refracted component a + i b = sqrt(eta² - k² - sin² + 2 i eta k) written out in reals. */
static inline float pt_fresnel_conductor(float cos_i, float eta, float k)
{
    float c = fminf(fmaxf(cos_i, 0.0f), 1.0f), c2 = c * c, s2 = 1.0f - c2;
    float t = eta * eta - k * k - s2, twice = 2.0f * eta * k;
    float a2b2 = sqrtf(t * t + twice * twice);
    float a = sqrtf(fmaxf(0.0f, 0.5f * (a2b2 + t)));
    float ps = a2b2 + c2, qs = 2.0f * a * c;
    float pp = c2 * a2b2 + s2 * s2, qp = qs * s2;
    if (!(ps + qs > 0.0f && pp + qp > 0.0f))
        return 1.0f;
    float r_s = (ps - qs) / (ps + qs);
    return fmaxf(0.0f, 0.5f * r_s * (1.0f + (pp - qp) / (pp + qp)));
}

static inline pt_vec3 pt_fresnel_conductor_rgb(float cos_i, pt_vec3 eta, pt_vec3 k)
{
    return v3(pt_fresnel_conductor(cos_i, eta.x, k.x), pt_fresnel_conductor(cos_i, eta.y, k.y),
              pt_fresnel_conductor(cos_i, eta.z, k.z));
}

/* Index k of the conductor with eta = 1 whose reflectance at normal incidence is r: R = k²/(4 + k²). */
static inline float pt_conductor_k_from_reflectance(float r)
{
    float rr = fminf(fmaxf(r, 0.0f), 0.9999f);
    return 2.0f * sqrtf(rr / (1.0f - rr));
}

#endif
