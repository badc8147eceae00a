#include "study/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <sqlite3.h>

#include "base/files.h"
#include "study/syncer.h"

struct ggn_study_store {
    sqlite3 *db;
    struct ggn_study_syncer *syncer; /* NULL: every commit waits for the disk */
    char path[4096];
};

enum { BUSY_MS = 5000 };

static const char schema[] =
    "CREATE TABLE IF NOT EXISTS study (id TEXT PRIMARY KEY, version INTEGER NOT NULL);"
    "CREATE TABLE IF NOT EXISTS person (row INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, key TEXT NOT NULL "
    "UNIQUE,"
    " seed INTEGER NOT NULL, created TEXT NOT NULL, profile TEXT NOT NULL);"
    "CREATE TABLE IF NOT EXISTS trial (person INTEGER NOT NULL REFERENCES person(row) ON DELETE CASCADE, slot INTEGER NOT "
    "NULL,"
    " revision INTEGER NOT NULL, level INTEGER NOT NULL, answer INTEGER NOT NULL, rating INTEGER NOT NULL, ms REAL NOT NULL,"
    " layout TEXT NOT NULL, at TEXT NOT NULL, frame_ms TEXT NOT NULL DEFAULT '', PRIMARY KEY (person, slot, revision)) "
    "WITHOUT ROWID;";

static int fail_sql(struct ggn_study_store *s, struct base_err *err)
{
    int code = sqlite3_errcode(s->db);
    if (code == SQLITE_NOMEM)
        return base_fail_nomem(err, s->path);
    return base_fail(err, BASE_EIO, "%s: %s", s->path, sqlite3_errmsg(s->db));
}

static int run(struct ggn_study_store *s, const char *sql, struct base_err *err)
{
    return sqlite3_exec(s->db, sql, NULL, NULL, NULL) == SQLITE_OK ? 0 : fail_sql(s, err);
}

static int prepare(struct ggn_study_store *s, const char *sql, sqlite3_stmt **statement, struct base_err *err)
{
    return sqlite3_prepare_v2(s->db, sql, -1, statement, NULL) == SQLITE_OK ? 0 : fail_sql(s, err);
}

static void bind_text(sqlite3_stmt *st, int i, const char *text) { sqlite3_bind_text(st, i, text, -1, SQLITE_STATIC); }

static void copy_text(sqlite3_stmt *st, int column, char *out, size_t room)
{
    const unsigned char *text = sqlite3_column_text(st, column);
    snprintf(out, room, "%s", text ? (const char *)text : "");
}

/* Runs a statement that gives at most one row. 1 a row is there, 0 none, negative on an error. */
static int step(struct ggn_study_store *s, sqlite3_stmt *st, struct base_err *err)
{
    int code = sqlite3_step(st);
    return code == SQLITE_ROW ? 1 : code == SQLITE_DONE ? 0 : fail_sql(s, err);
}

/* One number out of one row; 0 without a row. The statement's first variable is `row`, its second `slot`. */
static int query_number(struct ggn_study_store *s, const char *sql, int64_t row, int slot, int64_t *out,
                        struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, sql, &st, err);
    if (rc)
        return rc;
    if (sqlite3_bind_parameter_count(st) > 0)
        sqlite3_bind_int64(st, 1, row);
    if (sqlite3_bind_parameter_count(st) > 1)
        sqlite3_bind_int(st, 2, slot);
    rc = step(s, st, err);
    *out = rc == 1 ? sqlite3_column_int64(st, 0) : 0;
    sqlite3_finalize(st);
    return rc < 0 ? rc : 0;
}

/* Files from before there were clips. */
static int add_times(struct ggn_study_store *s, struct base_err *err)
{
    int64_t there = 0;
    int rc = query_number(s, "SELECT COUNT(*) FROM pragma_table_info('trial') WHERE name = 'frame_ms'", 0, 0, &there, err);
    return !rc && !there ? run(s, "ALTER TABLE trial ADD COLUMN frame_ms TEXT NOT NULL DEFAULT ''", err) : rc;
}

