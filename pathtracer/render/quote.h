/*
 * What accuracy costs in this scene, before it is rendered: predicted from a pilot, the first waves of the render itself.
 *
 * While the pilot runs, the criterion is asked at the render's own checks by several instances that differ in how many
 * viewers may still see noise (its parameter `visible`): each row of the quote is one of them. Neither the film nor the
 * render's own instance is touched, so that the render can go on afterwards as if there had been no quote. Not thread-safe.
 */
#ifndef PT_RENDER_QUOTE_H
#define PT_RENDER_QUOTE_H

#include "render/render.h"

enum { PT_QUOTE_ROWS = 4 };

struct pt_quote_block {
    struct lull_host_stop_at stop;
    double thread_s, thread_low_s, thread_high_s; /* of sampling up to there, and to the ends of the interval */
};

struct pt_quote_row {
    double visible;   /* NaN: the criterion has no such parameter, or none is used */
    const char *name; /* borrows static text: "draft", "default", "final", "as asked"; "normal": there is no default */
    int asked;        /* this is what a render with the given options does */
    struct lull_host_criterion *criterion; /* owns; NULL: uniform */
    struct lull_host_said *said;           /* owns; [blocks] */
    struct lull_host_said *first;          /* owns; [blocks] what it said when it was asked first */
    /* The answer, of pt_quote_finish: */
    struct pt_quote_block *blocks;     /* owns; [blocks] */
    double spp_min, spp_mean, spp_max; /* samples per pixel: least block, all pixels, dearest block */
    double spp_mean_low, spp_mean_high;
    double thread_s, thread_low_s, thread_high_s; /* of sampling, the whole image from its start */
    double wall_s, wall_low_s, wall_high_s;       /* with the checks, on free processors */
    double against_uniform;                       /* samples over those of spp_max everywhere */
    uint32_t unknown, unmet, capped; /* blocks without a prediction; without their light yet; that reach --spp-max */
};

struct pt_quote {
    struct pt_quote_row rows[PT_QUOTE_ROWS];
    int row_count;
    int threads;
    uint32_t block_count;
    double *block_cost_s; /* owns; [blocks] thread seconds per sample of every pixel; NaN: not known */
    double check_s;       /* wall seconds that the criterion takes for one block */
};

/* Rows of visible 0.5, of the criterion's default (0.25 if it names none) and of 0.05, and of the given one if it is
 * another; one row "as asked" where the criterion has no such parameter or the render has no criterion (table NULL).
 *
 * noisy: NULL, or the criterion that judges the noisy picture of a render that keeps the denoised one; then there are two
 * rows, both as asked, "denoised" and "noisy".
 *
 * The render's threads are borrowed until destroy. */
int pt_quote_create(const struct pt_render *render, const struct lull_criterion *table, const struct lull_pair *pairs,
                    uint32_t pair_count, const struct lull_criterion *noisy, struct base_log *log, struct pt_quote **out,
                    struct base_err *err);
void pt_quote_destroy(struct pt_quote *quote);

/* The hook `judged` of the pilot. A row whose criterion fails keeps what it knew. */
void pt_quote_ask(struct pt_quote *quote, struct pt_render *render, const uint32_t *due, uint32_t count);
/* After the pilot: asks about every block as it is and works out the answer. */
int pt_quote_finish(struct pt_quote *quote, struct pt_render *render, struct base_err *err);

#endif
