/* A baseline with made-up weights: its sizes, its file, and what it says of a block of another size. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_noise.h"

#include "baselines/baseline.h"
#include "baselines/lstm.h"

/* Sizes and windows at their ends; what a new one holds. */
static void new_baselines(void **state)
{
    (void)state;
    static const int least[] = {20, 8, 8};
    for (int kind = 0; kind < GGN_BASELINES; kind++) {
        struct ggn_baseline b;
        struct base_err err = {0};
        const int sizes[][3] = {{least[kind], 4096, 1},   {4096, least[kind], 1}, {least[kind] - 1, 50, 0},
                                {50, least[kind] - 1, 0}, {4097, 50, 0},          {50, 4097, 0}};
        char want[128];
        for (int i = 0; i < 6; i++) {
            assert_int_equal(ggn_baseline_init(&b, (enum ggn_baseline_kind)kind, sizes[i][0], sizes[i][1], 6, &err),
                             sizes[i][2] ? 0 : BASE_EINVAL);
            snprintf(want, sizeof want, "%s: blocks of %dx%d pixels; it takes %d to 4096", ggn_baseline_names[kind],
                     sizes[i][0], sizes[i][1], least[kind]);
            if (!sizes[i][2])
                assert_string_equal(err.text, want);
        }
        for (int window = 0; window <= 17; window++) {
            assert_int_equal(ggn_baseline_init(&b, (enum ggn_baseline_kind)kind, 65, 45, window, &err),
                             window > 0 && window < 17 ? 0 : BASE_EINVAL);
            snprintf(want, sizeof want, "%s: windows of %d images; it takes 1 to 16", ggn_baseline_names[kind], window);
            if (window == 0 || window == 17)
                assert_string_equal(err.text, want);
        }
        assert_int_equal(ggn_baseline_init(&b, (enum ggn_baseline_kind)kind, 65, 45, 4, &err), 0);
        assert_true(b.kind == (enum ggn_baseline_kind)kind && b.width == 65 && b.height == 45 && b.first == 0 && !b.lstm &&
                    !b.svm.values);
        assert_int_equal(b.window, kind == GGN_SVD_ENTROPY ? 4 : 1);
        assert_int_equal(b.features, kind == GGN_SVD_ENTROPY ? 6 : kind == GGN_ATTRIBUTES_SVM ? 26 : 128);
        assert_true(b.policy.passes == 1 && b.policy.threshold == 0.5 && b.policy.ratio == 1.15 && b.policy.first_spp == 20);
        assert_int_equal(ggn_baseline_feature_count(&b, 65, 45), b.features);
        assert_int_equal(ggn_baseline_feature_count(&b, 66, 91), 6 * b.features);
    }
}

/* Three looks of a small baseline with made-up weights. */
static void fill(struct ggn_baseline *b, enum ggn_baseline_kind kind)
{
    size_t n;
    assert_int_equal(ggn_baseline_init(b, kind, 24, 24, 3, NULL), 0);
    if (kind == GGN_SVD_ENTROPY) {
        n = ggn_lstm_parameters(b->features);
        b->lstm = malloc(n * sizeof *b->lstm);
    } else {
        assert_int_equal(ggn_svm_init(&b->svm, b->features, 5, NULL), 0);
        n = ggn_svm_values(&b->svm);
        b->svm.gamma = 0.125;
        b->svm.rho = 1.0 / 3.0;
    }
    for (size_t i = 0; i < n; i++)
        (b->lstm ? b->lstm : b->svm.values)[i] = (float)(0.3 * ggn_noise_gauss((uint32_t)i, 8));
    b->policy.threshold = 0.3;
    b->policy.ratio = 1.25;
}

