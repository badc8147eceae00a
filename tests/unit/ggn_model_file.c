/* Model files: what is written is read back, in every type; damage of every kind is one line and BASE_EINVAL. */
#include "support/ggn_cmocka.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "model/model.h"
#include "base/half.h"

static char path[] = "/tmp/ggn_model.XXXXXX";
static struct ggn_hyper small = {GGN_PRESET_LULL, 16, 17, 2, 1, 2, 1, 0};

static int setup(void **state)
{
    int fd = mkstemp(path);
    (void)state;
    return fd < 0 ? -1 : close(fd);
}

static int teardown(void **state)
{
    (void)state;
    return unlink(path);
}

static struct ggn_model *make(void)
{
    struct ggn_model *m = ggn_model_create(&small, NULL);

    assert_non_null(m);
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_init(m->weights[net], GGN_INIT_HASH, 5);
    m->calibration = (struct ggn_calibration){1.5, -0.25, 0.3, 3, 1.25};
    assert_non_null(cJSON_AddStringToObject(m->provenance, "data", "0123abcd"));
    return m;
}

static void save(enum ggn_type type)
{
    struct ggn_model *m = make();
    struct base_err err = {0};

    if (ggn_model_save(m, path, type, &err))
        fail_msg("%s", err.text);
    ggn_model_destroy(m);
}

static void test_round_trip(void **state)
{
    static const double tolerance[GGN_TYPES] = {0, 1.0 / 2048, 1.0 / 256};

    for (int type = 0; type < GGN_TYPES; type++) {
        struct ggn_model *want = make(), *got = NULL;
        struct base_err err = {0};
        save((enum ggn_type)type);
        if (ggn_model_load(path, &got, &err))
            fail_msg("%s", err.text);
        assert_memory_equal(&got->hyper, &want->hyper, sizeof want->hyper);
        assert_memory_equal(&got->calibration, &want->calibration, sizeof want->calibration);
        assert_string_equal(cJSON_GetObjectItem(got->provenance, "data")->valuestring, "0123abcd");
        for (int net = 0; net < GGN_NETS; net++) {
            for (size_t i = 0; i < want->graph[net].n_params; i++) {
                double a = (double)got->weights[net]->params[i], b = (double)want->weights[net]->params[i];
                assert_true(fabs(a - b) <= tolerance[type] * fabs(b) + (type == GGN_F16 ? 3e-8 : 0)); /* f16 subnormals */
            }
            assert_memory_equal(got->weights[net]->var, want->weights[net]->var, want->graph[net].n_stats * sizeof(float));
        }
        ggn_model_destroy(want);
        ggn_model_destroy(got);
    }
    (void)state;
}

/* Loads a changed copy; it must fail with a message that holds `expected`. */
static void refuse(const char *data, size_t size, const char *expected)
{
    struct ggn_model *m = NULL;
    struct base_err err = {0};
    int rc = ggn_model_load_memory("m.ggn", data, size, &m, &err);

    assert_int_equal(rc, BASE_EINVAL);
    assert_null(m);
    assert_null(strchr(err.text, '\n'));
    if (!strstr(err.text, "m.ggn: ") || !strstr(err.text, expected))
        fail_msg("message '%s' does not say '%s'", err.text, expected);
}

static void read_all(char **data, size_t *size)
{
    save(GGN_F32);
    assert_int_equal(base_file_read(path, 1 << 24, data, size, NULL), 0);
}

static uint64_t fnv(const char *p, size_t size)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++)
        h = (h ^ (unsigned char)(i >= 48 && i < 56 ? 0 : p[i])) * 0x100000001b3u;
    return h;
}

/* Puts the right checksum on a forged file. */
static void mend(char *p, size_t size)
{
    uint64_t h = fnv(p, size);
    for (int i = 0; i < 8; i++)
        p[48 + i] = (char)(h >> 8 * i);
}

static void test_truncated(void **state)
{
    char *data;
    size_t size;

    read_all(&data, &size);
    for (size_t n = 0; n < size; n += n < 256 ? 1 : 997)
        refuse(data, n, n < 64 ? "not a .ggn file" : "truncated");
    free(data);
    (void)state;
}

static void test_bit_flips(void **state)
{
    char *data;
    size_t size;

    read_all(&data, &size);
    for (size_t bit = 0; bit < 8 * size; bit += bit < 4096 ? 1 : 2311) {
        data[bit / 8] = (char)(data[bit / 8] ^ (1 << bit % 8));
        refuse(data, size, "");
        data[bit / 8] = (char)(data[bit / 8] ^ (1 << bit % 8));
    }
    free(data);
    (void)state;
}

/* Replaces the first `from` by `to` of the same length and mends the checksum. */
static void forge(const char *from, const char *to, const char *expected)
{
    char *data;
    size_t size, n = strlen(from);

    read_all(&data, &size);
    for (size_t i = 0; i + n <= size; i++)
        if (!memcmp(data + i, from, n)) {
            memcpy(data + i, to, n);
            break;
        }
    mend(data, size);
    refuse(data, size, expected);
    free(data);
}

/* A model that takes the noise picture says so in its file, and a file that says so of other networks is refused. */
static void test_picture(void **state)
{
    struct base_err err = {0};
    struct ggn_hyper published = ggn_hyper_default(GGN_PRESET_PAPER);

    small.picture = 1;
    forge("\"picture\":\t1", "\"picture\":\t0", "does not have the shape");
    forge("\"picture\":\t1", "\"picture\":\t7", "'picture' is missing or not a number in 0..1");
    struct ggn_model *m = make(), *read = NULL;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, NULL), 0);
    assert_int_equal(ggn_model_load(path, &read, &err), 0);
    assert_int_equal(read->hyper.picture, 1);
    assert_int_equal(read->graph[GGN_NET_D].value[0].c, 4);
    ggn_model_destroy(m);
    ggn_model_destroy(read);
    small.picture = 0;
    published.picture = 1;
    assert_int_equal(ggn_hyper_check(&published, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "picture"));
    (void)state;
}

