#define _GNU_SOURCE 1 /* RTLD_DEFAULT */
#include "geom/accel.h"

#include <dlfcn.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "geom/embree.h"
#include "geom/quadric.h"

struct pt_accel {
    RTCDevice device;
    RTCScene world;
    RTCScene *objects; /* [object_count of the scene], owns */
    enum RTCSceneFlags flags;
    int packet; /* rays that go together: the processor's own width, 1 = one by one */
    atomic_llong bytes;
};

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

/* Of what a query leaves out, by Embree's ids. */
struct left_out {
    uint32_t count;
    struct {
        unsigned geometry, primitive, instance, crossing;
    } of[PT_PASSED];
};

/* The crossings of a quadric, a bit each; of a triangle bit 0. */
static unsigned crossings_left_out(const void *context, unsigned geometry, unsigned primitive, unsigned instance)
{
    const struct left_out *list = ((const struct pt_embree_context *)context)->left_out;
    unsigned crossings = 0;
    for (uint32_t i = 0; list && i < list->count; i++)
        if (list->of[i].geometry == geometry && list->of[i].primitive == primitive && list->of[i].instance == instance)
            crossings |= 1u << list->of[i].crossing;
    return crossings;
}

/* Triangles. */
static void leave_out(const struct RTCFilterFunctionNArguments *args)
{
    const struct RTCHit *hit = (const struct RTCHit *)args->hit; /* of one ray */
    if (crossings_left_out(args->context, hit->geomID, hit->primID, hit->instID[0]))
        args->valid[0] = 0;
}

/* Vector `field` (its first component) of ray i of n. */
static inline pt_vec3 get_vector(const union lane *lanes, int field, int n, int i)
{
    return v3(lanes[field * n + i].f, lanes[(field + 1) * n + i].f, lanes[(field + 2) * n + i].f);
}

static inline void put_vector(pt_vec3 v, union lane *lanes, int field, int n, int i)
{
    lanes[field * n + i].f = v.x;
    lanes[(field + 1) * n + i].f = v.y;
    lanes[(field + 2) * n + i].f = v.z;
}

/* Ray i of n; as pt_quadric_intersect. */
static int quadric_query(const struct pt_quadric *q, const union lane *rays, int n, int i, unsigned left_out, float *t,
                         pt_vec3 *p_quadric)
{
    return pt_quadric_intersect(q, get_vector(rays, ORG_X, n, i), get_vector(rays, DIR_X, n, i), rays[TNEAR * n + i].f,
                                rays[TFAR * n + i].f, left_out, t, p_quadric);
}

static void quadric_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    int n = (int)args->N;
    union lane *lanes = (union lane *)args->rayhit;
    const unsigned left_out = crossings_left_out(args->context, args->geomID, args->primID, args->context->instID[0]);
    float t;
    pt_vec3 p;
    for (int i = 0; i < n; i++) {
        int crossing = args->valid[i] ? quadric_query(args->geometryUserPtr, lanes, n, i, left_out, &t, &p) : 0;
        if (!crossing)
            continue;
        lanes[TFAR * n + i].f = t;
        lanes[HIT_U * n + i].f = (float)(crossing - 1);
        lanes[HIT_V * n + i].f = 0.0f;
        put_vector(p, lanes, NG_X, n, i);
        lanes[GEOM_ID * n + i].u = args->geomID;
        lanes[PRIM_ID * n + i].u = args->primID;
        lanes[INST_ID * n + i].u = args->context->instID[0];
    }
}

static void quadric_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    int n = (int)args->N;
    union lane *lanes = (union lane *)args->ray;
    float t;
    pt_vec3 p;
    for (int i = 0; i < n; i++)
        if (args->valid[i] && quadric_query(args->geometryUserPtr, lanes, n, i, 0, &t, &p))
            lanes[TFAR * n + i].f = -INFINITY;
}

/* What memory is wanted for, in errors. */
#define WHAT "the acceleration structure"

/*
 * When memory runs out in the middle of a parallel loop of a library in C++, its exception cannot leave the loop, and the
 * process is aborted with what C++ says of it. With this as its last word it ends with a line and exit status 1 instead, as
 * any other lack of memory does.
 */
static void say_and_end(void)
{
    static const char line[] = "lull-render: out of memory (" WHAT ")\n";
    (void)!write(STDERR_FILENO, line, sizeof line - 1);
    _exit(1);
}

typedef void (*handler)(void);

