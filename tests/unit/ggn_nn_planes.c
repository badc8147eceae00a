/* The kernels that work plane by plane, in every instruction set, against the naive oracle; SSIM. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <string.h>

#include "nn/hash.h"
#include "nn/ssim.h"
#include "support/ggn_nn_near.h"

enum { ROOM = 6000, SENTINEL = 77 };

static float ka[ROOM], kb[ROOM], kc[ROOM], got[ROOM], before[ROOM];

static double wanted[ROOM];

/* Hashed inputs; an output that holds what may be added to, and elements beyond its rows that nobody may touch. */
static void fresh(uint32_t seed)
{
    for (uint32_t i = 0; i < ROOM; i++) {
        ka[i] = (float)rnd(i, seed);
        kb[i] = (float)rnd(i, seed + 1);
        kc[i] = (float)rnd(i, seed + 2);
        before[i] = got[i] = (float)rnd(i, seed + 3);
        wanted[i] = (double)got[i];
    }
}

static void compare(const char *what, enum base_isa isa, int w, double tolerance)
{
    for (int i = 0; i < ROOM; i++)
        if (!(fabs((double)got[i] - wanted[i]) <= tolerance * fmax(1, fabs(wanted[i]))))
            fail_msg("%s on %s, width %d, element %d: %.9g, not %.9g", what, base_isa_name(isa), w, i, (double)got[i],
                     wanted[i]);
}

static void scalar(const char *what, enum base_isa isa, int w, double value, double want)
{
    if (!(fabs(value - want) <= F32_TOLERANCE * fmax(1, fabs(want))))
        fail_msg("%s on %s, width %d: %.9g, not %.9g", what, base_isa_name(isa), w, value, want);
}

/* Sums and maps of a plane of h × w with rows of w + 2. */
static void check_plane(const struct ggn_kernels *k, int h, int w)
{
    const int row = w + 2;
    double sum = 0, square = 0, sums[2], d_sum = 0, dx_sum = 0, act_sum = 0;

    for (int add = 0; add < 2; add++) {
        fresh((uint32_t)(10 * w + add));
        sum = square = d_sum = dx_sum = 0;
        for (int i = 0; i < h * w; i++) {
            const int at = i / w * row + i % w;
            const double a = (double)ka[at], b = (double)kb[at], old = add ? (double)before[at] : 0;
            sum += a;
            square += (a - 0.25) * (a - 0.25);
            d_sum += b;
            dx_sum += b * (a - 0.125);
            wanted[at] = old + 0.5 * b - 0.75 * a + 0.3;
        }
        scalar("sum", k->isa, w, k->sum(ka, h, w, row), sum);
        scalar("sum of squares", k->isa, w, k->sum_sq(ka, 0.25, h, w, row), square);
        k->bn_sums(sums, kb, ka, 0.125f, h, w, row);
        scalar("sum of gradients", k->isa, w, sums[0], d_sum);
        scalar("sum of products", k->isa, w, sums[1], dx_sum);
        k->bn_grad(got, kb, ka, 0.5f, -0.75f, 0.3f, add, h, w, row);
        compare("bn_grad", k->isa, w, F32_TOLERANCE);
        fresh((uint32_t)(10 * w + add));
        for (int i = 0; i < h * w; i++) {
            const int at = i / w * row + i % w;
            wanted[at] = (add ? (double)before[at] : 0) + (double)kb[at] * (ka[at] > 0 ? 1 : 0.2);
        }
        k->lrelu_grad(got, kb, ka, 0.2f, add, h, w, row);
        compare("lrelu_grad", k->isa, w, F32_TOLERANCE);
        fresh((uint32_t)(10 * w + add));
        for (int i = 0; i < h * w; i++) {
            const int at = i / w * row + i % w;
            wanted[at] = (add ? (double)before[at] : 0) + (double)kb[at] * (double)ka[at] * (1 - (double)ka[at]);
        }
        k->sigmoid_grad(got, kb, ka, add, h, w, row);
        compare("sigmoid_grad", k->isa, w, F32_TOLERANCE);
    }
    fresh((uint32_t)w);
    for (int i = 0; i < h * w; i++)
        wanted[i / w * row + i % w] = 1.5 * (double)ka[i / w * row + i % w] - 0.25;
    k->affine(got, ka, 1.5f, -0.25f, h, w, row);
    compare("affine", k->isa, w, F32_TOLERANCE);
    for (int i = 0; i < h * w; i++)
        wanted[i / w * row + i % w] = fmax((double)ka[i / w * row + i % w], 0.2 * (double)ka[i / w * row + i % w]);
    k->lrelu(got, ka, 0.2f, h, w, row);
    compare("lrelu", k->isa, w, F32_TOLERANCE);
    for (int i = 0; i < h * w; i++)
        wanted[i / w * row + i % w] =
            1 / (1 + exp(-100 * (double)(kc[i / w * row + i % w] = 100 * ka[i / w * row + i % w]) / 100));
    k->sigmoid(got, kc, h, w, row);
    compare("sigmoid", k->isa, w, 3e-7);
    for (int i = 0; i < h * w; i++) {
        const int at = i / w * row + i % w;
        wanted[at] = (double)got[at] * (ka[at] > 0 ? 1 : 0.2);
        act_sum += wanted[at];
    }
    scalar("sum after the activation", k->isa, w, k->act_grad(got, ka, 0.2f, h, w, row), act_sum);
    compare("act_grad", k->isa, w, F32_TOLERANCE);
}

