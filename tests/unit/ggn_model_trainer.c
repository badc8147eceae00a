/* Training steps: they learn, resume bit-exactly, do not depend on threads, and both presets work. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model/trainer.h"
#include "nn/hash.h"

enum { H = 17, W = 21, AREA = H * W, WINDOW = 2, PLANES = 3 * WINDOW, BATCH = 4 };

static struct data {
    float noisy[BATCH * PLANES][AREA], denoised[BATCH * PLANES][AREA], reference[BATCH * 3][AREA];
    const float *p_noisy[BATCH * PLANES], *p_denoised[BATCH * PLANES], *p_reference[BATCH * 3], *p_first[BATCH * 3];
    double label[BATCH];
} data;

static int setup(void **state)
{
    for (int n = 0; n < BATCH; n++) {
        data.label[n] = n & 1;
        for (int c = 0; c < PLANES; c++)
            for (int k = 0; k < AREA; k++) {
                float clean = 0.5f + 0.4f * sinf(0.3f * (float)(k % W) + 0.2f * (float)(k / W) + (float)(n + c % 3));
                float noise = (n & 1 ? 0.4f : 0.02f) * ((float)ggn_hash_unit((uint32_t)k, (uint32_t)(n * 100 + c)) - 0.5f);
                data.noisy[n * PLANES + c][k] = clean + noise;
                data.denoised[n * PLANES + c][k] = clean;
                data.reference[n * 3 + c % 3][k] = clean;
            }
    }
    for (int i = 0; i < BATCH * PLANES; i++) {
        data.p_noisy[i] = data.noisy[i];
        data.p_denoised[i] = data.denoised[i];
    }
    for (int i = 0; i < BATCH * 3; i++) {
        data.p_reference[i] = data.reference[i];
        data.p_first[i] = data.noisy[i / 3 * PLANES + i % 3];
    }
    (void)state;
    return 0;
}

static int with_picture; /* of the networks that are made next */

static struct ggn_trainer *make(enum ggn_preset preset, double lr, struct base_threads *threads)
{
    struct ggn_hyper hyper = {preset, H, W, WINDOW, 4, 6, 4, with_picture, 0, 0};
    struct ggn_train_options options = ggn_train_options_default(preset);
    struct base_err err = {0};

    options.batch = BATCH;
    options.dropout = preset == GGN_PRESET_PAPER;
    for (int net = 0; net < GGN_NETS; net++)
        options.lr[net] = lr;
    struct ggn_trainer *t = ggn_trainer_create(&hyper, &options, threads, &err);
    if (!t)
        fail_msg("%s", err.text);
    return t;
}

static double judge(struct ggn_trainer *t)
{
    struct ggn_batch batch = {.count = BATCH, .noisy = data.p_noisy, .denoised = data.p_denoised, .label = data.label};
    struct base_err err = {0};
    double bce;

    if (ggn_trainer_classifier_step(t, &batch, &bce, NULL, &err))
        fail_msg("%s", err.text);
    return bce;
}

static double denoise(struct ggn_trainer *t)
{
    struct base_err err = {0};
    double loss;

    if (ggn_trainer_denoiser_step(t, data.p_first, data.p_reference, BATCH, &loss, &err))
        fail_msg("%s", err.text);
    return loss;
}

static void test_learns(void **state)
{
    struct ggn_trainer *t = make(GGN_PRESET_LULL, 1e-3, NULL); /* four times as fast the cross-entropy jumps up and down */
    double first = denoise(t), first_bce = judge(t), last = 0, last_bce = 0;

    for (int i = 0; i < 40; i++) {
        last = denoise(t);
        last_bce = judge(t);
    }
    if (!(last < 0.7 * first && last_bce < 0.6 * first_bce))
        fail_msg("1 - SSIM went from %g to %g, cross-entropy from %g to %g", first, last, first_bce, last_bce);
    ggn_trainer_destroy(t);
    (void)state;
}

