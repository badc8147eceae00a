#include "base/team.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

/* A message is its kind, the number of the call that it belongs to, and bytes. */
enum kind {
    PART, /* to rank 0: my share */
    ALL,  /* from rank 0: the whole */
    BYE,  /* to rank 0, the last one: how I ended */
    END   /* from rank 0, the last one */
};

struct letter {
    uint32_t kind, call;
    unsigned char bytes[];
};

struct farewell {
    int status;
    char text[600];
};

struct base_team {
    struct base_peers *peers; /* owns */
    double timeout_s;         /* 0: no limit */
    const volatile sig_atomic_t *interrupted;
    uint32_t call;
    int lost;                     /* somebody is gone for good: there is no orderly end */
    int over;                     /* of a member: rank 0 has said the end */
    struct farewell *ended;       /* owns; [count] at rank 0: what was heard */
    unsigned char *gone;          /* owns; [count] at rank 0: who has said BYE */
    struct base_team_part *parts; /* owns, with their data; [count] of the last call of collect */
    struct base_team_traffic traffic;
    struct base_err failed;
};

static const double LOOK_S = 0.05; /* between two looks whether everybody is still there */

static void forget_parts(struct base_team *t)
{
    for (int r = 0; r < t->peers->count; r++) {
        free(t->parts[r].data);
        t->parts[r] = (struct base_team_part){0};
    }
}

static void release(struct base_team *t)
{
    if (!t)
        return;
    free(t->ended);
    free(t->gone);
    free(t->parts);
    free(t);
}

int base_team_create(struct base_peers *peers, struct base_team **out, struct base_err *err)
{
    struct base_team *t = calloc(1, sizeof *t);
    size_t n = (size_t)peers->count;
    if (t) {
        t->ended = calloc(n, sizeof *t->ended);
        t->gone = calloc(n, 1);
        t->parts = calloc(n, sizeof *t->parts);
    }
    if (!t || !t->ended || !t->gone || !t->parts) {
        release(t);
        base_peers_abort(peers, 1); /* nobody could be told otherwise */
        return base_fail_nomem(err, "a team of processes");
    }
    t->peers = peers;
    *out = t;
    return 0;
}

int base_team_open(struct base_team **out, struct base_err *err)
{
    struct base_peers *peers;
    *out = NULL;
    int rc = base_peers_open(&peers, err);
    return rc || !peers ? rc : base_team_create(peers, out, err);
}

void base_team_watch(struct base_team *t, double timeout_s, const volatile sig_atomic_t *interrupted)
{
    if (!t)
        return;
    t->timeout_s = timeout_s;
    t->interrupted = interrupted;
}

int base_team_rank(const struct base_team *t) { return t ? t->peers->rank : 0; }

int base_team_count(const struct base_team *t) { return t ? t->peers->count : 1; }

int base_team_threads(const struct base_team *t) { return base_peers_threads(t ? t->peers : NULL); }

struct base_team_traffic base_team_traffic(const struct base_team *t)
{
    return t ? t->traffic : (struct base_team_traffic){0};
}

long base_team_first(const struct base_team *t, long n, int rank) { return n * rank / base_team_count(t); }

long base_team_most(const struct base_team *t, long n) { return (n + base_team_count(t) - 1) / base_team_count(t); }

int base_team_failed(const struct base_team *t, struct base_err *err)
{
    return t && t->failed.code ? base_fail(err, t->failed.code, "%s", t->failed.text) : 0;
}

/* --- letters -------------------------------------------------------------------------------------------------------- */

static int post(struct base_team *t, int rank, enum kind kind, const void *bytes, size_t size)
{
    struct letter *l = malloc(sizeof *l + size);
    if (!l)
        return base_fail_nomem(&t->failed, "messages");
    *l = (struct letter){(uint32_t)kind, t->call};
    if (size > 0)
        memcpy(l->bytes, bytes, size);
    t->traffic.messages++;
    t->traffic.bytes += sizeof *l + size;
    return base_peers_send(t->peers, rank, l, sizeof *l + size, &t->failed);
}

int base_team_refuse(struct base_team *t, int rank)
{
    return base_fail(&t->failed, BASE_EIO, "%s said something that makes no sense", t->peers->list[rank].name);
}

