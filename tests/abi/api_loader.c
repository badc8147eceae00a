/*
 * Finding, loading and checking criteria, good ones and broken ones (tests/abi/plugins).
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include <lull/loader.h>

#if defined(__SSE__)
#include <xmmintrin.h>

#include "support/api_folders.h"
#endif

static char plugins[2048];  /* tests/abi/plugins of this build */
static char criteria[2048]; /* lib/lull of this build */
static char scratch[2048];  /* a directory of our own */

static const char *in_dir(const char *dir, const char *name)
{
    static char paths[4][4200];
    static unsigned turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", dir, name);
    return path;
}

static struct {
    char text[8192];
    int lines;
} log_seen;

static void take_log(void *context, int32_t level, const char *text)
{
    (void)level;
    assert_null(context);
    size_t used = strlen(log_seen.text);
    snprintf(log_seen.text + used, sizeof log_seen.text - used, "%s\n", text);
    log_seen.lines++;
}

static int32_t open_in(const char *dirs, const char *spec, struct lull_found *found, struct lull_error *err)
{
    const char *list[] = {NULL, "", dirs};
    struct lull_search search = {.dirs = list, .dir_count = 3, .log = take_log};
    memset(&log_seen, 0, sizeof log_seen);
    memset(found, 0, sizeof *found);
    *err = (struct lull_error){.struct_size = sizeof *err};
    return lull_open(&search, spec, found, err);
}

static void assert_opens(const char *dirs, const char *spec, const char *id)
{
    struct lull_found found;
    struct lull_error err;
    if (open_in(dirs, spec, &found, &err) != LULL_OK)
        fail_msg("%s: %s", spec, err.message);
    assert_string_equal(found.criterion->id, id);
    assert_true(found.path[0] != '\0');
}

static void assert_refused(const char *dirs, const char *spec, int32_t status, const char *part)
{
    struct lull_found found;
    struct lull_error err;
    int32_t got = open_in(dirs, spec, &found, &err);
    if (got != status || err.code != status || !strstr(err.message, part))
        fail_msg("%s: status %d (expected %d), message '%s' (expected '%s')", spec, got, status, err.message, part);
    assert_null(found.criterion);
    assert_int_equal(found.path[0], '\0');
}

/* --- finding --------------------------------------------------------------------------------------------------------- */

static void opens_by_path_and_id(void **state)
{
    (void)state;
    assert_opens("", in_dir(plugins, "pair.so"), "first-of-pair");
    assert_opens("", in_dir(plugins, "pair.so:second-of-pair"), "second-of-pair");
    assert_opens("", in_dir(plugins, "pair.so:first-of-pair"), "first-of-pair");
    assert_refused("", in_dir(plugins, "pair.so:third"), LULL_E_KEY, "third");
    assert_refused("", in_dir(plugins, "pair.so:"), LULL_E_INVALID, "PATH:ID");
    assert_refused("", in_dir(plugins, "none.so"), LULL_E_IO, "no such file");
}

static void opens_by_name(void **state)
{
    (void)state;
    assert_opens(criteria, "null", "null");
    assert_opens(criteria, "halfbuf", "halfbuf");
    assert_opens(criteria, "halfbuf:halfbuf", "halfbuf");
    /* a file of that name that holds others only is another criterion: none is taken in its place */
    assert_refused(plugins, "pair", LULL_E_KEY,
                   "pair.so: holds no criterion with the id pair, but first-of-pair, second-of-pair");
    assert_opens(plugins, "pair:second-of-pair", "second-of-pair");
    assert_refused(criteria, "no-such", LULL_E_IO, "no-such");
    assert_refused(criteria, "null:other", LULL_E_KEY, "other");
    assert_refused("", "null", LULL_E_IO, "null"); /* nowhere to look: in particular not in the current directory */
}

static void opens_an_id_of_a_library_with_another_name(void **state)
{
    (void)state;
    char dir[2100], to[4200];
    snprintf(dir, sizeof dir, "%s/ids", scratch);
    snprintf(to, sizeof to, "%s/other-name.so", dir);
    assert_int_equal(mkdir(dir, 0700), 0);
    assert_int_equal(symlink(in_dir(plugins, "pair.so"), to), 0);
    assert_opens(dir, "second-of-pair", "second-of-pair");
    unlink(to);
    rmdir(dir);
}

