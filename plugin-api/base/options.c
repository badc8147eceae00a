#include "base/options.h"

#include <argp.h>
#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/paths.h"
#include "base/version.h"

enum { EXIT_UNWRITTEN = 2, MAX_OPTIONS = 96, KEY_LONG = 256, KEY_USAGE = KEY_LONG + MAX_OPTIONS, KEY_HELP, KEY_VERSION };

/* strtol and strtod pass over blanks before a number; an argument that has some is none. */
static int begins_blank(const char *text) { return isspace((unsigned char)*text) != 0; }

int base_parse_integer(const char *text, int64_t min, int64_t max, int64_t *out)
{
    char *end;
    errno = 0;
    long long v = strtoll(text, &end, 10);
    if (begins_blank(text) || end == text || *end || errno || v < min || v > max)
        return 0;
    *out = v;
    return 1;
}

int base_parse_real(const char *text, double min, double max, double *out)
{
    char *end;
    double v = strtod(text, &end);
    if (begins_blank(text) || end == text || *end || !(v >= min && v <= max))
        return 0;
    *out = v;
    return 1;
}

int base_parse_block(const char *text, int most, int out[2])
{
    char width[24];
    const size_t n = strcspn(text, "x");
    int64_t w, h;
    snprintf(width, sizeof width, "%.*s", n < sizeof width ? (int)n : 0, text);
    if (!base_parse_integer(width, 1, most, &w) || !base_parse_integer(text[n] ? text + n + 1 : width, 1, most, &h))
        return 0;
    out[0] = (int)w;
    out[1] = (int)h;
    return 1;
}

int base_word_index(const char *const *words, const char *text, size_t length)
{
    for (int i = 0; words[i]; i++)
        if (strlen(words[i]) == length && !memcmp(words[i], text, length))
            return i;
    return -1;
}

static int is_flag(const struct base_option *o) { return !o->arg && !o->words; }
static int is_text(const struct base_option *o) { return o->to.type == BASE_STORE_TEXT || o->to.type == BASE_STORE_TEXTS; }

/* "a, b or c" with other text between words, and before the last, and before each. */
static void join(const char *const *words, const char *between, const char *last, const char *before, char *text,
                 size_t room)
{
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; words[i] && used < room; i++) {
        const char *joint = i == 0 ? "" : words[i + 1] ? between : last;
        used += (size_t)snprintf(text + used, room - used, "%s%s%s", joint, before, words[i]);
    }
}

static int has_ending(const struct base_option *o, const char *name)
{
    for (int i = 0; o->words[i]; i++) {
        size_t n = strlen(name), k = strlen(o->words[i]);
        if (n > k + 1 && name[n - k - 1] == '.' && !strcasecmp(name + n - k, o->words[i]))
            return 1;
    }
    return 0;
}

static int store_integer(const struct base_option *o, void *at, const char *value)
{
    int64_t v;
    if (is_flag(o))
        v = o->min != 0.0 ? (int64_t)o->min : 1;
    else if (o->words)
        v = base_word_index(o->words, value, strlen(value));
    else if (!base_parse_integer(value, (int64_t)o->min, (int64_t)o->max, &v))
        return 0;
    if (v < 0 && o->words)
        return 0;
    if (o->to.type == BASE_STORE_INT)
        *(int *)at = (int)v;
    else if (o->to.type == BASE_STORE_U32)
        *(uint32_t *)at = (uint32_t)v;
    else
        *(uint64_t *)at = (uint64_t)v;
    return 1;
}

/* 1 when the value fits. */
static int store(const struct base_option *o, void *into, const char *value)
{
    void *at = (char *)into + o->to.offset;
    if (o->to.type == BASE_STORE_REAL)
        return base_parse_real(value, o->min, o->max, at);
    if (is_text(o) && o->words && !has_ending(o, value))
        return 0;
    if (o->to.type == BASE_STORE_TEXTS) {
        int *n = (int *)(void *)((char *)into + o->to.count), full = *n == o->to.room;
        if (!full)
            ((const char **)at)[(*n)++] = value;
        return !full;
    }
    if (o->to.type != BASE_STORE_TEXT)
        return store_integer(o, at, value);
    *(const char **)at = value;
    return 1;
}

