#include "cli.h"

#include <argp.h>

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/version.h"
#include "scene/settings.h"
#include "render/film.h"
#include "render/output.h"
#include "pbrt/xform.h"

enum key {
    KEY_BLOCK = 256,
    KEY_SPP_MIN,
    KEY_SPP_MAX,
    KEY_SPP,
    KEY_TIME_BUDGET,
    KEY_MAX_CHECK_OVERHEAD,
    KEY_MAX_SEAM,
    KEY_SIZE,
    KEY_CROP,
    KEY_LOOK_AT,
    KEY_FOV,
    KEY_LIST_CRITERIA,
    KEY_SEED,
    KEY_PREVIEW,
    KEY_STOP_MAP,
    KEY_REPORT,
    KEY_CHECKPOINT,
    KEY_CHECKPOINT_EVERY,
    KEY_RESUME,
    KEY_DEBUG_PATH,
    KEY_EXPLAIN,
    KEY_EFFECTS,
    KEY_STRICT,
    KEY_SAMPLER,
    KEY_INTEGRATOR,
    KEY_MAX_DEPTH,
    KEY_FILTER,
    KEY_AOV,
    KEY_REPRODUCIBLE,
    KEY_ORDER,
    KEY_SEQUENCE,
    KEY_LEVELS,
    KEY_BLOCKS,
    KEY_REFERENCE_SPP,
    KEY_NAME
};

