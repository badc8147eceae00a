/*
 * Open Image Denoise by dlopen: finding it, its failures, what it is given and what comes back, with the stub in its place
 * (tests/stub/oidn.c); and with the real library, where there is one (LULL_OIDN, build/oidn), what its header promises.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "denoise/oidn.h"
#include "support/api_folders.h"

static char stub[2048];

static struct lull_oidn *open_stub(const char *kind)
{
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    setenv("OIDN_STUB", kind, 1);
    if (lull_oidn_open(stub, 1, &o, &err))
        fail_msg("%s", err.text);
    return o;
}

static void refuses(const char *path, const char *kind, const char *text)
{
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    setenv("OIDN_STUB", kind, 1);
    assert_int_equal(lull_oidn_open(path, 1, &o, &err), BASE_EINVAL);
    assert_null(o);
    if (!strstr(err.text, text))
        fail_msg("'%s' does not say '%s'", err.text, text);
    assert_null(strchr(err.text, '\n'));
}

static void finding(void **unused)
{
    (void)unused;
    char file[2100];
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    lull_oidn_close(open_stub("identity"));
    snprintf(file, sizeof file, "%s/libOpenImageDenoise.so.2", stub);
    assert_int_equal(lull_oidn_open(file, 1, &o, &err), 0);
    assert_string_equal(lull_oidn_version(o), "2.5.1");
    lull_oidn_close(o);
    refuses("/no/such/folder", "identity", "/no/such/folder: no Open Image Denoise 2 there");
    refuses("/proc/self/exe", "identity", "no Open Image Denoise 2 there");
    setenv("LULL_OIDN", stub, 1);
    assert_int_equal(lull_oidn_open(NULL, 1, &o, &err), 0);
    lull_oidn_close(o);
    setenv("LULL_OIDN", "/no/such", 1);
    refuses(NULL, "identity", "/no/such: no Open Image Denoise 2 there");
    lull_oidn_close(NULL);
}

static void failures(void **unused)
{
    (void)unused;
    refuses(stub, "version", "is of version 3.0.1: version 2 is needed");
    refuses(stub, "no-device", "cannot make a device: the stub was told to have none (error 3)");
    static const struct {
        const char *kind, *text;
        int code;
    } runs[] = {{"commit", "cannot prepare its filter: the stub was told to refuse (error 3)", BASE_EINVAL},
                {"memory", "out of memory", BASE_ENOMEM}};
    for (size_t i = 0; i < 2; i++) {
        struct lull_oidn *o = open_stub(runs[i].kind);
        float color[3] = {1, 2, 3}, out[3];
        struct lull_oidn_picture p = {.width = 1, .height = 1, .color = color, .exposure = 1};
        struct base_err err = {0};
        assert_int_equal(lull_oidn_run(o, &p, LULL_OIDN_HIGH, NULL, NULL, out, &err), runs[i].code);
        assert_non_null(strstr(err.text, runs[i].text));
        assert_int_equal(lull_oidn_run(o, &p, LULL_OIDN_HIGH, NULL, NULL, out, NULL), runs[i].code);
        lull_oidn_close(o);
    }
}

static int third_time(void *data)
{
    return ++*(int *)data == 3;
}

static void cancelling(void **unused)
{
    (void)unused;
    struct lull_oidn *o = open_stub("endless");
    float color[3] = {1, 2, 3}, out[3];
    struct lull_oidn_picture p = {.width = 1, .height = 1, .color = color, .exposure = 1};
    struct base_err err = {0};
    int asked = 0;
    assert_int_equal(lull_oidn_run(o, &p, LULL_OIDN_HIGH, third_time, &asked, out, &err), BASE_EINVAL);
    assert_string_equal(err.text, "cancelled");
    assert_int_equal(asked, 3);
    lull_oidn_close(o);
}

/* The library is never given what is not finite, and never believed: the stub refuses the one, `nan` does the other. */
static void bad_numbers(void **unused)
{
    (void)unused;
    enum { W = 15, H = 15, N = 3 * W * H };
    static float color[N], albedo[N], normal[N], out[N];
    for (int i = 0; i < N; i++) {
        color[i] = i % 5 == 0 ? NAN : i % 7 == 0 ? INFINITY : i % 11 == 0 ? -1.0f : 1e6f;
        albedo[i] = i % 3 ? 2.0f : NAN;
        normal[i] = i % 3 ? -3.0f : INFINITY;
    }
    struct lull_oidn_picture p = {W, H, color, albedo, normal, 0.5};
    static const char *const kinds[] = {"identity", "nan"};
    for (size_t k = 0; k < 2; k++) {
        struct lull_oidn *o = open_stub(kinds[k]);
        struct base_err err = {0};
        if (lull_oidn_run(o, &p, LULL_OIDN_FAST, NULL, NULL, out, &err))
            fail_msg("%s", err.text);
        for (int i = 0; i < N; i++)
            assert_true(out[i] == (color[i] == 1e6f ? 1e6f : 0.0f));
        lull_oidn_close(o);
    }
}

