/* SPDX-License-Identifier: MIT
 *
 * Loading: resolve a name to a file, see that the file is a complete ELF object, dlopen, take the entry, check its tables.
 * A file cut short would make dlopen die of SIGBUS, therefore the look at its headers first.
 */
#define _GNU_SOURCE /* dladdr */
#include <lull/loader.h>

#include <dirent.h>
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "elf_file.h"
#include "process_state.h"

int32_t lull_error_set(struct lull_error *err, int32_t code, const char *format, ...)
{
    if (!err || err->struct_size <= offsetof(struct lull_error, message))
        return code;
    size_t room = err->struct_size - offsetof(struct lull_error, message);
    if (room > sizeof err->message)
        room = sizeof err->message;
    err->code = code;
    va_list args;
    va_start(args, format);
    vsnprintf(err->message, room, format, args);
    va_end(args);
    return code;
}

__attribute__((format(printf, 3, 4))) static void say(const struct lull_search *search, int32_t level, const char *format,
                                                      ...)
{
    if (!search || !search->log)
        return;
    char text[LULL_PATH_MAX + 600];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    search->log(search->log_context, level, text);
}

/* --- one library ----------------------------------------------------------------------------------------------------- */

/* Tells about, and where possible undoes, what loading did to the process. */
static void compare_process(const struct lull_search *search, const char *path, const struct lull_process_state *before)
{
    struct lull_process_state after;
    lull_process_state_read(&after);
    const char *changed = lull_process_state_restore(before);
    if (changed)
        say(search, LULL_LOG_WARNING, "%s: loading changed %s; restored", path, changed);
    if (after.thread_count > before->thread_count)
        say(search, LULL_LOG_WARNING, "%s: loading started %ld thread(s)", path, after.thread_count - before->thread_count);
}

static int32_t load_entry(const struct lull_search *search, const char *path, lull_entry_fn *entry, struct lull_error *err)
{
    const char *fault = lull_elf_file_fault(path);
    if (fault)
        return lull_error_set(err, LULL_E_IO, "%s: %s", path, fault);

    struct lull_process_state before;
    lull_process_state_read(&before);
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    const char *why = !library ? dlerror() : NULL;
    compare_process(search, path, &before);
    if (!library) /* dlerror's text begins with the path */
        return lull_error_set(err, LULL_E_IO, "cannot load: %s", why ? why : path);

    void *symbol = dlsym(library, LULL_ENTRY_NAME);
    if (!symbol)
        return lull_error_set(err, LULL_E_VERSION, "%s: not a criterion of ABI %d (no symbol %s)", path, LULL_API_MAJOR,
                              LULL_ENTRY_NAME);
    memcpy(entry, &symbol, sizeof symbol); /* ISO C knows no conversion from object to function pointer */
    return LULL_OK;
}

/* At most this many criteria in one library: an entry that never returns NULL must end somewhere. */
enum { ENTRY_MAX = 1000 };

static int32_t entry_check(const char *path, lull_entry_fn entry, uint32_t *count, struct lull_error *err)
{
    for (*count = 0; *count < ENTRY_MAX; ++*count) {
        const struct lull_criterion *c = entry(*count);
        if (!c)
            break;
        struct lull_error why = {.struct_size = sizeof why};
        int32_t status = lull_table_check(c, &why);
        if (status != LULL_OK)
            return lull_error_set(err, status, "%s: criterion %u: %s", path, *count, why.message);
        for (uint32_t i = 0; i < *count; i++)
            if (strcmp(entry(i)->id, c->id) == 0)
                return lull_error_set(err, LULL_E_INVALID, "%s: two criteria have the id %s", path, c->id);
    }
    if (*count == 0)
        return lull_error_set(err, LULL_E_INVALID, "%s: holds no criterion", path);
    if (*count == ENTRY_MAX)
        return lull_error_set(err, LULL_E_INVALID, "%s: the entry never ends its list with NULL", path);
    return LULL_OK;
}

static int32_t load_library(const struct lull_search *search, const char *path, lull_entry_fn *entry, uint32_t *count,
                            struct lull_error *err)
{
    int32_t status = load_entry(search, path, entry, err);
    return status != LULL_OK ? status : entry_check(path, *entry, count, err);
}

static const struct lull_criterion *find_id(lull_entry_fn entry, uint32_t count, const char *id)
{
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(entry(i)->id, id) == 0)
            return entry(i);
    return NULL;
}

/* What the library holds, as "ID, ID …". */
static void list_ids(lull_entry_fn entry, uint32_t count, char *text, size_t room)
{
    size_t used = 0;
    for (uint32_t i = 0; i < count && used < room; i++)
        used += (size_t)snprintf(text + used, room - used, "%s%s", i > 0 ? ", " : "", entry(i)->id);
}

/* --- directories ----------------------------------------------------------------------------------------------------- */

