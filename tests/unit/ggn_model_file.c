/* Model files: what is written is read back, in every type; damage of every kind is one line and BASE_EINVAL. */
#include "support/ggn_cmocka.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "model/container.h"
#include "sight/measure.h"
#include "model/model.h"
#include "base/bytes.h"

static char path[] = "/tmp/ggn_model.XXXXXX";
static struct ggn_hyper small = {GGN_PRESET_LULL, 16, 17, 2, 1, 2, 1, 0, 0, 0};

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
    m->policy.scale = 1.5;
    m->policy.shift = -0.25;
    m->policy.threshold = 0.3;
    m->policy.passes = 3;
    m->policy.ratio = 1.25;
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
        assert_true(got->policy.scale == 1.5 && got->policy.shift == -0.25 && got->policy.threshold == 0.3);
        assert_true(got->policy.passes == 3 && got->policy.ratio == 1.25 && got->policy.first_spp == 20);
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

static int parse_copy(struct ggn_container *c, const char *name, const void *data, size_t size, struct base_err *err)
{
    char *copy = malloc(size + 1);

    assert_non_null(copy);
    memcpy(copy, data, size);
    return ggn_container_parse(c, name, copy, size, err);
}

/* Loads a changed copy; it must fail with a message that holds `expected`. */
static void refuse(const char *data, size_t size, const char *expected)
{
    struct ggn_model *m = NULL;
    struct ggn_container c;
    struct base_err err = {0};
    int rc = parse_copy(&c, "m.ggn", data, size, &err);

    if (!rc)
        rc = ggn_model_parse(&c, "m.ggn", &m, &err);
    ggn_container_release(&c);
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

/* A residual model says so, too. */
static void test_residual(void **state)
{
    struct base_err err = {0};
    struct ggn_hyper published = ggn_hyper_default(GGN_PRESET_PAPER);

    small.reach = 0.5;
    small.scalars = GGN_SCALARS;
    forge("\"scalars\":\t7", "\"scalars\":\t0", "does not have the shape");
    forge("\"scalars\":\t7", "\"scalars\":\t3", "hyper-parameter scalars");
    forge("\"scalars\":\t7", "\"scalars\":\t9", "'scalars' is missing or not a number in 0..7");
    forge("\"residual\":\t0.5", "\"residual\":\t9.5", "'residual' is missing or not a number in 0..4");
    forge("\"residual\":\t0.5", "\"residual\":\t0.0", "hyper-parameter scalars");
    struct ggn_model *m = make(), *read = NULL;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, NULL), 0);
    assert_int_equal(ggn_model_load(path, &read, &err), 0);
    assert_true(read->hyper.reach == 0.5 && read->hyper.scalars == GGN_SCALARS);
    assert_int_equal(read->graph[GGN_NET_D].value[GGN_D_SCALARS].c, GGN_SCALARS);
    ggn_model_destroy(m);
    ggn_model_destroy(read);
    small.reach = 0;
    small.scalars = 0;
    published.reach = 0.5;
    assert_int_equal(ggn_hyper_check(&published, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "residual"));
    (void)state;
}

/* A model that takes the noise map says so in its file, and a file that says so of other networks is refused. */
static void test_picture(void **state)
{
    struct base_err err = {0};
    struct ggn_hyper published = ggn_hyper_default(GGN_PRESET_PAPER);

    small.noise_map = 1;
    forge("\"picture\":\t1", "\"picture\":\t0", "does not have the shape");
    forge("\"picture\":\t1", "\"picture\":\t7", "'picture' is missing or not a number in 0..1");
    struct ggn_model *m = make(), *read = NULL;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, NULL), 0);
    assert_int_equal(ggn_model_load(path, &read, &err), 0);
    assert_int_equal(read->hyper.noise_map, 1);
    assert_int_equal(read->graph[GGN_NET_D].value[0].c, 4);
    ggn_model_destroy(m);
    ggn_model_destroy(read);
    small.noise_map = 0;
    published.noise_map = 1;
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

/* --- the container, byte by byte ------------------------------------------------------------------------------------------ */

enum { AT_ENTRY = 64, ENTRY_SIZE = 88, AT_JSON = AT_ENTRY + 3 * ENTRY_SIZE, AT_DATA = 384, BYTES = AT_DATA + 3 * 64 };
static const char json[] = "{\"a\":1}", long_name[] = "a-name-of-47-characters-which-is-as-long-as-may";

static void put(unsigned char *at, int bytes, uint64_t value)
{
    for (int i = 0; i < bytes; i++)
        at[i] = (unsigned char)(value >> 8 * i);
}

