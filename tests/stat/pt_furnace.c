/* Furnaces: radiance that must come out exactly, whatever happens on the way. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "support/pt_scenes.h"

static void add_environment(struct pt_scene *scene, float radiance)
{
    struct pt_light light = {
        .kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {radiance, radiance, radiance}};
    test_add_light(scene, &light);
}

static pt_vec3 mean_of(struct pt_scene *scene, int max_depth, uint32_t spp, double *error)
{
    struct pt_integrator settings = test_integrator(max_depth);
    return test_mean(scene, &settings, pt_kernel_select(scene->effects, NULL, NULL), spp, error);
}

/* A sphere that fills the view, in a white environment. */
static void sphere_scene(struct pt_scene *scene)
{
    test_scene_begin(scene);
    test_camera(scene, v3(0, 0, -4), v3(0, 0, 0), v3(0, 1, 0), 20.0f, 24);
    add_environment(scene, 1.0f);
}

static struct pt_input grey(float x) { return (struct pt_input){0, {x, x, x}}; }

/* --- what a rough metal gives back after one reflection ------------------------------------------------------------------ */

static double smith_lambda(double cosine, double alpha)
{
    double tan2 = 1.0 / (cosine * cosine) - 1.0;
    return 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

/* Directional albedo of isotropic GGX without Fresnel's loss, height-correlated Smith masking (Heitz 2014, eq. 99): over half vectors h
 * drawn by D(h) cos h (Walter et al. 2007, eq. 35), the mean of G2 (wo·h) / (cos o · cos h), by the midpoint rule. */
static double metal_albedo(double cos_o, double alpha)
{
    enum { NU = 100, NP = 48 };
    double sin_o = sqrt(1.0 - cos_o * cos_o), sum = 0.0;
    for (int i = 0; i < NU; i++) {
        double u = (i + 0.5) / NU, cos_h = sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)),
               sin_h = sqrt(1.0 - cos_h * cos_h);
        for (int k = 0; k < NP; k++) {
            double oh = sin_o * sin_h * cos(2.0 * 3.14159265358979 * (k + 0.5) / NP) + cos_o * cos_h,
                   cos_i = 2.0 * oh * cos_h - cos_o;
            if (oh > 0.0 && cos_i > 0.0)
                sum += oh / (cos_o * cos_h * (1.0 + smith_lambda(cos_o, alpha) + smith_lambda(cos_i, alpha))) / (NU * NP);
        }
    }
    return sum;
}

/* The mean over the view of sphere_scene: a ray at the angle t from the axis meets the sphere at the incidence asin(4 sin t). */
static double metal_sphere(double alpha)
{
    enum { N = 40 };
    double edge = tan(10.0 * 3.14159265358979 / 180.0), sum = 0.0;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            double x = edge * (i + 0.5) / N, y = edge * (k + 0.5) / N, sin2 = (x * x + y * y) / (1.0 + x * x + y * y);
            sum += metal_albedo(sqrt(1.0 - 16.0 * sin2), alpha) / (N * N);
        }
    return sum;
}

static void rough_metals_lose_what_one_reflection_loses(void **state)
{
    (void)state;
    static const float alphas[] = {0.1f, 0.35f, 0.7f, 1.0f};
    for (int i = 0; i < 4; i++) {
        struct pt_scene scene;
        double error, want = metal_sphere((double)alphas[i]);
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, PT_BSDF_CONDUCTOR);
        scene.materials[id].reflectance = grey(1.0f);
        scene.materials[id].roughness_u = scene.materials[id].roughness_v = grey(alphas[i]);
        scene.materials[id].conductor_by_colour = 1;
        test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        double y = (double)v3_luminance(mean_of(&scene, -1, 128, &error));
        if (!(fabs(y - want) <= 4.0 * error + 5e-4)) /* … and the midpoint rule */
            fail_msg("alpha %g: %.5f ± %.5f, not %.5f", (double)alphas[i], y, error, want);
        test_scene_end(&scene);
    }
}

/* --- what rough glass and coatings give back ------------------------------------------------------------------------------ */

/* An oracle in double with its own walk: normals are drawn by D(h) cos h, not by what is visible, and light is followed through the
 * whole sphere or layer. Relative to the interface z is up, rel = index of the far side over that of the near one. */
struct rng48 {
    uint64_t state;
};

static double uniform(struct rng48 *r)
{
    r->state = r->state * 0x5deece66dull + 11u; /* that of drand48 */
    return ((double)(r->state >> 16 & 0xffffffffu) + 0.5) * 0x1p-32;
}

