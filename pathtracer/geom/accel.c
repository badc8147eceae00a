#include "geom/accel.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "geom/embree.h"
#include "geom/quadric.h"
#include "geom/terminate.h"

struct pt_accel {
    RTCDevice device;
    RTCScene world;
    RTCScene *objects;      /* [object_count], owns */
    RTCGeometry *instances; /* [instance_count], borrows from `world` */
    int32_t object_count;
    int packet; /* rays that go together: the processor's own width, 1 = one by one */
    atomic_llong bytes;
};

/* --- quadrics as user geometry ---------------------------------------------------------------------------------------- */

static void quadric_bounds(const struct RTCBoundsFunctionArguments *args)
{
    pt_vec3 lower, upper;
    pt_quadric_bounds(args->geometryUserPtr, &lower, &upper);
    args->bounds_o->lower_x = lower.x;
    args->bounds_o->lower_y = lower.y;
    args->bounds_o->lower_z = lower.z;
    args->bounds_o->upper_x = upper.x;
    args->bounds_o->upper_y = upper.y;
    args->bounds_o->upper_z = upper.z;
}

/* Embree's packets of n rays are arrays of n, one after the other; in C it gives no names to them. */
union lane {
    float f;
    uint32_t u;
};
enum { ORG_X, ORG_Y, ORG_Z, TNEAR, DIR_X, DIR_Y, DIR_Z, TIME, TFAR, MASK, RAY_ID, FLAGS, RAY_FIELDS };
enum { NG_X = RAY_FIELDS, NG_Y, NG_Z, HIT_U, HIT_V, PRIM_ID, GEOM_ID, INST_ID, OUR_FIELDS };
/* Embree 4 has one more, for instances that are arrays. */
enum { FIELDS = sizeof(struct RTCRayHit16) / (16 * sizeof(union lane)) };
_Static_assert(RTC_MAX_INSTANCE_LEVEL_COUNT == 1 && (int)FIELDS >= (int)OUR_FIELDS,
               "Embree has several levels of instances");

/* Ray i of n. */
static int quadric_query(const struct pt_quadric *q, const union lane *rays, unsigned n, unsigned i, float *t,
                         pt_vec3 *p_quadric)
{
    return pt_quadric_intersect(q, v3(rays[ORG_X * n + i].f, rays[ORG_Y * n + i].f, rays[ORG_Z * n + i].f),
                                v3(rays[DIR_X * n + i].f, rays[DIR_Y * n + i].f, rays[DIR_Z * n + i].f),
                                rays[TNEAR * n + i].f, rays[TFAR * n + i].f, t, p_quadric);
}

static void quadric_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    unsigned n = args->N;
    union lane *lanes = (union lane *)args->rayhit;
    float t;
    pt_vec3 p;
    for (unsigned i = 0; i < n; i++) {
        if (!args->valid[i] || !quadric_query(args->geometryUserPtr, lanes, n, i, &t, &p))
            continue;
        lanes[TFAR * n + i].f = t;
        lanes[HIT_U * n + i].f = lanes[HIT_V * n + i].f = 0.0f;
        lanes[NG_X * n + i].f = p.x;
        lanes[NG_Y * n + i].f = p.y;
        lanes[NG_Z * n + i].f = p.z;
        lanes[GEOM_ID * n + i].u = args->geomID;
        lanes[PRIM_ID * n + i].u = args->primID;
        lanes[INST_ID * n + i].u = args->context->instID[0];
    }
}

static void quadric_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    unsigned n = args->N;
    union lane *lanes = (union lane *)args->ray;
    float t;
    pt_vec3 p;
    for (unsigned i = 0; i < n; i++)
        if (args->valid[i] && quadric_query(args->geometryUserPtr, lanes, n, i, &t, &p))
            lanes[TFAR * n + i].f = -INFINITY;
}

/* --- building --------------------------------------------------------------------------------------------------------- */

static bool count_bytes(void *user, ssize_t bytes, bool post)
{
    (void)post;
    struct pt_accel *accel = user;
    atomic_fetch_add(&accel->bytes, (long long)bytes);
    return true;
}

static RTCGeometry make_mesh(RTCDevice device, const struct pt_mesh *mesh)
{
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!g)
        return NULL;
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh->vertices, 0, sizeof *mesh->vertices,
                               mesh->vertex_count);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh->indices, 0, 3 * sizeof(uint32_t),
                               mesh->triangle_count);
    return g;
}

