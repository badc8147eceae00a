#include "study/report.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/files.h"
#include "base/json.h"

enum { POWER_DIFFERENCE_PERCENT = 10 };

/* --- tables --- */

static int begin(struct base_file_out *out, const char *dir, const char *name, struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, dir, name, err);
    return rc ? rc : base_file_begin(out, path, err);
}

/* Samples per pixel of octaves; "nan" where unknown. */
static double spp(double octaves) { return exp2(octaves); }

static int write_people(const char *dir, const struct ggn_study_people *p, struct base_err *err)
{
    struct base_file_out out;
    int rc = begin(&out, dir, "people.csv", err);
    if (rc)
        return rc;
    fputs("person;done;of;catch_passed;catch_total;untouched;settings;minutes;median_s;fast;dropped;excluded\n", out.file);
    for (int i = 0; i < p->n; i++) {
        const struct ggn_study_result *r = &p->results[i];
        fprintf(out.file, "%s;%d;%d;%d;%d;%d;%d;%.2f;%.3f;%d;%d;%s\n", r->id, r->done, r->of, r->catch_passed,
                r->catch_total, r->untouched, r->settings, r->minutes, r->median_s, r->fast, r->dropped, r->excluded);
    }
    return base_file_commit(&out, err);
}

static int write_estimates(const char *dir, const struct ggn_study_people *p, struct base_err *err)
{
    struct base_file_out out;
    int rc = begin(&out, dir, "estimates.csv", err);
    if (rc)
        return rc;
    fputs("person;view;block;threshold;low;high;se_octaves;spread_octaves;spread_low;spread_high;trials\n", out.file);
    for (int i = 0; i < p->n; i++)
        for (int c = 0; c < p->n_cells; c++) {
            const struct ggn_study_estimate *e = &p->results[i].cells[c];
            int view;
            const struct ggn_study_block *b = ggn_study_cell_block(p, c, &view);
            if (e->trials > 0)
                fprintf(out.file, "%s;%s;%u;%.2f;%.2f;%.2f;%.4f;%.4f;%.4f;%.4f;%d\n", p->results[i].id,
                        p->study->views[view].name, b->id, spp(e->t), spp(e->lo), spp(e->hi), e->se, e->spread, e->spread_lo,
                        e->spread_hi, e->trials);
        }
    return base_file_commit(&out, err);
}

static int write_blocks(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                        struct base_err *err)
{
    struct base_file_out out;
    int rc = begin(&out, dir, "blocks.csv", err);
    if (rc)
        return rc;
    fputs("view;block;threshold;low;high;spread_octaves;people;trials;at_cap\n", out.file);
    for (int c = 0; c < p->n_cells; c++) {
        int view;
        const struct ggn_study_block *b = ggn_study_cell_block(p, c, &view);
        fprintf(out.file, "%s;%u;%.2f;%.2f;%.2f;%.4f;%d;%d;%d\n", p->study->views[view].name, b->id, spp(t[c].t),
                spp(t[c].lo), spp(t[c].hi), t[c].spread, t[c].people, t[c].trials, t[c].at_cap);
    }
    return base_file_commit(&out, err);
}

/* Whether the view's blocks are 0, 1, … and all have a threshold: then it has a line in thresholds.csv. */
static int is_whole(const struct ggn_study_people *p, const struct ggn_study_threshold *t, int view)
{
    const struct ggn_study_view *v = &p->study->views[view];
    for (int b = 0; b < v->n_blocks; b++)
        if (v->blocks[b].id != (uint32_t)b || isnan(t[p->first[view] + b].t))
            return 0;
    return 1;
}

static int write_thresholds(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                            struct base_err *err)
{
    struct base_file_out out;
    int whole = 0, rc = 0;
    for (int v = 0; v < p->study->n_views; v++)
        whole += is_whole(p, t, v);
    if (whole == 0)
        return 0;
    rc = begin(&out, dir, "thresholds.csv", err);
    if (rc)
        return rc;
    for (int v = 0; v < p->study->n_views; v++) {
        if (!is_whole(p, t, v))
            continue;
        fprintf(out.file, "%s;", p->study->views[v].name);
        for (int c = p->first[v]; c < p->first[v + 1]; c++)
            fprintf(out.file, "%.2f;", spp(t[c].t));
        putc('\n', out.file);
    }
    return base_file_commit(&out, err);
}

