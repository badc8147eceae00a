#define _GNU_SOURCE /* ST_NOEXEC, dladdr */
#include "base/module.h"

#include <dlfcn.h>
#include <elf.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <link.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

extern const ElfW(Ehdr) __ehdr_start __attribute__((visibility("hidden"))); /* of this very object, from the linker */

static int read_at(int fd, void *out, size_t size, uint64_t offset)
{
    return offset <= INT64_MAX && pread(fd, out, size, (off_t)offset) == (ssize_t)size;
}

/* NULL if the file is an ELF shared object for this processor whose segments all lie within the file, and where files may be
 * run; else what is wrong with it. */
static const char *find_fault(int fd)
{
    struct stat st;
    struct statvfs system;
    ElfW(Ehdr) h;
    ElfW(Phdr) p;
    if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))
        return "not a regular file";
    if (!read_at(fd, &h, sizeof h, 0) || memcmp(h.e_ident, ELFMAG, SELFMAG) != 0)
        return "not a shared object";
    if (h.e_ident[EI_CLASS] != __ehdr_start.e_ident[EI_CLASS])
        return "a shared object of another word size";
    if (h.e_ident[EI_DATA] != __ehdr_start.e_ident[EI_DATA] || h.e_machine != __ehdr_start.e_machine)
        return "a shared object for another processor";
    if (h.e_type != ET_DYN || h.e_phentsize != sizeof p)
        return "not a shared object";
    const uint64_t size = (uint64_t)st.st_size;
    for (unsigned i = 0; i < h.e_phnum; i++)
        if (h.e_phoff > size || !read_at(fd, &p, sizeof p, h.e_phoff + (uint64_t)i * sizeof p) ||
            (p.p_type == PT_LOAD && (p.p_offset > size || p.p_filesz > size - p.p_offset)))
            return "a shared object that was cut short";
    return fstatvfs(fd, &system) == 0 && (system.f_flag & ST_NOEXEC) ? "on a file system from which nothing is run (noexec)"
                                                                     : NULL;
}

static int check(const char *path, struct base_err *err)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return base_fail(err, BASE_EIO, "%s: %s", path, errno == ENOENT ? "no such file" : strerror(errno));
    const char *fault = find_fault(fd);
    close(fd);
    return fault ? base_fail(err, BASE_EIO, "%s: %s", path, fault) : 0;
}

/* The GNU C library has no number for it. A segment of a file that is whole, and may be run, has nothing else to lack. */
static int lacks_memory(const char *why)
{
    static const char *const words[] = {"llocate memory", "failed to map segment", "cannot map zero-fill", "out of memory"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        if (strstr(why, words[i]))
            return 1;
    return 0;
}

void *base_module_open(const char *path, int flags, struct base_err *err)
{
    if (strchr(path, '/') && check(path, err) != 0)
        return NULL;
    void *module = dlopen(path, flags);
    const char *why = module ? "" : dlerror();
    if (!module && (!why || lacks_memory(why)))
        base_fail_nomem(err, path);
    else if (!module) /* most often it begins with the path */
        base_fail(err, BASE_EIO, "cannot load: %s", why);
    return module;
}

/* Beside the shared object that this is part of, as the host library is, if the file is there; else by the program. */
static void find_module(const char *file, char path[PATH_MAX + 64])
{
    static const char here;
    Dl_info object;
    char program[PATH_MAX];
    const char *slash = dladdr(&here, &object) != 0 && object.dli_fname ? strrchr(object.dli_fname, '/') : NULL;
    if (slash) {
        snprintf(path, PATH_MAX + 64, "%.*s/lull/modules/%s", (int)(slash - object.dli_fname), object.dli_fname, file);
        if (access(path, F_OK) == 0)
            return;
    }
    const ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    program[n > 0 ? n : 0] = '\0';
    slash = strrchr(program, '/');
    snprintf(path, PATH_MAX + 64, "%.*s../lib/lull/modules/%s", slash ? (int)(slash + 1 - program) : 0, program, file);
}

void *base_module_symbol(const char *file, const char *symbol, int share, struct base_err *err)
{
    char path[PATH_MAX + 64];
    find_module(file, path);
    void *module = base_module_open(path, share ? RTLD_NOW | RTLD_GLOBAL : RTLD_LAZY | RTLD_LOCAL, err);
    void *found = module ? dlsym(module, symbol) : NULL;
    if (module && !found)
        base_fail(err, BASE_EIO, "%s: it has no %s: is this tree built, or installed, as a whole?", path, symbol);
    return found;
}
