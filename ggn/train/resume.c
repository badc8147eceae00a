#include "train/phase.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "base/json.h"

/* The plan's options and the data: a checkpoint of another run is refused. */
static int identify(const struct ggn_session *s, struct base_identity *to, struct base_err *err)
{
    base_identity_append(to, &s->plan->identity);
    base_identity_add(to, "crop", "%d", s->crop);
    base_identity_add(to, "size", "%dx%d", s->set.width, s->set.height);
    base_identity_add(to, "data-crc", "%08x", s->data_crc);
    return base_identity_check(to, err);
}

/* What the phase changes, as arrays in a fixed order; NULL past the end. */
static float *state_array(struct ggn_session *s, int i, size_t *count)
{
    static const int best[] = {GGN_NET_M, GGN_NET_D, GGN_NET_R}; /* the denoiser of preset paper only */
    const int paper = s->hyper.preset == GGN_PRESET_PAPER;
    const struct ggn_weights *r = s->model->weights[GGN_NET_R];
    if (s->progress.phase == GGN_PHASE_DENOISER || (i < 5 && paper))
        return ggn_trainer_state(s->trainer, GGN_NET_R, i, count);
    if (i < 3) {
        *count = i == 0 ? r->graph->n_params : r->graph->n_stats;
        return i == 0 ? r->params : i == 1 ? r->mean : r->var;
    }
    i -= paper ? 5 : 3;
    if (i < 10)
        return ggn_trainer_state(s->trainer, i < 5 ? GGN_NET_M : GGN_NET_D, i % 5, count);
    i -= 10;
    if (i >= 2 + paper)
        return NULL;
    *count = s->model->graph[best[i]].n_learned;
    return s->model->weights[best[i]]->params;
}

/* Adds all arrays to a container, or reads them from one. */
static int visit_arrays(struct ggn_session *s, struct ggn_container *c, int read, struct base_err *err)
{
    size_t count;
    float *array;
    int rc = 0;
    for (int i = 0; !rc && (array = state_array(s, i, &count)); i++) {
        char name[16];
        int dim = (int)count;
        snprintf(name, sizeof name, "%d", i);
        rc = read ? ggn_container_get(c, name, 1, &dim, array, err)
                  : ggn_container_add(c, name, GGN_F32, 1, &dim, array, err);
    }
    return rc;
}

static char *describe(struct ggn_session *s, const struct base_identity *identity)
{
    const struct ggn_progress *p = &s->progress;
    cJSON *root = cJSON_CreateObject();
    int failed = 0;
    cJSON *rows = base_json_array(root, "log", &failed);
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"phase", p->phase},
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
    base_json_text(root, "identity", identity->text, &failed);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        base_json_number(root, numbers[i].name, numbers[i].value, &failed);
    for (int i = 0; i < s->log.n; i++) {
        cJSON *row = base_json_array(rows, NULL, &failed);
        base_json_number(row, NULL, s->log.rows[i].phase, &failed);
        for (int k = 0; k < GGN_LOG_NUMBERS; k++)
            base_json_number(row, NULL, s->log.rows[i].numbers[k], &failed);
    }
    char *text = failed ? NULL : cJSON_PrintUnformatted(root);
    cJSON_Delete(root);
    return text;
}

static double number(const cJSON *item) { return cJSON_IsNumber(item) ? item->valuedouble : (double)NAN; }

static double field(const cJSON *root, const char *name) { return number(cJSON_GetObjectItemCaseSensitive(root, name)); }

static int restore(struct ggn_session *s, const cJSON *root, struct base_err *err)
{
    struct ggn_progress *p = &s->progress;
    const cJSON *row;
    double step = field(root, "step"), steps = field(root, "steps");
    if (!(step >= 0) || !(steps >= 0) || !(field(root, "t0") >= 0) || !(field(root, "t1") >= 0) || !(field(root, "t2") >= 0))
        return base_fail(err, BASE_EINVAL, "%s: progress is missing", s->checkpoint_path);
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
        for (int k = 0; k < GGN_LOG_NUMBERS; k++)
            r.numbers[k] = number(cJSON_GetArrayItem(row, k + 1));
        int rc = ggn_log_add(&s->log, &r, err);
        if (rc)
            return rc;
    }
    return 0;
}

int ggn_resume_save(struct ggn_session *s, struct base_err *err)
{
    struct ggn_container c = {0};
    struct base_identity identity = {0};
    int rc = identify(s, &identity, err);
    if (!rc && !(c.json = describe(s, &identity)))
        rc = base_fail_nomem(err, "checkpoint");
    if (!rc)
        rc = visit_arrays(s, &c, 0, err);
    if (!rc)
        rc = ggn_container_write(&c, s->checkpoint_path, err);
    base_identity_release(&identity);
    ggn_container_release(&c);
    return rc;
}

int ggn_resume_open(struct ggn_session *s, struct base_err *err)
{
    struct stat st;
    if (!s->plan->resume || stat(s->checkpoint_path, &st) != 0)
        return 0;
    int rc = ggn_container_read(&s->checkpoint, s->checkpoint_path, err);
    if (rc)
        return rc;
    cJSON *root = cJSON_Parse(s->checkpoint.json);
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(root, "kind");
    const double phase = field(root, "phase");
    if (!cJSON_IsString(kind) || strcmp(kind->valuestring, "training") != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: not a checkpoint of a training", s->checkpoint_path);
    else if (phase != GGN_PHASE_DENOISER && phase != GGN_PHASE_CLASSIFIER)
        rc = base_fail(err, BASE_EINVAL, "%s: of an unknown phase", s->checkpoint_path);
    else
        s->progress.phase = (int)phase;
    cJSON_Delete(root);
    return rc;
}

static int compare(const struct ggn_session *s, const cJSON *root, struct base_err *err)
{
    static const struct base_identity_words words = {": made with", ": made without", "this run"};
    const cJSON *saved = cJSON_GetObjectItemCaseSensitive(root, "identity");
    struct base_identity identity = {0};
    if (!cJSON_IsString(saved))
        return base_fail(err, BASE_EINVAL, "%s: made by an earlier version of Lull: train anew, without --resume",
                         s->checkpoint_path);
    int rc = identify(s, &identity, err);
    if (!rc)
        rc = base_identity_compare(&identity, saved->valuestring, strlen(saved->valuestring), s->checkpoint_path, &words,
                                   NULL, err);
    base_identity_release(&identity);
    return rc;
}

int ggn_resume_load(struct ggn_session *s, struct base_err *err)
{
    if (!s->checkpoint.data)
        return 0;
    cJSON *root = cJSON_Parse(s->checkpoint.json);
    int rc = compare(s, root, err);
    if (!rc)
        rc = visit_arrays(s, &s->checkpoint, 1, err);
    if (!rc)
        rc = restore(s, root, err);
    cJSON_Delete(root);
    ggn_container_release(&s->checkpoint);
    return rc;
}
