/*
 * Scene text to tokens, across included files, each with its place; and what directives read of them besides parameters.
 *
 * Files form a stack: pt_lexer_include pushes one, tokens come from the top, its end pops it. A parameter list may therefore
 * go on in the including file. Token texts point into file buffers and are valid until the next call.
 */
#ifndef PT_PBRT_LEXER_H
#define PT_PBRT_LEXER_H

#include <stddef.h>

#include "scene/arena.h"
#include "pbrt/diag.h"
#include "pbrt/source.h"

enum pt_token_kind {
    PT_TOKEN_END,      /* of the outermost file */
    PT_TOKEN_FILE_END, /* of a file included with `scoped` */
    PT_TOKEN_WORD,     /* directive, number, true, false … */
    PT_TOKEN_STRING,   /* quotes removed, escapes resolved, NUL behind it */
    PT_TOKEN_OPEN,     /* [ */
    PT_TOKEN_CLOSE,    /* ] */
    PT_TOKEN_BAD       /* the diag has failed */
};
struct pt_token {
    int kind;
    const char *text;
    size_t length;
    struct pt_loc loc;
};

struct pt_lexer_file {
    char *bytes; /* owns */
    char *at, *end, *line_start;
    struct pt_loc loc; /* file and the current line */
    int scoped;
};

enum { PT_LEXER_DEPTH = 32 };

struct pt_lexer {
    const struct pt_source *source; /* borrows */
    struct pt_diag *diag;           /* borrows */
    struct pt_arena *arena;         /* borrows; file names in places outlive the lexer there */
    struct pt_lexer_file stack[PT_LEXER_DEPTH];
    int depth;
    struct pt_token ahead; /* looked at, not yet taken */
    int has_ahead;
    struct pt_loc taken, before;                       /* of the token taken last and of the one before it */
    int (*is_directive)(const struct pt_token *token); /* NULL: none is */
};

/* Opens `path` on top of the stack; `from` is where it is asked for. Refuses loops and more than PT_LEXER_DEPTH levels. */
int pt_lexer_include(struct pt_lexer *lexer, const char *path, struct pt_loc from, int scoped);
/* Takes the next token. */
struct pt_token pt_lexer_next(struct pt_lexer *lexer);
/* Looks at it. */
struct pt_token pt_lexer_peek(struct pt_lexer *lexer);
/* Whether `token` begins something else, so that what is being read is not all there. */
int pt_lexer_has_ended(const struct pt_lexer *lexer, const struct pt_token *token);
/* Where the fault is that the token taken last brought to light: in front of it if something is missing there, which may be
 * in another file. */
struct pt_loc pt_lexer_fault(const struct pt_lexer *lexer, const struct pt_token *token);
/* Reads a quoted string of less than `room` bytes, with or without brackets; `what` names it in errors. */
int pt_lexer_string(struct pt_lexer *lexer, const char *what, char *out, size_t room);
/* Reads so many numbers, with or without brackets; `what` names what needs them. */
int pt_lexer_numbers(struct pt_lexer *lexer, const char *what, int count, double *out);
/* Reads the value of an Option: a number, true, false or a string. `value`: NULL, or where it goes, which must then be a
 * whole number from 0 to 2^31 - 1. */
int pt_lexer_option(struct pt_lexer *lexer, const char *name, uint32_t *value);
void pt_lexer_release(struct pt_lexer *lexer);

/* Parses all of text[0, n) as a decimal number ("-1", "+.5", "3.", "1e-008"), whatever the locale; correctly rounded.
 * Returns 1, or 0 when it is no number or not finite. Thread-safe. */
int pt_number_parse(const char *text, size_t n, double *out);

#endif
