/* A shot: frames that belong together, from one scene file per frame or one scene and a path of the camera. */
#ifndef PT_SHOT_H
#define PT_SHOT_H

#include "open.h"
#include "job/job.h"

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

/* Every frame whose image is not there yet, one after the other; of several processes each takes every n-th. Or, with
 * --plan-shot, its table. */
int pt_shot_run(const struct pt_cli *cli, struct job *job, struct base_log *log, int *status, struct base_err *err);
/* --plan-shot: pilots of every n-th frame, the table from them, its price on stdout. */
int pt_shot_plan(const struct pt_shot *shot, struct pt_open *open, int *status, struct base_err *err);

#endif
