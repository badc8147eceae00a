/* SPDX-License-Identifier: MIT
 *
 * Loading: resolve a name to a file, load it, take the entry, check its tables.
 */
#define _GNU_SOURCE /* dladdr */
#include <lull/loader.h>

#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/module.h"
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
    struct lull_process_state before;
    struct base_err why = {0};
    lull_process_state_read(&before);
    void *library = base_module_open(path, RTLD_NOW | RTLD_LOCAL, &why);
    compare_process(search, path, &before);
    if (!library)
        return lull_error_set(err, why.code == BASE_ENOMEM ? LULL_E_MEMORY : LULL_E_IO, "%s", why.text);

    void *symbol = dlsym(library, LULL_ENTRY_NAME);
    if (!symbol)
        return lull_error_set(err, LULL_E_VERSION, "%s: not a criterion of ABI %d (no symbol %s)", path, LULL_API_MAJOR,
                              LULL_ENTRY_NAME);
    memcpy(entry, &symbol, sizeof symbol); /* ISO C knows no conversion from object to function pointer */
    return entry_check(path, *entry, count, err);
}

/* What the library holds, as "ID, ID …". */
static void list_ids(lull_entry_fn entry, uint32_t count, char *text, size_t room)
{
    size_t used = 0;
    for (uint32_t i = 0; i < count && used < room; i++)
        used += (size_t)snprintf(text + used, room - used, "%s%s", i > 0 ? ", " : "", entry(i)->id);
}

/* The folder of a file with `tail` behind it; NULL: there is none, or it is too long. */
static const char *beside(const char *file, const char *tail, char path[LULL_PATH_MAX])
{
    const char *slash = strrchr(file, '/');
    const int length = slash ? snprintf(path, LULL_PATH_MAX, "%.*s%s", (int)(slash - file), file, tail) : LULL_PATH_MAX;
    return length < LULL_PATH_MAX ? path : NULL;
}

/* lib/lull beside the running program's own folder: the build tree and the installed tree have the same shape. */
static const char *beside_program(char path[LULL_PATH_MAX])
{
    char program[LULL_PATH_MAX];
    const ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    program[n > 0 ? n : 0] = '\0';
    return beside(program, "/../lib/lull", path);
}

/* lull beside the host library, if that is where this code is: a renderer is installed elsewhere. resolved: beside the file
 * that the library's name links to. */
static const char *beside_library(int resolved, char path[LULL_PATH_MAX])
{
    static const char here, name[] = "/liblull-host.so";
    Dl_info info;
    char *file = dladdr(&here, &info) != 0 && info.dli_fname ? realpath(info.dli_fname, NULL) : NULL;
    const char *own = resolved || !file ? file : info.dli_fname, *slash = own ? strrchr(own, '/') : NULL;
    const char *there = slash && strncmp(slash, name, strlen(name)) == 0 ? beside(own, "/lull", path) : NULL;
    free(file);
    return there;
}

enum { USUAL_ENTRIES = 4 };

static const char *usual_entry(size_t index, char own[LULL_PATH_MAX])
{
    return index == 0 ? getenv("LULL_PLUGIN_PATH") : index == 1 ? beside_program(own) : beside_library(index == 3, own);
}