static double logit_of(const struct ggn_baseline *b, int w, int h, uint32_t seed)
{
    static uint8_t rgb[3 * 60 * 60];
    static double look[3][4 * 128];
    const double *looks[3] = {look[0], look[1], look[2]};
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(b, NULL);
    assert_non_null(r);
    assert_true(ggn_baseline_feature_count(b, w, h) <= 4 * 128);
    for (uint32_t i = 0; i < 3; i++) {
        for (int k = 0; k < 3 * w * h; k++)
            rgb[k] = (uint8_t)(128.0 + 30.0 * ggn_noise_gauss((uint32_t)k, seed + i));
        ggn_baseline_extract(r, rgb, w, h, look[i]);
    }
    double logit = ggn_baseline_logit(r, looks, w, h);
    ggn_baseline_reader_destroy(r);
    return logit;
}

/* What is written is what is read: same numbers, same answers, for blocks of another size too. */
static void stored(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_baseline.XXXXXX";
    struct base_err err = {0};
    close(mkstemp(path));
    for (int kind = 0; kind < GGN_BASELINES; kind++) {
        struct ggn_baseline a, b;
        fill(&a, (enum ggn_baseline_kind)kind);
        cJSON *from = cJSON_CreateObject();
        assert_int_equal(ggn_baseline_save(&a, path, GGN_F32, from, &err), 0);
        cJSON_Delete(from);
        assert_int_equal(ggn_baseline_load(&b, path, (enum ggn_baseline_kind)((kind + 1) % GGN_BASELINES), &err),
                         BASE_EINVAL);
        assert_non_null(strstr(err.text, "not a baseline for"));
        assert_int_equal(ggn_baseline_load(&b, path, (enum ggn_baseline_kind)kind, &err), 0);
        assert_int_equal(b.kind, kind);
        assert_int_equal(b.window, kind == GGN_SVD_ENTROPY ? 3 : 1);
        assert_true(b.policy.threshold == 0.3 && b.policy.ratio == 1.25);
        assert_true(logit_of(&a, 24, 24, 1) == logit_of(&b, 24, 24, 1));
        assert_true(logit_of(&a, 24, 24, 1) != logit_of(&a, 24, 24, 7));
        assert_true(logit_of(&a, 40, 30, 1) == logit_of(&b, 40, 30, 1));
        assert_true(isfinite(logit_of(&b, 1, 1, 1)));
        ggn_baseline_release(&a);
        ggn_baseline_release(&b);
    }
    unlink(path);
}

/* A file whose description has one text for another: what reading it says ("": it is read). */
static void forged(const char *path, const char *from, const char *to, const char *want)
{
    struct ggn_container c, other = {0};
    struct ggn_baseline b;
    struct base_err err = {0};
    char line[200];
    assert_int_equal(ggn_container_read(&c, path, NULL), 0);
    const char *hit = strstr(c.json, from);
    assert_non_null(hit);
    other.json = malloc(strlen(c.json) + strlen(to) + 1);
    sprintf(other.json, "%.*s%s%s", (int)(hit - c.json), c.json, to, hit + strlen(from));
    for (int i = 0; i < c.n_entries; i++) {
        const struct ggn_entry *e = &c.entry[i];
        const int dim[] = {(int)e->dim[0], (int)e->dim[1]};
        assert_int_equal(ggn_container_add(&other, e->name, GGN_F32, e->rank, dim,
                                           (const float *)(const void *)(c.data + e->offset), NULL),
                         0);
    }
    char forged_path[] = "/tmp/ggn_forged.XXXXXX";
    close(mkstemp(forged_path));
    assert_int_equal(ggn_container_write(&other, forged_path, NULL), 0);
    ggn_container_release(&other);
    ggn_container_release(&c);
    int rc = ggn_baseline_load(&b, forged_path, GGN_BASELINES, &err);
    snprintf(line, sizeof line, "%s: %s", forged_path, want);
    assert_int_equal(rc, *want ? BASE_EINVAL : 0);
    assert_string_equal(err.text, *want ? line : "");
    ggn_baseline_release(&b);
    unlink(forged_path);
}

