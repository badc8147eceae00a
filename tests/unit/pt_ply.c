/* PLY: the three formats, extra properties, quads, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "pbrt/ply.h"

static const char ascii[] =
    "ply\nformat ascii 1.0\ncomment two faces\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nproperty float s\nproperty float t\nelement face 2\n"
    "property uchar flag\nproperty list uchar int vertex_index\nend_header\n"
    "0 0 0 255 0 0\n1 0 0 255 1 0\n1 1 0.5 255 1 1\n0 1 0 255 0 1\n7 4 0 1 2 3\n7 3 0 1 2\n";

static void check(const struct pt_ply *p)
{
    static const uint32_t expected[9] = {0, 1, 2, 0, 2, 3, 0, 1, 2};
    assert_int_equal(p->vertex_count, 4);
    assert_int_equal(p->triangle_count, 3);
    assert_memory_equal(p->indices, expected, sizeof expected);
    assert_true(p->positions[3 * 2 + 2] == 0.5f && p->uvs[2 * 2] == 1 && p->uvs[2 * 1 + 1] == 0);
    assert_null(p->normals);
}

static void reads_ascii(void **state)
{
    (void)state;
    struct pt_ply ply;
    struct base_err err = {0};
    assert_int_equal(pt_ply_parse("a.ply", ascii, sizeof ascii - 1, &ply, &err), 0);
    check(&ply);
    pt_ply_release(&ply);
}

static size_t put(char *out, size_t at, const void *value, size_t n, int swap)
{
    for (size_t i = 0; i < n; i++)
        out[at + i] = ((const char *)value)[swap ? n - 1 - i : i];
    return at + n;
}

static size_t binary(char *out, int big)
{
    static const float v[4][5] = {{0, 0, 0, 0, 0}, {1, 0, 0, 1, 0}, {1, 1, 0.5f, 1, 1}, {0, 1, 0, 0, 1}};
    static const int32_t faces[7] = {0, 1, 2, 3, 0, 1, 2};
    const char *end = strstr(ascii, "end_header\n") + 11;
    char header[1024];
    snprintf(header, sizeof header, "%.*s", (int)(end - ascii), ascii);
    char *format = strstr(header, "ascii");
    size_t n = (size_t)snprintf(out, 1024, "%.*s%s%s", (int)(format - header), header,
                                big ? "binary_big_endian" : "binary_little_endian", format + 5);
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 5; k++) {
            if (k == 3)
                out[n++] = (char)255;
            n = put(out, n, &v[i][k], 4, big);
        }
    for (int f = 0, at = 0; f < 2; f++) {
        int corners = f == 0 ? 4 : 3;
        out[n++] = 7;
        out[n++] = (char)corners;
        for (int k = 0; k < corners; k++)
            n = put(out, n, &faces[at++], 4, big);
    }
    return n;
}

static void reads_binary(void **state)
{
    (void)state;
    char bytes[2048];
    for (int big = 0; big < 2; big++) {
        size_t n = binary(bytes, big);
        struct pt_ply ply;
        struct base_err err = {0};
        if (pt_ply_parse("b.ply", bytes, n, &ply, &err) != 0)
            fail_msg("%s", err.text);
        check(&ply);
        pt_ply_release(&ply);
        /* Any cut is noticed. */
        for (size_t cut = 0; cut < n; cut++)
            assert_int_equal(pt_ply_parse("b.ply", bytes, cut, &ply, &err), BASE_EINVAL);
    }
}

/* They are not read, and that can be said. */
static void texture_coordinates_per_corner(void **state)
{
    (void)state;
    static const char text[] =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float %s\n"
        "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n";
    static const char *const names[] = {"texcoord", "texcoords", "weights"};
    for (int i = 0; i < 3; i++) {
        char bytes[512];
        struct pt_ply ply;
        struct base_err err = {0};
        int n = snprintf(bytes, sizeof bytes, text, names[i]);
        assert_int_equal(pt_ply_parse("a.ply", bytes, (size_t)n, &ply, &err), 0);
        assert_true(ply.triangle_count == 1 && !ply.uvs && ply.corner_uvs == (i < 2));
        pt_ply_release(&ply);
    }
}

static const char xyz[] = "property float x\nproperty float y\nproperty float z\n",
                  face[] = "element face 1\nproperty list uchar int vertex_indices\n";

