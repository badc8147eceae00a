#include "train/train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "figures/stats.h"
#include "nn/hash.h"
#include "train/session.h"
#include "train/start.h"

struct ggn_train_plan ggn_train_plan_default(enum ggn_preset preset)
{
    const int lull = preset == GGN_PRESET_LULL;

    return (struct ggn_train_plan){
        .data = {.ratio = lull ? 1.1 : 0},
        .preset = preset,
        .window = 6,
        .k_r = lull ? 8 : 16,
        .k_m = lull ? 10 : 20,
        .k_d = lull ? 32 : 64,
        .crop = lull ? 96 : 0,
        .batch_r = 16,
        .batch = lull ? 16 : 64,
        .steps_r = lull ? 2000 : 0,
        .steps = lull ? 2000 : 0,
        .epochs = 30,
        .epoch_steps = lull ? 100 : 0,
        .patience = lull ? 8 : 0,
        .lr_r = lull ? 1e-3 : 2e-4,
        .lr = lull ? 1e-3 : 2e-4,
        .difference = lull ? 8 : 0,
        .soft_labels = lull,
        .jitter = lull ? 0.3 : 0,
        .synthetic = lull ? 1 : 0,
        .extend = lull,
        .validation_windows = 400,
        .early_rate = 0.02,
        .seed = 1,
        .threads = 0,
    };
}

/* --- small parts that both phases use ------------------------------------------------------------------------------------- */

double ggn_session_lr(const struct ggn_session *s, double lr, uint64_t step, uint64_t steps)
{
    static const double LOWEST = 0.02, PI = 3.14159265358979323846;
    double t = steps ? (double)step / (double)steps : 0, warm = fmin(1, ((double)step + 1) / fmax(20, 0.02 * (double)steps));

    return lr * warm * (LOWEST + (1 - LOWEST) * 0.5 * (1 + cos(PI * t))) * ldexp(1, -s->progress.divergences);
}

uint32_t ggn_session_seed(const struct ggn_session *s)
{
    return ggn_hash(s->plan->seed, 1000 + (uint32_t)(10 * s->progress.divergences + s->progress.phase));
}

int ggn_session_interrupted(const struct ggn_session *s)
{
    return s->plan->interrupted && *s->plan->interrupted;
}

static void path_of(const struct ggn_session *s, const char *suffix, char *path, size_t room)
{
    snprintf(path, room, "%s%s", s->plan->out, suffix);
}

static void say(const struct ggn_session *s, const struct ggn_log_row *row, uint64_t steps, double rate)
{
    FILE *f = s->plan->progress;
    double left = (double)(steps - s->progress.step) / fmax(rate, 1e-9) *
                  (row->phase ? s->plan->batch : s->plan->batch_r);

    if (!f)
        return;
    fprintf(f, "%-8s %6.0f/%llu  loss %.4f", row->phase ? "judge" : "denoiser", row->step, (unsigned long long)steps, row->loss);
    if (row->phase)
        fprintf(f, "  accuracy %.3f", row->accuracy);
    if (!isnan(row->validation_loss))
        fprintf(f, "  | validation loss %.4f", row->validation_loss);
    if (row->phase && !isnan(row->validation_auc))
        fprintf(f, "  accuracy %.3f  AUC %.4f", row->validation_accuracy, row->validation_auc);
    fprintf(f, "  | %.1f %s/s  ETA %d:%02d\n", rate, row->phase ? "windows" : "crops", (int)(left / 60), (int)fmod(left, 60));
    fflush(f);
}

int ggn_session_epoch(struct ggn_session *s, struct ggn_log_row *row, uint64_t steps, double samples, double seconds,
                      struct base_err *err)
{
    char path[4096];

