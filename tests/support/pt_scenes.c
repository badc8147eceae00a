#include "support/pt_scenes.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "geom/accel.h"
#include "shade/camera.h"
#include "shade/light_build.h"
#include "shade/material.h"
#include "shade/medium.h"

static void *room(struct pt_scene *scene, size_t size)
{
    void *p = pt_arena_alloc(&scene->arena, TEST_ROOM, size);
    assert(p);
    return p;
}

void test_scene_begin(struct pt_scene *scene)
{
    memset(scene, 0, sizeof *scene);
    scene->materials = room(scene, sizeof *scene->materials);
    scene->meshes = room(scene, sizeof *scene->meshes);
    scene->quadrics = room(scene, sizeof *scene->quadrics);
    scene->shapes = room(scene, sizeof *scene->shapes);
    scene->objects = room(scene, sizeof *scene->objects);
    scene->instances = room(scene, sizeof *scene->instances);
    scene->lights = room(scene, sizeof *scene->lights);
    scene->media = room(scene, sizeof *scene->media);
    scene->textures = room(scene, sizeof *scene->textures);
    scene->images = room(scene, sizeof *scene->images);
    scene->radiance_scale = 1.0f;
    scene->camera.medium = -1;
}

/* Of any medium: segments inside it are attenuated. */
static pt_effects medium_effects(const struct pt_scene *scene, int32_t id)
{
    const struct pt_medium *m = &scene->media[id];
    pt_effects fx = PT_FX_ABSORPTION;
    if (!v3_is_black(m->sigma_s))
        fx |= PT_FX_SCATTERING;
    return m->kind == PT_MEDIUM_GRID ? fx | PT_FX_GRID_MEDIUM : fx;
}

void test_scene_finish(struct pt_scene *scene)
{
    struct base_err err = {0};
    if (scene->object_count == 0)
        scene->world_shape_count = scene->shape_count;
    int code = pt_materials_build(scene, &err);
    assert(!code);
    code = pt_media_build(scene, &err);
    assert(!code);
    pt_camera_init(&scene->camera);
    code = pt_accel_build(scene, &err);
    assert(!code);
    code = pt_lights_build(scene, &err);
    assert(!code);
    (void)code;
    for (int32_t i = 0; i < scene->shape_count; i++)
        scene->effects |= pt_material_effects(scene, scene->shapes[i].material) |
                          (scene->shapes[i].kind == PT_SHAPE_QUADRIC ? PT_FX_QUADRIC : 0) |
                          (scene->shapes[i].has_alpha ? PT_FX_ALPHA | PT_FX_TEXTURE : 0);
    for (int32_t i = 0; i < scene->light_count; i++)
        scene->effects |= scene->lights[i].kind == PT_LIGHT_AREA        ? 0
                          : scene->lights[i].kind <= PT_LIGHT_ENV_IMAGE ? PT_FX_ENVIRONMENT
                                                                        : PT_FX_DELTA_LIGHT;
    for (int32_t i = 0; i < scene->medium_count; i++)
        scene->effects |= medium_effects(scene, i);
    scene->effects |= (scene->light_count > 1 ? PT_FX_MANY_LIGHTS : 0) | (scene->instance_count ? PT_FX_INSTANCES : 0) |
                      (scene->camera.lens_radius > 0.0f ? PT_FX_DEFOCUS : 0) | (scene->camera.animated ? PT_FX_MOTION : 0);
}

void test_scene_end(struct pt_scene *scene)
{
    pt_accel_release(scene);
    pt_arena_release(&scene->arena);
}

/* World position of the camera, kept in to_render[1] of a camera that does not move. */
static pt_vec3 eye_of(const struct pt_scene *scene)
{
    const float *m = scene->camera.to_render[1].m;
    return v3(m[3], m[7], m[11]);
}

void test_camera(struct pt_scene *scene, pt_vec3 eye, pt_vec3 at, pt_vec3 up, float fov_deg, int size)
{
    pt_vec3 z = v3_norm(v3_sub(at, eye)), x = v3_norm(v3_cross(z, up)), y = v3_cross(x, z);
    struct pt_camera *c = &scene->camera;
    c->kind = PT_CAMERA_PERSPECTIVE;
    c->width = c->height = size;
    c->fov_deg = fov_deg;
    c->screen[0] = c->screen[2] = -1.0f;
    c->screen[1] = c->screen[3] = 1.0f;
    c->to_render[0] = (struct pt_mat34){{x.x, y.x, z.x, 0.0f, x.y, y.y, z.y, 0.0f, x.z, y.z, z.z, 0.0f}};
    c->to_render[1] = (struct pt_mat34){{0, 0, 0, eye.x, 0, 0, 0, eye.y, 0, 0, 0, eye.z}};
    c->medium = -1;
}

static struct pt_input constant(float x, float y, float z) { return (struct pt_input){.value = {x, y, z}}; }

