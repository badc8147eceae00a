#include "integ/trace.h"

#include <stdarg.h>

#include "shade/bsdf_models.h"

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
    pt_vec3 o = ray->origin, d = ray->direction;
    print(trace, "camera: origin (%g, %g, %g) direction (%g, %g, %g) time %g", (double)o.x, (double)o.y, (double)o.z,
          (double)d.x, (double)d.y, (double)d.z, (double)ray->time);
}

void pt_trace_surface(struct pt_trace *trace, const struct pt_place *at, const struct pt_bsdf *bsdf, pt_vec3 throughput)
{
    pt_vec3 p = at->p, n = at->s.n_geometric, t = throughput;
    print(trace,
          "%d: %s at (%g, %g, %g) normal (%g, %g, %g) material %d primitive %d "
          "throughput (%g, %g, %g)",
          ++trace->vertex, pt_bsdf_models[bsdf->kind].words, (double)p.x, (double)p.y, (double)p.z, (double)n.x, (double)n.y,
          (double)n.z, (int)at->shape->material, (int)at->primitive, (double)t.x, (double)t.y, (double)t.z);
    trace->met[bsdf->kind]++;
}

void pt_trace_scatter(struct pt_trace *trace, int32_t medium, pt_vec3 p, pt_vec3 throughput)
{
    pt_vec3 t = throughput;
    print(trace, "%d: scattered in medium %d at (%g, %g, %g) throughput (%g, %g, %g)", ++trace->vertex, (int)medium,
          (double)p.x, (double)p.y, (double)p.z, (double)t.x, (double)t.y, (double)t.z);
    trace->met[PT_MET_MEDIUM]++;
}

void pt_trace_light(struct pt_trace *trace, pt_vec3 wi, pt_vec3 added)
{
    print(trace, "   light towards (%g, %g, %g) adds (%g, %g, %g)", (double)wi.x, (double)wi.y, (double)wi.z,
          (double)added.x, (double)added.y, (double)added.z);
}

void pt_trace_emission(struct pt_trace *trace, float weight, pt_vec3 added)
{
    print(trace, "   emission met, weight %g, adds (%g, %g, %g)", (double)weight, (double)added.x, (double)added.y,
          (double)added.z);
}

void pt_trace_end(struct pt_trace *trace, pt_vec3 radiance)
{
    print(trace, "end: pixel value (%g, %g, %g)", (double)radiance.x, (double)radiance.y, (double)radiance.z);
}
