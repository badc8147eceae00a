/*
 * A shot: frames that belong together, from one scene file per frame or one scene and a path of the camera. Each frame is a
 * command line of its own, in which names have the frame's number in the place of %d or %04d.
 */
#ifndef PT_SHOT_H
#define PT_SHOT_H

#include "base/log.h"
#include "cli.h"
#include "job/job.h"

struct pt_shot {
    int *frames;           /* owns; [count], rising */
    struct pt_view *views; /* owns; [count], or NULL: the scene's camera */
    size_t count;
};

/* By --frames and --camera-path. BASE_EINVAL when these, or names in the command line, do not fit together or a scene is not
 * there. Released by pt_shot_release, after a failure too. */
int pt_shot_init(const struct pt_cli *cli, struct pt_shot *shot, struct base_err *err);
void pt_shot_release(struct pt_shot *shot);

/* The parts. A list like 1-24, 1,5,9 or 1-24:2; rising. */
int pt_shot_parse_frames(const char *text, struct pt_shot *shot, struct base_err *err);
/* Lines "frame;eye;at;up;fov" below one that says so; the first four as for --look-at, fov as for --fov or nothing. name: of
 * the file. */
int pt_shot_parse_path(const char *name, const char *text, size_t size, struct pt_shot *shot, struct base_err *err);
/* The pattern with the frame's number in it, in out[room]. A name without '%' stays. */
int pt_shot_name(const char *pattern, int frame, char *out, size_t room, struct base_err *err);
/* Its own for each frame of a shot and each seed of the command line; another seed is another picture of independent
 * noise. */
uint32_t pt_shot_seed(uint32_t seed, int frame);

/* The command line of frame `i` of the shot. Borrows both; released by pt_frame_cli_release. */
struct pt_frame_cli {
    struct pt_cli cli;
    char *names; /* owns */
};
int pt_frame_cli_init(struct pt_frame_cli *frame, const struct pt_cli *cli, const struct pt_shot *shot, size_t i,
                      struct base_err *err);
void pt_frame_cli_release(struct pt_frame_cli *frame);

/* Renders one command line; what main does without a shot. */
typedef int pt_shot_render(struct pt_cli *cli, struct job *job, struct base_log *log, int *status, struct base_err *err);

/* Every frame whose image is not there yet, one after the other; of several processes each takes every n-th. Or, with
 * --plan-shot, its table. */
int pt_shot_run(const struct pt_cli *cli, struct job *job, pt_shot_render *render, struct base_log *log, int *status,
                struct base_err *err);
/* Samples that a block gets between two pilots, of `count` blocks in rows of `columns`: the larger of its two needs; where
 * something moves in it or beside it, half of the octaves from there to the largest need of what moves. A block moves when
 * its need changes by more than the pilots' intervals allow. */
uint32_t pt_shot_need(const struct lull_host_quote_block *a, const struct lull_host_quote_block *b, size_t count,
                      uint32_t columns, size_t block);
/* --plan-shot: pilots of every n-th frame, the table from them, its price on stdout. */
int pt_shot_plan(const struct pt_cli *cli, const struct pt_shot *shot, struct base_log *log, int *status,
                 struct base_err *err);

#endif
