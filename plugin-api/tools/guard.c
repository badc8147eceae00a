/* SPDX-License-Identifier: MIT */
#define _DEFAULT_SOURCE 1 /* MAP_ANONYMOUS */
#include "check.h"

#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static size_t page_size(void) { return (size_t)sysconf(_SC_PAGESIZE); }

/* Whole pages for so many bytes. */
static size_t pages_of(size_t size) { return (size + page_size() - 1) / page_size() * page_size(); }

void *lc_guard_alloc(struct lc *c, size_t size)
{
    const size_t page = page_size(), inner = pages_of(size);
    char *base = mmap(NULL, inner + 2 * page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (base == MAP_FAILED || mprotect(base + page, inner, PROT_READ | PROT_WRITE) != 0)
        lc_need(c, NULL);
    return base + page + inner - size;
}

void lc_guard_free(void *memory, size_t size)
{
    const size_t page = page_size(), inner = pages_of(size);
    if (memory)
        munmap((char *)memory + size - inner - page, inner + 2 * page);
}

void *lc_place(struct lc *c, const void *from, size_t size)
{
    enum { PIECES = 10, PIECE_SIZE = 8192 };
    static char *pieces[PIECES];
    static unsigned next;
    char **piece = &pieces[next++ % PIECES];
    *piece = *piece ? *piece : lc_guard_alloc(c, PIECE_SIZE);
    size_t room = size < 8 ? 8 : (size + 7) / 8 * 8;
    char *at = *piece + PIECE_SIZE - room;
    memset(at, 0xa5, room);
    if (from && size > 0)
        memcpy(at, from, size);
    return at;
}

void *lc_place_struct(struct lc *c, const void *from, size_t size)
{
    uint32_t struct_size = (uint32_t)size;
    void *at = lc_place(c, from, size);
    memcpy(at, &struct_size, sizeof struct_size);
    return at;
}

void *lc_place_array(struct lc *c, const void *from, size_t size, uint32_t count, uint32_t stride)
{
    char *at = lc_place(c, NULL, (size_t)count * stride);
    for (uint32_t i = 0; i < count && stride >= size; i++)
        memcpy(at + (size_t)i * stride, (const char *)from + i * size, size);
    return at;
}
