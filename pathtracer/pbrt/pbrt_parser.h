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
    size_t named; /* pt_builder.name_undo.count when it was opened */
};

struct parser {
    struct pt_builder *b;
    struct pt_lexer lexer;
    struct pt_state state;
    struct pt_list frames;  /* struct frame */
    struct pt_list systems; /* struct pt_xform[2]: named coordinate systems */
    struct pt_names system_names;
    const struct directive *directive; /* the current one, its place, and what was read before it runs: */
    struct pt_loc loc;
    char name[NAME_MAX_BYTES];
    double numbers[16];
    struct pt_params params;
    struct pt_list attributes; /* struct pt_params *: owns what states point to */
    int in_world, ended;
};

/* Whose parameters are read before a directive runs, with those of an Attribute. */
enum directive_reads {
    READ_NOTHING,
    READ_PLAIN,
    READ_FOR_SHAPE, /* and on in the order of enum pt_attribute */
    READ_FOR_LIGHT,
    READ_FOR_MATERIAL,
    READ_FOR_MEDIUM
};

struct directive {
    const char *name;
    int (*run)(struct parser *p); /* NULL: the choice is ours */
    int in_world;                 /* refused before WorldBegin */
    /* what goes into parser.name, .numbers or .params first, or none of them: */
    const char *text; /* a quoted string, called so in errors */
    int numbers;      /* so many */
    enum directive_reads reads;
    /* of directives that share their function: */
    char block; /* frame.kind of what it opens or closes */
    enum pt_header header;
    int replaces; /* the transform instead of adding to it */
};

/* Messages with the place of the directive. */
#define pt_parser_fail(p, ...) pt_diag_fail(&(p)->b->diag, (p)->loc, __VA_ARGS__)
#define pt_parser_warn(p, ...) pt_diag_warn(&(p)->b->diag, (p)->loc, __VA_ARGS__)
/* Names a coordinate system. */
int pt_parser_save_system(struct parser *p, const char *name, const struct pt_xform ctm[2]);
/* The directives that concern transforms; ends with {0}. */
extern const struct directive pt_transform_directives[];

#endif
