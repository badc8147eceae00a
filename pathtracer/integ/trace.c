#include "integ/trace.h"

#include <stdarg.h>

#include "shade/bsdf.h"

#define XYZ(v) (double)(v).x, (double)(v).y, (double)(v).z

/* A line, if anybody reads. */
static void __attribute__((format(printf, 2, 3))) print(const struct pt_trace *trace, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (trace->out && vfprintf(trace->out, format, args) >= 0)
        putc('\n', trace->out);
    va_end(args);
}

void pt_trace_camera(struct pt_trace *trace, const struct pt_ray *ray)
{
    print(trace, "camera: origin (%g, %g, %g) direction (%g, %g, %g) time %g", XYZ(ray->origin), XYZ(ray->direction),
          (double)ray->time);
}

void pt_trace_surface(struct pt_trace *trace, const struct pt_place *at, const struct pt_bsdf *bsdf, pt_vec3 throughput)
{
    print(trace, "%d: %s at (%g, %g, %g) normal (%g, %g, %g) material %d primitive %d throughput (%g, %g, %g)",
          ++trace->vertex, pt_bsdf_models[bsdf->kind].words, XYZ(at->p), XYZ(at->s.n_geometric), (int)at->shape->material,
          (int)at->primitive, XYZ(throughput));
    trace->met[bsdf->kind]++;
}

void pt_trace_scatter(struct pt_trace *trace, int32_t medium, pt_vec3 p, pt_vec3 throughput)
{
    print(trace, "%d: scattered in medium %d at (%g, %g, %g) throughput (%g, %g, %g)", ++trace->vertex, (int)medium, XYZ(p),
          XYZ(throughput));
    trace->met[PT_MET_MEDIUM]++;
}

void pt_trace_light(struct pt_trace *trace, pt_vec3 wi, pt_vec3 added)
{
    print(trace, "   light towards (%g, %g, %g) adds (%g, %g, %g)", XYZ(wi), XYZ(added));
}

void pt_trace_emission(struct pt_trace *trace, float weight, pt_vec3 added)
{
    print(trace, "   emission met, weight %g, adds (%g, %g, %g)", (double)weight, XYZ(added));
}

void pt_trace_end(struct pt_trace *trace, pt_vec3 radiance) { print(trace, "end: pixel value (%g, %g, %g)", XYZ(radiance)); }
