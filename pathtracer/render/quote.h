/*
 * What accuracy costs in this scene, before it is rendered: the quote of lull/host.h, told from a pilot, the first waves of
 * the render itself. Its rows differ in the criterion's quality parameter. Neither the film nor the render's own instance
 * changes. Not thread-safe.
 */
#ifndef PT_RENDER_QUOTE_H
#define PT_RENDER_QUOTE_H

#include <stdio.h>

#include "render/render.h"

struct pt_quote {
    struct lull_host_quote *quote;          /* owns; for the hooks of the pilot */
    const struct lull_host_quote_row *rows; /* the answer, of pt_quote_finish; borrows */
    uint32_t row_count;
    int threads;
};

/* With the rows of lull_host_quote_usual; noisy as there. The render is borrowed until destroy. */
int pt_quote_create(const struct pt_render *render, const struct lull_criterion *noisy, struct pt_quote **out,
                    struct base_err *err);
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
