/*
 * What each person gave, out of the trials: an estimate per block or a judgement per pair, and whether they count.
 *
 * Cells are the blocks of all views in a row: cell = first[view] + block. The rules that exclude a person are in FORMAT.md.
 */
#ifndef GGN_STUDY_PEOPLE_H
#define GGN_STUDY_PEOPLE_H

#include "base/threads.h"
#include "study/plan.h"
#include "study/psychometric.h"
#include "study/store.h"

enum { GGN_STUDY_MIN_TRIALS = 10 }; /* of a block, catch trials included, fast ones not: fewer give no estimate */

struct ggn_study_judgement { /* one of a validation */
    int view, condition;     /* condition -1: a catch trial */
    int same, rating;
};

struct ggn_study_result { /* one person */
    char id[GGN_STUDY_ID];
    int done, of; /* slots */
    int catch_passed, catch_total;
    int untouched, settings;          /* adjustment: settings left where they started, of so many */
    int fast;                         /* answers in less than min_ms: in no estimate */
    int dropped;                      /* answers to clips with a frame that was never drawn: in no estimate */
    double minutes;                   /* answering; pauses not counted */
    double median_s;                  /* of an answer; NaN without any */
    char last[32];                    /* when the latest was stored: UTC, ISO 8601; empty without any */
    char excluded[96];                /* why; empty: counts */
    struct ggn_study_estimate *cells; /* owns; [n_cells]; trials 0 where there is none, as before the estimate */
    struct ggn_study_choice *choices; /* owns; [n_choices]; 2ifc: all of them, for pictures */
    int *choice_cells;                /* owns; [n_choices] */
    int n_choices;
    struct ggn_study_judgement *judgements; /* owns */
    int n_judgements;
};

struct ggn_study_people {
    const struct ggn_study *study; /* borrowed */
    int *first;                    /* owns; [n_views + 1] */
    int n_cells;
    int n;
    struct ggn_study_result *results; /* owns; in order of arrival */
};

/* Reads and judges all trials; people in parallel. Of two intervals there are no estimates yet. */
int ggn_study_people_init(struct ggn_study_people *people, const struct ggn_study *study, struct ggn_study_store *store,
                          struct base_threads *threads, struct base_err *err);
/* Estimates the thresholds of two intervals, the longest part of a report; people in parallel. */
int ggn_study_people_estimate(struct ggn_study_people *people, struct base_threads *threads, struct base_err *err);
void ggn_study_people_release(struct ggn_study_people *people);

/* log2 of the highest level of a cell's block. */
double ggn_study_cell_cap(const struct ggn_study_people *people, int cell);
const struct ggn_study_block *ggn_study_cell_block(const struct ggn_study_people *people, int cell, int *view);

#endif
