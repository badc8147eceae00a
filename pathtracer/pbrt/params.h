/*
 * Parameter lists: `"type name" value` or `"type name" [ values ]`, in v4 and v3 spellings.
 *
 * Getters convert, check type, count and range, mark the parameter as used, and fail through the diag with the parameter's
 * place; they then return the default, so that callers may go on. Pointers that getters return live until the next
 * pt_params_clear. Not thread-safe.
 */
#ifndef PT_PBRT_PARAMS_H
#define PT_PBRT_PARAMS_H

#include <stddef.h>

#include "pbrt/lexer.h"

enum pt_param_type {
    PT_PARAM_INTEGER,
    PT_PARAM_FLOAT,
    PT_PARAM_POINT2,
    PT_PARAM_VECTOR2,
    PT_PARAM_POINT3,
    PT_PARAM_VECTOR3,
    PT_PARAM_NORMAL,
    PT_PARAM_BOOL,
    PT_PARAM_STRING,
    PT_PARAM_TEXTURE,
    PT_PARAM_RGB,
    PT_PARAM_XYZ,
    PT_PARAM_SPECTRUM,
    PT_PARAM_BLACKBODY
};

struct pt_param {
    size_t name; /* offset in text */
    int type;    /* enum pt_param_type */
    int is_text; /* values are strings (always for STRING, TEXTURE; SPECTRUM by name) */
    int used;
    int inherited;       /* from an Attribute directive: not an error when unused */
    int colour_space;    /* 1 + enum pt_colour_space, where an Attribute was given; 0: that of the directive */
    size_t first, count; /* range in numbers */
    struct pt_loc loc;
};

struct pt_params {
    struct pt_diag *diag;   /* borrows */
    struct pt_loc loc;      /* of the directive */
    size_t kind;            /* offset in text of what the directive names: "trianglemesh", "diffuse" … */
    struct pt_param *items; /* owns */
    size_t count, room;
    double *numbers; /* owns; of a string its offset in text */
    size_t number_count, number_room;
    char *text; /* owns: names and strings, each with its end mark */
    size_t text_count, text_room;
};

/* Empties, keeps the memory, and starts a list for the directive at `loc`, which names `kind`. */
void pt_params_clear(struct pt_params *params, struct pt_diag *diag, struct pt_loc loc, const char *kind);
void pt_params_release(struct pt_params *params);
const char *pt_params_kind(const struct pt_params *params);
/* Whether a string has two words, as those that declare a parameter. */
int pt_params_declares(const struct pt_token *token);
/* Reads the list that follows a directive. */
int pt_params_read(struct pt_params *params, struct pt_lexer *lexer);
/* Appends copies of all of `from` as inherited parameters (they give way to those already there). */
int pt_params_append(struct pt_params *params, const struct pt_params *from);
/* Fails for the first parameter that nothing asked for: unknown names are errors. Names that pbrt knows elsewhere, and all
 * of v3, warn. */
void pt_params_check_used(struct pt_params *params);

/* The parameter called `name`, or NULL; does not mark it. */
struct pt_param *pt_params_find(const struct pt_params *params, const char *name);
/* Its place; that of the directive when absent, and for NULL. */
struct pt_loc pt_params_loc(const struct pt_params *params, const char *name);
/* Messages with that place. */
#define pt_params_fail(params, name, ...) pt_diag_fail((params)->diag, pt_params_loc(params, name), __VA_ARGS__)
#define pt_params_warn(params, name, ...) pt_diag_warn((params)->diag, pt_params_loc(params, name), __VA_ARGS__)
const char *pt_param_name(const struct pt_params *params, const struct pt_param *param);
/* 1 when it has so many values; else fails. */
int pt_param_has(const struct pt_params *params, const struct pt_param *param, size_t count);
/* Whether `name` is one of `names`, which are separated by blanks. */
int pt_name_is_in(const char *names, const char *name);
/* Marks as used what is known and has no effect here. Names are separated by blanks. */
void pt_params_ignore(struct pt_params *params, const char *names);

double pt_params_float(struct pt_params *params, const char *name, double fallback);
/* 1 when the value v of a parameter is in [low, high]; else fails. */
int pt_params_expect_in(struct pt_params *params, const char *name, double v, double low, double high);
/* Fails outside [low, high]. */
double pt_params_float_in(struct pt_params *params, const char *name, double fallback, double low, double high);
int pt_params_int_in(struct pt_params *params, const char *name, int fallback, int low, int high);
int pt_params_bool(struct pt_params *params, const char *name, int fallback);
const char *pt_params_string(struct pt_params *params, const char *name, const char *fallback);
/* 1 and xyz when given, else 0 and xyz untouched. */
int pt_params_point(struct pt_params *params, const char *name, double xyz[3]);
/* Arrays: NULL and *count = 0 when absent or empty. `components`: 1 for floats, 2 or 3 for points; *count is in those. */
const double *pt_params_floats(struct pt_params *params, const char *name, size_t components, size_t *count);
/* Whole numbers, each in [-2^31, 2^31). */
const double *pt_params_ints(struct pt_params *params, const char *name, size_t *count);
/* String i of an array of strings. */
const char *pt_params_string_at(const struct pt_params *params, const struct pt_param *param, size_t i);

#endif
