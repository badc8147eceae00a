/* Tokens, their places, included files, numbers, parameter lists. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pbrt/names.h"
#include "pbrt/params.h"

/* Several files in memory. */
struct files {
    const char *names[4], *texts[4];
};

static int read_files(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    const struct files *f = data;
    for (int i = 0; i < 4 && f->names[i]; i++)
        if (strcmp(f->names[i], path) == 0) {
            *bytes = strdup(f->texts[i]);
            *size = strlen(f->texts[i]);
            return *bytes ? 0 : base_fail_nomem(err, path);
        }
    return base_fail(err, BASE_EIO, "%s: no such file", path);
}

struct fixture {
    struct pt_source source;
    struct pt_arena arena;
    struct base_err err;
    struct pt_diag diag;
    struct pt_lexer lexer;
};

static void open_files(struct fixture *x, struct files *files)
{
    memset(x, 0, sizeof *x);
    x->source = (struct pt_source){read_files, NULL, files, 0};
    x->diag.err = &x->err;
    x->lexer = (struct pt_lexer){.source = &x->source, .diag = &x->diag, .arena = &x->arena};
    assert_int_equal(pt_lexer_include(&x->lexer, files->names[0], (struct pt_loc){0}, 0), 0);
}

static void close_files(struct fixture *x)
{
    pt_lexer_release(&x->lexer);
    pt_arena_release(&x->arena);
    pt_diag_release(&x->diag);
}

static void expect(struct fixture *x, int kind, const char *text, int line, int column)
{
    struct pt_token t = pt_lexer_next(&x->lexer);
    assert_int_equal(t.kind, kind);
    assert_int_equal(t.length, strlen(text));
    assert_memory_equal(t.text, text, t.length);
    assert_int_equal(t.loc.line, line);
    assert_int_equal(t.loc.column, column);
}

static void tokens_and_places(void **state)
{
    (void)state;
    struct files files = {{"a"}, {"Shape # Shape 1..2 \"x\n \"a\\tb\\\"\"[1 2]\r\n\tfoo"}};
    struct fixture x;
    open_files(&x, &files);
    expect(&x, PT_TOKEN_WORD, "Shape", 1, 1);
    expect(&x, PT_TOKEN_STRING, "a\tb\"", 2, 2);
    expect(&x, PT_TOKEN_OPEN, "[", 2, 10);
    expect(&x, PT_TOKEN_WORD, "1", 2, 11);
    expect(&x, PT_TOKEN_WORD, "2", 2, 13);
    expect(&x, PT_TOKEN_CLOSE, "]", 2, 14);
    expect(&x, PT_TOKEN_WORD, "foo", 3, 2);
    assert_int_equal(pt_lexer_next(&x.lexer).kind, PT_TOKEN_END);
    close_files(&x);
}

/* A line ends at LF, at CR LF and at a CR alone, and a comment with it. */
static void line_ends(void **state)
{
    (void)state;
    struct files files = {{"a"}, {"# 1\ra # 2\r\n b\r\r# 4\n\rc\r"}};
    struct fixture x;
    open_files(&x, &files);
    expect(&x, PT_TOKEN_WORD, "a", 2, 1);
    expect(&x, PT_TOKEN_WORD, "b", 3, 2);
    expect(&x, PT_TOKEN_WORD, "c", 7, 1);
    expect(&x, PT_TOKEN_END, "", 8, 1);
    close_files(&x);
    files = (struct files){{"a"}, {"\r\"open\rb"}};
    open_files(&x, &files);
    assert_int_equal(pt_lexer_next(&x.lexer).kind, PT_TOKEN_BAD);
    assert_string_equal(x.err.text, "a:2:1: string without a closing quote on its line");
    close_files(&x);
}

/* cloud-v3 does this: the medium of an included file goes on with parameters in the file that includes it. */
static void list_across_files(void **state)
{
    (void)state;
    struct files files = {{"a", "b"}, {"Include \"rgb y\" [ 1 2 3 ] end", "Medium \"float x\" 4"}};
    struct fixture x;
    struct pt_params params = {0};
    size_t n;
    open_files(&x, &files);
    expect(&x, PT_TOKEN_WORD, "Include", 1, 1);
    assert_int_equal(pt_lexer_include(&x.lexer, "b", (struct pt_loc){"a", 1, 1}, 0), 0);
    expect(&x, PT_TOKEN_WORD, "Medium", 1, 1);
    pt_params_clear(&params, &x.diag, (struct pt_loc){0}, "");
    assert_int_equal(pt_params_read(&params, &x.lexer), 0);
    assert_int_equal(params.count, 2);
    assert_true(pt_params_float(&params, "x", 0) == 4);
    assert_string_equal(params.items[1].loc.file, "a");
    assert_int_equal(params.items[1].loc.column, 9);
    expect(&x, PT_TOKEN_WORD, "end", 1, 27);
    assert_null(pt_params_floats(&params, "absent", 1, &n));
    pt_params_release(&params);
    close_files(&x);
}

