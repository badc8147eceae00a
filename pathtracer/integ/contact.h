/*
 * Surfaces at one place. A glass that stands on a floor has its lowest face where the floor is: rounding decides which of
 * the two a ray meets first, and a ray that leaves one of them (geom/offset.h) begins beyond the other. So they are taken
 * together. Where a path meets a surface that touches others, all that lie there are found and put in order, as if there
 * were a small gap between them; from there the path goes up and down in that list, and no ray is traced until it leaves it
 * at one of the ends, off the last surface. Shadow rays leave the same way, or not at all. Alpha, interfaces and media are
 * crossed in the list as they are on a ray.
 *
 * Seen along the ray come first the solids that it leaves, then sheets, what is opaque, and the solids that it enters: glass
 * before the floor that it stands on, from within, and the floor before the glass, from below. A sheet (what lets rays
 * through and has no inside) covers the opaque from both sides.
 *
 * Which surfaces touch is found once, when the scene is built. A scene where none do has no PT_FX_CONTACT, and its kernel
 * nothing of this.
 *
 * Pure, any thread may call it; but pt_contacts_find, which builds.
 */
#ifndef PT_INTEG_CONTACT_H
#define PT_INTEG_CONTACT_H

#include "integ/surface.h"

/* More at one place than these are left out. */
enum { PT_CONTACTS = 8 };

struct pt_contact {
    int32_t count;                   /* of the surfaces; 0: the path is at no such place */
    int32_t at;                      /* the one that the path is at, or meets next */
    int32_t step;                    /* 1: along `ray`, -1: against it */
    int32_t turned;                  /* the path has left `ray` */
    struct pt_ray ray;               /* that has met them, … */
    struct pt_hit hits[PT_CONTACTS]; /* … in this order, … */
    struct pt_hit beyond;            /* … and what it meets behind them */
};

/* Whether other surfaces may be at the point p of the shape. */
static inline int pt_contact_near(const struct pt_shape *shape, pt_vec3 p)
{
    pt_vec3 a = shape->touch_least, b = shape->touch_most;
    return shape->touches && p.x >= a.x && p.x <= b.x && p.y >= a.y && p.y <= b.y && p.z >= a.z && p.z <= b.z;
}

/* Whether they may be where the ray has met a surface. */
static inline int pt_contact_at(const struct pt_scene *scene, const struct pt_ray *ray, const struct pt_hit *hit)
{
    const struct pt_shape *shape = &scene->shapes[hit->shape];
    return shape->touches && pt_contact_near(shape, v3_madd(ray->origin, hit->t, ray->direction));
}

/* Finds what lies where `ray`, in `medium`, has met *hit, a surface that touches others. If there is more: *hit becomes the
 * first of all, and `ray` and `passed` what goes on behind the last. Else contact->count is 0 and nothing else has changed.
 * How many queries that took. */
uint32_t pt_contact_gather(const struct pt_scene *scene, int32_t medium, struct pt_ray *ray, struct pt_passed *passed,
                           struct pt_hit *hit, struct pt_contact *contact);

/* Surface i of the list. */
static inline void pt_contact_place(const struct pt_scene *scene, const struct pt_contact *contact, int32_t i,
                                    struct pt_place *at)
{
    pt_place_at_hit(PT_FX_ALL, scene, &contact->ray, &contact->hits[i], at);
}

/* 1 or -1: whether w, from a surface of the list with normal n, leads down the list or up. */
static inline int32_t pt_contact_step(const struct pt_contact *contact, pt_vec3 n, pt_vec3 w)
{
    return v3_dot(w, n) * v3_dot(contact->ray.direction, n) > 0.0f ? 1 : -1;
}

/* Where a ray towards w begins that goes from p, at a surface of the list, off the last surface that `step` leads to. */
pt_vec3 pt_contact_origin(const struct pt_scene *scene, const struct pt_contact *contact, pt_vec3 p, int32_t step,
                          pt_vec3 w);

/* Sets `touches` and `layer` of the scene's shapes, and PT_FX_CONTACT if any do; builds the acceleration structure anew
 * then. To be called after pt_accel_build. On failure there is no acceleration structure. */
int pt_contacts_find(struct pt_scene *scene, struct base_err *err);

#endif