/* Windows that do not differ, labels that the noise map alone tells; one sample has none. */
static void test_learns_from_the_picture(void **state)
{
    static float picture[BATCH][AREA];
    const float *pictures[BATCH], *same[BATCH * PLANES];
    struct base_err err = {0};
    double bce = 0;

    for (int n = 0; n < BATCH; n++) {
        for (int k = 0; k < AREA; k++)
            picture[n][k] = (n & 1 ? 0.5f : 0.05f) * (float)ggn_hash_unit((uint32_t)k, (uint32_t)(500 + n));
        pictures[n] = n == 2 ? NULL : picture[n];
    }
    for (int i = 0; i < BATCH * PLANES; i++)
        same[i] = data.denoised[i % PLANES];
    struct ggn_batch batch = {.count = BATCH, .noisy = same, .denoised = same, .label = data.label, .noise_map = pictures};
    with_picture = 1;
    struct ggn_trainer *t = make(GGN_PRESET_LULL, 4e-3, NULL);
    with_picture = 0;
    for (int i = 0; i < 40; i++)
        assert_int_equal(ggn_trainer_classifier_step(t, &batch, &bce, NULL, &err), 0);
    if (!(bce < 0.5)) /* log 2 = 0.69 is the least without the picture */
        fail_msg("cross-entropy %g", bce);
    const struct ggn_value *v = &t->graph[GGN_NET_D].value[0];
    for (int n = 0; n < BATCH; n++)
        for (int k = 0; k < AREA; k++) {
            int at = k / W * v->row + k % W;
            assert_true(ggn_exec_plane(t->d, 0, n, 2)[at] == (n == 2 ? 0 : picture[n][k]));
            assert_true(ggn_exec_plane(t->d, 0, n, 3)[at] == (n == 2 ? 0 : 1));
        }
    ggn_trainer_destroy(t);
    (void)state;
}

static void same_state(struct ggn_trainer *a, struct ggn_trainer *b)
{
    size_t count, other;

    for (int net = 0; net < GGN_NETS; net++) {
        float *x, *y;
        for (int i = 0; (x = ggn_trainer_state(a, net, i, &count)) != NULL; i++) {
            y = ggn_trainer_state(b, net, i, &other);
            assert_int_equal(count, other);
            assert_memory_equal(x, y, count * sizeof *x);
        }
        assert_int_equal(a->adam_t[net], b->adam_t[net]);
    }
    assert_int_equal(a->steps, b->steps);
}

/* What a checkpoint keeps: the arrays of ggn_trainer_state and the counters. */
static void copy_state(struct ggn_trainer *to, struct ggn_trainer *from)
{
    size_t count;
    float *x;

    for (int net = 0; net < GGN_NETS; net++) {
        for (int i = 0; (x = ggn_trainer_state(from, net, i, &count)) != NULL; i++)
            memcpy(ggn_trainer_state(to, net, i, &count), x, count * sizeof *x);
        to->adam_t[net] = from->adam_t[net];
        ggn_weights_pack(to->weights[net], NULL);
    }
    to->steps = from->steps;
}

static void test_resume_and_threads(void **state)
{
    struct base_threads *threads = base_threads_create(2, NULL);
    struct ggn_trainer *a = make(GGN_PRESET_LULL, 1e-3, NULL), *b = make(GGN_PRESET_LULL, 1e-3, threads);

    for (int i = 0; i < 2; i++) {
        denoise(a);
        judge(a);
    }
    copy_state(b, a);
    for (int i = 0; i < 2; i++) {
        denoise(a);
        judge(a);
        denoise(b);
        judge(b);
    }
    same_state(a, b);
    ggn_trainer_destroy(a);
    ggn_trainer_destroy(b);
    base_threads_destroy(threads);
    (void)state;
}

/* One step of every network, each parameter against Kingma & Ba 2015, algorithm 1, in double from the gradients that the trainer left:
 * with the bias corrections, whose part is large in the first steps. */
static void check_adam(const struct ggn_trainer *t, int net, const float *before, double *m, double *v, int step)
{
    const struct ggn_train_options *o = &t->options;
    double norm2 = 0, c1 = 1 - pow(o->beta1, step), c2 = 1 - pow(o->beta2, step);

    assert_int_equal(t->adam_t[net], step);
    for (size_t i = 0; i < t->graph[net].n_params; i++) {
        double g = (double)t->grad[net][i], was = (double)before[i];
        norm2 += g * g;
        m[i] = o->beta1 * m[i] + (1 - o->beta1) * g;
        v[i] = o->beta2 * v[i] + (1 - o->beta2) * g * g;
        double want = was - o->lr[net] * (m[i] / c1) / (sqrt(v[i] / c2) + o->eps);
        /* rounding of the parameter, and of moments that are sums of floats */
        if (!(fabs((double)t->weights[net]->params[i] - want) <= 2e-7 * fabs(was) + 2e-5 * o->lr[net]))
            fail_msg("net %d, step %d, parameter %zu: %.9g, not %.9g", net, step, i, (double)t->weights[net]->params[i],
                     want);
    }
    assert_true(sqrt(norm2) <= o->clip * (1 + 1e-5) && norm2 > 0);
}

