/* Block sequences: codings against an independent oracle, statistics, what is written is read back, every kind of damage is
 * noticed, and two runs are told apart. */
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

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"
#include "base/half.h"
#include "sequence/builder.h"
#include "sequence/manifest.h"
#include "sequence/simulate.h"
#include "sequence/statistics.h"
#include "sequence/layout.h"
#include "support/ggn_near.h"
#include "support/lseq_oracle.h"

enum { W = 37, H = 21, P = W * H };

static void half_floats(void **state)
{
    (void)state;
    for (int i = 0; i < 65536; i++) {
        double v = (double)base_f16_to_f32((uint16_t)i);
        if ((i >> 10 & 31) == 31)
            continue;
        assert_true(v == oracle_f16_value(i));
        if (seq_half_float(v) != i || base_f32_to_f16((float)v) != i)
            fail_msg("half %04x does not survive", (unsigned)i);
    }
    /* around every 37th half: its value, the middle to the next, and what a double can tell from the middle */
    for (int i = 0; i < 0x7bff; i += 37) {
        double v = oracle_f16_value(i), middle = (v + oracle_f16_value(i + 1)) / 2;
        const double near[] = {v, middle, nextafter(middle, 0), nextafter(middle, 1e9), 0.3 * v + 0.7 * middle};
        for (size_t k = 0; k < sizeof near / sizeof near[0]; k++) {
            assert_int_equal(seq_half_float(near[k]), oracle_f16(near[k]));
            assert_int_equal(seq_half_float(-near[k]), oracle_f16(-near[k]));
        }
    }
    assert_int_equal(seq_half_float(1e9), 0x7bff);
    assert_int_equal(seq_half_float(-HUGE_VAL), 0xfbff);
    assert_int_equal(seq_half_float((double)NAN), 0);
    assert_int_equal(base_f64_to_f16(65519.9), 0x7bff);
    assert_int_equal(base_f64_to_f16(65520.0), 0x7c00);
    assert_int_equal(base_f64_to_f16(-0.0), 0x8000);
}

static void codings(void **state)
{
    (void)state;
    double worst = 0.0;
    for (double x = 1e-6; x < 5e4; x *= 1.0007) {
        uint8_t d = base_srgb_code(x), q = seq_fine_encode(d, x);
        double back = seq_fine_decode(d, q);
        double room = d < 255 ? (oracle_eotf((d + 0.5) / 255) - oracle_eotf(d == 0 ? 0 : (d - 0.5) / 255)) / 16 : x * 0.0219;
        assert_int_equal(d, oracle_display(x));
        assert_int_equal(q, oracle_fine(x));
        worst = fmax(worst, fabs(back - x) / room);
        if (d < 255 && base_srgb_code(back) != d)
            fail_msg("%g: the refined value has another display code", x);
    }
    assert_true(worst <= 1.001);
    for (double x = 2e-7; x < 3e5; x *= 1.003) {
        uint8_t code = seq_half_log_encode(x), minus = seq_half_log_encode(-x);
        assert_int_equal(code, oracle_half_log(x));
        assert_int_equal(minus, oracle_half_log(-x));
        assert_near(seq_half_log_decode(minus), -seq_half_log_decode(code), 0);
        if (x > 2e-6 && x < 3e3)
            assert_true(fabs(seq_half_log_decode(code) / x - 1) < 0.0906);
    }
    assert_int_equal(seq_half_log_encode(0), 0);
    assert_int_equal(seq_half_log_encode(exp2(-19.875)), 1);
    assert_int_equal(seq_half_log_encode((double)NAN), 0);
    assert_int_equal(seq_fine_encode(255, 1e30), 255);
}

