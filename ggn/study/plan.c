#include "study/plan.h"

#include <math.h>
#include <stdlib.h>

/* SplitMix64 (Steele, Lea, Flood 2014). */
static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

/* Uniform in [0, n); the bias of the remainder is below n / 2^64. */
static int below(uint64_t *state, int n) { return (int)(next_random(state) % (uint64_t)n); }

static void shuffle(uint64_t *state, int *x, int n)
{
    for (int i = n - 1; i > 0; i--) {
        int j = below(state, i + 1), t = x[i];
        x[i] = x[j];
        x[j] = t;
    }
}

static void identity(int *x, int n)
{
    for (int i = 0; i < n; i++)
        x[i] = i;
}

uint64_t ggn_study_person_seed(const struct ggn_study *study, uint64_t n)
{
    uint64_t state = study->seed * UINT64_C(0x2545f4914f6cdd1d) + n;
    return next_random(&state) >> 11;
}

int ggn_study_slot_takes(const struct ggn_study *s, const struct ggn_study_slot *slot, uint32_t level)
{
    if (s->task == GGN_STUDY_VALIDATION || slot->catch_trial)
        return level == 0;
    return ggn_study_level(&s->views[slot->view].blocks[slot->block], level) >= 0;
}

int ggn_study_slot_times(const struct ggn_study *s, const struct ggn_study_slot *slot, const char *text, int *dropped)
{
    int n = s->views[slot->view].frames > 1 ? 2 * ggn_study_shown_frames(s) : 0;
    *dropped = 0;
    for (int i = 0; i < n; i++) {
        char *end;
        if (*text < '0' || *text > '9')
            return 0;
        long ms = strtol(text, &end, 10);
        if (ms > GGN_STUDY_MAX_STAND || *end != (i + 1 < n ? ' ' : '\0'))
            return 0;
        *dropped += ms == 0;
        text = *end ? end + 1 : end;
    }
    return *text == '\0';
}

/* Of n trials so many are catch trials: at least one when there are any. */
static int catch_count(const struct ggn_study *s, int n)
{
    int count = (int)lround(s->catch_share * n);
    return s->catch_share > 0.0 && count == 0 ? 1 : count;
}

int ggn_study_plan_count(const struct ggn_study *s)
{
    double blocks = 0.0, n;
    for (int v = 0; v < s->n_views; v++)
        blocks += s->views[v].n_blocks;
    if (s->task == GGN_STUDY_ADJUSTMENT) {
        n = blocks * s->repeats;
    } else if (s->task == GGN_STUDY_TWO_INTERVAL) {
        n = blocks * s->trials;
    } else {
        n = (double)s->n_views * s->n_conditions * s->repeats;
        n += n <= GGN_STUDY_MAX_TRIALS ? 2 * catch_count(s, (int)n / 2) : 0;
    }
    return n <= GGN_STUDY_MAX_TRIALS ? (int)n : GGN_STUDY_MAX_TRIALS + 1;
}

double ggn_study_plan_minutes(const struct ggn_study *s)
{
    const double judging_s = 15.0, setting_s = 12.0, choosing_s = 1.0; /* guesses; of people nothing is known yet */
    double trial_s = s->task == GGN_STUDY_VALIDATION     ? judging_s
                     : s->task == GGN_STUDY_TWO_INTERVAL ? 2.0 * (s->gap_ms + s->show_ms) / 1000.0 + choosing_s
                                                         : setting_s;
    return ggn_study_plan_count(s) * trial_s / 60.0;
}

/* Views one after the other in random order, each once per round of repeats. */
static void plan_adjustment(const struct ggn_study *s, uint64_t *state, int *order, struct ggn_study_plan *p)
{
    int screen = 0;
    for (int round = 0; round < s->repeats; round++) {
        identity(order, s->n_views);
        shuffle(state, order, s->n_views);
        for (int i = 0; i < s->n_views; i++, screen++) {
            const struct ggn_study_view *v = &s->views[order[i]];
            for (int b = 0; b < v->n_blocks; b++)
                p->slots[p->n++] = (struct ggn_study_slot){
                    .view = order[i], .block = b, .screen = screen, .start = below(state, v->blocks[b].n_levels)};
        }
    }
}

