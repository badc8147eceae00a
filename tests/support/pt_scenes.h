/*
 * Small scenes made directly in C, for tests that need a renderable without a parser.
 *
 * test_scene_begin, then test_add_*, then test_scene_finish; test_scene_end releases all. Failures abort the test (assert).
 */
#ifndef TESTS_SUPPORT_PT_SCENES_H
#define TESTS_SUPPORT_PT_SCENES_H

#include "integ/integrator.h"
#include "scene/scene.h"

/* Room in each array; enough for tests. */
enum { TEST_ROOM = 256 };

void test_scene_begin(struct pt_scene *scene);
void test_scene_finish(struct pt_scene *scene);
void test_scene_end(struct pt_scene *scene);

/* Camera at `eye` looking at `at` with `up`, square image of size² pixels. Call before any shape: everything is given in world
 * space and recentred at the eye. */
void test_camera(struct pt_scene *scene, pt_vec3 eye, pt_vec3 at, pt_vec3 up, float fov_deg, int size);

int32_t test_add_material(struct pt_scene *scene, int32_t kind); /* grey defaults; edit scene->materials[id] */
int32_t test_add_diffuse(struct pt_scene *scene, pt_vec3 reflectance);
/* Triangle mesh, positions in world space; copies. Returns the shape. */
int32_t test_add_mesh(struct pt_scene *scene, int32_t material, const float *positions, uint32_t vertex_count,
                      const uint32_t *indices, uint32_t triangle_count);
/* Parallelogram p, p+a, p+a+b, p+b; normal a × b. */
int32_t test_add_quad(struct pt_scene *scene, int32_t material, pt_vec3 p, pt_vec3 a, pt_vec3 b);
int32_t test_add_sphere(struct pt_scene *scene, int32_t material, pt_vec3 centre, float radius);
/* Makes shape `shape` an area light. */
int32_t test_add_area_light(struct pt_scene *scene, int32_t shape, pt_vec3 radiance, int two_sided);
int32_t test_add_light(struct pt_scene *scene, const struct pt_light *light);
int32_t test_add_medium(struct pt_scene *scene, pt_vec3 sigma_a, pt_vec3 sigma_s, float g);
/* Axis-aligned box seen from outside (inside_out = 1: from inside) as one mesh. */
int32_t test_add_box(struct pt_scene *scene, int32_t material, pt_vec3 lo, pt_vec3 hi, int inside_out);

/* The classic Cornell box, white/red/green walls, two boxes, one area light; `scale` and `shift` move the world. */
void test_cornell(struct pt_scene *scene, int size, float scale, pt_vec3 shift);

struct pt_integrator test_integrator(int max_depth);

/* Mean radiance over the image, spp samples a pixel; *error_of_mean (may be NULL) gets the luminance's standard error. */
pt_vec3 test_mean(const struct pt_scene *scene, const struct pt_integrator *settings, pt_kernel *kernel, uint32_t spp,
                  double *error_of_mean);

#endif