static void statistics(void **state)
{
    (void)state;
    const double mean[12] = {1, 0, 1, 1, 1, 0, 1, 1, 2, 0, 1, 1}, half[12] = {1.5, 1, 1, 1, 1, 1, 1, 1, 2, 1, 1, 1};
    const double d[12] = {0, 0.1, 0, -0.3, 0, 0.1, 0, -0.3, 0, 0.1, 0, -0.3}, m2[4] = {2, 1, 1, 1};
    double scratch[4];
    struct seq_stat s[SEQ_STATISTICS];
    seq_statistics(mean, half, d, m2, 4, 5, scratch, s);
    static const char *const names[SEQ_STATISTICS] = {"dammertz",      "half_unsettled", "rse",
                                                      "rse_unsettled", "tail999",        "gini"};
    for (int i = 0; i < SEQ_STATISTICS; i++)
        assert_string_equal(s[i].name, names[i]);
    assert_near(s[SEQ_DAMMERTZ].value, 0.5 / 2.0 / 4.0, 1e-12);
    double y0 = 0.2126729 + 0.7151522 + 0.0721750 * 2, white = 0.2126729 + 0.7151522 + 0.0721750;
    /* Pixel 0: variance of the mean (2 - y0^2)/4; pixel 1 is black with moment 1, so its error counts against the floor 0.02. */
    assert_near(s[SEQ_RSE].value, sqrt(((2 - y0 * y0) / 4.0 / (y0 * y0) + 0.25 / (0.02 * 0.02)) / 4.0), 1e-12);
    assert_true(s[SEQ_RSE_UNSETTLED].value == 0.25 && s[SEQ_HALF_UNSETTLED].value == 0.25);
    assert_near(s[SEQ_TAIL999].value, 0.3 * white / ((y0 + 2.0 * white) / 4.0), 1e-12);
    assert_near(s[SEQ_GINI].value, (1 * 0.1 + 3 * 0.3) / (4 * 0.4), 1e-12);
}

static void filters(void **state)
{
    (void)state;
    static const uint32_t planes[] = {SEQ_PLANE_DISPLAY, SEQ_PLANE_FINE, SEQ_PLANE_MEAN_F16};
    for (size_t k = 0; k < 3; k++)
        for (uint32_t f = 0; f < 8; f++) {
            static uint8_t a[6 * P], b[6 * P];
            if ((f & ~seq_plane_filters(planes[k])) != 0) {
                assert_int_equal(seq_plane_filter(planes[k], f, a, W, H, NULL), BASE_EINVAL);
                continue;
            }
            for (size_t i = 0; i < sizeof a; i++)
                a[i] = (uint8_t)(i * i * 31 + i / 7);
            memcpy(b, a, sizeof a);
            seq_plane_filter(planes[k], f, b, W, H, NULL);
            assert_int_equal(memcmp(a, b, sizeof a) != 0, f != 0);
            seq_plane_unfilter(planes[k], f, b, W, H, NULL);
            assert_memory_equal(a, b, sizeof a);
        }
}

static double mean[3 * P], half[3 * P];
static uint8_t display[3 * P];

static void fill(int seed)
{
    for (int i = 0; i < 3 * P; i++) {
        mean[i] = fabs(0.6 + 0.7 * sin(0.1 * i + seed));
        half[i] = 0.05 * cos(1.7 * i + seed);
        display[i] = base_srgb_code(mean[i]);
    }
}

/* Three levels (the second full) and a reference. */
static void build(struct seq_builder *w)
{
    struct seq_stat stats[2] = {{"dammertz", 0.25}, {"seconds", 3.5}};
    assert_int_equal(seq_builder_init(w, W, H, 400, 200, 9, 77, NULL), 0);
    for (uint32_t i = 0; i < 4; i++) {
        fill((int)i);
        struct seq_frame f = {.spp = i < 3 ? 20u << i : 4096u,
                              .half_spp = 10,
                              .is_reference = i == 3,
                              .full = i == 1,
                              .display = i == 2 ? NULL : display,
                              .mean = mean,
                              .half = half,
                              .stats = stats,
                              .n_stats = 2};
        assert_int_equal(seq_builder_add(w, &f, NULL), 0);
    }
}

static char dir[] = "/tmp/base_sequence.XXXXXX";
static char block_path[64];

static int setup(void **state)
{
    (void)state;
    if (!mkdtemp(dir))
        return -1;
    snprintf(block_path, sizeof block_path, "%s/block-00009.lseq", dir);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "%s/manifest.json", dir);
    unlink(path);
    unlink(block_path);
    return rmdir(dir);
}

