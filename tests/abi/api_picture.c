/*
 * The denoised picture of a frame (lull_host_denoise) with denoisers whose answers are known (tests/stub/oidn.c), through the
 * library that hosts load.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <lull/host_draft.h>

#include "support/api_folders.h"
#include "support/splitmix.h"

enum { W = 64, H = 48, N = W * H, SPP = 16, HALF = 6 };

static char stub[2048];
static int32_t (*begin)(const struct lull_host_config *, struct lull_host_criterion *, struct lull_host_frame **,
                        struct lull_error *);
static void (*end)(struct lull_host_frame *);
static struct lull_host_blocks *(*blocks_of)(struct lull_host_frame *);
static int32_t (*denoise)(const struct lull_host_frame *, const struct lull_host_view *, const struct lull_host_denoising *,
                          const struct lull_host_picture *, struct lull_error *);
static int32_t (*denoiser)(const char *, struct lull_error *);

static double color[N][3], half[N][3]; /* sums */
static float rgb[N][3], clean[N][3], weight[N];
static struct lull_host_frame *frame;
static struct lull_plane planes[LULL_PLANE_COUNT];
static struct lull_host_view view;

static struct lull_plane plane_of(const void *data, int32_t normaliser)
{
    return (struct lull_plane){.data = data,
                               .stride_x = 3 * sizeof(double),
                               .stride_y = 3 * sizeof(double) * W,
                               .stride_c = sizeof(double),
                               .scale = 1,
                               .type = LULL_TYPE_F64,
                               .normaliser = normaliser,
                               .channels = 3};
}

/* Samples of deviation sigma around truth(x) in blocks of 16 px. */
static void render(double sigma, double (*truth)(int x))
{
    uint64_t state = 3;
    const struct lull_host_config config = {.struct_size = sizeof config,
                                            .flags = LULL_HOST_UNIFORM,
                                            .width = W,
                                            .height = H,
                                            .block_width = 16,
                                            .block_height = 16,
                                            .planes = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF),
                                            .spp_min = SPP,
                                            .spp_max = SPP};
    memset(color, 0, sizeof color);
    memset(half, 0, sizeof half);
    for (int i = 0; i < N; i++)
        for (int s = 0; s < SPP; s++) {
            double v = truth(i % W) + sigma * splitmix_gauss(&state);
            for (int c = 0; c < 3; c++) {
                color[i][c] += v;
                half[i][c] += s < HALF ? v : 0;
            }
        }
    assert_int_equal(begin(&config, NULL, &frame, NULL), LULL_OK);
    struct lull_host_blocks *b = blocks_of(frame);
    for (uint32_t i = 0; i < b->count; i++)
        b->list[i].spp = SPP, b->list[i].half_spp = HALF;
    memset(planes, 0, sizeof planes);
    planes[LULL_PLANE_COLOR] = plane_of(color, LULL_NORM_SPP);
    planes[LULL_PLANE_HALF] = plane_of(half, LULL_NORM_HALF_SPP);
    view = (struct lull_host_view){
        .struct_size = sizeof view, .plane_count = LULL_PLANE_COUNT, .x1 = W, .y1 = H, .planes = planes};
}

static int32_t make(const char *kind, uint32_t flags, struct lull_error *err)
{
    const struct lull_host_denoising how = {.struct_size = sizeof how, .flags = flags, .threads = 1, .library = stub};
    const struct lull_host_picture out = {.struct_size = sizeof out, .rgb = rgb[0], .denoised = clean[0], .weight = weight};
    memset(rgb, 0xff, sizeof rgb);
    setenv("OIDN_STUB", kind, 1);
    return denoise(frame, &view, &how, &out, err);
}

static double flat(int x) { return 0.2 + 0 * x; }

static double stripes(int x) { return x % 2 ? 0.4 : 0.1; }

/* Root mean square difference from the truth. */
static double error_of(float (*picture)[3], double (*truth)(int x))
{
    double sum = 0;
    for (int i = 0; i < N; i++)
        sum += ((double)picture[i][0] - truth(i % W)) * ((double)picture[i][0] - truth(i % W)) / N;
    return sqrt(sum);
}

static double mean_weight(void)
{
    double sum = 0;
    for (int i = 0; i < N; i++) {
        assert_true(weight[i] >= 0 && weight[i] <= 1);
        sum += (double)weight[i] / N;
    }
    return sum;
}

