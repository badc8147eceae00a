#include "geom/accel.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "geom/quadric.h"

struct pt_accel {
    RTCDevice device;
    RTCScene world;
    RTCScene *objects;        /* [object_count], owns */
    RTCGeometry *instances;   /* [instance_count], borrows from `world` */
    int32_t object_count;
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

static int quadric_query(const struct pt_quadric *q, const struct RTCRay *ray, float *t, pt_vec3 *p_quadric)
{
    return pt_quadric_intersect(q, v3(ray->org_x, ray->org_y, ray->org_z), v3(ray->dir_x, ray->dir_y, ray->dir_z),
                                ray->tnear, ray->tfar, t, p_quadric);
}

/* Only single rays are traced, so N is 1 and the argument is a plain RTCRayHit. */
static void quadric_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    struct RTCRayHit *rayhit = (struct RTCRayHit *)args->rayhit;
    float t;
    pt_vec3 p;
    if (!args->valid[0] || !quadric_query(args->geometryUserPtr, &rayhit->ray, &t, &p))
        return;
    rayhit->ray.tfar = t;
    rayhit->hit.u = rayhit->hit.v = 0.0f;
    rayhit->hit.Ng_x = p.x;
    rayhit->hit.Ng_y = p.y;
    rayhit->hit.Ng_z = p.z;
    rayhit->hit.geomID = args->geomID;
    rayhit->hit.primID = args->primID;
    rayhit->hit.instID[0] = args->context->instID[0];
}

static void quadric_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    struct RTCRay *ray = (struct RTCRay *)args->ray;
    float t;
    pt_vec3 p;
    if (args->valid[0] && quadric_query(args->geometryUserPtr, ray, &t, &p))
        ray->tfar = -INFINITY;
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
    struct pt_accel *accel = calloc(1, sizeof *accel);
    if (!accel)
        return base_fail_nomem(err, "the acceleration structure");
    if (!build(scene, accel)) {
        destroy(accel);
        return base_fail_nomem(err, "the acceleration structure");
    }
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
    return (struct RTCRay){.org_x = ray->origin.x,    .org_y = ray->origin.y,    .org_z = ray->origin.z,
                           .tnear = ray->t_min,
                           .dir_x = ray->direction.x, .dir_y = ray->direction.y, .dir_z = ray->direction.z,
                           .time = ray->time,
                           .tfar = ray->t_max,        .mask = ~0u,               .id = 0,                   .flags = 0};
}

int pt_accel_intersect(const struct pt_scene *scene, const struct pt_ray *ray, int coherent, struct pt_hit *hit)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    struct RTCRayHit rh;
    rh.ray = make_ray(ray);
    rh.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene->accel->world, &context, &rh);
    if (rh.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
        hit->shape = -1;
        return 0;
    }
    hit->t = rh.ray.tfar;
    hit->u = rh.hit.u;
    hit->v = rh.hit.v;
    hit->primitive = (int32_t)rh.hit.primID;
    hit->geometric = v3(rh.hit.Ng_x, rh.hit.Ng_y, rh.hit.Ng_z);
    if (rh.hit.instID[0] == RTC_INVALID_GEOMETRY_ID) {
        hit->instance = -1;
        hit->shape = (int32_t)rh.hit.geomID;
    } else {
        hit->instance = (int32_t)rh.hit.instID[0] - scene->world_shape_count;
        hit->shape = scene->objects[scene->instances[hit->instance].object].first_shape + (int32_t)rh.hit.geomID;
    }
    return 1;
}

int pt_accel_occluded(const struct pt_scene *scene, const struct pt_ray *ray)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay r = make_ray(ray);
    rtcOccluded1(scene->accel->world, &context, &r);
    return r.tfar < 0.0f;
}

void pt_accel_instance_transform(const struct pt_scene *scene, int32_t id, float time, struct pt_mat34 *to_render)
{
    if (!scene->instances[id].animated) {
        *to_render = scene->instances[id].to_render[0];
        return;
    }
    rtcGetGeometryTransform(scene->accel->instances[id], time, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, to_render->m);
}