/* lib/lull beside the running program's own folder: the build tree and the installed tree have the same shape. */
static const char *beside_program(char path[LULL_PATH_MAX])
{
    static const char tail[] = "/../lib/lull";
    ssize_t n = readlink("/proc/self/exe", path, LULL_PATH_MAX - 1);
    path[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(path, '/');
    if (!slash || (size_t)(slash - path) + sizeof tail > LULL_PATH_MAX)
        return NULL;
    memcpy(slash, tail, sizeof tail);
    return path;
}

/* lull beside the host library, if that is where this code is: a renderer is installed elsewhere. resolved: beside the file
 * that the library's name links to. */
static const char *beside_library(int resolved, char path[LULL_PATH_MAX])
{
    static const char here, name[] = "/liblull-host.so", tail[] = "/lull";
    Dl_info info;
    char *file = dladdr(&here, &info) != 0 && info.dli_fname ? realpath(info.dli_fname, NULL) : NULL;
    const char *own = resolved || !file ? file : info.dli_fname, *slash = own ? strrchr(own, '/') : NULL;
    int is_there = slash && strncmp(slash, name, strlen(name)) == 0 && (size_t)(slash - own) + sizeof tail <= LULL_PATH_MAX;
    if (is_there) {
        memcpy(path, own, (size_t)(slash - own));
        memcpy(path + (slash - own), tail, sizeof tail);
    }
    free(file);
    return is_there ? path : NULL;
}

/* Walks the directories of a search, entries joined by ':' one by one. */
struct dir_walk {
    const struct lull_search *search;
    size_t index;
    const char *rest;
    char own[LULL_PATH_MAX];
};

enum { USUAL_ENTRIES = 4 };

static const char *usual_entry(struct dir_walk *walk, size_t index)
{
    return index == 0   ? getenv("LULL_PLUGIN_PATH")
           : index == 1 ? beside_program(walk->own)
                        : beside_library(index == 3, walk->own);
}

static int next_dir(struct dir_walk *walk, char dir[LULL_PATH_MAX])
{
    const struct lull_search *s = walk->search;
    for (;;) {
        while (!walk->rest || *walk->rest == '\0') {
            if (!s || walk->index >= (s->dirs ? s->dir_count : USUAL_ENTRIES))
                return 0;
            walk->rest = s->dirs ? s->dirs[walk->index] : usual_entry(walk, walk->index);
            walk->index++;
        }
        size_t length = strcspn(walk->rest, ":");
        const char *start = walk->rest;
        walk->rest += length + (start[length] == ':');
        if (length == 0 || length >= LULL_PATH_MAX)
            continue;
        memcpy(dir, start, length);
        dir[length] = '\0';
        return 1;
    }
}

static int is_file(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISREG(st.st_mode);
}

static int has_suffix(const char *text, const char *suffix)
{
    size_t n = strlen(text), m = strlen(suffix);
    return n > m && strcmp(text + n - m, suffix) == 0;
}

struct library_name {
    char *path;
    const char *base; /* within path */
};

struct library_list {
    struct library_name *items;
    size_t count, room;
};

static void library_list_release(struct library_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->items[i].path);
    free(list->items);
}

static int32_t library_list_add(struct library_list *list, const char *dir, const char *name)
{
    for (size_t i = 0; i < list->count; i++)
        if (strcmp(list->items[i].base, name) == 0)
            return LULL_OK; /* an earlier directory hides it */
    if (list->count == list->room) {
        size_t room = list->room == 0 ? 16 : 2 * list->room;
        struct library_name *items = realloc(list->items, room * sizeof *items);
        if (!items)
            return LULL_E_MEMORY;
        list->items = items;
        list->room = room;
    }
    size_t size = strlen(dir) + 1 + strlen(name) + 1;
    char *path = malloc(size);
    if (!path)
        return LULL_E_MEMORY;
    snprintf(path, size, "%s/%s", dir, name);
    if (size > LULL_PATH_MAX || !is_file(path)) {
        free(path);
        return LULL_OK;
    }
    list->items[list->count].path = path;
    list->items[list->count].base = path + strlen(dir) + 1;
    list->count++;
    return LULL_OK;
}

static int by_base(const void *a, const void *b)
{
    return strcmp(((const struct library_name *)a)->base, ((const struct library_name *)b)->base);
}

/* Every *.so of the directories; the caller releases the list, also after a failure. */
static int32_t library_list_scan(const struct lull_search *search, struct library_list *list)
{
    char dir[LULL_PATH_MAX];
    int32_t status = LULL_OK;
    for (struct dir_walk walk = {.search = search}; status == LULL_OK && next_dir(&walk, dir);) {
        DIR *d = opendir(dir);
        if (!d)
            continue; /* a directory that does not exist holds no criterion */
        size_t first = list->count;
        for (struct dirent *e; status == LULL_OK && (e = readdir(d));)
            if (e->d_name[0] != '.' && has_suffix(e->d_name, ".so"))
                status = library_list_add(list, dir, e->d_name);
        closedir(d);
        if (list->count > first)
            qsort(list->items + first, list->count - first, sizeof *list->items, by_base);
    }
    return status;
}

