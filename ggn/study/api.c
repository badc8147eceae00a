#include "study/api.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/json.h"
#include "study/plan.h"
#include "study/token.h"

enum { MAX_MS = 86400000 }; /* a day */

void ggn_study_refuse(struct ggn_study_response *r, int status, const char *why)
{
    int failed = 0;
    cJSON *o = cJSON_CreateObject();
    snprintf(r->why, sizeof r->why, "%s", why);
    base_json_text(o, "error", why, &failed);
    free(r->body);
    r->body = o && !failed ? cJSON_PrintUnformatted(o) : strdup("{}");
    cJSON_Delete(o);
    r->status = status;
    r->type = "application/json";
    r->fd = -1;
    r->size = r->body ? strlen(r->body) : 0;
    r->keep = 0;
}

/* Sends a JSON object, unless building it failed, and frees it. */
static void send_json(struct ggn_study_response *r, cJSON *o, int failed)
{
    char *text = o && !failed ? cJSON_PrintUnformatted(o) : NULL;
    cJSON_Delete(o);
    if (!text) {
        ggn_study_refuse(r, 500, "out of memory");
        return;
    }
    *r =
        (struct ggn_study_response){.status = 200, .type = "application/json", .fd = -1, .body = text, .size = strlen(text)};
}

/* A failure of the machine, not of the request. */
static void send_failure(struct ggn_study_response *r, const struct base_err *err) { ggn_study_refuse(r, 500, err->text); }

/* --- files --- */

static const char *media_type(const char *name)
{
    static const char *const types[][2] = {{".html", "text/html; charset=utf-8"},
                                           {".js", "text/javascript; charset=utf-8"},
                                           {".css", "text/css; charset=utf-8"},
                                           {".json", "application/json"},
                                           {".png", "image/png"},
                                           {".txt", "text/plain; charset=utf-8"}};
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; i < sizeof types / sizeof types[0] && dot; i++)
        if (strcmp(dot, types[i][0]) == 0)
            return types[i][1];
    return NULL;
}

/* ROOT/[FOLDER/]NAME, plain names only and no link, so that nothing outside can be named. */
static void send_file(struct ggn_study_response *r, const char *root, const char *folder, const char *name, int keep)
{
    char path[4096];
    struct stat info;
    const char *type = media_type(name);
    int n = snprintf(path, sizeof path, "%s/%s%s%s", root, folder, *folder ? "/" : "", name);
    if (!type || !ggn_study_plain_name(name) || (*folder && !ggn_study_plain_name(folder)) || n < 0 ||
        (size_t)n >= sizeof path) {
        ggn_study_refuse(r, 404, "no such file");
        return;
    }
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0 || fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        if (fd >= 0)
            close(fd);
        ggn_study_refuse(r, 404, "no such file");
        return;
    }
    *r = (struct ggn_study_response){.status = 200, .type = type, .fd = fd, .size = (size_t)info.st_size, .keep = keep};
}

static void get_file(const struct ggn_study_site *site, const char *path, struct ggn_study_response *r)
{
    char folder[4200];
    const char *slash = strchr(path, '/');
    if (strncmp(path, "stimuli/", 8) == 0 && (slash = strchr(path + 8, '/')) != NULL) {
        char root[4200];
        snprintf(root, sizeof root, "%s/stimuli", site->dir);
        snprintf(folder, sizeof folder, "%.*s", (int)(slash - path - 8), path + 8);
        send_file(r, root, folder, slash + 1, 1);
    } else if (strcmp(path, "texts.json") == 0) {
        send_file(r, site->dir, "", path, 0);
    } else if (!slash) {
        send_file(r, site->page_dir, "", *path ? path : "index.html", 0);
    } else {
        snprintf(folder, sizeof folder, "%.*s", (int)(slash - path), path);
        send_file(r, site->page_dir, folder, slash + 1, 0);
    }
}

/* --- people --- */

static void now_utc(char out[32])
{
    time_t now = time(NULL);
    struct tm tm;
    gmtime_r(&now, &tm);
    strftime(out, 32, "%Y-%m-%dT%H:%M:%SZ", &tm);
}

static int add_person(const struct ggn_study_site *site, struct ggn_study_person *p, struct base_err *err)
{
    int64_t number = 0;
    int rc = ggn_study_store_begin(site->store, err);
    if (rc)
        return rc;
    rc = ggn_study_store_next_number(site->store, &number, err);
    if (!rc && number >= GGN_STUDY_MAX_PEOPLE)
        rc = base_fail(err, BASE_EINVAL, "this study is full");
    if (!rc)
        rc = ggn_study_token(p->key, GGN_STUDY_KEY - 1, err);
    if (!rc)
        rc = ggn_study_token(p->id, GGN_STUDY_ID - 1, err);
    p->seed = ggn_study_person_seed(site->study, (uint64_t)number);
    now_utc(p->created);
    if (!rc)
        rc = ggn_study_store_add_person(site->store, p, "{}", err);
    if (!rc)
        rc = ggn_study_store_commit(site->store, err);
    if (rc)
        ggn_study_store_rollback(site->store);
    return rc;
}

