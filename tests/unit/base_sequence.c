/* Blocks of a sequence: what is written is read back, every kind of damage is noticed, and two runs are told apart. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <zlib.h>

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"
#include "sequence/manifest.h"
#include "sequence/simulate.h"
#include "support/ggn_near.h"
#include "support/base_made_block.h"

static void round_trip(void **state)
{
    (void)state;
    struct seq_builder w;
    struct seq_block b;
    struct base_err err = {0};
    uint32_t crc;
    static uint8_t bytes[3 * MADE_P];
    static float floats[3 * MADE_P];
    made_build(&w);
    assert_int_equal(seq_builder_write(&w, made_path, &crc, &err), 0);
    if (seq_block_read(made_path, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(b.n_levels, 3);
    assert_true(b.width == MADE_W && b.height == MADE_H && b.x0 == 400 && b.y0 == 200 && b.id == 9 && b.seed == 77);
    assert_non_null(b.reference);
    assert_int_equal(b.reference->spp, 4096);
    assert_ptr_equal(seq_level(&b, 40), &b.levels[1]);
    assert_null(seq_level(&b, 41));
    for (int i = 0; i < 4; i++) {
        const struct seq_record *r = i < 3 ? &b.levels[i] : b.reference;
        made_fill(i);
        assert_near(seq_stat(r, "dammertz"), 0.25, 0);
        assert_true(isnan(seq_stat(r, "nothing")));
        seq_display_planar(&b, r, bytes, NULL);
        assert_memory_equal(bytes, made_display, sizeof made_display);
        seq_display(&b, r, bytes, NULL);
        assert_int_equal(bytes[3 * 5 + 2], made_display[2 * MADE_P + 5]);
        seq_mean(&b, r, floats, NULL);
        for (int k = 0; k < 3 * MADE_P; k++)
            assert_near((double)floats[k], made_mean[k],
                        i == 0 || i == 2 ? (made_display[k] == 255 ? 0.022 * made_mean[k] : 0.0006) : 0.0005);
        seq_half_luminance(&b, r, floats, NULL);
        for (int k = 0; k < MADE_P; k++) {
            double y = base_luminance(made_half[k], made_half[MADE_P + k], made_half[2 * MADE_P + k]);
            assert_near((double)floats[k], y, 0.0906 * fabs(y) + 3e-5);
        }
        assert_int_equal(seq_half(&b, r, floats, &err), i == 1 || i == 3 ? 0 : BASE_EINVAL);
    }
    seq_block_release(&b);
    seq_builder_release(&w);
}

/* M and D of a level, and pictures of other sample counts made of them. */
static void other_counts(void **state)
{
    (void)state;
    struct seq_builder w;
    struct seq_block b;
    uint32_t crc;
    static float m[3 * MADE_P], d[3 * MADE_P], wanted[3 * MADE_P], y[MADE_P];
    made_build(&w);
    assert_int_equal(seq_builder_write(&w, made_path, &crc, NULL), 0);
    assert_int_equal(seq_block_read(made_path, &b, NULL), 0);
    for (int i = 0; i < 2; i++) { /* luminance of D alone, and all of it */
        assert_int_equal(seq_halves(&b, &b.levels[i], m, d, NULL), 0);
        assert_int_equal(seq_mean(&b, &b.levels[i], wanted, NULL), 0);
        assert_memory_equal(m, wanted, sizeof m);
        assert_int_equal(i ? seq_half(&b, &b.levels[1], wanted, NULL) : seq_half_luminance(&b, &b.levels[0], wanted, NULL),
                         0);
        for (int k = 0; k < 3 * MADE_P; k++)
            assert_true(d[k] == wanted[i ? k : k % MADE_P]);
        assert_int_equal(seq_mean_luminance(&b, &b.levels[i], y, NULL), 0);
        for (int k = 0; k < MADE_P; k++)
            assert_near((double)y[k], base_luminance((double)m[k], (double)m[MADE_P + k], (double)m[2 * MADE_P + k]), 1e-6);
    }
    for (int k = 0; k < 3 * MADE_P; k++)
        wanted[k] = m[k] - 0.5f * d[k];
    seq_simulate(m, d, 3 * MADE_P, -seq_noise_scale(40, 160), d); /* in place */
    assert_memory_equal(d, wanted, sizeof d);
    seq_block_release(&b);
    seq_builder_release(&w);

    /* squares of the scales against the variances that they are there for, of samples of variance 1 */
    const double n = 23, h = 7, r = 100;
    assert_near(pow(seq_half_scale(n, h), 2) * (1 / h + 1 / (n - h)) / 4, 1 / n, 1e-15);
    assert_near(pow(seq_means_scale(h, n), 2) * (1 / h - 1 / n), 1 / n, 1e-15);
    assert_near(pow(seq_reference_scale(r, n), 2) * (1 / n + 1 / r), 1 / n, 1e-15);
    assert_near(pow(seq_noise_scale(h, n), 2) / h, 1 / n, 1e-15);
    assert_true(seq_half_scale(16, 8) == 1 && seq_half_scale(5, 0) == 0 && seq_half_scale(5, 5) == 0);
}

