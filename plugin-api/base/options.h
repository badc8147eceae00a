/*
 * A command line as a table: one row says an option's name, what it takes, where that goes and what --help says about it.
 *
 *   static const struct base_option list[] = {
 *       {"window", 'w', "N", BASE_TO(struct settings, window), 2, 16, .help = "images per window (6)"},
 *       {"preset", 0, NULL, BASE_TO(struct settings, preset), .words = preset_names, .help = "networks and defaults"},
 *       {"json", 'j', NULL, BASE_TO(struct settings, json), .help = "print JSON"},
 *       {0}};
 *
 * The type of the member decides: int, uint32_t and uint64_t take an integer from min to max, double a number, const char *
 * the text itself (borrowed from argv). With `words` an integer member takes the index of the word; an int with neither
 * `arg` nor words is a flag. Not thread-safe (getopt).
 */
#ifndef BASE_OPTIONS_H
#define BASE_OPTIONS_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/files.h"
#include "base/identity.h"

enum base_store_type {
    BASE_STORE_NONE,
    BASE_STORE_INT,
    BASE_STORE_U32,
    BASE_STORE_U64,
    BASE_STORE_REAL,
    BASE_STORE_TEXT,
    BASE_STORE_TEXTS
};

struct base_store {
    enum base_store_type type;
    size_t offset; /* in the struct that base_options_parse fills */
    /* of BASE_STORE_TEXTS: offset of the int that counts them, room, and what so many are called */
    size_t count;
    int room;
    const char *things;
};

/* clang-format off */
#define BASE_TO(struct_type, member)                                                                                        \
    {_Generic(((struct_type *)0)->member, int: BASE_STORE_INT, uint32_t: BASE_STORE_U32, uint64_t: BASE_STORE_U64,          \
              double: BASE_STORE_REAL, const char *: BASE_STORE_TEXT), offsetof(struct_type, member), 0, 0, NULL}
/* For an option that may be repeated: a const char *member[…] and the int that counts how many are there. */
#define BASE_TO_LIST(struct_type, member, number, things)                                                                   \
    {BASE_STORE_TEXTS, offsetof(struct_type, member), offsetof(struct_type, number),                                        \
     (int)(sizeof ((struct_type *)0)->member / sizeof(const char *)), things}
/* clang-format on */

enum base_path { BASE_NO_PATH, BASE_FILE, BASE_FOLDER };
enum base_args { BASE_ARGS_PATHS, BASE_ARGS_FILES, BASE_ARGS_WORDS };

struct base_option {
    const char *name; /* long name without dashes; NULL: `help` is the heading of the rows that follow */
    int key;          /* short name, a letter, or 0 */
    const char *arg;  /* what --help calls the value; NULL: a flag, or the words */
    struct base_store to;
    double min, max; /* of a number, both allowed; a flag stores `min`, or 1 if that is 0 */
    const char *help;
    const char *const *words; /* ends with NULL. An integer: what may be said. Text: endings of a file's name */
    /* For all else: reads value (NULL for a flag) into the struct. Its error says what was expected; the option is put
     * before it. Out of memory is passed on as it is. */
    int (*set)(void *into, const char *value, struct base_err *err);
    int needed, hidden;    /* needed: text only; without it the command line is refused */
    int optional;          /* with `set`: the value, said by --name=VALUE, may be left out, and is NULL then */
    enum base_path input;  /* the value is read, if it is there: no output may take its place or go into its folder */
    enum base_path output; /* the value is written: refused when it cannot be, is an input, or is written twice */
    const struct base_file_kind *kind; /* of a file: refused when one of another kind is there; NULL: any is replaced */
    int role; /* in the identity of the result (base/identity.h): does another value make another one? */
    /* For a value of several parts, or a key of another name: appends its lines to the identity. */
    void (*identify)(const void *from, struct base_identity *to);
};

struct base_options {
    const char *doc;                  /* what the command does, and after "\v" what is printed below the options */
    const char *args_doc;             /* "SCENE.pbrt", "REFERENCE TEST", NULL if there are no arguments */
    const struct base_option *list;   /* ends with {0} */
    int args_min, args_max;           /* arguments that are no options */
    size_t args;                      /* offset of their const char *[args_max], borrowed from argv */
    int args_output;                  /* which of them, from 1, names a file to be written; 0: none */
    const char *(*mpi_version)(void); /* --version says which MPI there is; may be NULL */
    size_t arg_count;                 /* offset of an int that gets their number; 0: nobody asks */
    enum base_args args_are;          /* all but args_output: read, as files or folders or as files only; or mere words */
    size_t outputs;                   /* offset of a struct base_outputs that gets the files to be written; 0: nobody asks */
};

/* Fills *into from argv (whose order it may change); what is not on the command line stays as it was. --help, --usage and
 * --version print and exit. Otherwise 0, or BASE_EINVAL with one line that names the option. */
int base_options_parse(const struct base_options *options, int argc, char **argv, void *into, struct base_err *err);

/* Appends the lines of the options with a role, as `from` has them, and the roles of their names. */
void base_options_identify(const struct base_option *list, const void *from, struct base_identity *identity);

/* The parts, for values that are made of several: the whole text must be one number in [min, max]. 1 if it is. */
int base_parse_integer(const char *text, int64_t min, int64_t max, int64_t *out);
int base_parse_real(const char *text, double min, double max, double *out);
/* Width and height of blocks, WxH or N for both, each from 1 to most. */
int base_parse_block(const char *text, int most, int out[2]);
/* Index of the word that is text[0 … length), -1 if there is none. */
int base_word_index(const char *const *words, const char *text, size_t length);

#endif
