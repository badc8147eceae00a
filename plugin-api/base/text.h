/* UTF-8, and names that tables can hold. Pure functions. */
#ifndef BASE_TEXT_H
#define BASE_TEXT_H

#include <stddef.h>

/* Bytes of the character at the start of s (RFC 3629: no overlong forms, no surrogates): 1 to 4, or 0 where there is none
 * and at the end. */
int base_utf8_length(const char *s);

/* Puts '?' in the place of every byte that belongs to no character. */
void base_utf8_mend(char *s);

/* Bytes of the mark by which programs of Windows tell a UTF-8 text, U+FEFF at its start: 3, or 0 where there is none. */
size_t base_utf8_mark(const char *text, size_t size);

/* The name of a view in stop maps and manifests: the file's without folder and ending, with '_' for what a line
 * NAME;T0;T1;… or a folder's listing would take for something else: ';', '#', '"', control characters, bytes that are not
 * UTF-8, a leading dot. Never empty. Cut to room - 1 bytes. */
void base_view_name(const char *path, char *name, size_t room);

#endif