static void test_adam(void **state)
{
    struct ggn_trainer *t = make(GGN_PRESET_LULL, 1e-3, NULL);
    double *m[GGN_NETS], *v[GGN_NETS];
    float *before[GGN_NETS];

    t->options.lr[GGN_NET_D] = 3e-3;
    for (int net = 0; net < GGN_NETS; net++) {
        size_t n = t->graph[net].n_params;
        m[net] = calloc(n, sizeof **m);
        v[net] = calloc(n, sizeof **v);
        before[net] = malloc(n * sizeof **before);
        assert_true(m[net] && v[net] && before[net]);
    }
    for (int step = 1; step <= 4; step++) {
        for (int net = 0; net < GGN_NETS; net++)
            memcpy(before[net], t->weights[net]->params, t->graph[net].n_params * sizeof **before);
        denoise(t);
        judge(t);
        for (int net = 0; net < GGN_NETS; net++)
            check_adam(t, net, before[net], m[net], v[net], step);
    }
    for (int net = 0; net < GGN_NETS; net++) {
        free(m[net]);
        free(v[net]);
        free(before[net]);
    }
    ggn_trainer_destroy(t);
    (void)state;
}

static void test_paper(void **state)
{
    struct ggn_trainer *t = make(GGN_PRESET_PAPER, 2e-4, NULL);
    const struct ggn_graph *m = &t->graph[GGN_NET_M];
    size_t last = m->tensor[m->n_tensors - 2].offset;
    float *kept = malloc((m->n_params - last) * sizeof *kept);
    struct ggn_batch batch = {.count = BATCH, .noisy = data.p_noisy, .reference = data.p_reference, .label = data.label};
    struct ggn_paper_record r;
    struct base_err err = {0};

    assert_non_null(kept);
    memcpy(kept, t->weights[GGN_NET_M]->params + last, (m->n_params - last) * sizeof *kept);
    for (int i = 0; i < 3; i++)
        if (ggn_trainer_paper_step(t, &batch, &r, &err))
            fail_msg("%s", err.text);
    assert_int_equal(t->adam_t[GGN_NET_R], 3 * WINDOW);
    assert_int_equal(t->adam_t[GGN_NET_M], 3);
    assert_int_equal(t->adam_t[GGN_NET_D], 3);
    /* published: the generator's last convolution is never trained */
    assert_memory_equal(kept, t->weights[GGN_NET_M]->params + last, (m->n_params - last) * sizeof *kept);
    assert_true(isfinite(r.bce_after));
    free(kept);
    ggn_trainer_destroy(t);
    (void)state;
}

static void test_copy(void **state)
{
    struct ggn_trainer *t = make(GGN_PRESET_LULL, 1e-3, NULL), *u = make(GGN_PRESET_LULL, 1e-3, NULL);
    const struct ggn_weights *a = t->weights[GGN_NET_R], *b = u->weights[GGN_NET_R];

    denoise(t);
    assert_memory_not_equal(b->pack, a->pack, a->graph->n_pack * sizeof(float));
    ggn_weights_copy(u->weights[GGN_NET_R], a->params);
    assert_memory_equal(b->params, a->params, a->graph->n_params * sizeof(float));
    assert_memory_equal(b->mean, a->mean, a->graph->n_stats * sizeof(float));
    assert_memory_equal(b->var, a->var, a->graph->n_stats * sizeof(float));
    assert_memory_equal(b->pack, a->pack, a->graph->n_pack * sizeof(float));
    ggn_trainer_destroy(t);
    ggn_trainer_destroy(u);
    (void)state;
}

/* --- what is refused, and what is done with it ------------------------------------------------------------------------ */

