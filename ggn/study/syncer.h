/*
 * Syncs a file to the disk behind those who write to it, on a thread of its own, so that no answer waits for the disk.
 *
 * What is written while a sync runs goes to the disk with the next one, all of it together.
 */
#ifndef GGN_STUDY_SYNCER_H
#define GGN_STUDY_SYNCER_H

#include "base/err.h"

struct ggn_study_syncer; /* owns the thread and a descriptor of the file */

/* The file must exist and keep its inode. */
int ggn_study_syncer_start(const char *path, struct ggn_study_syncer **syncer, struct base_err *err);
/* What was written so far is to be synced. Any thread; never waits for the disk. */
void ggn_study_syncer_want(struct ggn_study_syncer *syncer);
/* 0, or why a sync failed; nothing is synced after that. Any thread; never waits for the disk. */
int ggn_study_syncer_check(struct ggn_study_syncer *syncer, struct base_err *err);
/* Waits until all that was wanted is synced, or a sync failed; NULL: nothing to do. */
void ggn_study_syncer_stop(struct ggn_study_syncer *syncer);

#endif
