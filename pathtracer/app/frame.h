/*
 * One picture of a command line: what differs from frame to frame of a shot, as data. What is no shot is one frame, which
 * has everything as the command line says it.
 */
#ifndef PT_FRAME_H
#define PT_FRAME_H

#include "cli.h"

/* --- a table: how many samples each block of each frame gets -------------------------------------------------------- */

enum { PT_SHOT_LAST_FRAME = 9999999, PT_SHOT_GRID = 160 };

/* So that any frame of a shot can be rendered anywhere, without asking a criterion. Text:
 *
 *   lull-shot-table 1
 *   size=640x360 crop=0,0,640,360 block=200x200      what the frames look like: pt_shot_table_grid
 *   1;64;120;512;80;64;90;333;1024                   frame; samples per pixel of each block, row by row
 *   2;…                                              frames rise
 */
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

/* --- a frame -------------------------------------------------------------------------------------------------------- */

struct pt_shot_frame {
    int number;    /* in its shot; -1: it stands alone */
    int resume;    /* from its checkpoint */
    uint32_t seed; /* of all random numbers */
    struct pt_view view;
    const char *paths[PT_PATHS];       /* borrow from the command line, or names; NULL: none. Alone: an image has a name */
    struct base_outputs outputs;       /* those that the command line names */
    const struct pt_shot_table *table; /* borrows; says the samples of all blocks; NULL: none */
    const uint32_t *block_spp;         /* of it */
    char *names;                       /* owns */
};

/* Of a command line that is no shot. Borrows it; released by pt_frame_release, after a failure too. */
int pt_frame_alone(struct pt_shot_frame *frame, const struct pt_cli *cli, struct base_err *err);
/* A frame of a shot, with its number in all names and its own seed. view: NULL: the command line's. Likewise. */
int pt_frame_init(struct pt_shot_frame *frame, const struct pt_cli *cli, int number, const struct pt_view *view,
                  struct base_err *err);
void pt_frame_release(struct pt_shot_frame *frame);

/* The pattern with the frame's number in the place of %d or %04d, in out[room]: in the file's own name, else in one of its
 * folders, which may have a '%' as well. Without it the pattern stays. */
int pt_frame_name(const char *pattern, int number, char *out, size_t room, struct base_err *err);
/* Whether the file's name changes with the number, or has another '%', which pt_frame_name refuses. */
int pt_frame_has_number(const char *pattern);
/* Its own for each frame of a shot and each seed of the command line; another seed is another picture of independent
 * noise. */
uint32_t pt_frame_seed(uint32_t seed, int number);

/* --- a shot: frames that belong together, from one scene file per frame or one scene and a path of the camera -------- */

struct pt_shot {
    int *frames;           /* owns; [count], rising */
    struct pt_view *views; /* owns; [count], or NULL: the scene's camera */
    size_t count;
};

void pt_shot_release(struct pt_shot *shot);

/* A list of frames like 1-24, 1,5,9 or 1-24:2; rising. */
int pt_shot_parse_frames(const char *text, struct pt_shot *shot, struct base_err *err);
/* Lines "frame;eye;at;up;fov" below one that says so; the first four as for --look-at, fov as for --fov or nothing. name: of
 * the file. */
int pt_shot_parse_path(const char *name, const char *text, size_t size, struct pt_shot *shot, struct base_err *err);

#endif
