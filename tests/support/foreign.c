#include "support/foreign.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    int code;
    const char *recorded; /* GNU */
} errors[] = {{ENOENT, "No such file or directory"},
              {EACCES, "Permission denied"},
              {ENOTDIR, "Not a directory"},
              {EISDIR, "Is a directory"},
              {EEXIST, "File exists"},
              {ENOSPC, "No space left on device"},
              {ENOTEMPTY, "Directory not empty"}};

static char *with(const char *text, const char *from, const char *to)
{
    char *made = NULL;
    size_t size = 0;
    FILE *f = open_memstream(&made, &size);
    assert(f);
    for (const char *at; (at = strstr(text, from)) != NULL; text = at + strlen(from))
        fprintf(f, "%.*s%s", (int)(at - text), text, to);
    fputs(text, f);
    fclose(f);
    return made;
}

char *foreign_as_recorded(const char *text)
{
    char *now = strdup(text);
    for (size_t i = 0; now && i < sizeof errors / sizeof errors[0]; i++) {
        char *next = with(now, strerror(errors[i].code), errors[i].recorded);
        free(now);
        now = next;
    }
    char *told =
        now ? with(now, "file is encrypted or is not a database", "file is not a database") : NULL; /* SQLite's words */
    free(now);
    return told;
}