static int write_view_json(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t, int view,
                           struct base_err *err)
{
    char name[GGN_STUDY_NAME + 32], path[4096];
    const struct ggn_study_view *v = &p->study->views[view];
    int failed = 0, known = 0;
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "scene", v->name, &failed);
    base_json_text(root, "source", "people", &failed);
    cJSON *blocks = base_json_array(root, "blocks", &failed);
    for (int b = 0; b < v->n_blocks; b++) {
        const struct ggn_study_threshold *th = &t[p->first[view] + b];
        if (isnan(th->t))
            continue;
        cJSON *o = base_json_object(blocks, NULL, &failed);
        base_json_number(o, "id", v->blocks[b].id, &failed);
        base_json_number(o, "x0", v->blocks[b].x0, &failed);
        base_json_number(o, "y0", v->blocks[b].y0, &failed);
        base_json_number(o, "threshold", spp(th->t), &failed);
        base_json_number(o, "low", spp(th->lo), &failed);
        base_json_number(o, "high", spp(th->hi), &failed);
        known++;
    }
    snprintf(name, sizeof name, "thresholds-%s.json", v->name);
    int rc = known > 0 ? base_file_join(path, dir, name, err) : 0;
    if (!rc && known > 0)
        rc = base_json_write(path, root, failed || !root, err);
    cJSON_Delete(root);
    return rc;
}

/* --- kinds --- */

static int has_kinds(const struct ggn_study *s)
{
    for (int v = 0; v < s->n_views; v++)
        if (s->views[v].kind)
            return 1;
    return 0;
}

static void put_difference(FILE *f, const struct ggn_study_difference *d)
{
    fprintf(f, "%.4f;%.4f;%.4f;%d\n", d->octaves, d->lo, d->hi, d->people);
}

static int write_kinds(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                       struct base_err *err)
{
    struct base_file_out out;
    int rc = has_kinds(p->study) ? begin(&out, dir, "kinds.csv", err) : 0;
    if (rc || !has_kinds(p->study))
        return rc;
    fputs("view;kind;block;threshold;low;high;octaves_above_noisy;octaves_low;octaves_high;people\n", out.file);
    for (int c = 0; c < p->n_cells; c++) {
        int view;
        const struct ggn_study_block *b = ggn_study_cell_block(p, c, &view);
        const struct ggn_study_view *v = &p->study->views[view];
        const struct ggn_study_difference d = ggn_study_against_noisy(p, v->kind, c);
        fprintf(out.file, "%s;%s;%u;%.2f;%.2f;%.2f;", v->name, ggn_study_kind_names[v->kind], b->id, spp(t[c].t),
                spp(t[c].lo), spp(t[c].hi));
        put_difference(out.file, &d);
    }
    for (int k = GGN_STUDY_DENOISED; k < GGN_STUDY_KINDS; k++) {
        const struct ggn_study_difference d = ggn_study_against_noisy(p, (enum ggn_study_kind)k, -1);
        if (d.people > 0) {
            fprintf(out.file, "(all);%s;;;;;", ggn_study_kind_names[k]);
            put_difference(out.file, &d);
        }
    }
    return base_file_commit(&out, err);
}

static void print_kinds(const struct ggn_study_people *p)
{
    for (int k = GGN_STUDY_DENOISED; k < GGN_STUDY_KINDS; k++) {
        const struct ggn_study_difference d = ggn_study_against_noisy(p, (enum ggn_study_kind)k, -1);
        if (d.people > 0)
            printf("%s: %.2f × the samples of the noisy picture [%.2f, %.2f], %d people, up to %d blocks\n",
                   ggn_study_kind_names[k], exp2(d.octaves), exp2(d.lo), exp2(d.hi), d.people, d.blocks);
    }
}

/* --- judgements --- */

static int write_judgements(const char *dir, const struct ggn_study_people *p, struct base_err *err)
{
    struct base_file_out out;
    int rc = begin(&out, dir, "judgements.csv", err);
    if (rc)
        return rc;
    fputs("view;condition;same;judgements;share;low;high;rating\n", out.file);
    for (int v = 0; v <= p->study->n_views; v++) /* the last: all views */
        for (int c = 0; c < p->study->n_conditions; c++) {
            struct ggn_study_share s = ggn_study_share(p, v < p->study->n_views ? v : -1, c);
            fprintf(out.file, "%s;%s;%d;%d;%.4f;%.4f;%.4f;%.3f\n", v < p->study->n_views ? p->study->views[v].name : "(all)",
                    p->study->conditions[c], s.same, s.n, s.share, s.lo, s.hi, s.rating);
        }
    return base_file_commit(&out, err);
}

