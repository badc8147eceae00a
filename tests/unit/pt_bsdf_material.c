/* Materials → closures and frames; the Fresnel terms they rest on. */
#include <complex.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "shade/bsdf_dispatch.h"
#include "shade/material.h"

static int near(float a, float b) { return fabsf(a - b) < 1e-5f; }

#define CONST(v) \
    { \
        .value = { v, v, v } \
    }
#define ROUGH(r) .roughness_u = CONST(r), .roughness_v = CONST(r)
#define PLAIN \
    .reflectance = CONST(0.5f), .transmittance = CONST(0.25f), .thickness = CONST(0.01f), .eta_rgb = CONST(0.2f), \
    .k_rgb = CONST(3.0f), .eta = 1.5f

static void fresnel_of_glass(void **state)
{
    (void)state;
    assert_true(near(pt_fresnel_dielectric(1.0f, 1.5f), 0.04f));
    assert_true(near(pt_fresnel_dielectric(-1.0f, 1.5f), 0.04f));
    assert_true(pt_fresnel_dielectric(0.0f, 1.5f) == 1.0f);
    assert_true(pt_fresnel_dielectric(-0.5f, 1.5f) == 1.0f); /* sin 60° > 1/1.5 */
    for (float mu = 0.0f; mu <= 1.0f; mu += 0.05f)
        assert_true(pt_fresnel_dielectric(mu + 1e-3f, 1.0f) < 1e-6f);
    /* Brewster's angle: half of the unpolarised reflectance is the s part, ((n² - 1)/(n² + 1))² */
    float brewster = cosf(atanf(1.5f)), rs = (2.25f - 1.0f) / (2.25f + 1.0f);
    assert_true(near(pt_fresnel_dielectric(brewster, 1.5f), 0.5f * rs * rs));
}

/* The real formula against complex arithmetic. */
static void fresnel_of_metal(void **state)
{
    (void)state;
    for (float mu = 0.0f; mu <= 1.0f; mu += 0.1f) {
        double complex n = 0.37 + 2.39 * I, s2 = 1.0 - (double)(mu * mu), ct = csqrt(1.0 - s2 / (n * n));
        double complex rp = (n * (double)mu - ct) / (n * (double)mu + ct),
                       rs = ((double)mu - n * ct) / ((double)mu + n * ct);
        double expected = 0.5 * (cabs(rp) * cabs(rp) + cabs(rs) * cabs(rs));
        assert_true(fabs(expected - (double)pt_fresnel_conductor(mu, 0.37f, 2.39f)) < 1e-5);
        assert_true(fabs((double)(pt_fresnel_conductor(mu, 1.5f, 0.0f) - pt_fresnel_dielectric(mu, 1.5f))) < 1e-5);
    }
    for (float r = 0.0f; r < 1.0f; r += 0.1f)
        assert_true(near(pt_fresnel_conductor(1.0f, 1.0f, pt_conductor_k_from_reflectance(r)), r));
}

