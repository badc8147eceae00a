#include "render/progress.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "render/progress_map.h"

static const double LIVE_S = 0.2, FIRST_PLAIN_S = 2.0, PLAIN_S = 10.0;

void pt_progress_init(struct pt_progress *p, struct base_log *log)
{
    *p = (struct pt_progress){.log = log, .next_s = base_clock_wall_s() + (log->terminal ? 0.0 : FIRST_PLAIN_S)};
}

/* Over half of the time so far, at least a few seconds; weights fall with age. */
static double look_at_pace(struct pt_progress_pace *p, double done_s, double at_s)
{
    const double share = 0.5, least_s = 5.0, elapsed_s = at_s - p->at_s;
    if (elapsed_s < 0.0)
        *p = (struct pt_progress_pace){0}; /* another render */
    if (elapsed_s > 0.0) {
        const double weight = p->busy > 0.0 ? -expm1(-elapsed_s / fmax(share * at_s, least_s)) : 1.0;
        p->busy += weight * ((done_s - p->done_s) / elapsed_s - p->busy);
        p->done_s = done_s;
        p->at_s = at_s;
    }
    return p->busy;
}

/* What is left, and wall seconds that it takes: INFINITY when nobody knows. */
static struct lull_host_forecast look(struct pt_progress_pace *p, const struct pt_render *r, double *wall_s)
{
    struct lull_host_forecast f = {.known = 1};
    int threads = pt_render_threads(r);
    int32_t code = lull_host_forecast_of(r->blocks, r->totals, threads, &f, NULL);
    const double busy = code == LULL_OK ? look_at_pace(p, f.done_s, r->totals->render_s) : 0.0;
    if (busy <= 0.0 || r->busy_threads <= 0.0)
        *wall_s = INFINITY;
    else /* what keeps the threads from it, other programs for one, will go on doing so */
        *wall_s = f.check_s + f.sampling_s * lull_host_busy(r->sampled_rows, threads) / busy;
    return f;
}

struct pt_progress_now pt_progress_of(struct pt_progress_pace *p, const struct pt_render *r)
{
    struct pt_progress_now now;
    const struct lull_host_forecast f = look(p, r, &now.left_s);
    now.share = f.left_s > 0.0 ? f.done_s / (f.done_s + f.left_s) : 1.0;
    now.known = f.known != 0;
    return now;
}

void pt_progress_text(struct pt_progress_pace *p, const struct pt_render *r, double *percent_shown, char *text, size_t room)
{
    double left_s;
    struct lull_host_forecast f = look(p, r, &left_s);
    lull_host_progress(r->blocks, r->totals, &f, r->config.time_budget_s, left_s, r->samples_per_s, percent_shown, text,
                       room);
}

/* Half of the terminal, which the message before it may fill. A longer line would be broken by the terminal. */
static void show_map(struct pt_progress *p, const struct pt_render *r, const char *line)
{
    enum { MOST_COLUMNS = 160, MOST_LINES = 40 };
    int columns, lines;
    char text[PT_PROGRESS_MAP_ROOM(MOST_COLUMNS, MOST_LINES) + 512];
    base_log_size(p->log, &columns, &lines);
    columns = columns < MOST_COLUMNS ? columns : MOST_COLUMNS;
    lines = lines < 2 * MOST_LINES ? lines : 2 * MOST_LINES;
    int shown = pt_progress_map(r->blocks, columns - 1, lines / 2, text, PT_PROGRESS_MAP_ROOM(MOST_COLUMNS, MOST_LINES));
    size_t used = strlen(text);
    if (shown > 0 && p->quality[0] && columns > 24)
        used += (size_t)snprintf(text + used, sizeof text - used, "%.*s\n", columns - 1, p->quality);
    snprintf(text + used, sizeof text - used, "%.*s", columns - 1, line + strspn(line, " "));
    base_log_live(p->log, text);
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
    pt_progress_text(&p->pace, r, &p->percent, text, sizeof text);
    if (p->map)
        show_map(p, r, text);
    else
        base_log_live(p->log, text);
    p->next_s = now_s + (p->log->terminal ? LIVE_S : PLAIN_S);
}