static RTCGeometry make_quadric(RTCDevice device, struct pt_quadric *quadric)
{
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    if (!g)
        return NULL;
    rtcSetGeometryUserPrimitiveCount(g, 1);
    rtcSetGeometryUserData(g, quadric);
    rtcSetGeometryBoundsFunction(g, quadric_bounds, NULL);
    rtcSetGeometryIntersectFunction(g, quadric_intersect);
    rtcSetGeometryOccludedFunction(g, quadric_occluded);
    return g;
}

/* M = T · Q · U with Q a rotation and U upper triangular (Gram–Schmidt on the columns), which is what Embree interpolates:
 * Q spherically, the rest linearly. A mirror goes into U. */
static void decompose(const struct pt_mat34 *t, struct RTCQuaternionDecomposition *out)
{
    pt_vec3 c0 = v3(t->m[0], t->m[4], t->m[8]), c1 = v3(t->m[1], t->m[5], t->m[9]), c2 = v3(t->m[2], t->m[6], t->m[10]);
    pt_vec3 q0 = v3_norm(c0);
    float u01 = v3_dot(q0, c1);
    pt_vec3 q1 = v3_norm(v3_madd(c1, -u01, q0)), q2 = v3_cross(q0, q1);
    rtcInitQuaternionDecomposition(out);
    rtcQuaternionDecompositionSetTranslation(out, t->m[3], t->m[7], t->m[11]);
    rtcQuaternionDecompositionSetScale(out, v3_dot(q0, c0), v3_dot(q1, c1), v3_dot(q2, c2));
    rtcQuaternionDecompositionSetSkew(out, u01, v3_dot(q0, c2), v3_dot(q1, c2));
    /* Shepperd 1978: divide by the largest of the four */
    float trace = q0.x + q1.y + q2.z, r, i, j, k;
    if (trace > 0.0f) {
        float s = 2.0f * sqrtf(1.0f + trace);
        r = 0.25f * s, i = (q1.z - q2.y) / s, j = (q2.x - q0.z) / s, k = (q0.y - q1.x) / s;
    } else if (q0.x > q1.y && q0.x > q2.z) {
        float s = 2.0f * sqrtf(1.0f + q0.x - q1.y - q2.z);
        r = (q1.z - q2.y) / s, i = 0.25f * s, j = (q1.x + q0.y) / s, k = (q2.x + q0.z) / s;
    } else if (q1.y > q2.z) {
        float s = 2.0f * sqrtf(1.0f + q1.y - q0.x - q2.z);
        r = (q2.x - q0.z) / s, i = (q1.x + q0.y) / s, j = 0.25f * s, k = (q2.y + q1.z) / s;
    } else {
        float s = 2.0f * sqrtf(1.0f + q2.z - q0.x - q1.y);
        r = (q0.y - q1.x) / s, i = (q2.x + q0.z) / s, j = (q2.y + q1.z) / s, k = 0.25f * s;
    }
    rtcQuaternionDecompositionSetQuaternion(out, r, i, j, k);
}

static void set_transforms(RTCGeometry g, const struct pt_instance *instance)
{
    if (!instance->animated) {
        rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, instance->to_render[0].m);
        return;
    }
    rtcSetGeometryTimeStepCount(g, 2);
    for (unsigned i = 0; i < 2; i++) {
        struct RTCQuaternionDecomposition q;
        decompose(&instance->to_render[i], &q);
        rtcSetGeometryTransformQuaternion(g, i, &q);
    }
}

/* Takes over the geometry. 0 when it could not be made. */
static int attach(RTCScene target, RTCGeometry g, unsigned id)
{
    if (!g)
        return 0;
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(target, g, id);
    rtcReleaseGeometry(g);
    return 1;
}

static RTCScene make_group(struct pt_scene *scene, RTCDevice device, int32_t first, int32_t count, int commit)
{
    RTCScene group = rtcNewScene(device);
    if (!group)
        return NULL;
    rtcSetSceneFlags(group, RTC_SCENE_FLAG_ROBUST);
    for (int32_t i = 0; i < count; i++) {
        const struct pt_shape *shape = &scene->shapes[first + i];
        RTCGeometry g = shape->kind == PT_SHAPE_MESH ? make_mesh(device, &scene->meshes[shape->data])
                                                     : make_quadric(device, &scene->quadrics[shape->data]);
        if (!attach(group, g, (unsigned)i)) {
            rtcReleaseScene(group);
            return NULL;
        }
    }
    if (commit)
        rtcCommitScene(group);
    return group;
}

