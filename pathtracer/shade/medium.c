#include "shade/medium.h"

_Thread_local unsigned long long pt_medium_queries;

/* exp(-σ t), and 1 for σ = 0 however far. */
static float beer(float sigma, float t) { return sigma > 0.0f ? expf(-sigma * t) : 1.0f; }

static pt_vec3 beer_rgb(pt_vec3 sigma, float t) { return v3(beer(sigma.x, t), beer(sigma.y, t), beer(sigma.z, t)); }

/* ∫ emission exp(-σ t) dt over [0, t], however far: what emits absorbs. */
static float glow(float emission, float sigma, float t)
{
    return emission > 0.0f ? emission * (sigma > 0.0f ? -expm1f(-sigma * t) / sigma : t) : 0.0f;
}

int pt_media_build(struct pt_scene *scene, struct base_err *err)
{
    int rc = 0;
    for (int32_t i = 0; i < scene->medium_count && !rc; i++)
        if (scene->media[i].kind == PT_MEDIUM_GRID)
            rc = pt_medium_grid_build(&scene->media[i], &scene->arena, err);
    return rc;
}

/* One channel is chosen by its share of the path's throughput β and gives the distance; the weight is the balance heuristic
 * over the three (one-sample MIS). Then Σ β is the same behind the collision, β_c σ_c T_c / (Σ β_k σ_k T_k / Σ β), but for
 * what is absorbed. Shares that did not follow β would make of it a product of numbers up to 3. */
static void homogeneous_sample(const struct pt_medium *m, float t_max, pt_vec3 throughput, struct pt_rng *rng,
                               struct pt_medium_event *event)
{
    pt_vec3 sigma_t = v3_add(m->sigma_a, m->sigma_s);
    event->emitted = v3_splat(0.0f);
    if (!v3_is_black(m->emission))
        event->emitted = v3(glow(m->emission.x, sigma_t.x, t_max), glow(m->emission.y, sigma_t.y, t_max),
                            glow(m->emission.z, sigma_t.z, t_max));
    event->scattered = 0;
    event->t = t_max;
    if (v3_is_black(m->sigma_s)) {
        event->weight = beer_rgb(sigma_t, t_max);
        return;
    }
    const pt_vec3 share = v3_scale(throughput, 1.0f / (throughput.x + throughput.y + throughput.z));
    float u = pt_rng_float(rng);
    float sigma = u < share.x ? sigma_t.x : u < share.x + share.y ? sigma_t.y : sigma_t.z;
    float t = sigma > 0.0f ? -log1pf(-pt_rng_float(rng)) / sigma : INFINITY;
    event->scattered = t < t_max;
    event->t = event->scattered ? t : t_max;
    pt_vec3 tr = beer_rgb(sigma_t, event->t);
    float pdf = v3_dot(share, event->scattered ? v3_mul(sigma_t, tr) : tr);
    pt_vec3 value = event->scattered ? v3_mul(m->sigma_s, tr) : tr;
    event->weight = pdf > 0.0f ? v3_scale(value, 1.0f / pdf) : v3_splat(0.0f);
}

void pt_medium_sample_distance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                               pt_vec3 throughput, struct pt_rng *rng, struct pt_medium_event *event)
{
    pt_medium_queries++;
    if (medium->kind == PT_MEDIUM_GRID)
        pt_medium_grid_sample(medium, origin, direction, t_max, throughput, rng, event);
    else
        homogeneous_sample(medium, t_max, throughput, rng, event);
}

pt_vec3 pt_medium_transmittance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                                struct pt_rng *rng)
{
    pt_medium_queries++;
    if (medium->kind == PT_MEDIUM_GRID)
        return pt_medium_grid_transmittance(medium, origin, direction, t_max, rng);
    return beer_rgb(v3_add(medium->sigma_a, medium->sigma_s), t_max);
}
