/* From the command line and the scene to what a render is made with. */
#ifndef PT_SETUP_H
#define PT_SETUP_H

#include "session.h"

/* What the command line puts over the scene's integrator. */
void pt_setup_override(const struct pt_cli *cli, struct pt_integrator *integrator);
/* BASE_EINVAL when the crop is outside the image. */
int pt_setup_config(const struct pt_session *session, struct pt_render_config *config, struct base_err *err);
/* Finds the criterion that is asked for and makes it, with its mask; none for a uniform image that names none. */
int pt_setup_criterion(struct pt_session *session, struct base_err *err);
/* The render with its criterion, after a look at where outputs will go. */
int pt_setup_render(struct pt_session *session, struct base_err *err);

#endif
