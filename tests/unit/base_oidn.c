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

static const struct lull_oidn_form pixel = {.width = 1, .height = 1, .quality = LULL_OIDN_HIGH, .threads = 1, .exposure = 1};

static struct lull_oidn *open_stub(const char *kind)
{
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    setenv("OIDN_STUB", kind, 1);
    if (lull_oidn_open(stub, &o, &err))
        fail_msg("%s", err.text);
    return o;
}

static void refuses(const char *path, const char *kind, const char *text)
{
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    setenv("OIDN_STUB", kind, 1);
    assert_int_equal(lull_oidn_open(path, &o, &err), BASE_EINVAL);
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
    assert_int_equal(lull_oidn_open(file, &o, &err), 0);
    lull_oidn_close(o);
    refuses("/no/such/folder", "identity", "/no/such/folder: no Open Image Denoise 2 there");
    refuses("/proc/self/exe", "identity", "no Open Image Denoise 2 there");
    setenv("LULL_OIDN", stub, 1);
    assert_int_equal(lull_oidn_open(NULL, &o, &err), 0);
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
                {"memory", "out of memory", BASE_ENOMEM},
                {"crash", "ended its process", BASE_EINVAL}};
    for (size_t i = 0; i < 3; i++) {
        struct lull_oidn *o = open_stub(runs[i].kind);
        float color[3] = {1, 2, 3}, out[3];
        struct lull_oidn_pictures p = {.color = {color}, .out = {out}};
        assert_int_equal(lull_oidn_prepare(o, &pixel, NULL), 0);
        for (int k = 0; k < 2; k++) {
            struct base_err err = {0};
            assert_int_equal(lull_oidn_run(o, &p, NULL, NULL, k ? NULL : &err), runs[i].code);
            assert_true(k || strstr(err.text, runs[i].text));
        }
        lull_oidn_close(o);
    }
}

static int third_time(void *data) { return ++*(int *)data == 3; }

static void cancelling(void **unused)
{
    (void)unused;
    struct lull_oidn *o = open_stub("endless");
    float color[3] = {1, 2, 3}, out[3];
    struct lull_oidn_pictures p = {.color = {color}, .out = {out}};
    struct base_err err = {0};
    int asked = 0;
    assert_int_equal(lull_oidn_run(o, &p, third_time, &asked, &err), BASE_EINVAL);
    assert_string_equal(err.text, "Open Image Denoise is not prepared");
    err.code = 0;
    assert_int_equal(lull_oidn_prepare(o, &pixel, &err), 0);
    assert_int_equal(lull_oidn_run(o, &p, third_time, &asked, &err), BASE_ECANCELLED);
    assert_string_equal(err.text, "cancelled");
    assert_int_equal(asked, 3);
    lull_oidn_close(o);
}

static void run_pixel(struct lull_oidn *o, float expected)
{
    float color[3] = {0.25f, 0.25f, 0.25f}, out[3];
    struct lull_oidn_pictures p = {.color = {color}, .out = {out}};
    struct base_err err = {0};
    if (lull_oidn_run(o, &p, NULL, NULL, &err))
        fail_msg("%s", err.text);
    assert_true(out[2] == expected);
}

/* One process from open to close, which has the environment of its start; what has ended is started anew, with another. */
static void staying(void **unused)
{
    (void)unused;
    struct lull_oidn *o = open_stub("identity");
    const struct lull_oidn_form two = {.width = 1, .height = 2, .quality = LULL_OIDN_HIGH, .threads = 1, .exposure = 1};
    float color[3] = {1, 2, 3}, out[3];
    struct lull_oidn_pictures p = {.color = {color}, .out = {out}};
    setenv("OIDN_STUB", "crash", 1);
    for (int k = 0; k < 2; k++) {
        assert_int_equal(lull_oidn_prepare(o, k ? &pixel : &two, NULL), 0);
        lull_oidn_resize(o, 1, 1);
        run_pixel(o, 0.25f);
        run_pixel(o, 0.25f);
    }
    lull_oidn_close(o);
    o = open_stub("crash");
    assert_int_equal(lull_oidn_prepare(o, &pixel, NULL), 0);
    setenv("OIDN_STUB", "constant", 1);
    assert_int_equal(lull_oidn_run(o, &p, NULL, NULL, NULL), BASE_EINVAL);
    run_pixel(o, 0.5f);
    lull_oidn_close(o);
}

