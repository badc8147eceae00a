/* Every allocation of reading and writing data, of FLIP, the observer and the statistics fails once: an error, no crash, no leak, and never a file that
 * lacks something. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "data/labels.h"
#include "sequence/manifest.h"
#include "data/import.h"
#include "picture/read.h"
#include "data/thresholds.h"
#include "sight/stats.h"
#include "sight/curve.h"
#include "sight/flip.h"
#include "train/views.h"
#include "support/fail_alloc.h"

enum { W = 12, H = 10, P = W * H };

static char dir[] = "/tmp/ggn_oom_data.XXXXXX";
static char block_path[64];
static uint32_t block_crc;
static uint8_t display[3 * P], other[3 * P];
static double mean[3 * P], half[3 * P];

static int setup(void **state)
{
    (void)state;
    for (int i = 0; i < 3 * P; i++) {
        mean[i] = 0.3 + 0.001 * (i % 200);
        half[i] = 0.02 * (i % 7 - 3);
        display[i] = (uint8_t)(120 + i % 9);
        other[i] = (uint8_t)(118 + i % 13);
    }
    if (!mkdtemp(dir))
        return -1;
    snprintf(block_path, sizeof block_path, "%s/block-00000.lseq", dir);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", dir);
    return system(command);
}

static int write_block(struct base_err *err)
{
    struct seq_builder w = {0};
    int rc = seq_builder_init(&w, W, H, 0, 0, 0, 1, err);
    for (uint32_t i = 0; i < 3 && !rc; i++) {
        struct seq_frame f = {.spp = 100u << i,
                              .half_spp = 50,
                              .is_reference = i == 2,
                              .full = i == 1,
                              .display = display,
                              .mean = mean,
                              .half = half};
        rc = seq_builder_add(&w, &f, err);
    }
    if (!rc)
        rc = seq_builder_write(&w, block_path, &block_crc, err);
    seq_builder_release(&w);
    return rc;
}

static int read_block(struct base_err *err)
{
    struct seq_block b;
    static float out[3 * P];
    static uint8_t bytes[3 * P];
    int rc = seq_block_read(block_path, &b, err);
    if (rc)
        return rc;
    for (uint32_t i = 0; i < b.n_levels && !rc; i++)
        rc = seq_mean(&b, &b.levels[i], out, err);
    if (!rc)
        rc = seq_half_luminance(&b, &b.levels[1], out, err);
    if (!rc)
        rc = seq_display(&b, b.reference, bytes, err);
    seq_block_release(&b);
    return rc;
}

static int texts(struct base_err *err)
{
    uint32_t levels[] = {100, 200};
    struct seq_manifest_block entries[] = {{.id = 0, .x1 = W, .y1 = H, .file = "block-00000.lseq", .bytes = 10},
                                           {.id = 1, .x0 = W, .x1 = 2 * W, .y1 = H, .file = "b", .bytes = 10}};
    struct ggn_label list[] = {{0, 120, 0}, {1, 200, 1}};
    struct seq_manifest m = {.scene = "s",
                             .width = 2 * W,
                             .height = H,
                             .block = W,
                             .n_levels = 2,
                             .levels = levels,
                             .n_blocks = 2,
                             .blocks = entries},
                        m2;
    struct ggn_labels l = {.source = "observer", .cap = 200, .spread = 0.25, .n = 2, .labels = list}, l2;
    int rc = seq_manifest_write(dir, &m, err);
    if (!rc)
        rc = ggn_labels_write(dir, &l, 0, err);
    if (!rc && (rc = seq_manifest_read(dir, &m2, err)) == 0) {
        assert_true(m2.n_blocks == 2 && m2.n_levels == 2); /* what was written is whole */
        seq_manifest_release(&m2);
    }
    if (!rc && (rc = ggn_labels_read(dir, &l2, err)) == 0) {
        assert_true(l2.n == 2 && l2.labels[1].censored && l2.cap == 200);
        ggn_labels_release(&l2);
    }
    return rc;
}

