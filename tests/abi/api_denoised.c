/*
 * The criterion "denoised" with a denoiser whose answers are known (tests/stub/oidn.c): what its two estimates see, when it
 * stops, and that nothing the denoiser does, or that is in the pixels, makes it stop or harms it. The real library, where
 * there is one, is in tests/cli/lull_check.sh.
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

#include <lull/loader.h>

#include "support/api_folders.h"
#include "support/splitmix.h"

enum { W = 230, H = 210, PIXELS = W * H, WIDE = 4000, BLOCKS = 35 };

static double color[PIXELS][3], half[PIXELS][3], albedo[PIXELS][3];
static char criteria[2048], stub[2048];
static uint64_t state;

/* Grey, with stripes of three pixels, and Gaussian noise whose deviation in the mean of all samples is sigma. */
static void make(double grey, double stripe, double sigma)
{
    state = 5;
    for (int i = 0; i < PIXELS; i++) {
        double truth = grey + (i % W % 6 < 3 ? stripe : -stripe), a = truth + sqrt(2) * sigma * splitmix_gauss(&state);
        double b = truth + sqrt(2) * sigma * splitmix_gauss(&state);
        for (int c = 0; c < 3; c++) {
            half[i][c] = a;
            color[i][c] = (a + b) / 2;
            albedo[i][c] = 0.5;
        }
    }
}

/* --- a host ------------------------------------------------------------------------------------------------------------ */

static int warnings;
static char warning[256];
static double said_halves, said_crossed; /* by the last debug line */

static void log_line(const struct lull_host *host, int32_t level, const char *text)
{
    (void)host;
    if (level == LULL_LOG_WARNING) {
        warnings++;
        snprintf(warning, sizeof warning, "%s", text);
    } else if (level == LULL_LOG_DEBUG) {
        const char *numbers = strstr(text, "error ");
        assert_int_equal(sscanf(numbers, "error %lf by its halves, %lf crossed", &said_halves, &said_crossed), 2);
    }
}

static int cancelling;

/* Every other time: whoever was told once asks no more. */
static int32_t cancelled(const struct lull_host *host)
{
    static int asked;
    (void)host;
    return cancelling && asked++ % 2;
}

static const struct lull_host host = {.struct_size = sizeof host, .max_workers = 1, .log = log_line, .cancelled = cancelled};

struct session {
    const struct lull_criterion *criterion;
    struct lull_instance *in;
    struct lull_rect rect[BLOCKS];
    struct lull_block all[BLOCKS];
    uint32_t blocks;
    int w, h;
};

static const struct lull_criterion *criterion(void)
{
    const char *dirs[] = {criteria};
    struct lull_search search = {.dirs = dirs, .dir_count = 1};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    if (lull_open(&search, "denoised", &found, &err) != LULL_OK)
        fail_msg("%s", err.message);
    return found.criterion;
}

