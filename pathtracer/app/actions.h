/* What the program does with what is open: an image, its quote, a recording, a look inside. Rank 0 only. *status: the exit
 * status of what went well. */
#ifndef PT_ACTIONS_H
#define PT_ACTIONS_H

#include "open.h"
#include "render/quote.h"

enum { PT_EXIT_FAILED = 1, PT_EXIT_BAD_INPUT = 2, PT_EXIT_INTERRUPTED = 130 };

int pt_action_status(enum pt_render_outcome outcome);

/* The frame as the command line wants it. Opens what it needs, and closes all but the scene. Every process of a job calls
 * it: the others help, where they can. */
int pt_action_frame(struct pt_open *open, const struct pt_shot_frame *frame, struct job *job, int *status,
                    struct base_err *err);

/* What every process of a job must have alike: the version, the identity, the model that the criterion starts with. */
int pt_agree_identity(const struct pt_open *open, struct base_identity *to, struct base_err *err);

int pt_action_image(struct pt_open *open, int *status, struct base_err *err);
/* The last line of a render: what it came to. */
void pt_action_summary(const struct pt_render *render, struct base_log *log);

/* A pilot and its answer, which the caller destroys. *status not 0: it was ended before. */
int pt_action_pilot(struct pt_open *open, struct pt_quote **quote, int *status, struct base_err *err);
int pt_action_quote(struct pt_open *open, int *status, struct base_err *err);

/* --explain: the effects that a scene calls for, why, and what they cost, on stdout. Times a few thousand paths (about a
 * second) with the chosen kernel and with the general one. name: the scene's, for the heading. */
void pt_action_explain(const struct pt_scene *scene, const struct pt_render_config *config, const char *name);
/* --debug-path: at[] is x, y, sample. */
int pt_action_debug_path(const struct pt_scene *scene, const struct pt_render_config *config, const int at[3],
                         struct base_err *err);

/* Every frame whose image is not there yet, one after the other; of several processes each takes every n-th. Or, with
 * --plan-shot, its table. */
int pt_shot_run(const struct pt_cli *cli, struct job *job, struct base_log *log, int *status, struct base_err *err);
/* --plan-shot: pilots of every n-th frame, the table from them, its price on stdout. */
int pt_shot_plan(const struct pt_shot *shot, struct pt_open *open, int *status, struct base_err *err);

#endif
