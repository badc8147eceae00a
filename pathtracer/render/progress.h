/*
 * The live line of a render: share done, active blocks, their range of samples, speed, time left. On a terminal it is
 * redrawn in place, elsewhere it is a plain line now and then. Without predictions of the criterion, the share is a lower
 * bound ("?" below 1 %) and the time an upper one. Where blocks stop is predicted as for
 * --quote (lull/host.h).
 */
#ifndef PT_RENDER_PROGRESS_H
#define PT_RENDER_PROGRESS_H

#include "base/log.h"
#include "render/render.h"

/* Threads that are at work: what other programs leave of the processors, over a part of the time so far. Of a few seconds it
 * would make the time left rise and fall with all that they do. */
struct pt_progress_pace {
    double done_s, at_s; /* thread seconds and wall seconds of sampling, as looked at last */
    double busy;         /* threads; 0: not known */
};

struct pt_progress {
    struct base_log *log; /* borrows */
    double next_s;        /* wall time of the next line */
    struct pt_progress_pace pace;
    double percent;   /* of the work, as of the last line … */
    uint64_t samples; /* … when the render had so many */
    int map;          /* above the line stand the blocks, as large as a terminal has room */
    char quality[48]; /* the criterion's quality parameter, told beside the map; "": it has none */
};

/* How far a render is that goes on. */
struct pt_progress_now {
    double share;  /* of its work that is done; the least if not known */
    double left_s; /* wall seconds; INFINITY: nobody knows */
    int known;     /* where every block will stop is predicted; else left_s is the most */
};
struct pt_progress_now pt_progress_of(struct pt_progress_pace *pace, const struct pt_render *render);

void pt_progress_init(struct pt_progress *progress, struct base_log *log);
/* Shows a line if it is time for one. */
void pt_progress_update(struct pt_progress *progress, const struct pt_render *render);

/* The line itself, without newline. *percent: that of the line before, at first 0; it never falls. */
void pt_progress_text(struct pt_progress_pace *pace, const struct pt_render *render, double *percent, char *text,
                      size_t room);

#endif
