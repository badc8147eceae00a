#include "pbrt/lexer.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"
#include "base/text.h"

int pt_lexer_include(struct pt_lexer *lexer, const char *path, struct pt_loc from, int scoped)
{
    if (lexer->depth >= PT_LEXER_DEPTH)
        return pt_diag_fail(lexer->diag, from, "files include each other more than %d levels deep", PT_LEXER_DEPTH);
    for (int i = 0; i < lexer->depth; i++)
        if (strcmp(lexer->stack[i].loc.file, path) == 0)
            return pt_diag_fail(lexer->diag, from, "\"%s\" includes itself", path);
    struct pt_lexer_file file = {.scoped = scoped};
    struct base_err err = {0};
    size_t size = 0;
    int rc = lexer->source->read(lexer->source->data, path, &file.bytes, &size, &err);
    if (rc && from.line == 0)
        return pt_diag_fail_code(lexer->diag, rc, from, "%s", err.text);
    if (rc)
        return pt_diag_fail_read(lexer->diag, from, &err);
    file.loc = (struct pt_loc){pt_arena_strdup(lexer->arena, path), 1, 1};
    if (!file.loc.file) {
        free(file.bytes);
        return pt_diag_nomem(lexer->diag, "file names");
    }
    if (size >= 2 && (memcmp(file.bytes, "\xff\xfe", 2) == 0 || memcmp(file.bytes, "\xfe\xff", 2) == 0)) {
        free(file.bytes);
        return pt_diag_fail(lexer->diag, file.loc, "the text is UTF-16 (expected UTF-8)");
    }
    file.at = file.line_start = file.bytes + base_utf8_mark(file.bytes, size);
    file.end = file.bytes + size;
    lexer->stack[lexer->depth++] = file;
    return 0;
}

static void skip_blanks(struct pt_lexer_file *f)
{
    char *at = f->at, *end = f->end;
    while (at < end) {
        char c = *at;
        if (c == '\n' || (c == '\r' && at[1] != '\n')) { /* at[1]: the bytes end in a NUL */
            f->loc.line++;
            f->line_start = ++at;
        } else if (c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f') {
            at++;
        } else if (c == '#') {
            while (at < end && *at != '\n' && *at != '\r')
                at++;
        } else {
            break;
        }
    }
    f->at = at;
}

/* f->at is behind the opening quote. Escapes are resolved in place. The token stays bad after a failure. */
static int read_string(struct pt_lexer *lexer, struct pt_lexer_file *f, struct pt_token *t)
{
    char *out = f->at, *start = f->at;
    for (; f->at < f->end && *f->at != '"' && *f->at != '\n' && *f->at != '\r'; f->at++) {
        char c = *f->at;
        if (c == '\\' && f->at + 1 < f->end) {
            c = *++f->at;
            static const char letters[] = "nrtbf\\'\"", meanings[] = "\n\r\t\b\f\\'\"";
            const char *known = memchr(letters, c, sizeof letters - 1);
            if (!known)
                return pt_diag_fail(lexer->diag, t->loc, "unknown escape \\%c in a string", c);
            c = meanings[known - letters];
        }
        if (c == '\0')
            return pt_diag_fail(lexer->diag, t->loc, "a zero byte in a string");
        *out++ = c;
    }
    if (f->at >= f->end || *f->at != '"')
        return pt_diag_fail(lexer->diag, t->loc, "string without a closing quote on its line");
    f->at++;
    *out = '\0'; /* at the latest where the quote was */
    t->kind = PT_TOKEN_STRING;
    t->text = start;
    t->length = (size_t)(out - start);
    return 0;
}

static int ends_word(char c)
{
    return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\v' || c == '\f' || c == '[' || c == ']' || c == '"' ||
           c == '#';
}