/* std::set_terminate: a program in C has it by the libraries that are in C++, or needs none. */
static handler set_handler(handler now)
{
    handler (*set_terminate)(handler);
    void *symbol = dlsym(RTLD_DEFAULT, "_ZSt13set_terminatePFvvE");
    memcpy(&set_terminate, &symbol, sizeof set_terminate); /* a pointer to data into one to a function */
    return set_terminate ? set_terminate(now) : NULL;
}

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
 * Q spherically, the rest linearly. A mirror goes into U, as does a shift by `origin` before all that. */
static void decompose(const struct pt_mat34 *t, pt_vec3 origin, struct RTCQuaternionDecomposition *out)
{
    pt_vec3 c0 = v3(t->m[0], t->m[4], t->m[8]), c1 = v3(t->m[1], t->m[5], t->m[9]), c2 = v3(t->m[2], t->m[6], t->m[10]);
    pt_vec3 q0 = v3_norm(c0);
    float u01 = v3_dot(q0, c1);
    pt_vec3 q1 = v3_norm(v3_madd(c1, -u01, q0)), q2 = v3_cross(q0, q1), at = pt_mat34_vector(t, origin);
    rtcInitQuaternionDecomposition(out);
    rtcQuaternionDecompositionSetTranslation(out, t->m[3], t->m[7], t->m[11]);
    rtcQuaternionDecompositionSetScale(out, v3_dot(q0, c0), v3_dot(q1, c1), v3_dot(q2, c2));
    rtcQuaternionDecompositionSetSkew(out, u01, v3_dot(q0, c2), v3_dot(q1, c2));
    rtcQuaternionDecompositionSetShift(out, v3_dot(q0, at), v3_dot(q1, at), v3_dot(q2, at));
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
        decompose(&instance->to_render[i], instance->origin, &q);
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

static RTCScene make_group(struct pt_scene *scene, const struct pt_accel *accel, int32_t first, int32_t count, int commit)
{
    RTCDevice device = accel->device;
    RTCScene group = rtcNewScene(device);
    if (!group)
        return NULL;
    rtcSetSceneFlags(group, accel->flags);
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
        if (!attach(accel->world, g, (unsigned)(scene->world_shape_count + i)))
            return 0;
    }
    return 1;
}

static void destroy(const struct pt_scene *scene, struct pt_accel *accel)
{
    if (accel->world)
        rtcReleaseScene(accel->world);
    for (int32_t i = 0; accel->objects && i < scene->object_count; i++)
        if (accel->objects[i])
            rtcReleaseScene(accel->objects[i]);
    if (accel->device)
        rtcReleaseDevice(accel->device);
    free(accel->objects);
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
    if (scene->object_count && !(accel->objects = calloc((size_t)scene->object_count, sizeof *accel->objects)))
        return 0;
    accel->device = rtcNewDevice(NULL);
    if (!accel->device)
        return 0;
    accel->packet = native_packet(accel->device);
    accel->flags = RTC_SCENE_FLAG_ROBUST;
    for (int32_t i = 0; i < scene->shape_count; i++) /* rays can go on behind some */
        if (scene->shapes[i].has_alpha || scene->shapes[i].touches ||
            scene->materials[scene->shapes[i].material].kind == PT_MATERIAL_INTERFACE)
            accel->flags = RTC_SCENE_FLAG_ROBUST | PT_EMBREE_FLAG_FILTER;
    rtcSetDeviceMemoryMonitorFunction(accel->device, count_bytes, accel);
    for (int32_t i = 0; i < scene->object_count; i++) {
        const struct pt_object *o = &scene->objects[i];
        if (!(accel->objects[i] = make_group(scene, accel, o->first_shape, o->shape_count, 1)))
            return 0;
    }
    accel->world = make_group(scene, accel, 0, scene->world_shape_count, 0);
    if (!accel->world || !build_instances(scene, accel))
        return 0;
    rtcCommitScene(accel->world);
    return rtcGetDeviceError(accel->device) == RTC_ERROR_NONE;
}

int pt_accel_build(struct pt_scene *scene, struct base_err *err)
{
    struct pt_accel *accel = calloc(1, sizeof *accel);
    if (!accel)
        return base_fail_nomem(err, WHAT);
    handler before = set_handler(say_and_end); /* one thread at a time */
    int built = build(scene, accel);
    if (!built)
        destroy(scene, accel); /* Embree may lack memory for that, too */
    set_handler(before);
    if (!built)
        return base_fail_nomem(err, WHAT);
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
    if (scene->accel)
        destroy(scene, scene->accel);
    scene->accel = NULL;
}

long long pt_accel_bytes(const struct pt_scene *scene) { return scene->accel ? atomic_load(&scene->accel->bytes) : 0; }

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

