/*
 * The order in which one person meets a study: a pure function of the study and of the person's seed.
 *
 * Nothing of a plan is stored: it is made again from the seed whenever a trial comes in, the page asks, or the report reads.
 */
#ifndef GGN_STUDY_PLAN_H
#define GGN_STUDY_PLAN_H

#include "study/study.h"

enum ggn_study_catch {
    GGN_STUDY_NO_CATCH,
    GGN_STUDY_CATCH_PLAIN,    /* heavy noise, which nobody misses */
    GGN_STUDY_CATCH_IDENTICAL /* validation: the reference against itself */
};

struct ggn_study_slot { /* one trial to be done; members that its task does not use are 0 */
    int view, block;    /* indices */
    int screen;         /* adjustment: slots of one screen are done together, in any order */
    int condition;      /* validation: index; -1 in a catch trial */
    int side;           /* 0, 1: the noisy interval is the first, the second; the judged picture is A or left, B or right */
    int start;          /* adjustment: index of the level shown first */
    enum ggn_study_catch catch_trial;
};

struct ggn_study_plan {
    int n;
    struct ggn_study_slot *slots; /* owns */
};

int ggn_study_plan_init(struct ggn_study_plan *plan, const struct ggn_study *study, uint64_t seed, struct base_err *err);
void ggn_study_plan_release(struct ggn_study_plan *plan);
/* Number of slots without making them; GGN_STUDY_MAX_TRIALS + 1 when there would be more than that. */
int ggn_study_plan_count(const struct ggn_study *study);

/* How long a person takes for them, roughly, without instructions and breaks. */
double ggn_study_plan_minutes(const struct ggn_study *study);

/* Whether a trial of the slot can have been at that level: 0 in catch trials and validations, else one of its block's. */
int ggn_study_slot_takes(const struct ggn_study *study, const struct ggn_study_slot *slot, uint32_t level);

/* Whether the text is what the page says of how long each frame of a clip stood in the two intervals: "42 41 0 83 …",
 * milliseconds, 0 for one that was never drawn because the next was due; *dropped counts those. Of stills the text is
 * empty. */
int ggn_study_slot_times(const struct ggn_study *study, const struct ggn_study_slot *slot, const char *text, int *dropped);

/* The seed of the study's n-th person. Below 2^53. */
uint64_t ggn_study_person_seed(const struct ggn_study *study, uint64_t n);

#endif