static void described(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_described.XXXXXX", *text, *flat;
    struct ggn_baseline b;
    struct ggn_container c;
    cJSON *from = cJSON_CreateObject();
    cJSON_AddNumberToObject(from, "blocks", 7);
    close(mkstemp(path));
    for (int kind = 0; kind < 2; kind++) {
        fill(&b, (enum ggn_baseline_kind)kind);
        b.first = 5 * !kind;
        assert_int_equal(ggn_baseline_save(&b, path, GGN_F16, from, NULL), 0);
        ggn_baseline_release(&b);
        assert_int_equal(ggn_container_read(&c, path, NULL), 0);
        text = flat = c.json;
        for (char *at = text; (*flat = *at) != '\0'; at++)
            flat += !strchr("\n\t ", *at);
        assert_string_equal(
            text,
            kind ? "{\"kind\":\"baseline\",\"method\":\"attributes\",\"width\":24,\"height\":24,\"window\":1,\"first\":0,"
                   "\"support\":5,\"gamma\":0.125,\"rho\":0.33333333333333331,\"policy\":{\"first_spp\":20,\"ratio\":1.25,"
                   "\"step_spp\":0,\"scale\":1,\"shift\":0,\"threshold\":0.3,\"slope\":0,"
                   "\"passes\":1},\"provenance\":{\"blocks\":7}}"
                 : "{\"kind\":\"baseline\",\"method\":\"svd-entropy\",\"width\":24,\"height\":24,\"window\":3,\"first\":5,"
                   "\"policy\":{\"first_spp\":20,\"ratio\":1.25,\"step_spp\":0,\"scale\":1,\"shift\":0,\"threshold\":0.3,"
                   "\"slope\":0,\"passes\":1},\"provenance\":{\"blocks\":7}}");
        static const char *const names[] = {"mean", "scale", "coefficient", "support"};
        assert_int_equal(c.n_entries, kind ? 4 : 1);
        for (int i = 0; i < c.n_entries; i++) {
            assert_string_equal(c.entry[i].name, kind ? names[i] : "lstm");
            assert_int_equal(c.entry[i].type, !kind || i == 3 ? GGN_F16 : GGN_F32);
            assert_int_equal(c.entry[i].rank, kind && i == 3 ? 2 : 1);
            assert_int_equal(c.entry[i].count, !kind ? ggn_lstm_parameters(1) : i == 2 ? 5 : i == 3 ? 5 * 26 : 26);
        }
        ggn_container_release(&c);
    }
    cJSON_Delete(from);
    fill(&b, GGN_ATTRIBUTES_SVM);
    from = cJSON_CreateObject();
    assert_int_equal(ggn_baseline_save(&b, path, GGN_F32, from, NULL), 0);
    cJSON_Delete(from);
    ggn_baseline_release(&b);
    forged(path, "attributes", "attributes", "");
    forged(path, "\"baseline\"", "\"model\"", "not a baseline");
    forged(path, "\"attributes\"", "\"attribute\"", "not a baseline");
    forged(path, "\"attributes\"", "1", "not a baseline");
    forged(path, "{", "[", "the description is not JSON");
    forged(path, "\"width\":\t24", "\"width\":\t0", "'width' is missing or not a number in 1..4096");
    forged(path, "\"width\":\t24", "\"width\":\t7", "attributes: blocks of 7x24 pixels; it takes 8 to 4096");
    forged(path, "\"height\":\t24", "\"height\":\t4097", "'height' is missing or not a number in 1..4096");
    forged(path, "\"height\":\t24", "\"height\":\t24.5", "'height' is not a whole number");
    forged(path, "\"window\":\t1", "\"window\":\t17", "'window' is missing or not a number in 1..16");
    forged(path, "\"window\":\t1", "\"window\":\t16", "");
    forged(path, "\"first\":\t0", "\"first\":\t18", "");
    forged(path, "\"first\":\t0", "\"first\":\t19", "'first' is missing or not a number in 0..18");
    forged(path, "\"support\":\t5", "\"support\":\t0", "'support' is missing or not a number in 1..1.04858e+06");
    forged(path, "\"support\":\t5", "\"support\":\t4",
           "tensor 'coefficient' does not have the shape that the network asks for");
    forged(path, "\"support\":\t5", "\"support\":\t1000", "the file is too small for 1000 vectors");
    forged(path, "\"gamma\":\t0.125", "\"gamma\":\t1e-12", "");
    forged(path, "\"gamma\":\t0.125", "\"gamma\":\t0", "'gamma' is missing or not a number in 1e-12..1e+12");
    forged(path, "\"rho\":\t0.3", "\"rho\":\t-2e12, \"r\":\t0.3", "'rho' is missing or not a number in -1e+12..1e+12");
    forged(path, "\"passes\":\t1", "\"passes\":\t0", "policy: passes = 0 is not in 1..16");
    fill(&b, GGN_SVD_ENTROPY);
    from = cJSON_CreateObject();
    assert_int_equal(ggn_baseline_save(&b, path, GGN_F32, from, NULL), 0);
    cJSON_Delete(from);
    ggn_baseline_release(&b);
    forged(path, "\"width\":\t24,\n\t\"height\":\t24", "\"width\":4000,\"height\":4000",
           "the file is too small for a network of this size");
    forged(path, "\"width\":\t24", "\"width\":\t40", "tensor 'lstm' does not have the shape that the network asks for");
    unlink(path);
}

