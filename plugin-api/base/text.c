#include "base/text.h"

#include <string.h>

#include "base/files.h"

int base_utf8_length(const char *s)
{
    const unsigned char *u = (const unsigned char *)s;
    if (u[0] == 0)
        return 0;
    if (u[0] < 0x80)
        return 1;
    int n = u[0] >= 0xc2 && u[0] <= 0xdf ? 2 : u[0] >= 0xe0 && u[0] <= 0xef ? 3 : u[0] >= 0xf0 && u[0] <= 0xf4 ? 4 : 0;
    for (int i = 1; i < n; i++)
        if ((u[i] & 0xc0) != 0x80)
            return 0;
    if ((u[0] == 0xe0 && u[1] < 0xa0) || (u[0] == 0xed && u[1] > 0x9f) || (u[0] == 0xf0 && u[1] < 0x90) ||
        (u[0] == 0xf4 && u[1] > 0x8f))
        return 0;
    return n;
}

void base_utf8_mend(char *s)
{
    while (*s != '\0') {
        int n = base_utf8_length(s);
        if (n == 0)
            *s = '?';
        s += n > 0 ? n : 1;
    }
}

size_t base_utf8_mark(const char *text, size_t size)
{
    static const char mark[] = "\xef\xbb\xbf";
    return size >= 3 && memcmp(text, mark, 3) == 0 ? 3 : 0;
}

void base_lines_init(struct base_lines *l, const char *name, const char *text, size_t size)
{
    *l = (struct base_lines){.name = name, .at = text + base_utf8_mark(text, size), .end = text + size};
}

/* Where the line at `at` ends, and where the next one begins. */
static const char *find_end(const char *at, const char *end, const char **next)
{
    while (at < end && *at != '\n' && *at != '\r')
        at++;
    *next = at + (at < end) + (at + 1 < end && at[0] == '\r' && at[1] == '\n');
    return at;
}

int base_lines_next(struct base_lines *l, const char **line, size_t *length, struct base_err *err)
{
    const char *begin = l->at, *stop;
    *line = NULL;
    if (begin == l->end)
        return 0;
    stop = find_end(begin, l->end, &l->at);
    l->number++;
    l->is_ended = stop < l->end;
    *length = (size_t)(stop - begin);
    if (memchr(begin, '\0', *length))
        return base_fail(err, BASE_EINVAL, "%s:%zu: has a byte 0 (expected a line of text, in UTF-8)", l->name, l->number);
    *line = begin;
    return 0;
}

size_t base_lines_left(const struct base_lines *l)
{
    size_t n = 0;
    for (const char *at = l->at; at < l->end; n++)
        find_end(at, l->end, &at);
    return n;
}

void base_view_name(const char *path, char *name, size_t room)
{
    const char *at = base_file_name(path), *dot = strrchr(at, '.');
    const char *end = dot && dot != at ? dot : at + strlen(at);
    char *out = name, *limit = name + room - 1;
    while (at < end) {
        int n = base_utf8_length(at);
        int plain = n > 1 || (n == 1 && (unsigned char)*at >= 0x20 && *at != 0x7f && !strchr(";#\"", *at));
        if (out + (n > 0 ? n : 1) > limit)
            break;
        if (plain) {
            memcpy(out, at, (size_t)n);
            out += n;
        } else
            *out++ = '_';
        at += n > 0 ? n : 1;
    }
    if (out == name && room > 1)
        *out++ = '_';
    *out = '\0';
    if (name[0] == '.')
        name[0] = '_';
}
