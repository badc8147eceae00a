/* Lists that name things once: numbers and texts, wherever in the list and at whatever stride the repetition is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "base/list.h"

enum { COUNT = 300 };

struct entry {
    char before;
    uint32_t id;
    char name[12];
};

static struct entry list[COUNT];

static void fill(void)
{
    for (uint32_t i = 0; i < COUNT; i++) {
        list[i].id = (i * 7919u + 5) % 65521; /* a permutation, as 65521 is prime */
        snprintf(list[i].name, sizeof list[i].name, "n%u", list[i].id);
    }
}

static void each_repetition_is_found(void **state)
{
    static const size_t at[][2] = {{0, 1}, {0, COUNT - 1}, {COUNT - 2, COUNT - 1}, {17, 204}};
    uint32_t twice = 0;
    const char *text = NULL;
    (void)state;
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        fill();
        assert_int_equal(base_unique_numbers(&list->id, sizeof *list, COUNT, &twice), 0);
        assert_int_equal(base_unique_texts(list->name, sizeof *list, COUNT, &text), 0);
        list[at[i][1]] = list[at[i][0]];
        assert_int_equal(base_unique_numbers(&list->id, sizeof *list, COUNT, &twice), 1);
        assert_int_equal(twice, list[at[i][0]].id);
        assert_int_equal(base_unique_texts(list->name, sizeof *list, COUNT, &text), 1);
        assert_string_equal(text, list[at[i][0]].name);
    }
}

static void a_list_of_none_or_one_repeats_nothing(void **state)
{
    uint32_t twice = 0;
    (void)state;
    fill();
    assert_int_equal(base_unique_numbers(&list->id, sizeof *list, 0, &twice), 0);
    assert_int_equal(base_unique_numbers(&list->id, sizeof *list, 1, &twice), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_repetition_is_found),
                                       cmocka_unit_test(a_list_of_none_or_one_repeats_nothing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
