/*
 * Caustics carry the right energy: light through a glass ball onto a screen, by path tracing and by tracing light from the
 * lamp. The light tracer shares the ray queries and the glass, but neither the kernel nor its radiance scaling.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "sample/rng.h"
#include "geom/accel.h"
#include "integ/surface.h"
#include "shade/bsdf_dispatch.h"
#include "support/pt_scenes.h"

enum { SEED = 5, SIZE = 16, SPP = 1200, PHOTONS = 600000, BOUNCES = 8 };

/* Lamp above, ball in the middle, translucent screen below, an orthographic camera under the screen. */
static const float lamp_half = 0.5f, screen_half = 1.0f, lamp_height = 3.0f;

struct bench {
    struct pt_scene scene;
    int32_t screen, ball;
};

static void begin(struct bench *b, float alpha, float eta)
{
    struct pt_scene *s = &b->scene;
    test_scene_begin(s);
    test_camera(s, v3(0, 0, 4), v3(0, 0, 0), v3(0, 1, 0), 30.0f, SIZE);
    s->camera.kind = PT_CAMERA_ORTHOGRAPHIC; /* sees the square [-1, 1]² of the screen */
    int32_t film = test_add_material(s, PT_BSDF_DIFFUSE_TRANSMISSION);
    s->materials[film].reflectance.value = v3_splat(0.0f);
    s->materials[film].transmittance.value = v3_splat(1.0f);
    int32_t glass = test_add_material(s, PT_BSDF_DIELECTRIC), black = test_add_diffuse(s, v3_splat(0.0f));
    s->materials[glass].eta = eta;
    s->materials[glass].roughness_u.value = s->materials[glass].roughness_v.value = v3_splat(alpha);
    b->screen = test_add_quad(s, film, v3(-1, -1, 0), v3(2, 0, 0), v3(0, 2, 0));
    b->ball = test_add_sphere(s, glass, v3(0.1f, 0, -1.5f), 0.6f);
    int32_t lamp =
        test_add_quad(s, black, v3(-lamp_half, -lamp_half, -lamp_height), v3(2 * lamp_half, 0, 0), v3(0, 2 * lamp_half, 0));
    test_add_area_light(s, lamp, v3_splat(1.0f), 0);
    test_scene_finish(s);
}

/* Mean irradiance on the screen from photons; *caustic gets the share that went through the ball. */
static double photon_irradiance(const struct bench *b, double *caustic, double *error)
{
    struct pt_rng rng = pt_rng_make(SEED);
    const double power = (double)(PT_PI * 4.0f * lamp_half * lamp_half), area = (double)(4.0f * screen_half * screen_half);
    double sum = 0.0, sum2 = 0.0, through = 0.0;
    for (int i = 0; i < PHOTONS; i++) {
        float x = lamp_half * (2.0f * pt_rng_float(&rng) - 1.0f), y = lamp_half * (2.0f * pt_rng_float(&rng) - 1.0f);
        pt_vec3 d = pt_sample_cosine(pt_rng_float(&rng), pt_rng_float(&rng));
        /* render space has the camera, at world z = 4, in its origin */
        struct pt_ray ray = {v3(x, y, -lamp_height - 4.0f + 1e-4f), d, 0.0f, INFINITY, 0.0f};
        double weight = power;
        for (int bounce = 0; bounce <= BOUNCES; bounce++) {
            struct pt_hit hit;
            struct pt_place at;
            if (!pt_accel_intersect(&b->scene, &ray, &hit))
                break;
            pt_place_at_hit(PT_FX_ALL, &b->scene, &ray, &hit, &at);
            if (hit.shape == b->screen) {
                sum += weight / area;
                sum2 += weight * weight / area / area;
                through += bounce > 0 ? weight / area : 0.0;
                break;
            }
            if (hit.shape != b->ball)
                break;
            struct pt_bsdf bsdf;
            struct pt_bsdf_sample s;
            struct pt_frame frame = pt_frame_from_normal(at.s.n_shading);
            pt_material_bsdf(PT_FX_ALL, &b->scene, &b->scene.materials[at.shape->material], &at.s, &bsdf);
            float u = pt_rng_float(&rng), u0 = pt_rng_float(&rng), u1 = pt_rng_float(&rng);
            if (!pt_bsdf_sample(PT_FX_ALL, &bsdf, pt_frame_to_local(&frame, v3_neg(ray.direction)), u, u0, u1, &s))
                break;
            weight *= (double)(s.weight.x / s.eta_scale); /* flux is not compressed by refraction */
            pt_vec3 w = pt_frame_to_world(&frame, s.wi);
            ray = (struct pt_ray){pt_offset_point(at.p, at.s.n_geometric, at.error, w), w, 0.0f, INFINITY, 0.0f};
        }
    }
    *caustic = through / PHOTONS;
    *error = sqrt((sum2 / PHOTONS - sum / PHOTONS * (sum / PHOTONS)) / PHOTONS);
    return sum / PHOTONS;
}

static void compare(float alpha, float eta)
{
    struct bench b;
    begin(&b, alpha, eta);
    double caustic, photon_error, path_error;
    double photons = photon_irradiance(&b, &caustic, &photon_error);
    struct pt_integrator settings = test_integrator(BOUNCES + 1);
    pt_vec3 mean = test_mean(&b.scene, &settings, pt_kernel_select(b.scene.effects, NULL, NULL), SPP, &path_error);
    /* a film that transmits all: radiance below = irradiance above / π */
    double paths = (double)(mean.x * PT_PI), error = hypot(photon_error, path_error * (double)PT_PI);
    assert_true(caustic > 0.05 * photons); /* there is a caustic to speak of */
    if (fabs(paths - photons) > 4.0 * error || error > 0.02 * photons)
        fail_msg("alpha %g eta %g: paths %g, photons %g ± %g (caustic %g)", (double)alpha, (double)eta, paths, photons,
                 error, caustic);
    test_scene_end(&b.scene);
}

static void glass_ball(void **state)
{
    (void)state;
    compare(0.0f, 1.5f);
}
static void frosted_ball(void **state)
{
    (void)state;
    compare(0.2f, 1.5f);
}
static void air_bubble(void **state)
{
    (void)state;
    compare(0.0f, 0.75f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(glass_ball), cmocka_unit_test(frosted_ball),
                                       cmocka_unit_test(air_bubble)};
    print_message("seed %d\n", SEED);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
