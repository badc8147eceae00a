#define _GNU_SOURCE /* vasprintf */
#include "base/identity.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REALS = 16, SHOWN = 160 }; /* bytes of a line in a message: two of them and a path fit */

/* Can be printed in a line: no control character, no byte that UTF-8 never has. */
static int is_text(char of)
{
    const unsigned char c = (unsigned char)of;
    return c >= ' ' && c != 0x7f && c != 0xc0 && c != 0xc1 && c <= 0xf4;
}

/* Appends n bytes and, behind them, a NUL. */
static void append(struct base_identity *id, const char *bytes, size_t n)
{
    char *text = realloc(id->text, id->size + n + 1);
    id->failed |= !text;
    if (!text)
        return;
    if (n > 0)
        memcpy(text + id->size, bytes, n);
    id->text = text;
    id->size += n;
    text[id->size] = '\0';
}

void base_identity_add(struct base_identity *id, const char *key, const char *format, ...)
{
    va_list args;
    char *value;
    va_start(args, format);
    const int length = vasprintf(&value, format, args);
    va_end(args);
    id->failed |= length < 0;
    if (length < 0)
        return;
    for (char *c = value; *c; c++)
        if (!is_text(*c))
            *c = '?';
    append(id, key, strlen(key));
    append(id, "=", 1);
    append(id, value, (size_t)length);
    append(id, "\n", 1);
    free(value);
}

void base_identity_add_reals(struct base_identity *id, const char *key, const double *values, int count)
{
    char text[REALS * 25 + 1] = "";
    size_t used = 0;
    for (int i = 0; i < count && used < sizeof text; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, "%.17g ", values[i]);
    base_identity_add(id, key, "%s", text);
}

void base_identity_role(struct base_identity *id, const char *key, int role)
{
    int n = 0;
    while (n < BASE_IDENTITY_ROLES && id->roles[n].key)
        n++;
    if (n < BASE_IDENTITY_ROLES)
        id->roles[n] = (struct base_identity_role){key, role};
}

void base_identity_append(struct base_identity *id, const struct base_identity *other)
{
    append(id, other->text, other->size);
    id->failed |= other->failed;
}

int base_identity_check(const struct base_identity *id, struct base_err *err)
{
    return id->failed ? base_fail_nomem(err, "settings") : 0;
}

void base_identity_release(struct base_identity *id)
{
    free(id->text);
    *id = (struct base_identity){0};
}

struct line {
    const char *text;   /* NULL: there is none */
    size_t length, key; /* of the whole line; of what stands before '=' */
};

/* The line at `from`; moves it on. */
static struct line next_line(const struct base_identity *l, size_t *from)
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
static struct line find(const struct base_identity *l, const struct line *like, int n)
{
    struct line line;
    for (size_t from = 0; (line = next_line(l, &from)).text;)
        if (same_key(&line, like) && n-- == 0)
            break;
    return line;
}

static int role_of(const struct base_identity *id, const struct line *line)
{
    for (int i = 0; i < BASE_IDENTITY_ROLES && id->roles[i].key; i++)
        if (strlen(id->roles[i].key) == line->key && memcmp(id->roles[i].key, line->text, line->key) == 0)
            return id->roles[i].role;
    return BASE_DECIDES;
}

/* The first line of `a` that decides and that `b` has not the same, and what it has instead. */
static struct line find_difference(const struct base_identity *a, const struct base_identity *b,
                                   const struct base_identity *roles, struct line *instead, unsigned *changed)
{
    struct line line, before;
    for (size_t from = 0; (line = next_line(a, &from)).text;) {
        int n = 0;
        for (size_t at = 0; (before = next_line(a, &at)).text != line.text;)
            n += same_key(&before, &line);
        *instead = find(b, &line, n);
        if (instead->text && instead->length == line.length && memcmp(instead->text, line.text, line.length) == 0)
            continue;
        const int role = role_of(roles, &line);
        if (role == BASE_DECIDES)
            return line;
        *changed |= 1u << role;
    }
    return line;
}

static int are_text(const struct base_identity *l)
{
    for (size_t i = 0; i < l->size; i++)
        if (l->text[i] != '\n' && !is_text(l->text[i]))
            return 0;
    return 1;
}

/* "key=value" of a line as a message has it. */
static const char *show(const struct line *line, char text[SHOWN + 4])
{
    const int cut = line->length > SHOWN;
    snprintf(text, SHOWN + 4, "%.*s%s", cut ? SHOWN : (int)line->length, line->text, cut ? "..." : "");
    return text;
}

int base_identity_compare(const struct base_identity *ours, const char *theirs, size_t size, const char *name,
                          const struct base_identity_words *w, unsigned *changed, struct base_err *err)
{
    const struct base_identity a = {.text = (char *)(size_t)theirs, .size = size};
    struct line line, instead = {0};
    char one[SHOWN + 4], other[SHOWN + 4];
    unsigned unused = 0;
    unsigned *to = changed ? changed : &unused;
    *to = 0;
    if (!are_text(&a))
        return base_fail(err, BASE_EINVAL, "%s%s other settings", name, w->with);
    line = find_difference(&a, ours, ours, &instead, to);
    if (line.text && instead.text)
        return base_fail(err, BASE_EINVAL, "%s%s %s, but %s has %s", name, w->with, show(&line, one), w->here,
                         show(&instead, other));
    if (line.text)
        return base_fail(err, BASE_EINVAL, "%s%s %s, but %s has no %.*s", name, w->with, show(&line, one), w->here,
                         (int)line.key, line.text);
    line = find_difference(ours, &a, ours, &instead, to);
    if (line.text)
        return base_fail(err, BASE_EINVAL, "%s%s %.*s, but %s has %s", name, w->without, (int)line.key, line.text, w->here,
                         show(&line, one));
    return 0;
}
