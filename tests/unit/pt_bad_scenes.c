/* Every malformed scene of tests/bad-input gives the one line that its first line announces, word for word. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "pbrt/load.h"

static const char folder[] = "tests/bad-input";
enum { LEAST = 100 };

static int is_scene(const struct dirent *entry)
{
    size_t n = strlen(entry->d_name);
    return n > 5 && strcmp(entry->d_name + n - 5, ".pbrt") == 0;
}

/* "# expect: 4: words" → 4 and words; "# expect: words" → 0 and words. */
static const char *expectation(char *bytes, int *line)
{
    static const char mark[] = "# expect: ";
    assert_memory_equal(bytes, mark, sizeof mark - 1);
    char *words = bytes + sizeof mark - 1, *end = strchr(words, '\n');
    assert_non_null(end);
    *end = '\0';
    char *rest;
    *line = (int)strtol(words, &rest, 10);
    return *line > 0 && rest[0] == ':' ? rest + 2 : words;
}

/* "PLACE COLUMN: WORDS", or the words alone where there is no place. */
static int is_line(const char *text, const char *place, const char *words)
{
    size_t n = strlen(place);
    if (n == 0)
        return strcmp(text, words) == 0;
    if (strncmp(text, place, n) != 0)
        return 0;
    size_t column = strspn(text + n, "0123456789");
    return column > 0 && strncmp(text + n + column, ": ", 2) == 0 && strcmp(text + n + column + 2, words) == 0;
}

static void each_gives_its_line(void **state)
{
    (void)state;
    struct dirent **entries;
    assert_int_equal(chdir(folder), 0);
    int n = scandir(".", &entries, is_scene, alphasort), wrong = 0;
    assert_true(n >= LEAST);
    for (int i = 0; i < n; i++) {
        char place[600] = "", *bytes;
        const char *path = entries[i]->d_name;
        int line;
        size_t size;
        struct base_err err = {0};
        struct pt_scene *scene = NULL;
        struct pt_scene_defaults defaults;
        assert_int_equal(base_file_read(path, 1 << 20, &bytes, &size, &err), 0);
        const char *words = expectation(bytes, &line);
        if (line > 0)
            snprintf(place, sizeof place, "%s:%d:", path, line);
        int rc = pt_scene_load(path, NULL, &scene, &defaults, &err);
        if (rc != BASE_EINVAL || scene || !is_line(err.text, place, words)) {
            print_error("%s: expected %s … %s, got %d \"%s\"\n", path, place, words, rc, err.text);
            wrong++;
        }
        free(bytes);
        free(entries[i]);
    }
    free(entries);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_gives_its_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
