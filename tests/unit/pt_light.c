#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "sample/rng.h"
#include "geom/accel.h"
#include "geom/quadric.h"
#include "integ/surface.h"
#include "shade/light_build.h"
#include "shade/light_select.h"
#include "support/pt_scenes.h"
#include "support/pt_mat34.h"
#include "support/pt_sphere.h"

enum { SAMPLES = 200000 };
static const double PI = 3.14159265358979323846;

static void alias_table_keeps_probabilities(void **state)
{
    (void)state;
    const double weights[6] = {1.0, 0.0, 3.0, 0.5, 0.0, 2.5};
    struct pt_emitter e[6];
    int32_t work[6];
    double p[6] = {0};
    pt_alias_build(weights, 6, e, work);
    for (int i = 0; i < 6; i++) {
        p[i] += (double)e[i].alias_q / 6.0;
        p[e[i].alias] += (1.0 - (double)e[i].alias_q) / 6.0;
    }
    for (int i = 0; i < 6; i++)
        assert_true(fabs(p[i] - weights[i] / 7.0) < 1e-6);
}

/* Any weights: what is kept and what is passed on add up, and nothing without weight is ever chosen. */
static void alias_tables_of_any_weights(void **state)
{
    (void)state;
    enum { N = 97 };
    struct pt_rng rng = pt_rng_make(9);
    for (int round = 0; round < 300; round++) {
        double weights[N], sum = 0.0, p[N] = {0};
        struct pt_emitter e[N];
        int32_t work[N], n = 1 + round % N;
        for (int i = 0; i < n; i++) {
            float u = pt_rng_float(&rng);
            weights[i] = round % 3 == 0 ? 1.0 : i > 0 && u < 0.2f ? 0.0 : pow(10.0, 6.0 * (double)u - 3.0);
            sum += weights[i];
        }
        pt_alias_build(weights, n, e, work);
        for (int i = 0; i < n; i++) {
            const float q = e[i].alias_q;
            const int32_t alias = e[i].alias;
            assert_true(q >= 0.0f && q <= 1.0f && alias >= 0 && alias < n);
            assert_true(weights[alias] > 0.0 && (weights[i] > 0.0 || q == 0.0f));
            p[i] += (double)q / n;
            p[alias] += (1.0 - (double)q) / n;
        }
        for (int i = 0; i < n; i++)
            if (!(fabs(p[i] - weights[i] / sum) < 1e-5))
                fail_msg("round %d: %d of %d has %g instead of %g", round, i, (int)n, p[i], weights[i] / sum);
    }
}

/* Lamps without area are all that there is: each is as likely as the others, and none lights anything. */
static void lamps_without_power(void **state)
{
    (void)state;
    struct pt_scene scene;
    const struct pt_receiver at = {{0, 0, -3}, {0, 0, 1}, PT_RECEIVER_SURFACE};
    test_scene_begin(&scene);
    int32_t black = test_add_diffuse(&scene, v3_splat(0.0f));
    for (int i = 0; i < 2; i++)
        test_add_area_light(&scene, test_add_quad(&scene, black, v3((float)i, 0, 1), v3(0, 2, 0), v3(0, 1, 0)), v3(1, 2, 3),
                            0);
    test_scene_finish(&scene);
    assert_int_equal(scene.emitter_count, 4);
    assert_null(scene.light_tree);
    for (int i = 0; i < 4; i++) {
        struct pt_light_sample s;
        assert_true(scene.emitters[i].pmf == 0.25f && scene.emitters[i].alias_q == 1.0f);
        assert_int_equal(pt_light_sample(PT_FX_ALL, &scene, &at, 0.25f * (float)i, 0.3f, 0.4f, &s), 0);
    }
    test_scene_end(&scene);
}

/* Density of a direction by asking what it hits, as the kernel does for BSDF sampling. */
static float pdf_of(const struct pt_scene *scene, const struct pt_receiver *from, pt_vec3 wi)
{
    struct pt_ray ray = {from->p, wi, 0.0f, INFINITY, 0.0f};
    struct pt_hit hit;
    struct pt_place at;
    if (!pt_accel_intersect(scene, &ray, &hit)) {
        float pdf = 0.0f;
        for (int32_t i = 0; i < scene->env_light_count; i++)
            pdf += pt_light_env_pdf(scene, &scene->lights[scene->env_lights[i]], from->p, wi);
        return pdf;
    }
    pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, &at);
    if (v3_dot(at.s.n_geometric, wi) >= 0.0f)
        return 0.0f;
    return pt_light_area_pdf(PT_FX_ALL, scene, at.shape, at.primitive, from, at.p, at.s.n_geometric, wi);
}

/* The density of samples equals the density asked for, it integrates to 1 over directions
 * (when all of the light is visible), and the estimate of the irradiance
 * on a sphere around p_ref (∫ L dω) agrees with uniform sampling of directions. */