/* The library is never given what is not finite, and never believed: the stub refuses the one, `nan` does the other. */
static void bad_numbers(void **unused)
{
    (void)unused;
    enum { W = 15, H = 15, N = 3 * W * H };
    static float color[N], albedo[N], normal[N], out[N], other[N];
    for (int i = 0; i < N; i++) {
        color[i] = i % 5 == 0 ? NAN : i % 7 == 0 ? INFINITY : i % 11 == 0 ? -1.0f : 1e6f;
        albedo[i] = i % 3 ? 2.0f : NAN;
        normal[i] = i % 3 ? -3.0f : INFINITY;
    }
    struct lull_oidn_pictures p = {{color, color}, albedo, normal, {out, other}, 0};
    struct lull_oidn_form form = {
        .width = W, .height = H, .albedo = 1, .normal = 1, .quality = LULL_OIDN_FAST, .threads = 1, .exposure = 0.5f};
    static const char *const kinds[] = {"identity", "nan"};
    for (size_t k = 0; k < 2; k++) {
        struct lull_oidn *o = open_stub(kinds[k]);
        struct base_err err = {0};
        if (lull_oidn_prepare(o, &form, &err) || lull_oidn_run(o, &p, NULL, NULL, &err))
            fail_msg("%s", err.text);
        for (int i = 0; i < N; i++)
            assert_true(out[i] == (color[i] == 1e6f ? 1e6f : 0.0f));
        assert_memory_equal(out, other, sizeof out);
        lull_oidn_close(o);
    }
}

/* Auxiliaries are denoised first where that is asked for, each by itself; the caller's stay as they are. */
static void prefiltered(void **unused)
{
    (void)unused;
    enum { W = 15, H = 15, N = 3 * W * H, MIDDLE = 3 * (7 * W + 7) };
    static float color[N], albedo[N], normal[N], out[N];
    const struct lull_oidn_form form = {
        .width = W, .height = H, .albedo = 1, .normal = 1, .quality = LULL_OIDN_HIGH, .threads = 1, .exposure = 1};
    struct lull_oidn_pictures p = {.color = {color}, .albedo = albedo, .normal = normal, .out = {out}};
    struct lull_oidn *o = open_stub("auxiliary");
    struct base_err err = {0};
    albedo[MIDDLE] = 1;
    normal[MIDDLE + 3] = -0.5f;
    for (int clean = 0; clean < 2; clean++) {
        p.prefiltered = clean;
        if (lull_oidn_prepare(o, &form, &err) || lull_oidn_run(o, &p, NULL, NULL, &err))
            fail_msg("%s", err.text);
        assert_true(fabsf(out[MIDDLE] - (clean ? 0.5f / 25 : 1)) < 1e-6f);
        assert_true(fabsf(out[MIDDLE - 6] - (clean ? 1.0f / 25 : 0)) < 1e-6f);
        assert_true(albedo[MIDDLE] == 1 && normal[MIDDLE + 3] == -0.5f);
    }
    lull_oidn_close(o);
}

/* The margin is the picture, mirrored, and does not come back: at each pixel the stub's mean of 5x5 reaches into it. */
static void mirrored(void **unused)
{
    (void)unused;
    enum { W = 7, H = 3, N = 3 * W * H };
    const struct lull_oidn_form form = {
        .width = W, .height = H, .quality = LULL_OIDN_HIGH, .threads = 1, .margin = LULL_OIDN_MARGIN, .exposure = 1};
    float color[N], out[N];
    struct lull_oidn_pictures p = {.color = {color}, .out = {out}};
    struct lull_oidn *o = open_stub("box");
    struct base_err err = {0};
    for (int i = 0; i < N; i++)
        color[i] = (float)(i * i % 17);
    if (lull_oidn_prepare(o, &form, &err) || lull_oidn_run(o, &p, NULL, NULL, &err))
        fail_msg("%s", err.text);
    static const int column[W + 4] = {2, 1, 0, 1, 2, 3, 4, 5, 6, 5, 4}, row[H + 4] = {2, 1, 0, 1, 2, 1, 0};
    for (int i = 0; i < N; i++) {
        double sum = 0;
        for (int k = 0; k < 25; k++)
            sum += (double)color[3 * (row[i / 3 / W + k / 5] * W + column[i / 3 % W + k % 5]) + i % 3];
        assert_true(fabs((double)out[i] - sum / 25) < 1e-5);
    }
    assert_int_equal(lull_oidn_mirrored(-5, 1), 0);
    assert_int_equal(lull_oidn_mirrored(9, 2), 1);
    lull_oidn_close(o);
}

/* --- the real library -------------------------------------------------------------------------------------------------- */

static char real[4096]; /* LULL_OIDN as it was */