static void post_person(const struct ggn_study_site *site, const cJSON *body, struct ggn_study_response *r)
{
    struct ggn_study_person person = {0};
    struct base_err err = {0};
    if (!cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(body, "consent"))) {
        ggn_study_refuse(r, 400, "consent is needed");
        return;
    }
    if (add_person(site, &person, &err)) {
        send_failure(r, &err);
        return;
    }
    int failed = 0;
    cJSON *o = cJSON_CreateObject();
    base_json_text(o, "key", person.key, &failed);
    base_json_text(o, "id", person.id, &failed);
    send_json(r, o, failed);
}

static void add_slot(cJSON *slots, const struct ggn_study *s, const struct ggn_study_slot *slot, int *failed)
{
    cJSON *o = base_json_object(slots, NULL, failed);
    base_json_number(o, "view", slot->view, failed);
    base_json_number(o, "catch", slot->catch_trial, failed);
    if (s->task == GGN_STUDY_VALIDATION)
        base_json_number(o, "condition", slot->condition, failed);
    else
        base_json_number(o, "block", slot->block, failed);
    if (s->task == GGN_STUDY_ADJUSTMENT) {
        base_json_number(o, "screen", slot->screen, failed);
        base_json_number(o, "start", slot->start, failed);
    } else {
        base_json_number(o, "side", slot->side, failed);
    }
}

static void add_trial(cJSON *trials, const struct ggn_study_trial *t, int *failed)
{
    cJSON *o = base_json_object(trials, NULL, failed);
    base_json_number(o, "slot", t->slot, failed);
    base_json_number(o, "revision", t->revision, failed);
    base_json_number(o, "level", t->level, failed);
    base_json_number(o, "answer", t->answer, failed);
    base_json_number(o, "rating", t->rating, failed);
}

static void get_person(const struct ggn_study_site *site, const struct ggn_study_person *p, struct ggn_study_response *r)
{
    struct ggn_study_plan plan = {0};
    struct ggn_study_trial *trials = NULL;
    char *profile = NULL;
    int n = 0;
    struct base_err err = {0};
    int rc = ggn_study_plan_init(&plan, site->study, p->seed, &err);
    if (!rc)
        rc = ggn_study_store_trials(site->store, p->row, &trials, &n, &err);
    if (!rc)
        rc = ggn_study_store_profile(site->store, p->row, &profile, &err);
    if (!rc) {
        int failed = 0;
        cJSON *o = cJSON_CreateObject();
        base_json_text(o, "id", p->id, &failed);
        failed |= !cJSON_AddRawToObject(o, "profile", profile);
        cJSON *list = base_json_array(o, "slots", &failed);
        for (int i = 0; i < plan.n; i++)
            add_slot(list, site->study, &plan.slots[i], &failed);
        list = base_json_array(o, "trials", &failed);
        for (int i = 0; i < n; i++)
            add_trial(list, &trials[i], &failed);
        send_json(r, o, failed);
    } else {
        send_failure(r, &err);
    }
    free(profile);
    free(trials);
    ggn_study_plan_release(&plan);
}

static void post_profile(const struct ggn_study_site *site, const struct ggn_study_person *p, const cJSON *body,
                         struct ggn_study_response *r)
{
    struct base_err err = {0};
    char *text = cJSON_PrintUnformatted(body);
    if (!text) {
        ggn_study_refuse(r, 500, "out of memory");
    } else if (strlen(text) > GGN_STUDY_PROFILE_MAX) {
        ggn_study_refuse(r, 413, "the profile is too long");
    } else if (ggn_study_store_set_profile(site->store, p->row, text, &err)) {
        send_failure(r, &err);
    } else {
        send_json(r, cJSON_CreateObject(), 0);
    }
    free(text);
}

/* --- trials --- */

/* A whole number in [lo, hi]; absent counts as 0. */
static int get_whole(const cJSON *o, const char *name, double lo, double hi, double *out)
{
    *out = 0.0;
    return cJSON_GetObjectItemCaseSensitive(o, name) ? base_json_get_whole(o, name, lo, hi, out) : lo <= 0.0 && hi >= 0.0;
}

