#include "shade/camera.h"

#include <math.h>

void pt_camera_init(struct pt_camera *camera)
{
    float scale = camera->kind == PT_CAMERA_PERSPECTIVE ? tanf(0.5f * camera->fov_deg * (PT_PI / 180.0f)) : 1.0f;
    const float *s = camera->screen;
    camera->x0 = scale * s[0];
    camera->dx = scale * (s[1] - s[0]) / (float)camera->width;
    camera->y0 = scale * s[3];
    camera->dy = -scale * (s[3] - s[2]) / (float)camera->height;
}

/* Rotation as quaternion (w, x, y, z), and what is left of the linear part: an upper-triangular stretch. */
struct decomposed {
    float q[4];
    float stretch[6]; /* xx, xy, xz, yy, yz, zz */
    pt_vec3 translation;
};

static void quaternion_of(pt_vec3 q0, pt_vec3 q1, pt_vec3 q2, float q[4])
{
    float m[3][3] = {{q0.x, q1.x, q2.x}, {q0.y, q1.y, q2.y}, {q0.z, q1.z, q2.z}};
    int i = m[1][1] > m[0][0] ? 1 : 0;
    i = m[2][2] > m[i][i] ? 2 : i;
    int j = (i + 1) % 3, k = (i + 2) % 3;
    float trace = m[0][0] + m[1][1] + m[2][2];
    /* Shepperd 1978: divide by the largest of the four */
    if (trace > m[i][i]) {
        float s = 2.0f * sqrtf(1.0f + trace);
        q[0] = 0.25f * s;
        q[1] = (m[2][1] - m[1][2]) / s;
        q[2] = (m[0][2] - m[2][0]) / s;
        q[3] = (m[1][0] - m[0][1]) / s;
    } else {
        float s = 2.0f * sqrtf(1.0f + m[i][i] - m[j][j] - m[k][k]);
        q[0] = (m[k][j] - m[j][k]) / s;
        q[1 + i] = 0.25f * s;
        q[1 + j] = (m[j][i] + m[i][j]) / s;
        q[1 + k] = (m[k][i] + m[i][k]) / s;
    }
}

static void decompose(const struct pt_mat34 *t, struct decomposed *out)
{
    pt_vec3 c0 = v3(t->m[0], t->m[4], t->m[8]), c1 = v3(t->m[1], t->m[5], t->m[9]), c2 = v3(t->m[2], t->m[6], t->m[10]);
    pt_vec3 q0 = v3_norm(c0);
    float xy = v3_dot(q0, c1);
    pt_vec3 q1 = v3_norm(v3_madd(c1, -xy, q0)), q2 = v3_cross(q0, q1);
    *out =
        (struct decomposed){.stretch = {v3_dot(q0, c0), xy, v3_dot(q0, c2), v3_dot(q1, c1), v3_dot(q1, c2), v3_dot(q2, c2)},
                            .translation = v3(t->m[3], t->m[7], t->m[11])};
    quaternion_of(q0, q1, q2, out->q);
}

static void slerp(const float a[4], const float b[4], float t, float out[4])
{
    float c = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], sign = c < 0.0f ? -1.0f : 1.0f, wa = 1.0f - t, wb = t;
    c = fabsf(c);
    if (c < 0.9999f) {
        float theta = acosf(c), s = 1.0f / sinf(theta);
        wa = sinf(wa * theta) * s;
        wb = sinf(wb * theta) * s;
    }
    float len2 = 0.0f;
    for (int i = 0; i < 4; i++) {
        out[i] = wa * a[i] + sign * wb * b[i];
        len2 += out[i] * out[i];
    }
    for (int i = 0; i < 4; i++)
        out[i] /= sqrtf(len2);
}

void pt_camera_transform_at(const struct pt_camera *camera, float time, struct pt_mat34 *out)
{
    struct decomposed a, b;
    float q[4], s[6];
    decompose(&camera->to_render[0], &a);
    decompose(&camera->to_render[1], &b);
    slerp(a.q, b.q, time, q);
    for (int i = 0; i < 6; i++)
        s[i] = (1.0f - time) * a.stretch[i] + time * b.stretch[i];
    float w = q[0], x = q[1], y = q[2], z = q[3];
    float r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                  2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                  2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    pt_vec3 t = v3_madd(v3_scale(a.translation, 1.0f - time), time, b.translation);
    const float translation[3] = {t.x, t.y, t.z};
    /* rotation times stretch, of which the lower triangle is 0 */
    for (int i = 0; i < 3; i++) {
        out->m[4 * i] = r[3 * i] * s[0];
        out->m[4 * i + 1] = r[3 * i] * s[1] + r[3 * i + 1] * s[3];
        out->m[4 * i + 2] = r[3 * i] * s[2] + r[3 * i + 1] * s[4] + r[3 * i + 2] * s[5];
        out->m[4 * i + 3] = translation[i];
    }
}

