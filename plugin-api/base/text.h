/* UTF-8, the lines of text tables, and names that tables can hold. Thread-safe. */
#ifndef BASE_TEXT_H
#define BASE_TEXT_H

#include <stddef.h>

#include "base/err.h"

/* Bytes of the character at the start of s (RFC 3629: no overlong forms, no surrogates): 1 to 4, or 0 where there is none
 * and at the end. */
int base_utf8_length(const char *s);

/* Puts '?' in the place of every byte that belongs to no character. */
void base_utf8_mend(char *s);

/* Bytes of the mark by which programs of Windows tell a UTF-8 text, U+FEFF at its start: 3, or 0 where there is none. */
size_t base_utf8_mark(const char *text, size_t size);

/* The lines of a text that people or spreadsheets wrote. They end in LF, CR LF or CR, each as it likes, and the last one in
 * nothing too. A mark in front is no part of the first one. */
struct base_lines {
    const char *name, *at, *end; /* borrows; name: of the file, for messages; at: behind the line given last */
    size_t number;               /* of that line, from 1 */
    int is_ended;                /* that line has an end */
};
void base_lines_init(struct base_lines *lines, const char *name, const char *text, size_t size);
/* The next line without its end; *line is NULL behind the last one. BASE_EINVAL: it has a byte 0, which no text has. */
int base_lines_next(struct base_lines *lines, const char **line, size_t *length, struct base_err *err);
/* So many follow. */
size_t base_lines_left(const struct base_lines *lines);

/* The name of a view in stop maps and manifests: the file's without folder and ending, with '_' for what a line
 * NAME;T0;T1;… or a folder's listing would take for something else: ';', '#', '"', control characters, bytes that are not
 * UTF-8, a leading dot. Never empty. Cut to room - 1 bytes. */
void base_view_name(const char *path, char *name, size_t room);

#endif
