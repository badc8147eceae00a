/*
 * Camera rays: perspective and orthographic, thin lens, moving camera; and pixel filters by importance sampling, so that a
 * sample never touches a neighbouring pixel's sums (Ernst, Stamminger & Greiner 2006). Pure, thread-safe.
 */
#ifndef PT_SHADE_CAMERA_H
#define PT_SHADE_CAMERA_H

#include "geom/accel.h"
#include "scene/scene.h"
#include "scene/settings.h"

/* Derives the camera's ray constants from its kind, size, fov and screen window. */
void pt_camera_init(struct pt_camera *camera);

/* Camera → render transform at `time` of an animated camera. */
void pt_camera_transform_at(const struct pt_camera *camera, float time, struct pt_mat34 *out);

/* Offsets (dx[i], dy[i]) from the centre of a pixel for (u0[i], u1[i]) in [0, 1), distributed as the filter; i < count. */
void pt_filter_sample(const struct pt_integrator *settings, int count, const float *u0, const float *u1, float *dx,
                      float *dy);

/* Point of the unit disk, concentric map (Shirley & Chiu 1997). */
void pt_camera_lens_sample(float u0, float u1, float *x, float *y);

/* Of a camera whose rays begin at a depth: origin and direction in the space of to_render, for the point (x, y) of the
 * window about its middle and the point (lens_x, lens_y) of the lens. */
void pt_camera_far_ray(const struct pt_camera *camera, float x, float y, float lens_x, float lens_y, pt_vec3 *o, pt_vec3 *d);

/* Ray through raster position (x, y), y down, direction of unit length. lens: (u0, u1) on the lens, used when it has one. */
static inline void pt_camera_ray(pt_effects fx, const struct pt_camera *camera, float x, float y, float lens_u, float lens_v,
                                 float time, struct pt_ray *ray)
{
    const struct pt_mat34 *to_render = &camera->to_render[0];
    struct pt_mat34 moving;
    if ((fx & PT_FX_MOTION) && camera->animated) {
        pt_camera_transform_at(camera, time, &moving);
        to_render = &moving;
    }
    pt_vec3 on_screen = v3(camera->x0 + camera->dx * x, camera->y0 + camera->dy * y, 1.0f);
    pt_vec3 o = v3_splat(0.0f), d = on_screen;
    if (camera->kind == PT_CAMERA_ORTHOGRAPHIC) {
        o = v3(on_screen.x, on_screen.y, 0.0f);
        d = v3(0.0f, 0.0f, 1.0f);
    }
    float lx = 0.0f, ly = 0.0f;
    if ((fx & PT_FX_DEFOCUS) && camera->lens_radius > 0.0f) {
        pt_vec3 focus = v3_madd(o, camera->focal_distance, d);
        pt_camera_lens_sample(lens_u, lens_v, &lx, &ly);
        o = v3(o.x + camera->lens_radius * lx, o.y + camera->lens_radius * ly, 0.0f);
        d = v3_sub(focus, o);
    }
    if (camera->start > 0.0f)
        pt_camera_far_ray(camera, on_screen.x, on_screen.y, lx, ly, &o, &d);
    ray->origin = pt_mat34_point(to_render, o);
    ray->direction = v3_norm(pt_mat34_vector(to_render, d));
    ray->t_min = PT_RAY_OFF_START;
    ray->t_max = INFINITY;
    ray->time = time;
}

#endif