struct d3 {
    double x, y, z;
};
static double d3_dot(struct d3 a, struct d3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static struct d3 d3_mix(double s, struct d3 a, double t, struct d3 b)
{
    return (struct d3){s * a.x + t * b.x, s * a.y + t * b.y, s * a.z + t * b.z};
}

static struct d3 draw_normal(double alpha, struct rng48 *r)
{
    double u = uniform(r), c = sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)), s = sqrt(1.0 - c * c),
           turn = 2.0 * 3.14159265358979 * uniform(r);
    return (struct d3){s * cos(turn), s * sin(turn), c};
}

/* Walter et al. 2007, eq. 22; 1 in total reflection. */
static double fresnel(double c, double rel)
{
    double g2 = rel * rel - 1.0 + c * c;
    if (g2 <= 0.0)
        return 1.0;
    double g = sqrt(g2), a = (g - c) / (g + c), b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

/* Light that looks back along o goes on along *i; its weight without the radiance's 1/η², which leaving undoes. metal: no way through. */
static double scatter(double alpha, double eta, int metal, struct d3 o, struct d3 *i, struct rng48 *r)
{
    const double side = o.z < 0.0 ? -1.0 : 1.0, rel = side > 0.0 ? eta : 1.0 / eta;
    struct d3 w = {o.x, o.y, side * o.z}, h = alpha > 0.0 ? draw_normal(alpha, r) : (struct d3){0, 0, 1};
    double oh = d3_dot(w, h), weight = 1.0;
    if (oh <= 0.0)
        return 0.0;
    if (metal || uniform(r) < fresnel(oh, rel)) {
        *i = d3_mix(2.0 * oh, h, -1.0, w);
        if (i->z <= 0.0)
            return 0.0;
    } else {
        double cos_t = sqrt(1.0 - (1.0 - oh * oh) / (rel * rel));
        *i = d3_mix(-1.0 / rel, w, oh / rel - cos_t, h);
        if (i->z >= 0.0)
            return 0.0;
    }
    if (alpha > 0.0)
        weight = oh / (w.z * h.z * (1.0 + smith_lambda(w.z, alpha) + smith_lambda(fabs(i->z), alpha)));
    i->z *= side;
    return weight;
}

/* A frame about n: world to local and back. */
static struct d3 turn(struct d3 n, struct d3 w, int back)
{
    struct d3 a = fabs(n.x) > 0.5 ? (struct d3){0, 1, 0} : (struct d3){1, 0, 0}, s = d3_mix(1.0, a, -d3_dot(a, n), n);
    s = d3_mix(1.0 / sqrt(d3_dot(s, s)), s, 0.0, s);
    struct d3 t = {n.y * s.z - n.z * s.y, n.z * s.x - n.x * s.z, n.x * s.y - n.y * s.x};
    return back ? d3_mix(1.0, d3_mix(w.x, s, w.y, t), w.z, n) : (struct d3){d3_dot(w, s), d3_dot(w, t), d3_dot(w, n)};
}

/* A coating on a base that absorbs nothing: five meetings with the base at most, as the header of bsdf_coated_diffuse.h says. */
struct coating {
    const char *name;
    double alpha, base_alpha, eta, thickness;
    int metal;
};

static double coating_walk(const struct coating *k, struct d3 o, struct rng48 *r)
{
    struct d3 i;
    double weight = scatter(k->alpha, k->eta, 0, o, &i, r);
    for (int base = 0; base < 5 && weight > 0.0 && i.z < 0.0; base++) {
        weight *= exp(-k->thickness / fabs(i.z));
        struct d3 up = {-i.x, -i.y, -i.z}, next;
        if (k->metal) {
            weight *= scatter(k->base_alpha, 1.0, 1, up, &next, r);
        } else {
            double c2 = uniform(r), s = sqrt(1.0 - c2), at = 2.0 * 3.14159265358979 * uniform(r);
            next = (struct d3){s * cos(at), s * sin(at), sqrt(c2)};
        }
        if (weight <= 0.0)
            return 0.0;
        weight *= exp(-k->thickness / next.z);
        weight *= scatter(k->alpha, k->eta, 0, (struct d3){-next.x, -next.y, -next.z}, &i, r);
    }
    return i.z > 0.0 ? weight : 0.0;
}

static double glass_walk(double alpha, double eta, struct d3 p, struct d3 d, struct rng48 *r)
{
    double weight = 1.0;
    for (int k = 0; k < 1000; k++) {
        struct d3 i;
        weight *= scatter(alpha, eta, 0, turn(p, (struct d3){-d.x, -d.y, -d.z}, 0), &i, r);
        if (weight <= 0.0 || i.z > 0.0)
            return weight;
        d = turn(p, i, 1);
        p = d3_mix(1.0, p, -2.0 * d3_dot(p, d), d);
        p = d3_mix(1.0 / sqrt(d3_dot(p, p)), p, 0.0, p);
    }
    return weight;
}

/* The mean over the view of sphere_scene, by n walks; k NULL: glass of roughness alpha. */
static double walk_sphere(const struct coating *k, double alpha, int n, double *error)
{
    struct rng48 r = {4711};
    double edge = tan(10.0 * 3.14159265358979 / 180.0), sum = 0.0, sum2 = 0.0;
    for (int j = 0; j < n; j++) {
        struct d3 d = {edge * (2.0 * uniform(&r) - 1.0), edge * (2.0 * uniform(&r) - 1.0), 1.0}, eye = {0, 0, -4};
        d = d3_mix(1.0 / sqrt(d3_dot(d, d)), d, 0.0, d);
        double b = d3_dot(eye, d), t = -b - sqrt(b * b - 15.0), x;
        struct d3 p = d3_mix(1.0, eye, t, d);
        x = k ? coating_walk(k, turn(p, (struct d3){-d.x, -d.y, -d.z}, 0), &r) : glass_walk(alpha, 1.5, p, d, &r);
        sum += x / n;
        sum2 += x * x / n;
    }
    *error = sqrt(fmax(sum2 - sum * sum, 0.0) / n);
    return sum;
}

/* Of the image against the walk, besides four standard errors of both: the tables of rough coatings, the cut of long walks. */
static void check_walk(const char *name, double y, double error, double want, double want_error, double tolerance)
{
    if (!(fabs(y - want) <= 4.0 * hypot(error, want_error) + tolerance))
        fail_msg("%s: %.5f ± %.5f, not %.5f ± %.5f", name, y, error, want, want_error);
}

enum { GLASS_SPP = 64, WALKS = 200000 };
static const double COAT_TOLERANCE = 0.003;

static void rough_glass_loses_what_single_reflections_lose(void **state)
{
    (void)state;
    static const float alphas[] = {0.1f, 0.4f, 1.0f};
    for (int i = 0; i < 3; i++) {
        struct pt_scene scene;
        double error, want_error, want = walk_sphere(NULL, (double)alphas[i], WALKS, &want_error);
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, PT_BSDF_DIELECTRIC);
        scene.materials[id].roughness_u = scene.materials[id].roughness_v = grey(alphas[i]);
        test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        double y = (double)v3_luminance(mean_of(&scene, -1, GLASS_SPP, &error));
        check_walk("rough glass", y, error, want, want_error, 0.0);
        test_scene_end(&scene);
    }
}

