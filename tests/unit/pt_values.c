/*
 * Numbers of the functions that scattering, lights, media, textures and quadrics are made of, at ordinary places and at
 * every edge: cosines of 0, total reflection, ends of intervals, directions along an axis, points inside and beside. What
 * they are is in pt_values.txt (support/approve.h says how to record). Sameness only: that the numbers are
 * right is said by stat/, and by closed forms in the other programs of unit/.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "geom/quadric.h"
#include "sample/sampler.h"
#include "shade/bsdf_dispatch.h"
#include "shade/camera.h"
#include "shade/light_select.h"
#include "shade/medium.h"
#include "support/approve.h"
#include "support/pt_bsdf_cases.h"
#include "support/pt_scenes.h"
#include "support/pt_mat34.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* --- what is told ----------------------------------------------------------------------------------------------------- */

static FILE *out;

static void number(float x) { fprintf(out, " %.7g", x == 0.0f ? 0.0 : (double)x); }
static void vector(pt_vec3 v)
{
    number(v.x);
    number(v.y);
    number(v.z);
}
static void words(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vfprintf(out, format, arguments);
    va_end(arguments);
}

/* --- optics ----------------------------------------------------------------------------------------------------------- */

static void print_fresnel(void)
{
    static const float etas[] = {0.6f, 1.0f, 1.5f, 2.4f},
                       cosines[] = {-1, -0.7f, -0.3f, -1e-3f, 0, 1e-4f, 0.2f, 0.9f, 1, 1.00001f};
    for (size_t i = 0; i < COUNT(etas); i++)
        for (size_t k = 0; k < COUNT(cosines); k++) {
            float cos_t, r = pt_fresnel_dielectric_t(cosines[k], etas[i], &cos_t);
            words("glass %g from %g:", (double)etas[i], (double)cosines[k]);
            number(r);
            number(cos_t);
            words(" metal");
            number(pt_fresnel_conductor(cosines[k], etas[i], 2.0f * (float)i));
            words("\n");
        }
    for (float r = -0.5f; r < 1.3f; r += 0.25f) {
        words("k of %g:", (double)r);
        number(pt_conductor_k_from_reflectance(r));
        words("\n");
    }
}

static void print_microfacets(void)
{
    static const float alphas[][2] = {{0.1f, 0.5f}, {1, 1}, {0.02f, 0.02f}};
    static const pt_vec3 ways[] = {{0, 0, 1}, {0.6f, 0, 0.8f}, {0, -0.96f, 0.28f}, {0.36f, 0.48f, -0.8f}, {1, 0, 0}};
    for (size_t i = 0; i < COUNT(alphas); i++)
        for (size_t k = 0; k < COUNT(ways); k++) {
            float x = alphas[i][0], y = alphas[i][1];
            words("alpha %g %g way %d:", (double)x, (double)y, (int)k);
            number(1e-3f * pt_ggx_d(ways[k], x, y));
            number(pt_ggx_stretch(ways[k], x, y));
            for (size_t j = 0; j < COUNT(ways); j++) {
                number(pt_ggx_g2_over_cos(ways[k], ways[j], x, y));
                number(pt_ggx_g2_over_g1(ways[k], ways[j], x, y));
                number(1e-3f * pt_ggx_visible_pdf(ways[k], ways[j], x, y));
            }
            vector(pt_ggx_sample_visible(ways[k], x, y, 0.3f, 0.7f));
            vector(pt_ggx_sample_visible(ways[k], x, y, 0, 0));
            vector(pt_ggx_sample_visible(ways[k], x, y, 0.9f, PT_ONE_BELOW));
            words("\n");
        }
}

static void print_warps(void)
{
    static const float us[] = {0, 0.1f, 0.1249f, 0.125f, 0.25f, 0.374f, 0.376f, 0.5f, 0.63f, 0.75f, 0.88f, PT_ONE_BELOW};
    for (size_t i = 0; i < COUNT(us); i++) {
        float s, c, x, y;
        pt_sincos_turn(us[i], &s, &c);
        words("%g:", (double)us[i]);
        number(s);
        number(c);
        vector(pt_sample_cosine(us[i], us[COUNT(us) - 1 - i]));
        vector(pt_sample_sphere(us[i], us[(i + 5) % COUNT(us)]));
        for (size_t k = 0; k < COUNT(us); k += 2) {
            pt_camera_lens_sample(us[i], us[k], &x, &y);
            number(x);
            number(y);
        }
        words("\n");
    }
}

