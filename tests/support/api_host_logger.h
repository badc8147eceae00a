/* A criterion that writes down all it is told and answers as the test says: `heard` holds both. For tests of the host library. */
#ifndef TESTS_SUPPORT_API_HOST_LOGGER_H
#define TESTS_SUPPORT_API_HOST_LOGGER_H

#include <lull/criterion.h>

enum { MOST = 16, ALL_PLANES = LULL_PLANE_BIT(LULL_PLANE_COUNT) - 1 };

struct lull_instance {
    double quality;
    const struct lull_host *host;
};

extern struct api_host_heard {
    struct lull_requirements needs;
    struct lull_decision answer[MOST];                    /* by block */
    int32_t create, require, begin, evaluate, save, load; /* to be answered */
    double fails_at;                                      /* the quality of an instance that fails to evaluate */
    char calls[400];
    struct lull_frame frame;
    struct lull_rect rects[MOST];
    struct lull_view view;
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block all[MOST], due[MOST];
    uint32_t count;
    double corner[5], pixel_spp; /* of pixel (8, 6) as the planes have it; -1: no such plane */
    double weight[2];            /* of that pixel and the next, -1 likewise */
    struct lull_decision preset;
    unsigned char state[8];
} heard;

extern struct lull_criterion table;           /* "logger" */
extern const struct lull_param parameters[2]; /* its own: visible, threshold */

/* Adds to heard.calls. */
void note(const char *format, ...);

/* A writer's: appends to where its context, a char *, points. */
int32_t gather(const struct lull_writer *writer, const void *data, uint64_t size);

#endif