static void directories_are_joined_and_ordered(void **state)
{
    (void)state;
    char joined[8000], hidden[4200];
    snprintf(joined, sizeof joined, "/no/such/dir::%s:%s", plugins, criteria);
    assert_opens(joined, "pair:first-of-pair", "first-of-pair");
    assert_opens(joined, "fixed", "fixed");
    /* a library called null.so in an earlier directory hides the later one, and is asked for its id */
    snprintf(hidden, sizeof hidden, "%s/null.so", scratch);
    assert_int_equal(symlink(in_dir(plugins, "pair.so"), hidden), 0);
    snprintf(joined, sizeof joined, "%s:%s", scratch, criteria);
    assert_refused(joined, "null", LULL_E_KEY, "null.so: holds no criterion with the id null, but first-of-pair");
    assert_opens(joined, "null:second-of-pair", "second-of-pair");
    unlink(hidden);
}

static void without_directories_the_usual_ones_are_searched(void **state)
{
    (void)state;
    struct lull_search usual = {.log = take_log};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    unsetenv("LULL_PLUGIN_PATH"); /* no lib/lull beside the tests */
    assert_int_equal(lull_open(&usual, "pair:first-of-pair", &found, &err), LULL_E_IO);
    assert_int_equal(setenv("LULL_PLUGIN_PATH", plugins, 1), 0);
    assert_int_equal(lull_open(&usual, "pair:first-of-pair", &found, &err), LULL_OK);
    assert_string_equal(found.criterion->id, "first-of-pair");
    unsetenv("LULL_PLUGIN_PATH");
}

static void bad_specs_are_refused(void **state)
{
    (void)state;
    struct lull_found found;
    struct lull_error err;
    assert_int_equal(open_in(criteria, "", &found, &err), LULL_E_INVALID);
    assert_int_equal(open_in(criteria, NULL, &found, &err), LULL_E_INVALID);
    assert_int_equal(open_in(criteria, ":x", &found, &err), LULL_E_INVALID);
    char *longest = malloc(3 * LULL_PATH_MAX);
    assert_non_null(longest);
    memset(longest, 'a', 3 * LULL_PATH_MAX - 1);
    longest[3 * LULL_PATH_MAX - 1] = '\0';
    assert_int_equal(open_in(criteria, longest, &found, &err), LULL_E_INVALID);
    longest[LULL_PATH_MAX - 9] = '\0';
    assert_int_equal(open_in(criteria, longest, &found, &err), LULL_E_IO);
    free(longest);
    assert_int_equal(lull_open(NULL, "null", &found, NULL), LULL_E_IO); /* no search, no error struct */
    assert_int_equal(lull_open(NULL, in_dir(criteria, "null.so"), &found, NULL), LULL_OK);
}

static int32_t collect(void *context, const struct lull_found *found)
{
    char *text = context;
    snprintf(text + strlen(text), 4000 - strlen(text), "%s ", found->criterion->id);
    return strcmp(found->criterion->id, "first-of-pair") == 0 && strstr(text, "stop!") ? 42 : 0;
}

static void lists_what_is_good(void **state)
{
    (void)state;
    char names[4000] = "", dir[2100], to[4200];
    snprintf(dir, sizeof dir, "%s/list", scratch);
    assert_int_equal(mkdir(dir, 0700), 0);
    const char *const libraries[] = {"pair.so", "empty.so", "twin_ids.so", "no_entry.so", "two_symbols.so"};
    for (int i = 0; i < 5; i++) {
        snprintf(to, sizeof to, "%s/%s", dir, libraries[i]);
        assert_int_equal(symlink(in_dir(plugins, libraries[i]), to), 0);
    }
    const char *list[] = {dir, dir};
    struct lull_search search = {.dirs = list, .dir_count = 2, .log = take_log};
    memset(&log_seen, 0, sizeof log_seen);
    assert_int_equal(lull_list(&search, collect, names), LULL_OK);
    assert_string_equal(names, "first-of-pair second-of-pair two-symbols ");
    assert_int_equal(log_seen.lines, 3); /* the broken ones, once each */
    assert_non_null(strstr(log_seen.text, "empty.so"));
    assert_non_null(strstr(log_seen.text, "twin_ids.so"));
    assert_non_null(strstr(log_seen.text, "no_entry.so"));
    snprintf(names, sizeof names, "stop!");
    assert_int_equal(lull_list(&search, collect, names), 42);
    assert_string_equal(names, "stop!first-of-pair ");
    for (int i = 0; i < 5; i++) {
        snprintf(to, sizeof to, "%s/%s", dir, libraries[i]);
        unlink(to);
    }
    rmdir(dir);
}