static void print_phases(void)
{
    static const float gs[] = {-0.9999f, -0.9f, -2e-3f, -5e-4f, 0, 9e-4f, 0.5f, 0.9999f},
                       us[] = {0, 0.2f, 0.5f, 0.8f, PT_ONE_BELOW};
    const pt_vec3 wo = {0.36f, 0.48f, -0.8f};
    for (size_t i = 0; i < COUNT(gs); i++)
        for (size_t k = 0; k < COUNT(us); k++) {
            pt_vec3 wi;
            float pdf = pt_phase_sample(gs[i], wo, us[k], us[(k + 2) % COUNT(us)], &wi);
            words("g %g u %g:", (double)gs[i], (double)us[k]);
            number(fabsf(gs[i]) < 0.95f ? pdf : 1e-5f * pdf);
            vector(wi);
            number(pt_phase_eval(gs[i], wo, v3(0.6f, 0, 0.8f)));
            words("\n");
        }
}

static void print_filters(void)
{
    static const float us[] = {0, 1e-6f, 0.003f, 0.2f, 0.5f, 0.7f, 0.9999f, PT_ONE_BELOW}, half = 0.5f;
    for (int kind = 0; kind < 3; kind++)
        for (size_t k = 0; k < COUNT(us); k++) {
            struct pt_integrator s = test_integrator(1);
            float dx, dy;
            s.filter = kind;
            s.filter_x = 1.5f;
            s.filter_y = 0.75f;
            s.filter_sigma = 0.4f;
            pt_filter_sample(&s, 1, &us[k], &us[COUNT(us) - 1 - k], &dx, &dy);
            words("filter %d at %g:", kind, (double)us[k]);
            number(dx);
            number(dy);
            s.filter_x = 4.0f; /* the approximation's tail */
            pt_filter_sample(&s, 1, &us[k], &half, &dx, &dy);
            number(dx);
            words("\n");
        }
}

/* --- scattering ------------------------------------------------------------------------------------------------------- */

static struct pt_bsdf uneven(struct pt_bsdf b, float y)
{
    b.alpha_y = y;
    b.base_alpha_y = 0.5f * y;
    return b;
}

static void print_bsdf(const struct pt_bsdf *b, int index)
{
    static const pt_vec3 ways[] = {{0, 0, 1},       {0.6f, 0, 0.8f},       {0.36f, -0.48f, 0.8f}, {-0.64f, 0.768f, -0.024f},
                                   {0.8f, 0.6f, 0}, {0.48f, 0.64f, -0.6f}, {-0.6f, 0, 0.8f}};
    static const float us[][3] = {
        {0, 0, 0}, {0.03f, 0.3f, 0.6f}, {0.3f, 0.9f, 0.1f}, {0.6f, 0.5f, 0.99f}, {0.97f, 0.2f, 0.4f}};
    words("model %d of %d smooth %d transmits %d\n", index, (int)b->kind, pt_bsdf_has_smooth(PT_FX_ALL, b),
          pt_bsdf_transmits(PT_FX_ALL, b));
    for (size_t i = 0; i < COUNT(ways); i++) {
        words(" wo %d:", (int)i);
        vector(pt_bsdf_albedo(PT_FX_ALL, b, ways[i]));
        for (size_t k = 0; k < COUNT(ways); k++) {
            float pdf;
            words(" f");
            vector(pt_bsdf_eval(PT_FX_ALL, b, ways[i], ways[k], &pdf));
            number(pdf);
        }
        words("\n");
        for (size_t k = 0; k < COUNT(us); k++) {
            struct pt_bsdf_sample s = {{0, 0, 0}, {0, 0, 0}, 0, 0, 0};
            int found = pt_bsdf_sample(PT_FX_ALL, b, ways[i], us[k][0], us[k][1], us[k][2], &s);
            words("  u %d: %d", (int)k, found);
            if (found) {
                words(" %u", s.flags);
                vector(s.wi);
                vector(s.weight);
                number(s.pdf_solid);
                number(s.eta_scale);
            }
            words("\n");
        }
    }
}

