#include "support/approve.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "support/foreign.h"

/* --- one line ------------------------------------------------------------------------------------------------------------- */

struct tolerance {
    int exact, all; /* to the byte; whole numbers may differ too */
    double relative, absolute;
    int shown; /* lines of an answer before the marks; -1: all */
};

static int read_tolerance(const char *line, struct tolerance *t)
{
    const char *shown = strstr(line, "; of each answer ");
    *t = (struct tolerance){.shown = -1};
    if (shown && sscanf(shown, "; of each answer %d lines and marks", &t->shown) != 1)
        return -1;
    t->exact = strncmp(line, "# exact", 7) == 0;
    t->all = strncmp(line, "# numbers ", 10) == 0;
    const char *format = t->all ? "# numbers within %lf of themselves + %lf" : "# decimals within %lf of themselves + %lf";
    return t->exact || sscanf(line, format, &t->relative, &t->absolute) == 2 ? 0 : -1;
}

struct number {
    double value, unit; /* unit: what a last bit may turn the last of three or more decimals by */
    int whole;
    const char *end;
};

/* Whether a number begins at p, which is not inside of a word. */
static int number_at(const char *text, const char *p)
{
    if (p > text && (isalnum((unsigned char)p[-1]) || p[-1] == '.' || p[-1] == '_'))
        return 0;
    p += *p == '-';
    return isdigit((unsigned char)*p) || (*p == '.' && isdigit((unsigned char)p[1]));
}

static struct number number_of(const char *p)
{
    char *end;
    struct number n = {.value = strtod(p, &end)};
    const char *point = p + (*p == '-');
    point += strspn(point, "0123456789");
    const size_t decimals = *point == '.' ? strspn(point + 1, "0123456789") : 0;
    n.unit = decimals >= 3 && point + 1 + decimals == end ? 1.01 * pow(10, -(double)decimals) : 0;
    n.whole = point == end;
    n.end = end;
    return n;
}

/* Blanks behind a number fill its column. */
static const char *behind(struct number n) { return n.end + strspn(n.end, " "); }

static int is_near(struct number a, struct number b, const struct tolerance *t)
{
    const double apart = fabs(a.value - b.value);
    if (a.whole && b.whole && !t->all)
        return apart == 0;
    return apart <= fmax(t->relative * fmax(fabs(a.value), fabs(b.value)) + t->absolute, fmax(a.unit, b.unit));
}

static int is_message(const char *line)
{
    return (line[0] == '-' && isdigit((unsigned char)line[1]) && line[2] == ':') || strstr(line, " warning: ");
}

/*
 * A mark stands for lines that nobody reads: how many, a checksum of their words, and the sum of w log(1 + |x| / 0.01) over their
 * numbers with weights w between 1 and 2, so that a change of any number by a share shows by that share. Rounding that is allowed
 * for each number adds up as a root of squares; of turned last digits two are allowed.
 */
static const char MARK[] = "[%d lines: words %x, %d numbers %lf ± %lf]";
static const double SMALL = 0.01, ROUNDED = 1e-5; /* of the sum itself */

static void write_mark(FILE *out, const char *lines, const char *end, int count, const struct tolerance *t)
{
    uint32_t words = 2166136261u; /* FNV-1a */
    double sum = 0, squares = 0, turned = 0;
    int numbers = 0;
    for (const char *p = lines; p < end;) {
        if (t->exact || !number_at(lines, p)) {
            words = (words ^ (unsigned char)*p++) * 16777619u;
            continue;
        }
        const struct number n = number_of(p);
        const double size = fabs(n.value), weight = 1 + fmod(0.6180339887498949 * numbers, 1);
        const double off = n.whole && !t->all ? 0 : weight * (t->relative * size + t->absolute) / (SMALL + size);
        sum += weight * copysign(log1p(size / SMALL), n.value);
        squares += off * off;
        turned = fmax(turned, weight * n.unit / (SMALL + size));
        numbers++;
        p = behind(n);
    }
    fprintf(out, "  [%d lines: words %08x, %d numbers %.6f ± %.6f]\n", count, words, numbers, sum,
            ROUNDED + 3 * sqrt(squares) + 2 * turned);
}

static int same_line(const char *a, const char *b, const struct tolerance *t)
{
    int lines[2], numbers[2];
    unsigned words[2];
    double sum[2], off[2];
    if (strcmp(a, b) == 0)
        return 1;
    if (sscanf(a, MARK, &lines[0], &words[0], &numbers[0], &sum[0], &off[0]) == 5 &&
        sscanf(b, MARK, &lines[1], &words[1], &numbers[1], &sum[1], &off[1]) == 5)
        return lines[0] == lines[1] && words[0] == words[1] && numbers[0] == numbers[1] && fabs(sum[0] - sum[1]) <= off[0];
    if (t->exact || is_message(a))
        return 0;
    const char *p = a, *q = b;
    while (*p && *q) {
        if (number_at(a, p) && number_at(b, q)) {
            const struct number x = number_of(p), y = number_of(q);
            if (!is_near(x, y, t))
                return 0;
            p = behind(x);
            q = behind(y);
        } else if (*p++ != *q++) {
            return 0;
        }
    }
    return *p == *q;
}