static void put_entry(unsigned char *at, const char *name, const uint32_t numbers[6], uint64_t offset, uint64_t size)
{
    memcpy(at, name, strlen(name));
    for (int i = 0; i < 6; i++)
        put(at + 48 + 4 * i, 4, numbers[i]);
    put(at + 72, 8, offset);
    put(at + 80, 8, size);
}

/* The file that model/container.h describes, of three tensors. */
static void by_hand(unsigned char file[BYTES])
{
    static const uint32_t single[] = {0x3f800000, 0xc0000000, 0x00000000, 0x7f7fffff, 0x00000001, 0x3eaaaaab};
    static const uint16_t half[] = {0x3c00, 0xbc00, 0x7bff}, brain[] = {0x3f80, 0xc000, 0x4049, 0x7f7f};

    memset(file, 0, BYTES);
    memcpy(file, "LULLGGN\n", 8);
    put(file + 8, 4, 1);
    put(file + 12, 4, 3);
    put(file + 16, 8, BYTES);
    put(file + 24, 8, AT_JSON);
    put(file + 32, 8, sizeof json - 1);
    put(file + 40, 8, AT_ENTRY);
    put_entry(file + AT_ENTRY, "a/one", (uint32_t[]){0, 2, 2, 3, 1, 1}, AT_DATA, 24);
    put_entry(file + AT_ENTRY + ENTRY_SIZE, "two", (uint32_t[]){1, 1, 3, 1, 1, 1}, AT_DATA + 64, 6);
    put_entry(file + AT_ENTRY + 2 * ENTRY_SIZE, long_name, (uint32_t[]){2, 4, 1, 2, 1, 2}, AT_DATA + 128, 8);
    memcpy(file + AT_JSON, json, sizeof json - 1);
    for (int i = 0; i < 6; i++)
        put(file + AT_DATA + 4 * i, 4, single[i]);
    for (int i = 0; i < 3; i++)
        put(file + AT_DATA + 64 + 2 * i, 2, half[i]);
    for (int i = 0; i < 4; i++)
        put(file + AT_DATA + 128 + 2 * i, 2, brain[i]);
    mend((char *)file, BYTES);
}

static void test_layout(void **state)
{
    static const float one[] = {1, -2, 0, 3.40282347e38f, 1.40129846e-45f, 1.0f / 3}, two[] = {1, -1, 65504};
    const float three[] = {1, -2, base_bf16_to_f32(0x4049), base_bf16_to_f32(0x7f7f)};
    unsigned char want[BYTES];
    struct ggn_container c = {.json = strdup(json)};
    float read[6];
    char *file;
    size_t size;

    by_hand(want);
    assert_int_equal(ggn_container_add(&c, "a/one", GGN_F32, 2, (int[]){2, 3}, one, NULL), 0);
    assert_int_equal(ggn_container_add(&c, "two", GGN_F16, 1, (int[]){3}, two, NULL), 0);
    assert_int_equal(ggn_container_add(&c, long_name, GGN_BF16, 4, (int[]){1, 2, 1, 2}, three, NULL), 0);
    assert_int_equal(ggn_container_write(&c, path, NULL), 0);
    ggn_container_release(&c);
    assert_true(!c.entry && !c.json && !c.data && c.n_entries == 0 && c.size == 0);
    assert_int_equal(base_file_read(path, 1 << 20, &file, &size, NULL), 0);
    assert_int_equal(size, BYTES);
    assert_memory_equal(file, want, BYTES);
    free(file);
    assert_int_equal(parse_copy(&c, "n", want, BYTES, NULL), 0);
    assert_string_equal(c.json, json);
    assert_true(c.n_entries == 3 && c.entry[2].rank == 4 && c.entry[2].count == 4 && c.entry[2].type == GGN_BF16);
    assert_int_equal(ggn_container_get(&c, "a/one", 2, (int[]){2, 3}, read, NULL), 0);
    assert_memory_equal(read, one, sizeof one);
    assert_int_equal(ggn_container_get(&c, "two", 1, (int[]){3}, read, NULL), 0);
    assert_memory_equal(read, two, sizeof two);
    assert_int_equal(ggn_container_get(&c, long_name, 4, (int[]){1, 2, 1, 2}, read, NULL), 0);
    assert_memory_equal(read, three, sizeof three);
    struct base_err err = {0};
    assert_int_equal(ggn_container_get(&c, "three", 1, (int[]){3}, read, &err), BASE_EINVAL);
    assert_string_equal(err.text, "tensor 'three' is missing");
    static const int shapes[][4] = {{1, 6, 1, 1}, {2, 3, 2, 1}, {3, 2, 3, 1}};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(ggn_container_get(&c, "a/one", shapes[i][0], shapes[i] + 1, read, &err), BASE_EINVAL);
        assert_string_equal(err.text, "tensor 'a/one' does not have the shape that the network asks for");
    }
    ggn_container_release(&c);
    (void)state;
}