/* Pooling of 2h(+1) × 2w(+1), its gradient to the first of the largest; ×2 bilinear and its adjoint. */
static void check_scaling(const struct ggn_kernels *k, int hx, int wx)
{
    const int h = hx / 2, w = wx / 2, row = w + 2, row_x = wx + 3;

    fresh((uint32_t)(hx * wx));
    for (int i = 0; i < ROOM; i++)
        ka[i] = (float)floor(4 * (double)ka[i]); /* several that are the largest */
    for (int i = 0; i < h * w; i++) {
        const float *x = ka + i / w * 2 * row_x + i % w * 2;
        wanted[i / w * row + i % w] = (double)fmaxf(fmaxf(x[0], x[1]), fmaxf(x[row_x], x[row_x + 1]));
    }
    k->maxpool2(got, ka, h, w, row, row_x);
    compare("maxpool2", k->isa, w, 0);
    memcpy(kc, got, sizeof kc);
    for (int add = 0; add < 2; add++) {
        memcpy(got, before, sizeof got);
        for (int i = 0; i < ROOM; i++)
            wanted[i] = i / row_x < hx && i % row_x < wx && !add ? 0 : (double)before[i];
        for (int i = 0; i < h * w; i++) {
            const int at = i / w * 2 * row_x + i % w * 2, places[] = {at, at + 1, at + row_x, at + row_x + 1};
            int first = 0;
            while (ka[places[first]] != kc[i / w * row + i % w])
                first++;
            wanted[places[first]] += (double)kb[i / w * row + i % w];
        }
        k->maxpool2_grad(got, kb, ka, kc, add, hx, wx, row, row_x);
        compare("maxpool2_grad", k->isa, w, F32_TOLERANCE);
    }
}

static double tent(int y, int i, int n) /* share of sample i of n in output y of 2n */
{
    const int near = y / 2, far = y & 1 ? near + 1 : near - 1, clamped = far < 0 ? 0 : far >= n ? n - 1 : far;
    return 0.75 * (i == near) + 0.25 * (i == clamped);
}

static void check_up(const struct ggn_kernels *k, int h, int w)
{
    const int row = w + 1, row_y = 2 * w + 3;

    fresh((uint32_t)(100 * h + w));
    for (int y = 0; y < 2 * h; y++)
        for (int x = 0; x < 2 * w; x++) {
            double *to = &wanted[y * row_y + x];
            *to = 0;
            for (int i = 0; i < h * w; i++)
                *to += tent(y, i / w, h) * tent(x, i % w, w) * (double)ka[i / w * row + i % w];
        }
    k->up(got, ka, h, w, row_y, row);
    compare("up", k->isa, w, F32_TOLERANCE);
    for (int add = 0; add < 2; add++) {
        fresh((uint32_t)(100 * h + w));
        for (int i = 0; i < h * w; i++) {
            double *to = &wanted[i / w * row + i % w];
            *to = add ? *to : 0;
            for (int p = 0; p < 4 * h * w; p++)
                *to += tent(p / (2 * w), i / w, h) * tent(p % (2 * w), i % w, w) *
                       (double)kb[p / (2 * w) * row_y + p % (2 * w)];
        }
        k->up_grad(got, kb, add, h, w, row_y, row);
        compare("up_grad", k->isa, w, F32_TOLERANCE);
    }
}

static void check_vectors(const struct ggn_kernels *k, int n)
{
    double dot = 0;

    fresh((uint32_t)n);
    for (int i = 0; i < n; i++) {
        dot += (double)ka[i] * (double)kb[i];
        wanted[i] += 0.7 * (double)ka[i];
    }
    scalar("dot", k->isa, n, (double)k->dot(ka, kb, n), dot);
    k->axpy(got, 0.7f, ka, n);
    compare("axpy", k->isa, n, F32_TOLERANCE);
    for (int i = 0; i < n; i++) {
        double g = (double)kb[i], m = 0.5 * (double)ka[i] + 0.5 * g, v = 0.9 * (double)fabsf(kc[i]) + 0.1 * g * g;
        kc[i] = fabsf(kc[i]);
        wanted[i] = (double)got[i] - 0.01 * (1.5 * m) / (sqrt(2.5 * v) + 0.125);
    }
    k->adam(got, kb, ka, kc, n, 0.01f, 0.5f, 0.9f, 1.5f, 2.5f, 0.125f);
    compare("adam", k->isa, n, F32_TOLERANCE);
    for (int lanes = k->lanes, i = 0; i < n; i++) {
        double sum = 0;
        for (int lane = 0; lane < lanes; lane++)
            sum += (double)ka[i * lanes + lane];
        wanted[i] = sum;
    }
    k->lane_sums(got, ka, n);
    compare("lane_sums", k->isa, n, F32_TOLERANCE);
}