/* --- texts ---------------------------------------------------------------------------------------------------------------- */

static char *read_file(const char *path)
{
    FILE *f = fopen(path, "rb");
    long size = f && fseek(f, 0, SEEK_END) == 0 ? ftell(f) : -1;
    char *text = size >= 0 ? malloc((size_t)size + 1) : NULL;
    if (text) {
        rewind(f);
        text[fread(text, 1, (size_t)size, f)] = '\0';
    }
    if (f)
        fclose(f);
    return text;
}

static int write_file(const char *path, const char *first, const char *rest)
{
    FILE *f = fopen(path, "wb");
    if (!f)
        return -1;
    const int written = fputs(first, f) >= 0 && fputs(rest, f) >= 0;
    return fclose(f) == 0 && written ? 0 : -1;
}

static const char *next_line(const char *line)
{
    line += strcspn(line, "\n");
    return line + (*line == '\n');
}
static int is_answer(const char *line) { return strncmp(line, "  ", 2) == 0; }

/* The text with marks in the place of what is not shown. */
static char *folded(const char *text, const struct tolerance *t)
{
    enum { MARKED = 100 };
    char *made = NULL;
    size_t size;
    FILE *out = open_memstream(&made, &size);
    int seen = 0;
    for (const char *line = text; *line;) {
        const char *end = next_line(line);
        seen = is_answer(line) ? seen + 1 : 0;
        if (t->shown < 0 || seen <= t->shown) {
            fwrite(line, 1, (size_t)(end - line), out);
        } else {
            int count = 1;
            for (; is_answer(end) && count < MARKED; count++)
                end = next_line(end);
            write_mark(out, line, end, count, t);
        }
        line = end;
    }
    fclose(out);
    return made;
}

/* --- sections ------------------------------------------------------------------------------------------------------------- */

struct section {
    const char *head, *answer, *end;
};

static const char *section_at(const char *text, struct section *s)
{
    s->head = text;
    while (*text && !is_answer(text))
        text = next_line(text);
    s->answer = text;
    while (*text && is_answer(text))
        text = next_line(text);
    return s->end = text;
}

static int find_section(const char *text, const struct section *like, struct section *found)
{
    const size_t size = (size_t)(like->answer - like->head);
    while (*text) {
        text = section_at(text, found);
        if ((size_t)(found->answer - found->head) == size && memcmp(found->head, like->head, size) == 0)
            return 1;
    }
    return 0;
}

/* The last line of the heading. */
static void name_of(const struct section *s, char *name, size_t room)
{
    const char *last = s->head;
    for (const char *line = s->head; line < s->answer; line = next_line(line))
        last = line;
    last += strspn(last, "> ");
    snprintf(name, room, "%.*s", s->answer > last ? (int)strcspn(last, "\n") : 0, last);
}

/* The first lines that differ, malloc'ed, or NULL. */
static char *difference(const struct section *recorded, const struct section *now, const struct tolerance *t)
{
    enum { TOLD = 3 };
    char *made = NULL;
    size_t size;
    int line = 0, told = 0;
    FILE *out = open_memstream(&made, &size);
    const char *p = recorded->answer, *q = now->answer;
    for (; p < recorded->end || q < now->end; line++) {
        const char *p_end = p < recorded->end ? next_line(p) : p, *q_end = q < now->end ? next_line(q) : q;
        char *a = p_end > p ? strndup(p + 2, strcspn(p + 2, "\n")) : NULL,
             *b = q_end > q ? strndup(q + 2, strcspn(q + 2, "\n")) : NULL;
        if ((!a || !b || !same_line(a, b, t)) && told++ < TOLD)
            fprintf(out, "line %d  recorded: %s\n%*s  now:      %s\n", line + 1, a ? a : "(nothing)",
                    5 + snprintf(NULL, 0, "%d", line + 1), "", b ? b : "(nothing)");
        free(a);
        free(b);
        p = p_end;
        q = q_end;
    }
    fclose(out);
    if (told > 0)
        return made;
    free(made);
    return NULL;
}

static int compare(const char *recorded, const char *text, const struct tolerance *t, approve_report *report, void *user)
{
    int differ = 0;
    struct section was, now;
    char name[200];
    for (const char *at = recorded; *at;) {
        at = section_at(at, &was);
        const int found = find_section(text, &was, &now);
        char *told = found ? difference(&was, &now, t) : strdup("this is recorded, and not there\n");
        name_of(&was, name, sizeof name);
        report(user, name, told);
        differ += told != NULL;
        free(told);
    }
    for (const char *at = text; *at;) {
        at = section_at(at, &now);
        if (find_section(recorded, &now, &was))
            continue;
        name_of(&now, name, sizeof name);
        report(user, name, "nothing is recorded under this name\n");
        differ++;
    }
    return differ;
}

