#include "eval/compare.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"

void ggn_pairing_release(struct ggn_pairing *p)
{
    free(p->views);
    free(p->truth);
    free(p->model);
    *p = (struct ggn_pairing){0};
}

/* The model's view that goes with truth->views[i], or NULL. */
static const struct ggn_view *partner(const struct ggn_thresholds *truth, int i, const struct ggn_thresholds *model,
                                      const char *view)
{
    const struct ggn_view *t = &truth->views[i];
    if (view && model->n == 1)
        return strcmp(t->name, view) == 0 ? &model->views[0] : NULL;
    if (view && strcmp(t->name, view) != 0)
        return NULL;
    if (truth->n == 1 && model->n == 1 && (t->unnamed || model->views[0].unnamed))
        return &model->views[0];
    return ggn_thresholds_find(model, t->name);
}

int ggn_pairing_init(struct ggn_pairing *out, const struct ggn_thresholds *truth, const struct ggn_thresholds *model,
                     const char *view, struct base_err *err)
{
    struct ggn_pairing p = {0};
    size_t room = 0;
    int rc = 0;
    for (int i = 0; i < truth->n; i++)
        room += (size_t)truth->views[i].n;
    p.views = malloc((size_t)(truth->n > 0 ? truth->n : 1) * sizeof *p.views);
    p.truth = malloc((room > 0 ? room : 1) * sizeof *p.truth);
    p.model = malloc((room > 0 ? room : 1) * sizeof *p.model);
    if (!p.views || !p.truth || !p.model) {
        rc = base_fail_nomem(err, "pairs");
        goto out;
    }
    for (int i = 0; i < truth->n; i++) {
        const struct ggn_view *t = &truth->views[i], *m = partner(truth, i, model, view);
        if (!m)
            continue;
        if (m->n != t->n) {
            rc = base_fail(err, BASE_EINVAL, "view '%s': %d blocks against %d", t->name, t->n, m->n);
            goto out;
        }
        p.views[p.n_views++] = (struct ggn_pair){t, m, p.n};
        for (int b = 0; b < t->n; b++)
            if (!isnan(t->spp[b]) && !isnan(m->spp[b])) {
                p.truth[p.n] = t->spp[b];
                p.model[p.n++] = m->spp[b];
            }
    }
    if (p.n == 0)
        rc = base_fail(err, BASE_EINVAL,
                       view ? "no view called '%s' to compare" : "no view has the same name on both sides%s",
                       view ? view : " (--view NAME names the partner of a single view)");
out:
    if (rc) {
        ggn_pairing_release(&p);
        return rc;
    }
    *out = p;
    return 0;
}

/* The figures in the order they are shown. */
#define FIGURES(X) \
    X(pearson_r, "%.4f", "Pearson r") \
    X(pearson_r_below_cap, "%.4f", "Pearson r, true below cap") \
    X(spearman, "%.4f", "Spearman rho") \
    X(spearman_below_cap, "%.4f", "Spearman rho, true below cap") \
    X(mae, "%.1f", "mean absolute error (spp)") \
    X(mae_below_cap, "%.1f", "  true below cap") \
    X(rmse, "%.1f", "RMSE (spp)") \
    X(share_below, "%.4f", "share below the true threshold") \
    X(early_stop_rate, "%.4f", "share below 0.8 x true (early stops)") \
    X(samples_ratio, "%.4f", "samples / samples at the true thresholds") \
    X(median_abs_log2, "%.4f", "median |log2(model/true)|") \
    X(median_log2, "%.4f", "median log2(model/true)") \
    X(iqr_log2, "%.4f", "inter-quartile range of log2") \
    X(within_half, "%.4f", "share within 1/2 octave") \
    X(within_one, "%.4f", "share within 1 octave")

void ggn_agreement_print_table(FILE *f, const struct ggn_agreement *a)
{
    fprintf(f, "%-42s %10zu\n%-42s %10zu\n", "blocks", a->blocks, "  true below cap", a->below_cap);
#define ROW(key, format, text) \
    do { \
        char value[32]; \
        snprintf(value, sizeof value, format, a->key + 1e-12); /* an exact half (284 of 640) rounds up */ \
        fprintf(f, "%-42s %10s\n", text, isnan(a->key) ? "-" : value); \
    } while (0);
    FIGURES(ROW)
#undef ROW
}

void ggn_agreement_print_json(FILE *f, const struct ggn_agreement *a)
{
    fprintf(f, "{\"blocks\": %zu, \"blocks_below_cap\": %zu", a->blocks, a->below_cap);
#define MEMBER(key, format, text) \
    if (isnan(a->key)) \
        fputs(", \"" #key "\": null", f); \
    else \
        fprintf(f, ", \"" #key "\": %.6f", a->key);
    FIGURES(MEMBER)
#undef MEMBER
    fputs("}", f);
}

static int columns_of(const struct ggn_pair *p)
{
    int c = p->truth->columns > 0 ? p->truth->columns : p->model->columns;
    return c > 0 ? c : (int)lround(ceil(sqrt((double)p->truth->n)));
}

int ggn_compare_write_blocks(const char *path, const struct ggn_pairing *p, struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fputs("view;block;true_spp;model_spp;log2_error;column;row\n", out.file);
    for (int v = 0; v < p->n_views; v++) {
        const struct ggn_view *t = p->views[v].truth, *m = p->views[v].model;
        const int columns = columns_of(&p->views[v]);
        for (int b = 0; b < t->n; b++)
            if (!isnan(t->spp[b]) && !isnan(m->spp[b]))
                fprintf(out.file, "%s;%d;%.10g;%.10g;%.4f;%d;%d\n", t->name, b, t->spp[b], m->spp[b],
                        log2(m->spp[b] / t->spp[b]), b % columns, b / columns);
    }
    return base_file_commit(&out, err);
}
