#include "host/frame.h"

#include <math.h>
#include <stdio.h>

static void format_time(double s, char text[32])
{
    long t = (long)ceil(fmin(s, 3.6e7));
    if (t >= 3600)
        snprintf(text, 32, "%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
    else
        snprintf(text, 32, "%ld:%02ld", t / 60, t % 60);
}

/* The share done, which never falls: a prediction that grows holds it where it was. What is only a lower bound says so, and
 * says nothing while it is below a hundredth. */
static void format_share(double *percent_shown, double share, int known, char text[16])
{
    double percent = floor(100.0 * share);
    int is_bound = !known && percent >= *percent_shown;
    *percent_shown = fmax(*percent_shown, percent);
    if (is_bound && percent < 1.0)
        snprintf(text, 16, "  ?%%");
    else
        snprintf(text, 16, "%s%3.0f%%", is_bound ? ">=" : "", *percent_shown);
}

void lull_host_progress(const struct lull_host_blocks *blocks, const struct lull_host_totals *totals,
                        const struct lull_host_forecast *f, double time_budget_s, double left_s, double samples_per_s,
                        double *percent, char *text, uint64_t room)
{
    double share = f->left_s > 0.0 ? f->done_s / (f->done_s + f->left_s) : 1.0;
    double elapsed_s = totals->render_s + totals->criterion_s, budget_left_s = fmax(0.0, time_budget_s - elapsed_s);
    if (time_budget_s > 0.0 && budget_left_s < left_s) {
        left_s = budget_left_s;
        share = fmin(1.0, elapsed_s / time_budget_s);
    }
    char left[32] = "unknown", done[16];
    format_share(percent, share, f->known != 0, done);
    if (isfinite(left_s))
        format_time(left_s, left);
    snprintf(text, (size_t)room, "%s  %u of %u blocks active  spp %llu..%llu  %.2f Mpaths/s  ETA %s%s", done, f->active,
             blocks->count, (unsigned long long)(f->active > 0 ? f->low : 0), (unsigned long long)f->high,
             samples_per_s * 1e-6, f->known || !isfinite(left_s) ? "" : "at most ", left);
}
