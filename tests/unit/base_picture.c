/* Image files in: what is written is what is read, from disk and from memory, by which names channels are found, what light
 * becomes; what is no image, or too large, is refused in one line. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "picture/draw.h"
#include "picture/png.h"
#include "picture/read.h"

static char dir[] = "/tmp/base_picture_XXXXXX";

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
    assert_int_equal(pic_write_png(path, W, H, C, pixels, &err), 0);
    struct pic_image image = {0};
    assert_int_equal(pic_read(path, &image, &err), 0);
    assert_int_equal(image.width, W);
    assert_int_equal(image.height, H);
    assert_int_equal(image.channels, C);
    assert_false(image.is_float_file);
    assert_non_null(image.u8);
    assert_memory_equal(image.u8, pixels, sizeof pixels);
    pic_release(&image);

    char *data;
    size_t size;
    assert_int_equal(base_file_read(path, 1 << 20, &data, &size, &err), 0);
    int rc = pic_read_memory("A.PNG", data, size, &image, &err); /* as Windows spells it */
    if (rc)
        print_error("%s\n", err.text);
    assert_int_equal(rc, 0);
    assert_memory_equal(image.u8, pixels, sizeof pixels);
    pic_release(&image);
    assert_null(image.u8);
    assert_int_equal(pic_read_memory("a.png", data, size / 3, &image, &err), BASE_EINVAL);
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
        struct pic_image image = {0};
        assert_int_equal(pic_write_png(path, width, H, channels, pixels, &err), 0);
        assert_int_equal(pic_read(path, &image, &err), 0);
        assert_int_equal(image.width, width);
        assert_int_equal(image.height, H);
        assert_int_equal(image.channels, channels);
        assert_memory_equal(image.u8, pixels, (size_t)(width * H * channels));
        pic_release(&image);
    }
}

static void refusals(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct pic_image image = {0};
    assert_int_equal(pic_read("/nonexistent/x.png", &image, &err), BASE_EIO);
    char path[64];
    snprintf(path, sizeof path, "%s/bad.png", dir);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs("not a png", f);
    fclose(f);
    err = (struct base_err){0};
    assert_int_equal(pic_read(path, &image, &err), BASE_EINVAL);
    assert_null(strchr(err.text, '\n'));
    uint8_t pixel[3] = {1, 2, 3};
    assert_int_equal(pic_write_png("/nonexistent/x.png", 1, 1, 3, pixel, &err), BASE_EIO);
    assert_int_equal(pic_write_png(path, 0, 1, 3, pixel, &err), BASE_EINVAL);
}

/* What a display shows has three channels, whatever the file has; a damaged file is refused by each way to read it. */
static void display(void **state)
{
    (void)state;
    enum { W = 2, H = 2 };
    static const uint8_t pixels[W * H * 4] = {10, 0, 20, 128, 30, 255, 40, 64, 50, 0, 60, 255, 70, 1, 80, 2};
    char path[64], *data;
    snprintf(path, sizeof path, "%s/a.png", dir);
    for (int channels = 1; channels <= 4; channels++) {
        struct base_err err = {0};
        struct pic_image image = {0};
        assert_int_equal(pic_write_png(path, W, H, channels, pixels, &err), 0);
        assert_int_equal(pic_read_display(path, &image, &err), 0);
        assert_true(image.width == W && image.height == H && image.channels == 3 && !image.f32);
        for (int i = 0; i < W * H; i++)
            for (int c = 0; c < 3; c++)
                assert_int_equal(image.u8[3 * i + c], pixels[channels * i + (channels < 3 ? 0 : c)]);
        pic_release(&image);
        size_t size;
        assert_int_equal(base_file_read(path, 1 << 20, &data, &size, &err), 0);
        data[45] ^= 1; /* in the first chunk after the header */
        FILE *f = fopen(path, "wb");
        assert_true(f && fwrite(data, 1, size, f) == size && fclose(f) == 0);
        free(data);
        assert_int_equal(pic_read_display(path, &image, &err), BASE_EINVAL);
        assert_non_null(strstr(err.text, "a.png: damaged PNG file (checksum at byte 33)"));
        assert_int_equal(pic_read_channel(path, "R", &image, &err), BASE_EINVAL);
        assert_non_null(strstr(err.text, "damaged PNG file"));
    }
}