static void print_bsdfs(void)
{
    const struct pt_bsdf models[] = {
        bsdf_diffuse(0.8f),
        bsdf_conductor(0, 0),
        bsdf_conductor(0.3f, 0.3f),
        bsdf_conductor(0.1f, 0.6f),
        bsdf_dielectric(0, 0, 1.5f),
        bsdf_dielectric(0, 0, 0.7f),
        bsdf_dielectric(0, 0, 1),
        bsdf_dielectric(0.2f, 0.4f, 1.5f),
        bsdf_dielectric(0.3f, 0.1f, 0.7f),
        bsdf_dielectric(0.3f, 0.3f, 1),
        bsdf_thin(1.5f),
        bsdf_thin(1),
        bsdf_diffuse_transmission(0.4f, 0.3f),
        bsdf_diffuse_transmission(0, 0.9f),
        bsdf_diffuse_transmission(0, 0),
        bsdf_coated_diffuse(0, 1.5f, 0.5f, 0.1f),
        bsdf_coated_diffuse(0.2f, 1.3f, 0.9f, 0),
        uneven(bsdf_coated_diffuse(0.05f, 1.5f, 0.2f, 0.4f), 0.3f),
        bsdf_coated_conductor(0, 0),
        bsdf_coated_conductor(0, 0.3f),
        bsdf_coated_conductor(0.2f, 0),
        uneven(bsdf_coated_conductor(0.1f, 0.2f), 0.4f),
        bsdf_scattering_coat(0, 0.9f, 1, 0.4f),
        bsdf_scattering_coat(0.3f, 0.5f, 0.2f, -0.6f),
    };
    for (size_t i = 0; i < COUNT(models); i++) {
        struct pt_bsdf b = models[i];
        b.walk_key = 77;
        print_bsdf(&b, (int)i);
    }
}

/* --- media ------------------------------------------------------------------------------------------------------------ */

static void print_crossing(const struct pt_medium *m, pt_vec3 origin, pt_vec3 direction, float t_max, uint32_t key)
{
    struct pt_rng rng = pt_rng_make(key), other = pt_rng_make(key + 100);
    struct pt_medium_event e;
    pt_medium_sample_distance(m, origin, direction, t_max, v3_splat(1.0f), &rng, &e);
    words(" %d", e.scattered);
    number(isfinite(e.t) ? e.t : -1.0f);
    vector(e.weight);
    vector(e.emitted);
    vector(pt_medium_transmittance(m, origin, direction, t_max, &other));
    words("\n");
}

static void print_media(void)
{
    static const float inf = INFINITY;
    const struct pt_medium media[] = {
        {.sigma_a = {0.5f, 1, 0}, .emission = {1, 2, 3}},
        {.sigma_s = {0.5f, 1, 0}},
        {.sigma_a = {0.1f, 0.2f, 0.3f}, .sigma_s = {1, 2, 3}},
        {.sigma_a = {1e-4f, 0, 2}, .sigma_s = {0, 0, 0}, .emission = {1, 1, 1}},
        {.sigma_a = {3, 2, 1}, .sigma_s = {1, 1, 1}, .emission = {0.5f, 0.2f, 0}},
    };
    const float ends[] = {0, 0.01f, 1, 5, inf};
    for (size_t i = 0; i < COUNT(media); i++)
        for (size_t k = 0; k < COUNT(ends); k++)
            for (uint32_t key = 1; key < 5; key++) {
                words("medium %d end %d:", (int)i, (int)k);
                print_crossing(&media[i], v3(0, 0, 0), v3(0, 0, 1), ends[k], key);
            }
}