static int bad_value(const struct base_option *o, const char *value, struct base_err *err)
{
    char words[256];
    if (o->words && !(is_text(o) && has_ending(o, value))) {
        join(o->words, ", ", " or ", is_text(o) ? "." : "", words, sizeof words);
        return base_fail(err, BASE_EINVAL, "--%s %s: expected %s%s", o->name, value,
                         is_text(o) ? "a name that ends in " : "", words);
    }
    if (o->to.type == BASE_STORE_TEXTS)
        return base_fail(err, BASE_EINVAL, "--%s %s: more than %d %s", o->name, value, o->to.room, o->to.things);
    if (o->to.type == BASE_STORE_REAL)
        return base_fail(err, BASE_EINVAL, "--%s %s: expected a number from %g to %g", o->name, value, o->min, o->max);
    return base_fail(err, BASE_EINVAL, "--%s %s: expected an integer from %.0f to %.0f", o->name, value, o->min, o->max);
}

static int take(const struct base_option *o, void *into, const char *value, struct base_err *err)
{
    struct base_err why = {0};
    if (!o->set)
        return store(o, into, value) ? 0 : bad_value(o, value, err);
    int rc = o->set(into, value, &why);
    if (rc == BASE_ENOMEM)
        return base_fail(err, rc, "%s", why.text);
    return rc ? base_fail(err, rc, "--%s%s%s: %s", o->name, value ? " " : "", value ? value : "", why.text) : 0;
}

static const struct base_option *find(const struct base_option *list, int key)
{
    if (key >= KEY_LONG && key < KEY_USAGE)
        return &list[key - KEY_LONG];
    for (; list->name || list->help; list++)
        if (list->name && list->key == key)
            return list;
    return NULL;
}

static void add_option(struct base_identity *id, const struct base_option *o, const void *from)
{
    const void *at = (const char *)from + o->to.offset;
    switch (o->to.type) {
    case BASE_STORE_INT: base_identity_add(id, o->name, "%d", *(const int *)at); return;
    case BASE_STORE_U32: base_identity_add(id, o->name, "%lu", (unsigned long)*(const uint32_t *)at); return;
    case BASE_STORE_U64: base_identity_add(id, o->name, "%llu", (unsigned long long)*(const uint64_t *)at); return;
    case BASE_STORE_REAL: base_identity_add(id, o->name, "%.17g", *(const double *)at); return;
    case BASE_STORE_TEXT:
        base_identity_add(id, o->name, "%s", *(const char *const *)at ? *(const char *const *)at : "");
        return;
    case BASE_STORE_TEXTS:
        for (int i = 0; i < *(const int *)(const void *)((const char *)from + o->to.count); i++)
            base_identity_add(id, o->name, "%s", ((const char *const *)at)[i]);
        return;
    case BASE_STORE_NONE: return; /* its row identifies it */
    }
}

void base_options_identify(const struct base_option *list, const void *from, struct base_identity *id)
{
    for (const struct base_option *o = list; o->name || o->help; o++) {
        if (o->role > BASE_DECIDES)
            base_identity_role(id, o->name, o->role);
        if (o->role != BASE_NO_IDENTITY && o->identify)
            o->identify(from, id);
        else if (o->role != BASE_NO_IDENTITY)
            add_option(id, o, from);
    }
}

/* What --help calls the value, or the words: a|b|c. */
static const char *value_name(const struct base_option *o, char *text, size_t room)
{
    if (o->arg || !o->words)
        return o->arg;
    join(o->words, "|", "|", "", text, room);
    return text;
}