/* One triangle: what the text gives, or why not. */
static int triangle(const char *text, size_t n, struct pt_ply *ply, char words[512])
{
    struct base_err err = {0};
    int rc = pt_ply_parse("a.ply", text, n, ply, &err);
    snprintf(words, 512, "%s", err.text);
    if (rc)
        return rc;
    const int is_one = ply->vertex_count == 3 && ply->triangle_count == 1 && ply->indices[2] == 2 && ply->positions[3] == 1;
    assert_true(is_one);
    return 0;
}

/* What other programs write beside the usual. */
static void habits_of_exporters(void **state)
{
    (void)state;
    static const char vertices[] = "0 0 0\n1 0 0\n0 1 0\n";
    char bytes[4096], words[512];
    struct pt_ply ply;
    int n = snprintf(bytes, sizeof bytes, "ply\nformat ascii 1.0\n%selement vertex 3\n%send_header\n3 0 1 2\n%s", face, xyz,
                     vertices); /* elements may stand in any order */
    assert_int_equal(triangle(bytes, (size_t)n, &ply, words), 0);
    pt_ply_release(&ply);
    n = snprintf(bytes, sizeof bytes, "ply\nformat ascii 1.0\n%selement vertex 3\n%send_header\n3 0 1 3\n%s", face, xyz,
                 vertices);
    assert_int_equal(triangle(bytes, (size_t)n, &ply, words), BASE_EINVAL);
    assert_string_equal(words, "a.ply: vertex index 3 out of range (expected 0 to 2)");
    /* a second element of that name, even without properties, is no larger range */
    n = snprintf(bytes, sizeof bytes,
                 "ply\nformat ascii 1.0\nelement vertex 3\n%s%selement vertex 9\nend_header\n%s3 0 1 8\n", xyz, face,
                 vertices);
    assert_int_equal(triangle(bytes, (size_t)n, &ply, words), BASE_EINVAL);
    assert_string_equal(words, "a.ply: PLY element \"vertex\" occurs twice");
    /* normals of Microsoft's C library */
    n = snprintf(bytes, sizeof bytes,
                 "ply\nformat ascii 1.0\nelement vertex 3\n%sproperty float nx\nproperty float ny\nproperty float nz\n%s"
                 "end_header\n0 0 0 -1.#IND 1.#QNAN 1.#INF\n1 0 0 0 0 1\n0 1 0 -1.#IND00 0 1\n3 0 1 2\n",
                 xyz, face);
    assert_int_equal(triangle(bytes, (size_t)n, &ply, words), 0);
    assert_true(isnan(ply.normals[0]) && isnan(ply.normals[1]) && isnan(ply.normals[2]) && ply.normals[5] == 1);
    pt_ply_release(&ply);
    n = snprintf(bytes, sizeof bytes,
                 "ply\nformat ascii 1.0\nelement vertex 3\n%s%send_header\n0 0 1.#IND\n1 0 0\n0 1 0\n3 0 1 2\n", xyz, face);
    assert_int_equal(triangle(bytes, (size_t)n, &ply, words), BASE_EINVAL);
    assert_string_equal(words, "a.ply: vertex 0 is not finite");
}

