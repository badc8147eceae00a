#include "train/resume.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/json.h"
#include "model/container.h"

enum { N_ROW = 10 };

uint32_t ggn_resume_key(const struct ggn_session *s)
{
    const struct ggn_train_plan *p = s->plan;
    const double numbers[] = {(double)p->preset,
                              p->window,
                              p->k_r,
                              p->k_m,
                              p->k_d,
                              s->crop,
                              p->batch_r,
                              p->batch,
                              p->steps_r,
                              p->steps,
                              p->epochs,
                              p->epoch_steps,
                              p->patience,
                              p->lr_r,
                              p->lr,
                              p->difference,
                              p->soft_labels,
                              p->flips,
                              p->jitter,
                              p->noise_map,
                              p->reach,
                              p->scalars,
                              p->painted,
                              p->synthetic,
                              p->extend,
                              p->validation_windows,
                              p->seed,
                              s->set.width,
                              s->set.height,
                              s->set.n};
    uLong crc = crc32(0, (const Bytef *)numbers, sizeof numbers);

    for (int i = 0; i < s->set.n; i++) {
        const struct ggn_level_series *c = &s->set.series[i];
        const double what[] = {c->split, c->block, c->n_levels, c->has_label ? c->label.threshold : -1};
        crc = crc32(crc, (const Bytef *)what, sizeof what);
        if (c->n_levels)
            crc =
                crc32(crc, c->noisy, (uInt)(ggn_series_set_values(&s->set) < 4096 ? ggn_series_set_values(&s->set) : 4096));
    }
    if (p->init)
        crc = crc32(crc, (const Bytef *)p->init, (uInt)strlen(p->init));
    return (uint32_t)crc;
}

/* What the phase changes, as arrays in a fixed order; NULL past the end. */
static float *state_array(struct ggn_session *s, int i, size_t *count)
{
    if (s->progress.phase == GGN_PHASE_DENOISER)
        return ggn_trainer_state(s->trainer, GGN_NET_R, i, count);
    if (i < 5 && s->hyper.preset == GGN_PRESET_PAPER)
        return ggn_trainer_state(s->trainer, GGN_NET_R, i, count);
    if (i < 3) {
        *count = i == 0 ? s->r_graph.n_params : s->r_graph.n_stats;
        return i == 0 ? s->r->params : i == 1 ? s->r->mean : s->r->var;
    }
    i -= s->hyper.preset == GGN_PRESET_PAPER ? 5 : 3;
    if (i < 10)
        return ggn_trainer_state(s->trainer, i < 5 ? GGN_NET_M : GGN_NET_D, i % 5, count);
    static const int net_of[] = {GGN_NET_M, GGN_NET_D, GGN_NET_R};
    float *const lists[] = {s->best[GGN_NET_M], s->best[GGN_NET_D], s->best[GGN_NET_R]};
    enum { LISTS = sizeof lists / sizeof lists[0] };
    float *kept[LISTS];
    int nets[LISTS], n = 0;
    for (int k = 0; k < LISTS; k++)
        if (lists[k]) {
            nets[n] = net_of[k];
            kept[n++] = lists[k];
        }
    i -= 10;
    if (i >= n)
        return NULL;
    *count = s->trainer->graph[nets[i]].n_learned;
    return kept[i];
}

/* --- JSON ------------------------------------------------------------------------------------------------------------- */

static double *row_field(struct ggn_log_row *r, int i)
{
    double *const fields[N_ROW] = {
        NULL,   &r->step,    &r->loss,       &r->accuracy, &r->validation_loss, &r->validation_accuracy, &r->validation_auc,
        &r->lr, &r->seconds, &r->processor_s};
    return fields[i];
}

static char *describe(struct ggn_session *s)
{
    const struct ggn_progress *p = &s->progress;
    cJSON *root = cJSON_CreateObject();
    int failed = 0;
    cJSON *rows = base_json_array(root, "log", &failed);
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"key", ggn_resume_key(s)},
                   {"phase", p->phase},
                   {"step", (double)p->step},
                   {"stale", p->stale},
                   {"divergences", p->divergences},
                   {"best_loss", p->best_loss},
                   {"best_step", (double)p->best_step},
                   {"seconds0", p->seconds[0]},
                   {"seconds1", p->seconds[1]},
                   {"processor_s0", p->processor_s[0]},
                   {"processor_s1", p->processor_s[1]},
                   {"steps", (double)s->trainer->steps},
                   {"t0", (double)s->trainer->adam_t[0]},
                   {"t1", (double)s->trainer->adam_t[1]},
                   {"t2", (double)s->trainer->adam_t[2]}};

    base_json_text(root, "kind", "training", &failed);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        base_json_number(root, numbers[i].name, numbers[i].value, &failed);
    for (int i = 0; i < s->log.n; i++) {
        cJSON *row = base_json_array(rows, NULL, &failed);
        base_json_number(row, NULL, s->log.rows[i].phase, &failed);
        for (int k = 1; k < N_ROW; k++)
            base_json_number(row, NULL, *row_field(&s->log.rows[i], k), &failed);
    }
    char *text = failed ? NULL : cJSON_PrintUnformatted(root);
    cJSON_Delete(root);
    return text;
}

