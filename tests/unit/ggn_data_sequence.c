/* Block sequences: codings, what is written is read back, and every kind of damage is noticed. */
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

#include "base/colour.h"
#include "support/ggn_near.h"

#include "base/files.h"
#include "data/image.h"
#include "data/manifest.h"
#include "data/sequence.h"
#include "model/preprocess.h"

enum { W = 37, H = 21, P = W * H };

static void halves(void **state)
{
    (void)state;
    for (int i = 0; i < 65536; i++) {
        float f = ggn_half_to_float((uint16_t)i);
        if (isfinite(f) && ggn_half_from_float(f) != (uint16_t)i)
            fail_msg("half %04x does not survive", (unsigned)i);
    }
    assert_int_equal(ggn_half_from_float(1e9f), 0x7bff);
    assert_int_equal(ggn_half_from_float(-1e9f), 0xfbff);
    assert_int_equal(ggn_half_from_float(NAN), 0);
    assert_int_equal(ggn_half_from_float(1.0f + 1.0f / 2048), 0x3c00); /* tie to even */
    assert_int_equal(ggn_half_from_float(1.0f + 3.0f / 2048), 0x3c02);
    assert_int_equal(ggn_half_from_float(6.0e-8f), 1);
}

static void codings(void **state)
{
    (void)state;
    double worst = 0.0;
    for (double x = 1e-6; x < 5e4; x *= 1.0007) {
        uint8_t d = ggn_preprocess(x, NULL, NULL);
        double back = ggn_fine_decode(d, ggn_fine_encode(d, x));
        double room = d < 255 ? (base_srgb_eotf((d + 0.5) / 255) - base_srgb_eotf(d == 0 ? 0 : (d - 0.5) / 255)) / 16 : x * 0.0219;
        worst = fmax(worst, fabs(back - x) / room);
        if (d < 255 && ggn_preprocess(back, NULL, NULL) != d)
            fail_msg("%g: the refined value has another display code", x);
    }
    assert_true(worst <= 1.001);
    for (double x = 2e-6; x < 3e3; x *= 1.01) {
        assert_true(fabs(ggn_halflog_decode(ggn_halflog_encode(x)) / x - 1) < 0.0906);
        assert_near(ggn_halflog_decode(ggn_halflog_encode(-x)), -ggn_halflog_decode(ggn_halflog_encode(x)), 0);
    }
    assert_int_equal(ggn_halflog_encode(0), 0);
    assert_int_equal(ggn_halflog_encode(1e-9), 0);
    assert_int_equal(ggn_halflog_encode((double)NAN), 0);
}

static void filters(void **state)
{
    (void)state;
    static const uint32_t planes[] = {GGN_PLANE_DISPLAY, GGN_PLANE_FINE, GGN_PLANE_MEAN_F16};
    for (size_t k = 0; k < 3; k++)
        for (uint32_t f = 0; f < 8; f++) {
            static uint8_t a[6 * P], b[6 * P];
            if ((f & ~ggn_plane_filters(planes[k])) != 0) {
                assert_int_equal(ggn_plane_filter(planes[k], f, a, W, H, NULL), BASE_EINVAL);
                continue;
            }
            for (size_t i = 0; i < sizeof a; i++)
                a[i] = (uint8_t)(i * i * 31 + i / 7);
            memcpy(b, a, sizeof a);
            ggn_plane_filter(planes[k], f, b, W, H, NULL);
            assert_int_equal(memcmp(a, b, sizeof a) != 0, f != 0);
            ggn_plane_unfilter(planes[k], f, b, W, H, NULL);
            assert_memory_equal(a, b, sizeof a);
        }
}

static float mean[3 * P], half[3 * P];
static uint8_t display[3 * P];

static void fill(int seed)
{
    for (int i = 0; i < 3 * P; i++) {
        mean[i] = (float)fabs(0.6 + 0.7 * sin(0.1 * i + seed));
        half[i] = (float)(0.05 * cos(1.7 * i + seed));
        display[i] = ggn_preprocess((double)mean[i], NULL, NULL);
    }
}

