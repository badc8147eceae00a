#include "scene/arena.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { ALIGNMENT = 16, CHUNK_BYTES = 1 << 18 };

struct pt_arena_chunk {
    struct pt_arena_chunk *next;
    size_t used, size;
    _Alignas(ALIGNMENT) unsigned char data[];
};

void *pt_arena_alloc(struct pt_arena *arena, size_t count, size_t size)
{
    if (count == 0 || size == 0 || count > (SIZE_MAX / 2) / size)
        return NULL;
    size_t bytes = (count * size + ALIGNMENT - 1) & ~(size_t)(ALIGNMENT - 1);
    struct pt_arena_chunk *c = arena->chunks;
    if (!c || c->size - c->used < bytes) {
        size_t room = bytes > CHUNK_BYTES ? bytes : CHUNK_BYTES;
        c = calloc(1, sizeof *c + room);
        if (!c)
            return NULL;
        c->size = room;
        /* A block larger than a chunk goes behind the open chunk, which keeps being filled. */
        if (arena->chunks && bytes > CHUNK_BYTES) {
            c->next = arena->chunks->next;
            arena->chunks->next = c;
        } else {
            c->next = arena->chunks;
            arena->chunks = c;
        }
    }
    void *p = c->data + c->used;
    c->used += bytes;
    arena->bytes += bytes;
    return p;
}

char *pt_arena_strdup(struct pt_arena *arena, const char *text)
{
    const size_t bytes = strlen(text) + 1;
    char *copy = pt_arena_alloc(arena, bytes, 1);
    return copy ? memcpy(copy, text, bytes) : NULL;
}

void pt_arena_release(struct pt_arena *arena)
{
    for (struct pt_arena_chunk *c = arena->chunks; c != NULL;) {
        struct pt_arena_chunk *next = c->next;
        free(c);
        c = next;
    }
    *arena = (struct pt_arena){0};
}

int pt_grow(void **items, size_t *room, size_t count, size_t size)
{
    if (count < *room)
        return 1;
    size_t bigger = *room > 0 ? *room * 2 : 16;
    if (bigger > SIZE_MAX / size)
        return 0;
    void *grown = realloc(*items, bigger * size);
    if (!grown)
        return 0;
    *items = grown;
    *room = bigger;
    return 1;
}