/* What is seen of a block of another size: of tiles of the own one, row by row; the highest answer speaks, and none is none. */
static void looks_at_tiles(void **state)
{
    (void)state;
    enum { W = 40, H = 30 };
    static uint8_t rgb[3 * W * H], tile[3 * 24 * 24];
    static const int starts[4][2] = {{0, 0}, {16, 0}, {0, 6}, {16, 6}};
    for (int kind = 0; kind < GGN_BASELINES; kind++) {
        static double look[4 * 128], part[128], stale[4 * 128];
        struct ggn_baseline b;
        double highest = -1e30;
        fill(&b, (enum ggn_baseline_kind)kind);
        struct ggn_baseline_reader *r = ggn_baseline_reader_create(&b, NULL);
        for (int i = 0; i < 3 * W * H; i++)
            rgb[i] = (uint8_t)(128.0 + 30.0 * ggn_noise_gauss((uint32_t)i, 5) * (i % W > 20 ? 2 : 1));
        ggn_baseline_extract(r, rgb, W, H, look);
        assert_int_equal(ggn_baseline_feature_count(&b, W, H), 4 * b.features);
        for (int k = 0; k < 4; k++) {
            for (int i = 0; i < 3 * 24 * 24; i++)
                tile[i] = rgb[i / 576 * W * H + (starts[k][1] + i % 576 / 24) * W + starts[k][0] + i % 24];
            ggn_baseline_extract(r, tile, 24, 24, part);
            assert_memory_equal(part, look + k * b.features, (size_t)b.features * sizeof *part);
            memcpy(stale + k * b.features, part, (size_t)b.features * sizeof *part);
            const double *alone[] = {part, part, part};
            highest = fmax(highest, ggn_baseline_logit(r, alone, 24, 24));
        }
        const double *all[] = {look, look, look}, *newest_broken[] = {look, look, stale};
        assert_true(ggn_baseline_logit(r, all, W, H) == highest);
        stale[2 * b.features] = (double)NAN;
        if (kind == GGN_SVD_ENTROPY)
            assert_true(isnan(ggn_baseline_logit(r, newest_broken, W, H)));
        newest_broken[0] = stale;
        assert_true(isnan(ggn_baseline_logit(r, newest_broken, W, H)));
        ggn_baseline_reader_destroy(r);
        ggn_baseline_release(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(new_baselines), cmocka_unit_test(stored),
                                       cmocka_unit_test(described), cmocka_unit_test(looks_at_tiles)};
    return cmocka_run_group_tests_name("baseline_file", tests, NULL, NULL);
}