    row->step = (double)s->progress.step;
    row->seconds = s->progress.seconds[row->phase];
    int rc = ggn_log_add(&s->log, row, err);
    if (rc)
        return rc;
    say(s, row, steps, samples / fmax(seconds, 1e-9));
    path_of(s, ".csv", path, sizeof path);
    rc = ggn_log_write_csv(&s->log, path, err);
    if (rc)
        return rc;
    path_of(s, ".ckpt", path, sizeof path);
    return ggn_session_save(s, path, err);
}

/* Copies params, mean and var of a network into one array, or back. */
static void copy_net(float *flat, struct ggn_weights *w, int store)
{
    float *const part[3] = {w->params, w->mean, w->var};
    const size_t count[3] = {w->graph->n_params, w->graph->n_stats, w->graph->n_stats};

    for (int i = 0; i < 3; flat += count[i++])
        memcpy(store ? flat : part[i], store ? part[i] : flat, count[i] * sizeof *flat);
    if (!store)
        ggn_weights_pack(w, NULL);
}

int ggn_session_keep_best(struct ggn_session *s, struct base_err *err)
{
    (void)err;
    copy_net(s->best[0], s->trainer->weights[GGN_NET_M], 1);
    copy_net(s->best[1], s->trainer->weights[GGN_NET_D], 1);
    if (s->best_r)
        copy_net(s->best_r, s->trainer->weights[GGN_NET_R], 1);
    return 0;
}

void ggn_session_load_best(struct ggn_session *s)
{
    copy_net(s->best[0], s->trainer->weights[GGN_NET_M], 0);
    copy_net(s->best[1], s->trainer->weights[GGN_NET_D], 0);
    if (s->best_r)
        copy_net(s->best_r, s->r, 0);
}

/* --- set-up --------------------------------------------------------------------------------------------------------------- */

static int check_plan(const struct ggn_session *s, struct base_err *err)
{
    const struct ggn_train_plan *p = s->plan;
    const int paper = p->preset == GGN_PRESET_PAPER;

    if (p->batch < 1 || p->batch > 1024 || p->batch_r < 1 || p->batch_r > 1024)
        return base_fail(err, BASE_EINVAL, "a batch has 1 to 1024 samples");
    if (!paper && (p->crop < 16 || p->crop > s->set.width || p->crop > s->set.height))
        return base_fail(err, BASE_EINVAL, "crop %d is not in 16..%d, the side of the blocks", p->crop,
                        s->set.width < s->set.height ? s->set.width : s->set.height);
    if (p->k_r < 3)
        return base_fail(err, BASE_EINVAL, "the denoiser needs a width of at least 3");
    if (!s->train.n)
        return base_fail(err, BASE_EINVAL, "%s: no training block has a label and %d levels; run `ggn label` first", p->data.dir, p->window);
    int noisy = 0;
    for (int i = 0; i < s->train.n; i++) {
        noisy += s->train.list[i].noisy;
        if (paper && !s->set.chains[s->train.list[i].chain].reference)
            return base_fail(err, BASE_EINVAL, "%s: preset paper needs a reference for each training block", p->data.dir);
    }
    if (noisy == 0 || noisy == s->train.n)
        return base_fail(err, BASE_EINVAL, "%s: all %d training windows are %s: nothing to tell apart", p->data.dir, s->train.n,
                        noisy ? "noisy" : "free of noise");
    return 0;
}