static void include_loops(void **state)
{
    (void)state;
    struct files files = {{"a", "b"}, {"x", "y"}};
    struct fixture x;
    open_files(&x, &files);
    assert_int_equal(pt_lexer_include(&x.lexer, "b", (struct pt_loc){"a", 3, 4}, 0), 0);
    assert_int_equal(pt_lexer_include(&x.lexer, "a", (struct pt_loc){"b", 3, 4}, 0), BASE_EINVAL);
    assert_string_equal(x.err.text, "b:3:4: \"a\" includes itself");
    close_files(&x);
}

/* Both spellings of a value, and what each getter makes of it. */
static void parameter_spellings(void **state)
{
    (void)state;
    struct files files = {{"a"},
                          {"\"float a\" 2 \"float b\" [ 3 ] \"bool c\" true \"bool d\" [ \"false\" ] \"string e\" \"x\" "
                           "\"string f\" [ \"y\" \"z\" ] \"point p\" [ 1 2 3 ] \"float uv\" [ 0 1 2 3 ] "
                           "\"integer i\" [ 1 -2 ] # \"float broken\" 1.2.3\n \"spectrum s\" \"metal-Cu-k\""}};
    struct fixture x;
    struct pt_params p = {0};
    double xyz[3];
    size_t n;
    open_files(&x, &files);
    pt_params_clear(&p, &x.diag, (struct pt_loc){0}, "");
    assert_int_equal(pt_params_read(&p, &x.lexer), 0);
    assert_int_equal(p.count, 10);
    assert_true(pt_params_float(&p, "a", 0) == 2 && pt_params_float(&p, "b", 0) == 3);
    assert_true(pt_params_bool(&p, "c", 0) == 1 && pt_params_bool(&p, "d", 1) == 0);
    assert_string_equal(pt_params_string(&p, "e", ""), "x");
    assert_string_equal(pt_params_string_at(&p, pt_params_find(&p, "f"), 1), "z");
    assert_int_equal(pt_params_point(&p, "p", xyz), 1);
    assert_true(xyz[0] == 1 && xyz[2] == 3);
    assert_non_null(pt_params_floats(&p, "uv", 2, &n));
    assert_int_equal(n, 2);
    assert_true(pt_params_ints(&p, "i", &n)[1] == -2);
    assert_int_equal(x.diag.rc, 0);
    pt_params_check_used(&p); /* f and s were not asked for: unknown names fail */
    assert_int_equal(x.diag.rc, BASE_EINVAL);
    assert_string_equal(x.err.text, "a:1:79: unknown parameter \"f\" of \"\"");
    assert_true(pt_name_is_in("B C", "B") && pt_name_is_in("B C", "C") && !pt_name_is_in("B C", "B C"));
    pt_params_release(&p);
    close_files(&x);
}

/* Where words end, every escape, the mark at the beginning of a file, an end without a line's end. */
static void characters(void **state)
{
    (void)state;
    struct files files = {{"a"},
                          {"\xef\xbb\xbf"
                           "ab[cd]ef\"g\"hi#j\n\vk\fl\tm\rn\r\n\"\\n\\r\\t\\b\\f\\\\\\'\\\"\" o"}};
    struct fixture x;
    open_files(&x, &files);
    expect(&x, PT_TOKEN_WORD, "ab", 1, 1);
    expect(&x, PT_TOKEN_OPEN, "[", 1, 3);
    expect(&x, PT_TOKEN_WORD, "cd", 1, 4);
    expect(&x, PT_TOKEN_CLOSE, "]", 1, 6);
    expect(&x, PT_TOKEN_WORD, "ef", 1, 7);
    expect(&x, PT_TOKEN_STRING, "g", 1, 9);
    expect(&x, PT_TOKEN_WORD, "hi", 1, 12);
    expect(&x, PT_TOKEN_WORD, "k", 2, 2);
    expect(&x, PT_TOKEN_WORD, "l", 2, 4);
    expect(&x, PT_TOKEN_WORD, "m", 2, 6);
    expect(&x, PT_TOKEN_WORD, "n", 3, 1);
    expect(&x, PT_TOKEN_STRING, "\n\r\t\b\f\\'\"", 4, 1);
    assert_int_equal(pt_lexer_peek(&x.lexer).loc.column, 20);
    expect(&x, PT_TOKEN_WORD, "o", 4, 20);
    struct pt_token end = pt_lexer_next(&x.lexer);
    assert_true(end.kind == PT_TOKEN_END && end.loc.line == 4 && end.loc.column == 21 && end.length == 0);
    close_files(&x);
    static const char *const bad[][2] = {{"\"a", "a:1:1: string without a closing quote on its line"},
                                         {" \"a\nb\"", "a:1:2: string without a closing quote on its line"},
                                         {"\"a\\q\"", "a:1:1: unknown escape \\q in a string"},
                                         {"\"a\\", "a:1:1: string without a closing quote on its line"}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        files = (struct files){{"a"}, {bad[i][0]}};
        open_files(&x, &files);
        assert_int_equal(pt_lexer_next(&x.lexer).kind, PT_TOKEN_BAD);
        assert_string_equal(x.err.text, bad[i][1]);
        close_files(&x);
    }
}