static void test_planes(void **state)
{
    for (int isa = 0; isa < BASE_ISA_COUNT; isa++) {
        const struct ggn_kernels *k = ggn_kernels_for((enum base_isa)isa);
        for (int w = 1; w < 50 && k; w += w < 10 ? 1 : 7) {
            check_plane(k, 3, w);
            check_scaling(k, 4 + w % 2, 2 + w);
            check_up(k, 1 + w % 4, 1 + w / 3);
            check_vectors(k, 3 * w);
        }
    }
    (void)state;
}

/* The mean over planes, more than are kept at a time, is that of their own means; each by the definition (Wang et al. 2004: an
 * 11 × 11 Gaussian of 1.5, zeros beyond the border). Any threads. */
static void test_ssim(void **state)
{
    enum { H = 9, W = 14, ROW = W + 3, N = 67 };
    static float x[N][H * ROW], y[N][H * ROW], dx[N][H * ROW];
    const float *px[N], *py[N];
    float *pd[N];
    struct base_threads *threads = base_threads_create(2, NULL);
    struct ggn_ssim *s = ggn_ssim_create(H, W, NULL, NULL), *both = ggn_ssim_create(H, W, threads, NULL);
    double mean = 0, each;

    for (int n = 0; n < N; n++) {
        for (int i = 0; i < H * ROW; i++) {
            x[n][i] = (float)ggn_hash_unit((uint32_t)i, (uint32_t)n);
            y[n][i] = 0.5f * x[n][i] + 0.4f * (float)ggn_hash_unit((uint32_t)i, (uint32_t)n + 100);
        }
        px[n] = x[n];
        py[n] = y[n];
        pd[n] = dx[n];
        double total = 0;
        for (int p = 0; p < H * W; p++) {
            double sum[6] = {0};
            for (int k = -60; k <= 60; k++) {
                const int dy = (k + 60) / 11 - 5, dxx = (k + 60) % 11 - 5, v = p / W + dy, u = p % W + dxx;
                const double g = exp(-(dy * dy + dxx * dxx) / 4.5);
                sum[5] += g;
                if (v < 0 || v >= H || u < 0 || u >= W)
                    continue;
                const double a = (double)x[n][v * ROW + u], b = (double)y[n][v * ROW + u];
                sum[0] += g * a;
                sum[1] += g * b;
                sum[2] += g * a * a;
                sum[3] += g * b * b;
                sum[4] += g * a * b;
            }
            for (int k = 0; k < 5; k++)
                sum[k] /= sum[5];
            total +=
                (2 * sum[0] * sum[1] + 1e-4) * (2 * (sum[4] - sum[0] * sum[1]) + 9e-4) /
                ((sum[0] * sum[0] + sum[1] * sum[1] + 1e-4) * (sum[2] - sum[0] * sum[0] + sum[3] - sum[1] * sum[1] + 9e-4));
        }
        each = ggn_ssim_mean(s, px + n, py + n, NULL, 1, ROW, 0);
        assert_true(fabs(each - total / (H * W)) < 1e-5);
        mean += each / N;
    }
    assert_true(fabs(ggn_ssim_mean(s, px, py, NULL, N, ROW, 0) - mean) < 1e-12);
    each = ggn_ssim_mean(both, px, py, pd, N, ROW, 3);
    assert_true(each == ggn_ssim_mean(s, px, py, NULL, N, ROW, 0));
    const float kept = dx[66][5 * ROW + 3], old = x[66][5 * ROW + 3]; /* a plane of the second lot, by differences */
    x[66][5 * ROW + 3] = old + 0.01f;
    double high = ggn_ssim_mean(s, px, py, NULL, N, ROW, 0);
    x[66][5 * ROW + 3] = old - 0.01f;
    assert_true(fabs((high - ggn_ssim_mean(s, px, py, NULL, N, ROW, 0)) / 0.02 * 3 - (double)kept) <
                0.02 * fabs((double)kept));
    ggn_ssim_destroy(s);
    ggn_ssim_destroy(both);
    base_threads_destroy(threads);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_planes),
        cmocka_unit_test(test_ssim),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