static void sample_counts(void **state)
{
    (void)state;
    uint32_t spp[8];
    const uint32_t geometric[] = {2, 3, 4, 5, 8, 9}, linear[] = {3, 7, 10};
    assert_int_equal(seq_levels(2, 9, 1.4, 1, spp, 8), 6); /* 2, 2.8, 3.92, 5.49, 7.68 and the end */
    assert_memory_equal(spp, geometric, sizeof geometric);
    assert_int_equal(seq_levels(3, 10.5, 4, 0, spp, 3), 3);
    assert_memory_equal(spp, linear, sizeof linear);
    assert_int_equal(seq_levels(3, 10.5, 4, 0, spp, 2), 3); /* no room for the end, … */
    assert_int_equal(seq_levels(3, 11, 4, 0, spp, 2), 3);   /* … which is a step here */
    assert_int_equal(seq_levels(1, 5, 1.01, 1, spp, 8), 5); /* each once */
}

/* Any truncation and any single damaged byte is noticed. */
static void damage(void **state)
{
    (void)state;
    char *bytes;
    size_t size;
    struct seq_block b;
    struct base_err err = {0};
    assert_int_equal(base_file_read(made_path, 1 << 24, &bytes, &size, &err), 0);
    for (size_t i = 0; i < size; i += i < 400 ? 1 : 97) {
        uint8_t *cut = malloc(i + 1), *bad = malloc(size);
        memcpy(cut, bytes, i);
        memcpy(bad, bytes, size);
        bad[i] ^= 0x10;
        if (seq_block_parse("cut", cut, i, &b, &err) != BASE_EINVAL)
            fail_msg("%zu of %zu bytes were believed", i, size);
        if (seq_block_parse("bad", bad, size, &b, &err) != BASE_EINVAL)
            fail_msg("damage at byte %zu was believed", i);
        free(cut);
        free(bad);
    }
    free(bytes);
}

static uint32_t crc_of(const uint8_t *bytes, size_t size) { return (uint32_t)crc32_z(0, bytes, size); }

/* Makes the checksums right again, as far as the records go. */
static void reseal(uint8_t *bytes, size_t size)
{
    base_put_u32(bytes + 60, crc_of(bytes, 60));
    for (size_t at = SEQ_FILE_HEADER; at + SEQ_RECORD_HEADER <= size;) {
        size_t payload = base_get_u32(bytes + at + 20);
        if (payload <= size - at - SEQ_RECORD_HEADER)
            base_put_u32(bytes + at + 24, crc_of(bytes + at + SEQ_RECORD_HEADER, payload));
        base_put_u32(bytes + at + 28, crc_of(bytes + at, 28));
        at += SEQ_RECORD_HEADER + payload;
    }
}

static void expect_block(uint8_t *bytes, size_t size, const char *words)
{
    struct seq_block b;
    struct base_err err = {0};
    char line[128];
    uint8_t *copy = malloc(size);
    memcpy(copy, bytes, size);
    snprintf(line, sizeof line, "b: %s", words ? words : "");
    int rc = seq_block_parse("b", copy, size, &b, &err);
    if (rc != (words ? BASE_EINVAL : 0) || (words && strcmp(err.text, line) != 0))
        fail_msg("%d \"%s\", expected \"%s\"", rc, err.text, line);
    if (rc)
        free(copy);
    else
        seq_block_release(&b);
}

