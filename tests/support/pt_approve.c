#include "support/pt_approve.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/files.h"
#include "support/base_foreign.h"

static const double relative = 1e-5, absolute = 3e-7;

/* A unit of the last digit of a decimal number that ends at `end`, which a last bit may turn; 0 for one of few digits. */
static double last_digit(const char *number, const char *end)
{
    const char *point = memchr(number, '.', (size_t)(end - number));
    const long decimals = point ? (long)strspn(point + 1, "0123456789") : 0;
    return decimals >= 3 && point + 1 + decimals == end ? 1.01 * pow(10, (double)-decimals) : 0;
}

int pt_approve_same(const char *a, const char *b)
{
    while (*a != '\0' && *b != '\0') {
        int numbers = (isdigit((unsigned char)*a) || (*a == '-' && isdigit((unsigned char)a[1]))) &&
                      (isdigit((unsigned char)*b) || (*b == '-' && isdigit((unsigned char)b[1])));
        if (numbers) {
            char *x, *y;
            double p = strtod(a, &x), q = strtod(b, &y);
            int whole = strspn(a, "-0123456789") == (size_t)(x - a) && strspn(b, "-0123456789") == (size_t)(y - b);
            double near = fmax(relative * fmax(fabs(p), fabs(q)) + absolute, fmax(last_digit(a, x), last_digit(b, y)));
            if (p != q && (whole || !(fabs(p - q) <= near)))
                return 0;
            a = x;
            b = y;
        } else if (*a++ != *b++) {
            return 0;
        }
    }
    return *a == *b;
}

/* Errors ("-1: …") and warnings are compared word for word. */
static int is_message(const char *line)
{
    return (line[0] == '-' && isdigit((unsigned char)line[1]) && line[2] == ':') || strstr(line, " warning: ");
}

static void append(char *text, size_t room, const char *line)
{
    size_t n = strlen(text), k = strlen(line);
    int open = k >= 2 && strcmp(line + k - 2, "\\c") == 0;
    assert_true(n + k + 2 < room);
    snprintf(text + n, room - n, "%.*s%s", (int)(open ? k - 2 : k), line, open ? "" : "\n");
}

static void add_file_line(struct pt_approve_case *c, const char *line)
{
    size_t n = strcspn(line, " ");
    int i = 0;
    while (c->files[i].name[0] != '\0' && (strlen(c->files[i].name) != n || strncmp(c->files[i].name, line, n) != 0))
        assert_true(++i < PT_APPROVE_FILES);
    snprintf(c->files[i].name, sizeof c->files[i].name, "%.*s", (int)n, line);
    append(c->files[i].text, PT_APPROVE_TEXT, line[n] == ' ' ? line + n + 1 : "");
}

/* Compares line by line with the recorded answer from `recorded` on; returns behind it. In `anew` goes the new one. */
static char *compare(struct pt_approve_case *c, pt_approve_answer *answer, char *recorded, FILE *anew, int *wrong)
{
    char *told_here = answer(c), *text = foreign_as_recorded(told_here), *save = NULL, *line = strtok_r(text, "\n", &save);
    int told = 0;
    for (; line || strncmp(recorded, "  ", 2) == 0; line = line ? strtok_r(NULL, "\n", &save) : NULL) {
        char expected[4096] = "";
        if (strncmp(recorded, "  ", 2) == 0) {
            size_t n = strcspn(recorded, "\n");
            snprintf(expected, sizeof expected, "%.*s", (int)n - 2, recorded + 2);
            recorded += n + (recorded[n] == '\n');
        }
        if (line)
            fprintf(anew, "  %s\n", line);
        if (is_message(expected) ? line && strcmp(expected, line) == 0 : pt_approve_same(expected, line ? line : ""))
            continue;
        *wrong += 1;
        if (told++ == 0)
            print_error("of %s  recorded: %s\n  now:      %s\n", c->text, expected, line ? line : "");
    }
    free(told_here);
    free(text);
    memset(c, 0, sizeof *c);
    return recorded;
}

void pt_approve(const char *path, pt_approve_answer *answer)
{
    static struct pt_approve_case c;
    char *bytes, *made = NULL;
    size_t size, made_size;
    int wrong = 0;
    struct base_err err = {0};
    assert_int_equal(base_file_read(path, 1 << 24, &bytes, &size, &err), 0);
    FILE *anew = open_memstream(&made, &made_size);
    assert_non_null(anew);
    memset(&c, 0, sizeof c);
    for (char *at = bytes; *at != '\0';) {
        char line[4096];
        size_t n = strcspn(at, "\n");
        snprintf(line, sizeof line, "%.*s", (int)n, at);
        if (c.text[0] != '\0' && strncmp(line, ">>", 2) != 0) {
            at = compare(&c, answer, at, anew, &wrong);
            continue;
        }
        assert_true(n < sizeof line && strncmp(line, "  ", 2) != 0);
        if (line[0] == '>')
            append(c.text, PT_APPROVE_TEXT, line + (line[1] == '>' ? 3 : 2));
        else if (line[0] == '=')
            snprintf(c.options, sizeof c.options, "%.*s", (int)sizeof c.options - 1, line);
        else if (line[0] == '@')
            add_file_line(&c, line + 2);
        fprintf(anew, "%s\n", line);
        at += n + (at[n] == '\n');
    }
    if (c.text[0] != '\0')
        compare(&c, answer, bytes + size, anew, &wrong);
    fclose(anew);
    if (getenv("RECORD")) {
        FILE *f = fopen(path, "w");
        assert_true(f && fputs(made, f) >= 0 && fclose(f) == 0);
    } else if (wrong > 0) {
        fail_msg("%s: %d lines differ", path, wrong);
    }
    free(made);
    free(bytes);
}