static void print_help(const struct base_options *options, const char *program, unsigned flags)
{
    static struct argp_option rows[MAX_OPTIONS + 4];
    static char names[MAX_OPTIONS][96];
    int n = 0, group = 0;
    for (const struct base_option *o = options->list; o->name || o->help; o++, n++) {
        const int key = o->key ? o->key : KEY_LONG + n;
        group += !o->name;
        rows[n] = (struct argp_option){.name = o->name,
                                       .doc = o->help,
                                       .group = group,
                                       .key = o->name ? key : 0,
                                       .arg = value_name(o, names[n], sizeof names[n]),
                                       .flags = (o->hidden ? OPTION_HIDDEN : 0) | (o->optional ? OPTION_ARG_OPTIONAL : 0)};
    }
    rows[n++] = (struct argp_option){.name = "help", .key = '?', .doc = "Print this and exit", .group = -1};
    rows[n++] = (struct argp_option){.name = "usage", .key = KEY_USAGE, .doc = "Print a short usage and exit", .group = -1};
    rows[n] = (struct argp_option){.name = "version",
                                   .doc = "Print the version and exit",
                                   .group = -1,
                                   .key = find(options->list, 'V') ? KEY_VERSION : 'V'};
    const struct argp argp = {.options = rows, .args_doc = options->args_doc, .doc = options->doc};
    argp_help(&argp, stdout, flags, (char *)(size_t)program);
}

_Noreturn static void answer(const struct base_options *options, const char *program, int key)
{
    if (key == KEY_VERSION) {
        printf("%.*s (Lull) %s\n", (int)strcspn(program, " "), program, BASE_VERSION);
        if (options->mpi_version)
            printf("MPI: %s\n", options->mpi_version());
    } else if (key == KEY_USAGE)
        print_help(options, program, ARGP_HELP_USAGE);
    else
        print_help(options, program, ARGP_HELP_SHORT_USAGE | ARGP_HELP_LONG | ARGP_HELP_DOC);
    if (!fflush(stdout) && !ferror(stdout))
        exit(EXIT_SUCCESS);
    fprintf(stderr, "%s: cannot write standard output\n", program);
    exit(EXIT_UNWRITTEN);
}

struct getopt_form {
    struct option longs[MAX_OPTIONS + 4];
    char shorts[2 * MAX_OPTIONS + 4];
};

/* Every option answers with KEY_LONG + its row, or its letter. The ':' tells a missing value from an unknown option. */
static void to_getopt(const struct base_option *list, struct getopt_form *form)
{
    char *s = form->shorts;
    int n = 0;
    *s++ = ':';
    for (int i = 0; list[i].name || list[i].help; i++) {
        if (!list[i].name)
            continue;
        int has_value = is_flag(&list[i]) ? no_argument : list[i].optional ? optional_argument : required_argument;
        form->longs[n++] = (struct option){list[i].name, has_value, NULL, KEY_LONG + i};
        if (list[i].key) {
            *s++ = (char)list[i].key;
            if (has_value == required_argument)
                *s++ = ':';
        }
    }
    *s = '\0';
    form->longs[n++] = (struct option){"help", no_argument, NULL, KEY_HELP};
    form->longs[n++] = (struct option){"usage", no_argument, NULL, KEY_USAGE};
    form->longs[n++] = (struct option){"version", no_argument, NULL, KEY_VERSION};
    form->longs[n] = (struct option){0};
}

/* What getopt did not like. `token` is the argument that it was at. */
static int bad_option(int key, const char *token, struct base_err *err)
{
    if (key == ':')
        return base_fail(err, BASE_EINVAL, "%s: a value is needed (--help says more)", token);
    if (optopt >= KEY_LONG)
        return base_fail(err, BASE_EINVAL, "%s: this option takes no value", token);
    if (optopt)
        return base_fail(err, BASE_EINVAL, "-%c: unknown option (--help lists the options)", optopt);
    return base_fail(err, BASE_EINVAL, "%s: unknown option, or the beginning of several (--help lists the options)", token);
}

static int take_arguments(const struct base_options *options, int count, char **argv, void *into, struct base_err *err)
{
    if (count > options->args_max)
        return base_fail(err, BASE_EINVAL, "%s: one argument too many; expected %s", argv[options->args_max],
                         options->args_doc ? options->args_doc : "options only");
    if (count < options->args_min)
        return base_fail(err, BASE_EINVAL, "expected %s (--help says more)", options->args_doc);
    for (int i = 0; i < count; i++)
        ((const char **)(void *)((char *)into + options->args))[i] = argv[i];
    if (options->arg_count)
        *(int *)(void *)((char *)into + options->arg_count) = count;
    return 0;
}