static int prepare(struct ggn_session *s, struct base_err *err)
{
    const struct ggn_train_plan *p = s->plan;
    const int paper = p->preset == GGN_PRESET_PAPER;
    int rc = ggn_chains_load(&s->set, &p->data, err);

    if (!rc && p->synthetic > 0)
        rc = ggn_chains_add_synthetic(&s->set, p->synthetic, p->seed, err);
    if (!rc && p->extend)
        rc = ggn_chains_extend(&s->set, p->seed, err);
    if (rc)
        return rc;
    struct ggn_window_options train = {.split = GGN_SPLIT_TRAIN, .length = p->window, .synthetic = 1, .label_first = paper,
                                       .soft = p->soft_labels};
    struct ggn_window_options validation = {.split = GGN_SPLIT_VALIDATION, .length = p->window, .soft = p->soft_labels};
    rc = ggn_windows_create(&s->train, &s->set, &train, err);
    if (!rc)
        rc = ggn_windows_create(&s->validation, &s->set, &validation, err);
    if (!rc)
        rc = check_plan(s, err);
    if (rc)
        return rc;
    s->hyper = (struct ggn_hyper){.preset = p->preset, .height = s->set.height, .width = s->set.width, .window = p->window,
                                  .k_r = p->k_r, .k_m = p->k_m, .k_d = p->k_d};
    rc = ggn_network_build(&s->r_graph, GGN_NET_R, &s->hyper, err);
    s->r = rc ? NULL : ggn_weights_create(&s->r_graph, NULL, 0, err);
    if (!s->r)
        return rc ? rc : BASE_ENOMEM;
    size_t crops = 6 * (size_t)p->batch_r * (size_t)p->crop * (size_t)p->crop;
    size_t windows = 2 * (size_t)p->batch * (size_t)p->window * ggn_chains_values(&s->set);
    size_t pointers = 6 * (size_t)p->batch_r + 6 * (size_t)p->batch * (size_t)p->window;
    s->buffer = malloc((crops > windows ? crops : windows) * sizeof *s->buffer);
    s->planes = malloc(pointers * sizeof *s->planes);
    return s->buffer && s->planes ? 0 : base_fail_nomem(err, "a batch");
}

static void session_release(struct ggn_session *s)
{
    ggn_trainer_destroy(s->trainer);
    ggn_weights_destroy(s->r);
    free(s->best[0]);
    free(s->best[1]);
    free(s->best_r);
    free(s->buffer);
    free((void *)s->planes);
    ggn_log_release(&s->log);
    ggn_windows_release(&s->train);
    ggn_windows_release(&s->validation);
    ggn_chains_release(&s->set);
    base_threads_destroy(s->threads);
}

static struct ggn_train_options trainer_options(const struct ggn_session *s, int parts, int batch)
{
    struct ggn_train_options o = ggn_train_options_default(s->plan->preset);

    o.parts = parts;
    o.batch = batch;
    o.seed = s->plan->seed;
    o.lr[GGN_NET_R] = s->plan->lr_r;
    o.lr[GGN_NET_M] = o.lr[GGN_NET_D] = s->plan->lr;
    return o;
}

static int begin_denoiser(struct ggn_session *s, struct base_err *err)
{
    struct ggn_hyper crop = s->hyper;
    struct ggn_train_options o = trainer_options(s, GGN_TRAIN_R, s->plan->batch_r);

    crop.height = crop.width = s->plan->crop;
    s->progress.phase = GGN_PHASE_DENOISER;
    s->trainer = ggn_trainer_create(&crop, &o, s->threads, err);
    if (!s->trainer)
        return BASE_ENOMEM;
    struct ggn_weights *w = s->trainer->weights[GGN_NET_R];
    if (s->plan->init) {
        memcpy(w->params, s->r->params, s->r_graph.n_params * sizeof *w->params);
        memcpy(w->mean, s->r->mean, s->r_graph.n_stats * sizeof *w->mean);
        memcpy(w->var, s->r->var, s->r_graph.n_stats * sizeof *w->var);
    } else {
        ggn_train_identity(&s->trainer->graph[GGN_NET_R], w->params);
    }
    ggn_weights_pack(w, NULL);
    ggn_trainer_keep(s->trainer);
    return 0;
}

