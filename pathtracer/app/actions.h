/* What the program does with a session that has threads and a scene: an image, its quote, a recording. Rank 0 only, but for
 * what says so. *status: the exit status of what went well. */
#ifndef PT_ACTIONS_H
#define PT_ACTIONS_H

#include "session.h"

enum { PT_EXIT_FAILED = 1, PT_EXIT_BAD_INPUT = 2, PT_EXIT_INTERRUPTED = 130 };

int pt_action_image(struct pt_session *session, int *status, struct base_err *err);
int pt_action_quote(struct pt_session *session, int *status, struct base_err *err);
int pt_action_sequence(struct pt_session *session, int *status, struct base_err *err);

/* The settings of a recording, besides what pt_sequence_record does; every process. */
int pt_action_open_sequence(struct pt_session *session, struct pt_render_config *config, struct base_err *err);
/* The render and its workers, as far as a checkpoint to be resumed had come. */
int pt_action_open_render(struct pt_session *session, struct base_err *err);
int pt_action_status(enum pt_render_outcome outcome);

/* Hooks of a render; data: the session. Progress and a checkpoint now and then; the one of a render that ends early. */
int pt_action_after_slice(void *data, struct pt_render *render, struct base_err *err);
int pt_action_suspend(void *data, struct pt_render *render, struct base_err *err);

#endif