/* Values that can be worked out by hand: the statistical tests hold models to themselves, these to the world. */
static void models_have_their_closed_forms(void **state)
{
    (void)state;
    struct pt_bsdf_sample s;
    pt_vec3 up = v3(0, 0, 1), wo = v3_norm(v3(0.6f, 0, 0.8f)), wi = v3_norm(v3(0, 0.8f, 0.6f));
    float pdf;
    /* thin slab: 2R/(1 + R) with R = 0.04 */
    struct pt_bsdf thin = {.kind = PT_BSDF_THIN_DIELECTRIC, .eta = 1.5f};
    assert_int_equal(pt_bsdf_sample(PT_FX_ALL, &thin, up, 0.0f, 0, 0, &s), 1);
    assert_true(near(s.pdf_solid, 0.08f / 1.04f) && s.flags == PT_SCATTER_DELTA && s.wi.z == 1.0f);
    assert_int_equal(pt_bsdf_sample(PT_FX_ALL, &thin, wo, 0.99f, 0, 0, &s), 1);
    assert_true(s.wi.x == -wo.x && s.wi.z == -wo.z && (s.flags & PT_SCATTER_TRANSMIT)); /* neither bent … */
    assert_true(s.weight.x == 1.0f && s.eta_scale == 1.0f);                             /* … nor compressed */
    /* Snell's law, and radiance compressed by 1/n² */
    struct pt_bsdf glass = {.kind = PT_BSDF_DIELECTRIC, .eta = 1.5f};
    assert_int_equal(pt_bsdf_sample(PT_FX_ALL, &glass, wo, 0.99f, 0, 0, &s), 1);
    assert_true(near(s.wi.x, -0.4f) && near(s.wi.z, -sqrtf(1.0f - 0.16f)) && near(s.weight.x, 1.0f / 2.25f));
    /* sides of a translucent film */
    struct pt_bsdf film = {
        .kind = PT_BSDF_DIFFUSE_TRANSMISSION, .reflectance = {0.2f, 0.2f, 0.2f}, .transmittance = {0.6f, 0.6f, 0.6f}};
    assert_true(near(pt_bsdf_eval(PT_FX_ALL, &film, wo, wi, &pdf).x, 0.2f * 0.6f * PT_INV_PI));
    assert_true(near(pt_bsdf_eval(PT_FX_ALL, &film, wo, v3_neg(wi), &pdf).x, 0.6f * 0.6f * PT_INV_PI));
    /* a coat of matched index only absorbs, once each way */
    float table[PT_COAT_HEADER + 2 * PT_COAT_ROW];
    pt_coat_table_build(table, 1, 1.0f, 0.3f, 0.0f, 0.0f);
    struct pt_bsdf coat = {.kind = PT_BSDF_COATED_DIFFUSE,
                           .eta = 1.0f,
                           .thickness = 0.3f,
                           .reflectance = {0.5f, 0.5f, 0.5f},
                           .coat_table = table};
    float expected = 0.5f * PT_INV_PI * 0.6f * expf(-0.3f / 0.8f) * expf(-0.3f / 0.6f);
    assert_true(near(pt_bsdf_eval(PT_FX_ALL, &coat, wo, wi, &pdf).x, expected));
    /* and over a mirror likewise: Rc exp(-2t) at normal incidence */
    struct pt_bsdf mirror = {
        .kind = PT_BSDF_COATED_CONDUCTOR, .eta = 1.0f, .thickness = 0.3f, .eta_rgb = {1, 1, 1}, .k_rgb = {2, 2, 2}};
    assert_int_equal(pt_bsdf_sample(PT_FX_ALL, &mirror, up, 0.5f, 0, 0, &s), 1);
    assert_true(near(s.weight.x, 0.5f * expf(-0.6f))); /* k² / (4 + k²) = 1/2 */
    /* the peak of a GGX lobe: F / (4 π alpha²) at normal incidence, where nothing shadows */
    struct pt_bsdf metal = {
        .kind = PT_BSDF_CONDUCTOR, .alpha_x = 0.2f, .alpha_y = 0.5f, .eta_rgb = {1, 1, 1}, .k_rgb = {2, 2, 2}};
    assert_true(near(pt_bsdf_eval(PT_FX_ALL, &metal, up, up, &pdf).x, 0.5f / (4.0f * PT_PI * 0.1f)));
    assert_true(near(pdf, 1.0f / (4.0f * PT_PI * 0.1f)));
}

static void roughness_is_remapped_as_in_pbrt(void **state)
{
    (void)state;
    struct pt_scene scene = {0};
    struct pt_surface s = {.n_geometric = {0, 0, 1}, .n_shading = {0, 0, 1}};
    struct {
        float roughness;
        int remap;
        float alpha;
    } cases[] = {{0.25f, 1, 0.5f},  {0.25f, 0, 0.25f}, {0.0f, 1, 0.0f}, {5e-4f, 0, 0.0f},
                 {2e-3f, 0, 2e-3f}, {4.0f, 0, 1.0f},   {-1.0f, 1, 0.0f}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct pt_material m = {
            .kind = PT_BSDF_CONDUCTOR, .remap_roughness = cases[i].remap, PLAIN, ROUGH(cases[i].roughness)};
        struct pt_bsdf b;
        pt_material_bsdf(PT_FX_ALL, &scene, &m, &s, &b);
        assert_int_equal(b.kind, PT_BSDF_CONDUCTOR);
        assert_true(near(b.alpha_x, cases[i].alpha) && near(b.alpha_y, cases[i].alpha));
    }
}

