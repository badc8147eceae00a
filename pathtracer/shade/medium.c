#include "shade/medium.h"

_Thread_local unsigned long long pt_medium_queries;

/* exp(-σ t), and 1 for σ = 0 however far. */
static float beer(float sigma, float t) { return sigma > 0.0f ? expf(-sigma * t) : 1.0f; }

static pt_vec3 beer_rgb(pt_vec3 sigma, float t) { return v3(beer(sigma.x, t), beer(sigma.y, t), beer(sigma.z, t)); }

/* ∫ exp(-σ t) dt over [0, t] */
static float optical_mean(float sigma, float t) { return sigma > 0.0f ? -expm1f(-sigma * t) / sigma : t; }

int pt_media_build(struct pt_scene *scene, struct base_err *err)
{
    for (int32_t i = 0; i < scene->medium_count; i++) {
        struct pt_medium *m = &scene->media[i];
        if (m->kind == PT_MEDIUM_GRID) {
            int rc = pt_medium_grid_build(m, &scene->arena, err);
            if (rc)
                return rc;
        }
    }
    return 0;
}

/* One channel is chosen uniformly and gives the distance; the weight is the balance heuristic over the three (one-sample
 * MIS), so grey media have constant weights. */
static void homogeneous_sample(const struct pt_medium *m, float t_max, struct pt_rng *rng, struct pt_medium_event *event)
{
    pt_vec3 sigma_t = v3_add(m->sigma_a, m->sigma_s);
    event->emitted = v3_splat(0.0f);
    if (!v3_is_black(m->emission))
        event->emitted = v3(m->emission.x * optical_mean(sigma_t.x, t_max), m->emission.y * optical_mean(sigma_t.y, t_max),
                            m->emission.z * optical_mean(sigma_t.z, t_max));
    event->scattered = 0;
    event->t = t_max;
    if (v3_is_black(m->sigma_s)) {
        event->weight = beer_rgb(sigma_t, t_max);
        return;
    }
    float u = 3.0f * pt_rng_float(rng);
    float sigma = u < 1.0f ? sigma_t.x : u < 2.0f ? sigma_t.y : sigma_t.z;
    float t = sigma > 0.0f ? -log1pf(-pt_rng_float(rng)) / sigma : INFINITY;
    if (t < t_max) {
        pt_vec3 tr = beer_rgb(sigma_t, t);
        float pdf = v3_mean(v3_mul(sigma_t, tr));
        event->scattered = 1;
        event->t = t;
        event->weight = pdf > 0.0f ? v3_scale(v3_mul(m->sigma_s, tr), 1.0f / pdf) : v3_splat(0.0f);
    } else {
        pt_vec3 tr = beer_rgb(sigma_t, t_max);
        float p = v3_mean(tr);
        event->weight = p > 0.0f ? v3_scale(tr, 1.0f / p) : v3_splat(0.0f);
    }
}

void pt_medium_sample_distance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                               struct pt_rng *rng, struct pt_medium_event *event)
{
    pt_medium_queries++;
    if (medium->kind == PT_MEDIUM_GRID)
        pt_medium_grid_sample(medium, origin, direction, t_max, rng, event);
    else
        homogeneous_sample(medium, t_max, rng, event);
}

pt_vec3 pt_medium_transmittance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                                struct pt_rng *rng)
{
    pt_medium_queries++;
    if (medium->kind == PT_MEDIUM_GRID)
        return pt_medium_grid_transmittance(medium, origin, direction, t_max, rng);
    return beer_rgb(v3_add(medium->sigma_a, medium->sigma_s), t_max);
}