/* NULL, or what is wrong with the body. */
static const char *read_trial(const struct ggn_study *s, const struct ggn_study_plan *plan, const cJSON *body,
                              struct ggn_study_trial *t)
{
    double slot, revision, level, answer, rating;
    const cJSON *ms = cJSON_GetObjectItemCaseSensitive(body, "ms"),
                *layout = cJSON_GetObjectItemCaseSensitive(body, "layout");
    int adjustment = s->task == GGN_STUDY_ADJUSTMENT, validation = s->task == GGN_STUDY_VALIDATION;
    if (!get_whole(body, "slot", 0, plan->n - 1, &slot) || !cJSON_HasObjectItem(body, "slot"))
        return "no such slot";
    if (!get_whole(body, "revision", 0, adjustment ? 1000 : 0, &revision))
        return "no such revision";
    if (!get_whole(body, "level", 0, 1e9, &level))
        return "no such level";
    if (!get_whole(body, "answer", s->task == GGN_STUDY_TWO_INTERVAL ? 1 : 0,
                   adjustment   ? 0
                   : validation ? 1
                                : 2,
                   &answer) ||
        (validation && !cJSON_HasObjectItem(body, "answer")))
        return "no such answer";
    if (!get_whole(body, "rating", validation ? 1 : 0, validation ? 5 : 0, &rating))
        return "no such rating";
    if (!cJSON_IsNumber(ms) || !(ms->valuedouble >= 0.0 && ms->valuedouble <= MAX_MS))
        return "no time";
    *t = (struct ggn_study_trial){.slot = (int)slot,
                                  .revision = (int)revision,
                                  .level = (uint32_t)level,
                                  .answer = (int)answer,
                                  .rating = (int)rating,
                                  .ms = ms->valuedouble};
    if (validation && (!cJSON_IsString(layout) ||
                       (strcmp(layout->valuestring, "beside") != 0 && strcmp(layout->valuestring, "flip") != 0)))
        return "no layout";
    if (validation)
        snprintf(t->layout, sizeof t->layout, "%s", layout->valuestring);
    const cJSON *times = cJSON_GetObjectItemCaseSensitive(body, "frame_ms");
    int dropped;
    if (times && (!cJSON_IsString(times) || strlen(times->valuestring) >= sizeof t->frame_ms))
        return "no times of frames";
    snprintf(t->frame_ms, sizeof t->frame_ms, "%s", times ? times->valuestring : "");
    if (!ggn_study_slot_times(s, &plan->slots[t->slot], t->frame_ms, &dropped))
        return "no times of frames";
    if (!ggn_study_slot_takes(s, &plan->slots[t->slot], t->level))
        return "no such level";
    now_utc(t->at);
    return NULL;
}

/* Whether it is this trial's turn: in the plan's order; settings in any order within the screens reached. */
static int is_turn(const struct ggn_study_site *site, const struct ggn_study_person *p, const struct ggn_study_plan *plan,
                   const struct ggn_study_trial *t, int *turn, struct base_err *err)
{
    int done = 0, revisions = 0;
    int rc = ggn_study_store_count(site->store, p->row, &done, err);
    if (!rc)
        rc = ggn_study_store_revisions(site->store, p->row, t->slot, &revisions, err);
    if (rc)
        return rc;
    *turn = t->revision < revisions; /* there already: the store compares */
    if (site->study->task != GGN_STUDY_ADJUSTMENT)
        *turn = *turn || t->slot == done;
    else /* a screen is reached when all slots of those before it are done, and they are the first in the plan */
        *turn = *turn || (t->revision == revisions &&
                          plan->slots[t->slot].screen <= plan->slots[done < plan->n ? done : plan->n - 1].screen);
    return 0;
}

static void post_trial(const struct ggn_study_site *site, const struct ggn_study_person *p, const cJSON *body,
                       struct ggn_study_response *r)
{
    struct ggn_study_plan plan = {0};
    struct ggn_study_trial trial;
    struct base_err err = {0};
    int turn = 0, done = 0, rc = ggn_study_plan_init(&plan, site->study, p->seed, &err);
    if (rc) {
        send_failure(r, &err);
        return;
    }
    const char *wrong = read_trial(site->study, &plan, body, &trial);
    if (!wrong)
        rc = is_turn(site, p, &plan, &trial, &turn, &err);
    if (!wrong && !rc && turn)
        rc = ggn_study_store_add_trial(site->store, p->row, &trial, &err);
    if (!wrong && rc >= 0 && turn)
        rc = ggn_study_store_count(site->store, p->row, &done, &err);
    if (wrong) {
        ggn_study_refuse(r, 400, wrong);
    } else if (rc == BASE_EINVAL || (!rc && !turn)) {
        ggn_study_refuse(r, 409, turn ? err.text : "it is not this trial's turn: another window may have gone on");
    } else if (rc) {
        send_failure(r, &err);
    } else {
        int failed = 0;
        cJSON *o = cJSON_CreateObject();
        base_json_number(o, "done", done, &failed);
        base_json_number(o, "of", plan.n, &failed);
        send_json(r, o, failed);
    }
    ggn_study_plan_release(&plan);
}

