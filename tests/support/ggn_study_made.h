/* A small study that tests of study/ take, and people in it. */
#ifndef TESTS_SUPPORT_GGN_STUDY_MADE_H
#define TESTS_SUPPORT_GGN_STUDY_MADE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "study/store.h"
#include "study/study.h"
#include "study/token.h"

#define ID "0123456789abcdef0123456789abcdef"

static char text[4096];

/* A study of one view with 4 blocks (ids 0, 1, 2, 5) and two conditions. */
static inline const char *study_text(const char *task, const char *instead_of, const char *with)
{
    char base[4096];
    snprintf(base, sizeof base,
             "{\"format\":\"lull-study\",\"version\":1,\"id\":\"" ID
             "\",\"task\":\"%s\",\"seed\":7,\"trials\":20,\"repeats\":3,"
             "\"catch_share\":0.1,\"show_ms\":700,\"gap_ms\":400,\"break_every\":60,\"min_catch_passed\":0.75,\"max_"
             "untouched\":0.5,"
             "\"conditions\":[\"a\",\"b\"],\"views\":[{\"name\":\"v\",\"width\":40,\"height\":10,\"blocks\":["
             "{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":10,\"y1\":10,\"levels\":[16,64,256]},"
             "{\"id\":1,\"x0\":10,\"y0\":0,\"x1\":20,\"y1\":10,\"levels\":[16,64,256]},"
             "{\"id\":2,\"x0\":20,\"y0\":0,\"x1\":30,\"y1\":10,\"levels\":[16,64,256]},"
             "{\"id\":5,\"x0\":30,\"y0\":0,\"x1\":40,\"y1\":10,\"levels\":[16,64,512]}]}]}",
             task);
    char *at = instead_of ? strstr(base, instead_of) : NULL;
    if (!at)
        snprintf(text, sizeof text, "%s", base);
    else
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - base), base, with, at + strlen(instead_of));
    return text;
}

static inline void parse(const char *task, struct ggn_study *s)
{
    struct base_err err = {0};
    study_text(task, NULL, NULL);
    assert_int_equal(ggn_study_parse("test", text, strlen(text), s, &err), 0);
}

static inline struct ggn_study_store *open_store(const char *dir)
{
    struct ggn_study_store *store = NULL;
    struct base_err err = {0};
    assert_int_equal(ggn_study_store_open(dir, ID, 1, &store, &err), 0);
    return store;
}

static inline int64_t add_person(struct ggn_study_store *store, const char *id, uint64_t seed)
{
    struct ggn_study_person p = {.seed = seed, .created = "2024-01-01T00:00:00Z"};
    struct base_err err = {0};
    snprintf(p.id, sizeof p.id, "%s", id);
    assert_int_equal(ggn_study_token(p.key, 32, &err), 0);
    assert_int_equal(ggn_study_store_add_person(store, &p, "{\"answers\":{\"vision\":\"well\"}}", &err), 0);
    assert_int_equal(ggn_study_store_find(store, p.key, NULL, &p, &err), 1);
    return p.row;
}

#endif
