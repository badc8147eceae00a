#include "study/status.h"

#include <math.h>
#include <string.h>

static void print_person(FILE *out, const struct ggn_study_result *r)
{
    char done[32], passed[32], median[32] = "-", dropped[64] = "";
    snprintf(done, sizeof done, "%d/%d", r->done, r->of);
    snprintf(passed, sizeof passed, "%d/%d", r->catch_passed, r->catch_total);
    if (!isnan(r->median_s))
        snprintf(median, sizeof median, "%.1f", r->median_s);
    if (r->dropped > 0)
        snprintf(dropped, sizeof dropped, "  %d with frames that were never shown", r->dropped);
    fprintf(out, "%-8s  %10s  %7s  %8s  %4d  %7.1f  %s%s%s%s\n", r->id, done, passed, median, r->fast, r->minutes,
            *r->last ? r->last : "-", dropped, *r->excluded ? "  does not count: " : "", r->excluded);
}

void ggn_study_status(FILE *out, const struct ggn_study_people *p)
{
    int finished = 0, begun = 0;
    const char *last = "";
    for (int i = 0; i < p->n; i++) {
        finished += p->results[i].done == p->results[i].of;
        begun += p->results[i].done > 0;
        if (strcmp(p->results[i].last, last) > 0)
            last = p->results[i].last;
    }
    fprintf(out, "%s: %d people, %d finished, %d under way, %d without an answer%s%s\n",
            ggn_study_task_names[p->study->task], p->n, finished, begun - finished, p->n - begun,
            *last ? "; last answer " : "", last);
    if (p->n == 0)
        return;
    fprintf(out, "%-8s  %10s  %7s  %8s  %4s  %7s  last answer\n", "person", "done", "catch", "median s", "fast", "minutes");
    for (int i = 0; i < p->n; i++)
        print_person(out, &p->results[i]);
}
