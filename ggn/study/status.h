/* Where a study stands while people take part: who, how far, how quickly, and who would not count. */
#ifndef GGN_STUDY_STATUS_H
#define GGN_STUDY_STATUS_H

#include <stdio.h>

#include "study/people.h"

/* A line on all of them, and a line for each person in order of arrival. */
void ggn_study_status(FILE *out, const struct ggn_study_people *people);

#endif