static void effects_are_those_the_closure_needs(void **state)
{
    (void)state;
    struct pt_material materials[] = {
        {.kind = PT_BSDF_DIFFUSE, PLAIN, ROUGH(0.0f)},
        {.kind = PT_BSDF_CONDUCTOR, PLAIN, ROUGH(0.0f)},
        {.kind = PT_BSDF_CONDUCTOR, PLAIN, ROUGH(0.3f)},
        {.kind = PT_BSDF_DIELECTRIC, PLAIN, ROUGH(0.0f)},
        {.kind = PT_BSDF_COATED_DIFFUSE, PLAIN, ROUGH(0.1f)},
        {.kind = PT_MATERIAL_MIX, .mix_a = 0, .mix_b = 4, .mix_amount = {.texture = 1}},
        {.kind = PT_MATERIAL_INTERFACE, PLAIN},
    };
    struct pt_scene scene = {.materials = materials, .material_count = 7};
    const pt_effects expected[] = {0,
                                   PT_FX_SPECULAR,
                                   PT_FX_GLOSSY,
                                   PT_FX_TRANSMISSION | PT_FX_SPECULAR,
                                   PT_FX_COATED | PT_FX_GLOSSY,
                                   PT_FX_MIX | PT_FX_TEXTURE | PT_FX_COATED | PT_FX_GLOSSY,
                                   PT_FX_INTERFACE};
    for (int i = 0; i < 7; i++)
        assert_int_equal(pt_material_effects(&scene, i), expected[i]);
    assert_int_equal(pt_materials_build(&scene, NULL), 0);
    assert_non_null(materials[4].coat_table);
    struct pt_surface s = {.n_geometric = {0, 0, 1}, .n_shading = {0, 0, 1}};
    for (int i = 0; i < 5; i++) { /* a kernel with exactly these effects gives what the general one gives */
        struct pt_bsdf narrow, wide;
        struct pt_bsdf_sample a, b;
        pt_material_bsdf(expected[i], &scene, &materials[i], &s, &narrow);
        pt_material_bsdf(PT_FX_ALL, &scene, &materials[i], &s, &wide);
        for (float u = 0.0f; u < 1.0f; u += 0.09f) {
            pt_vec3 wo = v3_norm(v3(0.3f, 0.1f, u - 0.5f));
            int ra = pt_bsdf_sample(expected[i], &narrow, wo, u, 0.3f, u, &a),
                rb = pt_bsdf_sample(PT_FX_ALL, &wide, wo, u, 0.3f, u, &b);
            assert_int_equal(ra, rb);
            if (ra)
                assert_memory_equal(&a, &b, sizeof a);
        }
        assert_int_equal(pt_bsdf_has_smooth(expected[i], &narrow), pt_bsdf_has_smooth(PT_FX_ALL, &wide));
    }
    pt_arena_release(&scene.arena);
}