/* --- routes --- */

/* study.json, and what the page would otherwise make of it by rules of its own. */
static void get_study(const struct ggn_study_site *site, struct ggn_study_response *r)
{
    char *text = ggn_study_print(site->study);
    cJSON *o = text ? cJSON_Parse(text) : NULL;
    int failed = 0;
    base_json_number(o, "minutes", ggn_study_plan_minutes(site->study), &failed);
    base_json_number(o, "shown_frames", ggn_study_shown_frames(site->study), &failed);
    send_json(r, o, failed);
    free(text);
}

/* KEY of "KEY" or "KEY/REST"; *rest gets what follows the slash, "" without one. NULL: no key. */
static const char *split_key(const char *path, char key[GGN_STUDY_KEY])
{
    size_t n = strspn(path, "0123456789abcdef");
    if (n != GGN_STUDY_KEY - 1 || (path[n] != '\0' && path[n] != '/'))
        return NULL;
    memcpy(key, path, n);
    key[n] = '\0';
    return path[n] ? path + n + 1 : path + n;
}

static void answer_person(const struct ggn_study_site *site, const char *path, int post, const cJSON *body,
                          struct ggn_study_response *r)
{
    char key[GGN_STUDY_KEY];
    struct ggn_study_person person;
    struct base_err err = {0};
    const char *rest = split_key(path, key);
    int found = rest ? ggn_study_store_find(site->store, key, NULL, &person, &err) : 0;
    if (found < 0)
        send_failure(r, &err);
    else if (found == 0)
        ggn_study_refuse(r, 404, "nobody has this link");
    else if (!post && *rest == '\0')
        get_person(site, &person, r);
    else if (post && strcmp(rest, "profile") == 0)
        post_profile(site, &person, body, r);
    else if (post && strcmp(rest, "trials") == 0)
        post_trial(site, &person, body, r);
    else
        ggn_study_refuse(r, 404, "no such address");
}

/* NULL, or why a request is not let in at all. */
static const char *check_origin(const struct ggn_study_site *site, const struct ggn_study_request *q, int post)
{
    int known = !site->hosts;
    for (int i = 0; !known && q->host && site->hosts[i]; i++)
        known = strcmp(q->host, site->hosts[i]) == 0;
    if (!known) /* a name of somebody else's that points here */
        return "wrong Host";
    if (!post)
        return NULL;
    if (q->fetch_site && strcmp(q->fetch_site, "same-origin") != 0)
        return "a request from another site";
    const char *origin = q->origin ? strstr(q->origin, "://") : NULL;
    if (q->origin && (!q->host || !origin || strcmp(origin + 3, q->host) != 0))
        return "a request from another site";
    if (!q->content_type ||
        strncmp(q->content_type, "application/json", 16) != 0) /* no form of another site can send this */
        return "Content-Type must be application/json";
    return NULL;
}

static void answer_post(const struct ggn_study_site *site, const struct ggn_study_request *q, const char *path,
                        struct ggn_study_response *r)
{
    cJSON *body = cJSON_ParseWithLength(q->body ? q->body : "", q->size);
    if (!cJSON_IsObject(body))
        ggn_study_refuse(r, 400, "the body must be one JSON object");
    else if (strcmp(path, "api/people") == 0)
        post_person(site, body, r);
    else if (strncmp(path, "api/people/", 11) == 0)
        answer_person(site, path + 11, 1, body, r);
    else
        ggn_study_refuse(r, 404, "no such address");
    cJSON_Delete(body);
}

void ggn_study_answer(const struct ggn_study_site *site, const struct ggn_study_request *q, struct ggn_study_response *r)
{
    const char *path = q->path + (q->path[0] == '/');
    int post = strcmp(q->method, "POST") == 0;
    char token[GGN_STUDY_KEY];
    *r = (struct ggn_study_response){.fd = -1};
    const char *refused = check_origin(site, q, post);
    if (refused) {
        ggn_study_refuse(r, 403, refused);
        return;
    }
    if (!post && strcmp(q->method, "GET") != 0 && strcmp(q->method, "HEAD") != 0) {
        ggn_study_refuse(r, 405, "GET and POST only");
        return;
    }
    if (site->token && (!(path = split_key(path, token)) || !ggn_study_token_equal(token, site->token))) {
        ggn_study_refuse(r, 403, "wrong token");
        return;
    }
    if (post)
        answer_post(site, q, path, r);
    else if (strcmp(path, "api/study") == 0)
        get_study(site, r);
    else if (strncmp(path, "api/people/", 11) == 0)
        answer_person(site, path + 11, 0, NULL, r);
    else
        get_file(site, path, r);
}