static void print_grids(void)
{
    static float density[40 * 3 * 2];
    static const pt_vec3 origins[] = {{-1, 0.5f, 0.5f}, {0.5f, 0.5f, 0.5f}, {3, 0.3f, 2}, {0, 0, 0}, {2, 1.5f, -1}};
    static const pt_vec3 ways[] = {{1, 0, 0},           {-1, 0, 0}, {0, 0, 1}, {0.6f, 0, 0.8f}, {-0.36f, -0.48f, -0.8f},
                                   {0.36f, 0.48f, 0.8f}};
    struct pt_arena arena = {0};
    struct pt_rng rng = pt_rng_make(5);
    struct pt_medium m = {.kind = PT_MEDIUM_GRID,
                          .g = 0.2f,
                          .sigma_a = {0.2f, 0.4f, 0.6f},
                          .sigma_s = {2, 1.5f, 1},
                          .emission = {0.3f, 0.2f, 0.1f},
                          .nx = 40,
                          .ny = 3,
                          .nz = 2,
                          .density = density,
                          .from_render = {{0.25f, 0, 0, 0, 0, 0.5f, 0.1f, 0, 0, -0.1f, 0.5f, 0.2f}}};
    for (size_t i = 0; i < COUNT(density); i++)
        density[i] = i % 7 == 0 ? 0.0f : 2.0f * pt_rng_float(&rng);
    assert_int_equal(pt_medium_grid_build(&m, &arena, NULL), 0);
    words("majorants %d %d %d:", m.mx, m.my, m.mz);
    for (int i = 0; i < m.mx * m.my * m.mz; i++)
        number(m.majorant[i]);
    words("\n");
    for (int i = 0; i < 60; i++) {
        pt_vec3 p = v3((float)(i % 5) * 0.25f, (float)(i / 5 % 4) / 3.0f, (float)(i / 20) * 0.5f);
        words("density %d:", i);
        number(pt_medium_density(&m, p));
        number(pt_medium_density(&m, v3_add(p, v3(0.013f, -0.02f, 0.1f))));
        words("\n");
    }
    for (size_t i = 0; i < COUNT(origins) * COUNT(ways); i++)
        for (uint32_t key = 1; key < 7; key++) {
            words("ray %d:", (int)i);
            print_crossing(&m, origins[i % COUNT(origins)], ways[i / COUNT(origins)], key % 3 == 0 ? 1.2f : INFINITY, key);
        }
    pt_arena_release(&arena);
}

/* --- quadrics --------------------------------------------------------------------------------------------------------- */

/* Whole and cut ones, each under a turn with a stretch and a mirror. */
static struct pt_quadric quadric(int k)
{
    struct pt_quadric q = {.kind = k % 3,
                           .radius = 1.25f,
                           .z_min = -1.25f,
                           .z_max = 1.25f,
                           .phi_max = 2.0f * PT_PI,
                           .to_render = {{1.2f, 0.3f, 0, 0.5f, -0.2f, 0.9f, 0.4f, -0.25f, 0.1f, -0.5f, 1.1f, 2}}};
    if (k >= 6)
        for (int i = 0; i < 3; i++)
            q.to_render.m[4 * i + 1] *= -1.0f;
    if (k >= 3) {
        q.phi_max = 4.0f;
        q.z_min = -0.5f;
        q.z_max = 0.75f;
    }
    if (q.kind == PT_QUADRIC_DISK) {
        q.z_max = q.z_min;
        q.inner_radius = k >= 3 ? 0.25f : 0.0f;
    }
    assert_int_equal(pt_mat34_invert(&q.to_render, &q.from_render), 1);
    return q;
}

static void print_point(const struct pt_quadric *q, pt_vec3 own)
{
    struct pt_quadric_point at;
    float u, v;
    pt_vec3 du, dv;
    pt_quadric_at(q, own, &at);
    pt_quadric_uv(q, own, &u, &v, &du, &dv);
    vector(at.p);
    vector(at.n);
    vector(v3_scale(at.error, 1e6f));
    number(u);
    number(v);
    vector(du);
    vector(dv);
}

static void print_quadrics(void)
{
    static const pt_vec3 from[] = {{0.5f, -0.25f, 2}, {-4, 0.1f, 2.2f}, {0.6f, 5, 1.9f}, {0.3f, -0.4f, -3}},
                         ways[] = {{0, 0, 1}, {1, 0.05f, -0.1f}, {0, -1, 0.02f}, {0.1f, 0.02f, 0.9f}, {-0.3f, 0.5f, -0.8f}};
    static const float ends[][2] = {{0, INFINITY}, {0, 3}, {3, INFINITY}};
    for (int k = 0; k < 9; k++) {
        struct pt_quadric q = quadric(k);
        pt_vec3 lower, upper;
        pt_quadric_bounds(&q, &lower, &upper);
        words("quadric %d area", k);
        number((float)pt_light_quadric_area(&q));
        vector(lower);
        vector(upper);
        words("\n poles");
        print_point(&q, v3(0, 0, 1.25f));
        print_point(&q, v3(0, 0, -1.25f));
        words("\n");
        for (size_t i = 0; i < COUNT(from) * COUNT(ways) * COUNT(ends); i++) {
            const float *end = ends[i % COUNT(ends)];
            float t;
            pt_vec3 own;
            if (!pt_quadric_intersect(&q, from[i / COUNT(ends) % COUNT(from)], ways[i / COUNT(ends) / COUNT(from)], end[0],
                                      end[1], 0, &t, &own))
                continue;
            words(" ray %d:", (int)i);
            number(t);
            vector(own);
            if (i % COUNT(ends) == 0)
                print_point(&q, own);
            words("\n");
        }
    }
}