/* --- broken libraries ------------------------------------------------------------------------------------------------ */

static void broken_libraries_are_refused(void **state)
{
    (void)state;
    assert_refused("", in_dir(plugins, "no_entry.so"), LULL_E_VERSION, LULL_ENTRY_NAME);
    assert_refused("", in_dir(plugins, "unresolved.so"), LULL_E_IO, "function_that_nobody_has");
    assert_refused("", in_dir(plugins, "short_table.so"), LULL_E_VERSION, "1.0");
    assert_refused("", in_dir(plugins, "twin_ids.so"), LULL_E_INVALID, "twin");
    assert_refused("", in_dir(plugins, "endless.so"), LULL_E_INVALID, "never ends");
    assert_refused("", in_dir(plugins, "empty.so"), LULL_E_INVALID, "no criterion");
}

static void write_bytes(const char *path, const char *bytes, size_t size)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, size, f), size);
    assert_int_equal(fclose(f), 0);
}

/* A library cut short at any length is refused and does not end the process (dlopen alone dies of SIGBUS). */
static void cut_libraries_are_refused(void **state)
{
    (void)state;
    FILE *f = fopen(in_dir(criteria, "null.so"), "rb");
    assert_non_null(f);
    static char bytes[1 << 22];
    size_t size = fread(bytes, 1, sizeof bytes, f);
    fclose(f);
    assert_true(size > 4096 && size < sizeof bytes);
    char path[4200];
    snprintf(path, sizeof path, "%s/cut.so", scratch);
    const size_t lengths[] = {0, 1, 15, 16, 63, 64, 100, 300, 1000, 4096};
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
        write_bytes(path, bytes, lengths[i]);
        assert_refused("", path, LULL_E_IO, "cut.so");
        unlink(path);
    }
    write_bytes(path, "#!/bin/sh\necho no\n", 18);
    assert_refused("", path, LULL_E_IO, "not a shared object");
    unlink(path);
    bytes[4] ^= 3; /* the other word size */
    write_bytes(path, bytes, size);
    assert_refused("", path, LULL_E_IO, "word size");
    unlink(path);
    assert_refused("", in_dir(scratch, "."), LULL_E_IO, "not a regular file");
}

static void side_effects_of_loading_are_told(void **state)
{
    (void)state;
    struct lull_found found;
    struct lull_error err;
#if defined(__SSE__)
    unsigned before = _mm_getcsr() & ~0x3fu;
    assert_int_equal(open_in("", in_dir(plugins, "fp_on_load.so"), &found, &err), LULL_OK);
    assert_int_equal(_mm_getcsr() & ~0x3fu, before);
    assert_non_null(strstr(log_seen.text, "floating-point control register"));
#endif
    assert_int_equal(open_in("", in_dir(plugins, "thread_on_load.so"), &found, &err), LULL_OK);
    assert_non_null(strstr(log_seen.text, "thread"));
    assert_int_equal(open_in("", in_dir(plugins, "pair.so"), &found, &err), LULL_OK);
    assert_int_equal(log_seen.lines, 0);
}

/* --- tables ---------------------------------------------------------------------------------------------------------- */

