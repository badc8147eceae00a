/* The SIN3D layout on a small generated copy of it, the .rawls reader, and a real sequence when it is there. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"

#include "data/dataset.h"
#include "data/image.h"
#include "data/rawls.h"
#include "data/sin3d.h"

enum { SIDE = 16, BLOCK = 8, LEVELS = 5 };

static char root[] = "/tmp/ggn_import.XXXXXX";

static void shell(const char *format, const char *a, const char *b)
{
    char command[2048];
    snprintf(command, sizeof command, format, a, b);
    assert_int_equal(system(command), 0);
}

static int setup(void **state)
{
    (void)state;
    return !mkdtemp(root) ? -1 : 0;
}

static int teardown(void **state)
{
    (void)state;
    shell("rm -rf %s%s", root, "");
    return 0;
}

static uint8_t value_at(int spp, int x, int y, int c)
{
    return (uint8_t)((unsigned)(spp + 7 * x + 13 * y + 50 * c) % 256u);
}

static void write_level(const char *dir, int spp, int side)
{
    static uint8_t rgb[64 * 64 * 3];
    char path[4096];
    for (int i = 0; i < side * side * 3; i++)
        rgb[i] = value_at(spp, i / 3 % side, i / 3 / side, i % 3);
    snprintf(path, sizeof path, "%s/p3d_toy-view2_%05d.png", dir, spp);
    assert_int_equal(ggn_image8_write_png(path, rgb, side, side, NULL), 0);
}

static const char *make_view(const char *name)
{
    static char dir[512];
    snprintf(dir, sizeof dir, "%s/%s", root, name);
    assert_int_equal(mkdir(dir, 0777), 0);
    for (int i = 1; i <= LEVELS; i++)
        write_level(dir, 20 * i, SIDE);
    return dir;
}

static const struct ggn_sin3d_options plain = {.block = BLOCK};

static void layout(void **state)
{
    (void)state;
    char text[] = "p3d_toy-view2_part6;40;60;100;90;\n", out[600];
    struct ggn_thresholds t;
    struct ggn_dataset d;
    struct seq_block b;
    struct base_err err = {0};
    static uint8_t rgb[3 * BLOCK * BLOCK];
    int labelled = 0;
    const char *dir = make_view("p3d_toy-view2_part6");
    snprintf(out, sizeof out, "%s/out", root);
    mkdir(out, 0777);
    snprintf(out, sizeof out, "%s/out/toy", root);
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", text, &t, NULL), 0);
    struct ggn_sin3d_options o = plain;
    o.thresholds = &t;
    if (ggn_sin3d_import_view(dir, out, &o, &labelled, &err) != 0)
        fail_msg("%s", err.text);
    assert_true(labelled);
    snprintf(out, sizeof out, "%s/out", root);
    if (ggn_dataset_open(out, &d, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(d.n, 1);
    assert_string_equal(d.views[0].manifest.scene, "p3d_toy");
    assert_int_equal(d.views[0].manifest.n_blocks, 4);
    assert_int_equal(d.views[0].manifest.reference_independent, 0);
    assert_string_equal(d.views[0].labels.source, "human");
    const struct ggn_label *l = ggn_labels_find(&d.views[0].labels, 2);
    assert_true(l->threshold == 100 && l->censored); /* the cap is the last level */
    assert_int_equal(ggn_labels_find(&d.views[0].labels, 1)->censored, 0);
    for (uint32_t i = 0; i < 4; i++) { /* row-major blocks, the right pixels at each level */
        if (seq_manifest_read_block(d.views[0].dir, &d.views[0].manifest, i, &b, &err) != 0)
            fail_msg("%s", err.text);
        assert_int_equal(b.n_levels, LEVELS);
        assert_true(b.id == i && b.x0 == (int)(i % 2) * BLOCK && b.y0 == (int)(i / 2) * BLOCK);
        for (uint32_t k = 0; k <= LEVELS; k++) {
            const struct seq_record *r = k < LEVELS ? &b.levels[k] : b.reference;
            assert_int_equal(seq_display(&b, r, rgb, &err), 0);
            for (int p = 0; p < BLOCK * BLOCK * 3; p++)
                assert_int_equal(rgb[p], value_at((int)r->spp, b.x0 + p / 3 % BLOCK, b.y0 + p / 3 / BLOCK, p % 3));
        }
        seq_block_release(&b);
    }
    ggn_dataset_release(&d);
    ggn_thresholds_release(&t);
}

