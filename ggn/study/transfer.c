#include "study/transfer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/json.h"
#include "study/plan.h"
#include "study/token.h"

enum { MAX_TEXT = 1 << 29 };

/* --- out --- */

/* What a reader of the file wants to know of a trial without making the plan again; the import does not look at it. */
static void add_meaning(cJSON *o, const struct ggn_study *s, const struct ggn_study_slot *slot,
                        const struct ggn_study_trial *t, int *failed)
{
    const struct ggn_study_view *view = &s->views[slot->view];
    base_json_text(o, "view", view->name, failed);
    base_json_number(o, "catch", slot->catch_trial, failed);
    if (s->task == GGN_STUDY_VALIDATION) {
        base_json_text(o, "condition", slot->condition >= 0 ? s->conditions[slot->condition] : NULL, failed);
        base_json_text(o, "judged_is", slot->side == 0 ? "A" : "B", failed);
        return;
    }
    base_json_number(o, "block", view->blocks[slot->block].id, failed);
    if (s->task == GGN_STUDY_TWO_INTERVAL) {
        base_json_number(o, "noise_in", slot->side + 1, failed);
        base_json_bool(o, "correct", t->answer == slot->side + 1, failed);
    } else {
        base_json_number(o, "started_at", view->blocks[slot->block].levels[slot->start], failed);
    }
}

static void add_trials(cJSON *list, const struct ggn_study *s, const struct ggn_study_plan *plan,
                       const struct ggn_study_trial *trials, int n, int *failed)
{
    for (int i = 0; i < n; i++) {
        const struct ggn_study_trial *t = &trials[i];
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_number(o, "slot", t->slot, failed);
        base_json_number(o, "revision", t->revision, failed);
        base_json_number(o, "level", t->level, failed);
        base_json_number(o, "answer", t->answer, failed);
        base_json_number(o, "rating", t->rating, failed);
        base_json_number(o, "ms", t->ms, failed);
        base_json_text(o, "layout", t->layout, failed);
        if (*t->frame_ms)
            base_json_text(o, "frame_ms", t->frame_ms, failed);
        base_json_text(o, "at", t->at, failed);
        if (t->slot < plan->n)
            add_meaning(o, s, &plan->slots[t->slot], t, failed);
    }
}

static int add_person(cJSON *list, const struct ggn_study *s, struct ggn_study_store *store,
                      const struct ggn_study_person *p, int *failed, struct base_err *err)
{
    struct ggn_study_plan plan = {0};
    struct ggn_study_trial *trials = NULL;
    char *profile = NULL;
    int n = 0, rc = ggn_study_plan_init(&plan, s, p->seed, err);
    if (!rc)
        rc = ggn_study_store_trials(store, p->row, &trials, &n, err);
    if (!rc)
        rc = ggn_study_store_profile(store, p->row, &profile, err);
    if (!rc) {
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_text(o, "id", p->id, failed);
        base_json_number(o, "seed", (double)p->seed, failed);
        base_json_text(o, "created", p->created, failed);
        cJSON *parsed = cJSON_Parse(profile);
        *failed |= !parsed || !o || !cJSON_AddItemToObject(o, "profile", parsed);
        add_trials(base_json_array(o, "trials", failed), s, &plan, trials, n, failed);
    }
    free(profile);
    free(trials);
    ggn_study_plan_release(&plan);
    return rc;
}

int ggn_study_export(const struct ggn_study *study, struct ggn_study_store *store, const char *path, int *people,
                     struct base_err *err)
{
    struct ggn_study_person *list = NULL;
    int n = 0, failed = 0, rc = ggn_study_store_people(store, &list, &n, err);
    if (rc)
        return rc;
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "format", "lull-study-trials", &failed);
    base_json_number(root, "version", 1, &failed);
    base_json_text(root, "study", study->id, &failed);
    base_json_text(root, "task", ggn_study_task_names[study->task], &failed);
    cJSON *array = base_json_array(root, "people", &failed);
    for (int i = 0; i < n && !rc; i++)
        rc = add_person(array, study, store, &list[i], &failed, err);
    if (!rc)
        rc = base_json_write(path, root, failed || !root, err);
    cJSON_Delete(root);
    free(list);
    *people = n;
    return rc;
}

/* --- in --- */

struct reader {
    const char *path;
    const struct ggn_study *study;
    struct ggn_study_store *store;
    struct base_err *err;
};

static int get_text(const cJSON *o, const char *name, char *out, size_t room)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    if (!cJSON_IsString(v) || strlen(v->valuestring) >= room)
        return 0;
    strcpy(out, v->valuestring);
    return 1;
}

