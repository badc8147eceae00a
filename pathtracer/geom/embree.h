#ifndef PT_GEOM_EMBREE_H
#define PT_GEOM_EMBREE_H
/*
 * Embree 3 or 4, for accel.c only: PT_EMBREE, which the Makefile says, is the one that is included, and these functions are
 * what the two are asked differently. Rays are the caller's, a packet of n = 1, 4, 8 or 16 in Embree's order, of which
 * those take part that are -1 in valid[n]. Any number of threads may ask a committed scene.
 */
#if PT_EMBREE == 4
#include <embree4/rtcore.h>

/* What callbacks are given: `left_out` is for them and for a filter, NULL: nothing is. */
struct pt_embree_context {
    struct RTCRayQueryContext embree;
    const void *left_out;
};

/* The arguments of a query, by which Embree 4 is told what 3 had in the context. */
#define PT_EMBREE_ARGUMENTS(kind, coherent) \
    struct pt_embree_context context; \
    struct RTC##kind##Arguments query; \
    rtcInitRayQueryContext(&context.embree); \
    context.left_out = NULL; \
    rtcInit##kind##Arguments(&query); \
    query.context = &context.embree; \
    query.flags = (coherent) ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT
#define PT_EMBREE_ASK(function, rays, ...) function(__VA_ARGS__, rays, &query)
/* Of a scene that is asked with a filter. */
#define PT_EMBREE_FLAG_FILTER RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS
/* All hits of triangles, not only of geometries that ask for it. */
#define PT_EMBREE_FILTER(function) query.filter = (function), query.flags |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER
#else
#include <embree3/rtcore.h>

struct pt_embree_context {
    struct RTCIntersectContext embree;
    const void *left_out;
};

#define PT_EMBREE_ARGUMENTS(kind, coherent) \
    struct pt_embree_context context; \
    rtcInitIntersectContext(&context.embree); \
    context.left_out = NULL; \
    context.embree.flags = (coherent) ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT
#define PT_EMBREE_ASK(function, rays, ...) function(__VA_ARGS__, &context.embree, rays)
#define PT_EMBREE_FLAG_FILTER RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION
#define PT_EMBREE_FILTER(function) context.embree.filter = (function)
#endif

/* One ray; `filter` clears *valid of triangles that are not to be hit. */
static inline void pt_embree_intersect1_filtered(RTCScene scene, void *ray, RTCFilterFunctionN filter, const void *left_out)
{
    PT_EMBREE_ARGUMENTS(Intersect, 0);
    context.left_out = left_out;
    PT_EMBREE_FILTER(filter);
    PT_EMBREE_ASK(rtcIntersect1, (struct RTCRayHit *)ray, scene);
}

/* Neighbours that are `coherent` go the same way through the scene. */
static inline void pt_embree_intersect(RTCScene scene, int n, const int *valid, void *rays, int coherent)
{
    PT_EMBREE_ARGUMENTS(Intersect, coherent);
    if (n == 16)
        PT_EMBREE_ASK(rtcIntersect16, (struct RTCRayHit16 *)rays, valid, scene);
    else if (n == 8)
        PT_EMBREE_ASK(rtcIntersect8, (struct RTCRayHit8 *)rays, valid, scene);
    else if (n == 4)
        PT_EMBREE_ASK(rtcIntersect4, (struct RTCRayHit4 *)rays, valid, scene);
    else
        PT_EMBREE_ASK(rtcIntersect1, (struct RTCRayHit *)rays, scene);
}

static inline void pt_embree_occluded(RTCScene scene, int n, const int *valid, void *rays)
{
    PT_EMBREE_ARGUMENTS(Occluded, 0);
    if (n == 16)
        PT_EMBREE_ASK(rtcOccluded16, (struct RTCRay16 *)rays, valid, scene);
    else if (n == 8)
        PT_EMBREE_ASK(rtcOccluded8, (struct RTCRay8 *)rays, valid, scene);
    else if (n == 4)
        PT_EMBREE_ASK(rtcOccluded4, (struct RTCRay4 *)rays, valid, scene);
    else
        PT_EMBREE_ASK(rtcOccluded1, (struct RTCRay *)rays, scene);
}
#endif
