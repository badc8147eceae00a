#include "render/progress.h"

#include <math.h>
#include <stdio.h>

#include "base/clock.h"

static const double LIVE_S = 0.2, FIRST_PLAIN_S = 2.0, PLAIN_S = 10.0;

void pt_progress_init(struct pt_progress *p, struct base_log *log)
{
    *p = (struct pt_progress){.log = log, .next_s = base_clock_wall_s() + (log->terminal ? 0.0 : FIRST_PLAIN_S)};
}

/* What is left, and wall seconds that it takes: INFINITY when nobody knows. */
static struct lull_host_forecast look(const struct pt_render *r, double *wall_s)
{
    struct lull_host_forecast f = {.known = 1};
    int threads = pt_render_threads(r);
    int32_t code = lull_host_forecast_of(r->blocks, r->totals, threads, &f, NULL);
    if (code != LULL_OK || r->busy_threads <= 0.0)
        *wall_s = INFINITY;
    else /* what keeps the threads from it now, other programs for one, will go on doing so */
        *wall_s = f.check_s + f.sampling_s * lull_host_busy(r->sampled_rows, threads) / r->busy_threads;
    return f;
}

void pt_progress_text(const struct pt_render *r, double *percent_shown, char *text, size_t room)
{
    double left_s;
    struct lull_host_forecast f = look(r, &left_s);
    lull_host_progress(r->blocks, r->totals, &f, r->config.time_budget_s, left_s, r->samples_per_s, percent_shown, text,
                       room);
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
