/*
 * Spectra to linear Rec.709 RGB. The renderer is an RGB renderer: spectra end here. Pure functions.
 */
#ifndef PT_PBRT_SPECTRA_H
#define PT_PBRT_SPECTRA_H

#include <stddef.h>

#include "scene/vec.h"

enum { PT_SPD_COUNT = 81, PT_SPD_FIRST_NM = 380, PT_SPD_STEP_NM = 5 };

/* A spectrum, its means over steps of 5 nm around 380, 385 … 780 nm. */
struct pt_spd {
    double v[PT_SPD_COUNT];
};

/* Linear interpolation between (wavelength nm, value) pairs, sorted by wavelength; beyond the ends 0, or the end value when
 * `extend`. count >= 1 pairs. However narrow a line is, its light counts. */
void pt_spd_from_pairs(const double *pairs, size_t count, int extend, struct pt_spd *out);
void pt_spd_constant(double value, struct pt_spd *out);
/* Planck's law, scaled so that its largest value over all wavelengths is 1. Kelvin > 0. */
void pt_spd_blackbody(double kelvin, struct pt_spd *out);

/* pbrt's names: "metal-Cu-eta", "metal-Cu-k" (Ag Al Au Cu CuZn MgO TiO2), "glass-BK7" (BAF10 FK51A LASF9 F5 F10 F11),
 * "stdillum-D65" (A D50 F1 … F12), "illum-acesD60". 1 when known. Illuminants come with luminance 1. */
int pt_spd_named(const char *name, struct pt_spd *out);
/* Index of refraction at 587.6 nm of a named glass; 0 when unknown. */
double pt_glass_index(const char *name);
/* Chromaticity-only named illuminants, as RGB of luminance 1. 1 when known. */
int pt_illuminant_named(const char *name, pt_vec3 *rgb);

/* Colour of a surface with this reflectance under D65; a constant r gives exactly (r, r, r). */
pt_vec3 pt_spd_reflectance_rgb(const struct pt_spd *spd);
/* RGB of a light with this spectral power, scaled so that a constant 1 has luminance 1 (pbrt-v3's convention). */
pt_vec3 pt_spd_emission_rgb(const struct pt_spd *spd);
/* Index and absorption per channel for which the Fresnel reflectance at normal incidence is the RGB colour of the spectral
 * one under D65. */
void pt_spd_conductor_rgb(const struct pt_spd *eta, const struct pt_spd *k, pt_vec3 *eta_rgb, pt_vec3 *k_rgb);
/* Mean weighted by the eye's luminance response. */
double pt_spd_luminous_mean(const struct pt_spd *spd);

pt_vec3 pt_xyz_to_rgb(double x, double y, double z);
/* Colour spaces of pbrt's ColorSpace directive to Rec.709, white kept white. `space` as returned by pt_colour_space. */
enum pt_colour_space { PT_COLOUR_SRGB, PT_COLOUR_DCI_P3, PT_COLOUR_REC2020, PT_COLOUR_ACES };
/* -1 when unknown. */
int pt_colour_space_named(const char *name);
pt_vec3 pt_colour_to_rec709(int space, pt_vec3 rgb);

#endif
