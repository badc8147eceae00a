/*
 * One picture of a command line: what differs from frame to frame of a shot, as data. What is no shot is one frame, which
 * has everything as the command line says it.
 */
#ifndef PT_FRAME_H
#define PT_FRAME_H

#include "cli.h"
#include "shot_table.h"

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

#endif
