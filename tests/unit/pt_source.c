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

/* Appends text[0, n) as a gzip file of its own. */
static size_t add_member(unsigned char *packed, size_t at, size_t room, const char *text, size_t n)
{
    z_stream z = {
        .next_in = (Bytef *)(uintptr_t)text, .avail_in = (uInt)n, .next_out = packed + at, .avail_out = (uInt)(room - at)};
    assert_int_equal(deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
    assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
    deflateEnd(&z);
    return room - z.avail_out;
}

static int unpack(const unsigned char *packed, size_t n, char **bytes, size_t *size, struct base_err *err)
{
    *bytes = NULL;
    return pt_source_unpack("a.gz", (const char *)packed, n, bytes, size, err);
}

static const char scene[] = "Shape \"sphere\" \"float radius\" [ 1.25 ] # the border of a member may be anywhere\n";

/* Wherever the text is cut into members, also empty ones as bgzip's last, it is the same text. */
static void members_are_one_text(void **state)
{
    (void)state;
    enum { N = sizeof scene - 1 };
    unsigned char packed[64 * N];
    char *bytes;
    size_t size, n = 0;
    struct base_err err = {0};
    for (size_t cut = 0; cut <= N; cut++)
        for (size_t zeros = 0; zeros < 600; zeros += 512) {
            memset(packed, 0, sizeof packed);
            n = add_member(packed, 0, sizeof packed, scene, cut);
            n = add_member(packed, n, sizeof packed, scene + cut, N - cut);
            n = add_member(packed, n, sizeof packed, "", 0);
            assert_int_equal(unpack(packed, n + zeros, &bytes, &size, &err), 0);
            assert_int_equal(size, N);
            assert_memory_equal(bytes, scene, N + 1);
            free(bytes);
        }
    n = 0;
    for (size_t i = 0; i < N; i++)
        n = add_member(packed, n, sizeof packed, scene + i, 1);
    assert_int_equal(unpack(packed, n, &bytes, &size, &err), 0);
    assert_int_equal(size, N);
    assert_memory_equal(bytes, scene, N);
    free(bytes);
}

/* A file that ends within a member, and bytes that are none: refused, because they would be lost. */
static void members_that_are_none(void **state)
{
    (void)state;
    unsigned char packed[1024];
    char *bytes;
    size_t size, first = add_member(packed, 0, sizeof packed, scene, 20);
    size_t n = add_member(packed, first, sizeof packed, scene + 20, 30);
    struct base_err err = {0};
    for (size_t cut = 1; cut < n; cut++) {
        int whole = cut == first;
        assert_int_equal(unpack(packed, cut, &bytes, &size, &err), whole ? 0 : BASE_EINVAL);
        assert_int_equal(bytes != NULL, whole);
        free(bytes);
    }
    packed[n - 8] ^= 1; /* of the checksum */
    assert_int_equal(unpack(packed, n, &bytes, &size, &err), BASE_EINVAL);
    assert_string_equal(err.text, "a.gz: damaged or truncated gzip file");
    memcpy(packed + first, "\0\0garbage", 9);
    assert_int_equal(unpack(packed, first + 9, &bytes, &size, &err), BASE_EINVAL);
    assert_string_equal(err.text, "a.gz: 9 bytes behind its last gzip member are no member (expected none, or zeros)");
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(packed_files), cmocka_unit_test(members_are_one_text),
                                       cmocka_unit_test(members_that_are_none), cmocka_unit_test(what_is_no_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