/* Where the number n of lanes is a constant. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))

struct packet {
    _Alignas(64) union lane lanes[FIELDS * 16];
    _Alignas(64) int valid[16];
};

/* Rays of a list, or, where that is NULL, side by side. */
struct batch {
    const struct pt_ray *const *list;
    const struct pt_ray_lanes *lanes;
};

ALWAYS_INLINE void put_ray(const struct pt_ray *from, union lane *lanes, int n, int i)
{
    put_vector(from->origin, lanes, ORG_X, n, i);
    put_vector(from->direction, lanes, DIR_X, n, i);
    lanes[TNEAR * n + i].f = from->t_min;
    lanes[TIME * n + i].f = from->time;
    lanes[TFAR * n + i].f = from->t_max;
}

ALWAYS_INLINE void put_field(const float *from, union lane *lanes, int count, int n)
{
    for (int i = 0; i < n; i++)
        lanes[i].f = from[i];
    for (int i = count; i < n; i++)
        lanes[i].f = from[0];
}

ALWAYS_INLINE void put_lanes(const struct pt_ray_lanes *rays, int first, union lane *lanes, int count, int n)
{
    for (int axis = 0; axis < 3; axis++) {
        put_field(rays->origin[axis] + first, &lanes[(ORG_X + axis) * n], count, n);
        put_field(rays->direction[axis] + first, &lanes[(DIR_X + axis) * n], count, n);
    }
    for (int i = 0; i < n; i++) {
        lanes[TNEAR * n + i].f = rays->t_min;
        lanes[TIME * n + i].f = 0.0f;
        lanes[TFAR * n + i].f = rays->t_max;
    }
}

/* The rays from `first` on of `count`, as many as go together in n lanes, as a question. Lanes without one hold a ray all
 * the same. Returns how many there are. */
ALWAYS_INLINE int packet_fill(struct packet *p, const struct batch *rays, int first, int count, int n)
{
    const int filled = count - first < n ? count - first : n;
    for (int i = 0; rays->list && i < n; i++)
        put_ray(rays->list[first + (i < filled ? i : 0)], p->lanes, n, i);
    if (!rays->list)
        put_lanes(rays->lanes, first, p->lanes, filled, n);
    for (int i = 0; i < n; i++) {
        p->valid[i] = i < filled ? -1 : 0;
        p->lanes[MASK * n + i].u = ~0u;
        p->lanes[RAY_ID * n + i].u = p->lanes[FLAGS * n + i].u = 0;
        p->lanes[GEOM_ID * n + i].u = p->lanes[INST_ID * n + i].u = RTC_INVALID_GEOMETRY_ID;
    }
    return filled;
}

/* What ray i of n has met. */
ALWAYS_INLINE void take_hit(const struct pt_scene *scene, const struct packet *p, int n, int i, struct pt_hit *hit)
{
    hit->t = p->lanes[TFAR * n + i].f;
    hit->u = p->lanes[HIT_U * n + i].f;
    hit->v = p->lanes[HIT_V * n + i].f;
    hit->primitive = (int32_t)p->lanes[PRIM_ID * n + i].u;
    hit->geometric = get_vector(p->lanes, NG_X, n, i);
    name_shape(scene, p->lanes[GEOM_ID * n + i].u, p->lanes[INST_ID * n + i].u, hit);
}

/* Asks for the hits of the next rays, or, if those are not wanted, whether there are any. Returns how many rays it asked. */
ALWAYS_INLINE int ask(const struct pt_scene *scene, const struct batch *rays, int first, int count, int coherent,
                      struct pt_hit *const *hits, uint8_t *occluded, int n)
{
    struct packet p;
    const int filled = packet_fill(&p, rays, first, count, n);
    if (hits) {
        pt_embree_intersect(scene->accel->world, n, p.valid, p.lanes, coherent);
        for (int i = 0; i < filled; i++)
            take_hit(scene, &p, n, i, hits[first + i]);
    } else {
        pt_embree_occluded(scene->accel->world, n, p.valid, p.lanes);
        for (int i = 0; i < filled; i++)
            occluded[first + i] = p.lanes[TFAR * n + i].f < 0.0f;
    }
    return filled;
}

static inline void ask_all(const struct pt_scene *scene, const struct batch *rays, int count, int coherent,
                           struct pt_hit *const *hits, uint8_t *occluded)
{
    for (int i = 0; i < count;)
        switch (count - i > 1 ? scene->accel->packet : 1) {
        case 16: i += ask(scene, rays, i, count, coherent, hits, occluded, 16); break;
        case 8: i += ask(scene, rays, i, count, coherent, hits, occluded, 8); break;
        case 4: i += ask(scene, rays, i, count, coherent, hits, occluded, 4); break;
        default: i += ask(scene, rays, i, count, coherent, hits, occluded, 1); break;
        }
}

