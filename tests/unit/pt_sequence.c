/* Block sequences as plugin-api/sequence/FORMAT.md says, read back byte by byte. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <math.h>

#include <cjson/cJSON.h>
#include <zlib.h>

#include "base/files.h"
#include "render/film.h"
#include "render/sequence.h"
#include "scene/scene.h"
#include "sequence/manifest.h"
#include "sequence/tail.h"
#include "support/lseq_oracle.h"
#include "support/pt_fake.h"
#include "support/pt_captured.h"

static void levels(void **state)
{
    (void)state;
    static uint32_t spp[PT_SEQUENCE_MAX_LEVELS];
    struct base_err err = {0};
    assert_int_equal(pt_sequence_levels("linear:20:100:20", spp, &err), 5);
    assert_int_equal(spp[4], 100);
    int n = pt_sequence_levels("geometric:20:10000:1.15", spp, &err);
    assert_in_range(n, 45, 46);
    assert_int_equal(spp[0], 20);
    assert_int_equal(spp[1], 23);
    assert_int_equal(spp[n - 1], 10000);
    for (int i = 1; i < n; i++)
        assert_true(spp[i] > spp[i - 1]);
    assert_int_equal(pt_sequence_levels("geometric:1:5:1.01", spp, &err), 5);
    enum { MOST = PT_SEQUENCE_MAX_LEVELS };
    char text[64], line[200];
    snprintf(text, sizeof text, "linear:1:%d:1", MOST - 1);
    assert_int_equal(pt_sequence_levels(text, spp, &err), MOST - 1);
    assert_true(spp[0] == 1 && spp[MOST - 2] == MOST - 1);
    snprintf(text, sizeof text, "linear:1:%d:1", MOST);
    assert_int_equal(pt_sequence_levels(text, spp, &err), BASE_EINVAL);
    snprintf(line, sizeof line, "--levels %s: more than %d levels", text, MOST - 1);
    assert_string_equal(err.text, line);
    snprintf(text, sizeof text, "linear:1:%d.5:1", MOST - 1); /* the last is whole and there */
    assert_int_equal(pt_sequence_levels(text, spp, &err), MOST - 1);
    assert_int_equal(pt_sequence_levels("linear:3:10:4", spp, &err), 3);
    assert_true(spp[0] == 3 && spp[1] == 7 && spp[2] == 10);
    assert_int_equal(pt_sequence_levels("geometric:3:3:1.001", spp, &err), 1);
    assert_int_equal(pt_sequence_levels("geometric:2:20:2.2", spp, &err), 4); /* 2, 4.4, 9.68 and the end */
    assert_true(spp[0] == 2 && spp[1] == 4 && spp[2] == 10 && spp[3] == 20);
    pt_sequence_levels("cubic:1:2:3", spp, &err);
    assert_string_equal(err.text, "--levels cubic:1:2:3: expected geometric:FIRST:LAST:RATIO or linear:FIRST:LAST:STEP");
    pt_sequence_levels("linear:2:1:1", spp, &err);
    assert_string_equal(err.text, "--levels linear:2:1:1: expected 1 <= FIRST <= LAST, RATIO >= 1.001, STEP >= 1");
    static const char *const bad[] = {"geometric:1:9:1.0009",
                                      "linear:1:9:0.9",
                                      "linear:0.9:9:1",
                                      "linear:1:1000000001:900000000",
                                      "",
                                      "linear",
                                      "linear:1:2",
                                      "cubic:1:2:3",
                                      "linear:0:5:1",
                                      "linear:5:1:1",
                                      "geometric:1:9:1",
                                      "linear:1:9:1:2",
                                      "linear:1:9:nan",
                                      "linear:1:100000:1",
                                      "geometric:1:inf:2"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(pt_sequence_levels(bad[i], spp, &err), BASE_EINVAL);
}