/* One number of a good file is another one, and the checksums fit: what is said of it, word for word. */
static void limits_of_blocks(void **state)
{
    (void)state;
    enum { FIRST = SEQ_FILE_HEADER, STATS = FIRST + SEQ_RECORD_HEADER, PLANE = STATS + 2 * SEQ_STAT_BYTES };
    char *text;
    size_t size;
    struct base_err err = {0};
    assert_int_equal(base_file_read(made_path, 1 << 24, &text, &size, &err), 0);
    uint8_t *bytes = (uint8_t *)text;
    const size_t second = FIRST + SEQ_RECORD_HEADER + base_get_u32(bytes + FIRST + 20);
    const size_t plane_1 = PLANE + SEQ_PLANE_HEADER + base_get_u32(bytes + PLANE + 12);
    const struct {
        size_t at;
        uint32_t value;
        const char *words;
    } cases[] = {
        {0, 0, "not a block sequence"},
        {8, 2, "a look at a whole frame (version 2 of the format), expected a block alone"},
        {8, 3, "version 3 of the format is not known"},
        {12, 63, "version 1 of the format is not known"},
        {16, 0, "a block of 0x21 pixels with 4 images"},
        {16, 4097, "a block of 4097x21 pixels with 4 images"},
        {20, 0, "a block of 37x0 pixels with 4 images"},
        {20, 4097, "a block of 37x4097 pixels with 4 images"},
        {36, 0, "a block of 37x21 pixels with 0 images"},
        {36, 4097, "a block of 37x21 pixels with 4097 images"},
        {36, (uint32_t)((size - FIRST) / SEQ_RECORD_HEADER) + 1, NULL}, /* told below: it depends on zlib */
        {36, 5, "header of image 3 makes no sense"},                    /* a reference that is not the last */
        {36, 3, "bytes after the last image"},
        {24, 0xfffffff0u, NULL},
        {32, 77, NULL},
        {FIRST, 3, "header of image 0 makes no sense"},
        {FIRST, 2, "header of image 0 makes no sense"},
        {FIRST, 0, "header of image 0 makes no sense"},
        {FIRST + 4, 0, "header of image 0 makes no sense"},
        {FIRST + 4, 39, NULL},
        {FIRST + 4, 40, "levels do not rise: 40 spp after 40"},
        {FIRST + 8, 20, NULL},
        {FIRST + 8, 21, "header of image 0 makes no sense"},
        {FIRST + 12, 65, "header of image 0 makes no sense"},
        {FIRST + 16, 0, "header of image 0 makes no sense"},
        {FIRST + 16, 17, "header of image 0 makes no sense"},
        {FIRST + 16, 2, "20 spp: bytes after the last plane"},
        {FIRST + 16, 4, "20 spp: plane 3 is cut short"},
        {FIRST + 20, 0xffffff, "truncated: 0 of 4 images"},
        {second, 2, "header of image 1 makes no sense"},
        {second + 4, 20, "levels do not rise: 20 spp after 20"},
        {second + 4, 21, NULL},
        {STATS + SEQ_NAME + 4, 0x7ff00000, "20 spp: statistic 0 is not usable"},
        {STATS + SEQ_STAT_BYTES + SEQ_NAME + 4, 0x7ff80000, "20 spp: statistic 1 is not usable"},
        {PLANE, 99, "20 spp: no display image"},
        {PLANE + 4, 8, "20 spp: plane 0 has the wrong size, filter or number"},
        {PLANE + 8, 3 * MADE_P + 1, "20 spp: plane 0 has the wrong size, filter or number"},
        {PLANE + 12, 0xffffff, "20 spp: plane 0 is cut short"},
        {plane_1, SEQ_PLANE_DISPLAY, "20 spp: plane 1 has the wrong size, filter or number"},
        {plane_1, 98, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char line[64];
        uint32_t kept = base_get_u32(bytes + cases[i].at);
        base_put_u32(bytes + cases[i].at, cases[i].value);
        reseal(bytes, size);
        snprintf(line, sizeof line, "truncated: room for fewer than %u images", cases[i].value);
        expect_block(bytes, size, cases[i].at == 36 && cases[i].value > 5 && !cases[i].words ? line : cases[i].words);
        base_put_u32(bytes + cases[i].at, kept);
        if (cases[i].at == FIRST + 20)
            base_put_u32(bytes + FIRST + 24, crc_of(bytes + STATS, kept));
    }
    reseal(bytes, size);
    expect_block(bytes, size, NULL);
    memset(bytes + STATS, 'n', SEQ_NAME); /* a name without an end */
    reseal(bytes, size);
    expect_block(bytes, size, "20 spp: statistic 0 is not usable");
    static const struct {
        size_t at;
        const char *words;
    } damaged[] = {{40, "the header is damaged (CRC)"},
                   {FIRST + 8, "header of image 0 is damaged (CRC)"},
                   {PLANE + 20, "image at 20 spp is damaged (CRC)"}};
    for (int i = 0; i < 3; i++) {
        bytes[damaged[i].at] ^= 1;
        expect_block(bytes, size, damaged[i].words);
        bytes[damaged[i].at] ^= 1;
    }
    free(text);
}

static void builder_limits(void **state)
{
    (void)state;
    struct seq_builder w;
    made_build(&w);
    struct seq_frame more = {.spp = 5000, .display = made_display};
    assert_int_equal(seq_builder_add(&w, &more, NULL), BASE_EINVAL); /* nothing after the reference */
    seq_builder_release(&w);
    struct base_err err = {0};
    static const uint32_t sizes[][3] = {{0, 5, 0}, {5, 0, 0}, {4097, 5, 0}, {5, 4097, 0}, {4096, 1, 1}, {1, 4096, 1}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        char line[64];
        int rc = seq_builder_init(&w, sizes[i][0], sizes[i][1], 0, 0, 0, 0, &err);
        assert_int_equal(rc, sizes[i][2] ? 0 : BASE_EINVAL);
        snprintf(line, sizeof line, "a block of %ux%u pixels", sizes[i][0], sizes[i][1]);
        if (rc)
            assert_string_equal(err.text, line);
        else
            seq_builder_release(&w);
    }
    assert_int_equal(seq_builder_init(&w, MADE_W, MADE_H, 0, 0, 0, 0, &err), 0);
    static const struct seq_stat stats[SEQ_MAX_STATS + 1];
    const struct seq_frame frames[] = {{.spp = 0, .display = made_display},
                                       {.spp = 7},
                                       {.spp = 7, .display = made_display, .stats = stats, .n_stats = SEQ_MAX_STATS + 1},
                                       {.spp = 7, .display = made_display, .stats = stats, .n_stats = SEQ_MAX_STATS},
                                       {.spp = 8, .mean = made_mean}};
    for (int i = 0; i < 5; i++)
        assert_int_equal(seq_builder_add(&w, &frames[i], &err), i < 3 ? BASE_EINVAL : 0);
    assert_string_equal(err.text, "image at 7 spp cannot be added to the sequence");
    assert_int_equal(w.n_records, 2);
    seq_builder_release(&w);
    assert_true(!w.bytes && w.size == 0);
}

/* named: by the message about the first difference; NULL: there is none. */
static void same_identity(const struct seq_manifest *a, const struct seq_manifest *b, const char *named)
{
    static const struct base_identity_words words = {" with", " without", "it"};
    struct base_identity ours = {0}, theirs = {0};
    struct base_err err = {0};
    seq_manifest_identity(b, &ours);
    seq_manifest_identity(a, &theirs);
    assert_int_equal(base_identity_compare(&ours, theirs.text, theirs.size, "m", &words, NULL, &err),
                     named ? BASE_EINVAL : 0);
    if (named)
        assert_non_null(strstr(err.text, named));
    base_identity_release(&ours);
    base_identity_release(&theirs);
}

/* What distinguishes two runs is named; the way to the source does not. */
static void differences(void **state)
{
    (void)state;
    uint32_t levels[] = {20, 40}, other[] = {20, 41};
    const struct seq_manifest m = {.scene = "s",
                                   .source = "a/s.pbrt",
                                   .source_crc32 = 7,
                                   .inputs_crc32 = 8,
                                   .camera = "view0",
                                   .renderer = "r",
                                   .has_look_at = 1,
                                   .look_at = {0.1, 2, 3, 4, 5, 6, 7, 8, 1.0 / 3},
                                   .fov_deg = 33.3,
                                   .width = 64,
                                   .height = 48,
                                   .block = 16,
                                   .seed = 1,
                                   .reference_seed = 2,
                                   .reference_spp = 9,
                                   .reference_independent = 1,
                                   .n_levels = 2,
                                   .levels = levels};
    struct seq_manifest back;
    struct base_err err = {0};
    assert_int_equal(seq_manifest_write(made_dir, &m, &err), 0);
    assert_int_equal(seq_manifest_read(made_dir, &back, &err), 0); /* every number survives the text */
    same_identity(&m, &back, NULL);
    seq_manifest_release(&back);
    struct seq_manifest n = m;
    strcpy(n.source, "b/s.pbrt");
    same_identity(&m, &n, NULL);
#define DIFFERS(change, member) \
    n = m; \
    change; \
    same_identity(&m, &n, "with " member "=")
    DIFFERS(n.scene[0] = 't', "scene");
    DIFFERS(n.source_crc32++, "source_crc32");
    DIFFERS(n.inputs_crc32++, "inputs_crc32");
    DIFFERS(n.camera[4] = '1', "camera");
    DIFFERS(n.look_at[8] = 0, "look_at");
    DIFFERS(n.has_look_at = 0, "look_at");
    DIFFERS(n.fov_deg = 0, "fov");
    DIFFERS(n.renderer[0] = 'q', "renderer");
    DIFFERS(n.width++, "width");
    DIFFERS(n.height++, "height");
    DIFFERS(n.block++, "block");
    DIFFERS(n.seed++, "seed");
    DIFFERS(n.reference_seed++, "reference_seed");
    DIFFERS(n.reference_spp++, "reference_spp");
    DIFFERS(n.reference_independent = 0, "reference_independent");
    DIFFERS(n.levels = other, "level");
    DIFFERS(n.n_levels = 1, "level");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_trip),     cmocka_unit_test(other_counts), cmocka_unit_test(sample_counts),
        cmocka_unit_test(differences),    cmocka_unit_test(damage),       cmocka_unit_test(limits_of_blocks),
        cmocka_unit_test(builder_limits),
    };
    return cmocka_run_group_tests(tests, made_begin, made_end);
}
