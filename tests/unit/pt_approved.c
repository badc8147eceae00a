/*
 * Small scenes and all that the loader makes of them: the files of tests/unit/pt_approved hold each scene's text and the recorded
 * answer, which is its warnings, then its one-line error or the whole renderable (support/approve.h says how to record).
 *
 * Options: strict, size=8x4, fov=, look-at=a,b,…, effects, power, only-warnings. The header (film … camera) is part of the answer of
 * scenes that do not begin with WorldBegin. Pictures named WxHxC.png exist with 8 bits, deep-WxHxC.png with 16; an alpha channel is
 * opaque in opaque-….
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

#include "support/approve.h"
#include "support/pt_dump.h"

/* --- files beside a scene --------------------------------------------------------------------------------------------- */

static size_t chunk(unsigned char *out, const char *type, const unsigned char *data, size_t n)
{
    const unsigned char length[4] = {(unsigned char)(n >> 24), (unsigned char)(n >> 16), (unsigned char)(n >> 8),
                                     (unsigned char)n};
    memcpy(out, length, 4);
    memcpy(out + 4, type, 4);
    memcpy(out + 8, data, n);
    uint32_t crc = (uint32_t)crc32(0, out + 4, (uInt)n + 4);
    for (size_t i = 0; i < 4; i++)
        out[8 + n + i] = (unsigned char)(crc >> (24 - 8 * i));
    return n + 12;
}

/* A PNG whose values run through the codes: k-th value 37 k + 11 modulo 256; the alpha of every pixel but the last is 255. */
static size_t make_png(const char *name, unsigned char *out)
{
    int deep = strncmp(name, "deep-", 5) == 0, opaque = strncmp(name, "opaque-", 7) == 0;
    unsigned width, height, channels;
    static const unsigned char colour[5] = {0, 0, 4, 2, 6};
    unsigned char rows[512], packed[1024];
    const char *digits = strpbrk(name, "0123456789");
    if (!digits || sscanf(digits, "%ux%ux%u.png", &width, &height, &channels) != 3)
        return 0;
    size_t n = 0, k = 0;
    for (unsigned y = 0; y < height; y++) {
        rows[n++] = 0;
        for (unsigned i = 0; i < width * channels; i++, k++) {
            int alpha = channels % 2 == 0 && i % channels == channels - 1, last = k + 1 == (size_t)width * height * channels;
            rows[n++] = alpha && (opaque || !last) ? 255 : (unsigned char)(37 * k + 11);
            if (deep)
                rows[n++] = alpha && !last ? 255 : 7;
        }
    }
    uLongf size = sizeof packed;
    assert_int_equal(compress(packed, &size, rows, n), Z_OK);
    const unsigned char head[13] = {
        0, 0, 0, (unsigned char)width, 0, 0, 0, (unsigned char)height, deep ? 16 : 8, colour[channels], 0, 0, 0};
    memcpy(out, "\x89PNG\r\n\x1a\n", 8);
    size_t at = 8 + chunk(out + 8, "IHDR", head, 13);
    at += chunk(out + at, "IDAT", packed, size);
    return at + chunk(out + at, "IEND", head, 0);
}

static int read_beside(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    const struct approve_case *c = data;
    unsigned char png[2048];
    const void *found = NULL;
    if (strcmp(path, "d/t.pbrt") == 0) {
        found = c->text;
        *size = strlen(c->text);
    }
    for (int i = 0; i < APPROVE_FILES && !found; i++)
        if (c->files[i].name[0] != '\0' && strncmp(path, "d/", 2) == 0 && strcmp(path + 2, c->files[i].name) == 0) {
            found = c->files[i].text;
            *size = strlen(c->files[i].text);
        }
    if (!found && strstr(path, ".png") && strncmp(path, "d/", 2) == 0 && (*size = make_png(path + 2, png)) > 0)
        found = png;
    if (!found)
        return base_fail(err, BASE_EIO, "%s: No such file or directory", path);
    *bytes = calloc(*size + 1, 1);
    if (!*bytes)
        return base_fail_nomem(err, path);
    memcpy(*bytes, found, *size);
    return 0;
}

/* --- the answer ------------------------------------------------------------------------------------------------------- */

static void read_options(const char *text, struct pt_load_options *o)
{
    const char *at;
    o->strict = strstr(text, "strict") != NULL;
    o->forced = strstr(text, "effects") ? PT_FX_ALL : 0;
    o->light_selection = strstr(text, "power") ? PT_LIGHT_SELECTION_POWER : PT_LIGHT_SELECTION_HIERARCHY;
    if ((at = strstr(text, "size=")) != NULL)
        assert_int_equal(sscanf(at, "size=%dx%d", &o->width, &o->height), 2);
    if ((at = strstr(text, "fov=")) != NULL)
        o->view.fov_deg = strtod(at + 4, NULL);
    if ((at = strstr(text, "look-at=")) != NULL) {
        char *end = (char *)(uintptr_t)(at + 7);
        for (int i = 0; i < 9; i++)
            o->view.look_at_world[i] = strtod(end + 1, &end);
        o->view.has_look_at = 1;
    }
}

/* malloc'ed */
static char *answer(struct approve_case *c)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    struct pt_source source = {read_beside, NULL, c, 0};
    struct base_log log = {.out = out};
    struct pt_load_options options = {.log = &log};
    struct pt_scene *scene = NULL;
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    read_options(c->options, &options);
    int rc = pt_scene_load_source("d/t.pbrt", &source, &options, &scene, &defaults, &err);
    if (rc)
        fprintf(out, "%d: %s\n", rc, err.text);
    else if (!strstr(c->options, "only-warnings")) {
        if (strncmp(c->text, "WorldBegin", 10) != 0)
            pt_dump_header(out, scene, &defaults);
        pt_dump_world(out, scene);
    }
    pt_scene_destroy(scene);
    assert_int_equal(fclose(out), 0);
    return text;
}

#define CHECK(name) \
    static void name(void **state) \
    { \
        (void)state; \
        approve_cases("tests/unit/pt_approved/" #name ".txt", answer); \
    }
CHECK(header)
CHECK(transforms)
CHECK(lights)
CHECK(materials)
CHECK(textures)
CHECK(shapes)
CHECK(media)
CHECK(lines)

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(header),    cmocka_unit_test(transforms), cmocka_unit_test(lights),
                                       cmocka_unit_test(materials), cmocka_unit_test(textures),   cmocka_unit_test(shapes),
                                       cmocka_unit_test(media),     cmocka_unit_test(lines)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