static const struct argp_option options[] = {
    {0, 0, 0, 0, "When to stop:", 1},
    {"criterion", 'c', "NAME|PATH[:ID]", 0, "Stopping criterion: a name (see --list-criteria) or a shared object; default ggn", 0},
    {"param", 'p', "KEY=VALUE", 0, "Parameter of the criterion; may be repeated", 0},
    {"list-criteria", KEY_LIST_CRITERIA, 0, 0, "List the criteria that are found and their parameters, and exit", 0},
    {"spp-min", KEY_SPP_MIN, "N", 0, "Samples per pixel before the first check (default 32)", 0},
    {"spp-max", KEY_SPP_MAX, "N", 0, "Samples per pixel at which every block stops (default 10000)", 0},
    {"spp", KEY_SPP, "N", 0, "The same number of samples everywhere; a criterion, if given, is asked once at the end", 0},
    {"time-budget", KEY_TIME_BUDGET, "SECONDS", 0, "Stop after so long; 0 = no limit (default)", 0},
    {"block", KEY_BLOCK, "N|WxH", 0, "Block size in pixels (default 200)", 0},
    {"max-check-overhead", KEY_MAX_CHECK_OVERHEAD, "SHARE", 0,
     "Leave out checks while they took more than this share of the time, e.g. 0.03; 0 = no bound (default). With a bound, "
     "as with a time budget, the result depends on the clock", 0},
    {"max-seam", KEY_MAX_SEAM, "RATIO", 0,
     "Re-open stopped blocks beside one with more than RATIO times their samples, so that no seam shows; 0 = never (default)", 0},
    {0, 0, 0, 0, "What to render:", 2},
    {"size", KEY_SIZE, "WxH", 0, "Image size, instead of the scene's", 0},
    {"crop", KEY_CROP, "X0,Y0,X1,Y1", 0,
     "Keep only these pixels. Blocks that the crop touches are rendered whole, so that they stop as in the full image", 0},
    {"look-at", KEY_LOOK_AT, "\"EX EY EZ AX AY AZ UX UY UZ\"", 0,
     "Look from E at A with U up, in the scene's world, instead of through the scene's camera", 0},
    {"fov", KEY_FOV, "DEGREES", 0, "Field of view over the image's short side, instead of the scene's", 0},
    {"sampler", KEY_SAMPLER, "independent|sobol", 0, "Instead of the scene's", 0},
    {"integrator", KEY_INTEGRATOR, "path|bsdf-only", 0,
     "path: next-event estimation with multiple importance sampling (default); bsdf-only: brute force, for checking", 0},
    {"max-depth", KEY_MAX_DEPTH, "N", 0, "Most bounces, instead of the scene's; -1 = unlimited", 0},
    {"filter", KEY_FILTER, "box|triangle|gaussian[:RADIUS]", 0, "Pixel filter, instead of the scene's; radius in pixels", 0},
    {"seed", KEY_SEED, "N", 0, "Seed of all random numbers (default 0)", 0},
    {"effects", KEY_EFFECTS, "auto|all", 0, "all: use the general kernel (same image, slower)", 0},
    {"strict", KEY_STRICT, 0, 0, "Unsupported scene features are errors", 0},
    {"threads", 't', "N", 0, "Worker threads (default: all processors)", 0},
    {0, 0, 0, 0, "What to write:", 3},
    {"output", 'o', "FILE.exr", 0, "Multi-layer EXR (default: the scene's name in the current folder, if nothing else is asked for)", 0},
    {"preview", KEY_PREVIEW, "FILE.png", 0, "The image as sRGB", 0},
    {"stop-map", KEY_STOP_MAP, "FILE.png|FILE.csv", 0, "Samples per block as a picture or a table; may be repeated", 0},
    {"report", KEY_REPORT, "FILE.json", 0, "Everything about the run", 0},
    {"aov", KEY_AOV, "LIST", 0, "More layers: albedo,normal,depth", 0},
    {"reproducible", KEY_REPRODUCIBLE, 0, 0, "Leave times out of the EXR: equal renders are equal files", 0},
    {"quiet", 'q', 0, 0, "No progress, no notes", 0},
    {0, 0, 0, 0, "Interrupting and going on:", 4},
    {"checkpoint", KEY_CHECKPOINT, "FILE", 0, "Save the state of the render now and then, and when it is interrupted", 0},
    {"checkpoint-every", KEY_CHECKPOINT_EVERY, "SECONDS", 0, "How often (default 60)", 0},
    {"resume", KEY_RESUME, 0, 0, "Go on from the checkpoint", 0},
    {0, 0, 0, 0, "Looking inside:", 5},
    {"explain", KEY_EXPLAIN, 0, 0, "Print the scene's effects, why, and the kernel chosen, and exit", 0},
    {"debug-path", KEY_DEBUG_PATH, "X,Y,SAMPLE", 0, "Print one path vertex by vertex, and exit", 0},
    {0, 0, 0, 0, "Recording block sequences (for training and evaluation):", 6},
    {"sequence", KEY_SEQUENCE, "DIR", 0, "Record blocks at rising sample counts into DIR; run again to go on", 0},
    {"levels", KEY_LEVELS, "KIND:FIRST:LAST:STEP", 0, "geometric:20:10000:1.15 (default) or linear:20:10000:20", 0},
    {"blocks", KEY_BLOCKS, "LIST", 0, "Only these blocks, e.g. 0,3,8-11", 0},
    {"reference-spp", KEY_REFERENCE_SPP, "N", 0, "Samples of the reference, which are independent (default 0: no reference)", 0},
    {"name", KEY_NAME, "SCENE[/VIEW]", 0, "Scene and view in the manifest (default: by the file's name)", 0},
    {"order-seed", KEY_ORDER, "N", OPTION_HIDDEN, "", 0},
    {0}};

struct parse {
    struct pt_cli *cli;
    struct base_err *err;
    int has_spp_bounds, has_levels_option;
};

/* --- values --------------------------------------------------------------------------------------------------------- */

static int bad_value(struct base_err *err, const char *option, const char *value, const char *expected)
{
    return base_fail(err, BASE_EINVAL, "--%s %s: expected %s", option, value, expected);
}

/* The whole text is one integer in [low, high]. */
static int integer(const char *text, long long low, long long high, long long *out)
{
    char *end;
    errno = 0;
    long long v = strtoll(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0 || v < low || v > high)
        return 0;
    *out = v;
    return 1;
}

static int get_integer(struct base_err *err, const char *option, const char *text, long long low, long long high, long long *out)
{
    char expected[96];
    snprintf(expected, sizeof expected, "an integer from %lld to %lld", low, high);
    return integer(text, low, high, out) ? 0 : bad_value(err, option, text, expected);
}

static int get_u64(struct base_err *err, const char *option, const char *text, long long low, long long high, uint64_t *out)
{
    long long v = 0;
    int rc = get_integer(err, option, text, low, high, &v);
    if (!rc)
        *out = (uint64_t)v;
    return rc;
}

