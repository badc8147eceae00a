/* Pictures out: what OpenEXR reads of a file that was written, and stop maps, their letters and their colours as recorded. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <openexr.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "host/frame.h"
#include "image/exr.h"
#include "picture/draw.h"
#include "picture/read.h"
#include "support/approve.h"

static char dir[] = "/tmp/pt_pictures_XXXXXX";

static int make_dir(void **state)
{
    (void)state;
    return !mkdtemp(dir);
}

static int remove_dir(void **state)
{
    (void)state;
    return rmdir(dir);
}

static void channel_row(void *data, int y, float *const *rows)
{
    for (int c = 0; c < *(const int *)data; c++)
        for (int x = 0; x < 3; x++)
            rows[c][x] = (float)(1000 * c + 10 * y + x);
}

static void check_exr_header(exr_context_t file, int count)
{
    const exr_attr_chlist_t *channels;
    exr_compression_t compression;
    exr_lineorder_t order;
    exr_attr_v2f_t centre;
    float aspect, width;
    assert_int_equal(exr_get_channels(file, 0, &channels), EXR_ERR_SUCCESS);
    assert_int_equal(channels->num_channels, count);
    for (int i = 0; i < count; i++) {
        const exr_attr_chlist_entry_t *e = &channels->entries[i];
        assert_true(e->pixel_type == EXR_PIXEL_FLOAT && e->p_linear == EXR_PERCEPTUALLY_LINEAR && e->x_sampling == 1 &&
                    e->y_sampling == 1);
    }
    assert_int_equal(exr_get_compression(file, 0, &compression), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_lineorder(file, 0, &order), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_pixel_aspect_ratio(file, 0, &aspect), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_screen_window_width(file, 0, &width), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_screen_window_center(file, 0, &centre), EXR_ERR_SUCCESS);
    assert_true(compression == EXR_COMPRESSION_ZIP && order == EXR_LINEORDER_INCREASING_Y && aspect == 1 && width == 1);
    assert_true(centre.x == 0 && centre.y == 0);
}

/* As many channels as are promised; the picture's own window, not what is stored, gives its size; numbers and words beside it. */
static void exr_channels(void **state)
{
    (void)state;
    char path[64], names[65][16];
    const char *list[65];
    for (int i = 0; i < 65; i++) { /* not in the order in which the library sorts them */
        snprintf(names[i], sizeof names[i], "c%02d", (i * 7 + 3) % 65);
        list[i] = names[i];
    }
    snprintf(path, sizeof path, "%s/a.png", dir); /* the name does not matter to it */
    const struct pt_exr_attribute attributes[] = {{"lull:words", "two words", 0}, {"lull:number", NULL, 2.5}};
    for (int count = 0; count <= 65; count += count == 0 ? 1 : count == 1 ? 63 : 1) {
        struct base_err err = {0};
        struct pt_exr_image image = {20, 40, 5, 2, 8, 39, count, list, 2, attributes, channel_row, &count};
        int rc = pt_exr_write(path, &image, &err);
        assert_int_equal(rc, count >= 1 && count <= 64 ? 0 : BASE_EINVAL);
        if (rc) {
            char expected[128];
            snprintf(expected, sizeof expected, "%s: %d channels, at most 64 can be written", path, count);
            assert_string_equal(err.text, expected);
            continue;
        }
        exr_context_t file = NULL;
        exr_attr_box2i_t window;
        const char *words;
        int32_t length;
        double number;
        assert_int_equal(exr_start_read(&file, path, NULL), EXR_ERR_SUCCESS);
        assert_int_equal(exr_get_display_window(file, 0, &window), EXR_ERR_SUCCESS);
        assert_true(window.min.x == 0 && window.min.y == 0 && window.max.x == 19 && window.max.y == 39);
        assert_int_equal(exr_get_data_window(file, 0, &window), EXR_ERR_SUCCESS);
        assert_true(window.min.x == 5 && window.min.y == 2 && window.max.x == 7 && window.max.y == 38);
        assert_int_equal(exr_attr_get_string(file, 0, "lull:words", &length, &words), EXR_ERR_SUCCESS);
        assert_true(length == 9 && strcmp(words, "two words") == 0);
        assert_int_equal(exr_attr_get_double(file, 0, "lull:number", &number), EXR_ERR_SUCCESS);
        assert_true(number == 2.5);
        check_exr_header(file, count);
        exr_finish(&file);
        char renamed[80];
        snprintf(renamed, sizeof renamed, "%s.exr", path);
        assert_int_equal(rename(path, renamed), 0);
        for (int c = 0; c < count; c++) {
            struct pic_image read;
            assert_int_equal(pic_read_channel(renamed, list[c], &read, &err), 0);
            assert_true(read.width == 3 && read.height == 37 && read.channels == 1 && read.is_float_file && !read.u8);
            for (int i = 0; i < 3 * 37; i++)
                assert_true(read.f32[i] == (float)(1000 * c + 10 * (i / 3 + 2) + i % 3));
            pic_release(&read);
            assert_null(read.f32);
        }
        unlink(renamed);
    }
}

