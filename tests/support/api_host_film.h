/* A film with blocks, in front of a criterion that writes everything down. For tests of the host library. */
#ifndef TESTS_SUPPORT_API_HOST_FILM_H
#define TESTS_SUPPORT_API_HOST_FILM_H

#include "host/frame.h"
#include "support/api_host_logger.h"

enum { WIDTH = 12, HEIGHT = 14, PIXELS = WIDTH * HEIGHT }; /* of the film, whose first pixel is (8, 0) */

extern double sums[LULL_PLANE_COUNT][3 * PIXELS];
extern uint32_t lost[PIXELS], lost_half[PIXELS]; /* dropped samples */
extern struct lull_plane planes[LULL_PLANE_COUNT], lost_plane;
extern struct lull_host_view view;
extern struct lull_host_criterion *criterion;
extern struct lull_host_frame *frame;
extern struct lull_host_config config;
extern struct lull_error err;
extern char warned[700]; /* the last message: "LEVEL: text" */
extern int released;     /* how often the services were given back */
extern const struct lull_host_services services;

/* 20 x 14 pixels in blocks of 8 x 6, of which a crop touches the last two columns; every sum of its own. The planes are those of a
 * mask; without counts. */
void set_up(uint32_t supplied, uint32_t required);
/* Opens the frame; its blocks with 10 samples and more. NULL: err says why. */
struct lull_host_block *begin(void);
void tear_down(void);

#endif