static void tables_are_checked(void **state)
{
    (void)state;
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    assert_int_equal(open_in(criteria, "halfbuf", &found, &err), LULL_OK);
    const struct lull_criterion good = *found.criterion;
    assert_int_equal(lull_table_check(&good, &err), LULL_OK);
    assert_int_equal(lull_table_check(NULL, &err), LULL_E_INVALID);
    struct lull_criterion bad = good;
    bad.struct_size = sizeof bad - 1;
    assert_int_equal(lull_table_check(&bad, &err), LULL_E_VERSION);
#define REFUSED(change) \
    bad = good; \
    change; \
    assert_int_equal(lull_table_check(&bad, &err), LULL_E_INVALID)
    REFUSED(bad.id = NULL);
    REFUSED(bad.id = "");
    REFUSED(bad.id = "Upper");
    REFUSED(bad.id = "a b");
    REFUSED(bad.name = NULL);
    REFUSED(bad.version = NULL);
    REFUSED(bad.description = NULL);
    REFUSED(bad.create = NULL);
    REFUSED(bad.requirements = NULL);
    REFUSED(bad.begin_frame = NULL);
    REFUSED(bad.evaluate = NULL);
    REFUSED(bad.end_frame = NULL);
    REFUSED(bad.destroy = NULL);
    REFUSED(bad.get_extension = NULL);
    REFUSED(bad.thread_level = 3);
    REFUSED(bad.thread_level = -1);
    REFUSED(bad.params = NULL);
    REFUSED(bad.param_stride = 8);
    struct lull_param params[2], *p = params;
#define PARAM_REFUSED(change) \
    params[0] = params[1] = good.params[0]; \
    params[1].name = "other"; \
    bad = good, bad.params = params, bad.param_count = 2; \
    assert_int_equal(lull_table_check(&bad, &err), LULL_OK); \
    change; \
    assert_int_equal(lull_table_check(&bad, &err), LULL_E_INVALID)
    PARAM_REFUSED(p->name = NULL);
    PARAM_REFUSED(p->name = "has space");
    PARAM_REFUSED(p->name = "other");
    PARAM_REFUSED(p->help = NULL);
    PARAM_REFUSED(p->type = 17);
    PARAM_REFUSED(p->max = p->min - 1);
    PARAM_REFUSED(p->choices = "a|b");
    PARAM_REFUSED(p->type = LULL_PARAM_CHOICE);
}

/* Each promise of a table, at its limit, with what is said word for word. */
static void tables_word_for_word(void **state)
{
    (void)state;
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_param two[2], *p = two;
    struct lull_criterion good, bad;
    char id[66];
    assert_int_equal(open_in(criteria, "halfbuf", &found, &err), LULL_OK);
    good = *found.criterion;
    good.id = "x";
    good.params = two;
    good.param_count = 2;
    good.param_stride = sizeof two[0];
#define SAYS(change, words) \
    two[0] = two[1] = (struct lull_param){.name = "a-0", .help = "h", .type = LULL_PARAM_INT, .min = 3, .max = 3}; \
    two[1].name = "b"; \
    bad = good; \
    change; \
    err.message[0] = '\0'; \
    assert_int_equal(lull_table_check(&bad, &err) == LULL_OK, words[0] == '\0'); \
    assert_string_equal(err.message, words)
    SAYS((void)p, "");
    assert_int_equal(lull_table_check(NULL, &err), LULL_E_INVALID);
    assert_string_equal(err.message, "no table");
    snprintf(id, sizeof id, "its table is smaller than in version 1.0 (%u bytes)", (unsigned)sizeof bad - 1);
    SAYS(bad.struct_size = sizeof bad - 1, id);
    SAYS(bad.struct_size = sizeof bad + 8, "");
    memset(id, 'i', sizeof id);
    id[63] = '\0';
    SAYS(bad.id = id, "");
    id[63] = 'i';
    id[64] = '\0';
    SAYS(bad.id = id, "its id is not of the form [a-z0-9.-]+");
    SAYS(bad.id = "a.z-09", "");
    SAYS(bad.id = "a_b", "its id is not of the form [a-z0-9.-]+");
    SAYS(bad.id = "`", "its id is not of the form [a-z0-9.-]+");
    SAYS(bad.id = "{", "its id is not of the form [a-z0-9.-]+");
    SAYS(bad.id = "a:b", "its id is not of the form [a-z0-9.-]+");
    SAYS(bad.version = NULL, "x: name, version or description is missing");
    SAYS(bad.destroy = NULL, "x: a function is missing");
    SAYS(bad.thread_level = LULL_THREADS_FULL, "");
    SAYS(bad.thread_level = LULL_THREADS_NONE, "");
    SAYS(bad.thread_level = 3, "x: unknown thread level 3");
    SAYS(bad.thread_level = -1, "x: unknown thread level -1");
    SAYS(bad.param_stride = sizeof two[0] - 1, "x: the parameter table is missing or has a bad stride");
    SAYS(bad.param_count = 10001, "x: the parameter table is missing or has a bad stride");
    SAYS((bad.params = NULL, bad.param_count = 0), "");
    SAYS(two[1].name = "a.b", "parameter 1 has no name of the form [a-z0-9-]+");
    SAYS(two[1].name = "a-0", "two parameters have the name a-0");
    SAYS(two[1].help = NULL, "parameter b has no help");
    SAYS(two[1].type = LULL_PARAM_TEXT, "");
    SAYS(two[1].type = LULL_PARAM_TEXT + 1, "parameter b has the unknown type 6");
    SAYS(two[1].type = LULL_PARAM_INT - 1, "parameter b has the unknown type -1");
    SAYS(two[1].max = 2, "parameter b has no finite range");
    SAYS((two[1].type = LULL_PARAM_FLOAT, two[1].max = HUGE_VAL), "parameter b has no finite range");
    SAYS((two[1].type = LULL_PARAM_FLOAT, two[1].min = -HUGE_VAL), "parameter b has no finite range");
    SAYS((two[1].type = LULL_PARAM_BOOL, two[1].max = 2), "");
    SAYS((two[1].type = LULL_PARAM_CHOICE, two[1].choices = "a|b"), "");
    SAYS(two[1].type = LULL_PARAM_CHOICE, "parameter b: choices go with the type CHOICE only");
    SAYS(two[1].choices = "a", "parameter b: choices go with the type CHOICE only");
#undef SAYS
}

