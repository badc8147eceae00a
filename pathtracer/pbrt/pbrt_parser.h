/*
 * State of the parser that pbrt.c and pbrt_transform.c share. Private to them.
 */
#ifndef PT_PBRT_PBRT_PARSER_H
#define PT_PBRT_PBRT_PARSER_H

#include "pbrt/build.h"

enum { NAME_MAX_BYTES = 1024, STATE_DEPTH = 1024 };

struct frame {
    struct pt_state state;
    char kind; /* 'A'ttribute, 'T'ransform, 'O'bject, 'I'mport */
    struct pt_loc loc;
};

struct parser {
    struct pt_builder *b;
    struct pt_lexer lexer;
    struct pt_state state;
    struct pt_list frames;  /* struct frame */
    struct pt_list systems; /* struct pt_xform[2]: named coordinate systems */
    struct pt_names system_names;
    struct pt_params params;   /* of the current directive */
    struct pt_list attributes; /* struct pt_params *: owns what states point to */
    int in_world, ended;
};

typedef int directive(struct parser *p, struct pt_loc loc);

/* A quoted string, with or without brackets, of less than `room` bytes; `what` names it in errors. */
int pt_parser_read_string(struct parser *p, const char *what, char *out, size_t room);
/* `count` numbers, with or without brackets. */
int pt_parser_read_numbers(struct parser *p, const char *directive_name, double *out, int count);
/* Names a coordinate system. */
int pt_parser_save_system(struct parser *p, const char *name, const struct pt_xform ctm[2]);
/* The directive of that name that concerns transforms, or NULL. */
directive *pt_parser_transform_directive(const char *name, size_t length);

#endif
