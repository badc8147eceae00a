/* UTF-8, lines of tables, names for them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "base/text.h"

static void characters(void **state)
{
    static const struct {
        const char *bytes;
        int length;
    } cases[] = {{"", 0},
                 {"a", 1},
                 {"\x7f", 1},
                 {"\xc3\xa4", 2},         /* a with dots */
                 {"\xe2\x82\xac", 3},     /* euro */
                 {"\xf0\x9f\x98\x80", 4}, /* beyond 16 bits */
                 {"\xf4\x8f\xbf\xbf", 4}, /* the last character */
                 {"\xf4\x90\x80\x80", 0}, /* beyond it */
                 {"\xe4t", 0},            /* Latin-1 */
                 {"\x80", 0},
                 {"\xc0\xaf", 0},     /* overlong */
                 {"\xe0\x9f\xbf", 0}, /* overlong */
                 {"\xf0\x8f\xbf\xbf", 0},
                 {"\xed\xa0\x80", 0}, /* a surrogate */
                 {"\xe2\x82", 0},     /* cut */
                 {"\xff", 0}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_int_equal(base_utf8_length(cases[i].bytes), cases[i].length);
    char text[] = "h\xe4user \xe2\x82\xac \xc3";
    base_utf8_mend(text);
    assert_string_equal(text, "h?user \xe2\x82\xac ?");
}

/* Each line in <>, what has no end without '>'; the number of those that follow the first must be told before. */
static void lines_end_as_they_like(void **state)
{
    static const char *const cases[][2] = {{"", ""},
                                           {"\n", "<>"},
                                           {"\r", "<>"},
                                           {"\r\n", "<>"},
                                           {"\n\r", "<><>"},
                                           {"a", "<a"},
                                           {"a\nb\n", "<a><b>"},
                                           {"a\rb\r", "<a><b>"},
                                           {"a\r\nb\r\n", "<a><b>"},
                                           {"a\nb\rc\r\nd", "<a><b><c><d"},
                                           {"a\r\rb", "<a><><b"},
                                           {"\xef\xbb\xbf"
                                            "a\r",
                                            "<a>"},
                                           {"a\v\f\x1c\xc2\x85"
                                            "b\r",
                                            "<a\v\f\x1c\xc2\x85"
                                            "b>"}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct base_lines l;
        const char *line;
        char got[64] = "";
        size_t length, count;
        base_lines_init(&l, "t", cases[i][0], strlen(cases[i][0]));
        for (count = base_lines_left(&l); base_lines_next(&l, &line, &length, NULL) == 0 && line; count--)
            snprintf(got + strlen(got), sizeof got - strlen(got), "<%.*s%s", (int)length, line, l.is_ended ? ">" : "");
        assert_string_equal(got, cases[i][1]);
        assert_int_equal(count, 0);
    }
    static const char wide[] = "a\r\0b\0";
    struct base_lines l;
    struct base_err err = {0};
    const char *line;
    size_t length;
    base_lines_init(&l, "t.csv", wide, sizeof wide - 1);
    assert_int_equal(base_lines_next(&l, &line, &length, &err), 0);
    assert_int_equal(base_lines_next(&l, &line, &length, &err), BASE_EINVAL);
    assert_null(line);
    assert_string_equal(err.text, "t.csv:2: has a byte 0 (expected a line of text, in UTF-8)");
}

static void view_names(void **state)
{
    static const char *const cases[][2] = {{"scenes/room.pbrt", "room"},
                                           {"room", "room"},
                                           {"a.b.pbrt", "a.b"},
                                           {"a;b#c.pbrt", "a_b_c"},
                                           {".pbrt", "_pbrt"},
                                           {"x/.hidden.pbrt", "_hidden"},
                                           {"l\xe4t.pbrt", "l_t"},
                                           {"\xc3\xa4.pbrt", "\xc3\xa4"},
                                           {"a\nb\"\x7f.pbrt", "a_b__"},
                                           {"my room.pbrt", "my room"},
                                           {"a~.pbrt", "a~"},
                                           {"a\x1f.pbrt", "a_"},
                                           {"folder/", "_"},
                                           {"", "_"}};
    char name[64];
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        base_view_name(cases[i][0], name, sizeof name);
        assert_string_equal(name, cases[i][1]);
    }
    base_view_name("abc\xc3\xa4.pbrt", name, 5); /* a character is cut whole */
    assert_string_equal(name, "abc");
    base_view_name("abc\xc3\xa4.pbrt", name, 6);
    assert_string_equal(name, "abc\xc3\xa4");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(characters), cmocka_unit_test(lines_end_as_they_like),
                                       cmocka_unit_test(view_names)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