static int build_instances(struct pt_scene *scene, struct pt_accel *accel)
{
    for (int32_t i = 0; i < scene->instance_count; i++) {
        RTCGeometry g = rtcNewGeometry(accel->device, RTC_GEOMETRY_TYPE_INSTANCE);
        if (!g)
            return 0;
        rtcSetGeometryInstancedScene(g, accel->objects[scene->instances[i].object]);
        set_transforms(g, &scene->instances[i]);
        accel->instances[i] = g;
        if (!attach(accel->world, g, (unsigned)(scene->world_shape_count + i)))
            return 0;
    }
    return 1;
}

static void destroy(struct pt_accel *accel)
{
    if (!accel)
        return;
    if (accel->world)
        rtcReleaseScene(accel->world);
    for (int32_t i = 0; i < accel->object_count; i++)
        if (accel->objects && accel->objects[i])
            rtcReleaseScene(accel->objects[i]);
    if (accel->device)
        rtcReleaseDevice(accel->device);
    free(accel->objects);
    free(accel->instances);
    free(accel);
}

/* Only widths that Embree has code for on this processor: those it would have to cut up it gets wrong (rtcOccluded16 of 3.13
 * with AVX2 fails an assertion). */
static int native_packet(RTCDevice device)
{
    return rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? 16
           : rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8
           : rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED) ? 4
                                                                                     : 1;
}

static int build(struct pt_scene *scene, struct pt_accel *accel)
{
    accel->object_count = scene->object_count;
    if (scene->object_count && !(accel->objects = calloc((size_t)scene->object_count, sizeof *accel->objects)))
        return 0;
    if (scene->instance_count && !(accel->instances = calloc((size_t)scene->instance_count, sizeof *accel->instances)))
        return 0;
    accel->device = rtcNewDevice(NULL);
    if (!accel->device)
        return 0;
    accel->packet = native_packet(accel->device);
    rtcSetDeviceMemoryMonitorFunction(accel->device, count_bytes, accel);
    for (int32_t i = 0; i < scene->object_count; i++) {
        const struct pt_object *o = &scene->objects[i];
        if (!(accel->objects[i] = make_group(scene, accel->device, o->first_shape, o->shape_count, 1)))
            return 0;
    }
    accel->world = make_group(scene, accel->device, 0, scene->world_shape_count, 0);
    if (!accel->world || !build_instances(scene, accel))
        return 0;
    rtcCommitScene(accel->world);
    return rtcGetDeviceError(accel->device) == RTC_ERROR_NONE;
}

int pt_accel_build(struct pt_scene *scene, struct base_err *err)
{
    static const char what[] = "the acceleration structure";
    struct pt_accel *accel = calloc(1, sizeof *accel);
    if (!accel)
        return base_fail_nomem(err, what);
    pt_terminate_begin(what);
    int built = build(scene, accel);
    if (!built)
        destroy(accel); /* Embree may lack memory for that, too */
    pt_terminate_end();
    if (!built)
        return base_fail_nomem(err, what);
    struct RTCBounds b;
    rtcGetSceneBounds(accel->world, &b);
    if (b.lower_x <= b.upper_x) {
        scene->bounds_min = v3(b.lower_x, b.lower_y, b.lower_z);
        scene->bounds_max = v3(b.upper_x, b.upper_y, b.upper_z);
    } else {
        scene->bounds_min = scene->bounds_max = v3_splat(0.0f);
    }
    scene->accel = accel;
    return 0;
}

void pt_accel_release(struct pt_scene *scene)
{
    destroy(scene->accel);
    scene->accel = NULL;
}

long long pt_accel_bytes(const struct pt_scene *scene) { return scene->accel ? atomic_load(&scene->accel->bytes) : 0; }

/* --- queries ---------------------------------------------------------------------------------------------------------- */

static inline struct RTCRay make_ray(const struct pt_ray *ray)
{
    return (struct RTCRay){.org_x = ray->origin.x,
                           .org_y = ray->origin.y,
                           .org_z = ray->origin.z,
                           .tnear = ray->t_min,
                           .dir_x = ray->direction.x,
                           .dir_y = ray->direction.y,
                           .dir_z = ray->direction.z,
                           .time = ray->time,
                           .tfar = ray->t_max,
                           .mask = ~0u,
                           .id = 0,
                           .flags = 0};
}