static void test_forged(void **state)
{
    char *data;
    size_t size;

    forge("\"k_r\":\t1", "\"k_r\":\t9", "too small");
    forge("\"k_m\":\t2", "\"k_m\":\t1", "does not have the shape");
    forge("\"k_d\":\t1", "\"k_d\":\t0", "k_d");
    forge("\"preset\":\t\"lull\"", "\"preset\":\t\"loud\"", "preset");
    forge("\"threshold\":\t0.3", "\"threshold\":\t7.3", "threshold");
    forge("\"kind\":\t\"model\"", "\"kind\":\t\"modem\"", "not a model");
    forge("\"consecutive\":\t3", "\"consecutive\":\t[", "JSON");
    forge("denoiser/enc0.0.weight", "denoiser/enc0.9.weight", "missing");
    read_all(&data, &size);
    data[8] = 2;
    mend(data, size);
    refuse(data, size, "version 2");
    free(data);
    for (int at = 24; at < 48; at += 8) { /* offsets and sizes near 2^64 */
        read_all(&data, &size);
        memset(data + at, 0xff, 8);
        mend(data, size);
        refuse(data, size, "outside");
        free(data);
    }
    for (int at = 64 + 48; at < 64 + 88; at += 4) { /* type, rank, dimensions, offset and size of the first tensor */
        read_all(&data, &size);
        memset(data + at, 0xff, 4);
        mend(data, size);
        refuse(data, size, "tensor");
        free(data);
    }
    (void)state;
}

static void test_not_finite(void **state)
{
    struct ggn_model *m = make(), *got = NULL;
    struct base_err err = {0};

    m->weights[GGN_NET_M]->params[3] = NAN;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, &err), 0);
    assert_int_equal(ggn_model_load(path, &got, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "not finite"));
    m->weights[GGN_NET_M]->params[3] = 0;
    m->weights[GGN_NET_M]->var[0] = -1;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, &err), 0);
    assert_int_equal(ggn_model_load(path, &got, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "negative"));
    ggn_model_destroy(m);
    (void)state;
}

/* What a narrower type cannot hold is refused, and the old file stays. */
static void test_too_large(void **state)
{
    struct ggn_model *m = make(), *got = NULL;
    struct base_err err = {0};

    assert_int_equal(ggn_model_save(m, path, GGN_F32, &err), 0);
    m->weights[GGN_NET_M]->params[3] = 65504.0f;
    assert_int_equal(ggn_model_save(m, path, GGN_F16, &err), 0);
    assert_int_equal(ggn_model_load(path, &got, &err), 0);
    ggn_model_destroy(got);
    m->weights[GGN_NET_M]->params[3] = -7e4f;
    assert_int_equal(ggn_model_save(m, path, GGN_F16, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "too large for f16"));
    assert_int_equal(ggn_model_load(path, &got, &err), 0);
    ggn_model_destroy(got);
    m->weights[GGN_NET_M]->params[3] = 3.4e38f;
    assert_int_equal(ggn_model_save(m, path, GGN_BF16, &err), BASE_EINVAL);
    assert_int_equal(ggn_model_save(m, path, GGN_F32, &err), 0);
    ggn_model_destroy(m);
    (void)state;
}

/* A failed write keeps the old file; a missing file is named. */
static void test_paths(void **state)
{
    struct ggn_model *m = make(), *got = NULL;
    struct base_err err = {0};

    assert_true(ggn_model_save(m, "/nonexistent/m.ggn", GGN_F32, &err) < 0);
    assert_true(ggn_model_load("/nonexistent/m.ggn", &got, &err) < 0);
    assert_non_null(strstr(err.text, "/nonexistent/m.ggn"));
    ggn_model_destroy(m);
    (void)state;
}

static void test_half_floats(void **state)
{
    for (uint32_t h = 0; h < 65536; h++) {
        float f = base_f16_to_f32((uint16_t)h), b = base_bf16_to_f32((uint16_t)h);
        if (!isnan(f))
            assert_int_equal(base_f32_to_f16(f), h);
        else
            assert_true(isnan(base_f16_to_f32(base_f32_to_f16(f))));
        if (!isnan(b))
            assert_int_equal(base_f32_to_bf16(b), h);
        else
            assert_true(isnan(base_bf16_to_f32(base_f32_to_bf16(b))));
    }
    assert_true(base_f16_to_f32(base_f32_to_f16(1.0f + 1.0f / 2048)) == 1.0f); /* tie to even */
    assert_true(base_f16_to_f32(base_f32_to_f16(1.0f + 3.0f / 2048)) == 1.0f + 1.0f / 512);
    assert_true(isinf(base_f16_to_f32(base_f32_to_f16(65520.0f))));
    assert_true(base_bf16_to_f32(base_f32_to_bf16(1.0f + 1.0f / 256)) == 1.0f);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_round_trip), cmocka_unit_test(test_truncated),
                                       cmocka_unit_test(test_bit_flips),  cmocka_unit_test(test_forged),
                                       cmocka_unit_test(test_not_finite), cmocka_unit_test(test_too_large),
                                       cmocka_unit_test(test_paths),      cmocka_unit_test(test_half_floats),
                                       cmocka_unit_test(test_picture)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