static int read_trial(const struct reader *r, const cJSON *o, const struct ggn_study_plan *plan, struct ggn_study_trial *t)
{
    double slot, revision, level, answer, rating, ms;
    int dropped;
    *t = (struct ggn_study_trial){0};
    if (!base_json_get_whole(o, "slot", 0, plan->n - 1, &slot) || !base_json_get_whole(o, "revision", 0, 1000, &revision) ||
        !base_json_get_whole(o, "level", 0, 1e9, &level) || !base_json_get_whole(o, "answer", 0, 2, &answer) ||
        !base_json_get_whole(o, "rating", 0, 5, &rating) || !base_json_get(o, "ms", 0, 86400000, &ms) ||
        !get_text(o, "layout", t->layout, sizeof t->layout) || !get_text(o, "at", t->at, sizeof t->at) ||
        (cJSON_HasObjectItem(o, "frame_ms") && !get_text(o, "frame_ms", t->frame_ms, sizeof t->frame_ms)))
        return 0;
    t->slot = (int)slot;
    t->revision = (int)revision;
    t->level = (uint32_t)level;
    t->answer = (int)answer;
    t->rating = (int)rating;
    t->ms = ms;
    return ggn_study_slot_takes(r->study, &plan->slots[t->slot], t->level) &&
           ggn_study_slot_times(r->study, &plan->slots[t->slot], t->frame_ms, &dropped);
}

static int import_trials(const struct reader *r, const cJSON *list, const struct ggn_study_person *p)
{
    struct ggn_study_plan plan = {0};
    struct ggn_study_trial trial;
    const cJSON *o;
    int rc = ggn_study_plan_init(&plan, r->study, p->seed, r->err);
    cJSON_ArrayForEach (o, list) {
        if (!rc && !read_trial(r, o, &plan, &trial))
            rc = base_fail(r->err, BASE_EINVAL, "%s: person %s has a trial that this study cannot have", r->path, p->id);
        if (!rc) {
            int added = ggn_study_store_add_trial(r->store, p->row, &trial, r->err);
            rc = added < 0 ? added : 0;
        }
    }
    ggn_study_plan_release(&plan);
    return rc;
}

static int import_person(const struct reader *r, const cJSON *o)
{
    struct ggn_study_person p = {0}, there;
    const cJSON *profile = cJSON_GetObjectItemCaseSensitive(o, "profile"),
                *trials = cJSON_GetObjectItemCaseSensitive(o, "trials");
    double seed = 0.0;
    if (!get_text(o, "id", p.id, sizeof p.id) || strspn(p.id, "0123456789abcdef") != GGN_STUDY_ID - 1 ||
        !base_json_get_whole(o, "seed", 0, 9007199254740991.0, &seed) ||
        !get_text(o, "created", p.created, sizeof p.created) || !cJSON_IsObject(profile) || !cJSON_IsArray(trials))
        return base_fail(r->err, BASE_EINVAL, "%s: a person without a proper id, seed, created, profile or trials", r->path);
    p.seed = (uint64_t)seed;
    int rc = ggn_study_store_find(r->store, NULL, p.id, &there, r->err);
    if (rc)
        return rc < 0 ? rc
                      : base_fail(r->err, BASE_EINVAL, "%s: person %s is in the study already; nothing was imported",
                                  r->path, p.id);
    rc = ggn_study_token(p.key, GGN_STUDY_KEY - 1, r->err);
    char *text = cJSON_PrintUnformatted(profile);
    if (!rc && !text)
        rc = base_fail_nomem(r->err, r->path);
    if (!rc)
        rc = ggn_study_store_add_person(r->store, &p, text, r->err);
    free(text);
    if (!rc)
        rc = ggn_study_store_find(r->store, NULL, p.id, &p, r->err);
    return rc < 0 ? rc : import_trials(r, trials, &p);
}

int ggn_study_import(const struct ggn_study *study, struct ggn_study_store *store, const char *path, int *people,
                     struct base_err *err)
{
    struct reader r = {path, study, store, err};
    char *text = NULL;
    size_t size;
    int n = 0, rc = base_file_read(path, MAX_TEXT, &text, &size, err);
    if (rc)
        return rc;
    cJSON *root = cJSON_ParseWithLength(text, size);
    const cJSON *format = cJSON_GetObjectItemCaseSensitive(root, "format"),
                *id = cJSON_GetObjectItemCaseSensitive(root, "study");
    const cJSON *list = cJSON_GetObjectItemCaseSensitive(root, "people"), *o;
    free(text);
    if (!cJSON_IsString(format) || strcmp(format->valuestring, "lull-study-trials") != 0 || !cJSON_IsArray(list))
        rc = base_fail(err, BASE_EINVAL, "%s: not a file of `lull-study export`", path);
    else if (!cJSON_IsString(id) || strcmp(id->valuestring, study->id) != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: trials of another study", path);
    else
        rc = ggn_study_store_begin(store, err);
    if (rc) {
        cJSON_Delete(root);
        return rc;
    }
    cJSON_ArrayForEach (o, list) {
        if (!rc)
            rc = import_person(&r, o);
        n++;
    }
    if (!rc)
        rc = ggn_study_store_commit(store, err);
    if (rc)
        ggn_study_store_rollback(store);
    cJSON_Delete(root);
    *people = n;
    return rc;
}
