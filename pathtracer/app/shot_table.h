/*
 * A shot table: how many samples each block of each frame gets, so that any frame of a shot can be rendered anywhere,
 * without asking a criterion. Text:
 *
 *   lull-shot-table 1
 *   size=640x360 crop=0,0,640,360 block=200x200      what the frames look like: pt_shot_table_grid
 *   1;64;120;512;80;64;90;333;1024                   frame; samples per pixel of each block, row by row
 *   2;…                                              frames rise
 */
#ifndef PT_SHOT_TABLE_H
#define PT_SHOT_TABLE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "render/render.h"

enum { PT_SHOT_LAST_FRAME = 9999999, PT_SHOT_GRID = 160 };

struct pt_shot_table {
    char grid[PT_SHOT_GRID];
    int *frames;   /* owns; [frame_count], rising, 0 … PT_SHOT_LAST_FRAME */
    uint32_t *spp; /* owns; [frame_count][block_count], 1 … 2^31 - 1 */
    size_t frame_count, block_count;
};

/* BASE_EINVAL names file and line. name: for that. Released by pt_shot_table_release, after a failure too. */
int pt_shot_table_parse(const char *name, const char *text, size_t size, struct pt_shot_table *out, struct base_err *err);
int pt_shot_table_read(const char *path, struct pt_shot_table *out, struct base_err *err);
/* Replaces the file as a whole or not at all. */
int pt_shot_table_write(const char *path, const struct pt_shot_table *table, struct base_err *err);
void pt_shot_table_release(struct pt_shot_table *table);

/* Samples of the frame's blocks; NULL: the table does not have it. */
const uint32_t *pt_shot_table_frame(const struct pt_shot_table *table, int frame);
/* The table's second line for this render. */
void pt_shot_table_grid(const struct pt_render_config *config, char grid[PT_SHOT_GRID]);

#endif
