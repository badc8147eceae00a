#include "geom/quadric.h"

#include <math.h>

#include "base/pi.h"

/* Bounds are widened by this share of their size, so that rounding of the transform never cuts the surface. */
#define BOUNDS_SLACK 4e-7f
/* Rounding of a float transform of a point that was computed in double: γ(4) of the terms (Higham 2002, §3.1). */
#define TRANSFORM_ERROR 5e-7f

struct dvec {
    double x, y, z;
};

static struct dvec transform(const float m[12], pt_vec3 p, double w)
{
    double x = (double)p.x, y = (double)p.y, z = (double)p.z;
    return (struct dvec){(double)m[0] * x + (double)m[1] * y + (double)m[2] * z + w * (double)m[3],
                         (double)m[4] * x + (double)m[5] * y + (double)m[6] * z + w * (double)m[7],
                         (double)m[8] * x + (double)m[9] * y + (double)m[10] * z + w * (double)m[11]};
}

static double angle_of(double x, double y)
{
    double phi = atan2(y, x);
    return phi < 0.0 ? phi + 2.0 * BASE_PI : phi;
}

/* Roots of a t² + 2 b t + c, stable; 0 when none. */
static int roots(double a, double b, double c, double *t0, double *t1)
{
    double disc = b * b - a * c;
    if (!(disc >= 0.0) || a == 0.0)
        return 0;
    double s = b < 0.0 ? sqrt(disc) - b : -sqrt(disc) - b;
    double r0 = s / a, r1 = s != 0.0 ? c / s : r0; /* s is 0 where b and c are */
    *t0 = r0 < r1 ? r0 : r1;
    *t1 = r0 < r1 ? r1 : r0;
    return 1;
}

static int whole_turn(const struct pt_quadric *q) { return q->phi_max >= 2.0f * PT_PI - 1e-4f; }

static int clipped(const struct pt_quadric *q, const struct dvec *p)
{
    if (!whole_turn(q) && angle_of(p->x, p->y) > (double)q->phi_max)
        return 1;
    if (q->kind == PT_QUADRIC_SPHERE && q->z_min <= -q->radius && q->z_max >= q->radius)
        return 0;
    return p->z < (double)q->z_min || p->z > (double)q->z_max;
}

static struct dvec along(struct dvec o, struct dvec d, double t)
{
    return (struct dvec){o.x + t * d.x, o.y + t * d.y, o.z + t * d.z};
}

static int intersect_round(const struct pt_quadric *q, struct dvec o, struct dvec d, double t_min, double t_max,
                           unsigned left_out, double *t, struct dvec *p)
{
    double r = (double)q->radius, zz = q->kind == PT_QUADRIC_SPHERE ? 1.0 : 0.0, t01[2];
    double a = d.x * d.x + d.y * d.y + zz * d.z * d.z, b = o.x * d.x + o.y * d.y + zz * o.z * d.z;
    if (!roots(a, b, o.x * o.x + o.y * o.y + zz * o.z * o.z - r * r, &t01[0], &t01[1]))
        return 0;
    for (int i = 0; i < 2; i++) {
        *t = t01[i];
        *p = along(o, d, *t);
        if (!(left_out >> i & 1) && *t > t_min && *t < t_max && !clipped(q, p))
            return 1 + i;
    }
    return 0;
}

static int intersect_disk(const struct pt_quadric *q, struct dvec o, struct dvec d, double t_min, double t_max,
                          unsigned left_out, double *t, struct dvec *p)
{
    *t = d.z != 0.0 ? ((double)q->z_min - o.z) / d.z : INFINITY;
    if ((left_out & 1) || !(*t > t_min && *t < t_max))
        return 0;
    *p = along(o, d, *t);
    double r = sqrt(p->x * p->x + p->y * p->y);
    return r <= (double)q->radius && r >= (double)q->inner_radius &&
           (whole_turn(q) || angle_of(p->x, p->y) <= (double)q->phi_max);
}

