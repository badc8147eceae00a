/* Which channels are the picture: by their names, whatever their order and whatever else is in the file. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "picture/channels.h"

enum { MOST = 40 };

/* "R G B|Z" is a file of two parts; "name:R" a channel of the part of that name. */
struct file {
    char text[400];
    struct pic_channel list[MOST];
    int count;
};

static void make(struct file *f, const char *names)
{
    int part = 0, at = 0;
    strcpy(f->text, names);
    f->count = 0;
    for (char *word = f->text, *end; *word; word = end) {
        const size_t n = strcspn(word, " |");
        const int next = word[n] == '|';
        end = word + n + (word[n] != '\0');
        word[n] = '\0';
        char *colon = strchr(word, ':');
        if (colon)
            *colon = '\0';
        f->list[f->count++] = (struct pic_channel){colon ? colon + 1 : word, colon ? word : NULL, part, at++};
        part += next;
        at = next ? 0 : at;
    }
}

/* Wanted, as "part: at at at". */
static void expect(const char *names, const char *wanted)
{
    struct file f;
    struct pic_choice got = {0};
    struct base_err err = {0};
    char text[64];
    make(&f, names);
    if (pic_choose_channels("a.exr", f.list, f.count, &got, &err) != 0)
        fail_msg("%s: %s", names, err.text);
    int used = snprintf(text, sizeof text, "%d:", got.part);
    for (int i = 0; i < got.count; i++)
        used += snprintf(text + used, sizeof text - (size_t)used, " %d", got.at[i]);
    if (strcmp(text, wanted) != 0)
        fail_msg("%s: %s, not %s", names, text, wanted);
}

/* A layer by its name, as other programs write it: in front of other words, in small letters, as a part. */
static void layers_by_name(void **state)
{
    (void)state;
    static const char *const cases[][3] = {
        {"half", "R G B half.R half.G half.B", "0: 3 4 5"},
        {"half", "R G B ViewLayer.half.B ViewLayer.half.G ViewLayer.half.R", "0: 5 4 3"},
        {"half", "R G B HALF.r HALF.g HALF.b", "0: 3 4 5"},
        {"half", "R G B half.red half.green half.blue", "0: 3 4 5"},
        {"half", "Y half.Y half.A", "0: 1 1 1"},
        {"half", "a.half.R a.half.G a.half.B half.R half.G half.B", "0: 3 4 5"}, /* rather the whole name */
        {"half", "rgb:R rgb:G rgb:B|half:B half:G half:R", "1: 2 1 0"},
        {"", "half.R half.G half.B R G B", "0: 3 4 5"},
        {"half", "R G B behalf.R behalf.G behalf.B", NULL},
        {"half", "R G B half.R half.G", NULL},
        {"half", "R G B half.X half.Y half.Z", NULL},
        {"half", "R G B half", NULL}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct file f;
        struct pic_choice got = {0};
        struct base_err err = {0};
        char text[64];
        make(&f, cases[i][1]);
        const int rc = pic_choose_layer("a.exr", cases[i][0], f.list, f.count, &got, &err);
        assert_int_equal(rc, cases[i][2] ? 0 : BASE_EINVAL);
        if (rc) {
            assert_string_equal(err.text, "a.exr: has no channels R, G and B in a layer 'half'");
            continue;
        }
        snprintf(text, sizeof text, "%d: %d %d %d", got.part, got.at[0], got.at[1], got.at[2]);
        if (got.count != 3 || strcmp(text, cases[i][2]) != 0)
            fail_msg("%s: %s, not %s", cases[i][1], text, cases[i][2]);
    }
}

