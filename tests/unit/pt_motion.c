/* Turning, stretching and shifting at once: what the camera and instances do over the shutter, against Rodrigues' formula in double,
 * for turns about many axes from nothing to nearly half a circle. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "geom/accel.h"
#include "shade/camera.h"
#include "support/pt_scenes.h"

/* A place is T · R(angle about axis) · U, U upper triangular: shift, turn, and stretch with shear. */
struct way {
    double axis[3];
    double angle[2]; /* radians, at shutter open and close */
    double shift[2][3], stretch[2][6];
};

/* Row-major 3x4 of w at time t; every part but the turn goes linearly. */
static void place_at(const struct way *w, double t, double m[12])
{
    double len = sqrt(w->axis[0] * w->axis[0] + w->axis[1] * w->axis[1] + w->axis[2] * w->axis[2]), a[3], r[3][3], u[6];
    double angle = (1 - t) * w->angle[0] + t * w->angle[1], c = cos(angle), s = sin(angle);
    for (int i = 0; i < 3; i++)
        a[i] = w->axis[i] / len;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double cross = i == j ? 0 : (j - i + 3) % 3 == 1 ? -a[3 - i - j] : a[3 - i - j];
            r[i][j] = (i == j) * c + s * cross + (1 - c) * a[i] * a[j];
        }
    for (int i = 0; i < 6; i++)
        u[i] = (1 - t) * w->stretch[0][i] + t * w->stretch[1][i];
    const double upper[3][3] = {{u[0], u[1], u[2]}, {0, u[3], u[4]}, {0, 0, u[5]}};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            m[4 * i + j] = r[i][0] * upper[0][j] + r[i][1] * upper[1][j] + r[i][2] * upper[2][j];
        m[4 * i + 3] = (1 - t) * w->shift[0][i] + t * w->shift[1][i];
    }
}

static struct pt_mat34 matrix_at(const struct way *w, double t)
{
    double m[12];
    struct pt_mat34 out;
    place_at(w, t, m);
    for (int i = 0; i < 12; i++)
        out.m[i] = (float)m[i];
    return out;
}

/* Every combination of axis, first angle and turn: all cases of the conversion to quaternions, near and far apart. */
static int next_way(int *k, struct way *w)
{
    static const double axes[][3] = {{1, 0, 0},     {0, 1, 0},      {0, 0, 1}, {1, 0.2, -0.1},
                                     {0.1, 1, 0.2}, {-0.2, 0.1, 1}, {1, 1, 1}};
    static const double first[] = {0, 0.3, 1.9, 2.6, 3.0, -2.8}, turn[] = {0, 0.028, 0.4, 1.5, 3.0};
    int a = *k % 7, f = *k / 7 % 6, t = *k / 42;
    if (t >= 5)
        return 0;
    ++*k;
    *w = (struct way){{axes[a][0], axes[a][1], axes[a][2]},
                      {first[f], first[f] + turn[t]},
                      {{0.5, -1, 2}, {1.5, 2, 1}},
                      {{1, 0, 0, 1, 0, 1}, {1, 0, 0, 1, 0, 1}}};
    if (*k % 2)
        *w = (struct way){{axes[a][0], axes[a][1], axes[a][2]},
                          {first[f], first[f] + turn[t]},
                          {{0.5, -1, 2}, {1.5, 2, 1}},
                          {{2, 0.3, -0.2, 1.5, 0.1, 1}, {1, -0.3, 0.2, 0.5, -0.1, 1.25}}};
    return 1;
}

static void the_camera_turns_evenly(void **state)
{
    (void)state;
    struct way w;
    for (int k = 0; next_way(&k, &w);)
        for (int step = 0; step <= 4; step++) {
            double t = step / 4.0, want[12];
            struct pt_camera camera = {.animated = 1, .to_render = {matrix_at(&w, 0), matrix_at(&w, 1)}};
            struct pt_mat34 m;
            pt_camera_transform_at(&camera, (float)t, &m);
            place_at(&w, t, want);
            for (int i = 0; i < 12; i++)
                if (!(fabs((double)m.m[i] - want[i]) <= 6e-6)) /* float, and a square root of it near half a turn */
                    fail_msg("case %d at %g, element %d: %.8g instead of %.8g", k, t, i, (double)m.m[i], want[i]);
        }
}

/* A small ball off the centre of an object, or the centre of an object that is off the origin about which it turns: where it is
 * met is where it should have got to. */
static void instances_turn_evenly(void **state)
{
    (void)state;
    const double ball[3] = {0.3, 0.7, -0.5};
    struct way w;
    for (int k = 0; next_way(&k, &w);) {
        const pt_vec3 off = v3((float)ball[0], (float)ball[1], (float)ball[2]), none = v3_splat(0.0f);
        struct pt_scene scene;
        test_scene_begin(&scene);
        int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
        test_add_sphere(&scene, grey, k / 2 % 2 ? off : none, 0.01f);
        scene.world_shape_count = 0;
        scene.objects[scene.object_count++] = (struct pt_object){0, 1};
        scene.instances[scene.instance_count++] =
            (struct pt_instance){0, 1, {matrix_at(&w, 0), matrix_at(&w, 1)}, k / 2 % 2 ? none : off};
        test_scene_finish(&scene);
        for (int step = 0; step <= 4; step++) {
            double t = step / 4.0, m[12], at[3];
            place_at(&w, t, m);
            for (int i = 0; i < 3; i++)
                at[i] = m[4 * i] * ball[0] + m[4 * i + 1] * ball[1] + m[4 * i + 2] * ball[2] + m[4 * i + 3];
            struct pt_ray ray = {v3((float)at[0], (float)at[1], (float)at[2] - 5.0f), v3(0, 0, 1), 0.0f, INFINITY, (float)t};
            struct pt_hit hit;
            if (!pt_accel_intersect(&scene, &ray, &hit) || !(fabsf(hit.t - 5.0f) < 0.04f))
                fail_msg("case %d at %g: not met at %g, %g, %g", k, t, at[0], at[1], at[2]);
        }
        test_scene_end(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_camera_turns_evenly), cmocka_unit_test(instances_turn_evenly)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
