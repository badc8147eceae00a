/*
 * People and their trials: DIR/study.db (SQLite, write-ahead log). A change is on the disk before the call returns, except
 * while it is served (below).
 *
 * A trial is (slot, revision): a slot of the person's plan, and how often it was done again (adjustment only). Trials are
 * added and never changed; the last revision counts. One thread per store unless said; several processes may have the same
 * file open.
 */
#ifndef GGN_STUDY_STORE_H
#define GGN_STUDY_STORE_H

#include <stdint.h>

#include "base/err.h"

enum {
    GGN_STUDY_KEY = 33, /* 32 hex digits: whoever has the key is the person */
    GGN_STUDY_ID = 9,   /* 8 hex digits: names the person in reports and exports */
    GGN_STUDY_PROFILE_MAX = 16384,
    GGN_STUDY_MAX_PEOPLE = 100000,
    GGN_STUDY_TIMES = 608 /* bytes of the times of a clip's frames: two intervals of 60 numbers of 4 digits */
};

struct ggn_study_store; /* owns the connection */

struct ggn_study_person {
    int64_t row; /* inside this file only */
    char id[GGN_STUDY_ID], key[GGN_STUDY_KEY];
    uint64_t seed;
    char created[32]; /* UTC, ISO 8601 */
};

struct ggn_study_trial {
    int slot, revision;
    uint32_t level;                 /* samples per pixel shown or set; 0 in catch trials and validations */
    int answer;                     /* 2ifc: the interval said to be noisy, 1 or 2; validation: 1 same, 0 different */
    int rating;                     /* validation: 1 very disturbing … 5 no difference */
    double ms;                      /* from what was shown to the answer, by the page's clock */
    char layout[16];                /* validation: "beside" or "flip" */
    char frame_ms[GGN_STUDY_TIMES]; /* clips: how long each frame stood (study/plan.h); else empty */
    char at[32];                    /* when it was stored: UTC, ISO 8601 */
};

/* Opens DIR/study.db, made when missing; `study_id` must be that of the study it was made for. create 0: must exist already.
 * dir NULL: in memory, for tests. */
int ggn_study_store_open(const char *dir, const char *study_id, int create, struct ggn_study_store **store,
                         struct base_err *err);
/* Waits until everything is on the disk or the disk fails. */
void ggn_study_store_close(struct ggn_study_store *store);

/* For a store in a folder, before it is served: from now on no call waits for the disk, except for one after another process
 * has imported or deleted. A change is in the system's hands when the call returns, so that the end of the process, however
 * it comes, loses nothing; it is synced to the disk right after, together with all others that came meanwhile. A power cut
 * loses what had not been synced, whole changes from the latest on. The log grows until the store is closed: about 5 KB a
 * trial. */
int ggn_study_store_sync_behind(struct ggn_study_store *store, struct base_err *err);
/* 0, or why syncing failed. Any thread. */
int ggn_study_store_check(struct ggn_study_store *store, struct base_err *err);

/* Everything between begin and commit is on the disk together or not at all. */
int ggn_study_store_begin(struct ggn_study_store *store, struct base_err *err);
int ggn_study_store_commit(struct ggn_study_store *store, struct base_err *err);
void ggn_study_store_rollback(struct ggn_study_store *store);

/* How many people were ever added, deleted ones included: the next one's number. */
int ggn_study_store_next_number(struct ggn_study_store *store, int64_t *number, struct base_err *err);
/* Adds a person; id, key, seed and created are given. */
int ggn_study_store_add_person(struct ggn_study_store *store, const struct ggn_study_person *person, const char *profile,
                               struct base_err *err);
/* 1 found, 0 not there, negative on an error. By key or by id, whichever is not NULL. */
int ggn_study_store_find(struct ggn_study_store *store, const char *key, const char *id, struct ggn_study_person *person,
                         struct base_err *err);
/* All people in order of arrival; *people is malloc'ed (caller frees), NULL when there are none. */
int ggn_study_store_people(struct ggn_study_store *store, struct ggn_study_person **people, int *n, struct base_err *err);
/* What they told and measured, a JSON object text (malloc, caller frees). */
int ggn_study_store_profile(struct ggn_study_store *store, int64_t row, char **profile, struct base_err *err);
int ggn_study_store_set_profile(struct ggn_study_store *store, int64_t row, const char *profile, struct base_err *err);

/* 1 added, 0 the same trial is there already, negative on an error; BASE_EINVAL: another one is there in its place. */
int ggn_study_store_add_trial(struct ggn_study_store *store, int64_t row, const struct ggn_study_trial *trial,
                              struct base_err *err);
/* Trials of a person by slot and revision; *trials is malloc'ed (caller frees), NULL when there are none. */
int ggn_study_store_trials(struct ggn_study_store *store, int64_t row, struct ggn_study_trial **trials, int *n,
                           struct base_err *err);
/* Slots that have a trial. */
int ggn_study_store_count(struct ggn_study_store *store, int64_t row, int *slots, struct base_err *err);
/* Revisions that a slot has. */
int ggn_study_store_revisions(struct ggn_study_store *store, int64_t row, int slot, int *revisions, struct base_err *err);

/* Removes a person and all their trials; the freed pages are overwritten. */
int ggn_study_store_delete(struct ggn_study_store *store, int64_t row, struct base_err *err);

#endif
