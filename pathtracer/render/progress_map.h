/*
 * The blocks of a render as a picture of half-block characters for a terminal with 256 colours: active blocks are white,
 * those without samples dark, stopped ones from violet to green by the logarithm of their samples, which is also a rise in
 * lightness. Pure; no state of the terminal outlasts a line.
 */
#ifndef PT_RENDER_PROGRESS_MAP_H
#define PT_RENDER_PROGRESS_MAP_H

#include <stddef.h>

#include <lull/host.h>

/* Bytes that are enough for a picture of so many characters and its legend. */
#define PT_PROGRESS_MAP_ROOM(columns, lines) ((size_t)(columns) * (size_t)(lines)*32 + (size_t)(lines)*8 + 256)

/* Lines, each with its newline, of at most `columns` characters, at most `lines` of them, the last a legend. A block takes
 * as many half characters as fit, up to 4 x 4, or several share one, which shows an active one if there is one. Returns the
 * number of lines; 0 and no text where nothing fits (3 columns, 2 lines) or blocks form no grid. */
int pt_progress_map(const struct lull_host_blocks *blocks, int columns, int lines, char *text, size_t room);

#endif