static int get_int(struct base_err *err, const char *option, const char *text, long long low, long long high, int *out)
{
    long long v = 0;
    int rc = get_integer(err, option, text, low, high, &v);
    if (!rc)
        *out = (int)v;
    return rc;
}

static int get_real(struct base_err *err, const char *option, const char *text, double low, double high, double *out)
{
    char *end, expected[96];
    double v = strtod(text, &end);
    if (end != text && *end == '\0' && v >= low && v <= high) {
        *out = v;
        return 0;
    }
    snprintf(expected, sizeof expected, "a number from %g to %g", low, high);
    return bad_value(err, option, text, expected);
}

/* n integers in [low, high] with one separator character between them. */
static int get_list(const char *text, char separator, int n, long long low, long long high, long long *out)
{
    for (int i = 0; i < n; i++) {
        char *end;
        errno = 0;
        out[i] = strtoll(text, &end, 10);
        if (end == text || errno != 0 || out[i] < low || out[i] > high || *end != (i + 1 < n ? separator : '\0'))
            return 0;
        text = end + 1;
    }
    return 1;
}

static int get_block(struct parse *p, const char *arg)
{
    long long v[2];
    if (get_list(arg, 'x', 1, 1, 4096, v))
        v[1] = v[0];
    else if (!get_list(arg, 'x', 2, 1, 4096, v))
        return bad_value(p->err, "block", arg, "N or WxH, each from 1 to 4096");
    p->cli->block_width = (int)v[0];
    p->cli->block_height = (int)v[1];
    return 0;
}

static int get_size(struct parse *p, const char *arg)
{
    long long v[2];
    if (!get_list(arg, 'x', 2, 1, 32768, v))
        return bad_value(p->err, "size", arg, "WxH, each from 1 to 32768");
    p->cli->width = (int)v[0];
    p->cli->height = (int)v[1];
    return 0;
}

static int get_crop(struct parse *p, const char *arg)
{
    long long v[4];
    if (!get_list(arg, ',', 4, 0, 32768, v) || v[0] >= v[2] || v[1] >= v[3])
        return bad_value(p->err, "crop", arg, "X0,Y0,X1,Y1 in pixels with X0 < X1 and Y0 < Y1");
    for (int i = 0; i < 4; i++)
        p->cli->crop[i] = (int)v[i];
    p->cli->has_crop = 1;
    return 0;
}

static int get_look_at(struct parse *p, const char *arg)
{
    static const double far = 1e9; /* what single precision can still tell apart from the scene */
    double *v = p->cli->view.look_at_world;
    const char *at = arg;
    struct pt_xform unused;
    int count = 0;
    for (char *end; count < 9; count++, at = end) {
        v[count] = strtod(at, &end);
        if (end == at || !(fabs(v[count]) <= far) || (*end != ' ' && *end != '\0'))
            break;
    }
    if (count != 9 || at[strspn(at, " ")] != '\0')
        return bad_value(p->err, "look-at", arg, "nine numbers with spaces between them: eye, point looked at, up");
    if (!pt_xform_look_at(v, v + 3, v + 6, &unused))
        return bad_value(p->err, "look-at", arg, "eye and point looked at apart, and up not along the view");
    p->cli->view.has_look_at = 1;
    return 0;
}

static int get_param(struct parse *p, const char *arg)
{
    struct pt_cli *cli = p->cli;
    const char *equals = strchr(arg, '=');
    if (!equals || equals == arg)
        return base_fail(p->err, BASE_EINVAL, "-p %s: expected KEY=VALUE", arg);
    if (cli->param_count == PT_CLI_MAX_PARAMS)
        return base_fail(p->err, BASE_EINVAL, "-p %s: more than %d parameters", arg, PT_CLI_MAX_PARAMS);
    char *text = strdup(arg);
    if (!text)
        return base_fail_nomem(p->err, "parameters");
    text[equals - arg] = '\0';
    cli->param_text[cli->param_count] = text;
    cli->params[cli->param_count++] = (struct lull_pair){text, text + (equals - arg) + 1};
    return 0;
}