static void blend_trusts_a_denoiser_that_is_right(void **state)
{
    (void)state;
    const double noise = 0.1 / sqrt(SPP);
    render(0.1, flat);
    assert_int_equal(make("box", 0, NULL), LULL_OK);
    assert_true(error_of(clean, flat) < 0.3 * noise);
    assert_true(error_of(rgb, flat) < 0.4 * noise);
    assert_true(mean_weight() < 0.3);
    end(frame);
}

/* The box removes the stripes: the blend keeps them. */
static void blend_keeps_what_a_denoiser_removes(void **state)
{
    (void)state;
    const double noise = 0.1 / sqrt(SPP);
    render(0.1, stripes);
    assert_int_equal(make("box", 0, NULL), LULL_OK);
    assert_true(error_of(clean, stripes) > 4 * noise);
    assert_true(error_of(rgb, stripes) < 1.1 * noise);
    assert_true(mean_weight() > 0.95);
    end(frame);
}

/* A speck of one sample is removed from its half, and would be kept in the mean of all, where it stands out less. */
static void specks_are_removed_from_halves(void **state)
{
    (void)state;
    const int at = 20 * W + 30;
    render(0, flat);
    for (int c = 0; c < 3; c++)
        color[at][c] += 6, half[at][c] += 6; /* the half has 1.2, the mean 0.575 */
    assert_int_equal(make("despeckle", 0, NULL), LULL_OK);
    assert_true(clean[at][0] < 0.25f && rgb[at][0] < 0.25f);
    assert_int_equal(make("despeckle", LULL_DENOISE_FULL, NULL), LULL_OK);
    assert_true(clean[at][0] > 0.5f);
    end(frame);
}

static void every_pixel_is_the_blend(void **state)
{
    (void)state;
    render(0.3, stripes);
    assert_int_equal(make("box", 0, NULL), LULL_OK);
    for (int i = 0; i < N; i++)
        for (int c = 0; c < 3; c++) {
            double noisy = color[i][c] / SPP, w = (double)weight[i];
            assert_true(fabs((double)rgb[i][c] - (w * noisy + (1 - w) * (double)clean[i][c])) < 1e-6);
        }
    end(frame);
}

static void full_is_the_denoised_picture(void **state)
{
    (void)state;
    render(0.1, stripes);
    planes[LULL_PLANE_HALF].data = NULL;
    assert_int_equal(make("constant", LULL_DENOISE_FULL, NULL), LULL_OK);
    assert_memory_equal(rgb, clean, sizeof rgb);
    assert_true(fabs((double)rgb[N / 2][1] - 0.5) < 1e-6 && mean_weight() == 0);
    struct lull_error e = {.struct_size = sizeof e};
    assert_int_equal(make("constant", 0, &e), LULL_E_INVALID);
    assert_string_equal(e.message, "a denoised picture needs the plane COLOR, a blend HALF besides");
    end(frame);
}

/* The denoiser gets the means of albedo and normal, pixel by pixel, and no normal without albedo. */
static void auxiliary_planes(void **state)
{
    (void)state;
    static double albedo[N][3], normal[N][3];
    render(0.1, flat);
    for (int i = 0; i < N; i++)
        for (int c = 0; c < 3; c++) {
            albedo[i][c] = SPP * (i % W + c) / (W + 3.0);
            normal[i][c] = SPP * (i / W - c) / (H + 3.0);
        }
    planes[LULL_PLANE_ALBEDO] = plane_of(albedo, LULL_NORM_SPP);
    planes[LULL_PLANE_NORMAL] = plane_of(normal, LULL_NORM_SPP);
    for (int with = 1; with >= 0; with--) {
        if (!with)
            planes[LULL_PLANE_ALBEDO].data = NULL;
        assert_int_equal(make("auxiliary", LULL_DENOISE_FULL, NULL), LULL_OK);
        for (int i = 0; i < N; i++)
            for (int c = 0; c < 3; c++)
                assert_true(fabs((double)rgb[i][c] - with * (albedo[i][c] + normal[i][c]) / SPP) < 1e-6);
    }
    end(frame);
}

/* The denoised picture of a denoiser that says what its albedo is, which is noisy about the truth: how noisy. */
static double error_by_albedo(void)
{
    assert_int_equal(make("auxiliary", 0, NULL), LULL_OK);
    return error_of(clean, flat);
}

/* Clean auxiliaries count but in a draft that is done, whose blocks have all been stopped although one of them shows an
 * error: not where that is not known of its samples, or a limit has ended a block. */
