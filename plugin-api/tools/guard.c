/* SPDX-License-Identifier: MIT */
#define _DEFAULT_SOURCE 1 /* MAP_ANONYMOUS */
#include "check.h"

#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static size_t page_size(void) { return (size_t)sysconf(_SC_PAGESIZE); }

/* Whole pages for so many bytes. */
static size_t pages_of(size_t size) { return (size + page_size() - 1) / page_size() * page_size(); }

void *lc_guard_alloc(size_t size)
{
    const size_t page = page_size(), inner = pages_of(size);
    char *base = mmap(NULL, inner + 2 * page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (base == MAP_FAILED)
        return NULL;
    if (mprotect(base + page, inner, PROT_READ | PROT_WRITE) != 0) {
        munmap(base, inner + 2 * page);
        return NULL;
    }
    return base + page + inner - size;
}

void lc_guard_free(void *memory, size_t size)
{
    const size_t page = page_size(), inner = pages_of(size);
    if (memory)
        munmap((char *)memory + size - inner - page, inner + 2 * page);
}

int lc_slots_init(struct lc_slots *s, struct lc *c)
{
    int room = 1;
    for (int i = 0; i < LC_SLOTS; i++)
        room &= (s->at[i] = lc_guard_alloc(LC_SLOT_SIZE)) != NULL;
    return LC_EXPECT(c, room, "out of memory") ? 0 : -1;
}

void lc_slots_release(struct lc_slots *s)
{
    for (int i = 0; i < LC_SLOTS; i++)
        lc_guard_free(s->at[i], LC_SLOT_SIZE);
}

void *lc_place(struct lc_slots *s, const void *from, size_t size)
{
    size_t room = size < 8 ? 8 : (size + 7) / 8 * 8;
    char *at = (char *)s->at[s->next++ % LC_SLOTS] + LC_SLOT_SIZE - room;
    memset(at, 0xa5, room);
    if (from && size > 0)
        memcpy(at, from, size);
    return at;
}

void *lc_place_struct(struct lc_slots *s, const void *from, size_t size)
{
    uint32_t struct_size = (uint32_t)size;
    void *at = lc_place(s, from, size);
    memcpy(at, &struct_size, sizeof struct_size);
    return at;
}

void *lc_place_array(struct lc_slots *s, const void *from, size_t size, uint32_t count, uint32_t stride)
{
    char *at = lc_place(s, NULL, (size_t)count * stride);
    for (uint32_t i = 0; i < count && stride >= size; i++)
        memcpy(at + (size_t)i * stride, (const char *)from + i * size, size);
    return at;
}