/* Index of arg among the words of a '|'-separated list. */
static int get_word(struct parse *p, const char *option, const char *arg, size_t length, const char *words, int *out)
{
    int i = 0;
    for (const char *w = words;; i++) {
        size_t n = strcspn(w, "|");
        if (n == length && memcmp(w, arg, n) == 0) {
            *out = i;
            return 0;
        }
        if (w[n] == '\0')
            return bad_value(p->err, option, arg, words);
        w += n + 1;
    }
}

static int get_filter(struct parse *p, const char *arg)
{
    size_t n = strcspn(arg, ":");
    int rc = get_word(p, "filter", arg, n, "box|triangle|gaussian", &p->cli->filter);
    if (!rc && arg[n] == ':') {
        double radius = 0.0;
        rc = get_real(p->err, "filter", arg + n + 1, 0.01, 16.0, &radius);
        p->cli->filter_radius = (float)radius;
    }
    return rc;
}

static int get_aov(struct parse *p, const char *arg)
{
    static const uint32_t planes[3] = {PT_FILM_ALBEDO, PT_FILM_NORMAL, PT_FILM_DEPTH};
    for (const char *w = arg;;) {
        size_t n = strcspn(w, ",");
        int i = 0;
        if (get_word(p, "aov", w, n, "albedo|normal|depth", &i) != 0)
            return bad_value(p->err, "aov", arg, "a list of albedo, normal, depth");
        p->cli->aov |= planes[i];
        if (w[n] == '\0')
            return 0;
        w += n + 1;
    }
}

static int get_stop_map(struct parse *p, const char *arg)
{
    if (!pt_output_has_ending(arg, "png") && !pt_output_has_ending(arg, "csv"))
        return bad_value(p->err, "stop-map", arg, "a name that ends in .png or .csv");
    if (p->cli->stop_map_count == PT_CLI_MAX_STOP_MAPS)
        return base_fail(p->err, BASE_EINVAL, "--stop-map %s: more than %d stop maps", arg, PT_CLI_MAX_STOP_MAPS);
    p->cli->stop_maps[p->cli->stop_map_count++] = arg;
    return 0;
}

static int get_file(struct parse *p, const char *option, const char *ending, const char *arg, const char **out)
{
    char expected[64];
    snprintf(expected, sizeof expected, "a name that ends in .%s", ending);
    if (!pt_output_has_ending(arg, ending))
        return bad_value(p->err, option, arg, expected);
    *out = arg;
    return 0;
}

static int get_debug_path(struct parse *p, const char *arg)
{
    long long v[3];
    if (!get_list(arg, ',', 3, 0, INT32_MAX, v))
        return bad_value(p->err, "debug-path", arg, "X,Y,SAMPLE");
    p->cli->debug_x = (uint32_t)v[0];
    p->cli->debug_y = (uint32_t)v[1];
    p->cli->debug_sample = (uint32_t)v[2];
    p->cli->action = PT_CLI_DEBUG_PATH;
    return 0;
}

/* --- options -------------------------------------------------------------------------------------------------------- */

