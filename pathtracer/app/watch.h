/* What goes on beside a render: its progress, a checkpoint and a preview now and then. Of one thread. */
#ifndef PT_WATCH_H
#define PT_WATCH_H

#include "open.h"
#include "render/progress.h"

struct pt_watch {
    struct base_log *log;
    struct pt_progress progress;
    const struct pt_open *open;                  /* of whom the settings are saved */
    const struct pt_checkpoint_plan *checkpoint; /* path NULL: none */
    const char *preview;                         /* NULL: none */
    double checkpoint_at_s, preview_at_s;        /* wall times of the next ones */
};

/* All is borrowed. */
void pt_watch_init(struct pt_watch *watch, const struct pt_open *open, const struct pt_checkpoint_plan *checkpoint,
                   const char *preview, struct base_log *log);
/* The hooks of pt_render_run that do it; their data is the watch. */
struct pt_render_hooks pt_watch_hooks(struct pt_watch *watch);

#endif