int32_t test_add_material(struct pt_scene *scene, int32_t kind)
{
    assert(scene->material_count < TEST_ROOM);
    struct pt_material *m = &scene->materials[scene->material_count];
    *m = (struct pt_material){.kind = kind,
                              .mix_amount = constant(0.5f, 0.5f, 0.5f),
                              .reflectance = constant(0.5f, 0.5f, 0.5f),
                              .transmittance = constant(0.25f, 0.25f, 0.25f),
                              .eta_rgb = constant(0.2f, 0.9f, 1.1f),
                              .k_rgb = constant(3.9f, 2.4f, 2.2f),
                              .thickness = constant(0.01f, 0.01f, 0.01f),
                              .eta = 1.5f};
    return scene->material_count++;
}

int32_t test_add_diffuse(struct pt_scene *scene, pt_vec3 reflectance)
{
    int32_t id = test_add_material(scene, PT_BSDF_DIFFUSE);
    scene->materials[id].reflectance = constant(reflectance.x, reflectance.y, reflectance.z);
    return id;
}

static int32_t add_shape(struct pt_scene *scene, int32_t kind, int32_t data, int32_t material)
{
    assert(scene->shape_count < TEST_ROOM);
    scene->shapes[scene->shape_count] = (struct pt_shape){.kind = kind,
                                                          .data = data,
                                                          .material = material,
                                                          .light = -1,
                                                          .medium_in = -1,
                                                          .medium_out = -1,
                                                          .alpha = constant(1, 1, 1)};
    return scene->shape_count++;
}

int32_t test_add_mesh(struct pt_scene *scene, int32_t material, const float *positions, uint32_t vertex_count,
                      const uint32_t *indices, uint32_t triangle_count)
{
    assert(scene->mesh_count < TEST_ROOM);
    struct pt_vertex *p = pt_arena_alloc(&scene->arena, vertex_count, sizeof *p);
    uint32_t *t = pt_arena_alloc(&scene->arena, 3 * (size_t)triangle_count, sizeof *t);
    assert(p && t);
    pt_vec3 eye = eye_of(scene);
    for (uint32_t i = 0; i < vertex_count; i++) {
        p[i].p = v3_sub(v3(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]), eye);
    }
    memcpy(t, indices, 3 * (size_t)triangle_count * sizeof *t);
    scene->meshes[scene->mesh_count] = (struct pt_mesh){vertex_count, triangle_count, p, t, 0, 0};
    return add_shape(scene, PT_SHAPE_MESH, scene->mesh_count++, material);
}

int32_t test_add_quad(struct pt_scene *scene, int32_t material, pt_vec3 p, pt_vec3 a, pt_vec3 b)
{
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    pt_vec3 q[4] = {p, v3_add(p, a), v3_add(v3_add(p, a), b), v3_add(p, b)};
    return test_add_mesh(scene, material, &q[0].x, 4, indices, 2);
}

int32_t test_add_sphere(struct pt_scene *scene, int32_t material, pt_vec3 centre, float radius)
{
    pt_vec3 c = v3_sub(centre, eye_of(scene));
    struct pt_quadric *q = &scene->quadrics[scene->quadric_count];
    *q = (struct pt_quadric){.kind = PT_QUADRIC_SPHERE,
                             .radius = radius,
                             .z_min = -radius,
                             .z_max = radius,
                             .phi_max = 2.0f * PT_PI,
                             .to_render = {{1, 0, 0, c.x, 0, 1, 0, c.y, 0, 0, 1, c.z}},
                             .from_render = {{1, 0, 0, -c.x, 0, 1, 0, -c.y, 0, 0, 1, -c.z}}};
    return add_shape(scene, PT_SHAPE_QUADRIC, scene->quadric_count++, material);
}

int32_t test_add_light(struct pt_scene *scene, const struct pt_light *light)
{
    assert(scene->light_count < TEST_ROOM);
    scene->lights[scene->light_count] = *light;
    return scene->light_count++;
}

int32_t test_add_area_light(struct pt_scene *scene, int32_t shape, pt_vec3 radiance, int two_sided)
{
    struct pt_light light = {
        .kind = PT_LIGHT_AREA, .shape = shape, .emission = radiance, .two_sided = two_sided, .image = -1};
    return scene->shapes[shape].light = test_add_light(scene, &light);
}

int32_t test_add_medium(struct pt_scene *scene, pt_vec3 sigma_a, pt_vec3 sigma_s, float g)
{
    scene->media[scene->medium_count] =
        (struct pt_medium){.kind = PT_MEDIUM_HOMOGENEOUS, .sigma_a = sigma_a, .sigma_s = sigma_s, .g = g};
    return scene->medium_count++;
}