/* What models need by themselves, and what each of their parameters adds when it is a texture. */
static void effects_of_every_model(void **state)
{
    (void)state;
    static const pt_effects plain[] = {0,
                                       PT_FX_SPECULAR,
                                       PT_FX_TRANSMISSION | PT_FX_SPECULAR,
                                       PT_FX_TRANSMISSION | PT_FX_SPECULAR,
                                       PT_FX_TRANSMISSION,
                                       PT_FX_COATED | PT_FX_SPECULAR,
                                       PT_FX_COATED | PT_FX_SPECULAR};
    enum { MODELS = sizeof plain / sizeof *plain }; /* those whose parameters are not plainly colours and numbers */
    /* which of reflectance, transmittance, roughness, roughness of the base, eta, k, thickness, g, albedo it reads */
    static const char *const reads[MODELS] = {"r", "aek", "a", "", "rt", "ratgs", "abtgsek"};
    static const int coated[MODELS] = {[PT_BSDF_COATED_DIFFUSE] = 1, [PT_BSDF_COATED_CONDUCTOR] = 1};
    for (int kind = 0; kind < MODELS; kind++) {
        struct pt_material m = {.kind = kind, PLAIN, ROUGH(0.0f)};
        struct pt_scene scene = {.materials = &m, .material_count = 1};
        struct {
            char read;
            struct pt_input *in;
            pt_effects adds;
        } inputs[] = {{'r', &m.reflectance, PT_FX_TEXTURE},
                      {coated[kind] ? 0 : 't', &m.transmittance, PT_FX_TEXTURE},
                      {'a', &m.roughness_u, PT_FX_TEXTURE | PT_FX_GLOSSY | PT_FX_SPECULAR},
                      {'a', &m.roughness_v, PT_FX_TEXTURE | PT_FX_GLOSSY | PT_FX_SPECULAR},
                      {'b', &m.base_roughness_u, PT_FX_TEXTURE | PT_FX_GLOSSY | PT_FX_SPECULAR},
                      {'b', &m.base_roughness_v, PT_FX_TEXTURE | PT_FX_GLOSSY | PT_FX_SPECULAR},
                      {'e', &m.eta_rgb, PT_FX_TEXTURE},
                      {'k', &m.k_rgb, PT_FX_TEXTURE},
                      {coated[kind] ? 't' : 0, &m.thickness, PT_FX_TEXTURE},
                      {'g', &m.g, PT_FX_TEXTURE},
                      {'s', &m.albedo, PT_FX_TEXTURE}};
        assert_int_equal(pt_material_effects(&scene, 0), plain[kind]);
        for (size_t i = 0; i < sizeof inputs / sizeof *inputs; i++) {
            int is_read = inputs[i].read && strchr(reads[kind], inputs[i].read);
            inputs[i].in->texture = 1;
            assert_int_equal(pt_material_effects(&scene, 0), plain[kind] | (is_read ? inputs[i].adds : 0));
            inputs[i].in->texture = 0;
        }
        m.conductor_by_colour = 1;
        m.eta_rgb.texture = m.k_rgb.texture = 1;
        assert_int_equal(pt_material_effects(&scene, 0), plain[kind]);
        m.reflectance.texture = 1;
        int by_colour = strchr(reads[kind], 'r') || strchr(reads[kind], 'e');
        assert_int_equal(pt_material_effects(&scene, 0), plain[kind] | (by_colour ? PT_FX_TEXTURE : 0));
        m.reflectance.texture = 0;
        for (int which = 0; which < 2; which++) {
            *(which ? &m.bump : &m.normal_map) = 1;
            assert_int_equal(pt_material_effects(&scene, 0), plain[kind] | PT_FX_BUMP | PT_FX_TEXTURE);
            *(which ? &m.bump : &m.normal_map) = 0;
        }
        for (int remap = 0; remap < 2; remap++) { /* from alpha 1e-3 on it is rough */
            m.remap_roughness = remap;
            m.roughness_v.value.x = remap ? 0.98e-6f : 0.98e-3f;
            assert_int_equal(pt_material_effects(&scene, 0), plain[kind]);
            m.roughness_v.value.x = remap ? 1.02e-6f : 1e-3f;
            pt_effects rough = !strchr(reads[kind], 'a') ? plain[kind]
                               : kind == PT_BSDF_COATED_CONDUCTOR
                                   ? plain[kind] | PT_FX_GLOSSY
                                   : (plain[kind] & ~(pt_effects)PT_FX_SPECULAR) | PT_FX_GLOSSY;
            assert_int_equal(pt_material_effects(&scene, 0), rough);
            m.roughness_v.value.x = 0;
        }
    }
}

