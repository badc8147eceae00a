/* SPDX-License-Identifier: MIT
 *
 * What can be seen of a library before an instance is made.
 */
#include "check.h"

#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"

lull_entry_fn lc_entry(const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL), *symbol = library ? dlsym(library, LULL_ENTRY_NAME) : NULL;
    lull_entry_fn entry;
    memcpy(&entry, &symbol, sizeof entry);
    return entry;
}

int lc_is_script(const char *path) { return base_file_has_ending(path, "py"); }

const struct lull_param *lc_param(const struct lc *c, uint32_t i)
{
    return (const void *)((const char *)c->criterion->params + (size_t)i * c->criterion->param_stride);
}

struct bytes {
    const char *data;
    uint64_t size;
};

static const void *within(const struct bytes *file, uint64_t offset, uint64_t size)
{
    return offset <= file->size && size <= file->size - offset ? file->data + offset : NULL;
}

static int is_export(const ElfW(Sym) * symbol)
{
    unsigned bind = symbol->st_info >> 4, visibility = symbol->st_other & 3;
    return symbol->st_shndx != SHN_UNDEF && symbol->st_shndx != SHN_ABS &&
           (bind == STB_GLOBAL || bind == STB_WEAK || bind == STB_GNU_UNIQUE) &&
           (visibility == STV_DEFAULT || visibility == STV_PROTECTED);
}

static int look_at_table(struct lc *c, const struct bytes *file, const ElfW(Shdr) * table, const ElfW(Shdr) * strings)
{
    const ElfW(Sym) *symbols = within(file, table->sh_offset, table->sh_size);
    const char *text = within(file, strings->sh_offset, strings->sh_size);
    if (!symbols || !text || strings->sh_size == 0 || text[strings->sh_size - 1] != '\0')
        return -1;
    int entries = 0;
    for (uint64_t i = 0; i < table->sh_size / sizeof *symbols; i++) {
        if (!is_export(&symbols[i]) || symbols[i].st_name >= strings->sh_size)
            continue;
        const int is_entry = strcmp(text + symbols[i].st_name, LULL_ENTRY_NAME) == 0;
        LC_EXPECT(c, is_entry, "exports %s", text + symbols[i].st_name);
        entries += is_entry;
    }
    return entries;
}

/* How often a shared object defines the entry; what else it defines for others is reported. -1: it is not understood. */
static int look_at_exports(struct lc *c, const struct bytes *file)
{
    const ElfW(Ehdr) *header = within(file, 0, sizeof *header);
    if (!header || memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 || header->e_shentsize != sizeof(ElfW(Shdr)))
        return -1;
    const ElfW(Shdr) *sections = within(file, header->e_shoff, (uint64_t)header->e_shnum * sizeof *sections);
    if (!sections)
        return -1;
    for (unsigned i = 0; i < header->e_shnum; i++)
        if (sections[i].sh_type == SHT_DYNSYM && sections[i].sh_link < header->e_shnum)
            return look_at_table(c, file, &sections[i], &sections[sections[i].sh_link]);
    return -1;
}

void lc_check_symbols(struct lc *c)
{
    char *data;
    size_t size;
    int entries = -1;
    if (lc_is_script(c->path)) {
        lc_skip(c, "a Python file exports nothing");
        return;
    }
    if (base_file_read(c->path, SIZE_MAX, &data, &size, NULL) == 0) {
        entries = look_at_exports(c, &(struct bytes){data, size});
        free(data);
    }
    if (LC_EXPECT(c, entries >= 0, "its symbol table cannot be read"))
        LC_EXPECT(c, entries == 1, "does not export %s", LULL_ENTRY_NAME);
}

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
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    if (lull_open(&search, c->path, &found, &err) != LULL_OK)
        lc_fail(c, "%s", err.message);
    for (int i = 0; i < SIGNALS; i++) {
        struct sigaction after;
        sigaction(signals[i], NULL, &after);
        LC_EXPECT(c, before[i].sa_handler == after.sa_handler, "loading changed the handling of signal %d", signals[i]);
    }
}

void lc_check_entry(struct lc *c)
{
    if (lc_is_script(c->path)) {
        lc_skip(c, "a Python file has none");
        return;
    }
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
