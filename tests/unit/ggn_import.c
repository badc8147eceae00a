/* Pictures into sequences: the SIN3D layout on a small generated copy of it; the .rawls reader; a real sequence when it is
 * there. Other files and halves: tests/hosts/test_sequence.py. */
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
#include "picture/read.h"
#include "data/import.h"
#include "sequence/simulate.h"
#include "support/ggn_transcript.h"
#include "picture/png.h"

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

static uint8_t value_at(int spp, int x, int y, int c) { return (uint8_t)((unsigned)(spp + 7 * x + 13 * y + 50 * c) % 256u); }

static void write_level(const char *dir, int spp, int side)
{
    static uint8_t rgb[64 * 64 * 3];
    char path[4096];
    for (int i = 0; i < side * side * 3; i++)
        rgb[i] = value_at(spp, i / 3 % side, i / 3 / side, i % 3);
    snprintf(path, sizeof path, "%s/p3d_toy-view2_%05d.png", dir, spp);
    assert_int_equal(pic_write_png(path, side, side, 3, rgb, NULL), 0);
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

static const struct ggn_import_options plain = {.block = BLOCK};

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
    assert_int_equal(ggn_thresholds_parse_csv("t.csv", text, strlen(text), &t, NULL), 0);
    struct ggn_import_options o = plain;
    o.thresholds = &t;
    if (ggn_import_view(dir, out, &o, &labelled, &err) != 0)
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
    if (ggn_import_view(dir, out, &plain, &labelled, &err) != 0)
        fail_msg("%s", err.text);
    stat(path, &after);
    assert_true(before.st_ino == after.st_ino); /* the first row was not written again */
    seq_manifest_read(out, &m, NULL);
    assert_int_equal(m.n_blocks, 4);
    seq_manifest_release(&m);
    struct ggn_import_options other = plain;
    other.block = SIDE;
    assert_int_equal(ggn_import_view(dir, out, &other, &labelled, &err), BASE_EINVAL);
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
    if (ggn_import_view(dir, out, &plain, &labelled, &err) != BASE_EINVAL)
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
static void strangers(const char *dir)
{
    shell("cp %s/p3d_toy-view2_00060.png %s/p3d_other_00060.png", dir, dir);
    shell("cp %s/p3d_toy-view2_00060.png %s/p3d_other_00080.png", dir, dir);
}
static void twice(const char *dir) { shell("cp %s/p3d_toy-view2_00060.png %s/p3d_toy-view2_060.png", dir, dir); }
static void other_kind(const char *dir) { shell("cp %s/p3d_toy-view2_00060.png %s/p3d_toy-view2_00120.rawls", dir, dir); }
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
    refuse("strangers", strangers, "pictures of 'p3d_toy-view2' and of 'p3d_other' (expected those of one view)");
    refuse("two", twice, "two images for 60 spp, 'p3d_toy-view2_00060.png' and 'p3d_toy-view2_060.png'");
    refuse("two-kinds", other_kind, "p3d_toy-view2_00120.rawls: the sequence 'p3d_toy-view2' has .png files, too");
    refuse("odd", odd_size, "not a multiple");
    struct ggn_import_options o = plain;
    char dir[600], out[600];
    int labelled;
    o.allow_gaps = 1;
    snprintf(dir, sizeof dir, "%s/gap", root);
    snprintf(out, sizeof out, "%s/gapped", root);
    assert_int_equal(ggn_import_view(dir, out, &o, &labelled, NULL), 0);
}