static void coatings_share_tables(void **state)
{
    (void)state;
    struct pt_material materials[] = {
        {.kind = PT_BSDF_COATED_DIFFUSE, PLAIN, ROUGH(0.1f)},
        {.kind = PT_BSDF_COATED_DIFFUSE, PLAIN, ROUGH(0.1f)},
        {.kind = PT_BSDF_COATED_DIFFUSE, PLAIN, ROUGH(0.2f)},
    };
    materials[1].reflectance.value = v3(2.0f, -1.0f, 0.5f);
    struct pt_scene scene = {.materials = materials, .material_count = 3};
    assert_int_equal(pt_materials_build(&scene, NULL), 0);
    assert_ptr_equal(materials[0].coat_table, materials[1].coat_table);
    assert_ptr_not_equal(materials[0].coat_table, materials[2].coat_table);
    assert_true(materials[1].reflectance.value.x == 1.0f && materials[1].reflectance.value.y == 0.0f);
    pt_arena_release(&scene.arena);
}

static void mixes_choose_by_amount(void **state)
{
    (void)state;
    struct pt_material materials[] = {
        {.kind = PT_BSDF_DIFFUSE, PLAIN, ROUGH(0.0f)},
        {.kind = PT_BSDF_CONDUCTOR, PLAIN, ROUGH(0.0f)},
        {.kind = PT_MATERIAL_MIX, .mix_a = 0, .mix_b = 1, .mix_amount = CONST(0.25f)},
        {.kind = PT_MATERIAL_MIX, .mix_a = 2, .mix_b = 1, .mix_amount = CONST(0.5f)},
        {.kind = PT_MATERIAL_MIX, .mix_a = 0, .mix_b = 1, .mix_amount = CONST(1.0f)},
        {.kind = PT_MATERIAL_MIX, .mix_a = 1, .mix_b = 2, .mix_amount = CONST(0.5f)},
    };
    struct pt_scene scene = {.materials = materials, .material_count = 6};
    struct pt_surface s = {0};
    int metal = 0, all = 0, other = 0;
    for (int i = 0; i < 1000; i++) {
        float u = ((float)i + 0.5f) / 1000.0f;
        metal += pt_material_resolve(PT_FX_ALL, &scene, 3, &s, u) == &materials[1];
        other += pt_material_resolve(PT_FX_ALL, &scene, 5, &s, u) == &materials[1];
        all += pt_material_resolve(PT_FX_ALL, &scene, 4, &s, u) == &materials[1];
    }
    assert_true(metal >= 623 && metal <= 627); /* 0.5 + 0.5 · 0.25 */
    assert_true(other >= 623 && other <= 627); /* nested in the second place too */
    assert_int_equal(all, 1000);
}

/* A displacement that rises along u tips the normal against it, by the angle of the slope; sides stay sides. */
static void bump_tips_the_normal(void **state)
{
    (void)state;
    static const float slope[2] = {0.0f, 0.5f};
    struct pt_image_map image = {
        .width = 2, .height = 1, .channels = 1, .type = PT_PIXEL_FLOAT, .gamma = 1, .pixels = slope};
    struct pt_texture texture = {
        .kind = PT_TEXTURE_IMAGE, .wrap = PT_WRAP_CLAMP, .scale = 1, .su = 0.1f, .sv = 0.1f, .du = 0.4f};
    struct pt_scene scene = {.images = &image, .textures = &texture, .image_count = 1, .texture_count = 1};
    struct pt_material m = {.kind = PT_BSDF_DIFFUSE, PLAIN, ROUGH(0.0f)};
    m.bump = 1;
    /* height = 0.5 · (2 · (0.1 u + 0.4) - 0.5) between the texel centres: slope 0.1 per u; 2 scene units per u */
    for (int side = -1; side <= 1; side += 2) {
        struct pt_surface s = {.u = 0.0f,
                               .v = 0.0f,
                               .n_geometric = {0, 0, (float)side},
                               .n_shading = {0, 0, (float)side},
                               .dpdu = {2, 0, 0},
                               .dpdv = {0, 2, 0}};
        struct pt_frame f = pt_material_frame(PT_FX_ALL, &scene, &m, &s);
        /* one texel of step leaves the ramp half-way: a secant */
        assert_true(f.n.z * (float)side > 0.9f && f.n.x < 0.0f && fabsf(f.n.y) < 1e-6f);
        assert_true(fabsf(v3_dot(f.s, f.n)) < 1e-6f && fabsf(v3_len(f.s) - 1.0f) < 1e-6f);
        pt_vec3 t = v3_cross(f.n, f.s);
        assert_true(fabsf(t.x - f.t.x) + fabsf(t.y - f.t.y) + fabsf(t.z - f.t.z) < 1e-6f);
    }
}