/* Embree's ids as ours. */
static inline void name_shape(const struct pt_scene *scene, unsigned geometry, unsigned instance, struct pt_hit *hit)
{
    if (geometry == RTC_INVALID_GEOMETRY_ID) {
        hit->shape = -1;
    } else if (instance == RTC_INVALID_GEOMETRY_ID) {
        hit->instance = -1;
        hit->shape = (int32_t)geometry;
    } else {
        hit->instance = (int32_t)instance - scene->world_shape_count;
        hit->shape = scene->objects[scene->instances[hit->instance].object].first_shape + (int32_t)geometry;
    }
}

int pt_accel_intersect(const struct pt_scene *scene, const struct pt_ray *ray, struct pt_hit *hit)
{
    struct RTCRayHit rh;
    rh.ray = make_ray(ray);
    rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    pt_embree_intersect1(scene->accel->world, &rh);
    hit->t = rh.ray.tfar;
    hit->u = rh.hit.u;
    hit->v = rh.hit.v;
    hit->primitive = (int32_t)rh.hit.primID;
    hit->geometric = v3(rh.hit.Ng_x, rh.hit.Ng_y, rh.hit.Ng_z);
    name_shape(scene, rh.hit.geomID, rh.hit.instID[0], hit);
    return hit->shape >= 0;
}

int pt_accel_occluded(const struct pt_scene *scene, const struct pt_ray *ray)
{
    struct RTCRay r = make_ray(ray);
    pt_embree_occluded1(scene->accel->world, &r);
    return r.tfar < 0.0f;
}

struct packet {
    _Alignas(64) union lane lanes[FIELDS * 16];
    _Alignas(64) int valid[16];
};

static inline void put_ray(const struct pt_ray *from, union lane *lanes, int n, int i)
{
    lanes[ORG_X * n + i].f = from->origin.x;
    lanes[ORG_Y * n + i].f = from->origin.y;
    lanes[ORG_Z * n + i].f = from->origin.z;
    lanes[TNEAR * n + i].f = from->t_min;
    lanes[DIR_X * n + i].f = from->direction.x;
    lanes[DIR_Y * n + i].f = from->direction.y;
    lanes[DIR_Z * n + i].f = from->direction.z;
    lanes[TIME * n + i].f = from->time;
    lanes[TFAR * n + i].f = from->t_max;
    lanes[MASK * n + i].u = ~0u;
    lanes[RAY_ID * n + i].u = lanes[FLAGS * n + i].u = 0;
}

/* How many of `count` rays go together next, each in a lane of n. */
static inline int packet_begin(struct packet *p, int count, int n)
{
    count = count < n ? count : n;
    for (int i = 0; i < n; i++)
        p->valid[i] = i < count ? -1 : 0;
    return count;
}

/* The first rays of a list of `count`, as many as go together. Lanes without one hold a ray all the same. */
static inline int packet_fill(struct packet *p, const struct pt_ray *const *rays, int count, int n)
{
    count = packet_begin(p, count, n);
    for (int i = 0; i < n; i++)
        put_ray(rays[i < count ? i : 0], p->lanes, n, i);
    return count;
}

static inline void put_field(const float *from, union lane *lanes, int count, int n)
{
    for (int i = 0; i < n; i++)
        lanes[i].f = from[i];
    for (int i = count; i < n; i++)
        lanes[i].f = from[0];
}

/* The same from ray `first` on of those that lie side by side; n is a constant wherever this is inlined. */
static inline __attribute__((always_inline)) void put_lanes(struct packet *p, const struct pt_ray_lanes *rays, int first,
                                                            int count, int n)
{
    for (int axis = 0; axis < 3; axis++) {
        put_field(rays->origin[axis] + first, &p->lanes[(ORG_X + axis) * n], count, n);
        put_field(rays->direction[axis] + first, &p->lanes[(DIR_X + axis) * n], count, n);
    }
    for (int i = 0; i < n; i++) {
        p->lanes[TNEAR * n + i].f = p->lanes[TIME * n + i].f = 0.0f;
        p->lanes[TFAR * n + i].f = rays->t_max;
        p->lanes[MASK * n + i].u = ~0u;
        p->lanes[RAY_ID * n + i].u = p->lanes[FLAGS * n + i].u = 0;
    }
}

static inline int packet_fill_lanes(struct packet *p, const struct pt_ray_lanes *rays, int first, int count, int n)
{
    count = packet_begin(p, count - first, n);
    if (n == 16)
        put_lanes(p, rays, first, count, 16);
    else if (n == 8)
        put_lanes(p, rays, first, count, 8);
    else
        put_lanes(p, rays, first, count, 4);
    return count;
}