static int tables(struct base_err *err)
{
    char text[] = "a;1;2;\nb;3;4;\nc;5;6;\n";
    static const char rawls_image[] = "IHDR\n12\n\1\0\0\0\1\0\0\0\1\0\0\0\nCOMMENTS\nDATA\n4\n\0\0\0\0\n";
    struct ggn_thresholds t;
    struct pic_image image;
    const double x[] = {1, 2, 3};
    const unsigned char label[] = {0, 1, 1};
    double auc;
    int rc = ggn_thresholds_parse_csv("t.csv", text, strlen(text), &t, err);
    if (rc)
        return rc;
    ggn_thresholds_release(&t);
    rc = ggn_rawls_parse("r", rawls_image, sizeof rawls_image - 1, &image, err);
    if (rc)
        return rc;
    pic_release(&image);
    return ggn_stats_auc(x, label, 3, &auc, err);
}

static int look(struct base_err *err)
{
    struct ggn_flip_stats flip;
    struct seq_block b;
    struct ggn_curve curve;
    int rc = ggn_flip(display, other, W, H, GGN_FLIP_PPD, NULL, &flip, err);
    if (!rc)
        rc = seq_block_read(block_path, &b, err);
    if (rc)
        return rc;
    for (int source = GGN_FROM_HALVES; source <= GGN_FROM_LEVELS && !rc; source++) {
        rc = ggn_curve_make(&b, (enum ggn_curve_source)source, 1, &curve, err);
        if (!rc)
            ggn_curve_release(&curve);
    }
    seq_block_release(&b);
    return rc;
}

/* The labels of a view of one block. */
static int label(struct base_err *err)
{
    struct stat st;
    uint32_t levels[] = {100, 200};
    struct seq_manifest_block entry = {.id = 0, .x1 = W, .y1 = H, .file = "block-00000.lseq", .crc32 = block_crc};
    struct ggn_dataset_view view = {.manifest = {.scene = "s",
                                                 .width = W,
                                                 .height = H,
                                                 .block = W,
                                                 .n_levels = 2,
                                                 .levels = levels,
                                                 .reference_spp = 400,
                                                 .reference_independent = 1,
                                                 .n_blocks = 1,
                                                 .blocks = &entry}};
    const struct ggn_observer *model = &ggn_observer_default;
    struct ggn_labels l;
    struct base_threads *threads = base_threads_create(1, err);
    if (!threads)
        return BASE_ENOMEM;
    snprintf(view.dir, sizeof view.dir, "%s", dir);
    assert_int_equal(stat(block_path, &st), 0);
    entry.bytes = (uint64_t)st.st_size;
    int rc = ggn_view_label(model, &view, GGN_FROM_HALVES, threads, &l, err);
    if (!rc) {
        assert_true(l.n == 1 && l.labels[0].threshold > 0);
        ggn_labels_release(&l);
    }
    base_threads_destroy(threads);
    return rc;
}

/* What may fail silently, because the work is whole all the same: the buffer of a file, the search for what an earlier writer left. */
static void fail_each(int (*body)(struct base_err *), int silent)
{
    enum { MANY = 5000 };
    long k = 1;
    assert_int_equal(body(NULL), 0);
    for (; k < MANY; k++) {
        struct base_err err = {0};
        fail_arm(k);
        int rc = body(&err), failed = fail_disarm();
        if (!failed)
            break;
        if (!rc && body == write_block)
            assert_int_equal(read_block(NULL), 0);
        if (rc ? err.text[0] == '\0' : --silent < 0)
            fail_msg("allocation %ld failed and nothing was said", k);
    }
    assert_true(k > 2 && k < MANY);
    assert_int_equal(body(NULL), 0);
}

static void blocks(void **state)
{
    (void)state;
    fail_each(write_block, 2);
    fail_each(read_block, 1);
}

static void json(void **state)
{
    (void)state;
    fail_each(texts, 7);
}

static void small_inputs(void **state)
{
    (void)state;
    fail_each(tables, 0);
}

static void observer(void **state)
{
    (void)state;
    assert_int_equal(write_block(NULL), 0);
    fail_each(look, 1);
    fail_each(label, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(blocks), cmocka_unit_test(json), cmocka_unit_test(small_inputs),
                                       cmocka_unit_test(observer)};
    return cmocka_run_group_tests_name("oom_data", tests, setup, teardown);
}
