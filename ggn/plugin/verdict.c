#include "plugin/network.h"

#include <math.h>
#include <stdlib.h>

enum { SPAN = 128 };

/* Display codes of the block; returns how many values were broken. */
static long read_display(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint8_t *out)
{
    const struct lull_plane *color = gp_view_plane(view, LULL_PLANE_COLOR);
    const size_t w = (size_t)(b->x1 - b->x0), plane = w * (size_t)(b->y1 - b->y0);
    struct ggn_pixel_counts counts = {0};

    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1;) {
            int32_t n = b->x1 - x < SPAN ? b->x1 - x : SPAN;
            double rgb[SPAN][3];
            gp_view_span(view, color, b, x, y, n, 3, rgb[0]);
            uint8_t *to = out + (size_t)(y - b->y0) * w + (size_t)(x - b->x0);
            for (int32_t i = 0; i < n; i++)
                for (int c = 0; c < 3; c++)
                    to[(size_t)c * plane + (size_t)i] = ggn_preprocess(rgb[i][c], &in->display, &counts);
            x += n;
        }
    return ggn_pixel_counts_bad(&counts);
}

static double luminance_of(const struct lull_instance *in, const double rgb[3])
{
    return in->luminance[0] * rgb[0] + in->luminance[1] * rgb[1] + in->luminance[2] * rgb[2];
}

/* Whether the noise sits in too few pixels for a judgement. D = (A − I)·√(h/(n − h)): noise of the variance of the mean. */
static int tail_holds(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, struct ggn_tail *tail)
{
    const struct lull_plane *color = gp_view_plane(view, LULL_PLANE_COLOR), *half = gp_view_plane(view, LULL_PLANE_HALF);
    const double n = (double)b->spp, h = (double)b->half_spp;

    if ((in->policy.tail999 <= 0 && in->policy.gini <= 0) || !half || h <= 0 || h >= n)
        return 0;
    const double split = sqrt(h / (n - h));
    ggn_tail_clear(tail);
    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1;) {
            int32_t count = b->x1 - x < SPAN ? b->x1 - x : SPAN;
            double mean[SPAN][3], a[SPAN][3];
            gp_view_span(view, color, b, x, y, count, 3, mean[0]);
            gp_view_span(view, half, b, x, y, count, 3, a[0]);
            for (int32_t i = 0; i < count; i++) {
                double luminance = luminance_of(in, mean[i]), d = split * (luminance_of(in, a[i]) - luminance);
                if (isfinite(luminance) && isfinite(d))
                    ggn_tail_add(tail, luminance, d);
            }
            x += count;
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

static uint64_t to_spp(double spp)
{
    return spp >= 1e18 ? UINT64_C(1000000000000000000) : (uint64_t)spp;
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
    head->answer.next_spp = to_spp(ceil(next));
    if (in->spp_max > b->spp && head->answer.next_spp > in->spp_max)
        head->answer.next_spp = in->spp_max;
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
                                              .next_spp = to_spp(fmax(in->policy.first_spp, (double)b->spp + 1))};
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