/* --- lights ----------------------------------------------------------------------------------------------------------- */

static void add_lamps(struct pt_scene *s)
{
    int32_t black = test_add_diffuse(s, v3_splat(0.0f));
    for (int k = 0; k < 9; k++) {
        int32_t id = test_add_sphere(s, black, v3(0, 0, 0), 1.0f);
        s->quadrics[s->shapes[id].data] = quadric(k);
        s->shapes[id].flip_normal = k % 2;
        test_add_area_light(s, id, v3(1, 2, 3), k == 5);
    }
    test_add_area_light(s, test_add_sphere(s, black, v3(1, 2, 3), 0.5f), v3(3, 1, 1), 0);
    int32_t inside = test_add_sphere(s, black, v3(0, 0, 0), 9.0f);
    s->shapes[inside].flip_normal = 1;
    test_add_area_light(s, inside, v3(1, 1, 1), 0);
    test_add_area_light(s, test_add_quad(s, black, v3(-1, 3, -1), v3(2, 0.5f, 0), v3(0, 0.25f, 2)), v3(5, 4, 3), 1);
    test_add_area_light(s, test_add_quad(s, black, v3(-1, -3, -1), v3(2, 0.5f, 0), v3(0, 0.25f, 2)), v3(5, 4, 3), 0);
    const struct pt_light deltas[] = {
        {.kind = PT_LIGHT_POINT, .shape = -1, .emission = {3, 2, 1}, .position = {1, 1, -2}},
        {.kind = PT_LIGHT_SPOT,
         .shape = -1,
         .emission = {3, 2, 1},
         .position = {0, 0, -3},
         .direction = {0, 0, 1},
         .cos_total = 0.5f,
         .cos_start = 0.9f},
        {.kind = PT_LIGHT_DISTANT, .shape = -1, .emission = {1, 2, 1}, .direction = {0.6f, 0, 0.8f}}};
    for (size_t i = 0; i < COUNT(deltas); i++)
        test_add_light(s, &deltas[i]);
}

static void add_skies(struct pt_scene *s)
{
    static float pixels[2][16 * 8 * 3];
    struct pt_rng rng = pt_rng_make(2);
    for (size_t i = 0; i < COUNT(pixels[0]); i++) {
        pixels[0][i] = i / 3 % 5 == 0 ? 0.0f : pt_rng_float(&rng);
        pixels[1][i] = 3.0f * pt_rng_float(&rng);
    }
    for (int k = 0; k < 4; k++) {
        int square = k % 2;
        s->images[s->image_count] = (struct pt_image_map){square ? 8 : 16, 8, 3, PT_PIXEL_FLOAT, 1, pixels[square]};
        struct pt_light sky = {.kind = k == 3 ? PT_LIGHT_ENV_CONSTANT : PT_LIGHT_ENV_IMAGE,
                               .shape = -1,
                               .image = s->image_count++,
                               .mapping = square ? PT_ENV_EQUAL_AREA : PT_ENV_LATLONG,
                               .emission = {1, 0.5f, 2},
                               .from_render = {{0, 0.6f, 0.8f, 0, 1, 0, 0, 0, 0, 0.8f, -0.6f, 0}},
                               .has_portal = k >= 2,
                               .portal = {-1, -2, 4},
                               .portal_u = {2, 0.5f, 0},
                               .portal_v = {0.25f, 3, 1}};
        test_add_light(s, &sky);
    }
}