/* Somebody's last message. */
static int hear_end(struct base_team *t, int rank, const struct letter *l, size_t size)
{
    if (size != sizeof *l + sizeof(struct farewell))
        return base_team_refuse(t, rank);
    memcpy(&t->ended[rank], l->bytes, sizeof t->ended[rank]);
    t->gone[rank] = 1;
    return 0;
}

int base_team_look(struct base_team *t)
{
    if (!t || t->peers->rank > 0)
        return 0;
    int rc = base_peers_mourn(t->peers, &t->failed);
    t->lost |= rc != 0;
    return rc;
}

/* The next letter, waited for as long as the team's patience lasts; *rank: in, who is waited for at least. */
static int take(struct base_team *t, int *rank, struct letter **out, size_t *size)
{
    double start_s = base_clock_wall_s(), waited_s = 0;
    int awaited = *rank, got = 0, rc = 0;
    while (!got && !rc) {
        void *data = NULL;
        got = base_peers_receive(t->peers, LOOK_S, rank, &data, size, &t->failed);
        waited_s = base_clock_wall_s() - start_s;
        *out = data;
        if (got < 0)
            rc = got;
        else if (!got && t->peers->rank == 0 && t->interrupted && *t->interrupted)
            rc = base_team_look(t);
        if (!got && !rc && t->peers->rank == 0 && t->timeout_s > 0 && waited_s > t->timeout_s) {
            t->lost = 1;
            rc = base_peers_give_up(t->peers, awaited, t->timeout_s, &t->failed);
        }
    }
    t->traffic.waiting_s += waited_s;
    if (rc)
        return rc;
    t->traffic.messages++;
    t->traffic.bytes += *size;
    if (*size >= sizeof **out)
        return 0;
    free(*out);
    return base_team_refuse(t, *rank);
}

/* --- calls ---------------------------------------------------------------------------------------------------------- */

static int ended_too_early(struct base_team *t, int rank)
{
    const struct farewell *f = &t->ended[rank];
    return base_fail(&t->failed, f->status == 1 ? BASE_ENOMEM : BASE_EINVAL, "%s: %s", t->peers->list[rank].name,
                     f->text[0] ? f->text : "ended too early");
}

/* Rank 0: one part from everybody. Who has given it may say goodbye while the others' are on their way. */
static int take_parts(struct base_team *t)
{
    for (int r = 1; r < t->peers->count; r++)
        if (t->gone[r])
            return ended_too_early(t, r);
    for (int left = t->peers->count - 1; left > 0;) {
        int rank = 1;
        struct letter *l;
        size_t size;
        while (t->parts[rank].data)
            rank++;
        if (take(t, &rank, &l, &size))
            return t->failed.code;
        if (l->kind == PART && l->call == t->call && !t->parts[rank].data) {
            t->parts[rank].size = size - sizeof *l;
            memmove(l, l->bytes, size - sizeof *l);
            t->parts[rank].data = l;
            left--;
            continue;
        }
        if (l->kind != BYE)
            base_team_refuse(t, rank);
        else if (hear_end(t, rank, l, size) == 0 && !t->parts[rank].data)
            ended_too_early(t, rank);
        free(l);
        if (t->failed.code)
            return t->failed.code;
    }
    return 0;
}

const struct base_team_part *base_team_collect(struct base_team *t, const void *mine, size_t size)
{
    if (!t || t->failed.code)
        return NULL;
    t->call++;
    forget_parts(t);
    if (t->peers->rank == 0)
        return take_parts(t) ? NULL : t->parts;
    post(t, 0, PART, mine, size);
    return NULL;
}

int base_team_tell(struct base_team *t, void *data, size_t size)
{
    if (!t || t->failed.code)
        return t ? t->failed.code : 0;
    t->call++;
    for (int r = 1; t->peers->rank == 0 && r < t->peers->count; r++)
        if (post(t, r, ALL, data, size))
            return t->failed.code;
    if (t->peers->rank == 0)
        return 0;
    struct letter *l;
    size_t got;
    int rank = 0;
    if (take(t, &rank, &l, &got))
        return t->failed.code;
    if (l->kind == END) {
        t->over = 1;
        base_fail(&t->failed, BASE_EIO, "rank 0 has ended"); /* nobody reads it: rank 0 says why */
    } else if (l->kind != ALL || l->call != t->call || got != sizeof *l + size) {
        base_team_refuse(t, 0);
    } else if (size > 0) {
        memcpy(data, l->bytes, size);
    }
    free(l);
    return t->failed.code;
}