static void clean_auxiliaries_but_in_drafts(void **state)
{
    (void)state;
    static double albedo[N][3];
    uint64_t random = 9;
    render(0.05, flat);
    struct lull_host_block *b = blocks_of(frame)->list;
    const uint32_t last = blocks_of(frame)->count - 1;
    for (int i = 0; i < N; i++)
        for (int c = 0; c < 3; c++)
            albedo[i][c] = SPP * (flat(0) + 0.05 * splitmix_gauss(&random));
    planes[LULL_PLANE_ALBEDO] = plane_of(albedo, LULL_NORM_SPP);
    const double cleaned = error_by_albedo();
    for (uint32_t i = 0; i <= last; i++)
        b[i].reason = LULL_REASON_CRITERION, b[i].asked = 1, b[i].asked_spp = SPP, b[i].error = 1;
    assert_true(error_by_albedo() == cleaned);
    b[0].error = 1.01;
    const double as_it_is = error_by_albedo();
    assert_true(fabs(as_it_is - 0.05) < 0.002 && cleaned < 0.5 * as_it_is);
    b[last].error = (double)NAN;
    assert_true(error_by_albedo() == cleaned);
    b[last].error = 1, b[last].asked_spp = SPP - 1;
    assert_true(error_by_albedo() == cleaned);
    b[last].asked_spp = SPP, b[last].reason = LULL_REASON_SPP_MAX;
    assert_true(error_by_albedo() == cleaned);
    end(frame);
}

/* A block without samples is black; one whose halves cannot be told apart is the denoised picture. */
static void blocks_without_halves(void **state)
{
    (void)state;
    render(0.1, stripes);
    struct lull_host_block *b = blocks_of(frame)->list;
    b[0].spp = b[0].half_spp = 0;
    b[11].half_spp = SPP;
    assert_int_equal(make("box", 0, NULL), LULL_OK);
    assert_true(rgb[0][0] == 0 && rgb[15 * W + 15][2] == 0 && clean[15 * W + 15][0] == 0 && rgb[16][0] > 0);
    assert_true(clean[N - 1][0] == rgb[N - 1][0] && rgb[N - 1][0] > 0);
    end(frame);
}

static void failures_are_one_line(void **state)
{
    (void)state;
    static const struct {
        const char *kind, *says;
    } cases[] = {{"crash", "Open Image Denoise ended its process"},
                 {"commit", "cannot prepare its filter"},
                 {"memory", "memory"},
                 {"version", "version 3.0.1"}};
    struct lull_error e = {.struct_size = sizeof e};
    render(0.1, flat);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        int32_t code = make(cases[k].kind, 0, &e);
        if ((code != LULL_E_INVALID && code != LULL_E_MEMORY) || !strstr(e.message, cases[k].says) ||
            strchr(e.message, '\n'))
            fail_msg("%s: %d, %s", cases[k].kind, code, e.message);
    }
    assert_int_equal(denoiser("/nowhere", &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "/nowhere"));
    setenv("OIDN_STUB", "identity", 1);
    assert_int_equal(denoiser(stub, &e), LULL_OK);
    end(frame);
}

int main(void)
{
    char path[2048];
    const struct CMUnitTest tests[] = {cmocka_unit_test(blend_trusts_a_denoiser_that_is_right),
                                       cmocka_unit_test(blend_keeps_what_a_denoiser_removes),
                                       cmocka_unit_test(specks_are_removed_from_halves),
                                       cmocka_unit_test(every_pixel_is_the_blend),
                                       cmocka_unit_test(full_is_the_denoised_picture),
                                       cmocka_unit_test(auxiliary_planes),
                                       cmocka_unit_test(clean_auxiliaries_but_in_drafts),
                                       cmocka_unit_test(blocks_without_halves),
                                       cmocka_unit_test(failures_are_one_line)};
    if (api_folder(path, sizeof path, "../../lib/liblull-host.so.1") != 0 ||
        api_folder(stub, sizeof stub, "../oidn-stub") != 0)
        return 1;
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    *(void **)&begin = dlsym(library, "lull_host_begin");
    *(void **)&end = dlsym(library, "lull_host_end");
    *(void **)&blocks_of = dlsym(library, "lull_host_blocks_of");
    *(void **)&denoise = dlsym(library, "lull_host_denoise");
    *(void **)&denoiser = dlsym(library, "lull_host_denoiser");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