static int read_any(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    (void)data;
    (void)path;
    (void)err;
    *bytes = strdup("x");
    *size = 1;
    return 0;
}

/* Files may stand on each other 32 deep; each comes to its end, and a scoped one says so. */
static void include_depth(void **state)
{
    (void)state;
    struct fixture x;
    memset(&x, 0, sizeof x);
    x.source = (struct pt_source){read_any, NULL, NULL, 0};
    x.diag.err = &x.err;
    x.lexer = (struct pt_lexer){.source = &x.source, .diag = &x.diag, .arena = &x.arena};
    for (int i = 0; i <= PT_LEXER_DEPTH; i++) {
        char name[16];
        snprintf(name, sizeof name, "f%d", i);
        assert_int_equal(pt_lexer_include(&x.lexer, name, (struct pt_loc){"f", 7, 8}, i % 2),
                         i < PT_LEXER_DEPTH ? 0 : BASE_EINVAL);
    }
    assert_string_equal(x.err.text, "f:7:8: files include each other more than 32 levels deep");
    for (int i = PT_LEXER_DEPTH - 1; i >= 0; i--) {
        expect(&x, PT_TOKEN_WORD, "x", 1, 1);
        if (i % 2)
            assert_int_equal(pt_lexer_next(&x.lexer).kind, PT_TOKEN_FILE_END);
    }
    assert_int_equal(pt_lexer_next(&x.lexer).kind, PT_TOKEN_END);
    close_files(&x);
}

/* A thousand names, each found with its last value, none that was not given. */
static void names(void **state)
{
    (void)state;
    struct pt_names n = {0};
    char name[16];
    assert_int_equal(pt_names_get(&n, "n0"), -1);
    for (int round = 0; round < 2; round++)
        for (int i = 0; i < 1000; i++) {
            snprintf(name, sizeof name, "n%d", i);
            assert_int_equal(pt_names_set(&n, name, 3 * i + round), 0);
        }
    for (int i = 0; i < 1000; i++) {
        snprintf(name, sizeof name, "n%d", i);
        assert_int_equal(pt_names_get(&n, name), 3 * i + 1);
        snprintf(name, sizeof name, "m%d", i);
        assert_int_equal(pt_names_get(&n, name), -1);
    }
    pt_names_release(&n);
    assert_true(!n.tree && pt_names_get(&n, "n0") == -1);
}

static void numbers(void **state)
{
    (void)state;
    static const char *const good[] = {"0",
                                       "-1",
                                       "+.5",
                                       "3.",
                                       "1e-008",
                                       "-4.37114e-008",
                                       "123456789012345678901234567890",
                                       "4.9e-324",
                                       "0.1",
                                       "2.2250738585072011e-308",
                                       "1.7976931348623157e308",
                                       "00012",
                                       "1E+5",
                                       "9007199254740993"};
    static const char *const bad[] = {"",     "-",   ".",   "e5",  "1e",    "1e+", "1.2.3",
                                      "0x10", "nan", "inf", "1,5", "1e999", "--1", "1 "};
    double v;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(pt_number_parse(good[i], strlen(good[i]), &v), 1);
        if (v != strtod(good[i], NULL))
            fail_msg("%s gives %.17g", good[i], v);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        if (pt_number_parse(bad[i], strlen(bad[i]), &v))
            fail_msg("\"%s\" is taken as %g", bad[i], v);
    /* Ten thousand of every size, against the C library. */
    uint64_t x = 88172645463325252u;
    for (int i = 0; i < 10000; i++) {
        char text[40];
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        snprintf(text, sizeof text, "%.*g", (int)(x % 18) + 1, ldexp((double)x, (int)(x >> 32) % 200 - 160));
        assert_int_equal(pt_number_parse(text, strlen(text), &v), 1);
        if (v != strtod(text, NULL))
            fail_msg("%s gives %.17g", text, v);
    }
}

/* The decimal point is a point in every locale. */
static void numbers_in_other_locales(void **state)
{
    (void)state;
    double v;
    setlocale(LC_ALL, "de_DE.UTF-8");
    assert_int_equal(pt_number_parse("0.12345678901234567890123", 25, &v), 1);
    setlocale(LC_ALL, "C");
    assert_true(v == 0.12345678901234567890123);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(tokens_and_places), cmocka_unit_test(line_ends),
                                       cmocka_unit_test(list_across_files), cmocka_unit_test(include_loops),
                                       cmocka_unit_test(characters),        cmocka_unit_test(names),
                                       cmocka_unit_test(include_depth),     cmocka_unit_test(parameter_spellings),
                                       cmocka_unit_test(numbers),           cmocka_unit_test(numbers_in_other_locales)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
