/*
 * Loading and listing with the k-th allocation failing, for every k: an error or success, never a crash, and memory as
 * before. create and begin_frame are covered by lull-check's out-of-memory check.
 */
#include "../../plugin-api/tools/check.h"
#include "support/api_folders.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char criteria[2048];

static struct lull_search search(const char **dirs)
{
    dirs[0] = criteria;
    return (struct lull_search){.dirs = dirs, .dir_count = 1};
}

static int32_t count_one(void *context, const struct lull_found *found)
{
    (void)found;
    ++*(int *)context;
    return 0;
}

static void open_survives(void **state)
{
    (void)state;
    const char *dirs[1];
    struct lull_search s = search(dirs);
    static const char *const specs[] = {"fixed", "no-such-criterion"};
    for (int i = 0; i < 2; i++) {
        struct lull_found found = {0};
        int32_t status = LULL_E_MEMORY;
        long k = 0;
        for (; k < 500 && status != (i ? LULL_E_IO : LULL_OK); k++) {
            struct lull_error err = {.struct_size = sizeof err};
            lc_alloc_fail_after(k);
            status = lull_open(&s, specs[i], &found, &err);
            lc_alloc_fail_after(-1);
            assert_true(status <= 0);
            if (status != LULL_OK) {
                assert_null(found.criterion);
                assert_true(err.message[0] != '\0');
            }
        }
        assert_true(k < 500);
    }
}

static void list_survives(void **state)
{
    (void)state;
    const char *dirs[1];
    struct lull_search s = search(dirs);
    int all = 0;
    assert_int_equal(lull_list(&s, count_one, &all), LULL_OK);
    assert_true(all >= 4);
    int32_t status = LULL_E_MEMORY;
    int seen = 0;
    for (long k = 0; k < 5000 && (status != LULL_OK || seen < all); k++) {
        seen = 0;
        lc_alloc_fail_after(k);
        status = lull_list(&s, count_one, &seen);
        lc_alloc_fail_after(-1);
        assert_true(status == LULL_OK || status == LULL_E_MEMORY);
        assert_true(seen <= all);
    }
    assert_int_equal(status, LULL_OK);
    assert_int_equal(seen, all);
}

int main(void)
{
    if (lc_alloc_count() < 0) {
        puts("1..1\nok 1 - allocations fail one by one # SKIP a sanitizer build brings its own malloc");
        return 0;
    }
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0)
        return 2;
    const struct CMUnitTest tests[] = {cmocka_unit_test(open_survives), cmocka_unit_test(list_survives)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