int32_t test_add_box(struct pt_scene *scene, int32_t material, pt_vec3 lo, pt_vec3 hi, int inside_out)
{
    static const uint32_t outward[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                         2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    float p[24];
    uint32_t indices[36];
    for (int i = 0; i < 8; i++) {
        p[3 * i] = i & 1 ? hi.x : lo.x;
        p[3 * i + 1] = i & 2 ? hi.y : lo.y;
        p[3 * i + 2] = i & 4 ? hi.z : lo.z;
    }
    for (int i = 0; i < 36; i++)
        indices[i] = outward[inside_out && i % 3 ? i + (i % 3 == 1 ? 1 : -1) : i];
    return test_add_mesh(scene, material, p, 8, indices, 12);
}

static pt_vec3 place(pt_vec3 p, float scale, pt_vec3 shift) { return v3_madd(shift, scale, p); }

/* A box of the given half size, turned by `angle` about the vertical axis. */
static void add_block(struct pt_scene *scene, int32_t material, pt_vec3 centre, pt_vec3 half, float angle, float scale,
                      pt_vec3 shift)
{
    static const uint32_t outward[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                         2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    pt_vec3 p[8];
    float c = cosf(angle), s = sinf(angle);
    for (int i = 0; i < 8; i++) {
        pt_vec3 q = v3(i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z);
        p[i] = place(v3_add(centre, v3(c * q.x + s * q.z, q.y, c * q.z - s * q.x)), scale, shift);
    }
    test_add_mesh(scene, material, &p[0].x, 8, outward, 12);
}

static void add_wall(struct pt_scene *scene, int32_t material, pt_vec3 p, pt_vec3 a, pt_vec3 b, float scale, pt_vec3 shift)
{
    test_add_quad(scene, material, place(p, scale, shift), v3_scale(a, scale), v3_scale(b, scale));
}

void test_cornell(struct pt_scene *scene, int size, float scale, pt_vec3 shift)
{
    test_scene_begin(scene);
    test_camera(scene, place(v3(0.0f, 1.0f, 6.8f), scale, shift), place(v3(0.0f, 1.0f, 0.0f), scale, shift),
                v3(0.0f, 1.0f, 0.0f), 19.5f, size);
    int32_t white = test_add_diffuse(scene, v3(0.725f, 0.71f, 0.68f)),
            red = test_add_diffuse(scene, v3(0.63f, 0.065f, 0.05f));
    int32_t green = test_add_diffuse(scene, v3(0.14f, 0.45f, 0.091f));
    add_wall(scene, white, v3(-1, 0, -1), v3(0, 0, 2), v3(2, 0, 0), scale, shift);
    add_wall(scene, white, v3(-1, 2, -1), v3(2, 0, 0), v3(0, 0, 2), scale, shift);
    add_wall(scene, white, v3(-1, 0, -1), v3(2, 0, 0), v3(0, 2, 0), scale, shift);
    add_wall(scene, red, v3(-1, 0, -1), v3(0, 2, 0), v3(0, 0, 2), scale, shift);
    add_wall(scene, green, v3(1, 0, -1), v3(0, 0, 2), v3(0, 2, 0), scale, shift);
    add_block(scene, white, v3(0.33f, 0.3f, 0.37f), v3(0.3f, 0.3f, 0.3f), -0.29f, scale, shift);
    add_block(scene, white, v3(-0.33f, 0.6f, -0.29f), v3(0.3f, 0.6f, 0.3f), 0.32f, scale, shift);
    int32_t black = test_add_diffuse(scene, v3_splat(0.0f));
    int32_t lamp = test_add_quad(scene, black, place(v3(-0.24f, 1.98f, -0.22f), scale, shift),
                                 v3_scale(v3(0.47f, 0, 0), scale), v3_scale(v3(0, 0, 0.38f), scale));
    test_add_area_light(scene, lamp, v3(17.0f, 12.0f, 4.0f), 0);
    test_scene_finish(scene);
}

struct pt_integrator test_integrator(int max_depth)
{
    return (struct pt_integrator){.max_depth = max_depth,
                                  .rr_depth = 3,
                                  .sampler = PT_SAMPLER_INDEPENDENT,
                                  .strategy = PT_STRATEGY_MIS,
                                  .filter = PT_FILTER_BOX,
                                  .filter_x = 0.5f,
                                  .filter_y = 0.5f,
                                  .filter_sigma = 0.5f,
                                  .max_component = INFINITY,
                                  .seed = 1};
}

pt_vec3 test_mean(const struct pt_scene *scene, const struct pt_integrator *settings, pt_kernel *kernel, uint32_t spp,
                  double *error_of_mean)
{
    double sum[3] = {0}, sum_l = 0.0, sum_l2 = 0.0, n = 0.0;
    int width = scene->camera.width, height = scene->camera.height;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x += PT_RUN) {
            int count = width - x < PT_RUN ? width - x : PT_RUN;
            for (uint32_t s = 0; s < spp; s++) {
                struct pt_path_result r[PT_RUN];
                kernel(scene, settings, (uint32_t)x, (uint32_t)y, count, s, r);
                for (int i = 0; i < count; i++) {
                    double l = (double)v3_luminance(r[i].radiance);
                    sum[0] += (double)r[i].radiance.x;
                    sum[1] += (double)r[i].radiance.y;
                    sum[2] += (double)r[i].radiance.z;
                    sum_l += l;
                    sum_l2 += l * l;
                    n += 1.0;
                }
            }
        }
    if (error_of_mean)
        *error_of_mean = sqrt(fmax(0.0, sum_l2 / n - sum_l / n * (sum_l / n)) / n);
    return v3((float)(sum[0] / n), (float)(sum[1] / n), (float)(sum[2] / n));
}
