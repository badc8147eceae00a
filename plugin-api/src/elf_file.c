/* SPDX-License-Identifier: MIT */
#include "elf_file.h"

#include <elf.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int read_at(int fd, void *out, size_t size, uint64_t offset)
{
    return offset <= INT64_MAX && pread(fd, out, size, (off_t)offset) == (ssize_t)size;
}

static const char *header_fault(const ElfW(Ehdr) * h)
{
    unsigned char own_class = sizeof(void *) == 8 ? ELFCLASS64 : ELFCLASS32;
    if (memcmp(h->e_ident, ELFMAG, SELFMAG) != 0)
        return "not a shared object";
    if (h->e_ident[EI_CLASS] != own_class)
        return "a shared object of another word size";
    if (h->e_type != ET_DYN || h->e_phentsize != sizeof(ElfW(Phdr)))
        return "not a shared object";
    return NULL;
}

static const char *segments_fault(int fd, const ElfW(Ehdr) * h, uint64_t size)
{
    for (unsigned i = 0; i < h->e_phnum; i++) {
        ElfW(Phdr) p;
        if (h->e_phoff > size || !read_at(fd, &p, sizeof p, h->e_phoff + (uint64_t)i * sizeof p))
            return "a shared object that was cut short";
        if (p.p_type == PT_LOAD && (p.p_offset > size || p.p_filesz > size - p.p_offset))
            return "a shared object that was cut short";
    }
    return NULL;
}

const char *lull_elf_file_fault(const char *path)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0)
        return errno == ENOENT ? "no such file" : "cannot be opened";
    struct stat st;
    ElfW(Ehdr) header;
    const char *fault;
    if (fstat(fd, &st) != 0 || !S_ISREG(st.st_mode))
        fault = "not a file";
    else if (!read_at(fd, &header, sizeof header, 0))
        fault = "not a shared object";
    else
        fault = header_fault(&header);
    if (!fault)
        fault = segments_fault(fd, &header, (uint64_t)st.st_size);
    close(fd);
    return fault;
}