/* Light that is no light is black or white, and counted, once for a pixel. */
static void encoding(void **state)
{
    (void)state;
    float light[] = {0, 1, 0.5f, -1, 2, 0, NAN, INFINITY, -0.0f, 0.25f, 0.0031308f, 1e-30f};
    static const uint8_t codes[] = {0, 255, 188, 0, 255, 0, 0, 255, 0, 137, 10, 0};
    struct pic_image image = {.width = 2, .height = 2, .channels = 3, .f32 = light};
    assert_int_equal(pic_encode("light", &image, NULL), 0);
    assert_memory_equal(image.u8, codes, sizeof codes);
    assert_int_equal(image.clipped, 2);
    free(image.u8);
}

/* A header of Targa claims up to 65535 pixels on a side. */
static void sizes(void **state)
{
    (void)state;
    static const struct {
        int width, height;
        const char *words;
    } cases[] = {{32769, 1, "a.tga: 32769x1 pixels (expected at most 2^27 in all, and 32768 on a side)"},
                 {1, 32769, "a.tga: 1x32769 pixels (expected at most 2^27 in all, and 32768 on a side)"},
                 {16384, 8193, "a.tga: 16384x8193 pixels (expected at most 2^27 in all, and 32768 on a side)"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const int w = cases[i].width, h = cases[i].height;
        uint8_t head[64] = {[2] = 3, [12] = (uint8_t)w, (uint8_t)(w >> 8), (uint8_t)h, (uint8_t)(h >> 8), 8};
        struct base_err err = {0};
        struct pic_image image = {0};
        assert_int_equal(pic_read_memory("a.tga", head, sizeof head, &image, &err), BASE_EINVAL);
        assert_string_equal(err.text, cases[i].words);
    }
}

/* From CIE XYZ it is the published inverse of sRGB (IEC 61966-2-1, amendment 1); a white stays white if it is the same. */
static void primaries(void **state)
{
    (void)state;
    static const float xyz[8] = {1, 0, 0, 1, 0, 0, 1.0f / 3, 1.0f / 3}, same[8] = PIC_REC709_PRIMARIES,
                       rec2020[8] = {0.708f, 0.292f, 0.170f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.3290f};
    static const double inverse[3][3] = {
        {3.2406255, -1.5372080, -0.4986286}, {-0.9689307, 1.8757561, 0.0415175}, {0.0557101, -0.2040211, 1.0569959}};
    const double digits = 4e-4; /* the standard begins with matrices of four digits */
    double m[3][3];
    assert_true(pic_primaries_to_rec709(xyz, m));
    for (int i = 0; i < 9; i++)
        assert_true(fabs(m[i / 3][i % 3] - inverse[i / 3][i % 3]) < digits);
    assert_true(pic_primaries_to_rec709(same, m));
    for (int i = 0; i < 9; i++)
        assert_true(fabs(m[i / 3][i % 3] - (i % 4 == 0)) < 1e-12);
    assert_true(pic_primaries_to_rec709(rec2020, m));
    for (int i = 0; i < 3; i++)
        assert_true(fabs(m[i][0] + m[i][1] + m[i][2] - 1) < 1e-12);
}

static void colours(void **state)
{
    (void)state;
    static const struct {
        enum pic_colour_map map;
        double t;
        uint8_t rgb[3];
    } cases[] = {
        {PIC_MAGMA, -1, {0, 0, 4}},          {PIC_MAGMA, NAN, {0, 0, 4}},        {PIC_MAGMA, 0.0625, {15, 9, 38}},
        {PIC_MAGMA, 0.875, {254, 194, 135}}, {PIC_MAGMA, 1, {252, 253, 191}},    {PIC_MAGMA, INFINITY, {252, 253, 191}},
        {PIC_VIRIDIS, 0, {68, 1, 84}},       {PIC_VIRIDIS, 0.5, {33, 145, 140}}, {PIC_VIRIDIS, 2, {253, 231, 37}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        uint8_t rgb[3];
        pic_colour(cases[i].map, cases[i].t, rgb);
        assert_memory_equal(rgb, cases[i].rgb, 3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(png_round_trip), cmocka_unit_test(png_of_many_sizes),
                                       cmocka_unit_test(refusals),       cmocka_unit_test(display),
                                       cmocka_unit_test(encoding),       cmocka_unit_test(sizes),
                                       cmocka_unit_test(colours),        cmocka_unit_test(primaries)};
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
