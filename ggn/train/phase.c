#include "train/phase.h"

#include <math.h>

#include "base/clock.h"

enum { MOST_DIVERGENCES = 8 };

static void say(const struct ggn_session *s, const struct ggn_log_row *row, const struct ggn_phase *phase, double rate)
{
    FILE *f = s->plan->progress;
    double left = (double)(phase->steps - s->progress.step) / fmax(rate, 1e-9) * phase->batch;
    if (!f)
        return;
    fprintf(f, "%-8s %6.0f/%llu  loss %.4f", ggn_log_phases[row->phase], row->step, (unsigned long long)phase->steps,
            row->loss);
    if (row->phase)
        fprintf(f, "  accuracy %.3f", row->accuracy);
    if (!isnan(row->validation_loss))
        fprintf(f, "  | validation loss %.4f", row->validation_loss);
    if (row->phase && !isnan(row->validation_auc))
        fprintf(f, "  accuracy %.3f  AUC %.4f", row->validation_accuracy, row->validation_auc);
    fprintf(f, "  | %.1f %s/s  ETA %d:%02d\n", rate, row->phase ? "windows" : "crops", (int)(left / 60),
            (int)fmod(left, 60));
    fflush(f);
}

/* One epoch with its curves and checkpoint; on divergence the trainer is back at the epoch's start and so is the step. */
static int epoch(struct ggn_session *s, const struct ggn_phase *phase, struct base_err *err)
{
    const uint64_t begin = s->progress.step, left = phase->steps - begin;
    const uint64_t n = left < phase->epoch_steps ? left : phase->epoch_steps;
    struct ggn_log_row row = {.phase = s->progress.phase};
    char path[4096];
    double start = base_clock_wall_s(), processor = base_clock_process_s(), loss, right;
    while (s->progress.step < begin + n) {
        if (s->plan->interrupted && *s->plan->interrupted)
            return GGN_TRAIN_INTERRUPTED;
        int rc = phase->step(s, s->progress.step, phase->steps, &loss, &right, err);
        if (rc) {
            s->progress.step = begin;
            return rc;
        }
        row.loss += loss / (double)n;
        row.accuracy += right / (double)n;
        s->progress.step++;
    }
    double seconds = base_clock_wall_s() - start;
    int rc = phase->validate(s, &row, err);
    if (rc)
        return rc;
    s->progress.seconds[row.phase] += base_clock_wall_s() - start;
    s->progress.processor_s[row.phase] += base_clock_process_s() - processor;
    /* from here on a divergence goes back to this state; written only once it has been validated and logged */
    ggn_trainer_keep(s->trainer);
    row.lr = s->trainer->options.lr[phase->net];
    row.step = (double)s->progress.step;
    row.seconds = s->progress.seconds[row.phase];
    row.processor_s = s->progress.processor_s[row.phase];
    rc = ggn_log_add(&s->log, &row, err);
    if (rc)
        return rc;
    say(s, &row, phase, (double)n * phase->batch / fmax(seconds, 1e-9));
    snprintf(path, sizeof path, "%s.csv", s->plan->out);
    rc = ggn_log_write_csv(&s->log, path, err);
    return rc ? rc : ggn_resume_save(s, err);
}

/* The denoiser's own phase is not cut short, and there is no model without a validation. */
static int hours_spent(const struct ggn_session *s)
{
    return s->plan->hours > 0 && s->progress.phase == GGN_PHASE_CLASSIFIER && s->progress.step > 0 &&
           s->progress.processor_s[0] + s->progress.processor_s[1] >= 3600 * s->plan->hours;
}

int ggn_phase_run(struct ggn_session *s, const struct ggn_phase *phase, struct base_err *err)
{
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_pack(s->trainer->weights[net], NULL);
    ggn_trainer_keep(s->trainer);
    while (s->progress.step < phase->steps && !hours_spent(s)) {
        int rc = epoch(s, phase, err);
        if (rc == GGN_EDIVERGED && ++s->progress.divergences <= MOST_DIVERGENCES) {
            if (s->plan->progress)
                fprintf(s->plan->progress, "%s; learning rates halved\n", err->text);
            err->code = 0;
            continue;
        }
        if (rc)
            return rc;
        if (s->plan->patience && s->progress.stale >= s->plan->patience)
            break;
    }
    return 0;
}