/* The form of the published tables: a row per scene, a column per method, per cent judged the same. */
static void print_scenes(FILE *f, const struct ggn_study_people *p, const char *separator)
{
    fputs("view", f);
    for (int c = 0; c < p->study->n_conditions; c++)
        fprintf(f, "%s%s", separator, p->study->conditions[c]);
    putc('\n', f);
    for (int v = 0; v <= p->study->n_views; v++) {
        fputs(v < p->study->n_views ? p->study->views[v].name : "(all)", f);
        for (int c = 0; c < p->study->n_conditions; c++) {
            struct ggn_study_share s = ggn_study_share(p, v < p->study->n_views ? v : -1, c);
            if (s.n > 0)
                fprintf(f, "%s%.0f %% [%.0f, %.0f]", separator, 100.0 * s.share, 100.0 * s.lo, 100.0 * s.hi);
            else
                fprintf(f, "%s", separator);
        }
        putc('\n', f);
    }
}

static int write_scenes(const char *dir, const struct ggn_study_people *p, struct base_err *err)
{
    struct base_file_out out;
    int rc = begin(&out, dir, "scenes.csv", err);
    if (rc)
        return rc;
    print_scenes(out.file, p, ";");
    return base_file_commit(&out, err);
}

/* --- report.json --- */

static int people_that_count(const struct ggn_study_people *p)
{
    int n = 0;
    for (int i = 0; i < p->n; i++)
        n += p->results[i].excluded[0] == '\0' && p->results[i].done > 0;
    return n;
}

/* The sum over people of an int of their results. */
static int total(const struct ggn_study_people *p, size_t member)
{
    int n = 0;
    for (int i = 0; i < p->n; i++)
        n += *(const int *)(const void *)((const char *)&p->results[i] + member);
    return n;
}
#define TOTAL(p, member) total(p, offsetof(struct ggn_study_result, member))

static void add_head(cJSON *root, const struct ggn_study_people *p, int *failed)
{
    base_json_text(root, "format", "lull-study-report", failed);
    base_json_number(root, "version", 1, failed);
    base_json_text(root, "study", p->study->id, failed);
    base_json_text(root, "task", ggn_study_task_names[p->study->task], failed);
    base_json_number(root, "people", p->n, failed);
    base_json_number(root, "people_that_count", people_that_count(p), failed);
    base_json_number(root, "min_catch_passed", p->study->min_catch_passed, failed);
    base_json_number(root, "max_untouched", p->study->max_untouched, failed);
    base_json_number(root, "min_ms", p->study->min_ms, failed);
    base_json_number(root, "max_fast", p->study->max_fast, failed);
    base_json_number(root, "fast_answers", TOTAL(p, fast), failed);
    if (p->study->fps)
        base_json_number(root, "dropped_answers", TOTAL(p, dropped), failed);
    cJSON *list = base_json_array(root, "excluded", failed);
    for (int i = 0; i < p->n; i++)
        if (p->results[i].excluded[0] != '\0') {
            cJSON *o = base_json_object(list, NULL, failed);
            base_json_text(o, "person", p->results[i].id, failed);
            base_json_text(o, "why", p->results[i].excluded, failed);
        }
}

static void add_ceiling(cJSON *root, const struct ggn_study_ceiling *c, int *failed)
{
    cJSON *o = base_json_object(root, "noise_ceiling", failed);
    base_json_number(o, "people", c->people, failed);
    base_json_number(o, "blocks", c->blocks, failed);
    base_json_number(o, "pearson_lower", c->pearson_lower, failed);
    base_json_number(o, "pearson_upper", c->pearson_upper, failed);
    base_json_number(o, "spearman_lower", c->spearman_lower, failed);
    base_json_number(o, "spearman_upper", c->spearman_upper, failed);
    base_json_number(o, "median_abs_log2_lower", c->median_abs_log2_lower, failed);
    base_json_number(o, "median_abs_log2_upper", c->median_abs_log2_upper, failed);
    base_json_number(o, "within_half_lower", c->within_half_lower, failed);
    base_json_number(o, "within_one_lower", c->within_one_lower, failed);
}

/* People needed for a difference of 10 %, from the pooled share of each condition. */
static int people_needed(const struct ggn_study_people *p, int condition, double *icc)
{
    struct ggn_study_share s = ggn_study_share(p, -1, condition);
    *icc = ggn_study_icc(p, condition);
    return s.n > 0 ? ggn_study_people_needed(s.share, POWER_DIFFERENCE_PERCENT / 100.0,
                                             p->study->n_views * p->study->repeats, isnan(*icc) ? 0.0 : *icc)
                   : 0;
}

static void add_conditions(cJSON *root, const struct ggn_study_people *p, int *failed)
{
    cJSON *list = base_json_array(root, "conditions", failed);
    for (int c = 0; c < p->study->n_conditions; c++) {
        struct ggn_study_share s = ggn_study_share(p, -1, c);
        double icc;
        int needed = people_needed(p, c, &icc);
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_text(o, "name", p->study->conditions[c], failed);
        base_json_number(o, "same", s.same, failed);
        base_json_number(o, "judgements", s.n, failed);
        base_json_number(o, "share", s.share, failed);
        base_json_number(o, "low", s.lo, failed);
        base_json_number(o, "high", s.hi, failed);
        base_json_number(o, "rating", s.rating, failed);
        base_json_number(o, "icc", icc, failed);
        base_json_number(o, "people_for_10_percent", s.n > 0 ? needed : (double)NAN, failed);
    }
}