static void check_light(const struct pt_scene *scene, pt_vec3 p_ref, int all_visible)
{
    const struct pt_receiver volume = {p_ref, {0, 0, 0}, PT_RECEIVER_VOLUME}, *at = &volume;
    struct pt_rng rng = pt_rng_make(11);
    double norm = 0.0, by_light = 0.0, by_direction = 0.0, square = 0.0;
    int lit = 0, agree = 0;
    for (int i = 0; i < SAMPLES; i++) {
        struct pt_light_sample s;
        float pick = pt_rng_float(&rng), u0 = pt_rng_float(&rng), u1 = pt_rng_float(&rng);
        if (pt_light_sample(PT_FX_ALL, scene, at, pick, u0, u1, &s)) {
            if (s.pixel)
                s.radiance = v3_mul(s.radiance, v3(s.pixel[0], s.pixel[1], s.pixel[2]));
            by_light += (double)v3_luminance(s.radiance) / (1.0 / (double)s.inv_pdf_solid) / SAMPLES;
            float pdf = pdf_of(scene, at, s.wi);
            lit++;
            agree += fabsf(pdf * s.inv_pdf_solid - 1.0f) <= 2e-3f;
            assert_true(fabsf(v3_len(s.wi) - 1.0f) < 1e-4f);
        }
        pt_vec3 w = pt_sample_sphere(pt_rng_float(&rng), pt_rng_float(&rng));
        double pdf = (double)pdf_of(scene, at, w);
        norm += pdf * 4.0 * PI / SAMPLES;
        square += pdf * pdf * 16.0 * PI * PI / SAMPLES;
        struct pt_ray ray = {p_ref, w, 0.0f, INFINITY, 0.0f};
        struct pt_hit hit;
        double l = 0.0;
        if (pt_accel_intersect(scene, &ray, &hit))
            l = pdf > 0.0 ? (double)v3_luminance(scene->lights[scene->shapes[hit.shape].light].emission) : 0.0;
        else /* light sampling goes through the portal only where an environment is constant */
            for (int32_t k = 0; k < scene->env_light_count && pdf > 0.0; k++)
                l += (double)v3_luminance(pt_light_env_eval(scene, &scene->lights[scene->env_lights[k]], w));
        by_direction += l * 4.0 * PI / SAMPLES;
    }
    double error = sqrt(fmax(0.0, square - norm * norm) / SAMPLES);
    if (all_visible && fabs(norm - 1.0) > 5.0 * error + 1e-4)
        fail_msg("the density integrates to %g ± %g", norm, error);
    if (fabs(by_light - by_direction) > 5.0 * error / norm * by_light + 1e-3)
        fail_msg("irradiance %g by light sampling, %g by direction", by_light, by_direction);
    assert_true(agree > 0.98 * lit); /* at the very rim of a shape rounding may find another primitive */
}

static void run(void (*build)(struct pt_scene *scene), int all_visible)
{
    struct pt_scene scene;
    test_scene_begin(&scene);
    build(&scene);
    test_scene_finish(&scene);
    check_light(&scene, v3(0.2f, 0.1f, -0.3f), all_visible);
    test_scene_end(&scene);
}

static void build_quad(struct pt_scene *s)
{
    int32_t black = test_add_diffuse(s, v3_splat(0.0f));
    test_add_area_light(s, test_add_quad(s, black, v3(-1, -1, 1), v3(0, 2, 0), v3(2, 0, 0)), v3(1, 2, 3), 0);
    test_add_area_light(s, test_add_quad(s, black, v3(-1, -1, -2), v3(2, 0, 0), v3(0, 2, 0)), v3(5, 1, 3), 0);
}

/* Of the corners of a triangle those in `down` have normals that point down, the others up. */
static void turn_normals(struct pt_scene *s, int32_t shape, int triangle, int down, struct pt_vertex vertices[4])
{
    struct pt_mesh *mesh = &s->meshes[s->shapes[shape].data];
    memcpy(vertices, mesh->vertices, 4 * sizeof *vertices);
    for (int i = 0; i < 3; i++)
        vertices[mesh->indices[3 * triangle + i]].n = v3(0, 0.3f, down >> i & 1 ? -1.0f : 1.0f + 0.5f * (float)i);
    mesh->vertices = vertices;
    mesh->has_normals = 1;
}

static void build_turned_normals(struct pt_scene *s)
{
    static struct pt_vertex above[4], below[4];
    int32_t black = test_add_diffuse(s, v3_splat(0.0f));
    int32_t up = test_add_quad(s, black, v3(-1, -1, 1), v3(0, 2, 0), v3(2, 0, 0)),
            down = test_add_quad(s, black, v3(-1, -1, -2), v3(2, 0, 0), v3(0, 2, 0));
    turn_normals(s, up, 0, 2, above);
    turn_normals(s, down, 0, 5, below);
    test_add_area_light(s, up, v3(1, 2, 3), 0);
    test_add_area_light(s, down, v3(5, 1, 3), 0);
}