static void resume(void **state)
{
    (void)state;
    char dir[600], out[600], path[700];
    struct seq_manifest m;
    struct base_err err = {0};
    struct stat before, after;
    int labelled;
    snprintf(dir, sizeof dir, "%s/p3d_toy-view2_part6", root);
    snprintf(out, sizeof out, "%s/out/toy", root);
    snprintf(path, sizeof path, "%s/block-00000.lseq", out);
    stat(path, &before);
    seq_manifest_read(out, &m, NULL);
    m.n_blocks = 3; /* as if the run had stopped inside the second row */
    seq_manifest_write(out, &m, NULL);
    seq_manifest_release(&m);
    if (ggn_sin3d_import_view(dir, out, &plain, &labelled, &err) != 0)
        fail_msg("%s", err.text);
    stat(path, &after);
    assert_true(before.st_ino == after.st_ino); /* the first row was not written again */
    seq_manifest_read(out, &m, NULL);
    assert_int_equal(m.n_blocks, 4);
    seq_manifest_release(&m);
    struct ggn_sin3d_options other = plain;
    other.block = SIDE;
    assert_int_equal(ggn_sin3d_import_view(dir, out, &other, &labelled, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "another sequence"));
}

/* Each spoils a fresh copy of the layout and names what must be in the message. */
static void refuse(const char *name, void (*spoil)(const char *dir), const char *why)
{
    char out[600];
    struct base_err err = {0};
    int labelled;
    const char *dir = make_view(name);
    spoil(dir);
    snprintf(out, sizeof out, "%s/refused", root);
    if (ggn_sin3d_import_view(dir, out, &plain, &labelled, &err) != BASE_EINVAL)
        fail_msg("%s was accepted", name);
    if (!strstr(err.text, why))
        fail_msg("%s: '%s' does not say '%s'", name, err.text, why);
    shell("rm -rf %s%s", out, "");
}

static void drop_level(const char *dir) { shell("rm %s/*_00060.png%s", dir, ""); }
static void mix_sizes(const char *dir) { write_level(dir, 60, 2 * SIDE); }
static void cut_level(const char *dir)
{
    char path[600];
    snprintf(path, sizeof path, "%s/p3d_toy-view2_00060.png", dir);
    assert_int_equal(truncate(path, 60), 0);
}
static void one_level(const char *dir) { shell("rm %s/*_000[4-9]0.png %s/*_00100.png", dir, dir); }
static void stranger(const char *dir) { shell("cp %s/p3d_toy-view2_00060.png %s/p3d_other_00060.png", dir, dir); }
static void odd_size(const char *dir)
{
    for (int i = 1; i <= LEVELS; i++)
        write_level(dir, 20 * i, 18);
}

static void bad_layouts(void **state)
{
    (void)state;
    refuse("gap", drop_level, "60 spp is missing");
    refuse("sizes", mix_sizes, "the other levels are");
    refuse("cut", cut_level, "00060.png");
    refuse("single", one_level, "1 levels");
    refuse("stranger", stranger, "does not belong");
    refuse("odd", odd_size, "not a multiple");
    struct ggn_sin3d_options o = plain;
    char dir[600], out[600];
    int labelled;
    o.allow_gaps = 1;
    snprintf(dir, sizeof dir, "%s/gap", root);
    snprintf(out, sizeof out, "%s/gapped", root);
    assert_int_equal(ggn_sin3d_import_view(dir, out, &o, &labelled, NULL), 0);
}

static void scene_names(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"p3d_kitchen-view1_part6", "p3d_kitchen"}, {"p3d_living-room-3-view0", "p3d_living-room-3"},
                                           {"p3d_low_table_2spheric_view0", "p3d_low_table_2spheric"}, {"p3d_arcsphere", "p3d_arcsphere"}};
    for (size_t i = 0; i < 4; i++) {
        char scene[64];
        ggn_sin3d_scene(pairs[i][0], scene, sizeof scene);
        assert_string_equal(scene, pairs[i][1]);
    }
}

static size_t make_rawls(char *out, uint32_t w, uint32_t h, uint32_t channels, const float *values)
{
    size_t n = (size_t)sprintf(out, "IHDR\n12\n");
    uint32_t head[3] = {w, h, channels};
    memcpy(out + n, head, 12);
    n += 12;
    n += (size_t)sprintf(out + n, "\nCOMMENTS\nsamples 20\nDATA of old\nDATA\n%u\n", w * h * channels * 4);
    for (uint32_t y = 0; y < h; y++) {
        memcpy(out + n, values + y * w * channels, w * channels * 4);
        n += w * channels * 4;
        out[n++] = '\n';
    }
    return n;
}

