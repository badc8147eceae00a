#include "observer/trials.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/text.h"

enum { TRIAL_BLOCKS = 256 };

struct trial {
    int block, seen;
    double log2_spp;
};

/* Lines that are no trial (two that ran into one another, level 0) are left out and counted. */
static int parse_trials(const char *path, char *text, struct trial **out, int *count, int *skipped, struct base_err *err)
{
    size_t room = 1;
    for (const char *p = text; *p != '\0'; p++)
        room += *p == '\n';
    struct trial *t = malloc(room * sizeof *t);
    int n = 0;
    *skipped = 0;
    if (!t)
        return base_fail_nomem(err, path);
    for (char *line = text + base_utf8_mark(text, strlen(text)), *next; line && *line != '\0'; line = next) {
        char *end = line;
        next = strchr(line, '\n');
        if (next)
            *next++ = '\0';
        double block = strtod(line, &end), level = *end == ';' ? strtod(end + 1, &end) : -1.0,
               seen = *end == ';' ? strtod(end + 1, &end) : -1.0;
        if (!(block >= 0 && block < TRIAL_BLOCKS) || !(level > 0 && level < 1e6) || (seen != 0.0 && seen != 1.0) ||
            end[strspn(end, "\r \t")] != '\0')
            ++*skipped;
        else
            t[n++] = (struct trial){(int)block, seen == 1.0, log2(20.0 * level)};
    }
    *out = t;
    *count = n;
    return 0;
}

/* Log-likelihood of one block's trials for threshold x (log2) and spread s. A lapse rate of 2 %: no slip rules. */
static double likelihood(const struct trial *t, int n, int block, double x, double s)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        if (t[i].block == block) {
            double p = 0.01 + 0.98 * 0.5 * erfc((t[i].log2_spp - x) / (s * sqrt(2.0)));
            sum += log(t[i].seen ? p : 1.0 - p);
        }
    return sum;
}

int ggn_trials_spread(const char *path, double *spread, int *blocks, int *trials, int *skipped, struct base_err *err)
{
    char *text;
    size_t size;
    struct trial *t = NULL;
    int n = 0, present[TRIAL_BLOCKS] = {0};
    int rc = base_file_read(path, 1 << 26, &text, &size, err);
    if (rc)
        return rc;
    rc = parse_trials(path, text, &t, &n, skipped, err);
    free(text);
    if (rc)
        return rc;
    *blocks = 0;
    for (int i = 0; i < n; i++)
        *blocks += present[t[i].block]++ == 0;
    double best = -INFINITY;
    for (double s = 0.05; s < 3.0; s *= 1.05) {
        double sum = 0.0;
        for (int b = 0; b < TRIAL_BLOCKS; b++) {
            double most = -INFINITY;
            for (double x = 4.0; present[b] > 0 && x <= 14.0; x += 0.05)
                most = fmax(most, likelihood(t, n, b, x, s));
            sum += present[b] > 0 ? most : 0.0;
        }
        if (sum > best) {
            best = sum;
            *spread = s;
        }
    }
    free(t);
    *trials = n;
    return n > 0 ? 0 : base_fail(err, BASE_EINVAL, "%s: no trials in it", path);
}