int base_team_gather(struct base_team *t, void *all, const size_t *start)
{
    if (!t || t->failed.code)
        return t ? t->failed.code : 0;
    const int rank = t->peers->rank;
    unsigned char *bytes = all;
    const struct base_team_part *parts = base_team_collect(t, bytes + start[rank], start[rank + 1] - start[rank]);
    for (int r = 1; parts && r < t->peers->count; r++) {
        if (parts[r].size != start[r + 1] - start[r])
            return base_team_refuse(t, r);
        if (parts[r].size > 0)
            memcpy(bytes + start[r], parts[r].data, parts[r].size);
    }
    return base_team_tell(t, all, start[t->peers->count]);
}

int base_team_gather_items(struct base_team *t, void *items, size_t size, long n)
{
    if (!t || t->failed.code)
        return t ? t->failed.code : 0;
    size_t *start = malloc(((size_t)t->peers->count + 1) * sizeof *start);
    if (!start)
        return base_fail_nomem(&t->failed, "messages");
    for (int r = 0; r <= t->peers->count; r++)
        start[r] = size * (size_t)base_team_first(t, n, r);
    int rc = base_team_gather(t, items, start);
    free(start);
    return rc;
}

int base_team_agree(struct base_team *t, const char *text, struct base_err *err)
{
    char answer = 0;
    if (!t)
        return 0;
    const struct base_team_part *parts = base_team_collect(t, text, strlen(text) + 1);
    for (int r = 1; parts && r < t->peers->count && !t->failed.code; r++) {
        const char *theirs = parts[r].data;
        if (parts[r].size == 0 || theirs[parts[r].size - 1] != '\0')
            base_team_refuse(t, r);
        else if (strcmp(theirs, text) != 0)
            base_peers_differ(t->peers, r, theirs, text, &t->failed);
    }
    base_team_tell(t, &answer, 1);
    return base_team_failed(t, err);
}

/* --- the end ---------------------------------------------------------------------------------------------------------- */

static void say_goodbye(struct base_team *t, int status, const char *text)
{
    struct farewell f = {.status = status};
    snprintf(f.text, sizeof f.text, "%s", text ? text : "");
    t->failed.code = 0;
    if (post(t, 0, BYE, &f, sizeof f))
        return;
    while (!t->over) {
        struct letter *l;
        size_t size;
        int rank = 0;
        if (take(t, &rank, &l, &size))
            return;
        t->over = l->kind == END;
        free(l);
    }
}

/* Rank 0 has no more to say; the others end when they are done. */
static int hear_all(struct base_team *t, int status, struct base_err *err)
{
    const int count = t->peers->count;
    t->failed = (struct base_err){0};
    for (int r = 1; r < count; r++)
        if (post(t, r, END, "", 0)) {
            base_fail(err, t->failed.code, "%s", t->failed.text);
            return status ? status : 2;
        }
    for (int r = 1; r < count; r++)
        while (!t->gone[r]) {
            struct letter *l;
            size_t size;
            int rank = r;
            if (take(t, &rank, &l, &size)) {
                base_fail(err, t->failed.code, "%s", t->failed.text);
                return status ? status : 2;
            }
            if (l->kind == BYE) /* else something that was on its way when rank 0 failed */
                hear_end(t, rank, l, size);
            free(l);
        }
    for (int r = 1; r < count && status == 0; r++) {
        status = t->ended[r].status;
        if (status)
            base_fail(err, BASE_EINVAL, "%s", t->ended[r].text[0] ? t->ended[r].text : "interrupted");
    }
    return status;
}

int base_team_close(struct base_team *t, int status, const char *text, struct base_err *err)
{
    if (!t)
        return status;
    if (t->peers->rank > 0)
        say_goodbye(t, status, text);
    else if (!t->lost)
        status = hear_all(t, status, err);
    if (t->lost)
        base_peers_abort(t->peers, status);
    status = t->peers->rank > 0 ? 0 : status;
    forget_parts(t);
    base_peers_close(t->peers);
    release(t);
    return status;
}
