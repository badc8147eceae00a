/* SPDX-License-Identifier: MIT
 *
 * What can be seen of a library before an instance is made.
 */
#include "check.h"

#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

lull_entry_fn lc_entry(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL), *symbol = library ? dlsym(library, LULL_ENTRY_NAME) : NULL;
    lull_entry_fn entry;
    memcpy(&entry, &symbol, sizeof entry);
    return entry;
}

const struct lull_param *lc_param(const struct lc *c, uint32_t i)
{
    return (const void *)((const char *)c->criterion->params + (size_t)i * c->criterion->param_stride);
}

/* --- symbols --------------------------------------------------------------------------------------------------------- */

struct exports {
    struct lc *check;
    unsigned entries;
};

static void note_export(void *context, const char *name)
{
    struct exports *e = context;
    if (strcmp(name, LULL_ENTRY_NAME) == 0)
        e->entries++;
    else
        lc_fail(e->check, "exports %s", name);
}

void lc_check_symbols(struct lc *c)
{
    struct exports e = {.check = c};
    if (lc_elf_exports(c->path, note_export, &e) != 0)
        lc_fail(c, "its symbol table cannot be read");
    else
        LC_EXPECT(c, e.entries == 1, "does not export %s", LULL_ENTRY_NAME);
}

/* --- loading --------------------------------------------------------------------------------------------------------- */

static const int signals[] = {SIGINT, SIGTERM, SIGHUP,  SIGQUIT, SIGILL,  SIGABRT, SIGFPE, SIGSEGV,
                              SIGBUS, SIGPIPE, SIGALRM, SIGUSR1, SIGUSR2, SIGCHLD, SIGPROF};
enum { SIGNALS = sizeof signals / sizeof *signals };

static void note_log(void *context, int32_t level, const char *text)
{
    if (level <= LULL_LOG_WARNING)
        lc_fail(context, "%s", text);
}

void lc_check_load(struct lc *c)
{
    struct sigaction before[SIGNALS];
    for (int i = 0; i < SIGNALS; i++)
        sigaction(signals[i], NULL, &before[i]);
    struct lull_search search = {.log = note_log, .log_context = c};
    struct lull_found *found = malloc(sizeof *found);
    struct lull_error err = {.struct_size = sizeof err};
    if (!found || lull_open(&search, c->path, found, &err) != LULL_OK)
        lc_fail(c, "%s", err.message);
    free(found);
    for (int i = 0; i < SIGNALS; i++) {
        struct sigaction after;
        sigaction(signals[i], NULL, &after);
        LC_EXPECT(c, before[i].sa_handler == after.sa_handler, "loading changed the handling of signal %d", signals[i]);
    }
}

/* --- entry ----------------------------------------------------------------------------------------------------------- */

void lc_check_entry(struct lc *c)
{
    lull_entry_fn entry = lc_entry(c->path);
    uint32_t count = 0;
    for (; count < 1000 && entry(count); count++)
        LC_EXPECT(c, entry(count) == entry(count), "entry(%u) is another pointer each time", count);
    LC_EXPECT(c, !entry(count) && !entry(count + 1), "entry is not NULL past the last criterion");
    LC_EXPECT(c, !entry(UINT32_MAX), "entry(4294967295) is not NULL");
    LC_EXPECT(c, !entry(UINT32_C(0x80000000)), "entry(2147483648) is not NULL");
    LC_EXPECT(c, entry(0) != NULL, "entry(0) is NULL");
    lc_note(c, "%u criteria in the library", count);
}

void lc_check_table(struct lc *c)
{
    const struct lull_criterion *t = c->criterion;
    struct lull_error err = {.struct_size = sizeof err};
    LC_EXPECT(c, lull_table_check(t, &err) == LULL_OK, "%s", err.message);
    const uint32_t known = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT | LULL_CAP_REOPENS;
    if (t->api_minor <= LULL_API_MINOR)
        LC_EXPECT(c, (t->capabilities & ~known) == 0, "unknown capabilities %#x", t->capabilities);
    LC_EXPECT(c, *t->name != '\0' && *t->version != '\0' && *t->description != '\0',
              "name, version or description is empty");
    LC_EXPECT(c, !t->get_extension("no.such/1"), "it claims the extension no.such/1");
    static const char *const levels[] = {"NONE", "INSTANCE", "FULL"};
    lc_note(c, "%s %s: %s; threads %s%s%s%s", t->id, t->version, t->name, levels[t->thread_level],
            t->capabilities & LULL_CAP_DETERMINISTIC ? ", deterministic" : "",
            t->capabilities & LULL_CAP_BATCH_INVARIANT ? ", batch invariant" : "",
            t->capabilities & LULL_CAP_REOPENS ? ", reopens" : "");
}
