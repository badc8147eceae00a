#include "train/log.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "figures/plot.h"

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
    fputs("phase,step,loss,accuracy,validation_loss,validation_accuracy,validation_auc,learning_rate,seconds\n", out.file);
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
        fprintf(out.file, "%.1f\n", r->seconds);
    }
    return base_file_commit(&out, err);
}

static void data_block(FILE *f, const struct ggn_log *log, int phase)
{
    fprintf(f, "$phase%d << END\n", phase);
    for (int i = 0; i < log->n; i++) {
        const struct ggn_log_row *r = &log->rows[i];
        if (r->phase == phase)
            fprintf(f, "%g %g %g %g %g %g\n", r->step, r->loss, r->validation_loss, r->accuracy, r->validation_accuracy,
                    r->validation_auc);
    }
    fputs("END\n", f);
}

static int has_phase(const struct ggn_log *log, int phase)
{
    for (int i = 0; i < log->n; i++)
        if (log->rows[i].phase == phase)
            return 1;
    return 0;
}

int ggn_log_draw(const struct ggn_log *log, const char *path, struct base_err *err)
{
    struct ggn_plot plot;
    int denoiser = has_phase(log, 0), judge = has_phase(log, 1);
    int rc = ggn_plot_begin(&plot, path, 480 * (denoiser + 2 * judge), 400, err);

    if (rc)
        return rc;
    FILE *f = plot.script;
    data_block(f, log, 0);
    data_block(f, log, 1);
    fprintf(f, "set multiplot layout 1,%d\nset grid\nset xrange [0:*]\nset xlabel 'step'\n", denoiser + 2 * judge);
    if (denoiser)
        fputs("set title 'Denoiser: 1 - SSIM'\nplot $phase0 using 1:2 with linespoints lw 2 pt 7 ps 0.4 lc '#3366aa' title "
              "'training', "
              "$phase0 using 1:3 with linespoints lw 2 pt 7 ps 0.4 lc '#cc5522' title 'validation'\n",
              f);
    if (judge)
        fputs("set title 'Generator and discriminator: cross-entropy'\nplot $phase1 using 1:2 with linespoints lw 2 pt 7 ps "
              "0.4 lc '#3366aa' title "
              "'training', $phase1 using 1:3 with linespoints lw 2 pt 7 ps 0.4 lc '#cc5522' title 'validation, calibrated'\n"
              "set title 'Accuracy and AUC'\nset yrange [0.5:1]\nset key bottom right\n"
              "plot $phase1 using 1:4 with linespoints lw 2 pt 7 ps 0.4 lc '#3366aa' title 'training accuracy', $phase1 "
              "using 1:5 with linespoints lw 2 pt 7 ps 0.4 "
              "lc '#cc5522' title 'validation accuracy', $phase1 using 1:6 with linespoints lw 2 pt 7 ps 0.4 lc '#228833' "
              "title 'validation AUC'\n",
              f);
    fputs("unset multiplot\n", f);
    return ggn_plot_end(&plot, 1, err);
}
