/* The door to support/approve.h for scripts: compares standard input, in the form of a record's text, with a record. Speaks TAP.
 *
 * usage: approve RECORD FIRST <TEXT      FIRST: the number of the first line of TAP; exit status 1 if a section differs
 */
#include <stdio.h>
#include <stdlib.h>

#include "support/approve.h"

static int number;

static void report(void *user, const char *section, const char *difference)
{
    const char *record = user;
    printf("%s %d - %s: %s\n", difference ? "not ok" : "ok", number++, record, section ? section : "the record");
    for (const char *p = difference; p && *p; p++) {
        if (p == difference || p[-1] == '\n')
            fputs("# ", stdout);
        putchar(*p);
    }
}

int main(int argc, char **argv)
{
    char *text = NULL;
    size_t size;
    FILE *made = open_memstream(&text, &size);
    if (argc != 3 || !made)
        return 2;
    for (int c; (c = getchar()) != EOF;)
        putc(c, made);
    fclose(made);
    number = atoi(argv[2]);
    const int differ = approve(argv[1], text, report, argv[1]);
    free(text);
    return differ != 0;
}
