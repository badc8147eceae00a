/*
 * The report of a study: CSV, JSON and pictures in a folder.
 *
 * Of thresholds:
 * - thresholds.csv, one line per view of which all blocks are known, for `ggn label --human` and `ggn compare`;
 * - thresholds-VIEW.json, the same per view with any blocks;
 * - blocks.csv, estimates.csv (per person), people.csv, report.json;
 * - kinds.csv where kinds are shown: each against the noisy picture;
 * - thresholds.png, people.png, and for two intervals curves.png.
 *
 * Of a validation: people.csv, judgements.csv, scenes.csv, report.json, shares.png. Columns: ggn/study/FORMAT.md.
 */
#ifndef GGN_STUDY_REPORT_H
#define GGN_STUDY_REPORT_H

#include "study/summary.h"

/* Makes `dir` if need be. Also prints the main figures on stdout. pictures 0: none (they take gnuplot). */
int ggn_study_report(const char *dir, const struct ggn_study_people *people, int pictures, struct base_err *err);

/* The pictures alone (report_pictures.c). */
int ggn_study_report_pictures(const char *dir, const struct ggn_study_people *people,
                              const struct ggn_study_threshold *thresholds, struct base_err *err);

#endif
