#include "pbrt/names.h"

#include <stdlib.h>
#include <string.h>

#include "base/err.h"

/* FNV-1a, Fowler, Noll and Vo. */
static uint32_t hash_of(const char *name)
{
    uint32_t h = 2166136261u;
    for (const unsigned char *c = (const unsigned char *)name; *c != '\0'; c++)
        h = (h ^ *c) * 16777619u;
    return h;
}

static struct pt_names_entry *slot_of(struct pt_names_entry *entries, size_t room, const char *name, uint32_t hash)
{
    size_t i = hash & (room - 1);
    while (entries[i].name && (entries[i].hash != hash || strcmp(entries[i].name, name) != 0))
        i = (i + 1) & (room - 1);
    return &entries[i];
}

int32_t pt_names_get(const struct pt_names *names, const char *name)
{
    if (names->room == 0)
        return -1;
    const struct pt_names_entry *e = slot_of(names->entries, names->room, name, hash_of(name));
    return e->name ? e->value : -1;
}

static int grow(struct pt_names *names)
{
    size_t room = names->room > 0 ? names->room * 2 : 32;
    struct pt_names_entry *entries = calloc(room, sizeof *entries);
    if (!entries)
        return BASE_ENOMEM;
    for (size_t i = 0; i < names->room; i++)
        if (names->entries[i].name)
            *slot_of(entries, room, names->entries[i].name, names->entries[i].hash) = names->entries[i];
    free(names->entries);
    names->entries = entries;
    names->room = room;
    return 0;
}

int pt_names_set(struct pt_names *names, const char *name, int32_t value)
{
    uint32_t hash = hash_of(name);
    struct pt_names_entry *e = names->room > 0 ? slot_of(names->entries, names->room, name, hash) : NULL;
    if (e && e->name) {
        e->value = value;
        return 0;
    }
    if ((names->count + 1) * 4 > names->room * 3 && grow(names) != 0)
        return BASE_ENOMEM;
    char *copy = strdup(name);
    if (!copy)
        return BASE_ENOMEM;
    *slot_of(names->entries, names->room, name, hash) = (struct pt_names_entry){copy, hash, value};
    names->count++;
    return 0;
}

void pt_names_release(struct pt_names *names)
{
    for (size_t i = 0; i < names->room; i++)
        free(names->entries[i].name);
    free(names->entries);
    *names = (struct pt_names){0};
}