static void round_trip(void **state)
{
    (void)state;
    struct seq_builder w;
    struct seq_block b;
    struct base_err err = {0};
    uint32_t crc;
    static uint8_t bytes[3 * P];
    static float floats[3 * P];
    build(&w);
    assert_int_equal(seq_builder_write(&w, block_path, &crc, &err), 0);
    if (seq_block_read(block_path, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(b.n_levels, 3);
    assert_true(b.width == W && b.height == H && b.x0 == 400 && b.y0 == 200 && b.id == 9 && b.seed == 77);
    assert_non_null(b.reference);
    assert_int_equal(b.reference->spp, 4096);
    assert_ptr_equal(seq_level(&b, 40), &b.levels[1]);
    assert_null(seq_level(&b, 41));
    for (int i = 0; i < 4; i++) {
        const struct seq_record *r = i < 3 ? &b.levels[i] : b.reference;
        fill(i);
        assert_near(seq_stat(r, "dammertz"), 0.25, 0);
        assert_true(isnan(seq_stat(r, "nothing")));
        seq_display_planar(&b, r, bytes, NULL);
        assert_memory_equal(bytes, display, sizeof display);
        seq_display(&b, r, bytes, NULL);
        assert_int_equal(bytes[3 * 5 + 2], display[2 * P + 5]);
        seq_mean(&b, r, floats, NULL);
        for (int k = 0; k < 3 * P; k++)
            assert_near((double)floats[k], mean[k],
                        i == 0 || i == 2 ? (display[k] == 255 ? 0.022 * mean[k] : 0.0006) : 0.0005);
        seq_half_luminance(&b, r, floats, NULL);
        for (int k = 0; k < P; k++) {
            double y = base_luminance(half[k], half[P + k], half[2 * P + k]);
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
    static float m[3 * P], d[3 * P], wanted[3 * P], y[P];
    build(&w);
    assert_int_equal(seq_builder_write(&w, block_path, &crc, NULL), 0);
    assert_int_equal(seq_block_read(block_path, &b, NULL), 0);
    for (int i = 0; i < 2; i++) { /* luminance of D alone, and all of it */
        assert_int_equal(seq_halves(&b, &b.levels[i], m, d, NULL), 0);
        assert_int_equal(seq_mean(&b, &b.levels[i], wanted, NULL), 0);
        assert_memory_equal(m, wanted, sizeof m);
        assert_int_equal(i ? seq_half(&b, &b.levels[1], wanted, NULL) : seq_half_luminance(&b, &b.levels[0], wanted, NULL),
                         0);
        for (int k = 0; k < 3 * P; k++)
            assert_true(d[k] == wanted[i ? k : k % P]);
        assert_int_equal(seq_mean_luminance(&b, &b.levels[i], y, NULL), 0);
        for (int k = 0; k < P; k++)
            assert_near((double)y[k], base_luminance((double)m[k], (double)m[P + k], (double)m[2 * P + k]), 1e-6);
    }
    for (int k = 0; k < 3 * P; k++)
        wanted[k] = m[k] - 0.5f * d[k];
    seq_simulate(m, d, 3 * P, -seq_noise_scale(40, 160), d); /* in place */
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
    assert_int_equal(base_file_read(block_path, 1 << 24, &bytes, &size, &err), 0);
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

/* Makes the checksums right again, as far as the records go. */
static void reseal(uint8_t *bytes, size_t size)
{
    base_put_u32(bytes + 60, seq_crc(bytes, 60));
    for (size_t at = SEQ_FILE_HEADER; at + SEQ_RECORD_HEADER <= size;) {
        size_t payload = base_get_u32(bytes + at + 20);
        if (payload <= size - at - SEQ_RECORD_HEADER)
            base_put_u32(bytes + at + 24, seq_crc(bytes + at + SEQ_RECORD_HEADER, payload));
        base_put_u32(bytes + at + 28, seq_crc(bytes + at, 28));
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
    assert_int_equal(base_file_read(block_path, 1 << 24, &text, &size, &err), 0);
    uint8_t *bytes = (uint8_t *)text;
    const size_t second = FIRST + SEQ_RECORD_HEADER + base_get_u32(bytes + FIRST + 20);
    const size_t plane_1 = PLANE + SEQ_PLANE_HEADER + base_get_u32(bytes + PLANE + 12);
    const struct {
        size_t at;
        uint32_t value;
        const char *words;
    } cases[] = {
        {0, 0, "not a block sequence"},
        {8, 2, "version 2 of the format is not known"},
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
        {PLANE + 8, 3 * P + 1, "20 spp: plane 0 has the wrong size, filter or number"},
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
            base_put_u32(bytes + FIRST + 24, seq_crc(bytes + STATS, kept));
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
    build(&w);
    struct seq_frame more = {.spp = 5000, .display = display};
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
    assert_int_equal(seq_builder_init(&w, W, H, 0, 0, 0, 0, &err), 0);
    static const struct seq_stat stats[SEQ_MAX_STATS + 1];
    const struct seq_frame frames[] = {{.spp = 0, .display = display},
                                       {.spp = 7},
                                       {.spp = 7, .display = display, .stats = stats, .n_stats = SEQ_MAX_STATS + 1},
                                       {.spp = 7, .display = display, .stats = stats, .n_stats = SEQ_MAX_STATS},
                                       {.spp = 8, .mean = mean}};
    for (int i = 0; i < 5; i++)
        assert_int_equal(seq_builder_add(&w, &frames[i], &err), i < 3 ? BASE_EINVAL : 0);
    assert_string_equal(err.text, "image at 7 spp cannot be added to the sequence");
    assert_int_equal(w.n_records, 2);
    seq_builder_release(&w);
    assert_true(!w.bytes && w.size == 0);
}

static void expect_unread(const struct seq_manifest *m, const char *words)
{
    struct seq_block b;
    struct base_err err = {0};
    char line[256];
    snprintf(line, sizeof line, "%s: %s", block_path, words);
    assert_int_equal(seq_manifest_read_block(dir, m, 0, &b, &err), BASE_EINVAL);
    assert_string_equal(err.text, line);
}

static void manifest(void **state)
{
    (void)state;
    uint32_t levels[] = {20, 40, 80, 160};
    struct seq_manifest_block entry = {
        .id = 9, .x0 = 400, .y0 = 200, .x1 = 400 + W, .y1 = 200 + H, .file = "block-00009.lseq"};
    struct seq_manifest m = {.scene = "a \"scene\"",
                             .width = 800,
                             .height = 600,
                             .block = 200,
                             .reference_spp = 4096,
                             .reference_independent = 1,
                             .n_levels = 3,
                             .levels = levels,
                             .n_blocks = 1,
                             .blocks = &entry},
                        back;
    struct seq_builder w;
    struct seq_block b;
    struct base_err err = {0};
    struct stat st;
    build(&w);
    assert_int_equal(seq_builder_write(&w, block_path, &entry.crc32, &err), 0);
    seq_builder_release(&w);
    stat(block_path, &st);
    entry.bytes = (uint64_t)st.st_size;
    assert_int_equal(seq_manifest_write(dir, &m, &err), 0);
    if (seq_manifest_read(dir, &back, &err) != 0 || seq_manifest_read_block(dir, &back, 0, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_string_equal(back.scene, m.scene);
    assert_int_equal(back.n_levels, 3);
    assert_int_equal(back.blocks[0].crc32, entry.crc32);
    seq_block_release(&b);

    back.blocks[0].crc32 ^= 1;
    expect_unread(&back, "not the file that the manifest lists (size or CRC)");
    back.blocks[0].crc32 ^= 1;
    back.blocks[0].bytes++;
    expect_unread(&back, "not the file that the manifest lists (size or CRC)");
    back.blocks[0].bytes--;
    uint32_t *const places[] = {&back.blocks[0].x1, &back.blocks[0].y1, &back.blocks[0].x0, &back.blocks[0].y0,
                                &back.blocks[0].id};
    for (int i = 0; i < 5; i++) {
        ++*places[i];
        back.blocks[0].x1 += i == 2; /* the same size, elsewhere */
        back.blocks[0].y1 += i == 3;
        expect_unread(&back, "block 9 is 37x21 at 400,200, the manifest says otherwise");
        --*places[i];
        back.blocks[0].x1 -= i == 2;
        back.blocks[0].y1 -= i == 3;
    }
    seq_manifest_release(&back);
    m.n_levels = 4; /* a level that the block does not have */
    seq_manifest_write(dir, &m, &err);
    seq_manifest_read(dir, &back, &err);
    expect_unread(&back, "the level at 160 spp is missing");
    seq_manifest_release(&back);
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
    assert_int_equal(seq_manifest_write(dir, &m, &err), 0);
    assert_int_equal(seq_manifest_read(dir, &back, &err), 0); /* every number survives the text */
    assert_null(seq_manifest_difference(&m, &back));
    seq_manifest_release(&back);
    struct seq_manifest n = m;
    strcpy(n.source, "b/s.pbrt");
    assert_null(seq_manifest_difference(&m, &n));
    n.inputs_crc32 = 0; /* recorded before it was noted */
    assert_null(seq_manifest_difference(&m, &n));
#define DIFFERS(change, member) \
    n = m; \
    change; \
    assert_string_equal(seq_manifest_difference(&m, &n), member)
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
    DIFFERS(n.levels = other, "levels");
    DIFFERS(n.n_levels = 1, "levels");
}

static void expect_text(const char *name, const char *expected)
{
    char path[64], *text;
    size_t size;
    struct base_err err = {0};
    snprintf(path, sizeof path, "%s/%s", dir, name);
    assert_int_equal(base_file_read(path, 1 << 16, &text, &size, &err), 0);
    assert_string_equal(text, expected);
    free(text);
}

/* The manifest word for word: what is always there, and what is there only if it says something. */
/* Member by member: what lies between them is anything. */
static int same_block(const struct seq_manifest_block *a, const struct seq_manifest_block *b)
{
    return a->id == b->id && a->x0 == b->x0 && a->y0 == b->y0 && a->x1 == b->x1 && a->y1 == b->y1 &&
           strcmp(a->file, b->file) == 0 && a->bytes == b->bytes && a->crc32 == b->crc32 && a->seconds == b->seconds &&
           a->dropped == b->dropped;
}

static void manifests_word_for_word(void **state)
{
    (void)state;
    uint32_t levels[] = {20, 40};
    struct base_err err = {0};
    struct seq_manifest_block list[2] = {
        {.id = 3, .x0 = 16, .y0 = 0, .x1 = 32, .y1 = 16, .file = "block-00003.lseq", .bytes = 1234, .crc32 = 0xabc},
        {.id = 4,
         .x0 = 32,
         .y0 = 1,
         .x1 = 40,
         .y1 = 9,
         .file = "f",
         .bytes = 5,
         .crc32 = 0xfedcba98u,
         .seconds = 1.5,
         .dropped = 17}};
    struct seq_manifest m = {.scene = "s",
                             .source = "a/s.pbrt",
                             .camera = "view0",
                             .renderer = "r",
                             .width = 64,
                             .height = 48,
                             .block = 16,
                             .seed = 1,
                             .reference_seed = 2,
                             .reference_spp = 9,
                             .reference_independent = 1,
                             .n_levels = 2,
                             .levels = levels},
                        back;
    assert_int_equal(seq_manifest_write(dir, &m, &err), 0);
    expect_text(
        "manifest.json",
        "{\n\t\"format\":\t\"lull-sequence\",\n\t\"version\":\t1,\n\t\"scene\":\t\"s\",\n\t\"source\":\t\"a/s.pbrt\",\n"
        "\t\"camera\":\t\"view0\",\n\t\"renderer\":\t\"r\",\n\t\"width\":\t64,\n\t\"height\":\t48,\n\t\"block\":\t16,\n"
        "\t\"seed\":\t1,\n\t\"reference_seed\":\t2,\n\t\"reference_spp\":\t9,\n\t\"levels\":\t[20, "
        "40],\n\t\"blocks\":\t[]\n}\n");
    m.source_crc32 = 0x12;
    m.inputs_crc32 = 0x345;
    m.has_look_at = 1;
    for (int i = 0; i < 9; i++)
        m.look_at[i] = i + 0.5;
    m.fov_deg = 33.25;
    m.reference_independent = 0;
    m.n_blocks = 2;
    m.blocks = list;
    assert_int_equal(seq_manifest_write(dir, &m, &err), 0);
    expect_text(
        "manifest.json",
        "{\n\t\"format\":\t\"lull-sequence\",\n\t\"version\":\t1,\n\t\"scene\":\t\"s\",\n\t\"source\":\t\"a/s.pbrt\",\n"
        "\t\"source_crc32\":\t\"00000012\",\n\t\"inputs_crc32\":\t\"00000345\",\n\t\"camera\":\t\"view0\",\n"
        "\t\"look_at\":\t[0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, "
        "8.5],\n\t\"fov\":\t33.25,\n\t\"renderer\":\t\"r\",\n\t\"width\":\t64,\n"
        "\t\"height\":\t48,\n\t\"block\":\t16,\n\t\"seed\":\t1,\n\t\"reference_seed\":\t2,\n\t\"reference_spp\":\t9,\n"
        "\t\"reference_independent\":\tfalse,\n\t\"levels\":\t[20, "
        "40],\n\t\"blocks\":\t[{\n\t\t\t\"id\":\t3,\n\t\t\t\"x0\":\t16,\n\t\t\t\"y0\":\t0,\n"
        "\t\t\t\"x1\":\t32,\n\t\t\t\"y1\":\t16,\n\t\t\t\"file\":\t\"block-00003.lseq\",\n\t\t\t\"bytes\":\t1234,"
        "\n\t\t\t\"crc32\":\t\"00000abc\"\n"
        "\t\t}, "
        "{\n\t\t\t\"id\":\t4,\n\t\t\t\"x0\":\t32,\n\t\t\t\"y0\":\t1,\n\t\t\t\"x1\":\t40,\n\t\t\t\"y1\":\t9,\n\t\t\t\"file\":"
        "\t\"f\",\n"
        "\t\t\t\"bytes\":\t5,\n\t\t\t\"crc32\":\t\"fedcba98\",\n\t\t\t\"seconds\":\t1.5,\n\t\t\t\"dropped\":\t17\n\t\t}]\n}"
        "\n");
    assert_int_equal(seq_manifest_read(dir, &back, &err), 0);
    assert_null(seq_manifest_difference(&m, &back));
    assert_string_equal(back.source, "a/s.pbrt");
    assert_true(back.n_blocks == 2 && same_block(&back.blocks[0], &list[0]) && same_block(&back.blocks[1], &list[1]));
    seq_manifest_release(&back);
    assert_true(back.n_blocks == 0 && !back.blocks && !back.levels);
}

/* `%s` of a good manifest, or of its only block, is changed; NULL: it stays good. */
static void limits_of_manifests(void **state)
{
    (void)state;
    static const char good[] =
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":1048576,\"height\":1048576,\"block\":4096,"
        "\"reference_spp\":2147483647,\"levels\":[1,2147483647],\"blocks\":[{\"id\":4294967295,\"x0\":0,\"y0\":0,\"x1\":1,"
        "\"y1\":1048576,\"file\":\"x\",\"bytes\":1073741824,\"crc32\":\"0000000f\",\"dropped\":0}]}";
    static const struct {
        const char *from, *to, *words;
    } cases[] = {
        {"lull-sequence", "other", "not the manifest of a sequence"},
        {"\"version\":1", "\"version\":2", "this version of the format is not known"},
        {"\"scene\":\"s\"", "\"scene\":7", "the scene has no name"},
        {"\"width\":1048576", "\"width\":1048577", "width, height or block is missing or out of range"},
        {"\"width\":1048576", "\"width\":0", "width, height or block is missing or out of range"},
        {"\"width\":1048576", "\"width\":1", NULL},
        {"\"height\":1048576", "\"height\":1048577", "width, height or block is missing or out of range"},
        {"\"height\":1048576", "\"height\":1.5", "width, height or block is missing or out of range"},
        {"\"block\":4096", "\"block\":4097", "width, height or block is missing or out of range"},
        {"\"block\":4096", "\"block\":\"8\"", "width, height or block is missing or out of range"},
        {"[1,2147483647]", "[0,2]", "level 0 does not rise"},
        {"[1,2147483647]", "[1,2147483648]", "level 1 does not rise"},
        {"[1,2147483647]", "[1,1]", "level 1 does not rise"},
        {"[1,2147483647]", "[]", "no list of levels"},
        {"[1,2147483647]", "7", "no list of levels"},
        {"\"blocks\":[", "\"blocks\":7,\"more\":[", "no list of blocks"},
        {"\"id\":4294967295", "\"id\":4294967296", "entry 0 of blocks is not usable"},
        {"\"id\":4294967295", "\"id\":0", NULL},
        {"\"x0\":0,", "\"x0\":1,", "entry 0 of blocks is not usable"},
        {"\"x0\":0,", "\"x0\":-1,", "entry 0 of blocks is not usable"},
        {"\"x1\":1,", "\"x1\":1048576,", NULL},
        {"\"x1\":1,", "\"x1\":1048577,", "entry 0 of blocks is not usable"},
        {"\"y0\":0,", "\"y0\":1048575,", NULL},
        {"\"y0\":0,", "\"y0\":1048576,", "entry 0 of blocks is not usable"},
        {"\"y1\":1048576", "\"y1\":0", "entry 0 of blocks is not usable"},
        {"\"bytes\":1073741824", "\"bytes\":1073741825", "entry 0 of blocks is not usable"},
        {"\"bytes\":1073741824", "\"bytes\":0", "entry 0 of blocks is not usable"},
        {"\"0000000f\"", "\"g\"", "entry 0 of blocks is not usable"},
        {"\"0000000f\"", "\"0000000f0\"", "entry 0 of blocks is not usable"},
        {"\"0000000f\"", "15", "entry 0 of blocks is not usable"},
        {"\"dropped\":0", "\"dropped\":1e15", NULL},
        {"\"dropped\":0", "\"dropped\":-1", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":\"\"", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":\".x\"", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":\"a/x\"", "entry 0 of blocks is not usable"},
        {"\"file\":\"x\"", "\"file\":4", "entry 0 of blocks is not usable"},
        {"\"version\":1", "\"version\":1,\"look_at\":[1,2,3,4,5,6,7,8]", "look_at is not nine numbers"},
        {"\"version\":1", "\"version\":1,\"look_at\":[1,2,3,4,5,6,7,8,\"9\"]", "look_at is not nine numbers"},
        {"\"version\":1", "\"version\":1,\"look_at\":9", "look_at is not nine numbers"},
        {"\"version\":1", "\"version\":1,\"look_at\":[1,2,3,4,5,6,7,8,9],\"fov\":\"x\"", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[1024], line[128];
        struct seq_manifest m;
        struct base_err err = {0};
        const char *at = strstr(good, cases[i].from);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, cases[i].to, at + strlen(cases[i].from));
        snprintf(line, sizeof line, "m.json: %s", cases[i].words ? cases[i].words : "");
        int rc = seq_manifest_parse("m.json", text, strlen(text), &m, &err);
        if (rc != (cases[i].words ? BASE_EINVAL : 0) || (rc && strcmp(err.text, line) != 0))
            fail_msg("%s: %d \"%s\", expected \"%s\"", cases[i].to, rc, err.text, line);
        if (!rc)
            seq_manifest_release(&m);
    }
}

static void bad_manifests(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "",
        "{}",
        "[1]",
        "{\"format\":\"lull-sequence\"}",
        "{\"format\":\"lull-sequence\",\"version\":2,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[1],"
        "\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"width\":8,\"height\":8,\"block\":8,\"levels\":[1],\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[],"
        "\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2,2],"
        "\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2],"
        "\"blocks\":"
        "[{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"../x\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2],"
        "\"blocks\":"
        "[{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":9,\"y1\":8,\"file\":\"x\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct seq_manifest m;
        struct base_err err = {0};
        if (seq_manifest_parse("m.json", bad[i], strlen(bad[i]), &m, &err) != BASE_EINVAL || err.text[0] == '\0')
            fail_msg("%s was accepted", bad[i]);
    }
}

static void a_block_is_listed_once(void **state)
{
    (void)state;
    for (int second = 3; second >= 2; second--) {
        struct seq_manifest m;
        struct base_err err = {0};
        char text[512];
        int n = snprintf(
            text, sizeof text,
            "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2]"
            ","
            "\"blocks\":[{\"id\":2,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"x\",\"bytes\":9,\"crc32\":\"00000000\"},"
            "{\"id\":%d,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"y\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
            second);
        assert_int_equal(seq_manifest_parse("m.json", text, (size_t)n, &m, &err), second == 3 ? 0 : BASE_EINVAL);
        if (second == 3)
            seq_manifest_release(&m);
        else
            assert_string_equal(err.text, "m.json: block 2 is listed twice");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_floats),
        cmocka_unit_test(codings),
        cmocka_unit_test(statistics),
        cmocka_unit_test(filters),
        cmocka_unit_test(round_trip),
        cmocka_unit_test(other_counts),
        cmocka_unit_test(sample_counts),
        cmocka_unit_test(differences),
        cmocka_unit_test(damage),
        cmocka_unit_test(limits_of_blocks),
        cmocka_unit_test(builder_limits),
        cmocka_unit_test(manifest),
        cmocka_unit_test(bad_manifests),
        cmocka_unit_test(a_block_is_listed_once),
        cmocka_unit_test(manifests_word_for_word),
        cmocka_unit_test(limits_of_manifests),
    };
    return cmocka_run_group_tests_name("sequence", tests, setup, teardown);
}
