/*
 * Surfaces that let a ray through and bound media. Where several lie at one place (a box of fog on a floor, two boxes side
 * by side) rounding decides which of them a ray meets first: they are taken together, and the media tell the order. Glass
 * among them: integ/contact.h. Inline, pure.
 */
#ifndef PT_INTEG_BORDERS_H
#define PT_INTEG_BORDERS_H

#include "integ/surface.h"

/* Two surfaces are at one place when they are parallel and their distances differ by less than this share of the bounds on
 * the rounding of their points: a sixth of a millionth of the coordinates, where thin layers are still layers. */
#define PT_PLACE_SHARE 0.2f
#define PT_PLACE_PARALLEL 0.999f

/* More at one place than these are left out. */
enum { PT_BORDERS = 8 };

struct pt_borders {
    int32_t count;
    float t, slack; /* of the first: where along the ray, and the rounding of that */
    pt_vec3 n;
    struct {
        int32_t from, to; /* media along the ray */
        int32_t leaves;   /* the ray comes from within the shape */
    } of[PT_BORDERS];
};

static inline float pt_place_slack(const struct pt_place *at, pt_vec3 direction)
{
    pt_vec3 n = at->s.n_geometric;
    return PT_PLACE_SHARE * v3_dot(v3_abs(n), at->error) / fabsf(v3_dot(n, direction));
}

/* Whether the surface `at`, met at t behind the first border, is at its place. */
static inline int pt_borders_at(const struct pt_borders *borders, const struct pt_place *at, pt_vec3 direction, float t)
{
    return fabsf(v3_dot(borders->n, at->s.n_geometric)) > PT_PLACE_PARALLEL &&
           t - borders->t <= borders->slack + pt_place_slack(at, direction);
}

static inline void pt_borders_add(struct pt_borders *borders, const struct pt_place *at, pt_vec3 direction, float t)
{
    const struct pt_shape *shape = at->shape;
    int leaves = v3_dot(direction, at->s.n_geometric) > 0.0f, k = borders->count;
    if (k == 0) {
        borders->t = t;
        borders->slack = pt_place_slack(at, direction);
        borders->n = at->s.n_geometric;
    }
    if (k == PT_BORDERS)
        return;
    borders->of[k].from = leaves ? shape->medium_in : shape->medium_out;
    borders->of[k].to = leaves ? shape->medium_out : shape->medium_in;
    borders->of[k].leaves = leaves;
    borders->count++;
}

/* The medium behind all of them; there are none afterwards. Next comes always one that begins in the medium that the ray is
 * in, and shapes are left before others are entered. */
static inline int32_t pt_borders_cross(struct pt_borders *borders, int32_t medium)
{
    while (borders->count > 0) {
        int32_t next = 0, best = -1;
        for (int32_t i = 0; i < borders->count; i++) {
            int32_t rank = 2 * (borders->of[i].from == medium) + borders->of[i].leaves;
            if (rank > best) {
                best = rank;
                next = i;
            }
        }
        medium = borders->of[next].to;
        borders->count--;
        for (int32_t i = next; i < borders->count; i++)
            borders->of[i] = borders->of[i + 1];
    }
    return medium;
}

#endif
