/*
 * The wave loop: samples every active block up to its next check, asks the criterion about all of them at once, stops or
 * schedules each, until none is active.
 *
 * Between two checks the work is cut into slices of a fraction of a second, after which the caller may show progress, write
 * a checkpoint or ask for an end. A slice takes as many blocks as its threads need rows, those first that are furthest from
 * their check. Slices leave no trace in the image: samples of a pixel are summed in index order whatever the slices,
 * threads, processes and order of blocks. Not thread-safe; uses the pool that it is given.
 */
#ifndef PT_RENDER_RENDER_H
#define PT_RENDER_RENDER_H

#include <signal.h>
#include <stdint.h>

#include "base/err.h"
#include "base/identity.h"
#include "base/log.h"
#include "base/threads.h"
#include "integ/integrator.h"
#include "job/job.h"
#include "render/farm.h"
#include "render/host.h"

struct pt_render_config {
    int width, height; /* of the image, pixels */
    int crop[4];       /* x0, y0, x1, y1, end exclusive, not empty, inside the image */
    int block_width, block_height;
    uint64_t spp_min, spp_max; /* 1 <= spp_min <= spp_max <= 2^31 - 1; equal: uniform */
    int uniform;               /* every block gets spp_max samples; a criterion is asked once at the end */
    double time_budget_s;      /* 0 = none */
    uint64_t pilot_spp; /* not 0: pt_render_run ends, with the blocks still active, before one gets more samples … */
    double pilot_s;     /* … and after so many seconds */
    double max_check_overhead;       /* share of the elapsed time that checks may take; 0 = no bound */
    double max_seam;                 /* most ratio of samples of neighbouring blocks, 0 = any (lull_host_reopen) */
    const struct lull_plane *mask;   /* borrows for pt_render_create; NULL = none */
    uint32_t planes;                 /* PT_FILM_* wanted besides those of the criterion */
    struct pt_integrator integrator; /* want_aux is set by the renderer */
    uint32_t order_seed;             /* not 0: work is handed out in a shuffled order (tests) */
    struct job *job;                 /* borrows; whose workers help to sample, NULL: none */
};

/* A block that is to be sampled. */
struct pt_render_candidate {
    uint32_t block;
    int octave;       /* of its samples: who has few goes first */
    double left_s;    /* thread seconds to its check, for want of better its samples to there */
    double per_spp_s; /* thread seconds per sample of all its pixels; 0 = not known */
};

/* Scratch of the slices; owned. */
struct pt_render_work {
    struct pt_row *items; /* [rows of all blocks] */
    size_t count;
    struct pt_render_candidate *candidates; /* [blocks] */
    uint32_t *due;                          /* [blocks] */
    uint8_t *final;                         /* [blocks] */
    struct lull_decision *decisions;        /* [blocks] */
};

struct pt_render {
    struct pt_render_config config;
    const struct pt_scene *scene; /* borrows */
    pt_kernel *kernel;
    struct base_threads *threads;          /* borrows */
    struct lull_host_criterion *criterion; /* borrows; NULL only with config.uniform */
    struct pt_film film;
    struct pt_host_view shown;       /* the film as criteria see it */
    struct lull_host_frame *frame;   /* owns; decides: blocks, limits, who is asked */
    struct lull_host_blocks *blocks; /* of the frame, as the totals */
    struct lull_host_totals *totals;
    struct pt_render_work work;
    double samples_per_s; /* recent, 0 = not known yet */
    double busy_threads;  /* likewise: thread seconds per wall second of sampling */
    long sampled_rows;    /* what those threads had to share */
};

enum pt_render_outcome {
    PT_RENDER_DONE,
    PT_RENDER_OUT_OF_TIME,
    PT_RENDER_INTERRUPTED,
    PT_RENDER_PILOT,
    PT_RENDER_LOST /* a worker: ended as if interrupted, and hooks.log was told why */
};

struct pt_render_hooks {
    /* After every slice; a negative code ends pt_render_run with it. May be NULL. */
    int (*slice)(void *data, struct pt_render *render, struct base_err *err);
    /* Asked about the blocks of each check after the criterion, before they are stopped or scheduled. May be NULL. */
    struct lull_host_quote *quote;
    /* Then told of the criterion's answers about blocks render->work.due[0 … count); a negative code ends pt_render_run with
     * it. May be NULL. */
    int (*looked)(void *data, struct pt_render *render, uint32_t count, struct base_err *err);
    /* Not 0: end after this slice. May be NULL. */
    const volatile sig_atomic_t *interrupted;
    /* Called before the blocks still active are closed for a limit or an interrupt, or when none is left, while everything
     * is as a later run needs it to go on. May be NULL. */
    int (*suspend)(void *data, struct pt_render *render, struct base_err *err);
    struct base_log *log; /* may be NULL */
    void *data;
};

/* Allocates the film and begins a frame for the criterion. The config is copied; scene, threads and criterion are borrowed
 * until destroy. */
int pt_render_create(const struct pt_render_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                     struct base_threads *threads, struct lull_host_criterion *criterion, struct pt_render **out,
                     struct base_err *err);
void pt_render_destroy(struct pt_render *render);

/* Of a uniform render: block i gets spp[i] samples instead, 1 … spp_max. To be said again after a state was loaded. */
void pt_render_plan(struct pt_render *render, const uint32_t *spp);

/* Options that may differ when a render goes on: they change no sample, only how many there are (base_option.role). */
enum pt_role {
    PT_ROLE_END = BASE_OWN_ROLE, /* the most samples */
    PT_ROLE_LIMIT,               /* where else blocks are checked and re-opened */
    PT_ROLE_RULE                 /* parameters of the criterion */
};
/* After a state was loaded, whose most samples may have been others: what these options would not have stopped is active
 * again. others: 1 << role of those that differ. first_spp: where a fresh render of these has its first check. */
void pt_render_go_on(struct pt_render *render, unsigned others, uint64_t first_spp);

/* Renders until all blocks are stopped, time is up, a pilot is over, or *interrupted is set. A pilot leaves the render
 * as it is between two slices: going on gives what it would have been without. */
int pt_render_run(struct pt_render *render, const struct pt_render_hooks *hooks, enum pt_render_outcome *outcome,
                  struct base_err *err);

/* For recording: samples every block up to spp (0: each to its own next_spp), without checks; *stopped is set when
 * *interrupted was before. */
int pt_render_advance(struct pt_render *render, uint64_t spp, const struct pt_render_hooks *hooks, int *stopped,
                      struct base_err *err);
/* Lists every block that has not been asked about with these samples in work.due, asks the criterion, if there is one, and
 * notes the answers, which are in work.decisions; nothing is stopped. Returns how many. */
uint32_t pt_render_judge(struct pt_render *render, const struct pt_render_hooks *hooks);

/* LULL_HOST_ and LULL_FRAME_ of such a frame. */
uint32_t pt_render_flags(const struct pt_render_config *config);

int pt_render_threads(const struct pt_render *render); /* that sample, those of workers too */

#endif