static void coatings_lose_what_their_walk_loses(void **state)
{
    (void)state;
    static const struct coating cases[] = {
        {"coated diffuse", 0.0, 0.0, 1.5, 0.01, 0},
        {"thick coat on diffuse", 0.0, 0.0, 1.5, 0.3, 0},
        {"coated diffuse, dense", 0.0, 0.0, 1.9, 0.01, 0},
        {"rough coat on diffuse", 0.3, 0.0, 1.5, 0.05, 0},
        {"coated metal", 0.0, 0.0, 1.5, 0.05, 1},
        {"coat on rough metal", 0.0, 0.3, 1.5, 0.01, 1},
        {"rough coat on rough metal", 0.3, 0.2, 1.5, 0.01, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct coating *k = &cases[i];
        struct pt_scene scene;
        double error, want_error, want = walk_sphere(k, 0.0, WALKS, &want_error);
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, k->metal ? PT_BSDF_COATED_CONDUCTOR : PT_BSDF_COATED_DIFFUSE);
        struct pt_material *m = &scene.materials[id];
        m->reflectance = grey(1.0f);
        m->conductor_by_colour = 1;
        m->eta = (float)k->eta;
        m->thickness = grey((float)k->thickness);
        m->roughness_u = m->roughness_v = grey((float)k->alpha);
        m->base_roughness_u = m->base_roughness_v = grey((float)k->base_alpha);
        test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        double y = (double)v3_luminance(mean_of(&scene, -1, GLASS_SPP, &error));
        check_walk(k->name, y, error, want, want_error, COAT_TOLERANCE);
        test_scene_end(&scene);
    }
}

struct furnace {
    const char *name;
    int32_t kind;
    float roughness, eta;
    double least, most; /* mean radiance */
};