static void build_sphere(struct pt_scene *s)
{
    int32_t black = test_add_diffuse(s, v3_splat(0.0f));
    test_add_area_light(s, test_add_sphere(s, black, v3(2, 0.5f, 1), 1.0f), v3(1, 2, 3), 0);
}

static void set_transform(struct pt_quadric *q, struct pt_mat34 t)
{
    q->to_render = t;
    assert_int_equal(pt_mat34_invert(&t, &q->from_render), 1);
}

/* An ellipsoid, a clipped sphere: sampled by area, with the stretch of the surface taken into account. */
static void build_ellipsoid(struct pt_scene *s)
{
    int32_t black = test_add_diffuse(s, v3_splat(0.0f)), id = test_add_sphere(s, black, v3(0, 0, 0), 1.0f);
    set_transform(&s->quadrics[0], (struct pt_mat34){{1, 0, 0, 3, 0, 2, 0, 0.5f, 0, 0.3f, 0.5f, 1}});
    test_add_area_light(s, id, v3(1, 2, 3), 0);
}

static void build_cylinder(struct pt_scene *s)
{
    int32_t black = test_add_diffuse(s, v3_splat(0.0f)), id = test_add_sphere(s, black, v3(0, 0, 0), 1.0f);
    s->quadrics[0].kind = PT_QUADRIC_CYLINDER;
    set_transform(&s->quadrics[0], (struct pt_mat34){{1, 0, 0, 3, 0, 1, 0, 0.5f, 0, 0, 1, 1}});
    test_add_area_light(s, id, v3(1, 2, 3), 0);
}

static void build_disk(struct pt_scene *s)
{
    int32_t black = test_add_diffuse(s, v3_splat(0.0f)), id = test_add_sphere(s, black, v3(0, 0, 0), 1.0f);
    s->quadrics[0] = (struct pt_quadric){.kind = PT_QUADRIC_DISK, .radius = 1.0f, .inner_radius = 0.25f, .phi_max = 4.0f};
    set_transform(&s->quadrics[0], (struct pt_mat34){{2, 0, 0, 0.3f, 0, -1, 0, 0, 0, 0, -1, 1}});
    test_add_area_light(s, id, v3(1, 2, 3), 0);
}

static void build_env(struct pt_scene *s, int32_t mapping, int32_t width, int32_t height)
{
    float *px = pt_arena_alloc(&s->arena, (size_t)(3 * width * height), sizeof *px);
    assert_non_null(px);
    struct pt_rng rng = pt_rng_make(5);
    for (int i = 0; i < 3 * width * height; i++)
        px[i] = pt_rng_float(&rng) * (i % 37 == 0 ? 10.0f : 1.0f);
    s->images[s->image_count++] = (struct pt_image_map){width, height, 3, PT_PIXEL_FLOAT, 1.0f, px};
    struct pt_light light = {.kind = PT_LIGHT_ENV_IMAGE,
                             .shape = -1,
                             .image = 0,
                             .mapping = mapping,
                             .emission = {1, 1, 2},
                             .from_render = {{0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0}}};
    test_add_light(s, &light);
}

/* A shear and scale of determinant 1. */
static void build_stretched(struct pt_scene *s, int32_t mapping)
{
    build_env(s, mapping, 24, 24);
    struct pt_light *light = &s->lights[s->light_count - 1];
    light->is_stretched = 1;
    light->from_render = (struct pt_mat34){{0, 0.5f, 0, 0, 2, 1, 0, 0, 0, 0, 1, 0}};
    light->to_render = (struct pt_mat34){{-1, 0.5f, 0, 0, 2, 0, 0, 0, 0, 0, 1, 0}};
}
static void build_stretched_latlong(struct pt_scene *s) { build_stretched(s, PT_ENV_LATLONG); }
static void build_stretched_equal_area(struct pt_scene *s) { build_stretched(s, PT_ENV_EQUAL_AREA); }

static void build_latlong(struct pt_scene *s) { build_env(s, PT_ENV_LATLONG, 32, 16); }
static void build_equal_area(struct pt_scene *s) { build_env(s, PT_ENV_EQUAL_AREA, 24, 24); }

static void add_portal(struct pt_scene *s)
{
    struct pt_light *light = &s->lights[s->light_count - 1];
    light->has_portal = 1;
    light->portal = v3(-0.3f, -0.8f, 1.2f);
    light->portal_u = v3(1.1f, 0.1f, 0.2f);
    light->portal_v = v3(0.4f, 0.9f, -0.3f);
}

static void build_latlong_portal(struct pt_scene *s)
{
    build_latlong(s);
    add_portal(s);
}

static void build_constant_portal(struct pt_scene *s)
{
    struct pt_light light = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {1, 1, 2}};
    test_add_light(s, &light);
    add_portal(s);
}

