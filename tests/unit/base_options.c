/* base/options: each kind of value, what is said about bad ones, and that one line says it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/options.h"
#include "base/version.h"

struct settings {
    const char *files[2], *out;
    int file_count, window, json, action, kind, pairs;
    uint32_t seed;
    uint64_t spp;
    double ratio;
};

static int add_pair(void *into, const char *value, struct base_err *err)
{
    if (!strchr(value, '='))
        return base_fail(err, BASE_EINVAL, "expected KEY=VALUE");
    ((struct settings *)into)->pairs++;
    return 0;
}

static const char *const kinds[] = {"f32", "f16", "bf16", NULL}, *const endings[] = {"png", "csv", NULL};
static const struct base_option list[] = {
    {.help = "All kinds:"},
    {"window", 'w', "N", BASE_TO(struct settings, window), 2, 16, .help = "an int"},
    {"seed", 's', "N", BASE_TO(struct settings, seed), 0, UINT32_MAX, .help = "32 bits"},
    {"spp", 0, "N", BASE_TO(struct settings, spp), 1, 1e12, .help = "64 bits"},
    {"ratio", 0, "R", BASE_TO(struct settings, ratio), 1, 16, .help = "a number"},
    {"kind", 'k', NULL, BASE_TO(struct settings, kind), .words = kinds, .help = "a word"},
    {"json", 'j', NULL, BASE_TO(struct settings, json), .help = "a flag"},
    {"explain", 0, NULL, BASE_TO(struct settings, action), 7, .help = "a flag with a value"},
    {"output", 'o', "FILE", BASE_TO(struct settings, out), .words = endings, .needed = 1, .help = "a file"},
    {"param", 'p', "KEY=VALUE", .set = add_pair, .help = "something else"},
    {"secret", 0, NULL, BASE_TO(struct settings, json), .hidden = 1, .help = "not listed"},
    {0}};
static const struct base_options options = {.doc = "Tries.\vAnd ends.",
                                            .args_doc = "A [B]",
                                            .list = list,
                                            .args_min = 1,
                                            .args_max = 2,
                                            .args = offsetof(struct settings, files),
                                            .arg_count = offsetof(struct settings, file_count)};

/* Splits the line at spaces. */
static int parse(const char *line, struct settings *s, struct base_err *err)
{
    static char text[256];
    char *argv[32];
    int argc = 0;
    snprintf(text, sizeof text, "/bin/try this %s", line);
    argv[argc++] = text;
    text[strlen("/bin/try this")] = '\0';
    for (char *p = strtok(text + strlen("/bin/try this") + 1, " "); p; p = strtok(NULL, " "))
        argv[argc++] = p;
    argv[argc] = NULL;
    *s = (struct settings){.window = 6, .kind = 1};
    *err = (struct base_err){0};
    return base_options_parse(&options, argc, argv, s, err);
}

static void values(void **state)
{
    (void)state;
    struct settings s;
    struct base_err err;
    assert_int_equal(
        parse("a -w 3 --seed=4294967295 b --spp 1000000000000 --ratio 1.5 -k bf16 -j --explain -o x.png -p a=1 -pb=2", &s,
              &err),
        0);
    assert_true(s.window == 3 && s.seed == UINT32_MAX && s.spp == 1000000000000u && s.ratio == 1.5 && s.kind == 2 &&
                s.json == 1);
    assert_true(s.action == 7 && s.pairs == 2 && s.file_count == 2);
    assert_string_equal(s.files[0], "a");
    assert_string_equal(s.files[1], "b");
    assert_string_equal(s.out, "x.png");
    assert_int_equal(parse("--out y.csv -- -w", &s, &err), 0); /* defaults stay; the beginning of a name is enough; "--" */
    assert_true(s.window == 6 && s.kind == 1 && s.file_count == 1 && !s.json);
    assert_string_equal(s.files[0], "-w");
    assert_int_equal(parse("a -o x.png --secret", &s, &err), 0);
    assert_true(s.json);
}