/* No BSDF may return more than it gets; those that lose nothing must return all. */
static void every_bsdf(void **state)
{
    (void)state;
    static const struct furnace cases[] = {
        {"diffuse", PT_BSDF_DIFFUSE, 0.0f, 1.5f, 0.9999, 1.0001},
        {"mirror", PT_BSDF_CONDUCTOR, 0.0f, 1.5f, 0.999, 1.0001},
        {"rough metal 1e-4", PT_BSDF_CONDUCTOR, 1e-4f, 1.5f, 0.999, 1.001},
        {"rough metal 0.01", PT_BSDF_CONDUCTOR, 0.01f, 1.5f, 0.99, 1.001},
        {"glass", PT_BSDF_DIELECTRIC, 0.0f, 1.5f, 0.995, 1.005},
        {"matched glass", PT_BSDF_DIELECTRIC, 0.0f, 1.0f, 0.9999, 1.0001},
        {"bubble", PT_BSDF_DIELECTRIC, 0.0f, 0.667f, 0.995, 1.005},
        {"rough glass 1e-4", PT_BSDF_DIELECTRIC, 1e-4f, 1.5f, 0.995, 1.005},
        {"thin glass", PT_BSDF_THIN_DIELECTRIC, 0.0f, 1.5f, 0.995, 1.005},
        {"diffuse transmission", PT_BSDF_DIFFUSE_TRANSMISSION, 0.0f, 1.5f, 0.995, 1.005},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct pt_scene scene;
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, cases[i].kind);
        struct pt_material *m = &scene.materials[id];
        m->reflectance = grey(cases[i].kind == PT_BSDF_DIFFUSE_TRANSMISSION ? 0.4f : 1.0f);
        m->transmittance = grey(0.6f);
        m->roughness_u = m->roughness_v = m->base_roughness_u = m->base_roughness_v = grey(cases[i].roughness);
        m->conductor_by_colour = 1;
        m->eta = cases[i].eta;
        test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        double error;
        pt_vec3 l = mean_of(&scene, -1, 32, &error);
        double y = (double)v3_luminance(l);
        if (!(y >= cases[i].least - 4.0 * error && y <= cases[i].most + 4.0 * error))
            fail_msg("%s: %g ± %g is outside [%g, %g]", cases[i].name, y, error, cases[i].least, cases[i].most);
        test_scene_end(&scene);
    }
}

/* A box of a scattering medium that absorbs nothing, bounded by interfaces: light only changes direction. */
static void medium_furnace(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct pt_scene scene;
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE);
        int32_t medium =
            test_add_medium(&scene, v3_splat(0.0f), i == 2 ? v3(0.5f, 2.0f, 8.0f) : v3_splat(3.0f), i == 0 ? 0.0f : 0.8f);
        int32_t box = test_add_box(&scene, id, v3(-1, -1, -1), v3(1, 1, 1), 0);
        scene.shapes[box].medium_in = medium;
        test_scene_finish(&scene);
        double error;
        pt_vec3 l = mean_of(&scene, -1, 32, &error);
        assert_true(fabs((double)v3_luminance(l) - 1.0) < 4.0 * error + 1e-3);
        /* of the colours, 18,000 samples of at most 3 each */
        if (!(fabsf(l.x - 1.0f) < 0.03f && fabsf(l.y - 1.0f) < 0.03f && fabsf(l.z - 1.0f) < 0.03f))
            fail_msg("medium %d: %g %g %g", i, (double)l.x, (double)l.y, (double)l.z);
        test_scene_end(&scene);
    }
}

/* Absorption only, straight through a slab of thickness 2: exp(-2 σ) per channel, seen from outside and lit through it. */
static void beer_lambert(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, 0, -4), v3(0, 0, 0), v3(0, 1, 0), 1e-3f, 4);
    add_environment(&scene, 1.0f);
    int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE);
    int32_t medium = test_add_medium(&scene, v3(0.1f, 0.5f, 2.0f), v3_splat(0.0f), 0.0f);
    scene.shapes[test_add_box(&scene, id, v3(-1, -1, -1), v3(1, 1, 1), 0)].medium_in = medium;
    test_scene_finish(&scene);
    pt_vec3 l = mean_of(&scene, 5, 4, NULL);
    assert_true(fabsf(l.x - expf(-0.2f)) < 1e-5f);
    assert_true(fabsf(l.y - expf(-1.0f)) < 1e-5f);
    assert_true(fabsf(l.z - expf(-4.0f)) < 1e-5f);
    test_scene_end(&scene);
}

