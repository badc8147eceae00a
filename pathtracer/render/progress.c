#include "render/progress.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"

static const double LIVE_S = 0.2, FIRST_PLAIN_S = 2.0, PLAIN_S = 10.0;

void pt_progress_init(struct pt_progress *p, FILE *out)
{
    *p = (struct pt_progress){.out = out};
    if (!out)
        return;
    p->terminal = isatty(fileno(out)) == 1;
    p->next_s = base_clock_wall_s() + (p->terminal ? 0.0 : FIRST_PLAIN_S);
}

static void format_time(double s, char *text, size_t room)
{
    long t = (long)ceil(fmin(s, 3.6e7));
    if (t >= 3600)
        snprintf(text, room, "%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
    else
        snprintf(text, room, "%ld:%02ld", t / 60, t % 60);
}

struct outlook {
    double done, expected; /* pixel samples */
    int known;             /* every active block has a prediction */
    uint64_t low, high;    /* samples of the active blocks */
    uint32_t active;
};

static struct outlook look(const struct pt_render *r)
{
    struct outlook o = {.known = 1, .low = UINT64_MAX};
    for (uint32_t i = 0; i < r->blocks.count; i++) {
        const struct pt_block *b = &r->blocks.list[i];
        double pixels = (double)(b->x1 - b->x0) * (double)(b->y1 - b->y0), end = (double)b->spp;
        if (b->reason == PT_REASON_NONE) {
            int predicted = b->asked && isfinite(b->predicted_spp);
            o.active++;
            o.low = b->spp < o.low ? b->spp : o.low;
            o.high = b->spp > o.high ? b->spp : o.high;
            o.known &= predicted || r->config.uniform;
            end = predicted && !r->config.uniform ? fmax(b->predicted_spp, (double)b->next_spp) : (double)r->config.spp_max;
            end = fmin(end, (double)r->config.spp_max);
        }
        o.done += pixels * (double)b->spp;
        o.expected += pixels * end;
    }
    return o;
}

void pt_progress_text(const struct pt_render *r, char *text, size_t room)
{
    struct outlook o = look(r);
    double elapsed_s = pt_render_elapsed_s(r), share = o.expected > 0.0 ? o.done / o.expected : 1.0;
    double left_s = r->samples_per_s > 0.0 ? (o.expected - o.done) / r->samples_per_s : INFINITY;
    int known = o.known;
    if (r->config.time_budget_s > 0.0) {
        double budget_left_s = fmax(0.0, r->config.time_budget_s - elapsed_s);
        if (budget_left_s < left_s) {
            left_s = budget_left_s;
            share = fmin(1.0, elapsed_s / r->config.time_budget_s);
        }
    }
    char left[32] = "unknown";
    if (isfinite(left_s))
        format_time(left_s, left, sizeof left);
    if (o.active == 0)
        o.low = 0;
    snprintf(text, room, "%s%3.0f%%  %u of %u blocks active  spp %llu..%llu  %.2f Mpaths/s  ETA %s%s", known ? "" : ">=",
             floor(100.0 * share), o.active, r->blocks.count, (unsigned long long)o.low, (unsigned long long)o.high,
             r->samples_per_s * 1e-6, known || !isfinite(left_s) ? "" : "at most ", left);
}

void pt_progress_update(struct pt_progress *p, const struct pt_render *r)
{
    double now_s = base_clock_wall_s();
    if (!p->out || now_s < p->next_s)
        return;
    char text[256];
    pt_progress_text(r, text, sizeof text);
    if (p->terminal)
        fprintf(p->out, "\r%s\033[K", text);
    else
        fprintf(p->out, "%s\n", text);
    fflush(p->out);
    p->shown = p->terminal;
    p->next_s = now_s + (p->terminal ? LIVE_S : PLAIN_S);
}

void pt_progress_clear(struct pt_progress *p)
{
    if (p->out && p->shown) {
        fputs("\r\033[K", p->out);
        fflush(p->out);
    }
    p->shown = 0;
}
