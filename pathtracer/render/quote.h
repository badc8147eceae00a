/*
 * What accuracy costs in this scene, before it is rendered: the quote of lull/host.h, told from a pilot, the first waves of
 * the render itself. Its rows differ in how many viewers may still see noise (the criterion's parameter `visible`). Neither
 * the film nor the render's own instance changes. Not thread-safe.
 */
#ifndef PT_RENDER_QUOTE_H
#define PT_RENDER_QUOTE_H

#include "render/render.h"

enum { PT_QUOTE_ROWS = 4 };

struct pt_quote_setting {
    double visible;   /* NaN: the criterion has no such parameter, or none is used */
    const char *name; /* borrows static text: "draft", "default", "final", "as asked"; "normal": there is no default */
};

struct pt_quote {
    struct lull_host_quote *told;                    /* owns */
    struct pt_quote_setting settings[PT_QUOTE_ROWS]; /* of the rows */
    const struct lull_host_quote_row *rows;          /* the answer, of pt_quote_finish; borrows */
    uint32_t row_count;
    int threads;
};

/* Rows of visible 0.5, of the criterion's default (0.25 if it names none) and of 0.05, and of the given one if it is
 * another; one row "as asked" where the criterion has no such parameter or the render has no criterion. pairs: the
 * parameters of the render's criterion.
 *
 * noisy: NULL, or the criterion that judges the noisy picture of a render that keeps the denoised one; then there are two
 * rows, both as asked, "denoised" and "noisy".
 *
 * Render, its criterion and log are borrowed until destroy. */
int pt_quote_create(const struct pt_render *render, const struct lull_pair *pairs, uint32_t pair_count,
                    const struct lull_criterion *noisy, struct base_log *log, struct pt_quote **out, struct base_err *err);
void pt_quote_destroy(struct pt_quote *quote);

/* The hook `judged` of the pilot. */
void pt_quote_ask(struct pt_quote *quote, struct pt_render *render, const uint32_t *due, uint32_t count);
/* After the pilot: asks about every block as it is and works out the answer. */
int pt_quote_finish(struct pt_quote *quote, struct pt_render *render, struct base_err *err);

#endif