int pt_quadric_intersect(const struct pt_quadric *q, pt_vec3 origin, pt_vec3 direction, float t_min, float t_max,
                         unsigned left_out, float *t, pt_vec3 *p_quadric)
{
    struct dvec o = transform(q->from_render.m, origin, 1.0), d = transform(q->from_render.m, direction, 0.0), p;
    double at;
    int found = q->kind == PT_QUADRIC_DISK ? intersect_disk(q, o, d, (double)t_min, (double)t_max, left_out, &at, &p)
                                           : intersect_round(q, o, d, (double)t_min, (double)t_max, left_out, &at, &p);
    if (!found)
        return 0;
    *t = (float)at;
    *p_quadric = v3((float)p.x, (float)p.y, (float)p.z);
    return found;
}

void pt_quadric_bounds(const struct pt_quadric *q, pt_vec3 *lower, pt_vec3 *upper)
{
    float r = q->radius;
    *lower = v3_splat(INFINITY);
    *upper = v3_splat(-INFINITY);
    for (int i = 0; i < 8; i++) {
        pt_vec3 p = pt_mat34_point(&q->to_render, v3(i & 1 ? r : -r, i & 2 ? r : -r, i & 4 ? q->z_max : q->z_min));
        *lower = v3_least(*lower, p);
        *upper = v3_most(*upper, p);
    }
    const float *l = &lower->x, *u = &upper->x;
    float size = 0.0f;
    for (int i = 0; i < 3; i++)
        size = fmaxf(size, fmaxf(u[i] - l[i], fmaxf(fabsf(l[i]), fabsf(u[i]))));
    *lower = v3_sub(*lower, v3_splat(size * BOUNDS_SLACK));
    *upper = v3_add(*upper, v3_splat(size * BOUNDS_SLACK));
}

void pt_quadric_at(const struct pt_quadric *q, pt_vec3 p_quadric, struct pt_quadric_point *out)
{
    const float *m = q->to_render.m;
    pt_vec3 n = p_quadric;
    if (q->kind == PT_QUADRIC_CYLINDER)
        n.z = 0.0f;
    else if (q->kind == PT_QUADRIC_DISK)
        n = v3(0.0f, 0.0f, 1.0f);
    out->p = pt_mat34_point(&q->to_render, p_quadric);
    out->n = pt_mat34_normal(&q->from_render, n);
    float r = q->radius, h = fmaxf(fabsf(q->z_min), fabsf(q->z_max));
    out->error = v3(TRANSFORM_ERROR * (fabsf(m[0]) * r + fabsf(m[1]) * r + fabsf(m[2]) * h + fabsf(m[3])),
                    TRANSFORM_ERROR * (fabsf(m[4]) * r + fabsf(m[5]) * r + fabsf(m[6]) * h + fabsf(m[7])),
                    TRANSFORM_ERROR * (fabsf(m[8]) * r + fabsf(m[9]) * r + fabsf(m[10]) * h + fabsf(m[11])));
}

void pt_quadric_uv(const struct pt_quadric *q, pt_vec3 p_quadric, float *u, float *v, pt_vec3 *dpdu, pt_vec3 *dpdv)
{
    double x = (double)p_quadric.x, y = (double)p_quadric.y, z = (double)p_quadric.z, r = (double)q->radius;
    double rho = sqrt(x * x + y * y), c = rho > 0.0 ? x / rho : 1.0, s = rho > 0.0 ? y / rho : 0.0;
    pt_vec3 dv = v3(0.0f, 0.0f, q->z_max - q->z_min);
    *u = (float)(angle_of(x, y) / (double)q->phi_max);
    if (q->kind == PT_QUADRIC_SPHERE) {
        double lo = acos((double)q->z_min / r), hi = acos((double)q->z_max / r);
        *v = (float)((acos(fmin(1.0, fmax(-1.0, z / r))) - lo) / (hi - lo));
        dv = v3((float)(z * c * (hi - lo)), (float)(z * s * (hi - lo)), (float)(-rho * (hi - lo)));
    } else if (q->kind == PT_QUADRIC_CYLINDER) {
        *v = (p_quadric.z - q->z_min) / (q->z_max - q->z_min);
    } else {
        double width = (double)q->inner_radius - r;
        *v = (float)((rho - r) / width);
        dv = v3((float)(width * c), (float)(width * s), 0.0f);
    }
    *dpdu = pt_mat34_vector(&q->to_render, v3(-q->phi_max * p_quadric.y, q->phi_max * p_quadric.x, 0.0f));
    *dpdv = pt_mat34_vector(&q->to_render, dv);
}