/* The same through next-event estimation: a point light behind the slab lights a diffuse wall head on; nested slabs add up. */
static void beer_lambert_on_shadow_rays(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, 0, -4), v3(0, 0, 4), v3(0, 1, 0), 1e-3f, 4);
    struct pt_light point = {
        .kind = PT_LIGHT_POINT, .shape = -1, .image = -1, .emission = {16, 16, 16}, .position = {0, 0, 0}};
    test_add_light(&scene, &point); /* at the camera: render space is recentred there */
    int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE), white = test_add_diffuse(&scene, v3_splat(1.0f));
    int32_t outer = test_add_medium(&scene, v3(0.1f, 0.2f, 0.5f), v3_splat(0.0f), 0.0f);
    int32_t inner = test_add_medium(&scene, v3(0.0f, 0.3f, 1.0f), v3_splat(0.0f), 0.0f);
    scene.shapes[test_add_box(&scene, id, v3(-2, -2, -2), v3(2, 2, 2), 0)].medium_in = outer;
    int32_t core = test_add_box(&scene, id, v3(-1, -1, -1), v3(1, 1, 1), 0);
    scene.shapes[core].medium_in = inner;
    scene.shapes[core].medium_out = outer;
    test_add_quad(&scene, white, v3(-1, -1, 4), v3(0, 2, 0), v3(2, 0, 0));
    test_scene_finish(&scene);
    pt_vec3 l = mean_of(&scene, 1, 4, NULL);
    const float sigma_outer[3] = {0.1f, 0.2f, 0.5f}, sigma_inner[3] = {0.0f, 0.3f, 1.0f}, got[3] = {l.x, l.y, l.z};
    for (int i = 0; i < 3; i++) {
        /* 2 units of each medium, there and back */
        float expected = 16.0f / 64.0f / PT_PI * expf(-4.0f * (sigma_outer[i] + sigma_inner[i]));
        assert_true(fabsf(got[i] - expected) < 1e-3f * expected);
    }
    test_scene_end(&scene);
}

/* Ulbricht's sphere: what a point of a diffuse sphere throws on any other is the same everywhere, so of a light of intensity I inside
 * the unit sphere, with the irradiance E there, L = ρ/π (E + ρ I / (1 - ρ)). The light is close to the wall: where a path goes next
 * matters, and must not follow from where it went before. */
static void light_in_a_white_sphere(void **state)
{
    (void)state;
    enum { SPP = 256, SIZE = 24, FINE = 4 };
    const double rho = 0.7, at = 0.75, pi = 3.14159265358979, edge = tan(20.0 * pi / 180.0);
    double direct = 0.0;
    for (int i = 0; i < SIZE * FINE * SIZE * FINE; i++) {
        struct d3 p = {edge * (2.0 * (i % (SIZE * FINE) + 0.5) / (SIZE * FINE) - 1.0),
                       edge * (2.0 * (i / (SIZE * FINE) + 0.5) / (SIZE * FINE) - 1.0), 1};
        p = d3_mix(1.0 / sqrt(d3_dot(p, p)), p, 0.0, p);
        struct d3 l = {at - p.x, -p.y, -p.z};
        double d2 = d3_dot(l, l);
        direct += -d3_dot(l, p) / (d2 * sqrt(d2)) / (SIZE * FINE * SIZE * FINE);
    }
    const double want = rho / pi * (direct + rho / (1.0 - rho));
    for (int sampler = 0; sampler < 2; sampler++) {
        struct pt_scene scene;
        double error;
        test_scene_begin(&scene);
        test_camera(&scene, v3(0, 0, 0), v3(0, 0, 1), v3(0, 1, 0), 40.0f, SIZE);
        struct pt_light point = {
            .kind = PT_LIGHT_POINT, .shape = -1, .image = -1, .emission = {1, 1, 1}, .position = {(float)at, 0, 0}};
        test_add_light(&scene, &point);
        test_add_sphere(&scene, test_add_diffuse(&scene, v3_splat((float)rho)), v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        struct pt_integrator settings = test_integrator(-1);
        settings.sampler = sampler;
        double y =
            (double)v3_luminance(test_mean(&scene, &settings, pt_kernel_select(scene.effects, NULL, NULL), SPP, &error));
        if (!(fabs(y - want) <= 4.0 * error + 1e-3 * want))
            fail_msg("sampler %d: %.5f ± %.5f, not %.5f", sampler, y, error, want);
        test_scene_end(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rough_metals_lose_what_one_reflection_loses),
        cmocka_unit_test(rough_glass_loses_what_single_reflections_lose),
        cmocka_unit_test(coatings_lose_what_their_walk_loses),
        cmocka_unit_test(every_bsdf),
        cmocka_unit_test(medium_furnace),
        cmocka_unit_test(beer_lambert),
        cmocka_unit_test(beer_lambert_on_shadow_rays),
        cmocka_unit_test(light_in_a_white_sphere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