/* The end of an included file is no token of its own, unless scoped: a parameter list may go on in the including file. */
static struct pt_token read_token(struct pt_lexer *lexer)
{
    for (;;) {
        struct pt_lexer_file *f = &lexer->stack[lexer->depth - 1];
        skip_blanks(f);
        struct pt_token t = {.kind = PT_TOKEN_END, .text = "", .loc = f->loc};
        t.loc.column = (int32_t)(f->at - f->line_start) + 1;
        if (f->at == f->end) {
            if (lexer->depth == 1)
                return t;
            /* The end of an imported file is a token, since its graphics state ends there. */
            int scoped = f->scoped;
            free(f->bytes);
            lexer->depth--;
            t.kind = PT_TOKEN_FILE_END;
            if (scoped)
                return t;
            continue;
        }
        char c = *f->at;
        if (c == '[' || c == ']') {
            t.kind = c == '[' ? PT_TOKEN_OPEN : PT_TOKEN_CLOSE;
            t.text = f->at++;
            t.length = 1;
            return t;
        }
        if (c == '"') {
            f->at++;
            t.kind = PT_TOKEN_BAD;
            read_string(lexer, f, &t);
            return t;
        }
        t.kind = PT_TOKEN_WORD;
        t.text = f->at;
        while (f->at < f->end && !ends_word(*f->at))
            f->at++;
        t.length = (size_t)(f->at - t.text);
        return t;
    }
}

struct pt_token pt_lexer_next(struct pt_lexer *lexer)
{
    struct pt_token t = lexer->has_ahead ? lexer->ahead : read_token(lexer);
    lexer->has_ahead = 0;
    lexer->before = lexer->taken;
    lexer->taken = t.loc;
    return t;
}

struct pt_token pt_lexer_peek(struct pt_lexer *lexer)
{
    if (!lexer->has_ahead) {
        lexer->ahead = read_token(lexer);
        lexer->has_ahead = 1;
    }
    return lexer->ahead;
}

int pt_lexer_has_ended(const struct pt_lexer *lexer, const struct pt_token *token)
{
    return token->kind == PT_TOKEN_END || token->kind == PT_TOKEN_FILE_END ||
           (token->kind == PT_TOKEN_WORD && lexer->is_directive && lexer->is_directive(token));
}

struct pt_loc pt_lexer_fault(const struct pt_lexer *lexer, const struct pt_token *token)
{
    return pt_lexer_has_ended(lexer, token) && lexer->before.file ? lexer->before : token->loc;
}

void pt_lexer_release(struct pt_lexer *lexer)
{
    while (lexer->depth > 0)
        free(lexer->stack[--lexer->depth].bytes);
}