/* Inside the frame, on its grid, with the halo where the frame reaches. */
static void boxes(void **unused)
{
    (void)unused;
    static const struct lull_oidn_box frames[] = {{0, 0, 1000, 700}, {5, 7, 5 + 403, 7 + 391}, {0, 0, 1, 1}, {3, 3, 18, 18}};
    for (size_t f = 0; f < 4; f++)
        for (int y = frames[f].y0; y < frames[f].y1; y += 97)
            for (int x = frames[f].x0; x < frames[f].x1; x += 97)
                for (int halo = 0; halo <= 96; halo += 32) {
                    const struct lull_oidn_box t = frames[f];
                    struct lull_oidn_box core = {x, y, x + 97 < t.x1 ? x + 97 : t.x1, y + 97 < t.y1 ? y + 97 : t.y1};
                    struct lull_oidn_box b = lull_oidn_box_of(core, halo, t);
                    assert_true(b.x0 >= t.x0 && b.y0 >= t.y0 && b.x1 <= t.x1 && b.y1 <= t.y1);
                    assert_int_equal((b.x0 - t.x0) % LULL_OIDN_GRID, 0);
                    assert_int_equal((b.y0 - t.y0) % LULL_OIDN_GRID, 0);
                    assert_true(b.x0 == t.x0 || (core.x0 - b.x0 >= halo && core.x0 - b.x0 < halo + LULL_OIDN_GRID));
                    assert_true(b.y0 == t.y0 || (core.y0 - b.y0 >= halo && core.y0 - b.y0 < halo + LULL_OIDN_GRID));
                    assert_true(b.x1 == t.x1 || b.x1 == core.x1 + halo);
                    assert_true(b.y1 == t.y1 || b.y1 == core.y1 + halo);
                }
}

/* --- the real library -------------------------------------------------------------------------------------------------- */

static char real[4096]; /* LULL_OIDN as it was */

static struct lull_oidn *open_real(int threads)
{
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    if (real[0])
        setenv("LULL_OIDN", real, 1);
    else
        unsetenv("LULL_OIDN");
    if (lull_oidn_open(NULL, threads, &o, &err)) {
        print_message("skipped: %s\n", err.text);
        skip();
    }
    return o;
}

static uint32_t seed = 1;

static float next(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (float)(seed >> 8) * 0x1p-24f;
}

static void denoise(struct lull_oidn *o, const struct lull_oidn_picture *p, float *out)
{
    struct base_err err = {0};
    if (lull_oidn_run(o, p, LULL_OIDN_HIGH, NULL, NULL, out, &err))
        fail_msg("%s", err.text);
}

/* Less noise; the same bits for two threads, for a crop on the grid with its halo, and (after scaling) for another exposure. */
static void real_library(void **unused)
{
    (void)unused;
    enum { W = 352, H = 272, N = 3 * W * H };
    struct lull_oidn *one = open_real(1), *two = open_real(2);
    float *color = malloc(4 * N * sizeof *color), *out = color + N, *again = out + N, *part = again + N;
    assert_non_null(color);
    for (int i = 0; i < N; i++)
        color[i] = 0.5f + 0.2f * (next() - 0.5f) + ((i / 3 % W) / 40 % 2 ? 0.2f : 0.0f);
    struct lull_oidn_picture p = {.width = W, .height = H, .color = color, .exposure = 1};
    denoise(one, &p, out);
    denoise(two, &p, again);
    assert_memory_equal(out, again, N * sizeof *out);
    double noise = 0, left = 0;
    for (int i = 0; i < N; i++) {
        double truth = 0.5 + ((i / 3 % W) / 40 % 2 ? 0.2 : 0.0);
        noise += pow((double)color[i] - truth, 2);
        left += pow((double)out[i] - truth, 2);
    }
    assert_true(left < 0.1 * noise);

    struct lull_oidn_box frame = {0, 0, W, H}, core = {203, 150, W, H}, b = lull_oidn_box_of(core, LULL_OIDN_HALO, frame);
    const int w = b.x1 - b.x0;
    for (int y = b.y0; y < b.y1; y++)
        memcpy(part + (y - b.y0) * w * 3, color + (y * W + b.x0) * 3, (size_t)w * 3 * sizeof *part);
    p = (struct lull_oidn_picture){.width = w, .height = b.y1 - b.y0, .color = part, .exposure = 1};
    assert_true(b.x0 > 0 && b.y0 > 0);
    denoise(one, &p, again);
    for (int y = core.y0; y < core.y1; y++)
        assert_memory_equal(again + ((y - b.y0) * w + core.x0 - b.x0) * 3, out + (y * W + core.x0) * 3,
                            (size_t)(core.x1 - core.x0) * 3 * sizeof *out);

    static const int sides[][2] = {{1, 1}, {15, 15}, {1, 200}, {37, 3}};
    for (size_t s = 0; s < 4; s++) {
        p = (struct lull_oidn_picture){.width = sides[s][0], .height = sides[s][1], .color = color, .exposure = 1e-6};
        denoise(one, &p, again);
    }
    free(color);
    lull_oidn_close(one);
    lull_oidn_close(two);
}

int main(void)
{
    if (getenv("LULL_OIDN"))
        snprintf(real, sizeof real, "%s", getenv("LULL_OIDN"));
    unsetenv("LULL_OIDN");
    if (api_folder(stub, sizeof stub, "../oidn-stub") != 0)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finding),     cmocka_unit_test(failures), cmocka_unit_test(cancelling),
        cmocka_unit_test(bad_numbers), cmocka_unit_test(boxes),    cmocka_unit_test(real_library),
    };
    return cmocka_run_group_tests_name("oidn", tests, NULL, NULL);
}
