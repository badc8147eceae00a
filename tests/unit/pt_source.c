/* Files of scenes: packed ones are unpacked, damaged ones refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

#include <cmocka.h>

#include "pbrt/source.h"

static void packed_files(void **state)
{
    (void)state;
    enum { SIZE = 9 << 20 }; /* more than the first guess at the unpacked size */
    char folder[] = "/tmp/pt_source_XXXXXX", path[64], *text = malloc(SIZE), *bytes = NULL;
    size_t size = 0;
    struct base_err err = {0};
    struct base_inputs inputs = BASE_INPUTS_EMPTY;
    const struct pt_source files = pt_source_files(&inputs);
    assert_true(mkdtemp(folder) && text);
    snprintf(path, sizeof path, "%s/a.gz", folder);
    for (int i = 0; i < SIZE; i++)
        text[i] = (char)('a' + i % 7 + (i >> 12) % 11);
    gzFile gz = gzopen(path, "wb");
    assert_non_null(gz);
    assert_int_equal(gzwrite(gz, text, SIZE), SIZE);
    assert_int_equal(gzclose(gz), Z_OK);
    assert_int_equal(files.read(files.data, path, &bytes, &size, &err), 0);
    assert_int_equal(size, SIZE);
    assert_memory_equal(bytes, text, SIZE);
    assert_int_equal(bytes[size], 0);
    free(bytes);
    assert_int_equal(truncate(path, 4096), 0);
    assert_int_equal(files.read(files.data, path, &bytes, &size, &err), BASE_EINVAL);
    assert_null(strchr(err.text, '\n'));
    assert_int_equal(inputs.count, 1);
    assert_string_equal(inputs.paths[0], path);
    base_inputs_release(&inputs);
    unlink(path);
    rmdir(folder);
    free(text);
}

static void what_is_no_file(void **state)
{
    (void)state;
    char *bytes = NULL;
    size_t size = 0;
    struct base_err err = {0};
    const struct pt_source files = pt_source_files(NULL);
    assert_int_equal(files.read(files.data, "/nonexistent", &bytes, &size, &err), BASE_EIO);
    assert_int_equal(files.read(files.data, "/tmp", &bytes, &size, &err), BASE_EINVAL);
    assert_null(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(packed_files), cmocka_unit_test(what_is_no_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