/* Three levels (the second full) and a reference. */
static void build(struct ggn_seq_builder *w)
{
    struct ggn_seq_stat stats[2] = {{"dammertz", 0.25}, {"seconds", 3.5}};
    assert_int_equal(ggn_seq_builder_init(w, W, H, 400, 200, 9, 77, NULL), 0);
    for (uint32_t i = 0; i < 4; i++) {
        fill((int)i);
        struct ggn_seq_frame f = {.spp = i < 3 ? 20u << i : 4096u, .half_spp = 10, .is_reference = i == 3, .full = i == 1,
                                  .display = display, .mean = mean, .half = half, .stats = stats, .n_stats = 2};
        assert_int_equal(ggn_seq_builder_add(w, &f, NULL), 0);
    }
}

static char dir[] = "/tmp/ggn_data_sequence.XXXXXX";
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
    struct ggn_seq_builder w;
    struct ggn_seq_block b;
    struct base_err err = {0};
    uint32_t crc;
    static uint8_t bytes[3 * P];
    static float floats[3 * P];
    build(&w);
    assert_int_equal(ggn_seq_builder_write(&w, block_path, &crc, &err), 0);
    if (ggn_seq_block_read(block_path, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(b.n_levels, 3);
    assert_true(b.width == W && b.height == H && b.x0 == 400 && b.y0 == 200 && b.id == 9 && b.seed == 77);
    assert_non_null(b.reference);
    assert_int_equal(b.reference->spp, 4096);
    assert_ptr_equal(ggn_seq_level(&b, 40), &b.levels[1]);
    assert_null(ggn_seq_level(&b, 41));
    for (int i = 0; i < 4; i++) {
        const struct ggn_seq_record *r = i < 3 ? &b.levels[i] : b.reference;
        fill(i);
        assert_near(ggn_seq_stat(r, "dammertz"), 0.25, 0);
        assert_true(isnan(ggn_seq_stat(r, "nothing")));
        ggn_seq_display_planar(&b, r, bytes, NULL);
        assert_memory_equal(bytes, display, sizeof display);
        ggn_seq_display(&b, r, bytes, NULL);
        assert_int_equal(bytes[3 * 5 + 2], display[2 * P + 5]);
        ggn_seq_mean(&b, r, floats, NULL);
        for (int k = 0; k < 3 * P; k++)
            assert_near((double)floats[k], (double)mean[k], i == 0 || i == 2 ? (display[k] == 255 ? 0.022 * (double)mean[k] : 0.0006) : 0.0005);
        ggn_seq_half_luminance(&b, r, floats, NULL);
        for (int k = 0; k < P; k++) {
            double y = base_luminance((double)half[k], (double)half[P + k], (double)half[2 * P + k]);
            assert_near((double)floats[k], y, 0.0906 * fabs(y) + 3e-5);
        }
        assert_int_equal(ggn_seq_half(&b, r, floats, &err), i == 1 || i == 3 ? 0 : BASE_EINVAL);
    }
    ggn_seq_block_release(&b);
    ggn_seq_builder_release(&w);
}

/* Any truncation and any single damaged byte is noticed. */
static void damage(void **state)
{
    (void)state;
    char *bytes;
    size_t size;
    struct ggn_seq_block b;
    struct base_err err = {0};
    assert_int_equal(base_file_read(block_path, 1 << 24, &bytes, &size, &err), 0);
    for (size_t i = 0; i < size; i += i < 400 ? 1 : 97) {
        uint8_t *cut = malloc(i + 1), *bad = malloc(size);
        memcpy(cut, bytes, i);
        memcpy(bad, bytes, size);
        bad[i] ^= 0x10;
        if (ggn_seq_block_parse("cut", cut, i, &b, &err) != BASE_EINVAL)
            fail_msg("%zu of %zu bytes were believed", i, size);
        if (ggn_seq_block_parse("bad", bad, size, &b, &err) != BASE_EINVAL)
            fail_msg("damage at byte %zu was believed", i);
        free(cut);
        free(bad);
    }
    free(bytes);
}

static void builder_limits(void **state)
{
    (void)state;
    struct ggn_seq_builder w;
    build(&w);
    struct ggn_seq_frame more = {.spp = 5000, .display = display};
    assert_int_equal(ggn_seq_builder_add(&w, &more, NULL), BASE_EINVAL); /* nothing after the reference */
    ggn_seq_builder_release(&w);
    assert_int_equal(ggn_seq_builder_init(&w, 0, 5, 0, 0, 0, 0, NULL), BASE_EINVAL);
}

static void manifest(void **state)
{
    (void)state;
    uint32_t levels[] = {20, 40, 80, 160};
    struct ggn_manifest_block entry = {.id = 9, .x0 = 400, .y0 = 200, .x1 = 400 + W, .y1 = 200 + H, .file = "block-00009.lseq"};
    struct ggn_manifest m = {.scene = "a \"scene\"", .width = 800, .height = 600, .block = 200, .reference_spp = 4096,
                             .reference_independent = 1, .n_levels = 3, .levels = levels, .n_blocks = 1, .blocks = &entry}, back;
    struct ggn_seq_builder w;
    struct ggn_seq_block b;
    struct base_err err = {0};
    struct stat st;
    build(&w);
    assert_int_equal(ggn_seq_builder_write(&w, block_path, &entry.crc32, &err), 0);
    ggn_seq_builder_release(&w);
    stat(block_path, &st);
    entry.bytes = (uint64_t)st.st_size;
    assert_int_equal(ggn_manifest_write(dir, &m, &err), 0);
    if (ggn_manifest_read(dir, &back, &err) != 0 || ggn_manifest_read_block(dir, &back, 0, &b, &err) != 0)
        fail_msg("%s", err.text);
    assert_string_equal(back.scene, m.scene);
    assert_int_equal(back.n_levels, 3);
    assert_int_equal(back.blocks[0].crc32, entry.crc32);
    ggn_seq_block_release(&b);

    back.blocks[0].crc32 ^= 1;
    assert_int_equal(ggn_manifest_read_block(dir, &back, 0, &b, &err), BASE_EINVAL);
    back.blocks[0].crc32 ^= 1;
    back.blocks[0].x1++; /* mixed sizes */
    assert_int_equal(ggn_manifest_read_block(dir, &back, 0, &b, &err), BASE_EINVAL);
    ggn_manifest_release(&back);
    m.n_levels = 4; /* a level that the block does not have */
    ggn_manifest_write(dir, &m, &err);
    ggn_manifest_read(dir, &back, &err);
    assert_int_equal(ggn_manifest_read_block(dir, &back, 0, &b, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "160 spp is missing"));
    ggn_manifest_release(&back);
}

static void bad_manifests(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "", "{}", "[1]", "{\"format\":\"lull-sequence\"}",
        "{\"format\":\"lull-sequence\",\"version\":2,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[1],\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"width\":8,\"height\":8,\"block\":8,\"levels\":[1],\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[],\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2,2],\"blocks\":[]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2],\"blocks\":"
        "[{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"file\":\"../x\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
        "{\"format\":\"lull-sequence\",\"version\":1,\"scene\":\"s\",\"width\":8,\"height\":8,\"block\":8,\"levels\":[2],\"blocks\":"
        "[{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":9,\"y1\":8,\"file\":\"x\",\"bytes\":9,\"crc32\":\"00000000\"}]}",
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct ggn_manifest m;
        struct base_err err = {0};
        if (ggn_manifest_parse("m.json", bad[i], strlen(bad[i]), &m, &err) != BASE_EINVAL || err.text[0] == '\0')
            fail_msg("%s was accepted", bad[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halves), cmocka_unit_test(codings), cmocka_unit_test(filters), cmocka_unit_test(round_trip),
        cmocka_unit_test(damage), cmocka_unit_test(builder_limits), cmocka_unit_test(manifest), cmocka_unit_test(bad_manifests),
    };
    return cmocka_run_group_tests_name("data_sequence", tests, setup, teardown);
}
