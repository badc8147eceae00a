/*
 * Bump allocator with one lifetime: a scene's data is allocated from one arena and released together.
 * Not thread-safe. Memory is zeroed and aligned to 16 bytes.
 */
#ifndef PT_SCENE_ARENA_H
#define PT_SCENE_ARENA_H

#include <stddef.h>

struct pt_arena_chunk;
struct pt_arena {
    struct pt_arena_chunk *chunks; /* owns */
    size_t bytes;                  /* handed out in total */
};

/* NULL when out of memory, when count * size overflows, or when either is 0. The arena owns the block until release. */
void *pt_arena_alloc(struct pt_arena *arena, size_t count, size_t size);
/* A copy; NULL when out of memory. */
char *pt_arena_strdup(struct pt_arena *arena, const char *text);
void pt_arena_release(struct pt_arena *arena);

/* Makes room for one more item in a malloc'ed array; 0 when out of memory, *items then as before. */
int pt_grow(void **items, size_t *room, size_t count, size_t size);

#endif