int pt_accel_intersect(const struct pt_scene *scene, const struct pt_ray *ray, struct pt_hit *hit)
{
    ask_all(scene, &(struct batch){.list = &ray}, 1, 0, &hit, NULL);
    return hit->shape >= 0;
}

void pt_accel_intersect_many(const struct pt_scene *scene, const struct pt_ray *const *rays, int count, int coherent,
                             struct pt_hit *const *hits)
{
    ask_all(scene, &(struct batch){.list = rays}, count, coherent, hits, NULL);
}

void pt_accel_intersect_lanes(const struct pt_scene *scene, const struct pt_ray_lanes *rays, int count, int coherent,
                              struct pt_hit *const *hits)
{
    ask_all(scene, &(struct batch){.lanes = rays}, count, coherent, hits, NULL);
}

void pt_accel_occluded_many(const struct pt_scene *scene, const struct pt_ray *const *rays, int count, uint8_t *occluded)
{
    ask_all(scene, &(struct batch){.list = rays}, count, 0, NULL, occluded);
}

void pt_accel_occluded_lanes(const struct pt_scene *scene, const struct pt_ray_lanes *rays, int count, uint8_t *occluded)
{
    ask_all(scene, &(struct batch){.lanes = rays}, count, 0, NULL, occluded);
}

/* A ray that goes on begins this share before what it has passed: rounding may put what is at the same place before it. */
#define PASSED_BACK 1e-5f
/* Where more was passed at one place than is remembered: the distance of a hit is known to a few roundings only. */
#define PASSED_BEYOND 1e-6f

void pt_ray_pass(struct pt_ray *ray, struct pt_passed *passed, const struct pt_hit *hit)
{
    struct pt_hit *place = &passed->hits[passed->count % PT_PASSED];
    float t = hit->t * (1.0f - PASSED_BACK);
    if (passed->count >= PT_PASSED)
        t = fmaxf(t, place->t * (1.0f + PASSED_BEYOND));
    ray->t_min = fmaxf(ray->t_min, t);
    *place = *hit;
    passed->count++;
}

int pt_accel_intersect_behind(const struct pt_scene *scene, const struct pt_ray *ray, const struct pt_passed *passed,
                              struct pt_hit *hit)
{
    struct left_out list = {.count = passed->count < PT_PASSED ? passed->count : PT_PASSED};
    for (uint32_t i = 0; i < list.count; i++) {
        const struct pt_hit *of = &passed->hits[i];
        int32_t first = of->instance < 0 ? 0 : scene->objects[scene->instances[of->instance].object].first_shape;
        list.of[i].geometry = (unsigned)(of->shape - first);
        list.of[i].instance =
            of->instance < 0 ? RTC_INVALID_GEOMETRY_ID : (unsigned)(scene->world_shape_count + of->instance);
        list.of[i].primitive = (unsigned)of->primitive;
        list.of[i].crossing = scene->shapes[of->shape].kind == PT_SHAPE_QUADRIC && of->u > 0.0f;
    }
    struct packet p;
    packet_fill(&p, &(struct batch){.list = &ray}, 0, 1, 1);
    pt_embree_intersect1_filtered(scene->accel->world, p.lanes, leave_out, &list);
    take_hit(scene, &p, 1, 0, hit);
    return hit->shape >= 0;
}

struct near {
    const struct pt_scene *scene;
    pt_accel_visit *visit;
    void *user;
};

static bool visit_near(struct RTCPointQueryFunctionArguments *args)
{
    const struct near *near = args->userPtr;
    struct pt_hit hit = {.instance = -1};
    name_shape(near->scene, args->geomID, args->context->instStackSize ? args->context->instID[0] : RTC_INVALID_GEOMETRY_ID,
               &hit);
    near->visit(near->user, hit.shape, (int32_t)args->primID, hit.instance);
    return false;
}

void pt_accel_near(const struct pt_scene *scene, pt_vec3 centre, float radius, float time, pt_accel_visit *visit, void *user)
{
    struct near near = {scene, visit, user};
    struct RTCPointQuery query = {centre.x, centre.y, centre.z, time, radius};
    struct RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene->accel->world, &query, &context, visit_near, &near);
}

void pt_accel_instance_transform(const struct pt_scene *scene, int32_t id, float time, struct pt_mat34 *to_render)
{
    if (!scene->instances[id].animated) {
        *to_render = scene->instances[id].to_render[0];
        return;
    }
    RTCGeometry g = rtcGetGeometry(scene->accel->world, (unsigned)(scene->world_shape_count + id));
    rtcGetGeometryTransform(g, time, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, to_render->m);
}