static void quads(void **state)
{
    (void)state;
    run(build_quad, 1);
}
static void stretched_skies(void **state)
{
    (void)state;
    run(build_stretched_latlong, 1);
    run(build_stretched_equal_area, 1);
}
static void normals_of_both_sides(void **state)
{
    (void)state;
    run(build_turned_normals, 0);
}
static void sphere_outside(void **state)
{
    (void)state;
    run(build_sphere, 1);
}
static void portal_of_an_image(void **state)
{
    (void)state;
    run(build_latlong_portal, 1);
}
static void portal_of_a_constant(void **state)
{
    (void)state;
    run(build_constant_portal, 1);
}
static void ellipsoid(void **state)
{
    (void)state;
    run(build_ellipsoid, 0);
}
static void cylinder(void **state)
{
    (void)state;
    run(build_cylinder, 0);
}
static void disk(void **state)
{
    (void)state;
    run(build_disk, 1);
}
static void latlong(void **state)
{
    (void)state;
    run(build_latlong, 1);
}
static void equal_area(void **state)
{
    (void)state;
    run(build_equal_area, 1);
}

/* From inside, an emitting sphere turned inwards fills all directions. */
static void sphere_inside(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    build_sphere(&scene);
    scene.shapes[0].flip_normal = 1;
    test_scene_finish(&scene);
    check_light(&scene, v3(2.3f, 0.4f, 1.1f), 1);
    test_scene_end(&scene);
}

/* A triangle with normals emits to the side that they have together, whatever its winding and the first of them say. */
static void normals_say_which_side_emits(void **state)
{
    (void)state;
    for (int k = 0; k < 8; k++) {
        struct pt_scene scene;
        test_scene_begin(&scene);
        int32_t id = test_add_quad(&scene, test_add_diffuse(&scene, v3_splat(0.0f)), v3(0, 0, 0), v3(1, 0, 0), v3(0, 1, 0));
        struct pt_mesh *mesh = &scene.meshes[scene.shapes[id].data];
        struct pt_vertex vertices[4];
        memcpy(vertices, mesh->vertices, sizeof vertices);
        for (int i = 0; i < 3; i++) /* of the corners of the first triangle, those in k point down */
            vertices[mesh->indices[i]].n = v3(0, 0, k >> i & 1 ? -1.0f : 1.0f);
        mesh->vertices = vertices;
        mesh->has_normals = 1;
        test_add_area_light(&scene, id, v3(1, 1, 1), 0);
        test_scene_finish(&scene);
        int down = (k & 1) + (k >> 1 & 1) + (k >> 2 & 1);
        assert_true(scene.emitters[0].n.z == (down > 1 ? -1.0f : 1.0f));
        test_scene_end(&scene);
    }
}

/* Also by the hierarchy: of many lamps, one in a corner of which another side emits than elsewhere. */
static void turned_triangles_are_selected_from_both_sides(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_vertex vertices[4];
    test_scene_begin(&scene);
    scene.light_selection = PT_LIGHT_SELECTION_HIERARCHY;
    int32_t black = test_add_diffuse(&scene, v3_splat(0.0f));
    for (int i = 0; i < 40; i++) { /* more than are looked at whether the hierarchy is worth it */
        int32_t quad = test_add_quad(&scene, black, v3(3.0f * (float)i, 0, 0), v3(1, 0, 0), v3(0, 1, 0));
        if (i == 20)
            turn_normals(&scene, quad, 0, 1, vertices);
        test_add_area_light(&scene, quad, v3(1, 1, 1), 0);
    }
    test_scene_finish(&scene);
    assert_non_null(scene.light_tree);
    for (int i = 0; i < 2; i++) {
        const struct pt_receiver at = {v3(60.3f, 0.3f, i ? -1.0f : 1.0f), {0, 0, 0}, PT_RECEIVER_VOLUME};
        assert_true(pt_light_tree_pmf(&scene, &at, 40) > 0.1f); /* the nearest by far */
    }
    test_scene_end(&scene);
}

