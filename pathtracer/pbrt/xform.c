#include "pbrt/xform.h"

#include <math.h>
#include <string.h>

#include "base/pi.h"

struct pt_xform pt_xform_identity(void) { return (struct pt_xform){{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}; }

struct pt_xform pt_xform_mul(struct pt_xform a, struct pt_xform b)
{
    struct pt_xform r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            r.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j] + (j == 3 ? a.m[i][3] : 0);
    return r;
}

struct pt_xform pt_xform_translate(double x, double y, double z)
{
    return (struct pt_xform){{{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}}};
}

struct pt_xform pt_xform_scale(double x, double y, double z)
{
    return (struct pt_xform){{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}}};
}

struct pt_xform pt_xform_rotate(double angle_deg, double x, double y, double z)
{
    double len = sqrt(x * x + y * y + z * z);
    double s = sin(angle_deg * (BASE_PI / 180)), c = cos(angle_deg * (BASE_PI / 180));
    x /= len;
    y /= len;
    z /= len;
    return (struct pt_xform){{{x * x + (1 - x * x) * c, x * y * (1 - c) - z * s, x * z * (1 - c) + y * s, 0},
                              {x * y * (1 - c) + z * s, y * y + (1 - y * y) * c, y * z * (1 - c) - x * s, 0},
                              {x * z * (1 - c) - y * s, y * z * (1 - c) + x * s, z * z + (1 - z * z) * c, 0}}};
}

void pt_cross(const double a[3], const double b[3], double out[3])
{
    double r[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, r, sizeof r);
}

int pt_normalize(double v[3])
{
    double len = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(len > 0) || !isfinite(len))
        return 0;
    for (int i = 0; i < 3; i++)
        v[i] /= len;
    return 1;
}

int pt_xform_look_at(const double eye[3], const double look[3], const double up[3], struct pt_xform *out)
{
    double z[3] = {look[0] - eye[0], look[1] - eye[1], look[2] - eye[2]}, u[3] = {up[0], up[1], up[2]}, x[3], y[3];
    if (!pt_normalize(z) || !pt_normalize(u))
        return 0;
    pt_cross(u, z, x);
    if (x[0] * x[0] + x[1] * x[1] + x[2] * x[2] < 1e-18 || !pt_normalize(x))
        return 0;
    pt_cross(z, x, y);
    struct pt_xform camera_to_world = {{{x[0], y[0], z[0], eye[0]}, {x[1], y[1], z[1], eye[1]}, {x[2], y[2], z[2], eye[2]}}};
    return pt_xform_invert(&camera_to_world, out);
}

int pt_xform_from16(const double v[16], struct pt_xform *out)
{
    double w = v[15];
    if (!(fabs(w) > 0) || fabs(v[3]) > 1e-6 * fabs(w) || fabs(v[7]) > 1e-6 * fabs(w) || fabs(v[11]) > 1e-6 * fabs(w))
        return 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            out->m[i][j] = v[4 * j + i] / w;
    return 1;
}

double pt_xform_det(const struct pt_xform *t)
{
    const double(*m)[4] = t->m;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

int pt_xform_invert(const struct pt_xform *t, struct pt_xform *out)
{
    const double(*m)[4] = t->m;
    double det = pt_xform_det(t), volume = 1;
    for (int i = 0; i < 3; i++)
        volume *= sqrt(m[i][0] * m[i][0] + m[i][1] * m[i][1] + m[i][2] * m[i][2]);
    /* 1e-14: rows dependent to the last bits of a double. Negated so that NaN fails. */
    if (!(fabs(det) > 1e-14 * volume) || !isfinite(det) || !isfinite(m[0][3] + m[1][3] + m[2][3]))
        return 0;
    struct pt_xform r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            r.m[i][j] = (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / det;
            if (!isfinite(r.m[i][j]))
                return 0;
        }
    for (int i = 0; i < 3; i++)
        r.m[i][3] = -(r.m[i][0] * m[0][3] + r.m[i][1] * m[1][3] + r.m[i][2] * m[2][3]);
    *out = r;
    return 1;
}

void pt_xform_vector(const struct pt_xform *t, const double v[3], double out[3])
{
    double r[3];
    for (int i = 0; i < 3; i++)
        r[i] = t->m[i][0] * v[0] + t->m[i][1] * v[1] + t->m[i][2] * v[2];
    memcpy(out, r, sizeof r);
}

void pt_xform_point(const struct pt_xform *t, const double p[3], double out[3])
{
    pt_xform_vector(t, p, out);
    for (int i = 0; i < 3; i++)
        out[i] += t->m[i][3];
}

int pt_xform_equal(const struct pt_xform *a, const struct pt_xform *b)
{
    for (int i = 0; i < 12; i++)
        if (a->m[i / 4][i % 4] != b->m[i / 4][i % 4]) /* numbers, not bytes: 0 is -0 */
            return 0;
    return 1;
}

/* Linear part = rotation · stretch, by averaging with the inverse transpose. */
static void polar(const struct pt_xform *t, struct pt_xform *rotation, struct pt_xform *stretch)
{
    struct pt_xform r = *t, inverse;
    r.m[0][3] = r.m[1][3] = r.m[2][3] = 0;
    const struct pt_xform source = r;
    for (int step = 0; step < 100; step++) {
        double change = 0;
        if (!pt_xform_invert(&r, &inverse))
            break;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                double next = 0.5 * (r.m[i][j] + inverse.m[j][i]);
                change = fmax(change, fabs(next - r.m[i][j]));
                r.m[i][j] = next;
            }
        if (change < 1e-12)
            break;
    }
    *rotation = r;
    if (pt_xform_invert(&r, &inverse))
        *stretch = pt_xform_mul(inverse, source);
    else
        *stretch = source;
}

