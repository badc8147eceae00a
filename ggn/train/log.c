#include "train/session.h"

#include <math.h>
#include <stdlib.h>

#include "base/files.h"

const char *const ggn_log_phases[] = {"denoiser", "judge"};

int ggn_log_add(struct ggn_log *log, const struct ggn_log_row *row, struct base_err *err)
{
    struct ggn_log_row *more = realloc(log->rows, ((size_t)log->n + 1) * sizeof *more);
    if (!more)
        return base_fail_nomem(err, "learning curves");
    log->rows = more;
    log->rows[log->n++] = *row;
    return 0;
}

void ggn_log_release(struct ggn_log *log)
{
    free(log->rows);
    *log = (struct ggn_log){0};
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
        for (int k = 0; k < GGN_LOG_NUMBERS - 2; k++) {
            if (!isnan(r->numbers[k]))
                fprintf(out.file, "%.9g", r->numbers[k]);
            fputc(',', out.file);
        }
        fprintf(out.file, "%.1f,%.1f\n", r->seconds, r->processor_s);
    }
    return base_file_commit(&out, err);
}