static void test_refusals(void **state)
{
    struct ggn_hyper hyper = {GGN_PRESET_LULL, H, W, WINDOW, 4, 6, 4, 0, 0, 0};
    struct ggn_batch batch = {.count = BATCH,
                              .noisy = data.p_noisy,
                              .denoised = data.p_denoised,
                              .reference = data.p_reference,
                              .label = data.label};
    struct ggn_paper_record record;
    struct base_err err = {0};
    double loss;

    for (int size = 0; size <= GGN_BATCH_MAX + 1; size += GGN_BATCH_MAX + 1) {
        struct ggn_train_options o = ggn_train_options_default(GGN_PRESET_LULL);
        char want[64];
        o.batch = size;
        assert_null(ggn_trainer_create(&hyper, &o, NULL, &err));
        snprintf(want, sizeof want, "batch size %d is not in 1..1024", size);
        assert_string_equal(err.text, want);
    }
    for (int preset = GGN_PRESET_PAPER; preset <= GGN_PRESET_LULL; preset++) {
        struct ggn_trainer *t = make((enum ggn_preset)preset, 1e-3, NULL);
        for (batch.count = 0; batch.count <= BATCH + 1; batch.count += BATCH + 1) {
            char want[64];
            snprintf(want, sizeof want, "a batch of %d is not in 1..%d", batch.count, BATCH);
            assert_int_equal(ggn_trainer_classifier_step(t, &batch, &loss, NULL, &err), BASE_EINVAL);
            assert_string_equal(err.text, want);
            assert_int_equal(ggn_trainer_denoiser_step(t, data.p_first, data.p_reference, batch.count, &loss, &err),
                             BASE_EINVAL);
            assert_string_equal(err.text, want);
        }
        batch.count = BATCH;
        int rc = preset == GGN_PRESET_PAPER ? ggn_trainer_classifier_step(t, &batch, &loss, NULL, &err)
                                            : ggn_trainer_paper_step(t, &batch, &record, &err);
        assert_int_equal(rc, BASE_EINVAL);
        assert_string_equal(err.text, preset == GGN_PRESET_PAPER ? "the published preset trains in its own order"
                                                                 : "the published order needs the preset paper");
        assert_int_equal(t->steps, 0);
        ggn_trainer_destroy(t);
    }
    for (int parts = GGN_TRAIN_R; parts <= GGN_TRAIN_MD; parts++) { /* the networks of one phase alone */
        struct ggn_train_options o = ggn_train_options_default(GGN_PRESET_LULL);
        size_t count;
        o.parts = parts;
        o.batch = BATCH;
        struct ggn_trainer *t = ggn_trainer_create(&hyper, &o, NULL, &err);
        assert_non_null(t);
        assert_true((t->r != NULL) == (parts == GGN_TRAIN_R) && (t->d != NULL) == (parts == GGN_TRAIN_MD) && !t->m2);
        int rc = parts == GGN_TRAIN_MD ? ggn_trainer_denoiser_step(t, data.p_first, data.p_reference, BATCH, &loss, &err)
                                       : ggn_trainer_classifier_step(t, &batch, &loss, NULL, &err);
        assert_int_equal(rc, BASE_EINVAL);
        assert_string_equal(err.text, "this trainer was made without the networks of the step");
        for (int net = 0; net < GGN_NETS; net++) {
            const int trained = (net == GGN_NET_R) == (parts == GGN_TRAIN_R);
            assert_true((ggn_trainer_state(t, net, 4, &count) != NULL) == trained && (t->grad[net] != NULL) == trained);
            assert_null(ggn_trainer_state(t, net, 5, &count));
            assert_null(ggn_trainer_state(t, net, -1, &count));
            assert_non_null(ggn_trainer_state(t, net, 2, &count));
            assert_int_equal(count, t->graph[net].n_stats);
        }
        ggn_trainer_destroy(t);
    }
    (void)state;
}

/* A gradient longer than the clip is made as long as it, of each network its own; a loss or gradient beyond what explodes goes back to what
 * was kept last, which says which step and tensor it was. */
static void test_clip_and_explode(void **state)
{
    struct ggn_trainer *t = make(GGN_PRESET_LULL, 1e-3, NULL), *u = make(GGN_PRESET_LULL, 1e-3, NULL);
    struct base_err err = {0};
    double loss, length = 0;

    for (int i = 0; i < 3; i++) {
        denoise(t);
        judge(t);
        if (i == 1) {
            ggn_trainer_keep(t);
            copy_state(u, t);
        }
    }
    t->options.clip = u->options.clip = 1e-3;
    denoise(t);
    for (size_t i = 0; i < t->graph[GGN_NET_R].n_params; i++)
        length += (double)t->grad[GGN_NET_R][i] * (double)t->grad[GGN_NET_R][i];
    assert_true(fabs(sqrt(length) / 1e-3 - 1) < 1e-5);
    t->options.explode = 1e-9;
    assert_int_equal(ggn_trainer_denoiser_step(t, data.p_first, data.p_reference, BATCH, &loss, &err), GGN_EDIVERGED);
    char want[160], *tensor = strstr(err.text, "worst in ");
    snprintf(want, sizeof want, "training diverged: loss of the denoiser is %g, worst in %.*s; returned to step 4", loss,
             tensor ? (int)strcspn(tensor + 9, ";") : 0, tensor ? tensor + 9 : "");
    assert_string_equal(err.text, want);
    same_state(t, u); /* two of each, which were kept */
    t->options.explode = 1e6;
    denoise(t);
    denoise(u);
    judge(t);
    judge(u);
    same_state(t, u);
    ggn_trainer_destroy(t);
    ggn_trainer_destroy(u);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_learns),
                                       cmocka_unit_test(test_learns_from_the_picture),
                                       cmocka_unit_test(test_resume_and_threads),
                                       cmocka_unit_test(test_adam),
                                       cmocka_unit_test(test_paper),
                                       cmocka_unit_test(test_copy),
                                       cmocka_unit_test(test_refusals),
                                       cmocka_unit_test(test_clip_and_explode)};
    return cmocka_run_group_tests(tests, setup, NULL);
}