/* Of old Macs; behind a binary header "\n" may be data. */
static void lines_that_end_in_cr(void **state)
{
    (void)state;
    static const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const int32_t corners[3] = {0, 1, 2};
    char bytes[1024], words[512];
    struct pt_ply ply;
    for (int is_binary = 0; is_binary < 2; is_binary++) {
        int n = snprintf(bytes, sizeof bytes, "ply\nformat %s 1.0\ncomment x\nelement vertex 3\n%s%send_header\n%s",
                         is_binary ? "binary_little_endian" : "ascii", xyz, face,
                         is_binary ? "" : "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
        for (int i = 0; i < n; i++)
            if (bytes[i] == '\n')
                bytes[i] = '\r';
        if (is_binary) {
            memcpy(bytes + n, positions, sizeof positions);
            bytes[n] = '\n'; /* a coordinate next to 0 */
            bytes[n + 36] = 3;
            memcpy(bytes + n + 37, corners, sizeof corners);
            n += 37 + 12;
        }
        if (triangle(bytes, (size_t)n, &ply, words) != 0)
            fail_msg("%s", words);
        pt_ply_release(&ply);
    }
}

/* Scanned points and their descriptors have many numbers each; a limit stays. */
static void many_properties(void **state)
{
    (void)state;
    static char bytes[1 << 16];
    char words[512];
    struct pt_ply ply;
    for (int count = 509; count <= 510; count++) {
        int n = snprintf(bytes, sizeof bytes, "ply\nformat ascii 1.0\nelement vertex 3\n%s", xyz);
        for (int i = 0; i < count; i++)
            n += snprintf(bytes + n, sizeof bytes - (size_t)n, "property float f_%d\n", i);
        n += snprintf(bytes + n, sizeof bytes - (size_t)n, "%send_header\n", face);
        for (int v = 0; v < 3; v++) {
            n += snprintf(bytes + n, sizeof bytes - (size_t)n, "%d %d 0", v == 1, v == 2);
            for (int i = 0; i < count; i++)
                n += snprintf(bytes + n, sizeof bytes - (size_t)n, " 7");
            n += snprintf(bytes + n, sizeof bytes - (size_t)n, "\n");
        }
        n += snprintf(bytes + n, sizeof bytes - (size_t)n, "3 0 1 2\n");
        const int rc = triangle(bytes, (size_t)n, &ply, words);
        assert_int_equal(rc, count == 509 ? 0 : BASE_EINVAL);
        if (rc)
            assert_string_equal(words, "a.ply: more than 512 PLY properties");
        else
            pt_ply_release(&ply);
    }
}

static size_t put_number(char *out, size_t at, int type, double v, int big)
{
    const int8_t i8 = (int8_t)v;
    const uint8_t u8 = (uint8_t)(int)v;
    const int16_t i16 = (int16_t)v;
    const uint16_t u16 = (uint16_t)(int)v;
    const int32_t i32 = (int32_t)v;
    const uint32_t u32 = (uint32_t)(int64_t)v;
    const float f32 = (float)v;
    const void *const from[] = {&i8, &u8, &i16, &u16, &i32, &u32, &f32, &v};
    static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return put(out, at, from[type], sizes[type], big);
}

/* A coordinate, the count of a list and its items may be of any type, in either order of bytes and by either name. */
static void numbers_of_every_type(void **state)
{
    (void)state;
    static const char *const names[2][8] = {{"char", "uchar", "short", "ushort", "int", "uint", "float", "double"},
                                            {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"}};
    static const double values[8] = {-100, 200, -30000, 60000, -2000000000, 4000000000.0, -1.5e30, 1.25e-30};
    for (int k = 0; k < 32; k++) {
        int type = k % 8, big = k / 8 % 2, name = k / 16;
        char bytes[1024];
        struct pt_ply ply;
        struct base_err err = {0};
        int indices = type < 6 ? type : 4;
        size_t n = (size_t)snprintf(
            bytes, sizeof bytes,
            "ply\r\nformat binary_%s_endian 1.0\nelement vertex 2\nproperty float x\nproperty %s y\nproperty float z\n"
            "property %s nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty %s v\nelement face 1\n"
            "property list %s %s vertex_index\nend_header\n",
            big ? "big" : "little", names[name][type], names[name][type], names[name][type], names[name][indices],
            names[name][indices]);
        for (int i = 0; i < 2; i++) {
            n = put_number(bytes, put_number(bytes, put_number(bytes, n, 6, 1 + i, big), type, values[type], big), 6, 3,
                           big);
            n = put_number(bytes, put_number(bytes, put_number(bytes, n, type, values[type], big), 6, 5, big), 6, 6, big);
            n = put_number(bytes, put_number(bytes, n, 6, 7, big), type, values[type], big);
        }
        n = put_number(bytes, n, indices, 3, big);
        for (int i = 0; i < 3; i++)
            n = put_number(bytes, n, indices, i == 1, big);
        if (pt_ply_parse("t.ply", bytes, n, &ply, &err) != 0)
            fail_msg("%s: %s", names[name][type], err.text);
        for (int i = 0; i < 2; i++) {
            const float v = (float)values[type], *p = ply.positions + 3 * i, *m = ply.normals + 3 * i;
            assert_true(p[0] == (float)(1 + i) && p[1] == v && p[2] == 3 && m[0] == v && m[1] == 5 && m[2] == 6);
            assert_true(ply.uvs[2 * i] == 7 && ply.uvs[2 * i + 1] == v);
        }
        assert_true(ply.triangle_count == 1 && ply.indices[0] == 0 && ply.indices[1] == 1 && ply.indices[2] == 0);
        pt_ply_release(&ply);
        assert_true(!ply.positions && ply.vertex_count == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_ascii),         cmocka_unit_test(texture_coordinates_per_corner),
        cmocka_unit_test(reads_binary),        cmocka_unit_test(numbers_of_every_type),
        cmocka_unit_test(habits_of_exporters), cmocka_unit_test(lines_that_end_in_cr),
        cmocka_unit_test(many_properties)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