static void block_lists(void **state)
{
    (void)state;
    struct base_err err = {0};
    uint8_t chosen[12] = {0};
    assert_int_equal(pt_sequence_choose("0,3,8-10", chosen, 12, &err), 0);
    static const uint8_t expected[12] = {1, 0, 0, 1, 0, 0, 0, 0, 1, 1, 1, 0};
    assert_memory_equal(chosen, expected, 12);
    static const char *const bad[] = {"", "12", "1-", "3-1", "-1", "a", "1,", "1;2", "0-12"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(pt_sequence_choose(bad[i], chosen, 12, &err), BASE_EINVAL);
    pt_sequence_choose("3-12", chosen, 12, &err);
    assert_string_equal(err.text, "--blocks 3-12: blocks are 0 to 11 here");
    pt_sequence_choose("3;4", chosen, 12, &err);
    assert_string_equal(err.text, "--blocks 3;4: expected a list like 0,3,8-11");
}

/* The film's second moment and the statistics must weigh colours alike: a pixel whose samples are all the same has no error,
 * whatever its colour. The bound is the rounding of a sum of 64 squares: sqrt(64 * 2^-53 / 63). */
static void noise_free_colours_have_no_error(void **state)
{
    (void)state;
    static const float colours[4][3] = {{0.7f, 0, 0}, {0, 0.7f, 0}, {0, 0, 0.7f}, {0.1f, 3.0f, 0.4f}};
    for (int k = 0; k < 4; k++) {
        struct pt_film_pixel p = {0};
        struct pt_path_result sample = {.radiance = v3(colours[k][0], colours[k][1], colours[k][2])};
        for (uint32_t s = 0; s < 64; s++)
            assert_true(pt_film_add(&p, PT_FILM_HALF | PT_FILM_MOMENT2, pt_film_in_half(s), &sample));
        double mean[3], half[3], none[3] = {0}, m2 = p.moment2 / 64, scratch;
        for (int c = 0; c < 3; c++) {
            mean[c] = p.color[c] / 64;
            half[c] = p.half[c] / 32;
        }
        struct seq_stat s[SEQ_STATISTICS];
        seq_statistics(mean, half, none, &m2, 1, 64, &scratch, s);
        assert_true(s[SEQ_RSE].value <= 1.1e-8 && s[SEQ_RSE_UNSETTLED].value == 0.0 && s[SEQ_HALF_UNSETTLED].value == 0.0);
    }
}

/* --- a recorded folder ---------------------------------------------------------------------------------------------- */

static char folder[64];
static struct base_threads *pool;

static int setup(void **state)
{
    (void)state;
    struct base_err err = {0};
    strcpy(folder, "/tmp/pt_sequence_XXXXXX");
    pool = base_threads_create(2, &err);
    return mkdtemp(folder) && pool ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    char command[128];
    base_threads_destroy(pool);
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static struct pt_sequence_config make_config(void)
{
    return (struct pt_sequence_config){.directory = folder,
                                       .levels = "linear:16:352:112",
                                       .blocks = "1,11",
                                       .reference_spp = 64,
                                       .scene_path = "x/room-view3.pbrt",
                                       .scene_crc = 0xabc,
                                       .render = pt_fake_config()};
}

static struct captured messages;
static struct pt_render_hooks hooks = {.log = &messages.log};

/* "…, 0.1 s each, 3 s left" after what is known. */
static void check_said(int i, const char *begin, const char *end)
{
    double each_s, left_s;
    const char *said = messages.text;
    for (; i > 0; i--)
        said = strchr(said, '\n') + 1;
    assert_memory_equal(said, begin, strlen(begin));
    assert_int_equal(sscanf(said + strlen(begin), "%lf s each, %lf s left", &each_s, &left_s), 2);
    assert_memory_equal(strchr(said, '\n') - strlen(end), end, strlen(end));
}

static pt_kernel *kernel = pt_fake_noise;
static int record(const struct pt_sequence_config *config, struct lull_host_criterion *criterion, struct base_err *err)
{
    int stopped;
    static const struct pt_scene empty; /* the kernel here needs none */
    return pt_sequence_record(config, &empty, kernel, pool, criterion, &hooks, &stopped, err);
}

static uint32_t u32(const unsigned char *p)
{
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static double f64(const unsigned char *p)
{
    double v;
    memcpy(&v, p, sizeof v);
    return v;
}

static unsigned char *read_all(const char *name, size_t *size)
{
    char path[128], *data;
    struct base_err err = {0};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    assert_int_equal(base_file_read(path, 1 << 26, &data, size, &err), 0);
    return (unsigned char *)data;
}

/* Undoes subtract green and average of a P-pixel RGB plane. */
static void unfilter(unsigned char *p, int width, int height)
{
    size_t pixels = (size_t)(width * height);
    for (size_t c = 0; c < 3; c++)
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                unsigned char *q = p + c * pixels + (size_t)(y * width + x);
                *q = (unsigned char)(*q + ((x > 0 ? q[-1] : 0) + (y > 0 ? q[-width] : 0)) / 2);
            }
    for (size_t i = 0; i < pixels; i++) {
        p[i] = (unsigned char)(p[i] + p[pixels + i]);
        p[2 * pixels + i] = (unsigned char)(p[2 * pixels + i] + p[pixels + i]);
    }
}

/* The film of one block at spp, rendered by itself. */
static struct pt_render *render_block(int x0, int y0, int x1, int y1, uint32_t spp, uint32_t seed)
{
    struct pt_render_config c = pt_fake_config();
    int crop[4] = {x0, y0, x1, y1};
    struct pt_render *r;
    struct pt_render_hooks none = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    memcpy(c.crop, crop, sizeof crop);
    c.spp_min = c.spp_max = spp;
    c.uniform = 1;
    c.planes = PT_FILM_HALF | PT_FILM_MOMENT2;
    c.integrator.seed = seed;
    assert_int_equal(pt_render_create(&c, NULL, pt_fake_noise, pool, NULL, &r, &err), 0);
    assert_int_equal(pt_render_run(r, &none, &outcome, &err), 0);
    return r;
}

/* Means from the film's sums: I, A of the half, D = (A - B)/2. */
static void means(const struct pt_render *r, size_t i, double mean[3], double a[3], double d[3])
{
    const double spp = (double)r->blocks->list[0].spp, half = floor(spp / 2);
    for (size_t c = 0; c < 3; c++) {
        const double all = r->film.color[3 * i + c], first = r->film.half[3 * i + c];
        mean[c] = all / spp;
        a[c] = first / half;
        d[c] = (first / half - (all - first) / (spp - half)) / 2;
    }
}

static double luminance(const double c[3]) { return 0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2]; }

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The statistics of FORMAT.md from its text, in its order. */
static void check_statistics(const unsigned char *p, const struct pt_render *r)
{
    static const char *const names[6] = {"dammertz", "half_unsettled", "rse", "rse_unsettled", "tail999", "gini"};
    static double noise[256];
    const size_t n = r->film.pixels;
    const double spp = (double)r->blocks->list[0].spp, pixels = (double)n;
    double expected[6] = {0}, bright = 0, sum = 0;
    for (size_t i = 0; i < n; i++) {
        double mean[3], a[3], d[3];
        means(r, i, mean, a, d);
        const double y = luminance(mean), m2 = r->film.moment2[i] / spp;
        const double e = sqrt(fmax(m2 - y * y, 0) / (spp - 1)) / fmax(fabs(y), 0.02);
        expected[0] += (fabs(mean[0] - a[0]) + fabs(mean[1] - a[1]) + fabs(mean[2] - a[2])) /
                       sqrt(mean[0] + mean[1] + mean[2]) / pixels;
        expected[1] += (fabs(y - luminance(a)) > 0.5 * fmax(fabs(y), 0.02)) / pixels;
        expected[2] += e * e / pixels;
        expected[3] += (e > 0.5) / pixels;
        noise[i] = fabs(luminance(d));
        bright += y / pixels;
    }
    expected[2] = sqrt(expected[2]);
    qsort(noise, n, sizeof *noise, rising);
    expected[4] = noise[(size_t)ceil(0.999 * pixels) - 1] / bright;
    for (size_t i = 0; i < n; i++) {
        expected[5] += (2 * (double)(i + 1) - pixels - 1) * noise[i];
        sum += noise[i];
    }
    expected[5] /= pixels * sum;
    for (int i = 0; i < 6; i++, p += 32) {
        assert_string_equal((const char *)p, names[i]);
        if (!(fabs(f64(p + 24) - expected[i]) <= 1e-9 * (1 + expected[i]))) /* sums in another order */
            fail_msg("%s at %g spp: %.12g, expected %.12g", names[i], spp, f64(p + 24), expected[i]);
    }
    assert_string_equal((const char *)p, "seconds");
    assert_true(f64(p + 24) > 0 && f64(p + 24) < 60);
}

static const unsigned char *check_plane(const unsigned char *p, uint32_t id, const struct pt_render *r)
{
    static unsigned char raw[6 * 256];
    uLongf n = sizeof raw;
    size_t pixels = r->film.pixels;
    int width = r->film.x1 - r->film.x0;
    assert_int_equal(u32(p), id);
    assert_int_equal(uncompress(raw, &n, p + 16, u32(p + 12)), Z_OK);
    assert_int_equal(n, u32(p + 8));
    if (id == 1)
        unfilter(raw, width, (int)pixels / width);
    for (size_t i = 0; i < pixels; i++) {
        double mean[3], a[3], d[3];
        means(r, i, mean, a, d);
        for (size_t c = 0; c < 3; c++) {
            uint16_t h = (uint16_t)(raw[c * pixels + i] | raw[(id > 3 ? 3 * pixels : 0) + c * pixels + i] << 8);
            if (id == 1)
                assert_int_equal(raw[c * pixels + i], oracle_display(mean[c]));
            else if (id == 2)
                assert_int_equal(raw[c * pixels + i], oracle_fine(mean[c]));
            else if (id >= 4)
                assert_int_equal(h, oracle_f16(id == 4 ? mean[c] : d[c]));
        }
        if (id == 3)
            assert_int_equal(raw[i], oracle_half_log(luminance(d)));
    }
    return p + 16 + u32(p + 12);
}

static void check_block(const char *name, int x0, int y0, int x1, int y1, int with_criterion)
{
    static const uint32_t spp[5] = {16, 128, 240, 352, 64};
    size_t size;
    unsigned char *data = read_all(name, &size);
    const unsigned char *p = data + 64;
    assert_memory_equal(data, "LULLSEQ1", 8);
    assert_int_equal(u32(data + 16), x1 - x0);
    assert_int_equal(u32(data + 20), y1 - y0);
    assert_int_equal(u32(data + 24), x0);
    assert_int_equal(u32(data + 28), y0);
    assert_int_equal(u32(data + 36), 5);
    assert_int_equal(u32(data + 60), crc32(0, data, 60));
    for (int k = 0; k < 5; k++) {
        uint32_t statistics_count = u32(p + 12), bytes = u32(p + 20);
        assert_int_equal(u32(p), k < 4 ? 1 : 2);
        assert_int_equal(u32(p + 4), spp[k]);
        assert_int_equal(u32(p + 8), spp[k] / 2);
        assert_int_equal(statistics_count, k == 4 ? 1 : 7 + with_criterion);
        assert_int_equal(u32(p + 16), 3);
        assert_int_equal(u32(p + 24), crc32(0, p + 32, bytes));
        assert_int_equal(u32(p + 28), crc32(0, p, 28));
        if (with_criterion && k < 4) {
            assert_string_equal((const char *)p + 32 + 7 * 32, "fake.error");
            assert_true(fabs(f64(p + 32 + 7 * 32 + 24) - 0.75) < 0.02);
        }
        struct pt_render *r = render_block(x0, y0, x1, y1, spp[k], k < 4 ? 7 : 7 ^ 0x5bd1e995u);
        if (k < 4)
            check_statistics(p + 32, r);
        const unsigned char *q = p + 32 + 32 * statistics_count;
        q = check_plane(q, 1, r);
        q = check_plane(q, k >= 3 ? 4 : 2, r); /* 352 is the first level of 320 or more */
        q = check_plane(q, k >= 3 ? 5 : 3, r);
        pt_render_destroy(r);
        p += 32 + bytes;
        assert_ptr_equal(p, q);
    }
    assert_ptr_equal(p, data + size);
    free(data);
}

static cJSON *read_manifest(void)
{
    size_t size;
    char *text = (char *)read_all("manifest.json", &size);
    cJSON *m = cJSON_Parse(text);
    assert_non_null(m);
    free(text);
    return m;
}

static void recorded_folder(void **state)
{
    (void)state;
    struct pt_sequence_config config = make_config();
    struct lull_host_criterion *criterion = NULL;
    struct base_err err = {0};
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, pool, NULL, &criterion, &err), 0);
    capture_begin(&messages);
    assert_int_equal(record(&config, criterion, &err), 0);
    assert_int_equal(captured_lines(&messages), 2);
    check_said(0, "block 1 recorded, 1 of 2, ", " s left");
    check_said(1, "block 11 recorded, 2 of 2, ", ", 0 s left");
    capture_end(&messages);
    lull_host_close(criterion);
    check_block("block-00001.lseq", 16, 0, 32, 16, 1);
    check_block("block-00011.lseq", 48, 32, 60, 44, 1);
    cJSON *m = read_manifest();
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(m, "scene")), "room");
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(m, "camera")), "view3");
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(m, "source_crc32")), "00000abc");
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(m, "levels")), 4);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(m, "blocks")), 2);
    size_t size;
    unsigned char *data = read_all("block-00011.lseq", &size);
    const cJSON *entry = cJSON_GetArrayItem(cJSON_GetObjectItem(m, "blocks"), 1);
    char crc[16];
    snprintf(crc, sizeof crc, "%08x", (unsigned)crc32(0, data, (uInt)size));
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(entry, "crc32")), crc);
    assert_true(cJSON_GetObjectItem(entry, "bytes")->valuedouble == (double)size);
    free(data);
    cJSON_Delete(m);
}