/* The denoiser's weights leave the trainer of crops for good. */
static void end_denoiser(struct ggn_session *s)
{
    const struct ggn_weights *from = s->trainer->weights[GGN_NET_R];

    memcpy(s->r->params, from->params, s->r_graph.n_params * sizeof *from->params);
    memcpy(s->r->mean, from->mean, s->r_graph.n_stats * sizeof *from->mean);
    memcpy(s->r->var, from->var, s->r_graph.n_stats * sizeof *from->var);
    ggn_weights_pack(s->r, NULL);
    ggn_trainer_destroy(s->trainer);
    s->trainer = NULL;
}

static int begin_judge(struct ggn_session *s, struct base_err *err)
{
    const int paper = s->plan->preset == GGN_PRESET_PAPER;
    struct ggn_train_options o = trainer_options(s, paper ? GGN_TRAIN_ALL : GGN_TRAIN_MD, s->plan->batch);

    s->progress = (struct ggn_progress){.phase = GGN_PHASE_JUDGE, .best_loss = HUGE_VAL,
                                        .seconds = {s->progress.seconds[0], 0}};
    s->trainer = ggn_trainer_create(&s->hyper, &o, s->threads, err);
    if (!s->trainer)
        return BASE_ENOMEM;
    for (int i = 0; i < 2; i++) {
        const struct ggn_graph *g = &s->trainer->graph[i ? GGN_NET_D : GGN_NET_M];
        s->best[i] = calloc(g->n_params + 2 * g->n_stats, sizeof *s->best[i]);
    }
    s->best_r = paper ? calloc(s->r_graph.n_params + 2 * s->r_graph.n_stats, sizeof *s->best_r) : NULL;
    if (!s->best[0] || !s->best[1] || (paper && !s->best_r))
        return base_fail_nomem(err, "the best epoch");
    return 0;
}

/* --- the end -------------------------------------------------------------------------------------------------------------- */

/* Calibration and policy from all validation windows (real levels only). */
static int finish(struct ggn_session *s, struct base_err *err)
{
    struct ggn_policy policy = ggn_policy_default();
    struct ggn_stopping stopping = {0};
    const int n = s->validation.n;
    size_t room = (size_t)n + 1;
    int *index = malloc(room * sizeof *index), right = 0;
    double *logit = malloc(room * sizeof *logit), *label = malloc(room * sizeof *label);
    double auc = (double)NAN, slope = 0;
    unsigned char *noisy = malloc(room);
    int rc = index && logit && label && noisy ? 0 : base_fail_nomem(err, "calibration");

    ggn_session_load_best(s);
    for (int i = 0; !rc && i < n; i++) {
        index[i] = i;
        label[i] = s->validation.list[i].label;
        noisy[i] = (unsigned char)s->validation.list[i].noisy;
    }
    if (!rc && s->plan->preset == GGN_PRESET_PAPER)
        rc = ggn_session_denoise(s, GGN_SPLIT_VALIDATION, err);
    if (!rc && n)
        rc = ggn_session_logits(s, &s->validation, index, n, logit, err);
    if (!rc && n)
        rc = ggn_stats_auc(logit, noisy, (size_t)n, &auc, err);
    if (!rc && n) {
        ggn_calibrate_platt(logit, label, n, &policy);
        for (int i = 0; i < n; i++)
            right += (ggn_policy_p(&policy, logit[i]) >= 0.5) == noisy[i];
        slope = ggn_calibrate_slope(&s->validation, logit, &policy);
        rc = ggn_calibrate_threshold(&s->validation, logit, s->plan->early_rate, &policy, &stopping, err);
    }
    if (!rc) {
        policy.slope = slope;
        policy.first_spp = s->set.first_spp;
        policy.ratio = s->set.ratio > 1.001 ? s->set.ratio : 0;
        policy.step_spp = s->set.step_spp;
        ggn_calibrate_limits(&s->train, &policy);
        ggn_calibrate_limits(&s->validation, &policy);
        rc = ggn_session_export(s, &policy, &stopping, auc, n ? (double)right / n : (double)NAN, err);
    }
    free(index);
    free(logit);
    free(label);
    free(noisy);
    return rc;
}