/* Only whole spheres that are still spheres after their transform are sampled by the cone that they fill. */
static void only_spheres_are_cones(void **state)
{
    (void)state;
    static const struct {
        float columns[9], z_min, z_max, phi_max;
        int cone;
    } cases[] = {{{2, 0, 0, 0, 2, 0, 0, 0, 2}, -1, 1, 6.2831853f, 1},
                 {{2, 0, 0, 0, 0, 2, 0, -2, 0}, -2, 3, 6.2831853f, 1},
                 {{2, 0, 0, 0, 2.01f, 0, 0, 0, 2}, -1, 1, 6.2831853f, 0},
                 {{2, 0, 0, 0, 2, 0, 0, 0, 2.01f}, -1, 1, 6.2831853f, 0},
                 {{1.92f, 0.56f, 0, 0.56f, 1.92f, 0, 0, 0, 2}, -1, 1, 6.2831853f, 0},
                 {{1.92f, 0, 0.56f, 0, 2, 0, 0.56f, 0, 1.92f}, -1, 1, 6.2831853f, 0},
                 {{2, 0, 0, 0, 1.92f, 0.56f, 0, 0.56f, 1.92f}, -1, 1, 6.2831853f, 0},
                 {{2, 0, 0, 0, 2, 0, 0, 0, 2}, -0.99f, 1, 6.2831853f, 0},
                 {{2, 0, 0, 0, 2, 0, 0, 0, 2}, -1, 0.99f, 6.2831853f, 0},
                 {{2, 0, 0, 0, 2, 0, 0, 0, 2}, -1, 1, 6.28f, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const float *c = cases[i].columns;
        struct pt_quadric q = {.kind = PT_QUADRIC_SPHERE,
                               .radius = 1,
                               .z_min = cases[i].z_min,
                               .z_max = cases[i].z_max,
                               .phi_max = cases[i].phi_max};
        set_transform(&q, (struct pt_mat34){{c[0], c[3], c[6], 5, c[1], c[4], c[7], 0, c[2], c[5], c[8], 0}});
        struct pt_scene scene = {.quadrics = &q};
        const struct pt_shape shape = {.kind = PT_SHAPE_QUADRIC};
        float pdf = pt_light_quadric_pdf(&scene, &shape, v3(0, 0, 0), v3(3, 0, 0), v3(-1, 0, 0), v3(1, 0, 0));
        float cone = 1.0f / (2.0f * PT_PI * (1.0f - sqrtf(1.0f - 0.16f))); /* radius 2 at distance 5 */
        assert_int_equal(fabsf(pdf / cone - 1.0f) < 1e-5f, cases[i].cone);
    }
}

/* Points of its own inner side are lit by the whole of it, evenly by area, whichever side of it their rounding puts them. */
static void sphere_lights_itself(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_rng rng = pt_rng_make(7);
    int lit = 0;
    test_scene_begin(&scene);
    build_sphere(&scene);
    scene.shapes[0].flip_normal = 1;
    test_scene_finish(&scene);
    for (int i = 0; i < 4000; i++) {
        pt_vec3 n = pt_sample_sphere(pt_rng_float(&rng), pt_rng_float(&rng)), p = v3_add(v3(2, 0.5f, 1), n);
        const struct pt_receiver at = {p, v3_neg(n), PT_RECEIVER_SURFACE};
        struct pt_light_sample s;
        if (!pt_light_sample(PT_FX_ALL, &scene, &at, 0.5f, pt_rng_float(&rng), pt_rng_float(&rng), &s))
            continue;
        /* the chord of a unit sphere meets both ends at cosine d/2, so dω = (d/2) dA/d² */
        float d = v3_len(v3_sub(s.target, p));
        lit++;
        if (d > 0.1f && !(fabsf(s.inv_pdf_solid - 2.0f * PT_PI / d) < 1e-3f * s.inv_pdf_solid))
            fail_msg("sample %d at distance %g has 1/pdf %g", i, (double)d, (double)s.inv_pdf_solid);
        assert_true(s.inv_pdf_solid < 2.0f * PT_PI / 0.1f || d < 0.11f);
    }
    assert_true(lit > 3900);
    test_scene_end(&scene);
}

/* The middle of each pixel, in double: latitude and longitude from the upper pole; poles are the first and last row. */
static void skies_are_looked_up_where_they_are(void **state)
{
    (void)state;
    enum { W = 12, H = 7 };
    static float pixels[W * H * 3];
    struct pt_scene scene = {0};
    struct pt_image_map map = {W, H, 3, PT_PIXEL_FLOAT, 1, pixels};
    struct pt_light light = {.kind = PT_LIGHT_ENV_IMAGE,
                             .emission = {1, 10, 100},
                             .mapping = PT_ENV_LATLONG,
                             .from_render = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
    scene.images = &map;
    for (int i = 0; i < W * H * 3; i++)
        pixels[i] = (float)(i + 1);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double theta = (y + 0.5) / H * PI, phi = (x + 0.5) / W * 2 * PI;
            pt_vec3 got = pt_light_env_image_eval(
                &scene, &light, v3((float)(sin(theta) * cos(phi)), (float)(sin(theta) * sin(phi)), (float)cos(theta)));
            float first = (float)(3 * (y * W + x) + 1);
            assert_true(got.x == first && got.y == 10 * (first + 1) && got.z == 100 * (first + 2));
        }
    assert_true(pt_light_env_image_eval(&scene, &light, v3(0, 0, 1)).x == 1);
    assert_true(pt_light_env_image_eval(&scene, &light, v3(0, 0, -1)).x == 3 * W * (H - 1) + 1);
    assert_true(pt_light_env_image_eval(&scene, &light, v3(1, -1e-9f, 0)).x ==
                3 * (H / 2 * W + W - 1) + 1); /* a whole turn */
    /* Clarberg's square: the upper pole in the middle, the lower in the corners, axes on the edges' middles */
    static const struct {
        pt_vec3 w;
        int x, y;
    } known[] = {
        {{0, 0, 1}, 4, 4},          {{0.01f, 0.01f, -1}, 7, 7}, {{-0.01f, 0.01f, -1}, 0, 7}, {{-0.01f, -0.01f, -1}, 0, 0},
        {{1, 0.01f, 0}, 7, 4},      {{0.01f, 1, 0}, 4, 7},      {{-1, -0.01f, 0}, 0, 3},     {{-0.01f, -1, 0}, 3, 0},
        {{0.5f, 0.5f, 0.1f}, 5, 5}, {{0.5f, 0.5f, -0.1f}, 6, 6}};
    map.width = map.height = 8;
    light.mapping = PT_ENV_EQUAL_AREA;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        float got = pt_light_env_image_eval(&scene, &light, known[i].w).x;
        if (got != (float)(3 * (known[i].y * 8 + known[i].x) + 1))
            fail_msg("direction %d is in pixel %d, %d", (int)i, (int)(got - 1) / 3 % 8, (int)(got - 1) / 24);
    }
}

