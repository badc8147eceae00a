/*
 * Raw trials out of a study and into it again: one JSON file, its form in ggn/study/FORMAT.md.
 *
 * Keys are not in the file: it does not let its reader go on in a person's name, and an imported person gets a new key.
 */
#ifndef GGN_STUDY_TRANSFER_H
#define GGN_STUDY_TRANSFER_H

#include "study/store.h"
#include "study/study.h"

/* Writes all trials to path, atomically. */
int ggn_study_export(const struct ggn_study *study, struct ggn_study_store *store, const char *path, int *people,
                     struct base_err *err);
/* Adds all people of the file, or none: a file of another study, a person who is there already, a trial that cannot be of
 * this study are refused. */
int ggn_study_import(const struct ggn_study *study, struct ggn_study_store *store, const char *path, int *people,
                     struct base_err *err);

#endif