/* --- public ---------------------------------------------------------------------------------------------------------- */

int32_t lull_list(const struct lull_search *search, int32_t (*visit)(void *context, const struct lull_found *found),
                  void *context)
{
    struct library_list list = {0};
    int32_t status = library_list_scan(search, &list);
    struct lull_found *found = status == LULL_OK ? malloc(sizeof *found) : NULL;
    if (!found)
        status = LULL_E_MEMORY;
    for (size_t i = 0; status == LULL_OK && i < list.count; i++) {
        lull_entry_fn entry;
        uint32_t count;
        struct lull_error err = {.struct_size = sizeof err};
        if (load_library(search, list.items[i].path, &entry, &count, &err) != LULL_OK) {
            say(search, LULL_LOG_ERROR, "skipped: %s", err.message);
            continue;
        }
        snprintf(found->path, sizeof found->path, "%s", list.items[i].path);
        for (uint32_t k = 0; status == LULL_OK && k < count; k++) {
            found->criterion = entry(k);
            status = visit(context, found);
        }
    }
    free(found);
    library_list_release(&list);
    return status;
}

/* Loads path and takes the criterion with this id, or the first one if id is NULL. */
static int32_t open_path(const struct lull_search *search, const char *path, const char *id, struct lull_found *found,
                         struct lull_error *err)
{
    lull_entry_fn entry;
    uint32_t count;
    int32_t status = load_library(search, path, &entry, &count, err);
    if (status != LULL_OK)
        return status;
    const struct lull_criterion *c = !id ? entry(0) : find_id(entry, count, id);
    if (!c) {
        char ids[256];
        list_ids(entry, count, ids, sizeof ids);
        return lull_error_set(err, LULL_E_KEY, "%s: holds no criterion with the id %s, but %s", path, id, ids);
    }
    found->criterion = c;
    snprintf(found->path, sizeof found->path, "%s", path);
    return LULL_OK;
}

struct name_query {
    const char *id;
    struct lull_found *found;
};

static int32_t take_if_named(void *context, const struct lull_found *found)
{
    struct name_query *query = context;
    if (strcmp(found->criterion->id, query->id) != 0)
        return 0;
    *query->found = *found;
    return 1;
}

/* DIR/name.so in the directories; id NULL means: the criterion called like the library. A library that holds others only
 * is refused: whoever asked for this name would be judged by another criterion. */
static int32_t open_name(const struct lull_search *search, const char *name, const char *id, struct lull_found *found,
                         struct lull_error *err)
{
    char dir[LULL_PATH_MAX], path[2 * LULL_PATH_MAX + 8];
    for (struct dir_walk walk = {.search = search}; next_dir(&walk, dir);) {
        snprintf(path, sizeof path, "%s/%s.so", dir, name);
        if (strlen(path) >= LULL_PATH_MAX || !is_file(path))
            continue;
        return open_path(search, path, id ? id : name, found, err);
    }
    if (!id) {
        struct name_query query = {.id = name, .found = found};
        int32_t status = lull_list(search, take_if_named, &query);
        if (status == 1)
            return LULL_OK;
        if (status != LULL_OK)
            return lull_error_set(err, status, "out of memory");
    }
    return lull_error_set(err, LULL_E_IO, "no criterion %s in the criterion directories", name);
}

int32_t lull_open(const struct lull_search *search, const char *spec, struct lull_found *found, struct lull_error *err)
{
    if (!spec || *spec == '\0' || !found || strlen(spec) > LULL_PATH_MAX - 8)
        return lull_error_set(err, LULL_E_INVALID, "a criterion is named NAME, PATH or PATH:ID");

    char base[LULL_PATH_MAX];
    snprintf(base, sizeof base, "%s", spec);
    char *id = NULL;
    if (!is_file(spec)) { /* a path may contain ':' itself */
        char *colon = strrchr(base, ':');
        if (colon && !strchr(colon, '/')) {
            *colon = '\0';
            id = colon + 1;
        }
    }
    if (id && (*id == '\0' || *base == '\0'))
        return lull_error_set(err, LULL_E_INVALID, "%s: a criterion is named NAME, PATH or PATH:ID", spec);
    if (!strchr(base, '/') && !has_suffix(base, ".so"))
        return open_name(search, base, id, found, err);
    char path[LULL_PATH_MAX + 2]; /* without a '/' dlopen would search the system's directories */
    snprintf(path, sizeof path, "%s%s", strchr(base, '/') ? "" : "./", base);
    return open_path(search, path, id, found, err);
}