static struct lull_oidn *open_real(void)
{
    struct base_err err = {0};
    struct lull_oidn *o = NULL;
    if (real[0])
        setenv("LULL_OIDN", real, 1);
    else
        unsetenv("LULL_OIDN");
    if (lull_oidn_open(NULL, &o, &err)) {
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

static void denoise(struct lull_oidn *o, const float *color, int width, int height, int threads, int margin, float *out)
{
    struct lull_oidn_form form = {
        .width = width, .height = height, .quality = LULL_OIDN_HIGH, .threads = threads, .margin = margin, .exposure = 1};
    struct lull_oidn_pictures p = {.color = {color}, .out = {out}};
    struct base_err err = {0};
    if (lull_oidn_prepare(o, &form, &err) || lull_oidn_run(o, &p, NULL, NULL, &err))
        fail_msg("%s", err.text);
}

/* Less noise; the same bits for two threads and for a crop on the grid with its halo; small pictures. */
static void real_library(void **unused)
{
    (void)unused;
    enum { W = 352, H = 272, N = 3 * W * H };
    struct lull_oidn *o = open_real();
    float *color = malloc(4 * N * sizeof *color), *out = color + N, *again = out + N, *part = again + N;
    assert_non_null(color);
    for (int i = 0; i < N; i++)
        color[i] = 0.5f + 0.2f * (next() - 0.5f) + ((i / 3 % W) / 40 % 2 ? 0.2f : 0.0f);
    denoise(o, color, W, H, 1, 0, out);
    denoise(o, color, W, H, 2, 0, again);
    assert_memory_equal(out, again, N * sizeof *out);
    double noise = 0, left = 0;
    for (int i = 0; i < N; i++) {
        double truth = 0.5 + ((i / 3 % W) / 40 % 2 ? 0.2 : 0.0);
        noise += pow((double)color[i] - truth, 2);
        left += pow((double)out[i] - truth, 2);
    }
    assert_true(left < 0.1 * noise);

    /* the pixels from (192, 144) on, which is on the grid, with the halo before them */
    enum { X = 192, Y = 144, X0 = X - LULL_OIDN_HALO, Y0 = Y - LULL_OIDN_HALO, CUT_W = W - X0, CUT_H = H - Y0 };
    assert_true(X0 % LULL_OIDN_GRID + Y0 % LULL_OIDN_GRID == 0);
    for (int y = 0; y < CUT_H; y++)
        memcpy(part + y * CUT_W * 3, color + ((y + Y0) * W + X0) * 3, CUT_W * 3 * sizeof *part);
    denoise(o, part, CUT_W, CUT_H, 1, 0, again);
    for (int y = Y; y < H; y++)
        assert_memory_equal(again + ((y - Y0) * CUT_W + X - X0) * 3, out + (y * W + X) * 3, (W - X) * 3 * sizeof *out);

    static const int sides[][2] = {{1, 1}, {15, 15}, {1, 200}, {37, 3}};
    for (size_t s = 0; s < 4; s++)
        denoise(o, color, sides[s][0], sides[s][1], 1, (int)s % 2 * LULL_OIDN_MARGIN, again);
    free(color);
    lull_oidn_close(o);
}

/* Grey with noise: how far the outermost pixels are off, root mean square, over the same of those inside. */
static double border_error(struct lull_oidn *o, int margin)
{
    enum { W = 100, H = 90, N = 3 * W * H, INSIDE = 8 };
    static float color[N], out[N];
    double square[2] = {0}, count[2] = {0};
    seed = 1;
    for (int i = 0; i < N; i++)
        color[i] = 0.4f + 0.1f * (next() - 0.5f);
    denoise(o, color, W, H, 1, margin, out);
    for (int i = 0; i < N; i++) {
        const int x = i / 3 % W, y = i / 3 / W, border = x == 0 || y == 0 || x == W - 1 || y == H - 1;
        if (border || (x >= INSIDE && y >= INSIDE && x < W - INSIDE && y < H - INSIDE)) {
            square[border] += pow((double)out[i] - 0.4, 2);
            count[border]++;
        }
    }
    return sqrt(square[1] / count[1] / (square[0] / count[0]));
}

static void real_margin(void **unused)
{
    (void)unused;
    struct lull_oidn *o = open_real();
    double without = border_error(o, 0), with = border_error(o, LULL_OIDN_MARGIN);
    print_message("outermost pixels are off %.1f times as much as others, mirrored on %.1f times\n", without, with);
    assert_true(with < 2.0 && without > 2.0 * with);
    lull_oidn_close(o);
}

int main(void)
{
    if (getenv("LULL_OIDN"))
        snprintf(real, sizeof real, "%s", getenv("LULL_OIDN"));
    unsetenv("LULL_OIDN");
    if (api_folder(stub, sizeof stub, "../oidn-stub") != 0)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finding),  cmocka_unit_test(failures),     cmocka_unit_test(cancelling),
        cmocka_unit_test(staying),  cmocka_unit_test(bad_numbers),  cmocka_unit_test(prefiltered),
        cmocka_unit_test(mirrored), cmocka_unit_test(real_library), cmocka_unit_test(real_margin),
    };
    return cmocka_run_group_tests_name("oidn", tests, NULL, NULL);
}
