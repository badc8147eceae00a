/*
 * The host's side of the stopping-criterion ABI: one criterion, one frame, and the film shown to it as the ABI's planes.
 *
 * Criteria are looked for in LULL_PLUGIN_PATH, then in ../lib/lull beside the program, and nowhere else. All calls come from
 * one thread; the criterion may use the pool through parallel_for.
 */
#ifndef PT_RENDER_CRITERION_H
#define PT_RENDER_CRITERION_H

#include <lull/criterion.h>

#include <stdio.h>

#include "base/err.h"
#include "base/threads.h"
#include "render/blocks.h"
#include "render/film.h"

struct pt_criterion;

struct pt_criterion_frame {
    int width, height;      /* of the whole image */
    uint64_t spp_min, spp_max, seed;
    double time_budget_s;   /* 0 = none */
    double sample_clamp;    /* 0 = none */
    int deterministic;      /* decisions may depend on samples only */
    int independent;        /* samples of a pixel are independent */
};

/* Makes an instance of the criterion that spec names (NAME, PATH.so or PATH.so:ID), with parameters. `threads` is borrowed
 * until destroy and may be NULL (one worker). warn gets one line per message of the loader or the criterion; may be NULL. */
int pt_criterion_create(const char *spec, const struct lull_pair *pairs, uint32_t pair_count, struct base_threads *threads,
                        void (*warn)(void *data, const char *line), void *warn_data, struct pt_criterion **out,
                        struct base_err *err);
/* The same for a table that is in memory already. */
int pt_criterion_create_table(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                              struct base_threads *threads, void (*warn)(void *data, const char *line), void *warn_data,
                              struct pt_criterion **out, struct base_err *err);
void pt_criterion_destroy(struct pt_criterion *criterion);

const struct lull_criterion *pt_criterion_table(const struct pt_criterion *criterion);
const struct lull_requirements *pt_criterion_requirements(const struct pt_criterion *criterion);
/* PT_FILM_* planes that it reads. */
uint32_t pt_criterion_film_planes(const struct pt_criterion *criterion);

/* Opens the frame. Fails when the criterion judges blocks of another size only. */
int pt_criterion_begin(struct pt_criterion *criterion, const struct pt_criterion_frame *frame, const struct pt_blocks *blocks,
                       const struct pt_film *film, struct base_err *err);

/* Asks about blocks->list[due[0 … count)] (rising). final: they get no more samples. decisions[i] is preset to CONTINUE and
 * stays so when the criterion fails, which is an error of this call too. */
int pt_criterion_evaluate(struct pt_criterion *criterion, struct pt_film *film, const struct pt_blocks *blocks,
                          const uint32_t *due, uint32_t count, const uint8_t *final, struct lull_decision *decisions,
                          struct base_err *err);

/* The criterion's history as bytes (malloc'ed, caller frees; size 0 when it keeps none), and back. */
int pt_criterion_save(const struct pt_criterion *criterion, unsigned char **data, size_t *size, struct base_err *err);
int pt_criterion_load(struct pt_criterion *criterion, const unsigned char *data, size_t size, struct base_err *err);

/* Every criterion that can be found, with its parameters, for people. Returns the number listed. */
int pt_criterion_list(FILE *out, void (*warn)(void *data, const char *line), void *warn_data);

#endif