/* Where somebody finds the whole of a text, marks and all. */
static void keep_whole(const char *path, const char *text)
{
    char kept[512];
    const char *build = getenv("BUILD"), *base = strrchr(path, '/');
    snprintf(kept, sizeof kept, "%s/approve", build ? build : "build");
    mkdir(kept, 0777);
    snprintf(kept, sizeof kept, "%s/approve/%s", build ? build : "build", base ? base + 1 : path);
    if (write_file(kept, "", text) == 0)
        fprintf(stderr, "# the whole text: %s\n", kept);
}

int approve(const char *path, const char *text, approve_report *report, void *user)
{
    struct tolerance t;
    char *recorded = read_file(path), why[600], first[200];
    if (!recorded || read_tolerance(recorded, &t) != 0) {
        snprintf(why, sizeof why, "%s: no record that begins with its tolerance (support/approve.h)\n", path);
        report(user, NULL, why);
        free(recorded);
        return -1;
    }
    snprintf(first, sizeof first, "%.*s\n", (int)strcspn(recorded, "\n"), recorded);
    char *whole = foreign_as_recorded(text), *now = folded(whole, &t);
    int differ = 0;
    if (getenv("RECORD") && (differ = write_file(path, first, now)) != 0)
        report(user, NULL, "the record cannot be written\n");
    else
        differ = compare(getenv("RECORD") ? now : next_line(recorded), now, &t, report, user);
    if (differ || getenv("WHOLE"))
        keep_whole(path, whole);
    free(now);
    free(whole);
    free(recorded);
    return differ;
}

/* --- in cmocka ------------------------------------------------------------------------------------------------------------ */

static void print_difference(void *user, const char *section, const char *difference)
{
    (void)user;
    if (difference)
        print_error("%s\n%s", section ? section : "", difference);
}

static void approve_made(const char *path, char *made)
{
    const int differ = approve(path, made, print_difference, NULL);
    free(made);
    if (differ != 0)
        fail_msg("%s: %d sections differ", path, differ);
}

static void write_answer(FILE *out, const char *text)
{
    for (const char *end; *text; text = end) {
        end = next_line(text);
        fprintf(out, "  %.*s\n", (int)strcspn(text, "\n"), text);
    }
}

void approve_text(const char *path, const char *text)
{
    char *made = NULL;
    size_t size;
    FILE *out = open_memstream(&made, &size);
    assert_non_null(out);
    for (const char *line = text; *line; line = next_line(line))
        fprintf(out, "%s%.*s\n", line[0] == '>' ? "" : "  ", (int)strcspn(line, "\n"), line);
    fclose(out);
    approve_made(path, made);
}

/* --- cases ---------------------------------------------------------------------------------------------------------------- */

static void append(char *text, size_t room, const char *line)
{
    size_t n = strlen(text), k = strlen(line);
    int open = k >= 2 && strcmp(line + k - 2, "\\c") == 0;
    assert_true(n + k + 2 < room);
    snprintf(text + n, room - n, "%.*s%s", (int)(open ? k - 2 : k), line, open ? "" : "\n");
}

static void add_file_line(struct approve_case *c, const char *line)
{
    size_t n = strcspn(line, " ");
    int i = 0;
    while (c->files[i].name[0] != '\0' && (strlen(c->files[i].name) != n || strncmp(c->files[i].name, line, n) != 0))
        assert_true(++i < APPROVE_FILES);
    snprintf(c->files[i].name, sizeof c->files[i].name, "%.*s", (int)n, line);
    append(c->files[i].text, APPROVE_TEXT, line[n] == ' ' ? line + n + 1 : "");
}

static void read_case_line(struct approve_case *c, const char *line)
{
    if (line[0] == '>')
        append(c->text, APPROVE_TEXT, line + (line[1] == '>' ? 3 : 2));
    else if (line[0] == '=')
        snprintf(c->options, sizeof c->options, "%.*s", (int)sizeof c->options - 1, line);
    else if (line[0] == '@')
        add_file_line(c, line + 2);
}

static void ask(struct approve_case *c, approve_answer *answer, FILE *out)
{
    char *told = answer(c);
    write_answer(out, told);
    free(told);
    memset(c, 0, sizeof *c);
}

void approve_cases(const char *path, approve_answer *answer)
{
    static struct approve_case c;
    char *recorded = read_file(path), *made = NULL;
    size_t size;
    FILE *out = open_memstream(&made, &size);
    assert_non_null(out);
    if (!recorded)
        fail_msg("%s cannot be read", path);
    memset(&c, 0, sizeof c);
    for (const char *at = next_line(recorded); *at; at = next_line(at)) {
        char line[4096];
        if (c.text[0] != '\0' && strncmp(at, ">>", 2) != 0)
            ask(&c, answer, out);
        if (is_answer(at))
            continue;
        assert_true(strcspn(at, "\n") < sizeof line);
        snprintf(line, sizeof line, "%.*s", (int)strcspn(at, "\n"), at);
        read_case_line(&c, line);
        fprintf(out, "%s\n", line);
    }
    if (c.text[0] != '\0')
        ask(&c, answer, out);
    fclose(out);
    free(recorded);
    approve_made(path, made);
}
