/* --quote: what a pilot says about the cost of a render, as text, as JSON and as a picture. */
#ifndef PT_QUOTE_OUTPUT_H
#define PT_QUOTE_OUTPUT_H

#include <stdio.h>

#include "base/err.h"
#include "render/quote.h"

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