static double number(const cJSON *item) { return cJSON_IsNumber(item) ? item->valuedouble : (double)NAN; }

static double field(const cJSON *root, const char *name) { return number(cJSON_GetObjectItemCaseSensitive(root, name)); }

static int restore(struct ggn_session *s, const cJSON *root, const char *path, struct base_err *err)
{
    struct ggn_progress *p = &s->progress;
    const cJSON *row;
    double step = field(root, "step"), steps = field(root, "steps");

    if (!(step >= 0) || !(steps >= 0) || !(field(root, "t0") >= 0) || !(field(root, "t1") >= 0) || !(field(root, "t2") >= 0))
        return base_fail(err, BASE_EINVAL, "%s: progress is missing", path);
    p->step = (uint64_t)step;
    p->stale = (int)fmax(field(root, "stale"), 0);
    p->divergences = (int)fmax(field(root, "divergences"), 0);
    p->best_loss = field(root, "best_loss");
    p->best_step = (uint64_t)fmax(field(root, "best_step"), 0);
    p->seconds[0] = field(root, "seconds0");
    p->seconds[1] = field(root, "seconds1");
    p->processor_s[0] = fmax(field(root, "processor_s0"), 0);
    p->processor_s[1] = fmax(field(root, "processor_s1"), 0);
    s->trainer->steps = (uint64_t)steps;
    s->trainer->adam_t[0] = (uint64_t)field(root, "t0");
    s->trainer->adam_t[1] = (uint64_t)field(root, "t1");
    s->trainer->adam_t[2] = (uint64_t)field(root, "t2");
    ggn_log_release(&s->log);
    cJSON_ArrayForEach (row, cJSON_GetObjectItemCaseSensitive(root, "log")) {
        struct ggn_log_row r = {.phase = (int)number(cJSON_GetArrayItem(row, 0)) != 0};
        for (int k = 1; k < N_ROW; k++)
            *row_field(&r, k) = number(cJSON_GetArrayItem(row, k));
        int rc = ggn_log_add(&s->log, &r, err);
        if (rc)
            return rc;
    }
    return 0;
}

/* --- file ------------------------------------------------------------------------------------------------------------- */

int ggn_resume_save(struct ggn_session *s, const char *path, struct base_err *err)
{
    struct ggn_container c = {.json = describe(s)};
    size_t count;
    float *array;
    int rc = c.json ? 0 : base_fail_nomem(err, "checkpoint");

    for (int i = 0; !rc && (array = state_array(s, i, &count)); i++) {
        char name[16];
        int dim = (int)count;
        snprintf(name, sizeof name, "%d", i);
        rc = ggn_container_add(&c, name, GGN_F32, 1, &dim, array, err);
    }
    if (!rc)
        rc = ggn_container_write(&c, path, err);
    ggn_container_release(&c);
    return rc;
}

static int read_file(const char *path, struct ggn_container *c, cJSON **root, struct base_err *err)
{
    int rc = ggn_container_read(c, path, err);

    if (rc)
        return rc;
    *root = cJSON_Parse(c->json);
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(*root, "kind");
    if (cJSON_IsString(kind) && !strcmp(kind->valuestring, "training"))
        return 0;
    cJSON_Delete(*root);
    ggn_container_release(c);
    return base_fail(err, BASE_EINVAL, "%s: not a checkpoint of a training", path);
}

int ggn_resume_phase(const char *path, int *phase, struct base_err *err)
{
    struct ggn_container c = {0};
    cJSON *root = NULL;
    int rc = read_file(path, &c, &root, err);

    if (rc)
        return rc;
    double v = field(root, "phase");
    cJSON_Delete(root);
    ggn_container_release(&c);
    if (v != GGN_PHASE_DENOISER && v != GGN_PHASE_CLASSIFIER)
        return base_fail(err, BASE_EINVAL, "%s: of an unknown phase", path);
    *phase = (int)v;
    return 0;
}

int ggn_resume_load(struct ggn_session *s, const char *path, struct base_err *err)
{
    struct ggn_container c = {0};
    cJSON *root = NULL;
    size_t count;
    float *array;
    int rc = read_file(path, &c, &root, err);

    if (rc)
        return rc;
    if (field(root, "key") != ggn_resume_key(s))
        rc = base_fail(err, BASE_EINVAL, "%s: made with other data or options", path);
    for (int i = 0; !rc && (array = state_array(s, i, &count)); i++) {
        char name[16];
        int dim = (int)count;
        snprintf(name, sizeof name, "%d", i);
        rc = ggn_container_get(&c, name, 1, &dim, array, err);
    }
    if (!rc)
        rc = restore(s, root, path, err);
    for (int net = 0; net < GGN_NETS && !rc; net++)
        ggn_weights_pack(s->trainer->weights[net], NULL);
    if (!rc)
        ggn_trainer_keep(s->trainer);
    cJSON_Delete(root);
    ggn_container_release(&c);
    return rc;
}
