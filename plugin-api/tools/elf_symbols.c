/* SPDX-License-Identifier: MIT
 *
 * The dynamic symbols that a shared object defines, read from its section headers.
 */
#include "check.h"

#include <elf.h>
#include <link.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"

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

static int visit_table(const struct bytes *file, const ElfW(Shdr) * table, const ElfW(Shdr) * strings,
                       void (*visit)(void *context, const char *name), void *context)
{
    const ElfW(Sym) *symbols = within(file, table->sh_offset, table->sh_size);
    const char *text = within(file, strings->sh_offset, strings->sh_size);
    if (!symbols || !text || strings->sh_size == 0 || text[strings->sh_size - 1] != '\0')
        return -1;
    for (uint64_t i = 0; i < table->sh_size / sizeof *symbols; i++)
        if (is_export(&symbols[i]) && symbols[i].st_name < strings->sh_size)
            visit(context, text + symbols[i].st_name);
    return 0;
}

static int visit_file(const struct bytes *file, void (*visit)(void *context, const char *name), void *context)
{
    const ElfW(Ehdr) *header = within(file, 0, sizeof *header);
    if (!header || memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 || header->e_shentsize != sizeof(ElfW(Shdr)))
        return -1;
    const ElfW(Shdr) *sections = within(file, header->e_shoff, (uint64_t)header->e_shnum * sizeof *sections);
    if (!sections)
        return -1;
    for (unsigned i = 0; i < header->e_shnum; i++)
        if (sections[i].sh_type == SHT_DYNSYM && sections[i].sh_link < header->e_shnum)
            return visit_table(file, &sections[i], &sections[sections[i].sh_link], visit, context);
    return -1;
}

int lc_elf_exports(const char *path, void (*visit)(void *context, const char *name), void *context)
{
    char *data;
    size_t size;
    if (base_file_read(path, SIZE_MAX, &data, &size, NULL) != 0)
        return -1;
    int result = visit_file(&(struct bytes){data, size}, visit, context);
    free(data);
    return result;
}
