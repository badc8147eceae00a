/*
 * Normals that are none, of length 0 or with a component that is no number, as exporters write them: the mesh has the sides,
 * and where no corner of a triangle has a normal the look, of the same mesh without normals.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "geom/accel.h"
#include "integ/surface.h"
#include "pbrt/load.h"
#include "sample/rng.h"
#include "support/pt_captured.h"
#include "support/pt_sphere.h"

enum { CORNERS = 6, FACES = 8, RAYS = 200 };
/* An octahedron, whose corners are the outward normals at them. */
static const int corners[CORNERS][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
static const int faces[FACES][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

/* What stands for the normals of corners that have none; the corners in `mask` have none. */
struct normals {
    const char *none;
    unsigned mask;
};

/* The file m.ply, or the parameters of a trianglemesh. */
static void write_mesh(char *out, size_t room, const struct normals *normals, int ply)
{
    size_t n = 0;
#define SAY(...) n += (size_t)snprintf(out + n, room - n, __VA_ARGS__)
    if (ply)
        SAY("ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n%s"
            "element face %d\nproperty list uchar int vertex_indices\nend_header\n",
            CORNERS, normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "", FACES);
    else
        SAY("\"point3 P\" [");
    for (int i = 0; i < CORNERS; i++) {
        SAY(" %d %d %d", corners[i][0], corners[i][1], corners[i][2]);
        if (ply && normals && (normals->mask >> i & 1))
            SAY(" %s", normals->none);
        else if (ply && normals)
            SAY(" %d %d %d", corners[i][0], corners[i][1], corners[i][2]);
        SAY(ply ? "\n" : "");
    }
    for (int i = 0; i < CORNERS && !ply && normals; i++) {
        SAY(i == 0 ? " ] \"normal N\" [" : "");
        if (normals->mask >> i & 1)
            SAY(" %s", normals->none);
        else
            SAY(" %d %d %d", corners[i][0], corners[i][1], corners[i][2]);
    }
    SAY(ply ? "" : " ] \"integer indices\" [");
    for (int i = 0; i < FACES; i++)
        SAY(ply ? "3 %d %d %d\n" : " %d %d %d", faces[i][0], faces[i][1], faces[i][2]);
    SAY(ply ? "" : " ]");
#undef SAY
    assert_true(n < room);
}

enum { TEXT = 2000 };
struct files {
    char scene[TEXT + 500], ply[TEXT];
};

static int read_file(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    const struct files *files = data;
    const char *text = strcmp(path, "t.pbrt") == 0 ? files->scene : files->ply;
    (void)err;
    *size = strlen(text);
    *bytes = malloc(*size + 1);
    assert_non_null(*bytes);
    memcpy(*bytes, text, *size + 1);
    return 0;
}

static struct pt_scene *scene_of(const char *before, const struct normals *normals, int ply)
{
    struct files files;
    char mesh[TEXT];
    write_mesh(files.ply, sizeof files.ply, normals, 1);
    write_mesh(mesh, sizeof mesh, normals, 0);
    snprintf(files.scene, sizeof files.scene, "Camera \"perspective\" WorldBegin %s AreaLightSource \"diffuse\" Shape %s %s",
             before, ply ? "\"plymesh\" \"string filename\" \"m.ply\"" : "\"trianglemesh\"", ply ? "" : mesh);
    struct captured messages;
    struct pt_source source = {.read = read_file, .data = &files};
    struct pt_load_options options = {.log = &messages.log};
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    struct pt_scene *scene = NULL;
    capture_begin(&messages);
    if (pt_scene_load_source("t.pbrt", &source, &options, &scene, &defaults, &err) != 0)
        fail_msg("%s", err.text);
    capture_end(&messages);
    return scene;
}

static int same(pt_vec3 a, pt_vec3 b) { return v3_len(v3_sub(a, b)) < 1e-6f; }

static void compare(const struct pt_scene *plain, const struct pt_scene *scene, int look, const char *what)
{
    struct pt_rng rng = pt_rng_make(1);
    for (int i = 0; i < RAYS; i++) {
        pt_vec3 d = pt_sample_sphere(pt_rng_float(&rng), pt_rng_float(&rng));
        struct pt_ray ray = {v3_scale(d, i % 2 ? -3.0f : 0.0f), d, 0.0f, INFINITY, 0.0f}; /* from without and within */
        struct pt_hit hit;
        struct pt_place a, b;
        assert_true(pt_accel_intersect(plain, &ray, &hit));
        pt_place_at_hit(PT_FX_ALL, plain, &ray, &hit, &a);
        assert_true(pt_accel_intersect(scene, &ray, &hit));
        pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, &b);
        if (!same(a.s.n_geometric, b.s.n_geometric) || (look && !same(a.s.n_shading, b.s.n_shading)))
            fail_msg("%s: ray %d finds another normal than on the mesh without normals", what, i);
        assert_true(fabsf(v3_len(b.s.n_shading) - 1.0f) < 1e-5f);
    }
    assert_int_equal(scene->emitter_count, FACES);
    for (int i = 0; i < FACES; i++)
        if (!same(plain->emitters[i].n, scene->emitters[i].n))
            fail_msg("%s: triangle %d shines to the other side", what, i);
}

static void none_are_as_without(void **state)
{
    (void)state;
    static const char *const ways[] = {"", "ReverseOrientation", "Scale -1 1 1", "Scale -1 1 1 ReverseOrientation",
                                       "Rotate 30 1 2 3 Scale 2 .5 -1"};
    static const char *const nones[] = {"0 0 0", "-0 0 0", "nan nan nan", "nan 0 1", "1 -nan 0", "0 1 inf", "-Inf 0 0"};
    static const unsigned masks[] = {0x3f, 1u << 4, 0x0f, 0x1f};
    for (size_t way = 0; way < sizeof ways / sizeof *ways; way++)
        for (int ply = 0; ply < 2; ply++) {
            struct pt_scene *plain = scene_of(ways[way], NULL, ply);
            for (size_t none = 0; none < (ply ? sizeof nones / sizeof *nones : 2); none++)
                for (size_t mask = 0; mask < sizeof masks / sizeof *masks; mask++) {
                    char what[200];
                    const struct normals normals = {nones[none], masks[mask]};
                    snprintf(what, sizeof what, "%s, normals %s at corners %x, ply %d", ways[way], nones[none], masks[mask],
                             ply);
                    struct pt_scene *scene = scene_of(ways[way], &normals, ply);
                    compare(plain, scene, masks[mask] == 0x3f, what);
                    pt_scene_destroy(scene);
                }
            pt_scene_destroy(plain);
        }
}

/* The octahedron's normals are its corners, so that between them, weighted by the lengths that they are given with, lies the
 * hit point itself: however it is turned, and taken along as a normal where it is stretched. */
static void lengths_are_weights(void **state)
{
    (void)state;
    static const struct {
        const char *way;
        float by[3];
    } cases[] = {{"", {1, 1, 1}},
                 {"Rotate 35 1 2 3", {1, 1, 1}},
                 {"Rotate -70 3 -1 1 Scale 1e-6 1e-6 1e-6", {1, 1, 1}},
                 {"Scale 1 2 5", {1, 4, 25}},
                 {"Scale 1e6 2e6 -5e6 ReverseOrientation", {-1, -4, -25}}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct pt_scene *scene = scene_of(cases[i].way, &(struct normals){"", 0}, (int)i % 2);
        struct pt_rng rng = pt_rng_make(1);
        for (int k = 0; k < RAYS; k++) {
            float u = pt_rng_float(&rng);
            pt_vec3 d = pt_sample_sphere(u, pt_rng_float(&rng));
            struct pt_ray ray = {v3_splat(0.0f), d, 0.0f, INFINITY, 0.0f};
            struct pt_hit hit;
            struct pt_place at;
            assert_true(pt_accel_intersect(scene, &ray, &hit));
            pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, &at);
            pt_vec3 want = v3_norm(v3(d.x / cases[i].by[0], d.y / cases[i].by[1], d.z / cases[i].by[2]));
            if (!(v3_len(v3_sub(at.s.n_shading, want)) < 1e-5f))
                fail_msg("%s: (%g, %g, %g) instead of (%g, %g, %g)", cases[i].way, (double)at.s.n_shading.x,
                         (double)at.s.n_shading.y, (double)at.s.n_shading.z, (double)want.x, (double)want.y, (double)want.z);
        }
        pt_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(none_are_as_without), cmocka_unit_test(lengths_are_weights)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
