#include "plugin/ggn.h"

#include "sequence/tail.h"

/* Display codes of the block; returns how many values were broken. */
static long read_display(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                         uint8_t *out)
{
    const size_t w = (size_t)(b->x1 - b->x0), plane = w * (size_t)(b->y1 - b->y0);
    struct ggn_pixel_counts counts = {0};
    struct lull_kit_span s;

    for (lull_kit_span_begin(&s, view, b, LULL_PLANE_BIT(LULL_PLANE_COLOR)); lull_kit_span_next(&s);) {
        uint8_t *to = out + (size_t)(s.y - b->y0) * w + (size_t)(s.x - b->x0);
        for (int32_t i = 0; i < s.count; i++)
            for (int c = 0; c < 3; c++)
                to[(size_t)c * plane + (size_t)i] = ggn_preprocess(s.value[LULL_PLANE_COLOR][i][c], &in->display, &counts);
    }
    return ggn_pixel_counts_bad(&counts);
}

/* One look at one block. */
struct look {
    struct lull_instance *in;
    const struct lull_view *view;
    const struct lull_block *block;
    struct gp_head *head;
    struct gp_worker *worker;
};

static double window_noise(void *data)
{
    const struct look *l = data;
    const struct gp_history *h = &l->in->history;
    const struct ggn_stopper *s = &l->head->stopper;
    const struct lull_block *b = l->block;
    size_t values = 3 * (size_t)(b->x1 - b->x0) * (size_t)(b->y1 - b->y0);

    return ggn_window_noise(gp_history_noisy(h, b->id, l->head->order[0]),
                            gp_history_noisy(h, b->id, l->head->order[s->used - 1]), values, (double)s->spp[0],
                            (double)s->spp[s->used - 1]);
}

/* D = (A − I)·√(h/(n − h)) of n samples, h of them in HALF: noise of the variance of the mean. *split is that root. 0: the
 * view has no half buffer with part of the samples. */
static int has_half(const struct look *l, double *split)
{
    const double n = (double)l->block->spp, h = (double)l->block->half_spp;

    if (!lull_kit_plane(l->view, LULL_PLANE_HALF) || h <= 0 || h >= n)
        return 0;
    *split = sqrt(h / (n - h));
    return 1;
}

static const uint32_t HALVES = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF);

/* The noise picture of the block as it is now, NULL: it has none. */
static const uint8_t *read_picture(const struct look *l)
{
    const struct lull_kit *kit = &l->in->kit;
    uint8_t *to = l->worker->picture;
    struct lull_kit_span s;
    double split;

    if (!l->in->model->hyper.picture || !has_half(l, &split))
        return NULL;
    for (lull_kit_span_begin(&s, l->view, l->block, HALVES); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            double mean = lull_kit_luminance(kit, s.value[LULL_PLANE_COLOR][i]);
            double half = lull_kit_luminance(kit, s.value[LULL_PLANE_HALF][i]);
            *to++ = ggn_picture_code(mean, split * (half - mean), &l->in->display);
        }
    return l->worker->picture;
}

/* Denoises the images that have not been denoised yet. */
static double window_logit(void *data)
{
    const struct look *l = data;
    const struct gp_history *history = &l->in->history;
    const uint8_t *noisy[GGN_WINDOW_MAX];
    const uint16_t *denoised[GGN_WINDOW_MAX];
    const struct lull_block *b = l->block;
    int w = b->x1 - b->x0, h = b->y1 - b->y0;

    for (int i = 0; i < l->in->rule.window; i++) {
        uint32_t slot = l->head->order[i];
        uint16_t *to = gp_history_denoised(history, b->id, slot);
        noisy[i] = gp_history_noisy(history, b->id, slot);
        denoised[i] = to;
        if (!(l->head->denoised >> slot & 1))
            ggn_judge_denoise(l->worker->judge, noisy[i], to, w, h);
        l->head->denoised |= UINT32_C(1) << slot;
    }
    return ggn_judge_logit(l->worker->judge, noisy, denoised, read_picture(l), w, h);
}

static int tail_statistics(void *data, double *tail999, double *gini)
{
    const struct look *l = data;
    const struct lull_kit *kit = &l->in->kit;
    double *noise = l->worker->noise, sum = 0, split;
    struct lull_kit_span s;
    size_t count = 0;

    if (!has_half(l, &split))
        return 0;
    for (lull_kit_span_begin(&s, l->view, l->block, HALVES); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            double luminance = lull_kit_luminance(kit, s.value[LULL_PLANE_COLOR][i]);
            double d = split * (lull_kit_luminance(kit, s.value[LULL_PLANE_HALF][i]) - luminance);
            if (isfinite(luminance) && isfinite(d)) {
                sum += luminance;
                noise[count++] = fabs(d);
            }
        }
    struct seq_tail tail = seq_tail_of(noise, count, count ? sum / (double)count : 0);
    *tail999 = tail.tail999;
    *gini = tail.gini;
    return 1;
}

void gp_verdict(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint32_t worker)
{
    struct gp_head *head = &in->history.pending[b->id];
    struct look look = {in, view, b, head, &in->worker[worker < in->workers ? worker : 0]};
    const struct ggn_evidence evidence = {&look, window_noise, window_logit, tail_statistics};

    *head = in->history.head[b->id];
    uint32_t before = head->stopper.used;
    if (!ggn_stopper_ask(&in->rule, &head->stopper, b->spp))
        return;
    uint32_t slot = gp_head_push(head, in->rule.window, before);
    head->bad = read_display(in, view, b, gp_history_noisy(&in->history, b->id, slot)) > 0;
    ggn_stopper_judge(&in->rule, &head->stopper, &evidence);
}