static void rawls(void **state)
{
    (void)state;
    float v[12] = {0, 0.5f, 1, 2, -1, 3.25f, 7, 8, 9, 10, 11, 1e-3f};
    char file[512];
    struct ggn_imagef image;
    struct base_err err = {0};
    size_t n = make_rawls(file, 2, 2, 3, v);
    assert_int_equal(ggn_rawls_parse("x", file, n, &image, &err), 0);
    assert_true(image.width == 2 && image.height == 2 && image.channels == 3);
    assert_memory_equal(image.data, v, sizeof v);
    ggn_imagef_release(&image);
    assert_int_equal(ggn_rawls_parse("x", file, n - 1, &image, &err), 0); /* the last newline may be missing */
    ggn_imagef_release(&image);
    for (size_t i = 0; i < n - 1; i++) {
        char *cut = malloc(i + 1);
        memcpy(cut, file, i);
        if (ggn_rawls_parse("x", cut, i, &image, &err) != BASE_EINVAL)
            fail_msg("%zu of %zu bytes were believed", i, n);
        free(cut);
    }
    n = make_rawls(file, 3, 2, 1, v);
    assert_int_equal(ggn_rawls_parse("x", file, n, &image, &err), 0);
    assert_near((double)image.data[3 * 5 + 2], 3.25, 0);
    ggn_imagef_release(&image);
    v[7] = NAN;
    n = make_rawls(file, 2, 2, 3, v);
    assert_int_equal(ggn_rawls_parse("x", file, n, &image, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "0,1 is not finite"));
    n = make_rawls(file, 0x40000000, 0, 3, v);
    assert_int_equal(ggn_rawls_parse("x", file, n, &image, &err), BASE_EINVAL);
}

static void rawls_layout(void **state)
{
    (void)state;
    char dir[600], out[600], path[700], file[4096];
    static float v[SIDE * SIDE * 3], back[3 * BLOCK * BLOCK];
    struct seq_manifest m;
    struct seq_block b;
    struct base_err err = {0};
    int labelled;
    snprintf(dir, sizeof dir, "%s/float", root);
    snprintf(out, sizeof out, "%s/float-out", root);
    mkdir(dir, 0777);
    for (int level = 1; level <= 2; level++) {
        for (int i = 0; i < SIDE * SIDE * 3; i++)
            v[i] = 0.01f * (float)(i % 300);
        size_t n = make_rawls(file, SIDE, SIDE, 3, v);
        snprintf(path, sizeof path, "%s/a_%05d.rawls", dir, 20 * level);
        FILE *f = fopen(path, "wb");
        assert_int_equal(fwrite(file, 1, n, f), n);
        fclose(f);
    }
    if (ggn_sin3d_import_view(dir, out, &plain, &labelled, &err) != 0 || seq_manifest_read(out, &m, &err) != 0 ||
        seq_manifest_read_block(out, &m, 1, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(seq_mean(&b, &b.levels[0], back, &err), 0);
    assert_near((double)back[0], (double)v[BLOCK * 3], 0.02 * (double)v[BLOCK * 3]);
    seq_block_release(&b);
    seq_manifest_release(&m);
}

static void real_sequence(void **state)
{
    (void)state;
    static const char dir[] = "../shared/sequences/cornell-box";
    char copy[700], out[600];
    if (access(dir, R_OK) != 0) {
        print_message("# SKIP ../shared is absent\n");
        skip();
    }
    /* Two of its levels: reading all twenty four times over takes too long for a unit test. */
    struct seq_manifest m;
    struct base_err err = {0};
    int labelled;
    snprintf(copy, sizeof copy, "%s/real", root);
    snprintf(out, sizeof out, "%s/real-out", root);
    mkdir(copy, 0777);
    shell("cp %s/*_05000.png %s/", dir, copy);
    shell("cp %s/*_10000.png %s/", dir, copy);
    struct ggn_sin3d_options o = {.block = 200, .allow_gaps = 1};
    if (ggn_sin3d_import_view(copy, out, &o, &labelled, &err) != 0 || seq_manifest_read(out, &m, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(m.n_blocks, 16);
    assert_string_equal(m.scene, "p3d_cornel-box");
    assert_int_equal(m.levels[m.n_levels - 1], 10000);
    seq_manifest_release(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layout), cmocka_unit_test(resume), cmocka_unit_test(bad_layouts), cmocka_unit_test(scene_names),
        cmocka_unit_test(rawls), cmocka_unit_test(rawls_layout), cmocka_unit_test(real_sequence),
    };
    return cmocka_run_group_tests_name("import_sin3d", tests, setup, teardown);
}
