/* `ggn compare REFERENCE MODEL`: stop maps against (human) thresholds. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/options.h"
#include "cli/commands.h"
#include "eval/compare.h"
#include "sequence/simulate.h"

struct options {
    const char *paths[2];
    const char *dir, *view;
    double cap;
    int block, json;
};

static const char *const written[] = {"blocks.csv", "summary.json", NULL};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"json", 'j', NULL, TO(json), .help = "print the statistics as one JSON object"},
    {"output", 'o', "DIR", TO(dir), .output = BASE_FOLDER, .files = written,
     .help = "write blocks.csv and summary.json there; lull-plot draws the first"},
    {"view", 'v', "NAME", TO(view), .help = "compare with this view of REFERENCE only"},
    {"cap", 'c', "SPP", TO(cap), 1e-9, 1e12, .help = "thresholds at the cap are censored (10000)"},
    {"block", 'b', "PIXELS", TO(block), 1, 32768, .help = "side of a block in an EXR stop map (200)"},
    {0}};

static int write_outputs(const struct options *o, const struct ggn_pairing *p, const struct ggn_agreement *a,
                         struct base_err *err)
{
    char path[4096];
    struct base_file_out out;
    int rc = base_make_folder(o->dir, err);
    if (!rc)
        rc = base_file_join(path, o->dir, "blocks.csv", err);
    if (!rc)
        rc = ggn_compare_write_blocks(path, p, err);
    if (!rc)
        rc = base_file_join(path, o->dir, "summary.json", err);
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
    static const struct base_options options = {
        .list = list,
        .args_doc = "REFERENCE MODEL",
        .args_min = 2,
        .args_max = 2,
        .args_are = BASE_ARGS_FILES,
        .args = offsetof(struct options, paths),
        .doc = "How well the stops or thresholds in MODEL agree with those in REFERENCE (people first). Both may be CSV "
               "(name;t0;…), a render's report JSON, or an EXR with the channel lull.spp.V."};
    struct options o = {.cap = SEQ_STUDY_CAP, .block = 200};
    struct ggn_thresholds sides[2] = {{0}, {0}};
    struct ggn_pairing pairing = {0};
    struct ggn_agreement figures;
    struct base_err err = {0};

    int rc = base_options_parse(&options, argc, argv, &o, &err);
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
        const struct ggn_pair *first = &pairing.views[0];
        if (strcmp(first->truth->name, first->model->name) != 0)
            printf("'%s' against '%s'\n", first->truth->name, first->model->name); /* --view made them a pair */
        else
            printf("%d view%s in common\n", pairing.n_views, pairing.n_views == 1 ? "" : "s");
        ggn_agreement_print_table(stdout, &figures);
    }
    ggn_pairing_release(&pairing);
    ggn_thresholds_release(&sides[0]);
    ggn_thresholds_release(&sides[1]);
    return !rc ? GGN_EXIT_OK : ggn_cmd_fail(argv[0], &err);
}