static const char *text_of(const struct base_option *o, const void *into)
{
    return o->to.type == BASE_STORE_TEXT ? *(const char *const *)(const void *)((const char *)into + o->to.offset) : NULL;
}

/* What is to be read and written, as far as the command line says so. */
struct files {
    struct base_inputs inputs;
    struct base_outputs outputs;
};

/* A folder in the place of a file is refused by who reads it. */
static int add_input(struct files *files, const char *path, enum base_path what, struct base_err *err)
{
    return what == BASE_FILE && base_file_check_input(path, NULL) != 0 ? 0 : base_inputs_add(&files->inputs, path, err);
}

static int note_files(const struct base_options *options, const void *into, struct files *files, struct base_err *err)
{
    int rc = 0;
    for (const struct base_option *o = options->list; !rc && (o->name || o->help); o++) {
        const char *text = text_of(o, into);
        if (o->needed && !text)
            rc = base_fail(err, BASE_EINVAL, "--%s %s is needed (--help says more)", o->name, o->arg);
        else if (o->output == BASE_FILE)
            rc = base_outputs_add(&files->outputs, o->name, text, err);
        else if (o->input && text)
            rc = add_input(files, text, o->input, err);
    }
    for (int i = 0; i < options->args_max && !rc && options->args_are != BASE_ARGS_WORDS; i++) {
        const char *arg = ((const char *const *)(const void *)((const char *)into + options->args))[i];
        if (i + 1 == options->args_output)
            rc = base_outputs_add(&files->outputs, "output", arg, err);
        else if (arg)
            rc = add_input(files, arg, options->args_are == BASE_ARGS_FILES ? BASE_FILE : BASE_FOLDER, err);
    }
    return rc;
}

/* Outputs that cannot be written, or that would take the place of an input or of each other, are found before the work. */
static int check_files(const struct base_options *options, void *into, struct files *files, struct base_err *err)
{
    int rc = note_files(options, into, files, err);
    if (!rc)
        rc = base_outputs_protect(&files->outputs, &files->inputs, err);
    for (const struct base_option *o = options->list; !rc && (o->name || o->help); o++)
        if (o->output == BASE_FOLDER && text_of(o, into))
            rc = base_outputs_protect_folder(text_of(o, into), &files->inputs, err);
        else if (o->kind)
            rc = base_file_check_kind(text_of(o, into), o->kind, err);
    if (!rc && options->outputs)
        *(struct base_outputs *)(void *)((char *)into + options->outputs) = files->outputs;
    return rc;
}

static int parse(const struct base_options *options, int argc, char **argv, void *into, struct files *files,
                 struct base_err *err)
{
    struct getopt_form form;
    const char *program = base_file_name(argv[0]);
    to_getopt(options->list, &form);
    optind = 0;
    opterr = 0;
    for (int key; (optopt = 0, key = getopt_long(argc, argv, form.shorts, form.longs, NULL)) != -1;) {
        const char *token = argv[optind - 1];
        if (key == '?' && (optopt == '?' || optopt == 'V')) /* letters that mean this where no option has taken them */
            key = optopt == '?' ? KEY_HELP : KEY_VERSION;
        if (key >= KEY_USAGE)
            answer(options, program, key);
        if (key == ':' || key == '?')
            return bad_option(key, token, err);
        const struct base_option *o = find(options->list, key);
        const int several = o->set || o->to.type == BASE_STORE_TEXTS; /* or only a part: values are met one by one */
        int rc = take(o, into, optarg, err);
        if (!rc && several && o->input)
            rc = add_input(files, optarg, o->input, err);
        else if (!rc && several && o->output)
            rc = base_outputs_add(&files->outputs, o->name, optarg, err);
        if (rc)
            return rc;
    }
    int rc = take_arguments(options, argc - optind, argv + optind, into, err);
    return rc ? rc : check_files(options, into, files, err);
}

int base_options_parse(const struct base_options *options, int argc, char **argv, void *into, struct base_err *err)
{
    struct files files = {.inputs = BASE_INPUTS_EMPTY};
    int rc = parse(options, argc, argv, into, &files, err);
    base_inputs_release(&files.inputs);
    return rc;
}
