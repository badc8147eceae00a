/*
 * What accuracy costs in this scene, before it is rendered: the quote of lull/host.h, told from a pilot, the first waves of
 * the render itself. Its rows differ in the criterion's quality parameter: how many times what is just seen (`error`), or
 * how many viewers may still see noise (`visible`). Neither the film nor the render's own instance changes. Not
 * thread-safe.
 */
#ifndef PT_RENDER_QUOTE_H
#define PT_RENDER_QUOTE_H

#include <stdio.h>

#include "render/render.h"

enum { PT_QUOTE_ROWS = 6 };

struct pt_quote_setting {
    const char *parameter; /* static text: "error", "visible"; NULL: the criterion has neither, or no value for it */
    double value;
    const char *name; /* static text: "rough", "draft", "good", "default", "strict", "as asked"; "normal": no default */
};

struct pt_quote {
    struct lull_host_quote *quote;                   /* owns; for the hooks of the pilot */
    struct pt_quote_setting settings[PT_QUOTE_ROWS]; /* of the rows */
    const struct lull_host_quote_row *rows;          /* the answer, of pt_quote_finish; borrows */
    uint32_t row_count;
    int threads;
};

/* Coarse to fine. Where the criterion has `error`: rows of 8, 4 and 2 times what is just seen; where the render's is set,
 * of 1, 0.5 and that one, too. Else rows of visible 0.5 (where there is no `error`), of the criterion's default (0.25 if it
 * names none) and of 0.05, and of the given one if it is another. One row "as asked" where the criterion has no such
 * parameter or the render has no criterion. pairs: the parameters of the render's criterion.
 *
 * noisy: NULL, or the criterion that judges the noisy picture of a render that keeps the denoised one; then there are rows
 * of 8, 4 and 2 times what is just seen of what is kept, and two as asked, "denoised" and "noisy".
 *
 * Render, its criterion and log are borrowed until destroy. */
int pt_quote_create(const struct pt_render *render, const struct lull_pair *pairs, uint32_t pair_count,
                    const struct lull_criterion *noisy, struct base_log *log, struct pt_quote **out, struct base_err *err);
void pt_quote_destroy(struct pt_quote *quote);

/* After the pilot: asks about every block as it is and works out the answer. */
int pt_quote_finish(struct pt_quote *quote, struct pt_render *render, struct base_err *err);
/* Of a finished one: the row of what the options ask for, which is always there. */
const struct lull_host_quote_row *pt_quote_asked(const struct pt_quote *quote);

/* What the answer is told with, as text, as JSON and as a picture (quote_output.c). */
struct pt_quote_info {
    const char *scene;   /* path of the scene file */
    int64_t scene_bytes; /* memory of the scene */
    double load_s;       /* wall seconds until the first sample */
    int interrupted;     /* the pilot was */
};

/* The table for people and what stands out. The quote is finished; paths of the most expensive blocks are replayed. */
void pt_quote_text(FILE *out, const struct pt_quote *quote, const struct pt_render *render,
                   const struct pt_quote_info *info);
/* The same and every block. */
int pt_quote_json(FILE *out, const struct pt_quote *quote, const struct pt_render *render, const struct pt_quote_info *info,
                  struct base_err *err);
/* Predicted time of each block of the row as asked: thread seconds, or minutes when they are long. */
int pt_quote_map(const char *path, const struct pt_quote *quote, const struct pt_render *render, struct base_err *err);

/* "9.9 s", "1.7 min", "12 h"; "12,345", and "12,345+" where there may be more. Both return text. */
const char *pt_quote_duration(double s, char text[32]);
const char *pt_quote_thousands(double value, int more, char text[32]);

#endif
