/* Analytic kernels and a criterion in memory, so that film and wave loop are tested without scene or shading. */
#ifndef TESTS_SUPPORT_PT_FAKE_H
#define TESTS_SUPPORT_PT_FAKE_H

#include <lull/criterion.h>

#include "render/render.h"

/* Radiance (0.5 + 0.5 u, 0.25, x / 1000) with u uniform in [0, 1) by a hash of (seed, x, y, sample). */
pt_kernel pt_fake_noise;
/* The same radiance always: (0.1, 0.2, 0.3); normal +z, depth 2, albedo 0.5. */
pt_kernel pt_fake_constant;
/* Like pt_fake_noise, but every 97th sample of pixels with x < 8 is NaN. */
pt_kernel pt_fake_nan;
/* Nothing but NaN for x < 8. */
pt_kernel pt_fake_all_nan;

/* Stops a block when its spp reach the value of parameter "at" times (1 + x0 / 16 % 4); keeps a count per block as state. */
const struct lull_criterion *pt_fake_criterion(void);

/* 4x3 blocks of 16x16 pixels, the last column and row narrower (60x44 pixels), spp 8 to 256. */
struct pt_render_config pt_fake_config(void);

struct pt_fake_run { /* owns */
    struct pt_render *render;
    struct lull_host_criterion *criterion; /* NULL: uniform */
    struct base_threads *pool;
};
/* Renders to the end, or the test fails. at: as above, NULL for a uniform render. */
struct pt_fake_run pt_fake_render(const struct pt_render_config *config, pt_kernel *kernel, int threads, const char *at);
void pt_fake_release(struct pt_fake_run *run);
/* Same film bytes and same decisions; times aside. */
void pt_fake_assert_same(const struct pt_render *a, const struct pt_render *b);

#endif