/* --- pictures by name ------------------------------------------------------------------------------------------------- */

/* Channel c is 1 + c everywhere, plus the place in a thousandth. */
static void place_row(void *data, int y, float *const *rows)
{
    const struct pt_exr_image *image = data;
    for (int c = 0; c < image->channel_count; c++)
        for (int x = image->x0; x < image->x1; x++)
            rows[c][x - image->x0] = 1 + (float)c + (float)(16 * y + x) / 1024;
}

/* A picture of 6x5 of these channels whose stored pixels are [x0, x1) x [y0, y1). */
static void write_picture(char path[64], const char *const *names, int count, const int window[4])
{
    struct base_err err = {0};
    struct pt_exr_image image = {6, 5, window[0], window[1], window[2], window[3], count, names, 0, NULL, place_row, NULL};
    image.data = &image;
    snprintf(path, 64, "%s/a.exr", dir);
    if (pt_exr_write(path, &image, &err) != 0)
        fail_msg("%s", err.text);
}

/* Wherever R, G, B and A stand among others, in the file's order or not, they are read; the same as codes for a display. */
static void channels_are_found_by_name(void **state)
{
    (void)state;
    static const int all[4] = {0, 0, 6, 5};
    static const struct {
        const char *names[8];
        int count, wanted, at[4];
    } cases[] = {
        {{"R", "G", "B"}, 3, 3, {0, 1, 2}},
        {{"Z", "B", "lull.error.V", "G", "N.X", "R", "AO.R", "a"}, 8, 4, {5, 3, 1, 7}},
        {{"depth", "A", "Y"}, 3, 2, {2, 1}},
        {{"mist"}, 1, 1, {0}},
        {{"V.Glossy.R", "V.Glossy.G", "V.Glossy.B", "V.Combined.B", "V.Combined.G", "V.Combined.R"}, 6, 3, {5, 4, 3}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char path[64];
        struct base_err err = {0};
        struct pic_image read, shown;
        write_picture(path, cases[i].names, cases[i].count, all);
        if (pic_read(path, &read, &err) != 0 || pic_read_display(path, &shown, &err) != 0)
            fail_msg("%s", err.text);
        assert_true(read.width == 6 && read.height == 5 && read.channels == cases[i].wanted && !read.is_part);
        for (int k = 0; k < 30 * read.channels; k++) {
            const int c = cases[i].at[k % read.channels], at = k / read.channels;
            assert_true(read.f32[k] == 1 + (float)c + (float)(16 * (at / 6) + at % 6) / 1024);
        }
        for (int k = 0; k < 90; k++)
            assert_int_equal(shown.u8[k], 255);
        pic_release(&read);
        pic_release(&shown);
        unlink(path);
    }
}

/* A file that stores part of its picture, as --crop writes it, or more: each pixel is where it is in the picture. */
static void windows_are_placed(void **state)
{
    (void)state;
    static const char *const rgb[] = {"R", "G", "B"};
    static const int windows[][4] = {{2, 1, 5, 4}, {0, 0, 6, 5}, {-2, -1, 8, 6}, {-3, 2, 4, 9}, {5, 4, 6, 5}, {-1, 0, 6, 5}};
    for (size_t i = 0; i < sizeof windows / sizeof windows[0]; i++) {
        const int *w = windows[i];
        char path[64];
        struct base_err err = {0};
        struct pic_image read;
        write_picture(path, rgb, 3, w);
        if (pic_read(path, &read, &err) != 0)
            fail_msg("%s", err.text);
        assert_true(read.width == 6 && read.height == 5 && read.channels == 3 && read.is_part == (i != 1));
        for (int y = 0; y < 5; y++)
            for (int x = 0; x < 6; x++)
                for (int c = 0; c < 3; c++) {
                    int stored = x >= w[0] && x < w[2] && y >= w[1] && y < w[3];
                    float wanted = stored ? 1 + (float)c + (float)(16 * y + x) / 1024 : 0;
                    assert_true(read.f32[(6 * y + x) * 3 + c] == wanted);
                }
        pic_release(&read);
        assert_int_equal(pic_read_display(path, &read, &err), 0); /* that is what is stored */
        assert_true(read.width == w[2] - w[0] && read.height == w[3] - w[1]);
        pic_release(&read);
        unlink(path);
    }
    static const int away[4] = {6, 0, 9, 5};
    char path[64], words[128];
    struct base_err err = {0};
    struct pic_image read;
    write_picture(path, rgb, 3, away);
    assert_int_equal(pic_read(path, &read, &err), BASE_EINVAL);
    snprintf(words, sizeof words, "%s: all of its pixels lie outside of its picture", path);
    assert_string_equal(err.text, words);
    unlink(path);
}

/* --- drawings --------------------------------------------------------------------------------------------------------- */

enum { DRAWING_ROOM = 1 << 16 };

static size_t letters(const char *words, char *out)
{
    struct pic_canvas canvas = {0};
    const uint8_t ink[3] = {1, 2, 3};
    uint8_t rgb[64 * 64 * 3] = {0};
    int x, y, scale, start;
    size_t n = 0;
    assert_int_equal(sscanf(words, "%d %d %d %d %d %n", &canvas.width, &canvas.height, &x, &y, &scale, &start), 5);
    canvas.rgb = rgb;
    pic_draw_text(&canvas, x, y, scale, ink, words + start);
    for (int v = 0; v < canvas.height; v++) {
        out[n++] = ' ';
        for (int u = 0; u < canvas.width; u++) {
            const uint8_t *pixel = rgb + 3 * (v * canvas.width + u);
            out[n++] = memcmp(pixel, ink, 3) == 0 ? '#' : pixel[0] + pixel[1] + pixel[2] == 0 ? '.' : '?';
        }
        out[n++] = '\n';
    }
    for (size_t i = (size_t)(3 * canvas.width * canvas.height); i < sizeof rgb; i++)
        assert_int_equal(rgb[i], 0);
    return n;
}

static size_t colours(const char *words, char *out)
{
    size_t n = 0;
    char *end;
    for (double t = strtod(words, &end); end != words; t = strtod(words, &end)) {
        uint8_t rgb[3];
        pic_colour(PIC_VIRIDIS, t, rgb);
        n += (size_t)sprintf(out + n, " #%02x%02x%02x", rgb[0], rgb[1], rgb[2]);
        words = end;
    }
    return n + (size_t)sprintf(out + n, "\n");
}

/* Runs of one colour. */
static size_t print_row(const uint8_t *row, int width, char *out)
{
    size_t n = 0;
    for (int x = 0, end; x < width; x = end) {
        for (end = x + 1; end < width && memcmp(row + 3 * x, row + 3 * end, 3) == 0; end++)
            ;
        n += (size_t)sprintf(out + n, " #%02x%02x%02x*%d", row[3 * x], row[3 * x + 1], row[3 * x + 2], end - x);
    }
    return n + (size_t)sprintf(out + n, "\n");
}

static size_t map_of_blocks(const char *words, char *out)
{
    struct lull_host_block list[4], *b = list;
    struct lull_host_blocks blocks = {.list = list};
    struct pic_canvas map;
    double values[4];
    char unit[16];
    int used;
    assert_int_equal(sscanf(words, "%d %d %d %d %15s%n", &blocks.x0, &blocks.y0, &blocks.x1, &blocks.y1, unit, &used), 5);
    for (words += used;
         sscanf(words, " %d,%d,%d,%d=%lf%n", &b->x0, &b->y0, &b->x1, &b->y1, &values[blocks.count], &used) == 5;
         words += used, b++)
        blocks.count++;
    assert_int_equal(lull_host_paint(&blocks, values, unit, &map, NULL), LULL_OK);
    size_t n = (size_t)sprintf(out, " %d x %d\n", map.width, map.height), stride = 3 * (size_t)map.width;
    for (int y = 0, end; y < map.height; y = end) {
        const uint8_t *row = map.rgb + (size_t)y * stride;
        for (end = y + 1; end < map.height && memcmp(row, map.rgb + (size_t)end * stride, stride) == 0; end++)
            ;
        n += (size_t)sprintf(out + n, " %d:", y);
        n += print_row(row, map.width, out + n);
    }
    free(map.rgb);
    return n;
}

static char *draw(struct approve_case *c)
{
    static const struct {
        const char *name;
        size_t (*draw)(const char *words, char *out);
    } kinds[] = {{"letters ", letters}, {"colours ", colours}, {"map ", map_of_blocks}};
    char *out = calloc(DRAWING_ROOM, 1);
    assert_non_null(out);
    c->text[strcspn(c->text, "\n")] = '\0';
    for (size_t i = 0; i < 3; i++)
        if (strncmp(c->text, kinds[i].name, strlen(kinds[i].name)) == 0)
            kinds[i].draw(c->text + strlen(kinds[i].name), out);
    return out;
}

static void drawings(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_pictures.txt", draw);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(drawings), cmocka_unit_test(exr_channels),
                                       cmocka_unit_test(channels_are_found_by_name), cmocka_unit_test(windows_are_placed)};
    return cmocka_run_group_tests(tests, make_dir, remove_dir);
}