static int draw_curves(const struct ggn_session *s, struct base_err *err)
{
    char path[4096];

    path_of(s, ".png", path, sizeof path);
    struct base_err picture = {0};
    if (ggn_log_draw(&s->log, path, &picture) && s->plan->progress)
        fprintf(s->plan->progress, "no picture of the learning curves: %s\n", picture.text); /* gnuplot is optional */
    (void)err;
    return 0;
}

static void announce(const struct ggn_session *s)
{
    if (!s->plan->progress)
        return;
    fprintf(s->plan->progress, "%d scenes; blocks: %d training (+ %d synthetic), %d validation; windows: %d training, %d validation; levels from %g, %s %g\n",
            s->set.n_scenes, ggn_chains_count(&s->set, GGN_SPLIT_TRAIN, 1),
            ggn_chains_count(&s->set, GGN_SPLIT_TRAIN, 0) - ggn_chains_count(&s->set, GGN_SPLIT_TRAIN, 1),
            ggn_chains_count(&s->set, GGN_SPLIT_VALIDATION, 1), s->train.n, s->validation.n, s->set.first_spp,
            s->set.ratio > 0 ? "ratio" : "step", s->set.ratio > 0 ? s->set.ratio : s->set.step_spp);
    if (!s->validation.n)
        fprintf(s->plan->progress, "no validation windows: the last epoch counts and p stays uncalibrated\n");
}

/* Runs the phases from `phase` on. */
static int run(struct ggn_session *s, int phase, int resume, const char *checkpoint, struct base_err *err)
{
    const int paper = s->plan->preset == GGN_PRESET_PAPER;
    int rc = 0;

    if (phase == GGN_PHASE_DENOISER) {
        rc = begin_denoiser(s, err);
        if (!rc && resume) {
            rc = ggn_session_restore(s, checkpoint, err);
            if (!rc) {
                ggn_weights_pack(s->trainer->weights[GGN_NET_R], NULL);
                ggn_trainer_keep(s->trainer);
            }
        }
        if (!rc)
            rc = ggn_phase_denoiser(s, err);
        if (rc)
            return rc;
        end_denoiser(s);
        resume = 0;
    }
    rc = begin_judge(s, err);
    if (!rc && s->plan->init)
        rc = ggn_session_import(s, s->plan->init, err);
    if (!rc && resume)
        rc = ggn_session_restore(s, checkpoint, err);
    if (rc)
        return rc;
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_pack(s->trainer->weights[net], NULL);
    ggn_trainer_keep(s->trainer);
    if (!paper)
        rc = ggn_session_denoise(s, GGN_SPLITS, err);
    return rc ? rc : ggn_phase_judge(s, err);
}

int ggn_train(const struct ggn_train_plan *plan, struct base_err *err)
{
    struct ggn_session s = {.plan = plan};
    char checkpoint[4096];
    struct stat st;
    int phase = plan->preset == GGN_PRESET_PAPER ? GGN_PHASE_JUDGE : GGN_PHASE_DENOISER;

    path_of(&s, ".ckpt", checkpoint, sizeof checkpoint);
    int resume = plan->resume && stat(checkpoint, &st) == 0;
    int rc = resume ? ggn_session_saved_phase(checkpoint, &phase, err) : 0;
    s.threads = rc ? NULL : base_threads_create(plan->threads > 0 ? plan->threads : base_threads_available(), err);
    if (!rc && !s.threads)
        rc = BASE_ENOMEM;
    if (!rc)
        rc = prepare(&s, err);
    if (!rc) {
        announce(&s);
        if (plan->init)
            rc = ggn_session_import(&s, plan->init, err);
    }
    if (!rc)
        rc = run(&s, phase, resume, checkpoint, err);
    if (!rc)
        rc = finish(&s, err);
    if (!rc)
        rc = draw_curves(&s, err);
    session_release(&s);
    return rc;
}