/* Shepperd 1978, the branch with the largest component. q = (x, y, z, w). */
static void quaternion_of(const struct pt_xform *t, double q[4])
{
    const double(*m)[4] = t->m;
    double trace = m[0][0] + m[1][1] + m[2][2];
    if (trace > 0) {
        double s = sqrt(trace + 1) * 2;
        q[0] = (m[2][1] - m[1][2]) / s;
        q[1] = (m[0][2] - m[2][0]) / s;
        q[2] = (m[1][0] - m[0][1]) / s;
        q[3] = s / 4;
        return;
    }
    int i = m[1][1] > m[0][0] ? 1 : 0;
    if (m[2][2] > m[i][i])
        i = 2;
    int j = (i + 1) % 3, k = (i + 2) % 3;
    double s = sqrt(fmax(0, m[i][i] - m[j][j] - m[k][k] + 1)) * 2;
    q[i] = s / 4;
    q[3] = s > 0 ? (m[k][j] - m[j][k]) / s : 1;
    q[j] = s > 0 ? (m[j][i] + m[i][j]) / s : 0;
    q[k] = s > 0 ? (m[k][i] + m[i][k]) / s : 0;
}

static struct pt_xform rotation_of(const double q[4])
{
    double x = q[0], y = q[1], z = q[2], w = q[3];
    return (struct pt_xform){{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0},
                              {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0},
                              {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0}}};
}

static void slerp(const double a[4], const double b[4], double s, double out[4])
{
    double dot = 0, flip = 1, wa = 1 - s, wb = s, len = 0;
    for (int i = 0; i < 4; i++)
        dot += a[i] * b[i];
    if (dot < 0) {
        flip = -1;
        dot = -dot;
    }
    if (dot < 0.9995) {
        double theta = acos(dot);
        wa = sin((1 - s) * theta) / sin(theta);
        wb = sin(s * theta) / sin(theta);
    }
    for (int i = 0; i < 4; i++) {
        out[i] = wa * a[i] + wb * flip * b[i];
        len += out[i] * out[i];
    }
    for (int i = 0; i < 4; i++)
        out[i] /= sqrt(len);
}

struct pt_xform pt_xform_interpolate(const struct pt_xform *a, const struct pt_xform *b, double s)
{
    struct pt_xform ra, rb, sa, sb, stretch;
    double qa[4], qb[4], q[4];
    polar(a, &ra, &sa);
    polar(b, &rb, &sb);
    /* A mirror belongs to the stretch: quaternions hold proper rotations only. */
    double mirror_a = pt_xform_det(&ra) < 0 ? -1 : 1, mirror_b = pt_xform_det(&rb) < 0 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            ra.m[i][j] *= mirror_a;
            rb.m[i][j] *= mirror_b;
            stretch.m[i][j] = (1 - s) * mirror_a * sa.m[i][j] + s * mirror_b * sb.m[i][j];
        }
    stretch.m[0][3] = stretch.m[1][3] = stretch.m[2][3] = 0;
    quaternion_of(&ra, qa);
    quaternion_of(&rb, qb);
    slerp(qa, qb, s, q);
    struct pt_xform r = pt_xform_mul(rotation_of(q), stretch);
    for (int i = 0; i < 3; i++)
        r.m[i][3] = (1 - s) * a->m[i][3] + s * b->m[i][3];
    return r;
}

struct pt_mat34 pt_xform_to_mat34(struct pt_xform t)
{
    struct pt_mat34 r;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            r.m[4 * i + j] = (float)t.m[i][j];
    return r;
}
