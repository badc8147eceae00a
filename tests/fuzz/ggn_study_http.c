/*
 * A request to a study, as it comes from the network: METHOD PATH, a line of Host, Origin, Sec-Fetch-Site and Content-Type
 * (each after a tab, empty: not sent), then the body. The first byte chooses the task. Whatever comes, there is an answer,
 * and trials that were stored before stay as they were.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "study/api.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define KEY "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"

static const char head[] =
    "{\"format\":\"lull-study\",\"version\":1,\"id\":\"00000000000000000000000000000000\",\"seed\":1,\"trials\":4,"
    "\"repeats\":2,\"catch_share\":0.25,\"show_ms\":1,\"gap_ms\":1,\"break_every\":0,\"min_catch_passed\":0.5,"
    "\"max_untouched\":0.5,\"conditions\":[\"a\",\"b\"],\"views\":[{\"name\":\"v\",\"width\":16,\"height\":8,\"blocks\":["
    "{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":8,\"y1\":8,\"levels\":[16,64,256]},"
    "{\"id\":1,\"x0\":8,\"y0\":0,\"x1\":16,\"y1\":8,\"levels\":[16,64,256]}]}],\"task\":\"";

static struct ggn_study studies[3];

static void make_studies(void)
{
    for (int i = 0; i < 3 && !studies[i].views; i++) {
        char text[2048];
        struct base_err err = {0};
        int n = snprintf(text, sizeof text, "%s%s\"}", head, ggn_study_task_names[i]);
        if (ggn_study_parse("fuzz", text, (size_t)n, &studies[i], &err))
            abort();
    }
}

/* Cuts the text at the first `end` and returns what follows; NULL: not there. */
static char *cut(char *text, char end)
{
    char *at = strchr(text, end);
    if (!at)
        return NULL;
    *at = '\0';
    return at + 1;
}

/* 1: the answer may have changed the store. */
static int ask(const struct ggn_study *study, struct ggn_study_store *store, struct ggn_study_request *q)
{
    static const char *const hosts[] = {"h", NULL};
    struct ggn_study_site site = {
        .dir = "/nonexistent", .page_dir = "/nonexistent", .hosts = hosts, .study = study, .store = store};
    struct ggn_study_response r;
    ggn_study_answer(&site, q, &r);
    if (r.status < 200 || r.status > 599 || (r.fd < 0 && (!r.body || strlen(r.body) != r.size)) || !r.type)
        abort();
    if ((r.status != 200) != (r.why[0] != '\0'))
        abort();
    if (r.fd >= 0)
        close(r.fd);
    free(r.body);
    return r.status == 200 && strcmp(q->method, "GET") != 0;
}

/* A store in memory for a study of this task, with a person and a trial; making one costs far more than most requests, so it
 * is kept until a request may have changed it. */
static struct ggn_study_store *stores[3];

static struct ggn_study_store *store_of(int task)
{
    struct base_err err = {0};
    const struct ggn_study_person person = {.id = "00000000", .key = KEY, .seed = 5, .created = "now"};
    const struct ggn_study_trial trial = {.slot = 0, .level = 16, .answer = 1, .ms = 3};
    if (!stores[task] && (ggn_study_store_open(NULL, studies[task].id, 1, &stores[task], &err) ||
                          ggn_study_store_add_person(stores[task], &person, "{}", &err) ||
                          ggn_study_store_add_trial(stores[task], 1, &trial, &err) != 1))
        abort();
    return stores[task];
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct base_err err = {0};
    struct ggn_study_trial *trials = NULL;
    int n = 0;
    if (size < 1 || size > GGN_STUDY_BODY_MAX)
        return 0;
    make_studies();
    char *text = malloc(size);
    if (!text)
        return 0;
    memcpy(text, data + 1, size - 1);
    text[size - 1] = '\0';
    const int task = data[0] % 3;
    struct ggn_study_store *store = store_of(task);
    int changed = 0;
    char *path = cut(text, ' '), *headers = path ? cut(path, '\n') : NULL, *body = headers ? cut(headers, '\n') : NULL;
    if (body) {
        const char *fields[4] = {NULL};
        for (int i = 0; i < 4 && headers; i++) {
            char *next = cut(headers, '\t');
            fields[i] = *headers ? headers : NULL;
            headers = next;
        }
        struct ggn_study_request q = {.method = text,
                                      .path = path,
                                      .host = fields[0],
                                      .origin = fields[1],
                                      .fetch_site = fields[2],
                                      .content_type = fields[3],
                                      .body = body,
                                      .size = size - 1 - (size_t)(body - text)};
        changed = ask(&studies[task], store, &q);
        if (ggn_study_store_trials(store, 1, &trials, &n, &err) || n < 1 || trials[0].level != 16 || trials[0].answer != 1)
            abort();
    }
    free(trials);
    if (changed) {
        ggn_study_store_close(store);
        stores[task] = NULL;
    }
    free(text);
    return 0;
}
