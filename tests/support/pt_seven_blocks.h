/*
 * A render that never ran: 24 x 9 pixels, seven blocks of 8 x 4 and less, of which the fourth has no sample yet; every number of its
 * own. The camera stands in a white ball that no path leaves, so that each path has as many vertices as it may have bounces.
 */
#ifndef TESTS_SUPPORT_PT_SEVEN_BLOCKS_H
#define TESTS_SUPPORT_PT_SEVEN_BLOCKS_H

#include <lull/criterion.h>

#include "host/frame.h"
#include "render/render.h"

struct pt_seven_blocks {
    struct pt_render render;
    struct lull_host_block *list; /* [7], the render's */
    struct pt_scene *scene;
    struct lull_host_criterion *criterion;
    struct lull_criterion table;
    double black[3]; /* of the first pixel */
    uint32_t no_drops[1];
};

/* Fails the test when something is missing. *s stays where it is until pt_seven_blocks_release. */
void pt_seven_blocks_init(struct pt_seven_blocks *s);
void pt_seven_blocks_release(struct pt_seven_blocks *s);

#endif
