/* What goes on beside a render: its progress, a checkpoint and a preview now and then, a live view. Of one thread. */
#ifndef PT_WATCH_H
#define PT_WATCH_H

#include "open.h"
#include "render/output.h"
#include "render/progress.h"

struct pt_watch {
    struct pt_render_hooks hooks; /* for pt_render_run; their data is the watch */
    struct pt_progress progress;
    const struct pt_open *open;         /* whose frame says which files */
    const struct pt_output_info *info;  /* what preview, stop maps and report say; NULL: none is written */
    struct lull_host_display *display;  /* owns; NULL: none */
    double checkpoint_at_s, files_at_s; /* wall times of the next ones */
};

/* All is borrowed. info: NULL, nothing is written but checkpoints. Where the command line says so, the render is shown in a
 * viewer, under the name of the scene: an image, which ends with pt_watch_end. BASE_EINVAL: it has no such address. */
int pt_watch_init(struct pt_watch *watch, const struct pt_open *open, const struct pt_output_info *info,
                  struct base_err *err);
/* Closes the live view, with the picture as it is, and takes the progress line away. */
void pt_watch_end(struct pt_watch *watch);

#endif
