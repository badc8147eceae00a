/* `ggn compare REFERENCE MODEL`: stop maps against (human) thresholds. */
#include <argp.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "cli/commands.h"
#include "base/files.h"
#include "eval/compare.h"

struct options {
    const char *paths[2];
    const char *dir, *view;
    double cap;
    int block, json;
};

static const struct argp_option option_table[] = {
    {"json", 'j', NULL, 0, "print the statistics as one JSON object", 0},
    {"output", 'o', "DIR", 0, "write scatter.png, errors.png, heatmaps.png, blocks.csv and summary.json there", 0},
    {"view", 'v', "NAME", 0, "compare with this view of REFERENCE only", 0},
    {"cap", 'c', "SPP", 0, "thresholds at the cap are censored (default 10000)", 0},
    {"block", 'b', "PIXELS", 0, "side of a block in an EXR stop map (default 200)", 0},
    {0},
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct options *o = state->input;
    char *end;
    double number = arg ? strtod(arg, &end) : 0.0;

    switch (key) {
    case 'j':
        o->json = 1;
        return 0;
    case 'o':
        o->dir = arg;
        return 0;
    case 'v':
        o->view = arg;
        return 0;
    case 'c':
        if (*end != '\0' || !(number > 0.0))
            argp_error(state, "--cap %s: expected a positive number", arg);
        o->cap = number;
        return 0;
    case 'b':
        if (*end != '\0' || !(number >= 1.0 && number <= 32768.0))
            argp_error(state, "--block %s: expected 1 … 32768", arg);
        o->block = (int)number;
        return 0;
    case ARGP_KEY_ARG:
        if (state->arg_num >= 2)
            return ARGP_ERR_UNKNOWN;
        o->paths[state->arg_num] = arg;
        return 0;
    case ARGP_KEY_END:
        if (state->arg_num < 2)
            argp_error(state, "REFERENCE and MODEL are needed");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int write_outputs(const struct options *o, const struct ggn_pairing *p, const struct ggn_agreement *a, struct base_err *err)
{
    char path[4096];
    struct base_file_out out;
    if (mkdir(o->dir, 0777) != 0 && errno != EEXIST)
        return base_fail(err, BASE_EIO, "%s: %s", o->dir, strerror(errno));
    const char *names[2];
    for (int i = 0; i < 2; i++) {
        const char *slash = strrchr(o->paths[i], '/');
        names[i] = slash ? slash + 1 : o->paths[i];
    }
    int rc = ggn_compare_pictures(o->dir, p, names[0], names[1], err);
    snprintf(path, sizeof path, "%s/summary.json", o->dir);
    if (!rc)
        rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    ggn_agreement_print_json(out.file, a);
    putc('\n', out.file);
    return base_file_commit(&out, err);
}

int ggn_cmd_compare(int argc, char **argv)
{
    static const struct argp argp = {
        .options = option_table,
        .parser = parse,
        .args_doc = "REFERENCE MODEL",
        .doc = "How well the stops or thresholds in MODEL agree with those in REFERENCE (people first). Both may be CSV "
               "(name;t0;…), a render's report JSON, or an EXR with the channel lull.spp.",
    };
    struct options o = {.cap = 10000.0, .block = 200};
    struct ggn_thresholds sides[2] = {{0}, {0}};
    struct ggn_pairing pairing = {0};
    struct ggn_agreement figures;
    struct base_err err = {0};

    argp_parse(&argp, argc, argv, 0, NULL, &o);
    int rc = 0;
    for (int i = 0; i < 2 && !rc; i++)
        rc = ggn_thresholds_read(o.paths[i], o.block, &sides[i], &err);
    if (!rc)
        rc = ggn_pairing_init(&pairing, &sides[0], &sides[1], o.view, &err);
    if (!rc)
        rc = ggn_stats_agreement(pairing.truth, pairing.model, pairing.n, o.cap, &figures, &err);
    if (!rc && o.dir)
        rc = write_outputs(&o, &pairing, &figures, &err);
    if (!rc && o.json) {
        ggn_agreement_print_json(stdout, &figures);
        putchar('\n');
    } else if (!rc) {
        printf("%d view%s in common\n", pairing.n_views, pairing.n_views == 1 ? "" : "s");
        ggn_agreement_print_table(stdout, &figures);
    }
    ggn_pairing_release(&pairing);
    ggn_thresholds_release(&sides[0]);
    ggn_thresholds_release(&sides[1]);
    return !rc ? GGN_EXIT_OK : ggn_cmd_fail(argv[0], &err);
}