static int write_json(const char *dir, const struct ggn_study_people *p, const struct ggn_study_ceiling *ceiling,
                      struct base_err *err)
{
    char path[4096];
    int failed = 0, rc = base_file_join(path, dir, "report.json", err);
    if (rc)
        return rc;
    cJSON *root = cJSON_CreateObject();
    add_head(root, p, &failed);
    if (p->study->task == GGN_STUDY_VALIDATION)
        add_conditions(root, p, &failed);
    else
        add_ceiling(root, ceiling, &failed);
    rc = base_json_write(path, root, failed || !root, err);
    cJSON_Delete(root);
    return rc;
}

/* --- the whole --- */

static void print_figures(const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                          const struct ggn_study_ceiling *c)
{
    int known = 0;
    printf("%d people, %d count\n", p->n, people_that_count(p));
    for (int i = 0; i < p->n; i++)
        if (p->results[i].excluded[0] != '\0')
            printf("  %s does not count: %s\n", p->results[i].id, p->results[i].excluded);
    if (TOTAL(p, fast) > 0)
        printf("%d answers in less than %g ms are left out\n", TOTAL(p, fast), p->study->min_ms);
    if (TOTAL(p, dropped) > 0)
        printf("%d answers to clips with a frame that the screen never showed are left out\n", TOTAL(p, dropped));
    if (p->study->task == GGN_STUDY_VALIDATION) {
        puts("judged the same as the reference, with 95 % intervals (Wilson):");
        print_scenes(stdout, p, "\t");
        for (int i = 0; i < p->study->n_conditions; i++) {
            double icc;
            int needed = people_needed(p, i, &icc);
            if (needed > 0)
                printf("%s: about %d people would show a difference of %d %%%s\n", p->study->conditions[i], needed,
                       POWER_DIFFERENCE_PERCENT,
                       isnan(icc) ? " (if people do not differ, which one person cannot tell)" : "");
        }
        return;
    }
    for (int i = 0; i < p->n_cells; i++)
        known += !isnan(t[i].t);
    printf("%d of %d blocks have a threshold\n", known, p->n_cells);
    print_kinds(p);
    if (c->people > 1)
        printf("noise ceiling, %d people, up to %d blocks: r %.2f … %.2f, Spearman %.2f … %.2f, median |log2| %.2f octaves "
               "(one person against "
               "the others)\n",
               c->people, c->blocks, c->pearson_lower, c->pearson_upper, c->spearman_lower, c->spearman_upper,
               c->median_abs_log2_lower);
}

static int write_threshold_files(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                                 struct base_err *err)
{
    int rc = write_estimates(dir, p, err);
    if (!rc)
        rc = write_blocks(dir, p, t, err);
    if (!rc)
        rc = write_thresholds(dir, p, t, err);
    if (!rc)
        rc = write_kinds(dir, p, t, err);
    for (int v = 0; v < p->study->n_views && !rc; v++)
        rc = write_view_json(dir, p, t, v, err);
    return rc;
}

int ggn_study_report(const char *dir, const struct ggn_study_people *p, int pictures, struct base_err *err)
{
    struct ggn_study_ceiling ceiling = {0};
    int validation = p->study->task == GGN_STUDY_VALIDATION, rc = 0;
    if (mkdir(dir, 0777) != 0 && errno != EEXIST)
        return base_fail(err, BASE_EIO, "%s: %s", dir, strerror(errno));
    struct ggn_study_threshold *t = calloc((size_t)p->n_cells + 1, sizeof *t);
    if (!t)
        return base_fail_nomem(err, dir);
    ggn_study_thresholds(p, t);
    rc = write_people(dir, p, err);
    if (!rc && validation)
        rc = write_judgements(dir, p, err);
    if (!rc && validation)
        rc = write_scenes(dir, p, err);
    if (!rc && !validation)
        rc = write_threshold_files(dir, p, t, err);
    if (!rc && !validation)
        rc = ggn_study_ceiling(p, &ceiling, err);
    if (!rc)
        rc = write_json(dir, p, &ceiling, err);
    if (!rc && pictures && people_that_count(p) > 0)
        rc = ggn_study_report_pictures(dir, p, t, err);
    if (!rc)
        print_figures(p, t, &ceiling);
    free(t);
    return rc;
}