/* What was not finite is counted per block, said, and in the manifest: of 352 and 64 samples those that are 5 modulo 97, in
 * the eight columns that pt_fake_nan spoils. */
static void dropped_samples_are_counted(void **state)
{
    (void)state;
    struct pt_sequence_config config = make_config();
    struct base_err err = {0};
    char own[] = "/tmp/pt_sequence_nan_XXXXXX", command[128];
    assert_non_null(mkdtemp(own));
    config.directory = own;
    config.blocks = "0,1";
    kernel = pt_fake_nan;
    capture_begin(&messages);
    messages.log.quiet = 1;
    assert_int_equal(record(&config, NULL, &err), 0);
    kernel = pt_fake_noise;
    assert_int_equal(captured_lines(&messages), 1);
    assert_string_equal(messages.text, "block 0: 640 samples were not finite and were dropped; manifest.json counts them\n");
    capture_end(&messages);
    struct seq_manifest m;
    assert_int_equal(seq_manifest_read(own, &m, &err), 0);
    assert_int_equal(m.blocks[0].dropped, 8 * 16 * (4 + 1));
    assert_int_equal(m.blocks[1].dropped, 0);
    seq_manifest_release(&m);
    snprintf(command, sizeof command, "rm -r %s", own);
    assert_int_equal(system(command), 0);
}

