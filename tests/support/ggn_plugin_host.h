/* A host of one picture with three blocks of several sizes, for tests of the criteria of ggn from inside. */
#ifndef TESTS_SUPPORT_GGN_PLUGIN_HOST_H
#define TESTS_SUPPORT_GGN_PLUGIN_HOST_H

#include <lull/criterion.h>

#include "sight/preprocess.h"

enum { GP_HOST_WIDTH = 60, GP_HOST_HEIGHT = 44, GP_HOST_BLOCKS = 3 };

extern const struct lull_rect gp_host_rects[GP_HOST_BLOCKS];
extern float gp_host_color[GP_HOST_HEIGHT][GP_HOST_WIDTH][3], gp_host_half[GP_HOST_HEIGHT][GP_HOST_WIDTH][3];
extern const struct ggn_display gp_host_usual;

/* Fills both with what `spp` samples give; a little less than half of them are in HALF. Noise differs from block to block. */
void gp_host_render(uint64_t spp);
/* As the frame's matrix weighs it. */
double gp_host_luminance(const float rgb[3]);

struct lull_frame gp_host_frame(uint32_t planes, const struct ggn_display *display, uint64_t spp_max);
/* An instance with this model and one more parameter, of either where they are given; every other time of a host with three
 * workers. */
struct lull_instance *gp_host_create(const struct lull_criterion *c, const char *path, const char *key, const char *value);
/* Asks about the blocks whose bits are set, each at `spp` samples; UINT64_MAX: the last of them is not where it was. */
int32_t gp_host_evaluate(const struct lull_criterion *c, struct lull_instance *in, uint64_t spp, uint32_t ids,
                         struct lull_decision *d);

#endif
