/* Tables and reports of thresholds. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_folder.h"
#include "support/ggn_transcript.h"
#include "data/thresholds.h"

static void a_view_is_listed_once(void **state)
{
    char once[] = "\xef\xbb\xbf" /* which is no part of the first name */
                  "a;1;\n# a;2;\nb;2;3;\n",
         twice[] = "a;1;\nb;2;\na;3;\n";
    struct ggn_thresholds t;
    struct base_err err = {0};
    (void)state;
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", once, sizeof once - 1, &t, &err), 0);
    assert_int_equal(t.n, 2);
    assert_non_null(ggn_thresholds_of(&t, "a"));
    ggn_thresholds_release(&t);
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", twice, sizeof twice - 1, &t, &err), BASE_EINVAL);
    assert_string_equal(err.text, "t.csv: view 'a' appears twice");
}

static void lines_end_as_they_like(void **state)
{
    char alone[] = "hall;1;2\r# c\rroom;3;4\ryard;5;6\r", mixed[] = "hall;1;2\r\nroom;3;4\nyard;5;6",
         wide[] = "hall;1;2\nro\0om;3;4\n";
    struct ggn_thresholds t;
    struct base_err err = {0};
    (void)state;
    for (int i = 0; i < 2; i++) {
        char *text = i ? mixed : alone;
        assert_int_equal(ggn_thresholds_parse_csv("t.csv", text, strlen(text), &t, &err), 0);
        assert_int_equal(t.n, 3);
        assert_true(ggn_thresholds_of(&t, "hall")->n == 2 && ggn_thresholds_of(&t, "yard")->spp[1] == 6);
        ggn_thresholds_release(&t);
    }
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", wide, sizeof wide - 1, &t, &err), BASE_EINVAL);
    assert_string_equal(err.text, "t.csv:2: has a byte 0 (expected a line of text, in UTF-8)");
}

static void print_thresholds(FILE *f, int rc, struct ggn_thresholds *t, const struct base_err *err)
{
    if (rc) {
        fprintf(f, "%s\n", err->text);
        return;
    }
    for (int i = 0; i < t->n; i++) {
        fprintf(f, "%.140s (%d, %d across):", t->views[i].name, t->views[i].n, t->views[i].columns);
        for (int b = 0; b < t->views[i].n && b < 8; b++)
            fprintf(f, " %g", t->views[i].spp[b]);
        fputs("; ", f);
    }
    const struct ggn_view *part = ggn_thresholds_of(t, "p"), *found = ggn_thresholds_of(t, "b");
    fprintf(f, "of p: %s, find b: %s\n", part ? part->name : "-", found ? found->name : "-");
    ggn_thresholds_release(t);
}

static void print_table(FILE *f, const char *name, const char *contents)
{
    struct ggn_thresholds t = {0};
    struct base_err err = {0};
    char path[256];
    put_file(name, contents);
    snprintf(path, sizeof path, "%s/%s", root, name);
    fprintf(f, "%s %.70s: ", name, contents);
    int rc = ggn_thresholds_read(path, (int[2]){8, 8}, &t, &err);
    print_thresholds(f, rc, &t, &err);
}

static void thresholds_are_told_word_by_word(void **state)
{
    static const char *const tables[] = {"",
                                         "\n# a\n",
                                         "a",
                                         ";1",
                                         "a;",
                                         "a;;",
                                         "a;1",
                                         "a;1;",
                                         "a;1;2",
                                         "a;1;;2",
                                         "a;1;2;;",
                                         "a;x",
                                         "a;1x",
                                         "a;1 ;2",
                                         "a; 1;2",
                                         "a;0",
                                         "a;-1",
                                         "a;1e12",
                                         "a;999999999999",
                                         "a;nan",
                                         "a;inf",
                                         "a;1\nb;2;3;\r\n",
                                         "a;1\n\nb",
                                         "a;1\nb;2;\na;3;",
                                         "p;1\np_part6;2",
                                         "p_part6;2\nb;1",
                                         "#a;1\nb;1"};
    static const char *const reports[] = {"",
                                          "{}",
                                          "{\"blocks\":[]}",
                                          "{\"blocks\":{}}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":5}]}",
                                          "{\"scene\":7,\"blocks\":[{\"id\":1,\"spp\":5,\"y0\":0}]}",
                                          ("{\"scene\":\"b\",\"blocks\":[{\"id\":3,\"spp\":5,\"threshold\":6,\"y0\":1},{"
                                           "\"id\":0,\"spp\":2,\"y0\":0},{\"id\":1,\"spp\":3,\"y0\":0}]}"),
                                          "{\"blocks\":[{\"id\":-1,\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":\"0\",\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":65535,\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":65536,\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":0}]}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":0}]}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":1e12}]}",
                                          "{\"blocks\":[{\"id\":0,\"spp\":999999999999}]}",
                                          "{\"blocks\":[{\"id\":0,\"threshold\":\"1\",\"spp\":5}]}",
                                          "{\"blocks\":[{\"id\":7,\"spp\":-5}]}"};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++)
        print_table(f, "t.csv", tables[i]);
    print_table(f, "t", "a;1");
    print_table(f, "t.json.csv", "a;1");
    for (size_t i = 0; i < sizeof reports / sizeof reports[0]; i++)
        print_table(f, "r.json", reports[i]);
    for (int length = GGN_VIEW_NAME - 1; length <= GGN_VIEW_NAME; length++) {
        char line[256];
        snprintf(line, sizeof line, "%0*d;1", length, 0);
        print_table(f, "long.csv", line);
    }
    for (int n = GGN_VIEW_BLOCKS; n <= GGN_VIEW_BLOCKS + 1; n++) {
        char *line = malloc(2 * (size_t)n + 8);
        strcpy(line, "a");
        for (int i = 0; i < n; i++)
            strcpy(line + 1 + 2 * i, ";7");
        print_table(f, "wide.csv", line);
        free(line);
    }
    transcript_hide(&t, root, "ROOT");
    transcript_end(&t, "data-thresholds");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_view_is_listed_once), cmocka_unit_test(lines_end_as_they_like),
                                       cmocka_unit_test(thresholds_are_told_word_by_word)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