static void pictures(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"R G B", "0: 0 1 2"},
        {"A B G R", "0: 3 2 1 0"},
        {"B G R", "0: 2 1 0"},
        {"B G N.X N.Y N.Z R Z", "0: 5 1 0"}, /* nothing else is alpha */
        {"B G R lull.error.V", "0: 2 1 0"},
        {"Albedo.B Albedo.G Albedo.R B G R", "0: 5 4 3"}, /* the file's own layer first */
        {"r g b a", "0: 0 1 2 3"},
        {"blue green red", "0: 2 1 0"},
        {".B .G .R .A", "0: 2 1 0 3"},
        {"Y", "0: 0"},
        {"A Y", "0: 1 0"},
        {"Y Z", "0: 0"}, /* luminance and depth */
        {"L", "0: 0"},
        {"luminance", "0: 0"},
        {"R", "0: 0"},
        {"A", "0: 0"},
        {"Z", "0: 0"},
        {"depth.V", "0: 0"},
        {"A mask", "0: 1 0"},
        {"R Z", "0: 0"},
        {"Y albedo.R albedo.G albedo.B", "0: 0"},
        {"ViewLayer.Combined.A ViewLayer.Combined.B ViewLayer.Combined.G ViewLayer.Combined.R ViewLayer.Depth.Z",
         "0: 3 2 1 0"},
        {"V.Combined.B V.Combined.G V.Combined.R V.Diffuse.B V.Diffuse.G V.Diffuse.R", "0: 2 1 0"},
        {"V.Diffuse.B V.Diffuse.G V.Diffuse.R combined.B combined.G combined.R", "0: 5 4 3"},
        {"V.Combined.B V.Combined.G V.Combined.R Composite.Combined.B Composite.Combined.G Composite.Combined.R",
         "0: 5 4 3"},
        {"Z|V.Combined:R V.Combined:G V.Combined:B|Composite.Combined:R Composite.Combined:G Composite.Combined:B",
         "2: 0 1 2"},
        {"beauty.B beauty.G beauty.R N.X N.Y N.Z Z", "0: 2 1 0"}, /* the only colour */
        {"layer.Y N.X N.Y N.Z", "0: 0"},
        {"R G B|R G B", "0: 0 1 2"}, /* the first part is the picture */
        {"Z|R G B A", "1: 0 1 2 3"},
        {"depth:Z|left:R left:G left:B", "1: 0 1 2"},
        {"d:R d:G d:B|V.Combined:R V.Combined:G V.Combined:B", "0: 0 1 2"},
        {"z:Z|d:R d:G d:B|V.Combined:R V.Combined:G V.Combined:B", "2: 0 1 2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        expect(cases[i][0], cases[i][1]);
}

static void no_pictures(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"Y RY BY", "a.exr: luminance and chroma, Y, RY, BY: convert them to R, G and B"},
        {"X Y Z", "a.exr: none of its channels is a picture: X, Y, Z (expected R, G and B, or Y)"},
        {"R G", "a.exr: none of its channels is a picture: R, G (expected R, G and B, or Y)"},
        {"Z N.X", "a.exr: none of its channels is a picture: Z, N.X (expected R, G and B, or Y)"},
        {"left.R left.G left.B right.R right.G right.B Z",
         "a.exr: several layers, left, right: keep one (expected R, G and B, or a layer Combined)"},
        {"a.Combined.R a.Combined.G a.Combined.B b.Combined.R b.Combined.G b.Combined.B",
         "a.exr: several layers, a.Combined, b.Combined: keep one (expected R, G and B, or a layer Combined)"},
        {"Z|R G B|R G B",
         "a.exr: several layers, one without a name, one without a name: keep one (expected R, G and B, or a "
         "layer Combined)"},
        {"", "a.exr: none of its channels is a picture:  (expected R, G and B, or Y)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct file f;
        struct pic_choice got;
        struct base_err err = {0};
        make(&f, cases[i][0]);
        assert_int_equal(pic_choose_channels("a.exr", f.list, f.count, &got, &err), BASE_EINVAL);
        assert_string_equal(err.text, cases[i][1]);
    }
}

/* Of many layers as many are named as a line has room for. */
static void long_lists(void **state)
{
    (void)state;
    char names[300][3][24];
    struct pic_channel list[900];
    struct pic_choice got;
    struct base_err err = {0};
    for (int i = 0; i < 900; i++) {
        snprintf(names[i / 3][i % 3], sizeof names[0][0], "layer-%d.%c", i / 3, "RGB"[i % 3]);
        list[i] = (struct pic_channel){names[i / 3][i % 3], NULL, 0, i};
    }
    assert_int_equal(pic_choose_channels("a.exr", list, 900, &got, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "several layers, layer-0, layer-1, layer-2, "));
    assert_non_null(strstr(err.text, ", ...: keep one"));
    assert_true(strlen(err.text) < sizeof err.text - 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(pictures), cmocka_unit_test(layers_by_name),
                                       cmocka_unit_test(no_pictures), cmocka_unit_test(long_lists)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