/* Powers of ten that are exact in double. */
static const double exact_pow10[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                     1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

struct decimal {
    uint64_t mantissa;   /* the first 19 significant digits */
    int exponent;        /* value = mantissa · 10^exponent */
    int negative, exact; /* exact: no digit was dropped */
};

static int is_digit(char c) { return c >= '0' && c <= '9'; }

/* 1 when text[0, n) is a decimal number and nothing else. */
static int scan(const char *text, size_t n, struct decimal *d)
{
    size_t i = 0;
    int digits = 0, significant = 0, point = 0;
    *d = (struct decimal){.exact = 1};
    if (i < n && (text[i] == '-' || text[i] == '+'))
        d->negative = text[i++] == '-';
    for (; i < n && (is_digit(text[i]) || (text[i] == '.' && !point)); i++) {
        if (text[i] == '.') {
            point = 1;
            continue;
        }
        digits++;
        /* so many fit into 64 bits; the others only move the point */
        if (significant < 19) {
            d->mantissa = d->mantissa * 10 + (uint64_t)(text[i] - '0');
            significant += d->mantissa > 0;
            d->exponent -= point;
        } else {
            d->exact &= text[i] == '0';
            d->exponent += !point;
        }
    }
    if (digits == 0)
        return 0;
    if (i < n && (text[i] == 'e' || text[i] == 'E')) {
        int sign = 1, value = 0, exponent_digits = 0;
        i++;
        if (i < n && (text[i] == '-' || text[i] == '+'))
            sign = text[i++] == '-' ? -1 : 1;
        for (; i < n && is_digit(text[i]); i++, exponent_digits++)
            value = value < 100000 ? value * 10 + (text[i] - '0') : value;
        if (exponent_digits == 0)
            return 0;
        d->exponent += sign * value;
    }
    return i == n;
}

/* The rare long or extreme ones: the C library, with the C locale whatever the process has. */
static int parse_slowly(const char *text, size_t n, double *out)
{
    char buffer[512];
    if (n >= sizeof buffer)
        return 0;
    memcpy(buffer, text, n);
    buffer[n] = '\0';
    char *point = strchr(buffer, '.');
    const struct lconv *conv = localeconv();
    if (point && conv->decimal_point[0] != '\0' && conv->decimal_point[1] == '\0')
        *point = conv->decimal_point[0];
    *out = strtod(buffer, NULL);
    return isfinite(*out);
}

int pt_number_parse(const char *text, size_t n, double *out)
{
    struct decimal d;
    if (!scan(text, n, &d))
        return 0;
    /* Both factors exact in double, one rounding: Clinger 1990, "How to read floating point numbers accurately". */
    if (d.exact && d.mantissa <= (1ull << 53) && d.exponent >= -22 && d.exponent <= 22) {
        double v = (double)d.mantissa;
        v = d.exponent < 0 ? v / exact_pow10[-d.exponent] : v * exact_pow10[d.exponent];
        *out = d.negative ? -v : v;
        return 1;
    }
    return parse_slowly(text, n, out);
}

int pt_lexer_string(struct pt_lexer *lexer, const char *what, char *out, size_t room)
{
    struct pt_token t = pt_lexer_next(lexer);
    if (t.kind == PT_TOKEN_BAD)
        return lexer->diag->rc;
    int bracket = t.kind == PT_TOKEN_OPEN;
    if (bracket)
        t = pt_lexer_next(lexer);
    if (t.kind != PT_TOKEN_STRING)
        return pt_diag_fail(lexer->diag, pt_lexer_fault(lexer, &t), "expected a quoted %s", what);
    if (t.length >= room)
        return pt_diag_fail(lexer->diag, t.loc, "%s of %zu characters (expected less than %zu)", what, t.length, room);
    strcpy(out, t.text);
    if (bracket && (t = pt_lexer_next(lexer)).kind != PT_TOKEN_CLOSE)
        return pt_diag_fail(lexer->diag, pt_lexer_fault(lexer, &t), "expected ] after the %s", what);
    return lexer->diag->rc;
}

int pt_lexer_numbers(struct pt_lexer *lexer, const char *what, int count, double *out)
{
    struct pt_token t;
    int bracket = pt_lexer_peek(lexer).kind == PT_TOKEN_OPEN;
    if (bracket)
        pt_lexer_next(lexer);
    for (int i = 0; i < count; i++) {
        t = pt_lexer_next(lexer);
        if (t.kind == PT_TOKEN_BAD)
            return lexer->diag->rc;
        if (pt_lexer_has_ended(lexer, &t))
            return pt_diag_fail(lexer->diag, pt_lexer_fault(lexer, &t), "%s has %d numbers (expected %d)", what, i, count);
        if (t.kind != PT_TOKEN_WORD || !pt_number_parse(t.text, t.length, &out[i]))
            return pt_diag_fail(lexer->diag, t.loc, "%s: \"%.*s\" (expected %d numbers)", what,
                                t.length < 40 ? (int)t.length : 40, t.text, count);
    }
    if (bracket && (t = pt_lexer_next(lexer)).kind != PT_TOKEN_CLOSE)
        return pt_diag_fail(lexer->diag, pt_lexer_fault(lexer, &t), "%s: expected ] after %d numbers", what, count);
    return 0;
}

int pt_lexer_option(struct pt_lexer *lexer, const char *name, uint32_t *value)
{
    struct pt_token t = pt_lexer_next(lexer);
    double number = -1;
    if (t.kind == PT_TOKEN_BAD)
        return lexer->diag->rc;
    int is_number = t.kind == PT_TOKEN_WORD && pt_number_parse(t.text, t.length, &number);
    if (value && is_number && number >= 0 && number <= INT32_MAX && number == floor(number)) {
        *value = (uint32_t)number;
        return 0;
    }
    static const char *const words[] = {"true", "false", NULL};
    if (!value && (is_number || t.kind == PT_TOKEN_STRING ||
                   (t.kind == PT_TOKEN_WORD && base_word_index(words, t.text, t.length) >= 0)))
        return 0;
    if (t.kind == PT_TOKEN_OPEN || t.kind == PT_TOKEN_CLOSE || pt_lexer_has_ended(lexer, &t))
        return pt_diag_fail(lexer->diag, pt_lexer_fault(lexer, &t), "Option \"%.40s\" has no value", name);
    return pt_diag_fail(lexer->diag, t.loc, "Option \"%.40s\" is \"%.*s\" (expected %s)", name,
                        t.length < 40 ? (int)t.length : 40, t.text,
                        value ? "a whole number from 0 to 2147483647" : "a number, true, false or a string");
}