/* The slices of one phase fail, or are the last before an interrupt. */
static struct {
    uint64_t spp_max; /* the phase: of levels or of the reference */
    int fails;
    volatile sig_atomic_t stop;
} ending;

static int end_there(void *data, struct pt_render *r, struct base_err *err)
{
    (void)data;
    if (r->config.spp_max != ending.spp_max)
        return 0;
    ending.stop = !ending.fails;
    return ending.fails ? base_fail(err, BASE_EIO, "the disk is gone") : 0;
}

/* A block that failed or was interrupted, on its way up or in its reference, is not there; the next run makes it. */
static void a_block_is_recorded_whole_or_not(void **state)
{
    (void)state;
    static const struct pt_scene empty;
    struct pt_sequence_config config = make_config();
    char own[] = "/tmp/pt_sequence_end_XXXXXX", command[128];
    assert_non_null(mkdtemp(own));
    config.directory = own;
    config.blocks = "0";
    for (int k = 0; k < 5; k++) {
        struct seq_manifest m;
        struct base_err err = {0};
        int stopped = 7;
        const struct pt_render_hooks ends = {.slice = k < 4 ? end_there : NULL, .interrupted = &ending.stop};
        ending.spp_max = k % 2 ? 64 : 352;
        ending.fails = k < 2;
        ending.stop = 0;
        int rc = pt_sequence_record(&config, &empty, kernel, pool, NULL, &ends, &stopped, &err);
        assert_int_equal(rc, k < 2 ? BASE_EIO : 0);
        assert_int_equal(stopped, k == 2 || k == 3);
        if (k < 2)
            assert_string_equal(err.text, "the disk is gone");
        assert_int_equal(seq_manifest_read(own, &m, &err), 0);
        assert_int_equal(m.n_blocks, k == 4);
        seq_manifest_release(&m);
        snprintf(command, sizeof command, "%s/block-00000.lseq", own);
        assert_int_equal(access(command, F_OK), k == 4 ? 0 : -1);
    }
    snprintf(command, sizeof command, "rm -r %s", own);
    assert_int_equal(system(command), 0);
}

