#include "render/progress.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

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

/* The blocks as a picture of half-block characters for a terminal with 256 colours. */

enum { ACTIVE = 231, UNTOUCHED = 237, BEYOND = -1, LARGEST_BLOCK = 4 };

/* Of the 256 colours, near viridis: lightness rises with the logarithm of a stopped block's samples. */
static const int ramp[] = {54, 60, 24, 30, 36, 71, 113};
enum { SHADES = sizeof ramp / sizeof ramp[0] };

struct map {
    const struct lull_host_blocks *blocks;
    int columns, rows; /* of blocks */
    int side, shared;  /* half characters of a block's side; blocks that share one, per side */
    double low, high;  /* samples of stopped blocks; low > high: there is none */
    FILE *to;
};

static int shade(const struct map *m, double spp)
{
    double t = m->high > m->low ? log(spp / m->low) / log(m->high / m->low) : 0.0;
    return ramp[(int)fmin(t * SHADES, SHADES - 1)];
}

/* The colour of half a character. */
static int colour(const struct map *m, int x, int y)
{
    double most = 0.0;
    int untouched = 0;
    for (int j = 0; j < m->shared; j++)
        for (int i = 0; i < m->shared; i++) {
            int column = x / m->side * m->shared + i, row = y / m->side * m->shared + j;
            if (column >= m->columns || row >= m->rows)
                continue;
            const struct lull_host_block *b = &m->blocks->list[row * m->columns + column];
            if (b->reason == LULL_REASON_NONE && b->spp > 0)
                return ACTIVE;
            untouched |= b->reason == LULL_REASON_NONE;
            most = fmax(most, (double)b->spp);
        }
    return untouched ? UNTOUCHED : most > 0.0 ? shade(m, most) : BEYOND;
}

static void put_line(const struct map *m, int width, int height, int line)
{
    int front = BEYOND, back = BEYOND;
    for (int x = 0; x < width; x++) {
        int up = colour(m, x, 2 * line), down = 2 * line + 1 < height ? colour(m, x, 2 * line + 1) : BEYOND;
        if (up != front)
            fprintf(m->to, "\033[38;5;%dm", front = up);
        if (down != back && down == BEYOND)
            fprintf(m->to, "\033[49m");
        else if (down != back)
            fprintf(m->to, "\033[48;5;%dm", down);
        back = down;
        fprintf(m->to, "\xe2\x96\x80"); /* U+2580, upper half block */
    }
    fprintf(m->to, "\033[0m\n");
}

/* As much of it as fits into so many characters. */
static void put_legend(const struct map *m, int columns)
{
    if (columns >= 8)
        fprintf(m->to, "\033[38;5;%dm\xe2\x96\x88\033[0m active", ACTIVE);
    if (m->low <= m->high && columns >= (int)SHADES + 52) {
        fprintf(m->to, "   stopped at ");
        for (int i = 0; i < SHADES; i++)
            fprintf(m->to, "\033[38;5;%dm\xe2\x96\x88", ramp[i]);
        fprintf(m->to, m->low < m->high ? "\033[0m %.0f to %.0f samples" : "\033[0m %.0f samples", m->low, m->high);
    }
    fprintf(m->to, "\n");
}

/* Lines, each with its newline, of at most `columns` characters, at most `lines` of them, the last a legend. A block takes
 * as many half characters as fit, up to 4 x 4, or several share one, which shows an active one if there is one. Returns
 * whether there is any: 0 where nothing fits (3 columns, 2 lines) or blocks form no grid. */
static int put_map(FILE *to, const struct lull_host_blocks *b, int columns, int lines)
{
    struct map m = {.blocks = b, .columns = (int)b->list_columns, .low = INFINITY, .to = to};
    if (b->columns == 0 || m.columns == 0 || columns < 3 || lines < 2)
        return 0;
    m.rows = (int)(b->count / b->list_columns);
    const int halves = 2 * (lines - 1);
    for (m.shared = 1; (m.columns + m.shared - 1) / m.shared > columns || (m.rows + m.shared - 1) / m.shared > halves;)
        m.shared++;
    for (m.side = 1;
         m.side < LARGEST_BLOCK && m.shared == 1 && m.columns * (m.side + 1) <= columns && m.rows * (m.side + 1) <= halves;)
        m.side++;
    for (uint32_t i = 0; i < b->count; i++)
        if (b->list[i].reason != LULL_REASON_NONE && b->list[i].spp > 0) {
            m.low = fmin(m.low, (double)b->list[i].spp);
            m.high = fmax(m.high, (double)b->list[i].spp);
        }
    const int width = (m.columns + m.shared - 1) / m.shared * m.side, height = (m.rows + m.shared - 1) / m.shared * m.side;
    for (int line = 0; 2 * line < height; line++)
        put_line(&m, width, height, line);
    put_legend(&m, columns);
    return 1;
}

/* Half of the terminal, which the message before it may fill. A longer line would be broken by the terminal. */
static void show_map(struct pt_progress *p, const struct pt_render *r, const char *line)
{
    enum { MOST_COLUMNS = 160, MOST_LINES = 40 };
    int columns, lines;
    char *text = NULL;
    size_t size;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return;
    base_log_size(p->log, &columns, &lines);
    columns = columns < MOST_COLUMNS ? columns : MOST_COLUMNS;
    lines = lines < 2 * MOST_LINES ? lines : 2 * MOST_LINES;
    if (put_map(to, r->blocks, columns - 1, lines / 2) && p->quality[0] && columns > 24)
        fprintf(to, "%.*s\n", columns - 1, p->quality);
    fprintf(to, "%.*s", columns - 1, line + strspn(line, " "));
    if (fclose(to) == 0)
        base_log_live(p->log, text);
    free(text);
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