/* A frame of w x h pixels, in blocks of at most 117 x 105. */
static void begin(struct session *s, int w, int h, const char *picture, uint32_t planes, uint32_t flags)
{
    struct lull_pair pairs[] = {{"library", stub}, {"picture", picture}};
    struct lull_error err = {.struct_size = sizeof err};
    *s = (struct session){.criterion = criterion(), .w = w, .h = h};
    warnings = cancelling = 0;
    if (s->criterion->create(&host, pairs, 2, sizeof pairs[0], &s->in, &err) != LULL_OK)
        fail_msg("%s", err.message);
    for (int y = 0; y < h; y += 105)
        for (int x = 0; x < w; x += 117)
            s->rect[s->blocks++] = (struct lull_rect){x, y, x + 117 < w ? x + 117 : w, y + 105 < h ? y + 105 : h};
    struct lull_frame frame = {.struct_size = sizeof frame,
                               .flags = flags,
                               .width = (uint32_t)w,
                               .height = (uint32_t)h,
                               .blocks = s->rect,
                               .block_count = s->blocks,
                               .block_stride = sizeof s->rect[0],
                               .planes = planes,
                               .exposure = 1,
                               .transfer = LULL_TRANSFER_SRGB,
                               .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
    if (s->criterion->begin_frame(s->in, &frame, &err) != LULL_OK)
        fail_msg("%s", err.message);
    for (uint32_t i = 0; i < s->blocks; i++)
        s->all[i] = (struct lull_block){.id = i,
                                        .x0 = s->rect[i].x0,
                                        .y0 = s->rect[i].y0,
                                        .x1 = s->rect[i].x1,
                                        .y1 = s->rect[i].y1,
                                        .thread_s = (double)NAN};
}

static int32_t ask(struct session *s, uint32_t id, uint64_t spp, struct lull_decision *d, struct lull_error *err)
{
    const int64_t row = 24 * s->w;
    struct lull_plane planes[LULL_PLANE_COUNT] = {
        [LULL_PLANE_COLOR] = {color, 24, row, 8, 1, LULL_TYPE_F64, LULL_NORM_ONE, 3, 0},
        [LULL_PLANE_HALF] = {half, 24, row, 8, 1, LULL_TYPE_F64, LULL_NORM_ONE, 3, 0},
        [LULL_PLANE_ALBEDO] = {albedo, 24, row, 8, 1, LULL_TYPE_F64, LULL_NORM_ONE, 3, 0},
    };
    for (uint32_t i = 0; i < s->blocks; i++)
        s->all[i].spp = spp, s->all[i].half_spp = spp / 2;
    struct lull_view view = {.struct_size = sizeof view,
                             .x1 = s->w,
                             .y1 = s->h,
                             .planes = planes,
                             .plane_count = LULL_PLANE_COUNT,
                             .plane_stride = sizeof planes[0],
                             .all = s->all,
                             .all_count = s->blocks,
                             .all_stride = sizeof s->all[0],
                             .elapsed_s = (double)NAN};
    *d = (struct lull_decision){.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    return s->criterion->evaluate(s->in, &view, &s->all[id], sizeof s->all[0], d, sizeof *d, 1, err);
}

static struct lull_decision answer(struct session *s, uint32_t id, uint64_t spp)
{
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_decision d;
    if (ask(s, id, spp, &d, &err) != LULL_OK)
        fail_msg("%s", err.message);
    return d;
}

enum { GIVEN = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) | LULL_PLANE_BIT(LULL_PLANE_ALBEDO) };

static void start(struct session *s, const char *kind, const char *picture)
{
    setenv("OIDN_STUB", kind, 1);
    begin(s, W, H, picture, GIVEN, 0);
}

static void end(struct session *s) { s->criterion->destroy(s->in); }

/* --- what is seen ------------------------------------------------------------------------------------------------------ */

/* At so many samples of a block whose stripes, which the denoiser takes away, are this strong. */
static struct lull_decision answer_with(struct session *s, double stripe, uint32_t block, uint64_t spp)
{
    make(0.5, stripe, 0.002);
    return answer(s, block, spp);
}

/* A denoiser that removes everything: a low error is followed by another look soon, which finds it low as well; one that is far
 * below the limit at the first look is not. */
static void two_looks_stop(void **unused)
{
    (void)unused;
    struct session s;
    double stripe = 0.01, error = 0;
    for (int i = 0; i < 20 && !(error > 0.6 && error < 0.8); i++) {
        stripe *= error > 0 ? 0.7 / error : 1;
        start(&s, "constant", "denoised");
        error = answer_with(&s, stripe, 0, 64).error;
        end(&s);
    }
    start(&s, "constant", "denoised");
    struct lull_decision d = answer(&s, 0, 16);
    assert_true(d.action == LULL_CONTINUE && (d.flags & LULL_DECISION_TOO_EARLY) && d.next_spp == 64);
    d = answer_with(&s, stripe, 0, 64);
    assert_true(d.action == LULL_CONTINUE && d.next_spp == 80 && d.error < 0.8 && d.p_noisy < 0.35);
    assert_true(answer(&s, 0, 64).action == LULL_CONTINUE); /* the same question is no second look */
    d = answer(&s, 0, 80);
    assert_true(d.action == LULL_STOP && d.error < 0.8);
    assert_int_equal(answer_with(&s, 0.03, 1, 64).action, LULL_CONTINUE); /* another block: found bad, then good twice */
    assert_true(answer_with(&s, 0, 1, 80).action == LULL_CONTINUE && answer(&s, 1, 100).action == LULL_STOP);
    d = answer(&s, 2, 64);
    assert_true(d.action == LULL_STOP && d.error < 0.943 - 0.4);
    end(&s);
}

/* Errors that come down to the limit need no second look; one that falls far below it at once does: it may be luck. */
static void a_trend_stops(void **unused)
{
    (void)unused;
    struct session s;
    const double limit = 0.943; /* the default of `visible` */
    double stripe = 0.01, error = 0;
    for (int i = 0; i < 20 && !(error > limit && error < 1.1 * limit); i++) {
        stripe *= error > 0 ? 1.05 * limit / error : 1;
        start(&s, "constant", "denoised");
        error = answer_with(&s, stripe, 0, 64).error;
        end(&s);
    }
    start(&s, "constant", "denoised");
    struct lull_decision d = answer_with(&s, stripe, 0, 64);
    assert_true(d.error > limit && d.error < 1.1 * limit && d.action == LULL_CONTINUE && d.next_spp == 80);
    d = answer_with(&s, 0.8 * stripe, 0, 80);
    assert_true(d.error < limit && d.action == LULL_STOP);
    d = answer_with(&s, 4 * stripe, 1, 64);
    assert_true(d.error > 2 * limit && d.action == LULL_CONTINUE);
    d = answer_with(&s, 0.8 * stripe, 1, 128);
    assert_true(d.error < limit && d.action == LULL_CONTINUE && d.next_spp == 160);
    end(&s);
}

/* What it says that the first look is at. */
static uint64_t first_look(const char *error, const char *first_spp)
{
    struct lull_pair pairs[] = {{"library", stub}, {"error", error}, {"first-spp", first_spp}};
    struct lull_requirements needs = {.struct_size = sizeof needs};
    struct lull_instance *in = NULL;
    assert_int_equal(criterion()->create(&host, pairs, first_spp ? 3 : 2, sizeof pairs[0], &in, NULL), LULL_OK);
    assert_int_equal(criterion()->requirements(in, &needs, NULL), LULL_OK);
    criterion()->destroy(in);
    return needs.first_spp;
}

static void drafts_are_looked_at_earlier(void **unused)
{
    (void)unused;
    setenv("OIDN_STUB", "constant", 1);
    assert_int_equal(first_look("0.5", NULL), 64);
    assert_int_equal(first_look("2", NULL), 64);
    assert_int_equal(first_look("3", NULL), 42);
    assert_int_equal(first_look("4", NULL), 32);
    assert_int_equal(first_look("50", NULL), 16);
    assert_int_equal(first_look("4", "50"), 50);
}

/* The frame's edge is no edge to the denoiser: a block that ends there has the error that it has in a larger frame, whose
 * pixels are its own mirrored on. */
static void mirrored_beyond_the_frame(void **unused)
{
    (void)unused;
    enum { BW = 117, BH = 105 };
    static double small[2][BW * BH][3];
    struct session s;
    make(0.4, 0.1, 0.02);
    setenv("OIDN_STUB", "box", 1);
    begin(&s, BW, BH, "denoised", GIVEN, 0);
    double alone = answer(&s, 0, 64).error;
    end(&s);
    memcpy(small[0], color, sizeof small[0]);
    memcpy(small[1], half, sizeof small[1]);
    for (int i = 0; i < PIXELS; i++) {
        const int x = i % W, y = i / W, u = x < BW ? x : 2 * (BW - 1) - x, v = y < BH ? y : abs(2 * (BH - 1) - y);
        memcpy(color[i], small[0][v * BW + u], sizeof color[i]);
        memcpy(half[i], small[1][v * BW + u], sizeof half[i]);
    }
    begin(&s, W, H, "denoised", GIVEN, 0);
    assert_true(alone > 0 && answer(&s, 0, 64).error == alone);
    end(&s);
}

/* Stripes far below the noise, which the denoiser wipes away: the halves agree, only crossing them shows it. */
static void stripes_below_the_noise(void **unused)
{
    (void)unused;
    struct session s;
    make(0.4, 0.015, 0.05);
    start(&s, "box", "denoised");
    struct lull_decision d = answer(&s, 0, 64);
    assert_int_equal(d.action, LULL_CONTINUE);
    const double with = said_crossed;
    assert_true(with > 1.6 && d.error >= with - 0.006); /* of what is said, two digits */
    make(0.4, 0, 0.05);
    answer(&s, 1, 64);
    assert_true(said_crossed < 0.75 * with);
    end(&s);
    make(0.4, 0.015, 0.02); /* less noise: the halves say that it is good */
    start(&s, "constant", "denoised");
    d = answer(&s, 0, 64);
    assert_true(said_halves == 0 && said_crossed > 1.5 && d.action == LULL_CONTINUE);
    end(&s);
}

/* A small place where the denoiser fails counts, though the patch around it is right. */
static void a_small_place(void **unused)
{
    (void)unused;
    struct session s;
    make(0.5, 0, 0.004);
    start(&s, "constant", "denoised");
    answer(&s, 0, 64);
    const double right = said_crossed;
    for (int y = 30; y < 42; y++)
        for (int x = 30; x < 42; x++)
            for (int c = 0; c < 3; c++)
                color[y * W + x][c] += 0.05, half[y * W + x][c] += 0.05;
    answer(&s, 0, 65);
    assert_true(said_crossed > 1.1 && said_crossed > 3 * right);
    end(&s);
}

/* One bright sample is in one half alone: what the mean shows of it counts, not half of what the half shows, L* being concave.
 * 0.55 on 0.1 is 41.3 of L*, the kernel leaves 0.325 of it in the middle; half the halves' difference would be 31. */
static void a_speck(void **unused)
{
    (void)unused;
    struct session s;
    make(0.1, 0, 0);
    for (int c = 0; c < 3; c++)
        color[20 * W + 20][c] = 0.55, half[20 * W + 20][c] = 1;
    start(&s, "identity", "denoised");
    answer(&s, 0, 64);
    const double patch = 59 * 53, block = 117 * 105;
    const double seen = 41.3 * 0.325 / sqrt(2) * pow(1.01 / patch, 1.0 / 6) / 2 / 0.261835 * (1 + 1.94 / sqrt(block));
    assert_true(fabs(said_halves - seen) < 0.03 * seen);
    end(&s);
}

/* A denoiser that blurs an edge is wrong there, on few of the pixels around. */
static void an_edge(void **unused)
{
    (void)unused;
    struct session s;
    make(0.2, 0, 0.01);
    for (int i = 0; i < PIXELS; i++)
        for (int c = 0; c < 3 && i % W % 117 >= 60; c++)
            color[i][c] += 0.1, half[i][c] += 0.1;
    start(&s, "box", "denoised");
    answer(&s, 0, 64);
    printf("# figure edge: %.2f by halves, %.2f crossed\n", said_halves, said_crossed);
    assert_true(said_crossed > 3);
    end(&s);
}

/* Where the denoiser is wrong, the blend is the noisy picture: its error falls with the noise. */
static void the_blend_is_no_worse_than_the_noise(void **unused)
{
    (void)unused;
    struct session s;
    make(0.4, 0.02, 0.0005);
    start(&s, "box", "denoised");
    assert_true(answer(&s, 0, 1000).error > 1.5);
    end(&s);
    start(&s, "box", "blend");
    assert_true(answer(&s, 0, 1000).error < 0.5);
    end(&s);
}

/* What is really there, at every sample of both halves, and below the noise; the denoiser wipes it away. */
static void thin_and_bright(void **unused)
{
    (void)unused;
    static const char *const what[] = {"nothing", "hair", "glints"};
    double crossed[3];
    for (int k = 0; k < 3; k++) {
        struct session s;
        make(0.3, 0, 0.02);
        for (int i = 0; i < PIXELS; i++) {
            const int x = i % W, y = i / W;
            const double more = k == 1 && (x + 3 * y) % 41 < 2 ? 0.06 : k == 2 && x % 13 == 5 && y % 11 == 4 ? 0.25 : 0;
            for (int c = 0; c < 3; c++)
                color[i][c] += more, half[i][c] += more;
        }
        start(&s, "constant", "denoised");
        for (int i = 0; i < PIXELS; i++) /* that the denoiser always says 0.5 is right but for these */
            for (int c = 0; c < 3; c++)
                color[i][c] += 0.2, half[i][c] += 0.2;
        const struct lull_decision d = answer(&s, 0, 64);
        crossed[k] = said_crossed;
        printf("# figure %s: %.2f by halves, %.2f crossed\n", what[k], said_halves, said_crossed);
        assert_true(said_halves == 0 && (k == 0 || (d.error > 1 && crossed[k] > 1.5 * crossed[0])));
        end(&s);
    }
}

/* Light that comes late: the first look finds nothing, the second one sample's light in one half, and goes on. */
static void late_light(void **unused)
{
    (void)unused;
    struct session s;
    make(0.5, 0, 0.002);
    start(&s, "identity", "blend");
    assert_true(answer(&s, 0, 64).error < 0.9);
    for (int i = 0; i < 40; i++)
        for (int c = 0; c < 3; c++)
            half[(30 + i / 8) * W + 40 + i % 8][c] += 0.3, color[(30 + i / 8) * W + 40 + i % 8][c] += 0.15;
    const struct lull_decision d = answer(&s, 0, 80);
    assert_true(d.action == LULL_CONTINUE && d.error > 1);
    make(0.5, 0, 0.002); /* what was low once must be low twice again */
    assert_int_equal(answer(&s, 0, 160).action, LULL_CONTINUE);
    assert_int_equal(answer(&s, 0, 200).action, LULL_STOP);
    end(&s);
}

/* A frame of 4,000 x 11 pixels, whose blocks lie on no grid of 16. */
static void a_wide_frame(void **unused)
{
    (void)unused;
    struct session s;
    make(0.4, 0, 0.02);
    setenv("OIDN_STUB", "box", 1);
    begin(&s, WIDE, 11, "blend", GIVEN, 0);
    assert_int_equal(s.blocks, (WIDE + 116) / 117);
    for (uint32_t i = 0; i < s.blocks; i += 16)
        assert_true(answer(&s, i, 64).error > 0.05);
    end(&s);
}

/* --- what must do no harm ---------------------------------------------------------------------------------------------- */

static void hard_pixels(void **unused)
{
    (void)unused;
    static const char *const kinds[] = {"identity", "box", "nan"};
    for (size_t k = 0; k < 3; k++) {
        struct session s;
        start(&s, kinds[k], "blend");
        make(1e6, 1e5, 1e4); /* all white */
        struct lull_decision d = answer(&s, 0, 64);
        assert_true(d.error == 0 || !strcmp(kinds[k], "nan"));
        make(0.4, 0, 0.0005);
        for (int c = 0; c < 3; c++)
            half[50 * W + 50][c] = 2e6, color[50 * W + 50][c] = 1e6; /* one sample */
        d = answer(&s, 1, 64);
        d = answer(&s, 0, 80);
        assert_true(d.action == LULL_CONTINUE && isfinite(d.error));
        make(0, 0, 0);
        d = answer(&s, 2, 64);
        assert_true(d.error == 0);
        make(0.4, 0, 0.0005);
        half[20 * W + 150][0] = (double)NAN, color[21 * W + 150][1] = (double)INFINITY, color[22 * W + 150][2] = 1e300;
        d = answer(&s, 1, 80);
        assert_true((d.flags & LULL_DECISION_BAD_INPUT) && isfinite(d.error));
        end(&s);
    }
}

static void sizes(void **unused)
{
    (void)unused;
    static const int side[][2] = {{1, 1}, {15, 15}, {1, 200}, {118, 3}, {33, 106}};
    for (size_t k = 0; k < sizeof side / sizeof side[0]; k++) {
        struct session s;
        make(0.4, 0, 0.02);
        setenv("OIDN_STUB", "box", 1);
        begin(&s, side[k][0], side[k][1], "blend", GIVEN, 0);
        for (uint32_t i = 0; i < s.blocks; i++)
            assert_true(isfinite(answer(&s, i, 64).error));
        end(&s);
    }
}

/* Evaluate fails, blocks go on, and nothing is remembered. */
static void failing_denoisers(void **unused)
{
    (void)unused;
    static const struct {
        const char *kind, *text;
        int32_t code;
    } kinds[] = {{"commit", "cannot prepare its filter", LULL_E_INTERNAL},
                 {"crash", "ended its process", LULL_E_INTERNAL},
                 {"memory", "out of memory", LULL_E_MEMORY},
                 {"endless", "cancelled", LULL_E_CANCELLED}};
    make(0.5, 0, 0.004);
    for (size_t k = 0; k < 4; k++) {
        struct session s;
        struct lull_error err = {.struct_size = sizeof err};
        struct lull_decision d;
        start(&s, kinds[k].kind, "denoised");
        cancelling = !strcmp(kinds[k].kind, "endless");
        assert_int_equal(ask(&s, 0, 64, &d, &err), kinds[k].code);
        assert_non_null(strstr(err.message, kinds[k].text));
        assert_int_equal(ask(&s, 0, 64, &d, NULL), kinds[k].code);
        cancelling = 0;
        setenv("OIDN_STUB", "constant", 1);
        assert_int_equal(answer(&s, 0, 64).action, LULL_STOP); /* the first look */
        end(&s);
    }
}

static void no_library(void **unused)
{
    (void)unused;
    static const struct {
        const char *library, *kind, *text;
    } cases[] = {{stub, "version", "library: Open Image Denoise is of version 3.0.1: version 2 is needed"},
                 {stub, "no-device", "library: Open Image Denoise cannot make a device"},
                 {"/no/such", "identity", "library: /no/such: no Open Image Denoise 2 there"}};
    for (size_t k = 0; k < 3; k++) {
        struct lull_pair pair = {"library", cases[k].library};
        struct lull_error err = {.struct_size = sizeof err};
        struct lull_instance *in = NULL;
        setenv("OIDN_STUB", cases[k].kind, 1);
        assert_int_equal(criterion()->create(&host, &pair, 1, sizeof pair, &in, &err), LULL_E_VALUE);
        assert_null(in);
        if (strncmp(err.message, cases[k].text, strlen(cases[k].text)))
            fail_msg("%s", err.message);
    }
}

static void warns_once(void **unused)
{
    (void)unused;
    struct session s;
    make(0.4, 0.02, 0.004);
    setenv("OIDN_STUB", "identity", 1);
    begin(&s, W, H, "blend", GIVEN | LULL_PLANE_BIT(LULL_PLANE_NORMAL), 0);
    assert_int_equal(warnings, 0);
    end(&s);
    begin(&s, W, H, "blend", GIVEN, 0);
    assert_int_equal(warnings, 1);
    assert_non_null(strstr(warning, "ALBEDO and NORMAL"));
    answer(&s, 0, 64);
    memcpy(half, color, sizeof half);
    for (uint32_t i = 0; i < 3; i++)
        assert_true(answer(&s, i, 100).action == LULL_CONTINUE);
    assert_int_equal(warnings, 2);
    assert_non_null(strstr(warning, "COLOR and HALF are the same"));
    end(&s);
    begin(&s, W, H, "blend", GIVEN | LULL_PLANE_BIT(LULL_PLANE_NORMAL), LULL_FRAME_SHARED);
    assert_int_equal(warnings, 1);
    end(&s);
}

/* What lies around a block is denoised with it; but the same question gets the same answer. */
static void neighbours(void **unused)
{
    (void)unused;
    struct session s;
    make(0.4, 0, 0.01);
    start(&s, "box", "denoised");
    const double before = answer(&s, 0, 64).error;
    for (int y = 0; y < H; y++)
        for (int x = 117; x < 120; x++)
            for (int c = 0; c < 3; c++)
                color[y * W + x][c] = half[y * W + x][c] = 5;
    assert_true(answer(&s, 0, 64).error == before);
    assert_true(answer(&s, 0, 65).error > 2 * before);
    end(&s);
}

int main(void)
{
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0 || api_folder(stub, sizeof stub, "../oidn-stub") != 0)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_looks_stop),
        cmocka_unit_test(a_trend_stops),
        cmocka_unit_test(drafts_are_looked_at_earlier),
        cmocka_unit_test(mirrored_beyond_the_frame),
        cmocka_unit_test(stripes_below_the_noise),
        cmocka_unit_test(a_small_place),
        cmocka_unit_test(a_speck),
        cmocka_unit_test(an_edge),
        cmocka_unit_test(the_blend_is_no_worse_than_the_noise),
        cmocka_unit_test(thin_and_bright),
        cmocka_unit_test(late_light),
        cmocka_unit_test(a_wide_frame),
        cmocka_unit_test(hard_pixels),
        cmocka_unit_test(sizes),
        cmocka_unit_test(failing_denoisers),
        cmocka_unit_test(no_library),
        cmocka_unit_test(warns_once),
        cmocka_unit_test(neighbours),
    };
    return cmocka_run_group_tests_name("denoised_criterion", tests, NULL, NULL);
}
