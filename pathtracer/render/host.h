/*
 * Asking a criterion: the host's side of the stopping-criterion ABI, one criterion and one frame at a time. host_find finds
 * it, host_services is what it may call, host_planes shows it the film, host_state keeps its history. All calls come from
 * one thread; the criterion may use the pool through parallel_for.
 */
#ifndef PT_RENDER_HOST_H
#define PT_RENDER_HOST_H

#include <lull/criterion.h>

#include "base/err.h"
#include "base/threads.h"
#include "render/blocks.h"
#include "render/film.h"
#include "render/host_services.h"
#include "render/mask.h"

/* Read-only but for the functions of host*.h. */
struct pt_criterion {
    const struct lull_criterion *table;
    struct lull_instance *dialled[PT_MASK_STEPS + 1]; /* own; by step of the mask, NULL where no block is of that step */
    const struct pt_mask *mask;     /* borrows until destroy, as the pairs; NULL = none */
    const struct lull_pair *pairs;
    uint32_t pair_count;
    uint8_t *step;                  /* owns; [blocks] whose instance judges it */
    struct lull_decision *answers;  /* owns; [blocks] scratch of evaluate */
    struct lull_requirements needs;
    struct pt_host_services services;
    struct lull_host host;          /* shows the services to the criterion */
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block *all;         /* owns; [blocks] state of every block */
    struct lull_block *due;         /* owns; [blocks] scratch of evaluate */
    struct lull_rect *rects;        /* owns; [blocks] */
    uint32_t *spp;                  /* owns; [film pixels] only when the criterion requires samples per pixel */
    double begin_s;
    int open;                       /* a frame was begun */
};

struct pt_criterion_frame {
    int width, height;      /* of the whole image */
    uint64_t spp_min, spp_max, seed;
    double time_budget_s;   /* 0 = none */
    double sample_clamp;    /* 0 = none */
    int deterministic;      /* decisions may depend on samples only */
    int independent;        /* samples of a pixel are independent */
};

/* Makes an instance with parameters. `threads` is borrowed until destroy and may be NULL (one worker). warn gets one line
 * per message of the criterion; may be NULL. */
int pt_criterion_create(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                        struct base_threads *threads, void (*warn)(void *data, const char *line), void *warn_data,
                        struct pt_criterion **out, struct base_err *err);
void pt_criterion_destroy(struct pt_criterion *criterion);

/* Before begin: blocks are judged by instances of their own dial. pairs are those of create. */
int pt_criterion_set_mask(struct pt_criterion *criterion, const struct pt_mask *mask, const struct lull_pair *pairs,
                          uint32_t pair_count, struct base_err *err);

/* Opens the frame. Fails when the criterion judges blocks of another size only. */
int pt_criterion_begin(struct pt_criterion *criterion, const struct pt_criterion_frame *frame,
                       const struct pt_blocks *blocks, const struct pt_film *film, struct base_err *err);

/* What is decided where nobody was asked or the answer is not to be had: go on. */
extern const struct lull_decision pt_criterion_undecided;

/* Asks about blocks->list[due[0 … count)] (rising). final: they get no more samples. decisions[i] is preset to undecided
 * and stays so when the criterion fails, which is an error of this call too. */
int pt_criterion_evaluate(struct pt_criterion *criterion, struct pt_film *film, const struct pt_blocks *blocks,
                          const uint32_t *due, uint32_t count, const uint8_t *final, struct lull_decision *decisions,
                          struct base_err *err);

/* Fails with what the criterion said: "criterion ID: " and `what` go before it. */
int pt_criterion_fail(const struct pt_criterion *criterion, const char *what, int32_t code, const struct lull_error *said,
                      struct base_err *err);

#endif
