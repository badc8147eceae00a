/* Image files: what is written is what is read, from disk and from memory; what is no image is refused in one line. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "base/png.h"
#include "image/oiio.h"

static char dir[] = "/tmp/pt_oiio_XXXXXX";

static int make_dir(void **state)
{
    (void)state;
    return !mkdtemp(dir);
}

static int remove_dir(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "%s/a.png", dir);
    unlink(path);
    snprintf(path, sizeof path, "%s/bad.png", dir);
    unlink(path);
    return rmdir(dir);
}

static void png_round_trip(void **state)
{
    (void)state;
    enum { W = 5, H = 3, C = 4 };
    uint8_t pixels[W * H * C];
    for (int i = 0; i < W * H * C; i++)
        pixels[i] = (uint8_t)(i * 4 + 3);
    pixels[3] = 0; /* colour under zero alpha must survive: no premultiplication */
    char path[64];
    snprintf(path, sizeof path, "%s/a.png", dir);
    struct base_err err = {0};
    assert_int_equal(base_png_write(path, W, H, C, pixels, &err), 0);
    struct pt_oiio_image image = {0};
    assert_int_equal(pt_oiio_read(path, &image, &err), 0);
    assert_int_equal(image.width, W);
    assert_int_equal(image.height, H);
    assert_int_equal(image.channels, C);
    assert_false(image.is_float_file);
    assert_non_null(image.u8);
    assert_memory_equal(image.u8, pixels, sizeof pixels);
    pt_oiio_release(&image);

    char *data;
    size_t size;
    assert_int_equal(base_file_read(path, 1 << 20, &data, &size, &err), 0);
    int rc = pt_oiio_read_memory("a.png", data, size, &image, &err);
    if (rc)
        print_error("%s\n", err.text);
    assert_int_equal(rc, 0);
    assert_memory_equal(image.u8, pixels, sizeof pixels);
    pt_oiio_release(&image);
    assert_null(image.u8);
    assert_int_equal(pt_oiio_read_memory("a.png", data, size / 3, &image, &err), BASE_EINVAL);
    assert_null(strchr(err.text, '\n'));
    free(data);
}

/* More than one chunk, rows of every filter's edge, each number of channels: OpenImageIO reads back what was written. */
static void png_of_many_sizes(void **state)
{
    (void)state;
    enum { W = 301, H = 203, C = 4 };
    static uint8_t pixels[W * H * C];
    uint32_t random = 1;
    char path[64];
    snprintf(path, sizeof path, "%s/a.png", dir);
    for (int i = 0; i < W * H * C; i++)
        pixels[i] = (uint8_t)((random = random * 1664525u + 1013904223u) >> 24);
    for (int channels = 1; channels <= C; channels++) {
        int width = channels == 2 ? 1 : W;
        struct base_err err = {0};
        struct pt_oiio_image image = {0};
        assert_int_equal(base_png_write(path, width, H, channels, pixels, &err), 0);
        assert_int_equal(pt_oiio_read(path, &image, &err), 0);
        assert_int_equal(image.width, width);
        assert_int_equal(image.height, H);
        assert_int_equal(image.channels, channels);
        assert_memory_equal(image.u8, pixels, (size_t)(width * H * channels));
        pt_oiio_release(&image);
    }
}

static void refusals(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct pt_oiio_image image = {0};
    assert_int_equal(pt_oiio_read("/nonexistent/x.png", &image, &err), BASE_EIO);
    char path[64];
    snprintf(path, sizeof path, "%s/bad.png", dir);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs("not a png", f);
    fclose(f);
    err = (struct base_err){0};
    assert_int_equal(pt_oiio_read(path, &image, &err), BASE_EINVAL);
    assert_null(strchr(err.text, '\n'));
    uint8_t pixel[3] = {1, 2, 3};
    assert_int_equal(base_png_write("/nonexistent/x.png", 1, 1, 3, pixel, &err), BASE_EIO);
    assert_int_equal(base_png_write(path, 0, 1, 3, pixel, &err), BASE_EINVAL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(png_round_trip), cmocka_unit_test(png_of_many_sizes),
                                       cmocka_unit_test(refusals)};
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