static int option_when(struct parse *p, int key, const char *arg)
{
    struct pt_cli *cli = p->cli;
    switch (key) {
    case 'c':
        cli->criterion = arg;
        return 0;
    case 'p':
        return get_param(p, arg);
    case KEY_LIST_CRITERIA:
        cli->action = PT_CLI_LIST_CRITERIA;
        return 0;
    case KEY_SPP_MIN:
        p->has_spp_bounds = 1;
        return get_u64(p->err, "spp-min", arg, 1, INT32_MAX, &cli->spp_min);
    case KEY_SPP_MAX:
        p->has_spp_bounds = 1;
        return get_u64(p->err, "spp-max", arg, 1, INT32_MAX, &cli->spp_max);
    case KEY_SPP:
        return get_u64(p->err, "spp", arg, 1, INT32_MAX, &cli->spp);
    case KEY_TIME_BUDGET:
        return get_real(p->err, "time-budget", arg, 0.0, 1e9, &cli->time_budget_s);
    case KEY_BLOCK:
        return get_block(p, arg);
    case KEY_MAX_CHECK_OVERHEAD:
        return get_real(p->err, "max-check-overhead", arg, 0.0, 1.0, &cli->max_check_overhead);
    case KEY_MAX_SEAM:
        if (strcmp(arg, "0") == 0)
            return 0;
        return get_real(p->err, "max-seam", arg, 1.0, 1e6, &cli->max_seam);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int option_what(struct parse *p, int key, const char *arg)
{
    struct pt_cli *cli = p->cli;
    long long v = 0;
    int rc;
    switch (key) {
    case KEY_SIZE:
        return get_size(p, arg);
    case KEY_CROP:
        return get_crop(p, arg);
    case KEY_LOOK_AT:
        return get_look_at(p, arg);
    case KEY_FOV:
        return get_real(p->err, "fov", arg, 1e-3, 179.9, &cli->view.fov_deg);
    case KEY_SAMPLER:
        return get_word(p, "sampler", arg, strlen(arg), "independent|sobol", &cli->sampler);
    case KEY_INTEGRATOR:
        return get_word(p, "integrator", arg, strlen(arg), "path|bsdf-only", &cli->strategy);
    case KEY_MAX_DEPTH:
        cli->has_max_depth = 1;
        return get_int(p->err, "max-depth", arg, -1, 1000000, &cli->max_depth);
    case KEY_FILTER:
        return get_filter(p, arg);
    case KEY_SEED:
        rc = get_integer(p->err, "seed", arg, 0, UINT32_MAX, &v);
        cli->seed = (uint32_t)v;
        return rc;
    case KEY_EFFECTS:
        return get_word(p, "effects", arg, strlen(arg), "auto|all", &cli->all_effects);
    case KEY_STRICT:
        cli->strict = 1;
        return 0;
    case 't':
        return get_int(p->err, "threads", arg, 1, 1024, &cli->threads);
    case KEY_ORDER:
        rc = get_integer(p->err, "order-seed", arg, 0, UINT32_MAX, &v);
        cli->order_seed = (uint32_t)v;
        return rc;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int option_output(struct parse *p, int key, const char *arg)
{
    struct pt_cli *cli = p->cli;
    switch (key) {
    case 'o':
        return get_file(p, "output", "exr", arg, &cli->output);
    case KEY_PREVIEW:
        return get_file(p, "preview", "png", arg, &cli->preview);
    case KEY_STOP_MAP:
        return get_stop_map(p, arg);
    case KEY_REPORT:
        return get_file(p, "report", "json", arg, &cli->report);
    case KEY_AOV:
        return get_aov(p, arg);
    case KEY_REPRODUCIBLE:
        cli->reproducible = 1;
        return 0;
    case 'q':
        cli->quiet = 1;
        return 0;
    case KEY_CHECKPOINT:
        cli->checkpoint = arg;
        return 0;
    case KEY_CHECKPOINT_EVERY:
        return get_real(p->err, "checkpoint-every", arg, 0.0, 1e9, &cli->checkpoint_every_s);
    case KEY_RESUME:
        cli->resume = 1;
        return 0;
    case KEY_EXPLAIN:
        cli->action = PT_CLI_EXPLAIN;
        return 0;
    case KEY_DEBUG_PATH:
        return get_debug_path(p, arg);
    case KEY_SEQUENCE:
        cli->sequence = arg;
        cli->action = PT_CLI_SEQUENCE;
        return 0;
    case KEY_LEVELS:
        p->has_levels_option = 1;
        cli->levels = arg;
        return 0;
    case KEY_BLOCKS:
        p->has_levels_option = 1;
        cli->sequence_blocks = arg;
        return 0;
    case KEY_REFERENCE_SPP:
        p->has_levels_option = 1;
        return get_u64(p->err, "reference-spp", arg, 0, INT32_MAX, &cli->reference_spp);
    case KEY_NAME:
        p->has_levels_option = 1;
        cli->name = arg;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse_option(int key, char *arg, struct argp_state *state)
{
    struct parse *p = state->input;
    if (key == ARGP_KEY_ARG) {
        if (p->cli->scene) {
            base_fail(p->err, BASE_EINVAL, "%s: one scene at a time, and %s was given already", arg, p->cli->scene);
            return EINVAL;
        }
        p->cli->scene = arg;
        return 0;
    }
    int rc = option_when(p, key, arg);
    if (rc == ARGP_ERR_UNKNOWN)
        rc = option_what(p, key, arg);
    if (rc == ARGP_ERR_UNKNOWN)
        rc = option_output(p, key, arg);
    return rc == ARGP_ERR_UNKNOWN ? ARGP_ERR_UNKNOWN : !rc ? 0 : EINVAL;
}

/* --- the whole ------------------------------------------------------------------------------------------------------ */

static int check_together(const struct parse *p)
{
    const struct pt_cli *cli = p->cli;
    if (cli->action == PT_CLI_LIST_CRITERIA)
        return 0;
    if (!cli->scene)
        return base_fail(p->err, BASE_EINVAL, "a scene file is needed (--help says more)");
    if (cli->spp > 0 && p->has_spp_bounds)
        return base_fail(p->err, BASE_EINVAL, "--spp takes the same samples everywhere: leave out --spp-min and --spp-max");
    if (cli->spp_min > cli->spp_max)
        return base_fail(p->err, BASE_EINVAL, "--spp-min %llu is above --spp-max %llu", (unsigned long long)cli->spp_min,
                       (unsigned long long)cli->spp_max);
    if (cli->resume && !cli->checkpoint)
        return base_fail(p->err, BASE_EINVAL, "--resume needs --checkpoint FILE");
    if (!cli->sequence && p->has_levels_option)
        return base_fail(p->err, BASE_EINVAL, "--levels, --blocks, --reference-spp and --name belong to --sequence DIR");
    if (cli->sequence && (cli->spp > 0 || cli->checkpoint || cli->has_crop))
        return base_fail(p->err, BASE_EINVAL, "--sequence goes with neither --spp, --checkpoint nor --crop");
    if (cli->param_count > 0 && cli->spp > 0 && !cli->criterion)
        return base_fail(p->err, BASE_EINVAL, "-p %s=%s: no criterion is used", cli->params[0].key, cli->params[0].value);
    return 0;
}

/* argp prints help only when it may print its own errors, too. */
static int asks_for_help(int argc, char **argv)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-?") == 0 || strcmp(argv[i], "--usage") == 0 ||
            strcmp(argv[i], "--version") == 0 || strcmp(argv[i], "-V") == 0)
            return 1;
    return 0;
}

int pt_cli_parse(struct pt_cli *cli, int argc, char **argv, struct base_err *err)
{
    static const struct argp argp = {
        .options = options,
        .parser = parse_option,
        .args_doc = "SCENE.pbrt",
        .doc = "Renders a scene block by block and stops each block when its noise can no longer be seen.\v"
               "Exit status: 0 done, 1 memory ran out, 2 bad input or an output could not be written, 130 interrupted "
               "(everything is written all the same).",
    };
    *cli = (struct pt_cli){.block_width = 200, .block_height = 200, .spp_min = 32, .spp_max = 10000, .checkpoint_every_s = 60.0,
                           .sampler = -1, .strategy = -1, .filter = -1};
    /* Assigned, not defined: a definition of ours would be hidden from libc. */
    argp_program_version = "pathtracer (Lull) " BASE_VERSION;
    argp_err_exit_status = 2;
    struct base_err first = {0};
    struct parse p = {.cli = cli, .err = &first};
    int index = 0;
    int rc = argp_parse(&argp, argc, argv, asks_for_help(argc, argv) ? 0 : ARGP_NO_ERRS, &index, &p);
    if (rc != 0 && first.text[0] == '\0')
        base_fail(&first, BASE_EINVAL, "%s: unknown option, or its value is missing (--help lists the options)",
                index > 1 && index <= argc ? argv[index - 1] : argv[argc - 1]);
    if (rc == 0)
        rc = check_together(&p);
    if (rc != 0) {
        pt_cli_release(cli);
        return base_fail(err, first.code, "%s", first.text);
    }
    return 0;
}

void pt_cli_release(struct pt_cli *cli)
{
    for (uint32_t i = 0; i < cli->param_count; i++)
        free(cli->param_text[i]);
    cli->param_count = 0;
}