static void print_emitter(const struct pt_scene *s, int32_t id, const struct pt_receiver *at)
{
    static const float us[][2] = {{0, 0}, {0.2f, 0.7f}, {0.6f, 0.45f}, {0.999f, 0.3f}};
    const struct pt_emitter *e = &s->emitters[id];
    for (size_t k = 0; k < COUNT(us); k++) {
        struct pt_light_sample l = {.pixel = NULL};
        int lit = pt_light_sample_emitter(PT_FX_ALL, s, e, at->p, us[k][0], us[k][1], &l);
        words("  u %d: %d", (int)k, lit);
        if (lit) {
            vector(l.wi);
            vector(l.radiance);
            number(e->pmf * l.inv_pdf_solid);
            words(" %d %d", l.delta, l.finite);
            if (l.finite)
                vector(l.target);
            if (l.pixel)
                vector(v3(l.pixel[0], l.pixel[1], l.pixel[2]));
            const struct pt_light *light = &s->lights[e->light];
            if (light->kind == PT_LIGHT_ENV_IMAGE || light->kind == PT_LIGHT_ENV_CONSTANT) {
                number(pt_light_env_density(s, light, at->p, l.wi));
                vector(pt_light_env_eval(s, light, l.wi));
            } else if (light->kind == PT_LIGHT_AREA) {
                pt_vec3 n = e->primitive >= 0 ? e->n : v3(0, 0.6f, 0.8f);
                number(pt_light_area_pdf(PT_FX_ALL, s, &s->shapes[light->shape], e->primitive, at, l.target, n, l.wi));
            }
        }
        words("\n");
    }
}

static void print_lights(void)
{
    static const struct pt_receiver places[] = {{{0, 0, 0}, {0, 0, 1}, PT_RECEIVER_SURFACE},
                                                {{2, 3, -4}, {0, -0.6f, 0.8f}, PT_RECEIVER_BOTH_SIDES},
                                                {{0.6f, -0.3f, 2.1f}, {0, 0, 0}, PT_RECEIVER_VOLUME},
                                                {{-1, -2, 4}, {1, 0, 0}, PT_RECEIVER_SURFACE}};
    for (int skies = 0; skies < 2; skies++) {
        struct pt_scene s;
        test_scene_begin(&s);
        add_lamps(&s);
        if (skies)
            add_skies(&s);
        test_scene_finish(&s);
        for (int32_t i = 0; i < s.emitter_count; i++)
            for (size_t k = 0; k < COUNT(places) && (skies || s.light_tree); k++) {
                float u = ((float)i + 0.5f) / (float)s.emitter_count, pmf = 0.0f;
                words("emitter %d %d at %d", skies, (int)i, (int)k);
                number(s.emitters[i].pmf);
                if (s.light_tree) {
                    number(pt_light_tree_pmf(&s, &places[k], i));
                    words(" %d", (int)pt_light_tree_pick(&s, &places[k], u, &pmf));
                    number(pmf);
                }
                words(" %d\n", (int)(pt_light_pick_by_power(&s, u) - s.emitters));
                if (skies)
                    print_emitter(&s, i, &places[k]);
            }
        test_scene_end(&s);
    }
}

/* --- textures --------------------------------------------------------------------------------------------------------- */

#define CONST(v) \
    { \
        .value = { v, 2 * v, 3 * v } \
    }

