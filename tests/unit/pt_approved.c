/*
 * Small scenes and all that the loader makes of them: the files of tests/golden/pbrt hold each scene's text and the recorded
 * answer, which is its warnings, then its one-line error or the whole renderable.
 *
 *     # comment          kept
 *     = strict size=8x4  options of the next scene (also: fov=, look-at=a,b,…, effects, power, only-warnings)
 *     @ a.ply text       a line of a file beside the scene
 *     > text             the first line of the scene
 *     >> text            each further one
 *       answer           two blanks before it; made anew by `APPROVE=1 build/tests/unit/pt_approved`, and then to be read
 *
 * The header (film … camera) is part of the answer of scenes that do not begin with WorldBegin. Pictures named WxHxC.png exist
 * with 8 bits, deep-WxHxC.png with 16; an alpha channel is opaque in opaque-….
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

#include "base/files.h"
#include "support/pt_dump.h"

/* Numbers may differ so much: sums in another order, sines of another C library. */
static const double relative = 1e-5, absolute = 3e-7;

enum { TEXT = 1 << 14, FILES = 4 };

struct scene_case {
    char options[200], text[TEXT];
    struct {
        char name[64], text[TEXT];
    } files[FILES];
};

/* --- files beside a scene --------------------------------------------------------------------------------------------- */

static size_t chunk(unsigned char *out, const char *type, const unsigned char *data, size_t n)
{
    const unsigned char length[4] = {(unsigned char)(n >> 24), (unsigned char)(n >> 16), (unsigned char)(n >> 8), (unsigned char)n};
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
    const unsigned char head[13] = {0, 0, 0, (unsigned char)width, 0, 0, 0, (unsigned char)height, deep ? 16 : 8, colour[channels], 0, 0, 0};
    memcpy(out, "\x89PNG\r\n\x1a\n", 8);
    size_t at = 8 + chunk(out + 8, "IHDR", head, 13);
    at += chunk(out + at, "IDAT", packed, size);
    return at + chunk(out + at, "IEND", head, 0);
}

static int read_beside(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    const struct scene_case *c = data;
    unsigned char png[2048];
    const void *found = NULL;
    if (strcmp(path, "d/t.pbrt") == 0) {
        found = c->text;
        *size = strlen(c->text);
    }
    for (int i = 0; i < FILES && !found; i++)
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

static void tell(void *data, const char *line)
{
    fprintf(data, "%s\n", line);
}

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
static char *answer(struct scene_case *c)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    struct pt_source source = {read_beside, NULL, c, 0};
    struct pt_load_options options = {.warn = tell, .warn_data = out};
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

/* The same characters, and numbers as near as the bounds say. */
static int same(const char *a, const char *b)
{
    while (*a != '\0' && *b != '\0') {
        int numbers = (isdigit((unsigned char)*a) || (*a == '-' && isdigit((unsigned char)a[1]))) &&
                      (isdigit((unsigned char)*b) || (*b == '-' && isdigit((unsigned char)b[1])));
        if (numbers) {
            char *x, *y;
            double p = strtod(a, &x), q = strtod(b, &y);
            if (p != q && !(fabs(p - q) <= relative * fmax(fabs(p), fabs(q)) + absolute))
                return 0;
            a = x;
            b = y;
        } else if (*a++ != *b++) {
            return 0;
        }
    }
    return *a == *b;
}

/* --- files of cases --------------------------------------------------------------------------------------------------- */

static void append(char *text, size_t room, const char *line)
{
    size_t n = strlen(text);
    assert_true(n + strlen(line) + 2 < room);
    snprintf(text + n, room - n, "%s\n", line);
}

static void add_file_line(struct scene_case *c, const char *line)
{
    size_t n = strcspn(line, " ");
    int i = 0;
    while (c->files[i].name[0] != '\0' && (strlen(c->files[i].name) != n || strncmp(c->files[i].name, line, n) != 0))
        assert_true(++i < FILES);
    snprintf(c->files[i].name, sizeof c->files[i].name, "%.*s", (int)n, line);
    append(c->files[i].text, TEXT, line[n] == ' ' ? line + n + 1 : "");
}

/* Compares line by line with the recorded answer from `recorded` on; returns behind it. In `anew` goes the new one. */
static char *compare(struct scene_case *c, char *recorded, FILE *anew, int *wrong)
{
    char *text = answer(c), *save = NULL, *line = strtok_r(text, "\n", &save);
    int told = 0;
    for (; line || strncmp(recorded, "  ", 2) == 0; line = line ? strtok_r(NULL, "\n", &save) : NULL) {
        char expected[4096] = "";
        if (strncmp(recorded, "  ", 2) == 0) {
            size_t n = strcspn(recorded, "\n");
            snprintf(expected, sizeof expected, "%.*s", (int)n - 2, recorded + 2);
            recorded += n + (recorded[n] == '\n');
        }
        if (line)
            fprintf(anew, "  %s\n", line);
        if (same(expected, line ? line : ""))
            continue;
        *wrong += 1;
        if (told++ == 0)
            print_error("of %s  recorded: %s\n  now:      %s\n", c->text, expected, line ? line : "");
    }
    free(text);
    memset(c, 0, sizeof *c);
    return recorded;
}

static void check_file(const char *name)
{
    static struct scene_case c;
    char path[256], *bytes, *made = NULL;
    size_t size, made_size;
    int wrong = 0;
    struct base_err err = {0};
    snprintf(path, sizeof path, "tests/golden/pbrt/%s", name);
    assert_int_equal(base_file_read(path, 1 << 24, &bytes, &size, &err), 0);
    FILE *anew = open_memstream(&made, &made_size);
    assert_non_null(anew);
    memset(&c, 0, sizeof c);
    for (char *at = bytes; *at != '\0';) {
        char line[4096];
        size_t n = strcspn(at, "\n");
        snprintf(line, sizeof line, "%.*s", (int)n, at);
        if (c.text[0] != '\0' && strncmp(line, ">>", 2) != 0) {
            at = compare(&c, at, anew, &wrong);
            continue;
        }
        assert_true(n < sizeof line && strncmp(line, "  ", 2) != 0);
        if (line[0] == '>')
            append(c.text, TEXT, line + (line[1] == '>' ? 3 : 2));
        else if (line[0] == '=')
            snprintf(c.options, sizeof c.options, "%.*s", (int)sizeof c.options - 1, line);
        else if (line[0] == '@')
            add_file_line(&c, line + 2);
        fprintf(anew, "%s\n", line);
        at += n + (at[n] == '\n');
    }
    if (c.text[0] != '\0')
        compare(&c, bytes + size, anew, &wrong);
    fclose(anew);
    if (getenv("APPROVE")) {
        FILE *f = fopen(path, "w");
        assert_true(f && fputs(made, f) >= 0 && fclose(f) == 0);
    } else if (wrong > 0) {
        fail_msg("%s: %d lines differ", path, wrong);
    }
    free(made);
    free(bytes);
}

#define CHECK(name) \
    static void name(void **state) \
    { \
        (void)state; \
        check_file(#name ".txt"); \
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
