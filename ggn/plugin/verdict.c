#include "plugin/ggn.h"

/* Display codes of the block; returns how many values were broken. */
static long read_display(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint8_t *out)
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

/* Whether the noise sits in too few pixels for a judgement. D = (A − I)·√(h/(n − h)): noise of the variance of the mean. */
static int tail_holds(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, struct ggn_tail *tail)
{
    const uint32_t planes = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF);
    const double n = (double)b->spp, h = (double)b->half_spp, split = sqrt(h / (n - h));
    struct lull_kit_span s;

    if ((in->policy.tail999 <= 0 && in->policy.gini <= 0) || !lull_kit_plane(view, LULL_PLANE_HALF) || h <= 0 || h >= n)
        return 0;
    ggn_tail_clear(tail);
    for (lull_kit_span_begin(&s, view, b, planes); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            double luminance = lull_kit_luminance(&in->kit, s.value[LULL_PLANE_COLOR][i]);
            double d = split * (lull_kit_luminance(&in->kit, s.value[LULL_PLANE_HALF][i]) - luminance);
            if (isfinite(luminance) && isfinite(d))
                ggn_tail_add(tail, luminance, d);
        }
    return ggn_policy_tail_holds(&in->policy, ggn_tail_999(tail), ggn_tail_gini(tail));
}

/* Logit of the newest window; denoises the images that have not been denoised yet. */
static double window_logit(const struct lull_instance *in, const struct lull_block *b, struct gp_head *head, struct ggn_judge *judge)
{
    const uint8_t *noisy[GP_WINDOW_MAX];
    const uint16_t *denoised[GP_WINDOW_MAX];
    int w = b->x1 - b->x0, h = b->y1 - b->y0;

    for (int i = 0; i < in->window; i++) {
        uint32_t slot = head->order[(int)head->used - in->window + i];
        noisy[i] = gp_history_noisy(&in->history, b->id, slot);
        denoised[i] = gp_history_denoised(&in->history, b->id, slot);
        if (!(head->denoised >> slot & 1))
            ggn_judge_denoise(judge, noisy[i], gp_history_denoised(&in->history, b->id, slot), w, h);
        head->denoised |= UINT32_C(1) << slot;
    }
    return ggn_judge_logit(judge, noisy, denoised, w, h);
}

/* CONTINUE, at the next level or, while the gate says that the block is plainly noisy, at the first level of the window that
 * will end where it expects to open: half of that, because the estimate is noisy itself, and at most fourfold. */
static void schedule(const struct lull_instance *in, const struct lull_block *b, struct gp_head *head, double gate_opens)
{
    double spp = (double)b->spp, next = ggn_policy_next(&in->policy, spp);

    if (gate_opens > 0 && in->policy.ratio > 1.001) {
        double jump = fmin(0.5 * gate_opens / pow(in->policy.ratio, in->window - 1), 4 * spp);
        head->jumped = jump > 1.5 * next;
        next = head->jumped ? jump : next;
    }
    if (next < in->policy.first_spp)
        next = in->policy.first_spp;
    head->answer.action = LULL_CONTINUE;
    head->answer.next_spp = lull_kit_spp(ceil(next));
    if (in->kit.spp_max > b->spp && head->answer.next_spp > in->kit.spp_max)
        head->answer.next_spp = in->kit.spp_max;
}

/* The verdict on a head whose newest image has just been pushed. */
static void judge_window(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                         struct gp_head *head, struct gp_worker *worker)
{
    struct gp_answer *a = &head->answer;
    size_t values = 3 * (size_t)(b->x1 - b->x0) * (size_t)(b->y1 - b->y0);

    if (head->used < 2) {
        a->flags |= LULL_DECISION_TOO_EARLY;
        schedule(in, b, head, 0);
        return;
    }
    uint32_t oldest = head->order[head->used < (uint32_t)in->window ? 0 : head->used - (uint32_t)in->window];
    uint32_t newest = head->order[head->used - 1];
    a->error = ggn_window_noise(gp_history_noisy(&in->history, b->id, oldest), gp_history_noisy(&in->history, b->id, newest), values,
                                (double)head->spp[oldest], (double)head->spp[newest]);
    if (in->gate && in->policy.gate_noise > 0 && a->error > in->policy.gate_noise) {
        double ratio = a->error / in->policy.gate_noise;
        head->passes = 0;
        a->predicted_spp = (double)b->spp * ratio * ratio; /* the error of a mean falls as 1/√spp */
        schedule(in, b, head, a->predicted_spp);
        return;
    }
    if (head->regular < (uint32_t)in->window) {
        a->flags |= LULL_DECISION_TOO_EARLY;
        schedule(in, b, head, 0);
        return;
    }
    a->p_noisy = ggn_policy_p(&in->policy, window_logit(in, b, head, worker->judge));
    head->passes = a->p_noisy < in->policy.threshold ? head->passes + 1 : 0;
    if (head->passes >= (uint32_t)in->policy.passes && !tail_holds(in, view, b, &worker->tail)) {
        a->action = LULL_STOP;
        a->predicted_spp = (double)b->spp;
        return;
    }
    schedule(in, b, head, 0);
    a->predicted_spp = fmax(ggn_policy_predict(&in->policy, a->p_noisy, in->policy.threshold, (double)b->spp),
                            (double)a->next_spp);
}

/* Whether an image at spp belongs into the history: not before the first level, and not so soon after the newest image that
 * the two would hardly differ (hosts may ask at any time). */
static int due(const struct lull_instance *in, const struct gp_head *head, uint64_t spp)
{
    if ((double)spp < in->policy.first_spp)
        return 0;
    if (!head->used)
        return 1;
    double last = (double)head->spp[head->order[head->used - 1]];
    return (double)spp >= last + 0.5 * (ggn_policy_next(&in->policy, last) - last);
}

void gp_verdict(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint32_t worker)
{
    struct gp_head *head = &in->history.pending[b->id];

    *head = in->history.head[b->id];
    if (head->asked_spp == b->spp && b->spp)
        return;
    head->asked_spp = b->spp;
    if (!due(in, head, b->spp)) {
        /* the last verdict stands; its next check may have to move */
        if (!head->used) {
            head->answer = (struct gp_answer){.flags = LULL_DECISION_TOO_EARLY, .p_noisy = (double)NAN,
                                              .predicted_spp = (double)NAN, .error = (double)NAN,
                                              .next_spp = lull_kit_spp(fmax(in->policy.first_spp, (double)b->spp + 1))};
        } else if (head->answer.action == LULL_CONTINUE && head->answer.next_spp <= b->spp) {
            head->answer.next_spp = b->spp + 1;
        }
        return;
    }
    head->answer = (struct gp_answer){.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    uint32_t slot = gp_head_push(head, in->window, b->spp);
    if (read_display(in, view, b, gp_history_noisy(&in->history, b->id, slot)))
        head->answer.flags |= LULL_DECISION_BAD_INPUT;
    judge_window(in, view, b, head, &in->worker[worker < in->workers ? worker : 0]);
}