static void print_textures(void)
{
    static const uint8_t bytes[4 * 3 * 4] = {3,   200, 17,  90,  255, 0,   128, 64, 33,  77,  141, 250, 9,   180, 60,  30,
                                             201, 99,  150, 44,  120, 240, 5,   70, 66,  6,   166, 106, 26,  226, 86,  186,
                                             46,  146, 216, 116, 13,  213, 113, 53, 153, 253, 93,  193, 173, 73,  233, 133};
    static const float floats[3 * 2] = {0.5f, -1, 2, 8, 0.25f, 1};
    struct pt_image_map images[] = {{4, 3, 4, PT_PIXEL_U8_SRGB, 1, bytes},      {4, 3, 3, PT_PIXEL_U8_LINEAR, 1, bytes},
                                    {4, 3, 3, PT_PIXEL_U8_LINEAR, 2.2f, bytes}, {4, 3, 1, PT_PIXEL_U8_SRGB, 1, bytes},
                                    {3, 2, 1, PT_PIXEL_FLOAT, 1, floats},       {1, 2, 3, PT_PIXEL_FLOAT, 1, floats}};
    static const float uvs[][2] = {{0, 0}, {0.3f, 0.6f}, {0.99f, 0.01f}, {-0.4f, 1.7f}, {2.6f, -3.1f}, {0.5f, 0.5f}};
    struct pt_texture t[64];
    int32_t n = 0;
    for (int image = 0; image < 6; image++)
        for (int wrap = 0; wrap < 3; wrap++)
            for (int channel = -1; channel < 4; channel += channel == 0 ? 3 : 1)
                t[n++] = (struct pt_texture){.kind = PT_TEXTURE_IMAGE,
                                             .image = image,
                                             .wrap = wrap,
                                             .channel = channel,
                                             .invert = wrap == 1 && channel == 0,
                                             .scale = 1.0f + 0.5f * (float)wrap,
                                             .su = 1.5f,
                                             .sv = -2,
                                             .du = 0.1f,
                                             .dv = 0.2f};
    t[n++] = (struct pt_texture){.kind = PT_TEXTURE_SCALE, .in = {{.texture = 2}, CONST(0.3f)}};
    t[n++] = (struct pt_texture){.kind = PT_TEXTURE_MIX, .in = {{.texture = 2}, CONST(0.3f), {.texture = 1}}};
    t[n] = (struct pt_texture){
        .kind = PT_TEXTURE_CHECKERBOARD, .su = 3, .sv = -2, .du = 0.5f, .in = {{.texture = n}, CONST(0.3f)}};
    n++;
    t[n++] = (struct pt_texture){.kind = PT_TEXTURE_BILERP,
                                 .su = 0.5f,
                                 .sv = 2,
                                 .dv = 0.25f,
                                 .in = {{.texture = 2}, CONST(0.3f), CONST(0.7f), CONST(0.2f)}};
    t[n++] = (struct pt_texture){.kind = PT_TEXTURE_CONSTANT, .in = {CONST(0.4f)}};
    struct pt_scene scene = {.images = images, .textures = t, .image_count = 6, .texture_count = n};
    for (int32_t i = 1; i <= n; i++) {
        float du, dv;
        pt_texture_step(&scene, i, &du, &dv);
        words("texture %d:", (int)i);
        number(du);
        number(dv);
        for (size_t k = 0; k < COUNT(uvs); k++)
            vector(pt_texture_eval(&scene, i, uvs[k][0], uvs[k][1]));
        words("\n");
    }
}

/* --- numbers drawn ---------------------------------------------------------------------------------------------------- */

static void print_samplers(void)
{
    for (uint32_t i = 0; i < 64; i++) {
        struct pt_sampler s = pt_sampler_make(i % 3 > 0, i / 8 * 1000003u, i * 7919u, i * i, i % 8 * 12345u);
        pt_sampler_block(&s, i % 5);
        struct pt_sample2 p = pt_sampler_2d(&s, i % 7 * 2);
        struct pt_rng rng = pt_sampler_stream(&s, i % 14);
        words("%u: %u %u", i, pt_sampler_bits(&s, i % 14), pt_rng_next(&rng));
        words(" %u\n", pt_rng_next(&rng));
        words(" %u:", i);
        number(p.x);
        number(p.y);
        number(pt_sampler_1d(&s, i % 14));
        number(pt_rng_float(&rng));
        words("\n");
    }
}

static const struct table {
    const char *name;
    void (*tell)(void);
} tables[] = {{"fresnel", print_fresnel},   {"microfacets", print_microfacets},
              {"warps", print_warps},       {"phases", print_phases},
              {"filters", print_filters},   {"models", print_bsdfs},
              {"media", print_media},       {"grids", print_grids},
              {"quadrics", print_quadrics}, {"lights", print_lights},
              {"textures", print_textures}, {"samplers", print_samplers}};

static char *tell(struct approve_case *c)
{
    char *text = NULL;
    size_t size;
    out = open_memstream(&text, &size);
    assert_non_null(out);
    c->text[strcspn(c->text, "\n")] = '\0';
    for (size_t i = 0; i < COUNT(tables); i++)
        if (strcmp(tables[i].name, c->text) == 0)
            tables[i].tell();
    fclose(out);
    return text;
}

static void values(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_values.txt", tell);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(values)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