void pt_camera_far_ray(const struct pt_camera *camera, float x, float y, float lens_x, float lens_y, pt_vec3 *o, pt_vec3 *d)
{
    const int perspective = camera->kind == PT_CAMERA_PERSPECTIVE;
    const float by = perspective ? camera->start : 1.0f, f = camera->focal_distance;
    const float beyond = camera->focus_beyond / f, lx = camera->lens_radius * lens_x, ly = camera->lens_radius * lens_y;
    *o = v3(by * x + lx * beyond, by * y + ly * beyond, 0.0f);
    *d =
        v3((perspective ? camera->middle_x + x : 0.0f) - lx / f, (perspective ? camera->middle_y + y : 0.0f) - ly / f, 1.0f);
}

void pt_camera_lens_sample(float u0, float u1, float *x, float *y)
{
    float a = 2.0f * u0 - 1.0f, b = 2.0f * u1 - 1.0f, r = 0.0f, phi = 0.0f;
    if (a * a > b * b) {
        r = a;
        phi = 0.25f * PT_PI * (b / a);
    } else if (b != 0.0f) {
        r = b;
        phi = 0.5f * PT_PI - 0.25f * PT_PI * (a / b);
    }
    *x = r * cosf(phi);
    *y = r * sinf(phi);
}

/* Inverse of the tent of radius r over u in [0, 1). */
static float tent(float u, float r)
{
    return u < 0.5f ? r * (sqrtf(2.0f * u) - 1.0f) : r * (1.0f - sqrtf(2.0f * (1.0f - u)));
}

/* Inverse error function, single precision: M. Giles 2010, "Approximating the erfinv function". */
static float erf_inverse(float x)
{
    static const float central[] = {2.81022636e-08f, 3.43273939e-07f, -3.5233877e-06f, -4.39150654e-06f, 0.00021858087f,
                                    -0.00125372503f, -0.00417768164f, 0.246640727f,    1.50140941f};
    static const float tail[] = {-0.000200214257f, 0.000100950558f, 0.00134934322f, -0.00367342844f, 0.00573950773f,
                                 -0.0076224613f,   0.00943887047f,  1.00167406f,    2.83297682f};
    float w = -logf((1.0f - x) * (1.0f + x));
    const float *c = w < 5.0f ? central : tail;
    w = w < 5.0f ? w - 2.5f : sqrtf(w) - 3.0f;
    float p = c[0];
    for (int i = 1; i < 9; i++)
        p = c[i] + p * w;
    return p * x;
}

/* Inverse of the Gaussian cut at radius r; `scale` = sigma √2, `e` = erf(r / scale). */
static float truncated_gaussian(float u, float r, float scale, float e)
{
    float x = (2.0f * u - 1.0f) * e;
    return fmaxf(-r, fminf(r, scale * erf_inverse(fmaxf(-0.9999999f, fminf(0.9999999f, x)))));
}

static void sample_axis(const struct pt_integrator *settings, float r, int count, const float *u, float *d)
{
    const float scale = settings->filter_sigma * 1.41421356f;
    if (settings->filter == PT_FILTER_TRIANGLE) {
        for (int i = 0; i < count; i++)
            d[i] = tent(u[i], r);
    } else if (settings->filter == PT_FILTER_GAUSSIAN) {
        const float e = erff(r / scale);
        for (int i = 0; i < count; i++)
            d[i] = truncated_gaussian(u[i], r, scale, e);
    } else {
        for (int i = 0; i < count; i++)
            d[i] = (2.0f * u[i] - 1.0f) * r;
    }
}

void pt_filter_sample(const struct pt_integrator *settings, int count, const float *u0, const float *u1, float *dx,
                      float *dy)
{
    sample_axis(settings, settings->filter_x, count, u0, dx);
    sample_axis(settings, settings->filter_y, count, u1, dy);
}