/* The file belongs to one study for ever. */
static int claim(struct ggn_study_store *s, const char *study_id, struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, "INSERT INTO study SELECT ?1, 1 WHERE NOT EXISTS (SELECT 1 FROM study)", &st, err);
    if (rc)
        return rc;
    bind_text(st, 1, study_id);
    rc = step(s, st, err);
    sqlite3_finalize(st);
    if (rc < 0 || (rc = prepare(s, "SELECT id FROM study", &st, err)) != 0)
        return rc;
    rc = step(s, st, err);
    const unsigned char *id = rc == 1 ? sqlite3_column_text(st, 0) : NULL;
    if (rc >= 0)
        rc = id && strcmp((const char *)id, study_id) == 0
                 ? 0
                 : base_fail(err, BASE_EINVAL, "%s: belongs to another study than study.json beside it", s->path);
    sqlite3_finalize(st);
    return rc;
}

int ggn_study_store_open(const char *dir, const char *study_id, int create, struct ggn_study_store **store,
                         struct base_err *err)
{
    struct ggn_study_store *s = calloc(1, sizeof *s);
    if (!s)
        return base_fail_nomem(err, "study.db");
    snprintf(s->path, sizeof s->path, ":memory:");
    int rc = dir ? base_file_join(s->path, dir, "study.db", err) : 0;
    if (rc) {
        free(s);
        return rc;
    }
    int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | (create ? SQLITE_OPEN_CREATE : 0);
    if (dir && !create && access(s->path, F_OK) != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: nobody has taken part yet: `lull-study serve %s` first", s->path, dir);
    else if (sqlite3_open_v2(s->path, &s->db, flags, NULL) != SQLITE_OK)
        rc = fail_sql(s, err);
    if (!rc)
        sqlite3_busy_timeout(s->db, BUSY_MS);
    if (!rc) /* FULL: an acknowledged trial survives a power cut, not only a crash */
        rc = run(s, "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA secure_delete=ON;",
                 err);
    if (!rc)
        rc = run(s, schema, err);
    if (!rc)
        rc = add_times(s, err);
    if (!rc)
        rc = claim(s, study_id, err);
    if (rc) {
        ggn_study_store_close(s);
        return rc;
    }
    *store = s;
    return 0;
}

void ggn_study_store_close(struct ggn_study_store *store)
{
    if (store) {
        ggn_study_syncer_stop(store->syncer);
        sqlite3_close(store->db);
    }
    free(store);
}

/* Called after each commit, in place of SQLite's own check whether to copy the log into the file. */
static int on_commit(void *data, sqlite3 *db, const char *name, int pages)
{
    struct ggn_study_store *s = data;
    (void)db, (void)name, (void)pages;
    ggn_study_syncer_want(s->syncer);
    return SQLITE_OK;
}

/* NORMAL alone would still sync inside some requests: where the log is copied into the file, and where the first commit
 * after that begins the log anew. So both are done here: the log is emptied, then begun by setting what is set already, and
 * grows from then on. */
int ggn_study_store_sync_behind(struct ggn_study_store *s, struct base_err *err)
{
    char log[sizeof s->path + 4];
    int rc = run(s, "PRAGMA wal_checkpoint(TRUNCATE); PRAGMA user_version=0; PRAGMA synchronous=NORMAL;", err);
    snprintf(log, sizeof log, "%s-wal", s->path);
    if (!rc)
        rc = ggn_study_syncer_start(log, &s->syncer, err);
    if (!rc)
        sqlite3_wal_hook(s->db, on_commit, s);
    return rc;
}

int ggn_study_store_check(struct ggn_study_store *s, struct base_err *err)
{
    return s->syncer ? ggn_study_syncer_check(s->syncer, err) : 0;
}

int ggn_study_store_begin(struct ggn_study_store *s, struct base_err *err) { return run(s, "BEGIN IMMEDIATE", err); }

int ggn_study_store_commit(struct ggn_study_store *s, struct base_err *err) { return run(s, "COMMIT", err); }

void ggn_study_store_rollback(struct ggn_study_store *s) { run(s, "ROLLBACK", NULL); }

/* --- people --- */

int ggn_study_store_next_number(struct ggn_study_store *s, int64_t *number, struct base_err *err)
{
    return query_number(s, "SELECT seq FROM sqlite_sequence WHERE name = 'person'", 0, 0, number, err);
}

int ggn_study_store_add_person(struct ggn_study_store *s, const struct ggn_study_person *p, const char *profile,
                               struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, "INSERT INTO person (id, key, seed, created, profile) VALUES (?1, ?2, ?3, ?4, ?5)", &st, err);
    if (rc)
        return rc;
    bind_text(st, 1, p->id);
    bind_text(st, 2, p->key);
    sqlite3_bind_int64(st, 3, (int64_t)p->seed);
    bind_text(st, 4, p->created);
    bind_text(st, 5, profile);
    rc = step(s, st, err);
    sqlite3_finalize(st);
    return rc;
}