static inline struct pt_ray lane_ray(const struct pt_ray_lanes *rays, int i)
{
    return (struct pt_ray){v3(rays->origin[0][i], rays->origin[1][i], rays->origin[2][i]),
                           v3(rays->direction[0][i], rays->direction[1][i], rays->direction[2][i]), 0.0f, rays->t_max, 0.0f};
}

static void packet_intersect(const struct pt_scene *scene, struct packet *p, int n, int coherent)
{
    for (int i = 0; i < n; i++)
        p->lanes[GEOM_ID * n + i].u = p->lanes[INST_ID * n + i].u = RTC_INVALID_GEOMETRY_ID;
    pt_embree_intersect(scene->accel->world, n, p->valid, p->lanes, coherent);
}

/* What ray i of n has met. */
static inline void take_hit(const struct pt_scene *scene, const struct packet *p, int n, int i, struct pt_hit *hit)
{
    hit->t = p->lanes[TFAR * n + i].f;
    hit->u = p->lanes[HIT_U * n + i].f;
    hit->v = p->lanes[HIT_V * n + i].f;
    hit->primitive = (int32_t)p->lanes[PRIM_ID * n + i].u;
    hit->geometric = v3(p->lanes[NG_X * n + i].f, p->lanes[NG_Y * n + i].f, p->lanes[NG_Z * n + i].f);
    name_shape(scene, p->lanes[GEOM_ID * n + i].u, p->lanes[INST_ID * n + i].u, hit);
}

void pt_accel_intersect_many(const struct pt_scene *scene, const struct pt_ray *const *rays, int count, int coherent,
                             struct pt_hit *const *hits)
{
    struct packet p;
    int n = scene->accel->packet;
    while (count > 1 && n > 1) {
        int filled = packet_fill(&p, rays, count, n);
        packet_intersect(scene, &p, n, coherent);
        for (int i = 0; i < filled; i++)
            take_hit(scene, &p, n, i, hits[i]);
        count -= filled;
        rays += filled;
        hits += filled;
    }
    for (int i = 0; i < count; i++)
        pt_accel_intersect(scene, rays[i], hits[i]);
}

void pt_accel_intersect_lanes(const struct pt_scene *scene, const struct pt_ray_lanes *rays, int count, int coherent,
                              struct pt_hit *hits)
{
    struct packet p;
    int n = scene->accel->packet, done = 0;
    while (count - done > 1 && n > 1) {
        int filled = packet_fill_lanes(&p, rays, done, count, n);
        packet_intersect(scene, &p, n, coherent);
        for (int i = 0; i < filled; i++)
            take_hit(scene, &p, n, i, &hits[done + i]);
        done += filled;
    }
    for (; done < count; done++) {
        struct pt_ray ray = lane_ray(rays, done);
        pt_accel_intersect(scene, &ray, &hits[done]);
    }
}

void pt_accel_occluded_many(const struct pt_scene *scene, const struct pt_ray *const *rays, int count, uint8_t *occluded)
{
    struct packet p;
    int n = scene->accel->packet;
    while (count > 1 && n > 1) {
        int filled = packet_fill(&p, rays, count, n);
        pt_embree_occluded(scene->accel->world, n, p.valid, p.lanes);
        for (int i = 0; i < filled; i++)
            occluded[i] = p.lanes[TFAR * n + i].f < 0.0f;
        count -= filled;
        rays += filled;
        occluded += filled;
    }
    for (int i = 0; i < count; i++)
        occluded[i] = (uint8_t)pt_accel_occluded(scene, rays[i]);
}

void pt_accel_occluded_lanes(const struct pt_scene *scene, const struct pt_ray_lanes *rays, int count, uint8_t *occluded)
{
    struct packet p;
    int n = scene->accel->packet, done = 0;
    while (count - done > 1 && n > 1) {
        int filled = packet_fill_lanes(&p, rays, done, count, n);
        pt_embree_occluded(scene->accel->world, n, p.valid, p.lanes);
        for (int i = 0; i < filled; i++)
            occluded[done + i] = p.lanes[TFAR * n + i].f < 0.0f;
        done += filled;
    }
    for (; done < count; done++) {
        struct pt_ray ray = lane_ray(rays, done);
        occluded[done] = (uint8_t)pt_accel_occluded(scene, &ray);
    }
}

void pt_accel_instance_transform(const struct pt_scene *scene, int32_t id, float time, struct pt_mat34 *to_render)
{
    if (!scene->instances[id].animated) {
        *to_render = scene->instances[id].to_render[0];
        return;
    }
    rtcGetGeometryTransform(scene->accel->instances[id], time, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, to_render->m);
}