/* Point, spot and distant lights against their closed forms. */
static void delta_lights(void **state)
{
    (void)state;
    struct pt_light point = {.kind = PT_LIGHT_POINT, .emission = {8, 8, 8}, .position = {0, 0, 2}};
    struct pt_light spot = {.kind = PT_LIGHT_SPOT,
                            .emission = {8, 8, 8},
                            .position = {0, 0, 2},
                            .direction = {0, 0, -1},
                            .cos_total = 0.8f,
                            .cos_start = 0.9f};
    struct pt_light distant = {.kind = PT_LIGHT_DISTANT, .emission = {3, 3, 3}, .direction = {0, 0, -1}};
    struct pt_light_sample s;
    assert_int_equal(pt_light_delta_sample(&point, 0.5f, v3(0, 0, 0), &s), 1);
    assert_true(fabsf(s.radiance.x - 2.0f) < 1e-6f && s.delta && s.finite && s.inv_pdf_solid == 2.0f);
    assert_int_equal(pt_light_delta_sample(&spot, 1.0f, v3(0, 0, 0), &s), 1);
    assert_true(fabsf(s.radiance.x - 2.0f) < 1e-6f);
    assert_int_equal(pt_light_delta_sample(&spot, 1.0f, v3(1.6f, 0, 0), &s), 0);
    float r = 2.0f * sqrtf(1.0f - 0.85f * 0.85f) / 0.85f; /* half way between the cones: smoothstep is 1/2 */
    assert_int_equal(pt_light_delta_sample(&spot, 1.0f, v3(r, 0, 0), &s), 1);
    assert_true(fabsf(s.radiance.x - 0.5f * 8.0f / (4.0f + r * r)) < 1e-4f);
    spot.is_quartic = 1; /* and (1/2)⁴ in pbrt-v3 */
    assert_int_equal(pt_light_delta_sample(&spot, 1.0f, v3(r, 0, 0), &s), 1);
    assert_true(fabsf(s.radiance.x - 0.0625f * 8.0f / (4.0f + r * r)) < 1e-4f);
    assert_int_equal(pt_light_delta_sample(&spot, 1.0f, v3(0, 0, 0), &s), 1);
    assert_true(fabsf(s.radiance.x - 2.0f) < 1e-6f);
    for (double cone = 1e-5; cone < 1; cone *= 4) { /* radians, from a laser on: lit within, dark outside, half way 1/2 */
        struct pt_light narrow = spot;
        narrow.is_quartic = 0;
        narrow.cos_total = cos(cone);
        narrow.cos_start = 1;
        float half = (float)(2 * tan(acos(0.5 + 0.5 * cos(cone)))), dist2 = 4 + half * half;
        assert_int_equal(pt_light_delta_sample(&narrow, 1.0f, v3(0, 0, 0), &s), 1);
        assert_true(fabsf(s.radiance.x - 2.0f) < 1e-5f);
        assert_int_equal(pt_light_delta_sample(&narrow, 1.0f, v3(half, 0, 0), &s), 1);
        assert_true(fabsf(s.radiance.x - 4.0f / dist2) < 0.02f);
        narrow.cos_start = narrow.cos_total;
        float inside = (float)(2 * tan(0.97 * cone));
        assert_int_equal(pt_light_delta_sample(&narrow, 1.0f, v3(inside, 0, 0), &s), 1);
        assert_true(fabsf(s.radiance.x * (4 + inside * inside) - 8.0f) < 1e-4f);
        assert_int_equal(pt_light_delta_sample(&narrow, 1.0f, v3((float)(2 * tan(1.03 * cone)), 0, 0), &s), 0);
    }
    assert_int_equal(pt_light_delta_sample(&distant, 1.0f, v3(5, 6, 7), &s), 1);
    assert_true(!s.finite && s.wi.z == 1.0f && s.radiance.x == 3.0f);
}