static void get_person(sqlite3_stmt *st, struct ggn_study_person *p)
{
    p->row = sqlite3_column_int64(st, 0);
    copy_text(st, 1, p->id, sizeof p->id);
    copy_text(st, 2, p->key, sizeof p->key);
    p->seed = (uint64_t)sqlite3_column_int64(st, 3);
    copy_text(st, 4, p->created, sizeof p->created);
}

int ggn_study_store_find(struct ggn_study_store *s, const char *key, const char *id, struct ggn_study_person *person,
                         struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s,
                     key ? "SELECT row, id, key, seed, created FROM person WHERE key = ?1"
                         : "SELECT row, id, key, seed, created FROM person WHERE id = ?1",
                     &st, err);
    if (rc)
        return rc;
    bind_text(st, 1, key ? key : id);
    rc = step(s, st, err);
    if (rc == 1)
        get_person(st, person);
    sqlite3_finalize(st);
    return rc;
}

int ggn_study_store_people(struct ggn_study_store *s, struct ggn_study_person **people, int *n, struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    struct ggn_study_person *list = NULL;
    int count = 0, rc = prepare(s, "SELECT row, id, key, seed, created FROM person ORDER BY row", &st, err);
    if (rc)
        return rc;
    while ((rc = step(s, st, err)) == 1) {
        struct ggn_study_person *more = realloc(list, ((size_t)count + 1) * sizeof *list);
        if (!more) {
            rc = base_fail_nomem(err, s->path);
            break;
        }
        list = more;
        get_person(st, &list[count++]);
    }
    sqlite3_finalize(st);
    if (rc) {
        free(list);
        return rc;
    }
    *people = list;
    *n = count;
    return 0;
}

int ggn_study_store_profile(struct ggn_study_store *s, int64_t row, char **profile, struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, "SELECT profile FROM person WHERE row = ?1", &st, err);
    if (rc)
        return rc;
    sqlite3_bind_int64(st, 1, row);
    rc = step(s, st, err);
    if (rc >= 0) {
        const char *text = rc == 1 ? (const char *)sqlite3_column_text(st, 0) : NULL;
        *profile = strdup(text ? text : "{}");
        rc = *profile ? 0 : base_fail_nomem(err, s->path);
    }
    sqlite3_finalize(st);
    return rc;
}

int ggn_study_store_set_profile(struct ggn_study_store *s, int64_t row, const char *profile, struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, "UPDATE person SET profile = ?2 WHERE row = ?1", &st, err);
    if (rc)
        return rc;
    sqlite3_bind_int64(st, 1, row);
    bind_text(st, 2, profile);
    rc = step(s, st, err);
    sqlite3_finalize(st);
    return rc;
}

int ggn_study_store_delete(struct ggn_study_store *s, int64_t row, struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, "DELETE FROM person WHERE row = ?1", &st, err);
    if (rc)
        return rc;
    sqlite3_bind_int64(st, 1, row);
    rc = step(s, st, err);
    sqlite3_finalize(st);
    return !rc ? run(s, "PRAGMA wal_checkpoint(TRUNCATE)", err) : rc;
}

/* --- trials --- */

static void get_trial(sqlite3_stmt *st, struct ggn_study_trial *t)
{
    *t = (struct ggn_study_trial){.slot = sqlite3_column_int(st, 0),
                                  .revision = sqlite3_column_int(st, 1),
                                  .level = (uint32_t)sqlite3_column_int64(st, 2),
                                  .answer = sqlite3_column_int(st, 3),
                                  .rating = sqlite3_column_int(st, 4),
                                  .ms = sqlite3_column_double(st, 5)};
    copy_text(st, 6, t->layout, sizeof t->layout);
    copy_text(st, 7, t->at, sizeof t->at);
    copy_text(st, 8, t->frame_ms, sizeof t->frame_ms);
}

