#include "plugin/text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

int32_t gp_fail(struct lull_error *err, int32_t code, const char *format, ...)
{
    if (err && LULL_HAS(struct lull_error, err, message)) {
        va_list args;

        err->code = code;
        va_start(args, format);
        vsnprintf(err->message, sizeof err->message, format, args);
        va_end(args);
    }
    return code;
}

int32_t gp_fail_from(struct lull_error *err, const char *what, const struct base_err *from)
{
    int32_t code = from->code == BASE_ENOMEM ? LULL_E_MEMORY : LULL_E_IO;

    return gp_fail(err, code, "%s: %.400s", what, from->text);
}

int gp_number(const char *text, double *out)
{
    double mantissa = 0, power = 0;
    int negative = *text == '-', digits = 0, point = 0;

    text += *text == '-' || *text == '+';
    for (;; text++) {
        if (*text == '.' && !point) {
            point = 1;
        } else if (*text >= '0' && *text <= '9' && digits < 300) {
            mantissa = 10 * mantissa + (*text - '0');
            power -= point;
            digits++;
        } else {
            break;
        }
    }
    if (!digits)
        return 0;
    if (*text == 'e' || *text == 'E') {
        double exponent = 0;
        int sign = text[1] == '-' ? -1 : 1, n = 0;

        text += 1 + (text[1] == '-' || text[1] == '+');
        for (; *text >= '0' && *text <= '9' && n < 4; text++, n++)
            exponent = 10 * exponent + (*text - '0');
        if (!n)
            return 0;
        power += sign * exponent;
    }
    /* Dividing by an exact power of ten rounds short numbers such as 0.05 correctly; multiplying by its inverse does not. */
    double value = power < 0 ? mantissa / pow(10, -power) : mantissa * pow(10, power);
    if (*text || !isfinite(value))
        return 0;
    *out = negative ? -value : value;
    return 1;
}

static int choice_index(const char *choices, const char *text)
{
    size_t length = strlen(text);

    for (int i = 0; choices; i++) {
        size_t n = strcspn(choices, "|");

        if (n == length && !memcmp(choices, text, n))
            return i;
        choices = choices[n] ? choices + n + 1 : NULL;
    }
    return -1;
}

int32_t gp_param(const struct lull_param *params, uint32_t count, const char *key, const char *text, double *value,
                 struct lull_error *err)
{
    for (uint32_t i = 0; i < count; i++) {
        const struct lull_param *p = &params[i];
        double min = p->type == LULL_PARAM_BOOL ? 0 : p->min, max = p->type == LULL_PARAM_BOOL ? 1 : p->max;

        if (strcmp(p->name, key))
            continue;
        if (p->type == LULL_PARAM_FILE || p->type == LULL_PARAM_TEXT)
            return (int32_t)i;
        if (p->type == LULL_PARAM_CHOICE) {
            int choice = choice_index(p->choices, text);
            if (choice < 0)
                return gp_fail(err, LULL_E_VALUE, "%s: '%.80s' is none of %s", p->name, text, p->choices);
            *value = choice;
            return (int32_t)i;
        }
        if (!gp_number(text, value) || (p->type != LULL_PARAM_FLOAT && *value != floor(*value)))
            return gp_fail(err, LULL_E_VALUE, "%s: '%.80s' is not %s", p->name, text,
                           p->type == LULL_PARAM_FLOAT ? "a number" : "an integer");
        if (*value < min || *value > max)
            return gp_fail(err, LULL_E_VALUE, "%s: %.80s is not in [%g, %g]", p->name, text, min, max);
        return (int32_t)i;
    }
    return gp_fail(err, LULL_E_KEY, "no parameter '%.80s'", key);
}