static void litter(const char *dir)
{
    static const char *const names[] = {
        "preview-256.png",  "._p3d_toy-view2_00020.png",   ".DS_Store", "Thumbs.db",
        "notes_7.txt",      "p3d_toy-view2_00020 (1).png", "x~",        "p3d_toy-view2_00020.png~",
        "p3d_other_9.jpeg", "._p3d_toy-view2_00120.png",   "p3d.exr"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        shell("echo litter >'%s/%s'", dir, names[i]);
    shell("mv %s/p3d_toy-view2_00040.png %s/p3d_toy-view2_40.PNG", dir, dir);
}

/* What is hidden or called otherwise is none of the sequence. */
static void litter_is_left_where_it_is(void **state)
{
    char out[2][600];
    struct base_err err = {0};
    int labelled;
    (void)state;
    for (int i = 0; i < 2; i++) {
        const char *dir = make_view(i ? "littered" : "clean");
        if (i)
            litter(dir);
        snprintf(out[i], sizeof out[i], "%s/%s-out", root, i ? "littered" : "clean");
        assert_int_equal(ggn_import_pictures(dir), LEVELS);
        assert_int_equal(ggn_import_check(dir, &plain, &err), 0);
        if (ggn_import_view(dir, out[i], &plain, &labelled, &err) != 0)
            fail_msg("%s", err.text);
    }
    shell("diff -r %s %s", out[0], out[1]);
}

/* Halves of ACES primaries, in files of their own, as layers, and as layers that are the picture: the first two are the same
 * sequence, the third has no noise. Values are light, whose planes are half floats. */
static void halves_are_converted_as_pictures(void **state)
{
    static const char *const kinds[] = {"files", "layers", "still"};
    static float mean[3 * BLOCK * BLOCK], d[3][3 * BLOCK * BLOCK];
    (void)state;
    shell("cd %s && mkdir %s", root,
          "aces aces/files aces/layers aces/still && "
          "aces='--attrib:type=float[8] chromaticities .7347,.2653,0,1,.0001,-.077,.32168,.33767 -d float' && for n in 4 8; "
          "do "
          "oiiotool --pattern constant:color=.5,.4,.3 8x8 3 $aces -o aces/files/a_$n.exr "
          "--pattern constant:color=.52,.38,.31 8x8 3 $aces -o aces/files/a_half_$n.exr "
          "--pattern constant:color=.5,.4,.3,.52,.38,.31 8x8 6 --chnames R,G,B,half.R,half.G,half.B $aces "
          "-o aces/layers/a_$n.exr --pattern constant:color=.5,.4,.3,.5,.4,.3 8x8 6 "
          "--chnames R,G,B,half.R,half.G,half.B $aces -o aces/still/a_$n.exr; done");
    for (int k = 0; k < 3; k++) {
        char dir[600], out[600];
        struct base_err err = {0};
        struct seq_manifest m;
        struct seq_block b;
        int labelled;
        snprintf(dir, sizeof dir, "%s/aces/%s", root, kinds[k]);
        snprintf(out, sizeof out, "%s/aces-%s", root, kinds[k]);
        if (ggn_import_view(dir, out, &plain, &labelled, &err) != 0 || seq_manifest_read(out, &m, &err) != 0 ||
            seq_manifest_read_block(out, &m, 0, &b, &err) != 0 || seq_halves(&b, &b.levels[1], mean, d[k], &err) != 0)
            fail_msg("%s", err.text);
        assert_near((double)mean[0], .71386097, 1e-3); /* red of Rec. 709: tests/cli/ggn_compare.sh has it from elsewhere */
        seq_block_release(&b);
        seq_manifest_release(&m);
    }
    for (size_t i = 0; i < 3 * BLOCK * BLOCK; i++) {
        assert_near((double)d[1][i], (double)d[0][i], 1e-6);
        assert_near((double)d[2][i], 0, 0);
    }
    assert_true(fabsf(d[0][0]) > 0.01f);
}

/* A layer that only some levels have is no reason to do without it. */
static void halves_of_some_levels(void **state)
{
    char dir[600], out[600];
    struct base_err err = {0};
    int labelled;
    (void)state;
    snprintf(dir, sizeof dir, "%s/some", root);
    snprintf(out, sizeof out, "%s/some-out", root);
    shell("cp -r %s/aces/layers %s", root, dir);
    shell("cp %s/aces/files/a_4.exr %s/", root, dir);
    assert_int_equal(ggn_import_view(dir, out, &plain, &labelled, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "'a_8.exr' has a half, 'a_4.exr' has none"));
}

/* Levels whose stored pixels lie elsewhere in their pictures are no levels of one view. */
static void other_windows(void **state)
{
    char dir[600], out[600];
    struct base_err err = {0};
    int labelled;
    (void)state;
    snprintf(dir, sizeof dir, "%s/windows", root);
    snprintf(out, sizeof out, "%s/windows-out", root);
    shell("mkdir %s && cd %s && for n in 4 8; do oiiotool --pattern constant:color=.5,.4,.3 8x8 3 --fullsize 16x16+0+0 "
          "-d float -o a_$n.exr; done && oiiotool a_8.exr --origin +2+3 --fullsize 16x16+0+0 -o a_16.exr",
          dir, dir);
    assert_int_equal(ggn_import_view(dir, out, &plain, &labelled, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "a_16.exr: its data window begins at 2,3, that of 'a_4.exr' at 0,0"));
    shell("rm %s/a_16.exr%s", dir, "");
    assert_int_equal(ggn_import_view(dir, out, &plain, &labelled, &err), 0);
}

/* Of several views one in pictures that are not read, or whose names tell no levels, is no reason to do without it. */
static void pictures_that_are_no_levels(void **state)
{
    static const char *const names[] = {"a_20.tif", "a_20.HDR", "a20.png", "00020.png", "a_20spp.exr", "wood.png", "x7.txt"};
    struct base_err err = {0};
    char dir[600];
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(dir, sizeof dir, "%s/odd-%zu", root, i);
        shell("mkdir %s%s", dir, "");
        shell("touch %s/%s", dir, names[i]);
        shell("touch %s/b%s", dir, names[i]);
        assert_int_equal(ggn_import_pictures(dir), i < 2 ? 1 : 0);
        assert_int_equal(ggn_import_looks_numbered(dir), i < 5);
    }
    snprintf(dir, sizeof dir, "%s/odd-0", root);
    shell("rm %s/b%s", dir, names[0]);
    assert_int_equal(ggn_import_check(dir, &plain, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "odd-0/a_20.tif: such pictures are not read (expected .exr, .png, .jpg or .rawls)"));
}