/* View by view, so that the page preloads one view at a time. In each round every block comes once, and no block follows
 * itself: its next level depends on the answer, everybody else's is known and loaded before. Per block a permutation of the
 * rounds says which are catch trials, and the noise comes as often first as second. */
static void plan_two_interval(const struct ggn_study *s, uint64_t *state, int *work, struct ggn_study_plan *p)
{
    int *order = work, *blocks = order + s->n_views,
        *rounds = blocks + GGN_STUDY_MAX_BLOCKS; /* rounds: [n_blocks][trials] */
    int catches = catch_count(s, s->trials);
    identity(order, s->n_views);
    shuffle(state, order, s->n_views);
    for (int i = 0; i < s->n_views; i++) {
        int n = s->views[order[i]].n_blocks, last = -1;
        for (int b = 0; b < n; b++) {
            identity(rounds + (size_t)b * (size_t)s->trials, s->trials);
            shuffle(state, rounds + (size_t)b * (size_t)s->trials, s->trials);
        }
        for (int round = 0; round < s->trials; round++) {
            identity(blocks, n);
            shuffle(state, blocks, n);
            if (n > 1 && blocks[0] == last) {
                blocks[0] = blocks[n - 1];
                blocks[n - 1] = last;
            }
            for (int b = 0; b < n; b++) {
                int rank = rounds[(size_t)blocks[b] * (size_t)s->trials + (size_t)round];
                p->slots[p->n++] =
                    (struct ggn_study_slot){.view = order[i],
                                            .block = blocks[b],
                                            .side = rank & 1,
                                            .catch_trial = rank < catches ? GGN_STUDY_CATCH_PLAIN : GGN_STUDY_NO_CATCH};
            }
            last = blocks[n - 1];
        }
    }
}

/* All pictures in random order; half of the catch trials differ plainly, the other half not at all. */
static void plan_validation(const struct ggn_study *s, uint64_t *state, struct ggn_study_plan *p)
{
    int judged = s->n_views * s->n_conditions * s->repeats, catches = ggn_study_plan_count(s) - judged;
    struct ggn_study_slot *slots = p->slots;
    for (int i = 0; i < judged; i++)
        slots[i] = (struct ggn_study_slot){.view = i % s->n_views, .condition = i / s->n_views % s->n_conditions};
    for (int i = 0; i < catches; i++)
        slots[judged + i] =
            (struct ggn_study_slot){.view = below(state, s->n_views),
                                    .condition = -1,
                                    .catch_trial = i % 2 ? GGN_STUDY_CATCH_IDENTICAL : GGN_STUDY_CATCH_PLAIN};
    p->n = judged + catches;
    for (int i = p->n - 1; i > 0; i--) {
        int j = below(state, i + 1);
        struct ggn_study_slot t = slots[i];
        slots[i] = slots[j];
        slots[j] = t;
    }
    for (int i = 0; i < p->n; i++)
        slots[i].side = below(state, 2);
}

int ggn_study_plan_init(struct ggn_study_plan *plan, const struct ggn_study *s, uint64_t seed, struct base_err *err)
{
    struct ggn_study_plan p = {0};
    uint64_t state = seed;
    int n = ggn_study_plan_count(s);
    if (n > GGN_STUDY_MAX_TRIALS)
        return base_fail(err, BASE_EINVAL, "study: more than %d trials for one person; take fewer views or trials",
                         GGN_STUDY_MAX_TRIALS);
    int *work = malloc(((size_t)s->n_views + GGN_STUDY_MAX_BLOCKS + (size_t)n) * sizeof *work);
    p.slots = malloc((size_t)(n > 0 ? n : 1) * sizeof *p.slots);
    if (!p.slots || !work) {
        free(p.slots);
        free(work);
        return base_fail_nomem(err, "plan of a study");
    }
    if (s->task == GGN_STUDY_ADJUSTMENT)
        plan_adjustment(s, &state, work, &p);
    else if (s->task == GGN_STUDY_TWO_INTERVAL)
        plan_two_interval(s, &state, work, &p);
    else
        plan_validation(s, &state, &p);
    free(work);
    *plan = p;
    return 0;
}

void ggn_study_plan_release(struct ggn_study_plan *plan)
{
    free(plan->slots);
    *plan = (struct ggn_study_plan){0};
}
