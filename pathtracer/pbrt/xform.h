/*
 * Affine transforms in double, for the current transformation matrix and everything that must not lose the camera's
 * neighbourhood to rounding. Pure functions.
 */
#ifndef PT_PBRT_XFORM_H
#define PT_PBRT_XFORM_H

#include "scene/scene.h"

/* Rows of an affine 3x4 matrix applied to column vectors. */
struct pt_xform {
    double m[3][4];
};

struct pt_xform pt_xform_identity(void);
/* (a b) p = a (b p) */
struct pt_xform pt_xform_mul(struct pt_xform a, struct pt_xform b);
struct pt_xform pt_xform_translate(double x, double y, double z);
struct pt_xform pt_xform_scale(double x, double y, double z);
/* Degrees about an axis, which need not be unit but not zero. */
struct pt_xform pt_xform_rotate(double angle_deg, double x, double y, double z);
/* out = a × b, which may be a or b. */
void pt_cross(const double a[3], const double b[3], double out[3]);
/* Makes v unit; 0, and v as it was, when its length is 0 or not finite. */
int pt_normalize(double v[3]);
/* World → camera (+x right, +y up, +z forward, left-handed as in pbrt). 0 when the three points are degenerate. */
int pt_xform_look_at(const double eye[3], const double look[3], const double up[3], struct pt_xform *out);
/* From pbrt's sixteen numbers (columns one after the other). 0 when the last row is not (0, 0, 0, w ≠ 0). */
int pt_xform_from16(const double v[16], struct pt_xform *out);
/* 0 and *out untouched when singular (determinant 0 relative to its rows) or not finite. */
int pt_xform_invert(const struct pt_xform *t, struct pt_xform *out);
double pt_xform_det(const struct pt_xform *t);
void pt_xform_point(const struct pt_xform *t, const double p[3], double out[3]);
void pt_xform_vector(const struct pt_xform *t, const double v[3], double out[3]);
int pt_xform_equal(const struct pt_xform *a, const struct pt_xform *b);
/* Translation, rotation (slerp) and scale interpolated apart; Shoemake and Duff 1992, "Matrix animation and polar
 * decomposition". s = 0 gives a, s = 1 gives b. */
struct pt_xform pt_xform_interpolate(const struct pt_xform *a, const struct pt_xform *b, double s);
struct pt_mat34 pt_xform_to_mat34(struct pt_xform t);

#endif
