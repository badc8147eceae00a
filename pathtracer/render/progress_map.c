#include "render/progress_map.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

enum { ACTIVE = 231, UNTOUCHED = 237, BEYOND = -1, LARGEST_BLOCK = 4 };

/* Of the 256 colours, near viridis: lightness rises. */
static const int ramp[] = {54, 60, 24, 30, 36, 71, 113};
enum { SHADES = sizeof ramp / sizeof ramp[0] };

struct map {
    const struct lull_host_blocks *blocks;
    int columns, rows; /* of blocks */
    int side, shared;  /* half characters of a block's side; blocks that share one, per side */
    double low, high;  /* samples of stopped blocks; low > high: there is none */
    char *text;
    size_t used, room;
};

static void put(struct map *m, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(struct map *m, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int n = vsnprintf(m->text + m->used, m->room - m->used, format, args);
    va_end(args);
    m->used += n > 0 && (size_t)n < m->room - m->used ? (size_t)n : 0;
}

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

static void put_line(struct map *m, int width, int height, int line)
{
    int front = BEYOND, back = BEYOND;
    for (int x = 0; x < width; x++) {
        int up = colour(m, x, 2 * line), down = 2 * line + 1 < height ? colour(m, x, 2 * line + 1) : BEYOND;
        if (up != front)
            put(m, "\033[38;5;%dm", front = up);
        if (down != back && down == BEYOND)
            put(m, "\033[49m");
        else if (down != back)
            put(m, "\033[48;5;%dm", down);
        back = down;
        put(m, "\xe2\x96\x80"); /* U+2580, upper half block */
    }
    put(m, "\033[0m\n");
}

/* As much of it as fits into so many characters. */
static void put_legend(struct map *m, int columns)
{
    char range[64] = "";
    if (m->low <= m->high)
        snprintf(range, sizeof range, m->low < m->high ? " %.0f to %.0f samples" : " %.0f samples", m->low, m->high);
    if (columns >= 8)
        put(m, "\033[38;5;%dm\xe2\x96\x88\033[0m active", ACTIVE);
    if (m->low <= m->high && columns >= (int)SHADES + 52) {
        put(m, "   stopped at ");
        for (int i = 0; i < SHADES; i++)
            put(m, "\033[38;5;%dm\xe2\x96\x88", ramp[i]);
        put(m, "\033[0m%s", range);
    }
    put(m, "\n");
}

int pt_progress_map(const struct lull_host_blocks *b, int columns, int lines, char *text, size_t room)
{
    struct map m = {.blocks = b, .columns = (int)b->list_columns, .low = INFINITY, .text = text, .room = room};
    text[0] = '\0';
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
    return (height + 1) / 2 + 1;
}