static void going_on(void **state)
{
    (void)state;
    struct pt_sequence_config config = make_config();
    struct base_err err = {0};
    struct stat before, after;
    char path[128];
    snprintf(path, sizeof path, "%s/block-00001.lseq", folder);
    stat(path, &before);
    capture_begin(&messages);
    config.blocks = "1,2,11";
    assert_int_equal(record(&config, NULL, &err), 0);
    assert_int_equal(captured_lines(&messages), 1);
    check_said(0, "block 2 recorded, 1 of 1, ", ", 0 s left");
    capture_end(&messages);
    stat(path, &after);
    assert_true(before.st_ino == after.st_ino);
    check_block("block-00002.lseq", 32, 0, 48, 16, 0);

    FILE *f = fopen(path, "r+b"); /* a damaged file is made again */
    fseek(f, 100, SEEK_SET);
    fputc('x', f);
    fclose(f);
    capture_begin(&messages);
    assert_int_equal(record(&config, NULL, &err), 0);
    assert_int_equal(captured_lines(&messages), 1);
    capture_end(&messages);
    check_block("block-00001.lseq", 16, 0, 32, 16, 0);
    cJSON *m = read_manifest();
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(m, "blocks")), 3);
    cJSON_Delete(m);

    config.reference_spp = 65;
    assert_int_equal(record(&config, NULL, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "reference_spp=64, but this render has reference_spp=65"));
    config = make_config();
    config.render.integrator.max_depth = 3;
    assert_int_equal(record(&config, NULL, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "max depth 3, clamp inf; use another folder"));
    config = make_config();
    config.directory = "/proc/nope/deep";
    assert_int_equal(record(&config, NULL, &err), BASE_EIO);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels),
        cmocka_unit_test(block_lists),
        cmocka_unit_test(noise_free_colours_have_no_error),
        cmocka_unit_test(recorded_folder),
        cmocka_unit_test(dropped_samples_are_counted),
        cmocka_unit_test(a_block_is_recorded_whole_or_not),
        cmocka_unit_test(going_on),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