/* The file with `bytes` of `value` at `at`: refused with this line, or read ("" ). */
static void parsed(int at, int bytes, uint64_t value, const char *want)
{
    unsigned char file[BYTES];
    struct ggn_container c;
    struct base_err err = {0};

    by_hand(file);
    put(file + at, bytes, value);
    if (at != 48)
        mend((char *)file, BYTES);
    int rc = parse_copy(&c, "n", file, BYTES, &err);
    assert_int_equal(rc, *want ? BASE_EINVAL : 0);
    assert_string_equal(err.text, want);
    assert_true(!rc || (!c.data && !c.entry && !c.json));
    ggn_container_release(&c);
}

static void test_refused_containers(void **state)
{
    static const char shape[] = "n: tensor 'a/one' has an impossible shape",
                      outside[] = "n: tensor 'a/one' lies outside of the file";
    static const char kind[] = "n: tensor 'a/one' has an unknown type or rank",
                      table[] = "n: the tensor table lies outside of the file";
    static const char description[] = "n: the description lies outside of the file";
    const int e = AT_ENTRY;

    parsed(0, 1, 'l', "n: not a .ggn file");
    parsed(8, 4, 0, "n: .ggn version 0; this program reads version 1");
    parsed(16, 8, BYTES + 1, "n: truncated: the header says 577 bytes, the file has 576");
    parsed(16, 8, BYTES - 1, "n: too long: the header says 575 bytes, the file has 576");
    parsed(48, 1, 0, "n: damaged (checksum does not match)");
    parsed(56, 8, 7, "");
    parsed(24, 8, BYTES + 1, description);
    parsed(24, 8, BYTES - 7, "");
    parsed(24, 8, BYTES - 6, description);
    parsed(32, 8, BYTES - AT_JSON, "");
    parsed(32, 8, BYTES - AT_JSON + 1, description);
    parsed(32, 8, (1 << 20) + 1, description);
    parsed(12, 4, 4097, table);
    parsed(12, 4, 0, "");
    parsed(40, 8, BYTES + 1, table);
    parsed(40, 8, BYTES - 3 * ENTRY_SIZE + 1, table);
    parsed(e + 48, 4, 3, kind);
    parsed(e + 52, 4, 0, kind);
    parsed(e + 52, 4, 5, kind);
    parsed(e + 52, 4, 1, shape); /* a second dimension that counts, in a vector */
    parsed(e + 52, 4, 4, "");
    parsed(e + 56, 4, 0, shape);
    parsed(e + 64, 4, 2, shape);
    parsed(e + 56, 4, 0xffffffff, shape); /* more than 4 GiB of numbers */
    parsed(e + 56, 4, 3, outside);
    parsed(e + 72, 8, AT_DATA + 1, outside);
    parsed(e + 72, 8, AT_DATA + 32, outside);
    parsed(e + 72, 8, BYTES - 64, "");
    parsed(e + 72, 8, BYTES, outside);
    parsed(e + 72, 8, BYTES + 64, outside);
    parsed(e + 80, 8, 23, outside);
    parsed(e + 80, 8, 25, outside);
    parsed(e, 1, '\n', "");
    parsed(e + 40, 8, ~UINT64_C(0), "");
    (void)state;
}

/* A description of a mebibyte is read, one of a byte more is not. */
static void test_longest_description(void **state)
{
    const size_t most = 1 << 20;
    unsigned char *file = calloc(1, 64 + most + 1);
    struct ggn_container c;
    struct base_err err = {0};

    for (size_t more = 0; more < 2; more++) {
        memcpy(file, "LULLGGN\n", 8);
        put(file + 8, 4, 1);
        put(file + 16, 8, 64 + most + more);
        put(file + 24, 8, 64);
        put(file + 32, 8, most + more);
        put(file + 40, 8, 64);
        mend((char *)file, 64 + most + more);
        assert_int_equal(parse_copy(&c, "n", file, 64 + most + more, &err), more ? BASE_EINVAL : 0);
        ggn_container_release(&c);
    }
    assert_string_equal(err.text, "n: the description lies outside of the file");
    free(file);
    (void)state;
}

