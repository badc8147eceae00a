/* Files and codes that a renderer may have from the host library. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "host/frame.h"

static void outputs_are_looked_at_first(void **state)
{
    (void)state;
    char folder[] = "/tmp/lull-host-XXXXXX", in[64], out[64], again[64];
    assert_non_null(mkdtemp(folder));
    snprintf(in, sizeof in, "%s/in.blend", folder);
    snprintf(out, sizeof out, "%s/out.png", folder);
    snprintf(again, sizeof again, "%s/./out.png", folder);
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_host_output list[2] = {{"output", out}, {"preview", again}};
    const char *inputs[] = {in};

    const uint8_t rgb[6] = {1, 2, 3, 4, 5, 6};
    assert_int_equal(lull_host_write_png(in, 2, 1, rgb, &e), LULL_OK);
    assert_int_equal(lull_host_check_outputs(list, 1, inputs, 1, &e), LULL_OK);
    assert_int_equal(lull_host_check_outputs(list, 0, NULL, 0, &e), LULL_OK);
    assert_int_equal(lull_host_check_outputs(list, 2, inputs, 1, &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "--preview "));
    list[0].path = in;
    assert_int_equal(lull_host_check_outputs(list, 1, inputs, 1, &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "this is an input"));
    list[0].path = "/nowhere/at/all";
    assert_int_equal(lull_host_check_outputs(list, 1, inputs, 1, &e), LULL_E_IO);
    assert_int_equal(lull_host_write_png(list[0].path, 2, 1, rgb, &e), LULL_E_IO);
    assert_int_equal(lull_host_write_png(out, 1u << 31, 1, rgb, &e), LULL_E_INVALID);
    unlink(in);
    assert_int_equal(rmdir(folder), 0);
}

static int32_t take(const struct lull_writer *writer, const void *data, uint64_t size)
{
    if (size > 6)
        return LULL_E_MEMORY;
    memcpy(writer->context, data, (size_t)size);
    return LULL_OK;
}

/* What a display shows of a file comes as it was written; a file without what is needed, or too large for the caller, not. */
static void pictures_are_read_as_they_are_shown(void **state)
{
    (void)state;
    char folder[] = "/tmp/lull-host-XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a.png", folder);
    const uint8_t rgb[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    uint8_t got[6] = {0};
    uint32_t width = 77, height = 78;
    struct lull_error e = {.struct_size = sizeof e};
    const struct lull_writer writer = {.struct_size = sizeof writer, .context = got, .write = take};
    assert_int_equal(lull_host_write_png(path, 3, 1, rgb, &e), LULL_OK);
    assert_int_equal(lull_host_read_shown(path, NULL, NULL, &width, &height, &writer, &e), LULL_E_MEMORY);
    assert_true(width == 77 && height == 78 && strstr(e.message, "did not take"));
    assert_int_equal(lull_host_write_png(path, 1, 2, rgb, &e), LULL_OK);
    assert_int_equal(lull_host_read_shown(path, NULL, "B", &width, &height, &writer, &e), LULL_OK);
    assert_true(width == 1 && height == 2 && memcmp(got, rgb, 6) == 0);
    assert_int_equal(lull_host_read_shown(path, NULL, "lull.weight.V", &width, &height, &writer, &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "a.png: has no channel 'lull.weight.V'"));
    assert_int_equal(lull_host_read_shown(path, "noisy", NULL, &width, &height, &writer, &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "'noisy'"));
    assert_int_equal(lull_host_read_shown(folder, NULL, NULL, &width, &height, NULL, &e), LULL_E_INVALID);
    unlink(path);
    assert_int_equal(lull_host_read_shown(path, NULL, NULL, &width, &height, &writer, &e), LULL_E_IO);
    assert_int_equal(rmdir(folder), 0);
}

/* What was there before stays until the file is complete. */
static void files_appear_when_they_are_whole(void **state)
{
    (void)state;
    char folder[] = "/tmp/lull-host-XXXXXX", path[64], text[8] = "";
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a", folder);
    struct lull_host_file *file;
    int32_t fd;
    for (int i = 0; i < 3; i++) { /* the second one is given up */
        assert_int_equal(lull_host_file_begin(path, &file, &fd, NULL), LULL_OK);
        assert_int_equal(write(fd, i == 0 ? "old" : "new", 3), 3);
        assert_int_equal(access(path, F_OK), i == 0 ? -1 : 0);
        if (i == 1)
            lull_host_file_abort(file);
        else
            assert_int_equal(lull_host_file_commit(file, NULL), LULL_OK);
        FILE *f = fopen(path, "r");
        assert_true(f && fread(text, 1, 4, f) == 3 && fclose(f) == 0);
        assert_string_equal(text, i < 2 ? "old" : "new");
    }
    unlink(path);
    assert_int_equal(rmdir(folder), 0); /* and nothing else is left */
    assert_int_equal(lull_host_file_begin(path, &file, &fd, NULL), LULL_E_IO);
}

static void codes_of_light(void **state)
{
    (void)state;
    const double light[] = {(double)NAN, -1, 0, 0.18, 0.5, 1, (double)INFINITY};
    const uint8_t wanted[] = {0, 0, 0, 118, 188, 255, 255};
    uint8_t codes[8] = {[7] = 9};
    lull_host_srgb(light, 7, codes);
    assert_memory_equal(codes, wanted, 7);
    assert_int_equal(codes[7], 9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(outputs_are_looked_at_first),
        cmocka_unit_test(pictures_are_read_as_they_are_shown),
        cmocka_unit_test(files_appear_when_they_are_whole),
        cmocka_unit_test(codes_of_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
