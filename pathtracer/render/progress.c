#include "render/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
static const double LIVE_S = 0.2, FIRST_PLAIN_S = 2.0, PLAIN_S = 10.0;

void pt_progress_init(struct pt_progress *p, struct base_log *log)
{
    *p = (struct pt_progress){.log = log, .next_s = base_clock_wall_s() + (log->terminal ? 0.0 : FIRST_PLAIN_S)};
}

static void format_time(double s, char *text, size_t room)
{
    long t = (long)ceil(fmin(s, 3.6e7));
    if (t >= 3600)
        snprintf(text, room, "%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
    else
        snprintf(text, room, "%ld:%02ld", t / 60, t % 60);
}

/* What is left, and wall seconds that it takes: INFINITY when nobody knows. */
static struct lull_host_forecast look(const struct pt_render *r, double *wall_s)
{
    struct lull_host_forecast f = {.known = 1};
    int threads = pt_render_threads(r);
    int32_t code = lull_host_outlook(r->blocks, r->totals, threads, &f, NULL);
    if (code != LULL_OK || r->busy_threads <= 0.0)
        *wall_s = INFINITY;
    else /* what keeps the threads from it now, other programs for one, will go on doing so */
        *wall_s = f.check_s + f.sampling_s * lull_host_busy(r->sampled_rows, threads) / r->busy_threads;
    return f;
}

/* The share done, which never falls: a prediction that grows holds it where it was. What is only a lower bound says so, and
 * says nothing while it is below a hundredth. */
static void format_share(double *percent_shown, double share, int known, char *text, size_t room)
{
    double percent = floor(100.0 * share);
    int is_bound = !known && percent >= *percent_shown;
    *percent_shown = fmax(*percent_shown, percent);
    if (is_bound && percent < 1.0)
        snprintf(text, room, "  ?%%");
    else
        snprintf(text, room, "%s%3.0f%%", is_bound ? ">=" : "", *percent_shown);
}

void pt_progress_text(const struct pt_render *r, double *percent_shown, char *text, size_t room)
{
    double elapsed_s = r->totals->render_s + r->totals->criterion_s, left_s;
    struct lull_host_forecast o = look(r, &left_s);
    double share = o.left_s > 0.0 ? o.done_s / (o.done_s + o.left_s) : 1.0;
    int known = o.known != 0;
    if (r->config.time_budget_s > 0.0) {
        double budget_left_s = fmax(0.0, r->config.time_budget_s - elapsed_s);
        if (budget_left_s < left_s) {
            left_s = budget_left_s;
            share = fmin(1.0, elapsed_s / r->config.time_budget_s);
        }
    }
    char left[32] = "unknown", done[16];
    format_share(percent_shown, share, known, done, sizeof done);
    if (isfinite(left_s))
        format_time(left_s, left, sizeof left);
    if (o.active == 0)
        o.low = 0;
    snprintf(text, room, "%s  %u of %u blocks active  spp %llu..%llu  %.2f Mpaths/s  ETA %s%s", done, o.active,
             r->blocks->count, (unsigned long long)o.low, (unsigned long long)o.high, r->samples_per_s * 1e-6,
             known || !isfinite(left_s) ? "" : "at most ", left);
}

void pt_progress_update(struct pt_progress *p, const struct pt_render *r)
{
    double now_s = base_clock_wall_s();
    if (!p->log || p->log->quiet || now_s < p->next_s)
        return;
    char text[256];
    if (r->totals->samples < p->samples)
        p->percent = 0.0; /* another render */
    p->samples = r->totals->samples;
    pt_progress_text(r, &p->percent, text, sizeof text);
    base_log_live(p->log, text);
    p->next_s = now_s + (p->log->terminal ? LIVE_S : PLAIN_S);
}
