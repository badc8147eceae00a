#include "train/log.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "figures/charts.h"

const char *const ggn_log_phases[] = {"denoiser", "judge"};

int ggn_log_add(struct ggn_log *log, const struct ggn_log_row *row, struct base_err *err)
{
    if ((log->n & (log->n - 1)) == 0) {
        struct ggn_log_row *more = realloc(log->rows, (log->n ? 2 * (size_t)log->n : 1) * sizeof *more);
        if (!more)
            return base_fail_nomem(err, "learning curves");
        log->rows = more;
    }
    log->rows[log->n++] = *row;
    return 0;
}

void ggn_log_release(struct ggn_log *log)
{
    free(log->rows);
    *log = (struct ggn_log){0};
}

static void put(FILE *f, double v, char after)
{
    if (isnan(v))
        fprintf(f, "%c", after);
    else
        fprintf(f, "%.9g%c", v, after);
}

int ggn_log_write_csv(const struct ggn_log *log, const char *path, struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);

    if (rc)
        return rc;
    fputs("phase,step,loss,accuracy,validation_loss,validation_accuracy,validation_auc,learning_rate,seconds,processor_s\n",
          out.file);
    for (int i = 0; i < log->n; i++) {
        const struct ggn_log_row *r = &log->rows[i];
        fprintf(out.file, "%s,", ggn_log_phases[r->phase]);
        put(out.file, r->step, ',');
        put(out.file, r->loss, ',');
        put(out.file, r->accuracy, ',');
        put(out.file, r->validation_loss, ',');
        put(out.file, r->validation_accuracy, ',');
        put(out.file, r->validation_auc, ',');
        put(out.file, r->lr, ',');
        fprintf(out.file, "%.1f,%.1f\n", r->seconds, r->processor_s);
    }
    return base_file_commit(&out, err);
}

static int has_phase(const struct ggn_log *log, int phase)
{
    for (int i = 0; i < log->n; i++)
        if (log->rows[i].phase == phase)
            return 1;
    return 0;
}

/* What is drawn: of the rows of a phase a column over the step, into one of three charts. */
static const struct {
    int chart, phase;
    size_t at;
    const char *title, *colour;
} curves[] = {{0, 0, offsetof(struct ggn_log_row, loss), "training", "#3366aa"},
              {0, 0, offsetof(struct ggn_log_row, validation_loss), "validation", "#cc5522"},
              {1, 1, offsetof(struct ggn_log_row, loss), "training", "#3366aa"},
              {1, 1, offsetof(struct ggn_log_row, validation_loss), "validation, calibrated", "#cc5522"},
              {2, 1, offsetof(struct ggn_log_row, accuracy), "training accuracy", "#3366aa"},
              {2, 1, offsetof(struct ggn_log_row, validation_accuracy), "validation accuracy", "#cc5522"},
              {2, 1, offsetof(struct ggn_log_row, validation_auc), "validation AUC", "#228833"}};
enum { CHARTS = 3, CURVES = sizeof curves / sizeof curves[0] };

int ggn_log_draw(const struct ggn_log *log, const char *path, struct base_err *err)
{
    const double open = (double)NAN;
    struct ggn_chart charts[CHARTS] = {
        {.title = "Denoiser: 1 - SSIM", .from = {0, open}, .to = {open, open}},
        {.title = "Generator and discriminator: cross-entropy", .from = {0, open}, .to = {open, open}},
        {.title = "Accuracy and AUC", .from = {0, 0.5}, .to = {open, 1}, .key = GGN_KEY_BOTTOM}};
    struct ggn_series series[CURVES];
    const size_t rows = (size_t)log->n;
    double *values = malloc((rows > 0 ? 2 * CURVES * rows : 1) * sizeof *values);
    if (!values)
        return base_fail_nomem(err, path);
    for (size_t c = 0; c < CURVES; c++) {
        struct ggn_chart *chart = &charts[curves[c].chart];
        double *x = values + 2 * c * rows, *y = x + rows;
        series[c] = (struct ggn_series){.title = curves[c].title, .colour = curves[c].colour, .x = x, .y = y, .at = open};
        for (size_t i = 0; i < rows; i++)
            if (log->rows[i].phase == curves[c].phase) {
                x[series[c].n] = log->rows[i].step;
                y[series[c].n++] = *(const double *)(const void *)((const char *)&log->rows[i] + curves[c].at);
            }
        chart->series = chart->n++ ? chart->series : &series[c];
        chart->x_label = "step";
        chart->point_size = 0.4;
    }
    const int denoiser = has_phase(log, 0), n = denoiser + 2 * has_phase(log, 1);
    int rc = ggn_plot_charts(path, 480 * n, 400, charts + !denoiser, n, err);
    free(values);
    return rc;
}
