/* --debug-path: the tracing kernel tells what happens at each vertex, one line of text each, and counts them for --quote. */
#ifndef PT_INTEG_TRACE_H
#define PT_INTEG_TRACE_H

#include <stdio.h>

#include "integ/integrator.h"
#include "integ/surface.h"

struct pt_trace {
    FILE *out; /* gets the lines; NULL: they are not wanted */
    int vertex;
    uint32_t met[PT_MET_COUNT]; /* vertices so far, by what they are */
};

void pt_trace_camera(struct pt_trace *trace, const struct pt_ray *ray);
void pt_trace_surface(struct pt_trace *trace, const struct pt_place *at, const struct pt_bsdf *bsdf, pt_vec3 throughput);
void pt_trace_scatter(struct pt_trace *trace, int32_t medium, pt_vec3 p, pt_vec3 throughput);
void pt_trace_light(struct pt_trace *trace, pt_vec3 wi, pt_vec3 added);
void pt_trace_emission(struct pt_trace *trace, float weight, pt_vec3 added);
void pt_trace_end(struct pt_trace *trace, pt_vec3 radiance);

#endif
