#include "integ/contact.h"

#include "integ/borders.h"

/* What decides the order, of each surface of a list. */
struct layer {
    float t, error;   /* bound on the rounding of its place, along the normal */
    int32_t rank;     /* the larger is met before */
    int32_t from, to; /* media along the ray */
    pt_vec3 n;
};

static struct layer layer_of(const struct pt_place *at, pt_vec3 direction, float t)
{
    pt_vec3 n = at->s.n_geometric;
    int leaves = v3_dot(direction, n) > 0.0f;
    int32_t rank = at->shape->layer == PT_LAYER_SOLID ? (leaves ? 3 : 0) : at->shape->layer == PT_LAYER_SHEET ? 2 : 1;
    int32_t from = leaves ? at->shape->medium_in : at->shape->medium_out,
            to = leaves ? at->shape->medium_out : at->shape->medium_in;
    return (struct layer){t, v3_dot(v3_abs(n), at->error), rank, from, to, n};
}

/* Whether b, which comes next on the ray, is within `share` of the bounds of their rounding. */
static int together(const struct layer *a, const struct layer *b, pt_vec3 direction, float share)
{
    return fabsf(v3_dot(a->n, b->n)) > PT_PLACE_PARALLEL &&
           (b->t - a->t) * fabsf(v3_dot(b->n, direction)) <= share * (a->error + b->error);
}

/* Whether b is the triangle beside a, met on their edge. */
static int same_surface(const struct pt_hit *a, const struct pt_hit *b, const struct layer *la, const struct layer *lb)
{
    return a->shape == b->shape && a->instance == b->instance && v3_dot(la->n, lb->n) > PT_PLACE_PARALLEL;
}

/* Of solids of one rank next comes always one that begins in the medium that the ray is in. */
static void order_by_media(int32_t medium, struct layer *layers, struct pt_contact *contact)
{
    for (int32_t i = 0; i < contact->count; i++) {
        int32_t next = i;
        for (int32_t k = contact->count - 1; k >= i; k--)
            if (layers[k].rank == layers[i].rank && layers[k].from == medium)
                next = k;
        if (layers[i].from == layers[i].to)
            next = i;
        struct pt_hit hit = contact->hits[next];
        struct layer layer = layers[next];
        for (int32_t k = next; k > i; k--) {
            contact->hits[k] = contact->hits[k - 1];
            layers[k] = layers[k - 1];
        }
        contact->hits[i] = hit;
        layers[i] = layer;
        if (layer.from != layer.to)
            medium = layer.to;
    }
}

uint32_t pt_contact_gather(const struct pt_scene *scene, int32_t medium, struct pt_ray *ray, struct pt_passed *passed,
                           struct pt_hit *hit, struct pt_contact *contact)
{
    const pt_vec3 d = ray->direction;
    const float t_min = ray->t_min;
    const uint32_t passed_before = passed->count;
    struct layer layers[PT_CONTACTS], last = {0}; /* the last along the ray, which the order may have moved */
    uint32_t queries = 0;
    contact->ray = *ray;
    contact->beyond = *hit;
    for (contact->count = 0;;) {
        struct pt_place at;
        pt_place_at_hit(PT_FX_ALL, scene, ray, &contact->beyond, &at);
        struct layer next = layer_of(&at, d, contact->beyond.t);
        if (contact->count && !together(&last, &next, d, 1.0f))
            break;
        int32_t k = contact->count;
        int again = 0;
        for (int32_t i = 0; i < k; i++)
            again |= together(&layers[i], &next, d, PT_PLACE_SHARE) &&
                     same_surface(&contact->hits[i], &contact->beyond, &layers[i], &next);
        if (k < PT_CONTACTS && !again) {
            for (; k > 0 && layers[k - 1].rank < next.rank && together(&layers[k - 1], &next, d, PT_PLACE_SHARE); k--) {
                layers[k] = layers[k - 1];
                contact->hits[k] = contact->hits[k - 1];
            }
            layers[k] = next;
            contact->hits[k] = contact->beyond;
            contact->count++;
        }
        last = next;
        pt_ray_pass(ray, passed, &contact->beyond);
        queries++;
        if (!pt_accel_intersect_behind(scene, ray, passed, &contact->beyond))
            break;
    }
    contact->at = 0;
    contact->step = 1;
    contact->turned = 0;
    if (contact->count == 1) {
        contact->count = 0;
        ray->t_min = t_min;
        passed->count = passed_before;
    } else {
        order_by_media(medium, layers, contact);
        *hit = contact->hits[0];
    }
    return queries;
}

pt_vec3 pt_contact_origin(const struct pt_scene *scene, const struct pt_contact *contact, pt_vec3 p, int32_t step, pt_vec3 w)
{
    struct pt_place end;
    pt_contact_place(scene, contact, step > 0 ? contact->count - 1 : 0, &end);
    pt_vec3 n = end.s.n_geometric;
    return pt_offset_point(v3_madd(p, v3_dot(n, v3_sub(end.p, p)), n), n, end.error, w);
}