/* The directory of a search with this number, from 1: those that an entry joins by ':' count one by one. 0: it has fewer. */
static int find_dir(const struct lull_search *s, size_t number, char dir[LULL_PATH_MAX])
{
    char own[LULL_PATH_MAX];
    for (size_t i = 0; s && i < (s->dirs ? s->dir_count : USUAL_ENTRIES); i++) {
        const char *at = s->dirs ? s->dirs[i] : usual_entry(i, own);
        while (at && *at != '\0') {
            const size_t length = strcspn(at, ":");
            if (length > 0 && length < LULL_PATH_MAX && --number == 0) {
                snprintf(dir, LULL_PATH_MAX, "%.*s", (int)length, at);
                return 1;
            }
            at += length + (at[length] == ':');
        }
    }
    return 0;
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

/* The first directory that has such a file, counted from 1, and the file's path; 0: none has. */
static size_t find_file(const struct lull_search *search, const char *name, const char *ending, char path[LULL_PATH_MAX])
{
    char dir[LULL_PATH_MAX];
    for (size_t number = 1; find_dir(search, number, dir); number++)
        if (snprintf(path, LULL_PATH_MAX, "%s/%s%s", dir, name, ending) < LULL_PATH_MAX && is_file(path))
            return number;
    return 0;
}

static int is_library(const struct dirent *e) { return e->d_name[0] != '.' && has_suffix(e->d_name, ".so"); }

static int by_name(const struct dirent **a, const struct dirent **b) { return strcmp((*a)->d_name, (*b)->d_name); }

static int32_t visit_library(const struct lull_search *search, struct lull_found *found,
                             int32_t (*visit)(void *context, const struct lull_found *found), void *context)
{
    lull_entry_fn entry;
    uint32_t count;
    struct lull_error err = {.struct_size = sizeof err};
    int32_t status = LULL_OK;
    if (load_library(search, found->path, &entry, &count, &err) != LULL_OK) {
        say(search, LULL_LOG_ERROR, "skipped: %s", err.message);
        return LULL_OK;
    }
    for (uint32_t k = 0; status == LULL_OK && k < count; k++) {
        found->criterion = entry(k);
        status = visit(context, found);
    }
    return status;
}

int32_t lull_list(const struct lull_search *search, int32_t (*visit)(void *context, const struct lull_found *found),
                  void *context)
{
    struct lull_found *found = malloc(sizeof *found);
    char dir[LULL_PATH_MAX];
    int32_t status = found ? LULL_OK : LULL_E_MEMORY;
    for (size_t number = 1; status == LULL_OK && find_dir(search, number, dir); number++) {
        struct dirent **list = NULL;
        const int count = scandir(dir, &list, is_library, by_name); /* -1: most often there is no such directory */
        status = count < 0 && errno == ENOMEM ? LULL_E_MEMORY : LULL_OK;
        for (int i = 0; i < count; i++) {
            if (status == LULL_OK && find_file(search, list[i]->d_name, "", found->path) == number)
                status = visit_library(search, found, visit, context);
            free(list[i]);
        }
        free(list);
    }
    free(found);
    return status;
}

/* Loads path and takes the criterion with this id, or the first one if id is NULL. */
static int32_t open_path(const struct lull_search *search, const char *path, const char *id, struct lull_found *found,
                         struct lull_error *err)
{
    lull_entry_fn entry;
    uint32_t count, i = 0;
    int32_t status = load_library(search, path, &entry, &count, err);
    if (status != LULL_OK)
        return status;
    while (id && i < count && strcmp(entry(i)->id, id) != 0)
        i++;
    if (i == count) {
        char ids[256];
        list_ids(entry, count, ids, sizeof ids);
        return lull_error_set(err, LULL_E_KEY, "%s: holds no criterion with the id %s, but %s", path, id, ids);
    }
    found->criterion = entry(i);
    snprintf(found->path, sizeof found->path, "%s", path);
    return LULL_OK;
}

/* A Python file is run by a module of ours (../script), which lies in a folder of the directories, or of the usual ones. */
static void *script_symbol(const struct lull_search *search, const char *name, struct lull_error *err)
{
    static const char file[] = "modules/lull-python.so";
    const struct lull_search usual = {0};
    char path[LULL_PATH_MAX];
    if (!find_file(search, file, "", path) && !find_file(&usual, file, "", path)) {
        lull_error_set(err, LULL_E_IO, "no %s in the criterion directories: is this tree built, or installed, as a whole?",
                       file);
        return NULL;
    }
    void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL), *symbol = module ? dlsym(module, name) : NULL;
    const char *why = symbol ? NULL : dlerror();
    if (!symbol)
        lull_error_set(err, LULL_E_IO, "cannot load: %s", why ? why : path);
    return symbol;
}

static int32_t open_script(const struct lull_search *search, const char *path, const char *id, struct lull_found *found,
                           struct lull_error *err)
{
    struct lull_error why = {.struct_size = sizeof why};
    const struct lull_criterion *criterion;
    int32_t (*find)(const char *path, const struct lull_criterion **out, struct lull_error *err);
    if (!is_file(path))
        return lull_error_set(err, LULL_E_IO, "%s: %s", path, access(path, F_OK) != 0 ? "no such file" : "not a file");
    void *symbol = script_symbol(search, "lull_script_find", err);
    if (!symbol)
        return LULL_E_IO;
    memcpy(&find, &symbol, sizeof symbol);
    int32_t status = find(path, &criterion, &why);
    if (status != LULL_OK)
        return lull_error_set(err, status, "%s", why.message);
    status = lull_table_check(criterion, &why);
    if (status != LULL_OK)
        return lull_error_set(err, status, "%s: %s", path, why.message);
    if (id && strcmp(id, criterion->id) != 0)
        return lull_error_set(err, LULL_E_KEY, "%s: holds no criterion with the id %s, but %s", path, id, criterion->id);
    found->criterion = criterion;
    snprintf(found->path, sizeof found->path, "%s", path);
    return LULL_OK;
}

int32_t lull_answer_scripts(void (*answer)(void *request, uint64_t bytes), struct lull_error *err)
{
    void *symbol = script_symbol(NULL, "lull_script_answer_here", err);
    void (*tell)(void (*answer)(void *request, uint64_t bytes));
    if (!symbol)
        return LULL_E_IO;
    memcpy(&tell, &symbol, sizeof symbol);
    tell(answer);
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
    char path[LULL_PATH_MAX];
    if (find_file(search, name, ".so", path))
        return open_path(search, path, id ? id : name, found, err);
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
    const int script = has_suffix(base, ".py");
    if (!strchr(base, '/') && !script && !has_suffix(base, ".so"))
        return open_name(search, base, id, found, err);
    char path[LULL_PATH_MAX + 2]; /* without a '/' dlopen would search the system's directories */
    snprintf(path, sizeof path, "%s%s", strchr(base, '/') ? "" : "./", base);
    return (script ? open_script : open_path)(search, path, id, found, err);
}