/* A name of 48 bytes is cut, what is no character of ASCII becomes a question mark, and a value must be a number. */
static void test_names_and_values(void **state)
{
    unsigned char file[BYTES];
    struct ggn_container c;
    struct base_err err = {0};
    float read[6];

    by_hand(file);
    memcpy(file + AT_ENTRY, "\x1f \x7e\x7f\x80", 5);
    memset(file + AT_ENTRY + ENTRY_SIZE, 'n', 48);
    put(file + AT_DATA + 12, 4, 0x7f800000);
    mend((char *)file, BYTES);
    assert_int_equal(parse_copy(&c, "n", file, BYTES, &err), 0);
    assert_string_equal(c.entry[0].name, "? ~??");
    assert_int_equal(strlen(c.entry[1].name), 47);
    assert_int_equal(ggn_container_get(&c, "? ~??", 2, (int[]){2, 3}, read, &err), BASE_EINVAL);
    assert_string_equal(err.text, "tensor '? ~\?\?' holds a value that is not finite");
    ggn_container_release(&c);
    const float large = 70000;
    struct ggn_container w = {.json = strdup(json)};
    assert_int_equal(ggn_container_add(&w, "x", GGN_F16, 1, (int[]){1}, &large, NULL), 0);
    assert_int_equal(ggn_container_write(&w, path, &err), BASE_EINVAL);
    assert_string_equal(err.text, "tensor 'x' has a value of 70000, too large for f16");
    ggn_container_release(&w);
    (void)state;
}

/* --- the description ------------------------------------------------------------------------------------------------------ */

static const char described[] =
    "{\"kind\":\"model\",\"preset\":\"lull\",\"height\":16,\"width\":17,\"window\":2,\"k_r\":3,\"k_m\":4,\"k_d\":5,"
    "\"picture\":1,\"calibration\":{\"scale\":2,\"shift\":-1,\"threshold\":0.25,\"spacing\":1.5,"
    "\"consecutive\":3},\"provenance\":{\"seed\":7}}";

/* The description with one text for another: what parsing says ("": it reads it). */
static void describe(const char *from, const char *to, const char *want)
{
    char text[512];
    const char *hit = strstr(described, from);
    struct ggn_description d;
    struct base_err err = {0};

    assert_non_null(hit);
    snprintf(text, sizeof text, "%.*s%s%s", (int)(hit - described), described, to, hit + strlen(from));
    int rc = ggn_description_parse(text, &d, &err);
    assert_string_equal(err.text, want);
    assert_int_equal(rc, *want ? BASE_EINVAL : 0);
    if (!rc)
        cJSON_Delete(d.provenance);
}

static void test_descriptions(void **state)
{
    struct ggn_description d;

    assert_int_equal(ggn_description_parse(described, &d, NULL), 0);
    assert_true(d.hyper.preset == GGN_PRESET_LULL && d.hyper.height == 16 && d.hyper.width == 17 && d.hyper.window == 2);
    assert_true(d.hyper.k_r == 3 && d.hyper.k_m == 4 && d.hyper.k_d == 5 && d.hyper.noise_map == 1);
    assert_true(d.policy.scale == 2 && d.policy.shift == -1 && d.policy.threshold == 0.25);
    assert_true(d.policy.ratio == 1.5 && d.policy.passes == 3);
    char *text = ggn_description_print(&d), *flat = calloc(strlen(text) + 1, 1);
    for (char *from = text, *to = flat; *from; from++)
        if (!strchr("\n\t ", *from))
            *to++ = *from;
    assert_string_equal(flat, described);
    free(text);
    free(flat);
    cJSON_Delete(d.provenance);
    describe("\"lull\"", "\"paper\"", "");
    describe("\"lull\"", "\"Lull\"", "'preset' is neither \"paper\" nor \"lull\"");
    describe("\"lull\"", "1", "'preset' is neither \"paper\" nor \"lull\"");
    describe("\"model\"", "\"models\"", "not a model (its description has no \"kind\": \"model\")");
    describe("\"kind\"", "\"Kind\"", "not a model (its description has no \"kind\": \"model\")");
    describe("{\"kind\"", "{kind", "the description is not JSON");
    describe("\"height\":16", "\"height\":1", "");
    describe("\"height\":16", "\"height\":0", "'height' is missing or not a number in 1..1.04858e+06");
    describe("\"k_d\":5", "\"k_d\":1048576", "");
    describe("\"k_d\":5", "\"k_d\":1048577", "'k_d' is missing or not a number in 1..1.04858e+06");
    describe("\"width\":17", "\"wide\":17", "'width' is missing or not a number in 1..1.04858e+06");
    describe("\"window\":2", "\"window\":2.5", "'window' is not a whole number");
    describe("\"picture\":1", "\"picture\":0", "");
    describe("\"picture\":1", "\"pictures\":9", "");
    describe("\"picture\":1", "\"picture\":2", "'picture' is missing or not a number in 0..1");
    describe("\"picture\":1", "\"picture\":-1", "'picture' is missing or not a number in 0..1");
    describe("\"scale\":2", "\"scale\":-1e6", "");
    describe("\"scale\":2", "\"scale\":1.1e6", "'scale' is missing or not a number in -1e+06..1e+06");
    describe("\"shift\":-1", "\"shift\":1e6", "");
    describe("\"shift\":-1", "\"shift\":-1.1e6", "'shift' is missing or not a number in -1e+06..1e+06");
    describe("\"threshold\":0.25", "\"threshold\":0", "");
    describe("\"threshold\":0.25", "\"threshold\":1", "");
    describe("\"threshold\":0.25", "\"threshold\":1.1", "'threshold' is missing or not a number in 0..1");
    describe("\"threshold\":0.25", "\"threshold\":\"0\"", "'threshold' is missing or not a number in 0..1");
    describe("\"spacing\":1.5", "\"spacing\":1", "");
    describe("\"spacing\":1.5", "\"spacing\":16", "");
    describe("\"spacing\":1.5", "\"spacing\":0.99", "'spacing' is missing or not a number in 1..16");
    describe("\"spacing\":1.5", "\"spacing\":16.1", "'spacing' is missing or not a number in 1..16");
    describe("\"consecutive\":3", "\"consecutive\":16", "");
    describe("\"consecutive\":3", "\"consecutive\":17", "'consecutive' is missing or not a number in 1..16");
    describe("\"consecutive\":3", "\"consecutive\":0", "'consecutive' is missing or not a number in 1..16");
    describe("{\"seed\":7}", "[]", "'provenance' is not an object");
    describe(",\"provenance\":{\"seed\":7}", "", "");
    (void)state;
}