static void scene_names(void **state)
{
    (void)state;
    static const char *const pairs[][2] = {{"p3d_kitchen-view1_part6", "p3d_kitchen"},
                                           {"p3d_living-room-3-view0", "p3d_living-room-3"},
                                           {"p3d_low_table_2spheric_view0", "p3d_low_table_2spheric"},
                                           {"p3d_arcsphere", "p3d_arcsphere"}};
    for (size_t i = 0; i < 4; i++) {
        char scene[64];
        ggn_import_scene(pairs[i][0], scene, sizeof scene);
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
    struct pic_image image;
    struct base_err err = {0};
    size_t n = make_rawls(file, 2, 2, 3, v);
    assert_int_equal(ggn_rawls_parse("x", file, n, &image, &err), 0);
    assert_true(image.width == 2 && image.height == 2 && image.channels == 3);
    assert_memory_equal(image.f32, v, sizeof v);
    pic_release(&image);
    assert_int_equal(ggn_rawls_parse("x", file, n - 1, &image, &err), 0); /* the last newline may be missing */
    pic_release(&image);
    for (size_t i = 0; i < n - 1; i++) {
        char *cut = malloc(i + 1);
        memcpy(cut, file, i);
        if (ggn_rawls_parse("x", cut, i, &image, &err) != BASE_EINVAL)
            fail_msg("%zu of %zu bytes were believed", i, n);
        free(cut);
    }
    n = make_rawls(file, 3, 2, 1, v);
    assert_int_equal(ggn_rawls_parse("x", file, n, &image, &err), 0);
    assert_near((double)image.f32[3 * 5 + 2], 3.25, 0);
    pic_release(&image);
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
    if (ggn_import_view(dir, out, &plain, &labelled, &err) != 0 || seq_manifest_read(out, &m, &err) != 0 ||
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
    struct ggn_import_options o = {.block = 200, .allow_gaps = 1};
    if (ggn_import_view(copy, out, &o, &labelled, &err) != 0 || seq_manifest_read(out, &m, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(m.n_blocks, 16);
    assert_string_equal(m.scene, "p3d_cornel-box");
    assert_int_equal(m.levels[m.n_levels - 1], 10000);
    seq_manifest_release(&m);
}

/* --- transcripts: what is read, and every line --- */

static void put(const char *format, const char *name, const char *contents)
{
    char path[900];
    snprintf(path, sizeof path, format, root, name);
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fputs(contents, f);
    fclose(f);
}

/* Which names are levels of a view. */
static void names_of_levels(FILE *f)
{
    static const char *const names[] = {"a_00020.png",     "a_20.rawls",       "a_20.PNG",    "a_20.jpg",     "_20.png",
                                        "b_7.png",         "a20.png",          "a_.png",      "a_0.png",      "a_000.png",
                                        "a_123456789.png", "a_1234567890.png", "a_20",        "a_20.png.bak", ".a_20.png",
                                        "a_2x.png",        "a-b_c_20.png",     "a_20.png.png"};
    char dir[600], name[300];
    for (size_t i = 0; i < sizeof names / sizeof names[0] + 3; i++) {
        size_t more = i - sizeof names / sizeof names[0];
        snprintf(dir, sizeof dir, "%s/name", root);
        mkdir(dir, 0777);
        if (i < sizeof names / sizeof names[0])
            snprintf(name, sizeof name, "%s", names[i]);
        else
            snprintf(name, sizeof name, "%0*d_20.png", (int)more + GGN_VIEW_NAME - 2, 0);
        put("%s/name/%s", name, "");
        fprintf(f, "%s: %d\n", name, ggn_import_pictures(dir));
        shell("rm -r %s%s", dir, "");
    }
}

static void print_progress(void *data, const char *view, int done, int of)
{
    fprintf(data, "  %s %d of %d\n", view, done, of);
}

static void print_import(FILE *f, const char *name, const char *dir, const char *out, const struct ggn_import_options *o)
{
    struct base_err err = {0};
    struct seq_manifest m;
    struct ggn_labels l;
    int labelled = -1;
    fprintf(f, "%s: ", name);
    if (ggn_import_view(dir, out, o, &labelled, &err)) {
        fprintf(f, "%s; %s\n", err.text, access(out, F_OK) == 0 ? "the folder is there" : "nothing is there");
        return;
    }
    assert_int_equal(seq_manifest_read(out, &m, NULL), 0);
    fprintf(f, "labelled %d; %s of %s by %s, %ux%u in %u, reference %u %d, levels", labelled, m.scene, m.source, m.renderer,
            m.width, m.height, m.block, m.reference_spp, m.reference_independent);
    for (uint32_t i = 0; i < m.n_levels; i++)
        fprintf(f, " %u", m.levels[i]);
    for (uint32_t i = 0; i < m.n_blocks; i++)
        fprintf(f, "; %u %s %u,%u..%u,%u", m.blocks[i].id, m.blocks[i].file, m.blocks[i].x0, m.blocks[i].y0, m.blocks[i].x1,
                m.blocks[i].y1);
    fputc('\n', f);
    seq_manifest_release(&m);
    if (!labelled)
        return;
    assert_int_equal(ggn_labels_read(out, &l, NULL), 0);
    fprintf(f, "  %s, %s, cap %g, spread %g:", l.source, l.detail, l.cap, l.spread);
    for (uint32_t i = 0; i < l.n; i++)
        fprintf(f, " %u %g %d", l.labels[i].id, l.labels[i].threshold, l.labels[i].censored);
    fputc('\n', f);
    ggn_labels_release(&l);
}

static void second_gone(const char *dir) { shell("rm %s/*_00040.png%s", dir, ""); }
static void early(const char *dir) { shell("mv %s/p3d_toy-view2_00080.png %s/p3d_toy-view2_00070.png", dir, dir); }
static void keep(const char *dir) { (void)dir; }

static void views_are_told_word_by_word(void **state)
{
    static const struct {
        const char *name, *thresholds;
        void (*spoil)(const char *dir);
        int block, gaps;
    } cases[] = {{"whole", "p3d_toy-view2;1;2;3;4\np3d_toy-view2_part6;40;99.5;100;101\n", keep, BLOCK, 0},
                 {"named", "other;1\np3d_toy-view2;1;2;3;4\nnamed;5;6;7;8", keep, BLOCK, 0},
                 {"folder", "x;1\nfolder;5;6;7;8", keep, BLOCK, 0},
                 {"nobody", "x;1", keep, BLOCK, 0},
                 {"few", "few;5;6;7", keep, BLOCK, 0},
                 {"large", "large;7", keep, SIDE, 0},
                 {"odd5", "odd5;1", keep, 5, 0},
                 {"drop", NULL, drop_level, BLOCK, 0},
                 {"second", NULL, second_gone, BLOCK, 0},
                 {"early", NULL, early, BLOCK, 0},
                 {"gaps", NULL, early, BLOCK, 1},
                 {"mix", NULL, mix_sizes, BLOCK, 0},
                 {"one", NULL, one_level, BLOCK, 0},
                 {"stranger2", NULL, strangers, BLOCK, 0},
                 {"twice", NULL, twice, BLOCK, 0},
                 {"kind", NULL, other_kind, BLOCK, 0}};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    char out[700];
    (void)state;
    names_of_levels(f);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct ggn_import_options o = {
            .block = cases[i].block, .allow_gaps = cases[i].gaps, .progress = i == 0 ? print_progress : NULL, .data = f};
        struct ggn_thresholds thresholds = {0};
        char csv[200];
        const char *dir = make_view(cases[i].name);
        cases[i].spoil(dir);
        if (cases[i].thresholds) {
            snprintf(csv, sizeof csv, "%s", cases[i].thresholds);
            assert_int_equal(ggn_thresholds_parse_csv("t.csv", csv, strlen(csv), &thresholds, NULL), 0);
            o.thresholds = &thresholds;
        }
        snprintf(out, sizeof out, "%s/%s-out", root, cases[i].name);
        print_import(f, cases[i].name, dir, out, &o);
        if (i == 0) { /* and once more, with other options */
            print_import(f, "again", dir, out, &o);
            print_import(f, "in larger blocks", dir, out, &(struct ggn_import_options){.block = SIDE});
            snprintf(out, sizeof out, "%s/none/x", root);
            print_import(f, "into no folder", dir, out, &o);
            print_import(f, "nothing", out, dir, &o);
        }
        ggn_thresholds_release(&thresholds);
    }
    transcript_hide(&t, root, "ROOT");
    transcript_end(&t, "data-sin3d");
}

/* A line for each run of equal answers. */
static void print_rawls(FILE *f, const char *what, long value, const char *file, size_t n, char last[256])
{
    struct pic_image image;
    struct base_err err = {0};
    int rc = ggn_rawls_parse("x", file, n, &image, &err);
    char text[256] = "";
    size_t used = 0;
    if (rc)
        snprintf(text, sizeof text, "%.200s", err.text);
    for (int i = 0; i < 12 && !rc && i < 3 * image.width * image.height; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, " %g", (double)image.f32[i]);
    if (!rc)
        pic_release(&image);
    if (strcmp(text, last) != 0)
        fprintf(f, "%s %ld: %s\n", what, value, text);
    strcpy(last, text);
}

static void rawls_are_told_word_by_word(void **state)
{
    static const uint32_t sizes[][3] = {{2, 2, 1},     {2, 2, 3},        {2, 2, 2},        {2, 2, 4},     {2, 2, 0},
                                        {0, 2, 3},     {2, 0, 3},        {32768, 1, 1},    {32769, 1, 1}, {1, 32768, 1},
                                        {1, 32769, 1}, {32768, 4096, 3}, {32768, 4097, 3}, {3, 1, 3},     {1, 4, 3}};
    float v[12] = {0, 0.5f, 1, 2, -1, 3.25f, 7, 8, 9, 10, 11, 1e-3f};
    char file[512], last[256] = "";
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    size_t n = make_rawls(file, 2, 2, 3, v);
    for (size_t i = 0; i <= n; i++)
        print_rawls(f, "bytes", (long)i, file, i, last);
    for (size_t i = 0; i < n; i++) {
        file[i] ^= 0x20;
        print_rawls(f, "otherwise at", (long)i, file, n, last);
        file[i] ^= 0x20;
    }
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        n = make_rawls(file, 2, 2, 3, v);
        memcpy(file + 8, sizes[i], 12);
        last[0] = '\0';
        print_rawls(f, "size", (long)i, file, n, last);
    }
    for (int i = 0; i < 12; i++) {
        float kept = v[i];
        v[i] = i % 2 ? INFINITY : NAN;
        n = make_rawls(file, 2, 2, 3, v);
        print_rawls(f, "value", i, file, n, last);
        v[i] = kept;
    }
    transcript_end(&t, "data-rawls");
}

/* --- pictures of other programs --- */

static void print_image(FILE *f, const char *name)
{
    struct pic_image image;
    struct pic_image channel;
    struct base_err err = {0};
    char path[600];
    snprintf(path, sizeof path, "%s/%s", root, name);
    fprintf(f, "%s: ", name);
    if (pic_read_display(path, &image, &err)) {
        fprintf(f, "%s\n", err.text);
    } else {
        fprintf(f, "%dx%d, %zu clipped:", image.width, image.height, image.clipped);
        for (int i = 0; i < 3 * image.width * image.height && i < 18; i++)
            fprintf(f, " %d", image.u8[i]);
        fputc('\n', f);
        pic_release(&image);
    }
    if (!strstr(name, ".exr"))
        return;
    if (pic_read_channel(path, "lull.spp", &channel, &err)) {
        fprintf(f, "  %s\n", err.text);
    } else {
        fprintf(f, "  %dx%d, %d channel:", channel.width, channel.height, channel.channels);
        for (int i = 0; i < channel.width * channel.height; i++)
            fprintf(f, " %g", (double)channel.f32[i]);
        fputc('\n', f);
        pic_release(&channel);
    }
}

static void pictures_of_others(void **state)
{
    static const char *const names[] = {"none.png", "grey.png", "grey-alpha.png", "rgba.png", "mixed.exr",
                                        "xyz.exr",  "two.exr",  "parts.exr",      "half.exr", "folder.png"};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    char path[600], command[2000];
    struct base_err err = {0};
    struct pic_image image;
    (void)state;
    /* rgba.png is 17/255, 34/255, 51/255 at 85/255: eight bits hold it with the alpha multiplied in and without, as versions of
     * OpenImageIO multiply before they round or after. */
    snprintf(command, sizeof command,
             "cd %s && mkdir folder.png && oiiotool --pattern constant:color=0.3 2x1 1 -d uint8 -o grey.png --pattern "
             "constant:color=0.3,0.5 2x1 2 --chnames Y,A -d uint8 -o grey-alpha.png "
             "--pattern constant:color=0.0666667,0.1333333,0.2,0.3333333 2x1 4 -d uint8 -o rgba.png "
             "--pattern constant:color=9,0.2,0.3,0.4,8 2x1 5 --chnames AA,G,B,R,Z -d float -o mixed.exr "
             "--pattern constant:color=0.1,0.2,-0.3,0.4 2x1 4 --chnames x1,x2,x3,x4 -d float -o xyz.exr --pattern "
             "constant:color=0.7,0.2 2x1 2 --chnames a1,lull.spp -d float -o two.exr "
             "--pattern constant:color=0.25,2,1 3x2 3 -d half -o half.exr --pattern constant:color=7,5 3x2 2 --chnames "
             "other,lull.spp -d float --siappend -o parts.exr >/dev/null 2>&1",
             root);
    if (system(command) != 0)
        fail_msg("oiiotool failed");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        print_image(f, names[i]);
    transcript_hide(&t, root, "ROOT");
    transcript_end(&t, "data-pictures");
    /* the library's words are its own: each line begins with the file, once */
    for (int i = 0; i < 2; i++) {
        put("%s/%s", i ? "garbage.webp" : "garbage.jpg", "garbage garbage garbage garbage garbage\n");
        snprintf(path, sizeof path, "%s/garbage.%s", root, i ? "webp" : "jpg");
        assert_int_equal(pic_read_display(path, &image, &err), BASE_EINVAL);
        assert_int_equal(strncmp(err.text, path, strlen(path)), 0);
        assert_null(strchr(err.text, '\n'));
        if (i ? strstr(err.text + 1, path) != NULL : strncmp(err.text + strlen(path), ": ", 2) != 0)
            fail_msg("%s", err.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layout),
        cmocka_unit_test(resume),
        cmocka_unit_test(bad_layouts),
        cmocka_unit_test(litter_is_left_where_it_is),
        cmocka_unit_test(halves_are_converted_as_pictures),
        cmocka_unit_test(halves_of_some_levels),
        cmocka_unit_test(other_windows),
        cmocka_unit_test(pictures_that_are_no_levels),
        cmocka_unit_test(scene_names),
        cmocka_unit_test(rawls),
        cmocka_unit_test(rawls_layout),
        cmocka_unit_test(real_sequence),
        cmocka_unit_test(views_are_told_word_by_word),
        cmocka_unit_test(rawls_are_told_word_by_word),
        cmocka_unit_test(pictures_of_others),
    };
    return cmocka_run_group_tests_name("import", tests, setup, teardown);
}
