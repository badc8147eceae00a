#include "host/frame.h"

#include <string.h>

/* A text of lines "key=value\n". */
struct lines {
    const char *text;
    size_t size;
};

struct line {
    const char *text;   /* NULL: there is none */
    size_t length, key; /* of the whole line; of what stands before '=' */
};

/* The line at `from`; moves it on. */
static struct line next_line(const struct lines *l, size_t *from)
{
    struct line line = {0};
    if (*from >= l->size)
        return line;
    line.text = l->text + *from;
    const char *end = memchr(line.text, '\n', l->size - *from);
    line.length = end ? (size_t)(end - line.text) : l->size - *from;
    const char *equals = memchr(line.text, '=', line.length);
    line.key = equals ? (size_t)(equals - line.text) : line.length;
    *from += line.length + (end != NULL);
    return line;
}

static int same_key(const struct line *a, const struct line *b)
{
    return a->key == b->key && memcmp(a->text, b->text, a->key) == 0;
}

/* The n-th line with this line's key. */
static struct line find(const struct lines *l, const struct line *like, int n)
{
    struct line line;
    for (size_t from = 0; (line = next_line(l, &from)).text;)
        if (same_key(&line, like) && n-- == 0)
            break;
    return line;
}

/* The first line of `a` that `b` has not the same, and what it has instead. */
static struct line find_difference(const struct lines *a, const struct lines *b, struct line *instead)
{
    struct line line, before;
    for (size_t from = 0; (line = next_line(a, &from)).text;) {
        int n = 0;
        for (size_t at = 0; (before = next_line(a, &at)).text != line.text;)
            n += same_key(&before, &line);
        *instead = find(b, &line, n);
        if (!instead->text || instead->length != line.length || memcmp(instead->text, line.text, line.length) != 0)
            return line;
    }
    return line;
}

/* Could be printed: no control characters but the lines' ends, no byte that UTF-8 never has. */
static int is_text(const struct lines *l)
{
    for (size_t i = 0; i < l->size; i++) {
        unsigned char c = (unsigned char)l->text[i];
        if ((c < ' ' && c != '\n') || c == 0x7f || c == 0xc0 || c == 0xc1 || c > 0xf4)
            return 0;
    }
    return 1;
}

int32_t lull_host_same_identity(const char *saved, uint64_t saved_size, const char *present, const char *name,
                                struct lull_error *err)
{
    int32_t code = lull_host_given(err, "saved", saved, "present", present, "name", name, NULL);
    if (code != LULL_OK)
        return code;
    const struct lines theirs = {saved, (size_t)saved_size}, ours = {present, strlen(present)};
    struct line a, b, none = {0};
    if (!is_text(&theirs))
        return lull_error_set(err, LULL_E_VALUE, "%s: made with other settings", name);
    a = find_difference(&theirs, &ours, &b);
    if (!a.text) {
        b = find_difference(&ours, &theirs, &a);
        a = none;
        if (!b.text)
            return LULL_OK;
    }
    if (!b.text)
        return lull_error_set(err, LULL_E_VALUE, "%s: made with %.*s, but this render has no %.*s", name, (int)a.length,
                              a.text, (int)a.key, a.text);
    if (!a.text)
        return lull_error_set(err, LULL_E_VALUE, "%s: made without %.*s, but this render has %.*s", name, (int)b.key, b.text,
                              (int)b.length, b.text);
    return lull_error_set(err, LULL_E_VALUE, "%s: made with %.*s, but this render has %.*s", name, (int)a.length, a.text,
                          (int)b.length, b.text);
}