static void errors_fit_the_callers_struct(void **state)
{
    (void)state;
    assert_int_equal(lull_error_set(NULL, LULL_E_IO, "x"), LULL_E_IO);
    struct lull_error err = {.struct_size = sizeof err};
    char text[1000];
    memset(text, 'y', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    lull_error_set(&err, LULL_E_KEY, "%s", text);
    assert_int_equal(err.code, LULL_E_KEY);
    assert_int_equal(strlen(err.message), sizeof err.message - 1);
    memset(&err, 'z', sizeof err);
    err.struct_size = offsetof(struct lull_error, message) + 4;
    lull_error_set(&err, LULL_E_KEY, "abcdef");
    assert_string_equal(err.message, "abc");
    assert_int_equal(err.message[4], 'z');
    err.struct_size = offsetof(struct lull_error, message);
    lull_error_set(&err, LULL_E_IO, "abcdef");
    assert_int_equal(err.code, LULL_E_KEY); /* a struct too short for a message is left alone */
}

static int find_directories(void)
{
    if (api_folder(plugins, sizeof plugins, API_PLUGINS) != 0 || api_folder(criteria, sizeof criteria, API_CRITERIA) != 0)
        return -1;
    const char *tmp = getenv("TMPDIR");
    snprintf(scratch, sizeof scratch, "%s/lull-loader-XXXXXX", tmp ? tmp : "/tmp");
    return mkdtemp(scratch) ? 0 : -1;
}

int main(void)
{
    if (find_directories() != 0)
        return 2;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(opens_by_path_and_id),
        cmocka_unit_test(opens_by_name),
        cmocka_unit_test(opens_an_id_of_a_library_with_another_name),
        cmocka_unit_test(directories_are_joined_and_ordered),
        cmocka_unit_test(without_directories_the_usual_ones_are_searched),
        cmocka_unit_test(bad_specs_are_refused),
        cmocka_unit_test(lists_what_is_good),
        cmocka_unit_test(broken_libraries_are_refused),
        cmocka_unit_test(cut_libraries_are_refused),
        cmocka_unit_test(side_effects_of_loading_are_told),
        cmocka_unit_test(tables_are_checked),
        cmocka_unit_test(tables_word_for_word),
        cmocka_unit_test(errors_fit_the_callers_struct),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    rmdir(scratch);
    return failed;
}