#define TRIAL_COLUMNS "slot, revision, level, answer, rating, ms, layout, at, frame_ms"

/* The trial of a slot and revision. 1 there, 0 not, negative on an error. */
static int find_trial(struct ggn_study_store *s, int64_t row, int slot, int revision, struct ggn_study_trial *t,
                      struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    int rc = prepare(s, "SELECT " TRIAL_COLUMNS " FROM trial WHERE person = ?1 AND slot = ?2 AND revision = ?3", &st, err);
    if (rc)
        return rc;
    sqlite3_bind_int64(st, 1, row);
    sqlite3_bind_int(st, 2, slot);
    sqlite3_bind_int(st, 3, revision);
    rc = step(s, st, err);
    if (rc == 1)
        get_trial(st, t);
    sqlite3_finalize(st);
    return rc;
}

int ggn_study_store_add_trial(struct ggn_study_store *s, int64_t row, const struct ggn_study_trial *t, struct base_err *err)
{
    struct ggn_study_trial old;
    sqlite3_stmt *st = NULL;
    int rc = find_trial(s, row, t->slot, t->revision, &old, err);
    if (rc < 0)
        return rc;
    if (rc == 1) {
        int same = old.level == t->level && old.answer == t->answer && old.rating == t->rating && old.ms == t->ms &&
                   strcmp(old.layout, t->layout) == 0 && strcmp(old.frame_ms, t->frame_ms) == 0;
        return same ? 0 : base_fail(err, BASE_EINVAL, "trial %d is done already, with another answer", t->slot);
    }
    rc = prepare(s, "INSERT INTO trial (person, " TRIAL_COLUMNS ") VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)", &st,
                 err);
    if (rc)
        return rc;
    sqlite3_bind_int64(st, 1, row);
    sqlite3_bind_int(st, 2, t->slot);
    sqlite3_bind_int(st, 3, t->revision);
    sqlite3_bind_int64(st, 4, t->level);
    sqlite3_bind_int(st, 5, t->answer);
    sqlite3_bind_int(st, 6, t->rating);
    sqlite3_bind_double(st, 7, t->ms);
    bind_text(st, 8, t->layout);
    bind_text(st, 9, t->at);
    bind_text(st, 10, t->frame_ms);
    rc = step(s, st, err);
    sqlite3_finalize(st);
    return rc < 0 ? rc : 1;
}

int ggn_study_store_trials(struct ggn_study_store *s, int64_t row, struct ggn_study_trial **trials, int *n,
                           struct base_err *err)
{
    sqlite3_stmt *st = NULL;
    struct ggn_study_trial *list = NULL;
    size_t count = 0, room = 0;
    int rc = prepare(s, "SELECT " TRIAL_COLUMNS " FROM trial WHERE person = ?1 ORDER BY slot, revision", &st, err);
    if (rc)
        return rc;
    sqlite3_bind_int64(st, 1, row);
    while ((rc = step(s, st, err)) == 1) {
        if (count == room) {
            struct ggn_study_trial *more = realloc(list, (room = room ? 2 * room : 64) * sizeof *list);
            if (!more) {
                rc = base_fail_nomem(err, s->path);
                break;
            }
            list = more;
        }
        get_trial(st, &list[count++]);
    }
    sqlite3_finalize(st);
    if (rc) {
        free(list);
        return rc;
    }
    *trials = list;
    *n = (int)count;
    return 0;
}

int ggn_study_store_count(struct ggn_study_store *s, int64_t row, int *slots, struct base_err *err)
{
    int64_t n = 0;
    int rc = query_number(s, "SELECT COUNT(DISTINCT slot) FROM trial WHERE person = ?1", row, 0, &n, err);
    *slots = (int)n;
    return rc;
}

int ggn_study_store_revisions(struct ggn_study_store *s, int64_t row, int slot, int *revisions, struct base_err *err)
{
    int64_t n = 0;
    int rc = query_number(s, "SELECT COUNT(*) FROM trial WHERE person = ?1 AND slot = ?2", row, slot, &n, err);
    *revisions = (int)n;
    return rc;
}