/* The table from which an environment is sampled: small where the image is even, fine enough where it is not. */
static void tables_are_as_fine_as_the_image_asks(void **state)
{
    (void)state;
    enum { W = 1024, H = 512 };
    for (int kind = 0; kind < 3; kind++) {
        struct pt_scene scene;
        test_scene_begin(&scene);
        float *px = pt_arena_alloc(&scene.arena, (size_t)3 * W * H, sizeof *px);
        assert_non_null(px);
        for (int i = 0; i < 3 * W * H; i++) /* even; every other pixel dark; one pixel that outshines all others */
            px[i] = kind == 1 && i / 3 % 2 ? 0.0f : kind == 2 && i / 3 == 100 * W + 300 ? 1e6f : 1.0f;
        scene.images[scene.image_count++] = (struct pt_image_map){W, H, 3, PT_PIXEL_FLOAT, 1.0f, px};
        struct pt_light light = {.kind = PT_LIGHT_ENV_IMAGE,
                                 .shape = -1,
                                 .image = 0,
                                 .mapping = PT_ENV_LATLONG,
                                 .emission = {1, 1, 1},
                                 .from_render = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
        test_add_light(&scene, &light);
        test_scene_finish(&scene);
        const struct pt_env_distribution *d = &scene.env_distributions[0];
        if (kind == 0)
            assert_true(d->width == 128 && d->height == 128);
        else
            assert_true(d->width == W && d->height == H);
        test_scene_end(&scene);
    }
}

/* --- skies whose size no table divides ------------------------------------------------------------------------------------ */

/* A sky of light of all strengths, black in a quarter of it, with a sun of one pixel that has half of all light. */
static void uneven_sky(struct pt_scene *s, int32_t mapping, int32_t w, int32_t h)
{
    float *px = pt_arena_alloc(&s->arena, (size_t)(3 * w * h), sizeof *px);
    assert_non_null(px);
    struct pt_rng rng = pt_rng_make(5);
    for (int i = 0; i < w * h; i++) {
        float u = pt_rng_float(&rng), l = i % w < w / 4 ? 0.0f : 0.1f + u * u;
        px[3 * i] = l;
        px[3 * i + 1] = l * pt_rng_float(&rng);
        px[3 * i + 2] = l * pt_rng_float(&rng);
    }
    for (int k = 0; k < 3; k++)
        px[3 * (h / 3 * w + w / 2 + (w > 2)) + k] = 0.4f * (float)(w * h);
    s->images[s->image_count++] = (struct pt_image_map){w, h, 3, PT_PIXEL_FLOAT, 1.0f, px};
    struct pt_light light = {.kind = PT_LIGHT_ENV_IMAGE,
                             .shape = -1,
                             .mapping = mapping,
                             .emission = {1, 1, 1},
                             .from_render = {{0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0}}};
    test_add_light(s, &light);
}

/* The direction of a place (s, t) of a latitude–longitude map. */
static pt_vec3 latlong_direction(const struct pt_light *light, double s, double t)
{
    pt_vec3 l = v3((float)(sin(PI * t) * cos(2 * PI * s)), (float)(sin(PI * t) * sin(2 * PI * s)), (float)cos(PI * t));
    return pt_mat34_normal(&light->from_render, l); /* a rotation: its transpose is its inverse */
}

/* Over the pixels of a latitude–longitude map, each as large as it is: the density integrates to 1, and is positive where there is
 * light. *light gets the integral of luminance. */
static double integral_of_density(const struct pt_scene *scene, double *luminance)
{
    const struct pt_light *light = &scene->lights[0];
    const struct pt_image_map *map = &scene->images[0];
    double integral = 0.0;
    *luminance = 0.0;
    for (int y = 0; y < map->height; y++) {
        double solid = 2 * PI / map->width * (cos(PI * y / map->height) - cos(PI * (y + 1) / map->height));
        double t = (y + 0.5) / map->height, square = 2 * PI * PI * sin(PI * t) / map->width / map->height;
        for (int x = 0; x < map->width; x++) {
            pt_vec3 w = latlong_direction(light, (x + 0.5) / map->width, t);
            float pdf = pt_light_env_density(scene, light, v3(0, 0, 0), w);
            float l = v3_luminance(pt_light_env_eval(scene, light, w));
            if (l > 0.0f && !(pdf > 0.0f))
                fail_msg("%d x %d: no density at pixel %d, %d", (int)map->width, (int)map->height, x, y);
            integral += (double)pdf * square;
            *luminance += (double)l * solid;
        }
    }
    return integral;
}

/* Of samples: their mean against the integral `want`, and what their weights scatter. */
static void check_sky_samples(const struct pt_scene *scene, double want, double most_squared_weight)
{
    enum { N = 20000 };
    const struct pt_light *light = &scene->lights[0];
    const struct pt_image_map *map = &scene->images[0];
    const pt_vec3 p = v3(0.2f, 0.1f, -0.3f);
    struct pt_rng rng = pt_rng_make(3);
    double sum = 0.0, sum2 = 0.0;
    int agree = 0;
    for (int i = 0; i < N; i++) {
        struct pt_light_sample s;
        float u0 = pt_rng_float(&rng), u1 = pt_rng_float(&rng);
        if (!pt_light_env_sample(scene, light, p, u0, u1, &s)) {
            agree++;
            continue;
        }
        double weight = (double)(v3_luminance(v3(s.pixel[0], s.pixel[1], s.pixel[2])) * s.inv_pdf_solid);
        sum += weight / N;
        sum2 += weight * weight / N;
        agree += fabsf(pt_light_env_density(scene, light, p, s.wi) * s.inv_pdf_solid - 1.0f) < 1e-2f;
    }
    double error = sqrt(fmax(0.0, sum2 - sum * sum) / N);
    if (fabs(sum - want) > 5.0 * error + 1e-5 * want)
        fail_msg("%d x %d: %g ± %g by sampling, %g by integration", (int)map->width, (int)map->height, sum, error, want);
    if (sum2 / (sum * sum) > most_squared_weight)
        fail_msg("%d x %d: squared weight %g", (int)map->width, (int)map->height, sum2 / (sum * sum));
    assert_true(agree > 0.98 * N); /* at the very rim of a pixel rounding may find the next one */
}

/* Sizes that 128, 256, 512 and 1024 do not divide, along either axis. */
static const int odd_sizes[][2] = {{129, 65},  {131, 77},  {200, 100}, {255, 127}, {257, 1},   {300, 150}, {333, 40},
                                   {515, 9},   {700, 350}, {1023, 5},  {1025, 3},  {1100, 60}, {1500, 50}, {2047, 7},
                                   {2049, 11}, {3000, 12}, {5000, 6},  {3, 1025},  {5, 1500},  {7, 2500},  {1026, 1027}};
enum { ODD_SIZES = sizeof odd_sizes / sizeof *odd_sizes };
/* What a table may leave within its cells (TABLE_SQUARED_WEIGHT), times ∫ 2 sin² / (∫ sin)² = 4/3 of the solid angle within the row of
 * a pole at most; the scatter of the estimate itself. */
static const double SKY_SQUARED_WEIGHT = 1.3 * 4 / 3 * 1.05;

static void skies_of_any_size(void **state)
{
    (void)state;
    for (int i = 0; i < ODD_SIZES; i++) {
        const int w = odd_sizes[i][0], h = odd_sizes[i][1];
        struct pt_scene scene;
        double luminance;
        test_scene_begin(&scene);
        uneven_sky(&scene, PT_ENV_LATLONG, w, h);
        test_scene_finish(&scene);
        double integral = integral_of_density(&scene, &luminance);
        if (!(fabs(integral - 1.0) < 1e-4)) /* floats of the cumulative sums */
            fail_msg("%d x %d: the density integrates to %.6f", w, h, integral);
        check_sky_samples(&scene, luminance, SKY_SQUARED_WEIGHT);
        add_portal(&scene);
        check_sky_samples(&scene, luminance, INFINITY);
        test_scene_end(&scene);
    }
}

/* Every pixel of an equal-area map has the same solid angle. */
static void equal_area_skies_of_any_size(void **state)
{
    (void)state;
    for (int i = 0; i < ODD_SIZES; i++) {
        const int w = odd_sizes[i][0], h = odd_sizes[i][1];
        struct pt_scene scene;
        test_scene_begin(&scene);
        uneven_sky(&scene, PT_ENV_EQUAL_AREA, w, h);
        test_scene_finish(&scene);
        double luminance = 0.0;
        const float *px = scene.images[0].pixels;
        for (int k = 0; k < w * h; k++)
            luminance += 4 * PI / (w * h) * (double)v3_luminance(v3(px[3 * k], px[3 * k + 1], px[3 * k + 2]));
        check_sky_samples(&scene, luminance, SKY_SQUARED_WEIGHT);
        test_scene_end(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(alias_table_keeps_probabilities),
        cmocka_unit_test(alias_tables_of_any_weights),
        cmocka_unit_test(lamps_without_power),
        cmocka_unit_test(quads),
        cmocka_unit_test(stretched_skies),
        cmocka_unit_test(normals_of_both_sides),
        cmocka_unit_test(turned_triangles_are_selected_from_both_sides),
        cmocka_unit_test(sphere_outside),
        cmocka_unit_test(sphere_inside),
        cmocka_unit_test(ellipsoid),
        cmocka_unit_test(cylinder),
        cmocka_unit_test(disk),
        cmocka_unit_test(latlong),
        cmocka_unit_test(equal_area),
        cmocka_unit_test(portal_of_an_image),
        cmocka_unit_test(portal_of_a_constant),
        cmocka_unit_test(delta_lights),
        cmocka_unit_test(sphere_lights_itself),
        cmocka_unit_test(only_spheres_are_cones),
        cmocka_unit_test(normals_say_which_side_emits),
        cmocka_unit_test(skies_are_looked_up_where_they_are),
        cmocka_unit_test(tables_are_as_fine_as_the_image_asks),
        cmocka_unit_test(skies_of_any_size),
        cmocka_unit_test(equal_area_skies_of_any_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