/* Whole lines of what a model of these networks cannot be. */
static void test_refused_models(void **state)
{
    struct ggn_model *m = make(), *got = NULL;
    struct base_err err = {0};
    char want[160];

    m->weights[GGN_NET_D]->var[2] = -1e-9f;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, &err), 0);
    assert_int_equal(ggn_model_load(path, &got, &err), BASE_EINVAL);
    snprintf(want, sizeof want, "%s: a running variance of the discriminator is negative", path);
    assert_string_equal(err.text, want);
    m->weights[GGN_NET_D]->var[2] = 0;
    assert_int_equal(ggn_model_save(m, path, GGN_F32, &err), 0);
    assert_int_equal(ggn_model_load(path, &got, &err), 0);
    /* a tensor too many */
    struct ggn_container c = {0}, more = {0};
    assert_int_equal(ggn_container_read(&c, path, NULL), 0);
    more.json = strdup(c.json);
    for (int i = 0; i <= c.n_entries; i++) {
        const struct ggn_entry *e = &c.entry[i < c.n_entries ? i : 0];
        const int dim[] = {(int)e->dim[0], (int)e->dim[1], (int)e->dim[2], (int)e->dim[3]};
        const float *values = (const float *)(const void *)(c.data + e->offset);
        assert_int_equal(ggn_container_add(&more, i < c.n_entries ? e->name : "more", GGN_F32, e->rank, dim, values, NULL),
                         0);
    }
    assert_int_equal(ggn_container_write(&more, path, NULL), 0);
    snprintf(want, sizeof want, "%s: %d tensors where the networks have %d", path, c.n_entries + 1, c.n_entries);
    ggn_container_release(&c);
    ggn_container_release(&more);
    ggn_model_destroy(got);
    got = NULL;
    assert_int_equal(ggn_model_load(path, &got, &err), BASE_EINVAL);
    assert_string_equal(err.text, want);
    assert_null(got);
    ggn_model_destroy(m);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_round_trip),
                                       cmocka_unit_test(test_truncated),
                                       cmocka_unit_test(test_bit_flips),
                                       cmocka_unit_test(test_forged),
                                       cmocka_unit_test(test_not_finite),
                                       cmocka_unit_test(test_too_large),
                                       cmocka_unit_test(test_paths),
                                       cmocka_unit_test(test_half_floats),
                                       cmocka_unit_test(test_picture),
                                       cmocka_unit_test(test_residual),
                                       cmocka_unit_test(test_layout),
                                       cmocka_unit_test(test_refused_containers),
                                       cmocka_unit_test(test_names_and_values),
                                       cmocka_unit_test(test_longest_description),
                                       cmocka_unit_test(test_descriptions),
                                       cmocka_unit_test(test_refused_models)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