static void refusals(void **state)
{
    (void)state;
    static const struct {
        const char *line, *text;
    } bad[] = {
        {"a -w 1", "--window 1: expected an integer from 2 to 16"},
        {"a -w 17", "--window 17: expected an integer from 2 to 16"},
        {"a -w 3x", "--window 3x: expected an integer from 2 to 16"},
        {"a --seed -1", "--seed -1: expected an integer from 0 to 4294967295"},
        {"a --spp 99999999999999999999", "--spp 99999999999999999999: expected an integer from 1 to 1000000000000"},
        {"a --spp \t8", "--spp \t8: expected an integer from 1 to 1000000000000"}, /* strtol would take it */
        {"a --spp 8\t", "--spp 8\t: expected an integer from 1 to 1000000000000"},
        {"a --ratio \n2", "--ratio \n2: expected a number from 1 to 16"},
        {"a --ratio nan", "--ratio nan: expected a number from 1 to 16"},
        {"a -k f64", "--kind f64: expected f32, f16 or bf16"},
        {"a -k f3", "--kind f3: expected f32, f16 or bf16"},
        {"a -o png", "--output png: expected a name that ends in .png or .csv"},
        {"a -o .png", "--output .png: expected a name that ends in .png or .csv"},
        {"a -p k", "--param k: expected KEY=VALUE"},
        {"a -z", "-z: unknown option (--help lists the options)"},
        {"a -jz", "-z: unknown option (--help lists the options)"},
        {"a --nothing=1", "--nothing=1: unknown option, or the beginning of several (--help lists the options)"},
        {"a --s 1", "--s: unknown option, or the beginning of several (--help lists the options)"},
        {"a --json=1", "--json=1: this option takes no value"},
        {"a --window", "--window: a value is needed (--help says more)"},
        {"a -w", "-w: a value is needed (--help says more)"},
        {"a b c -o x.png", "c: one argument too many; expected A [B]"},
        {"-o x.png", "expected A [B] (--help says more)"},
        {"a", "--output FILE is needed (--help says more)"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct settings s;
        struct base_err err;
        assert_int_equal(parse(bad[i].line, &s, &err), BASE_EINVAL);
        assert_string_equal(err.text, bad[i].text);
    }
}

/* -V is a command's own where it wants it. */
static void own_letter(void **state)
{
    (void)state;
    static const struct base_option own[] = {{"views", 'V', "N", BASE_TO(struct settings, window), 0, 9, .help = "views"},
                                             {0}};
    static const struct base_options with_own = {.doc = "", .list = own};
    char *argv[] = {(char[]){"try"}, (char[]){"-V4"}, NULL};
    struct settings s = {0};
    assert_int_equal(base_options_parse(&with_own, 2, argv, &s, NULL), 0);
    assert_int_equal(s.window, 4);
}

/* What a child that asks for `option` prints; it must end with status 0. */
static void printed(const char *option, char *text, size_t room)
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        struct settings s;
        struct base_err err;
        dup2(ends[1], 1);
        parse(option, &s, &err);
        _exit(9);
    }
    close(ends[1]);
    size_t used = 0;
    for (ssize_t n; (n = read(ends[0], text + used, room - 1 - used)) > 0;)
        used += (size_t)n;
    text[used] = '\0';
    close(ends[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static void help_and_version(void **state)
{
    (void)state;
    static char text[8192];
    printed("--version", text, sizeof text);
    assert_string_equal(text, "try (Lull) " BASE_VERSION "\n");
    printed("-V", text, sizeof text);
    assert_string_equal(text, "try (Lull) " BASE_VERSION "\n");
    printed("-j --help --nothing", text, sizeof text);
    static const char *const parts[] = {
        "Usage: try this [OPTION...] A [B]", "Tries.", "All kinds:", "-w, --window=N", "--kind=f32|f16|bf16", "And ends."};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        assert_non_null(strstr(text, parts[i]));
    assert_null(strstr(text, "--secret"));
    printed("-?", text, sizeof text);
    assert_non_null(strstr(text, "--window=N"));
    printed("--usage", text, sizeof text);
    assert_non_null(strstr(text, "[--window=N]"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(values), cmocka_unit_test(refusals), cmocka_unit_test(own_letter),
                                       cmocka_unit_test(help_and_version)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