static void normal_maps_are_in_tangent_space(void **state)
{
    (void)state;
    static const float texel[3] = {0.8f, 0.5f, 0.9f}; /* (0.6, 0, 0.8) */
    struct pt_image_map image = {
        .width = 1, .height = 1, .channels = 3, .type = PT_PIXEL_FLOAT, .gamma = 1, .pixels = texel};
    struct pt_texture texture = {.kind = PT_TEXTURE_IMAGE, .wrap = PT_WRAP_REPEAT, .scale = 1, .su = 1, .sv = 1};
    struct pt_scene scene = {.images = &image, .textures = &texture, .image_count = 1, .texture_count = 1};
    struct pt_material m = {.kind = PT_BSDF_DIFFUSE, PLAIN, ROUGH(0.0f)};
    m.normal_map = 1;
    struct pt_surface s = {.n_geometric = {0, 1, 0}, .n_shading = {0, 1, 0}, .dpdu = {0, 0, 3}, .dpdv = {3, 0, 0}};
    pt_vec3 n = pt_material_frame(PT_FX_ALL, &scene, &m, &s).n;
    assert_true(near(n.x, 0.0f) && near(n.y, 0.8f) && near(n.z, 0.6f));
    s.dpdu = v3_splat(0.0f); /* no tangent: the plain normal, not NaN */
    assert_true(v3_is_finite(pt_material_frame(PT_FX_ALL, &scene, &m, &s).n));
}

/* Red tips the normal the way u grows and green the way v grows: also where texture coordinates or shapes are mirrored, and on the
 * side that ReverseOrientation chooses. */
static void normal_maps_follow_mirrored_coordinates(void **state)
{
    (void)state;
    static const float texel[3] = {0.5f * (1.0f + 0.48f), 0.5f * (1.0f + 0.64f), 0.8f}; /* (0.48, 0.64, 0.6) */
    struct pt_image_map image = {
        .width = 1, .height = 1, .channels = 3, .type = PT_PIXEL_FLOAT, .gamma = 1, .pixels = texel};
    struct pt_texture texture = {.kind = PT_TEXTURE_IMAGE, .wrap = PT_WRAP_REPEAT, .scale = 1, .su = 1, .sv = 1};
    struct pt_scene scene = {.images = &image, .textures = &texture, .image_count = 1, .texture_count = 1};
    struct pt_material m = {.kind = PT_BSDF_DIFFUSE, PLAIN, ROUGH(0.0f)};
    m.normal_map = 1;
    for (int k = 0; k < 8; k++) {
        float u = k & 1 ? -1.0f : 1.0f, v = k & 2 ? -1.0f : 1.0f, side = k & 4 ? -1.0f : 1.0f;
        struct pt_surface s = {
            .n_geometric = {0, 0, side}, .n_shading = {0, 0, side}, .dpdu = {3 * u, 0, 0}, .dpdv = {u, 2 * v, 0}};
        pt_vec3 n = pt_material_frame(PT_FX_ALL, &scene, &m, &s).n;
        assert_true(near(n.x, 0.48f * u) && near(n.y, 0.64f * v) && near(n.z, 0.6f * side));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fresnel_of_glass),
        cmocka_unit_test(fresnel_of_metal),
        cmocka_unit_test(models_have_their_closed_forms),
        cmocka_unit_test(roughness_is_remapped_as_in_pbrt),
        cmocka_unit_test(effects_are_those_the_closure_needs),
        cmocka_unit_test(effects_of_every_model),
        cmocka_unit_test(coatings_share_tables),
        cmocka_unit_test(mixes_choose_by_amount),
        cmocka_unit_test(bump_tips_the_normal),
        cmocka_unit_test(normal_maps_are_in_tangent_space),
        cmocka_unit_test(normal_maps_follow_mirrored_coordinates),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
