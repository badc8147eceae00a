#define _DEFAULT_SOURCE /* strsep */
#include "cli.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "job/job.h"
#include "pbrt/xform.h"
#include "render/checkpoint.h"
#include "render/film.h"
#include "sequence/planes.h"

static int expected(struct base_err *err, const char *what) { return base_fail(err, BASE_EINVAL, "expected %s", what); }

/* n integers in [low, high] with one separator character between them. */
static int get_list(const char *text, const char *separator, int n, int64_t low, int64_t high, int *out)
{
    char copy[128], *rest = copy;
    if (snprintf(copy, sizeof copy, "%s", text) >= (int)sizeof copy)
        return 0;
    for (int i = 0; i < n; i++) {
        const char *part = strsep(&rest, separator);
        int64_t v;
        if (!part || !base_parse_integer(part, low, high, &v))
            return 0;
        out[i] = (int)v;
    }
    return !rest;
}

static int set_block(void *into, const char *value, struct base_err *err)
{
    struct pt_cli *cli = into;
    int v[2];
    if (!base_parse_block(value, 4096, v))
        return expected(err, "N or WxH, each from 1 to 4096");
    cli->render.block_width = v[0];
    cli->render.block_height = v[1];
    return 0;
}

static int set_seam(void *into, const char *value, struct base_err *err)
{
    struct pt_cli *cli = into;
    if (strcmp(value, "0") != 0 && !base_parse_real(value, 1, 1e6, &cli->render.max_seam))
        return expected(err, "0 or a number from 1 to 1e+06");
    return 0;
}

static int set_size(void *into, const char *value, struct base_err *err)
{
    struct pt_cli *cli = into;
    int v[2];
    if (!get_list(value, "x", 2, 1, 32768, v))
        return expected(err, "WxH, each from 1 to 32768");
    if ((double)v[0] * v[1] > PT_CLI_MAX_PIXELS)
        return expected(err, "WxH of at most 2^28 pixels in all");
    cli->load.width = v[0];
    cli->load.height = v[1];
    return 0;
}

static int set_crop(void *into, const char *value, struct base_err *err)
{
    struct pt_cli *cli = into;
    if (!get_list(value, ",", 4, 0, 32768, cli->render.crop) || cli->render.crop[0] >= cli->render.crop[2] ||
        cli->render.crop[1] >= cli->render.crop[3])
        return expected(err, "X0,Y0,X1,Y1 in pixels with X0 < X1 and Y0 < Y1");
    cli->has_crop = 1;
    return 0;
}

int pt_cli_look_at(const char *value, struct pt_view *view, struct base_err *err)
{
    static const double far = 1e9; /* what single precision can still tell apart from the scene */
    double *v = view->look_at_world;
    const char *at = value;
    struct pt_xform unused;
    int count = 0;
    for (char *end; count < 9; count++, at = end) {
        v[count] = strtod(at, &end);
        if (end == at || !(fabs(v[count]) <= far) || (*end != ' ' && *end != '\0'))
            break;
    }
    if (count != 9 || at[strspn(at, " ")] != '\0')
        return expected(err, "nine numbers with spaces between them: eye, point looked at, up");
    if (!pt_xform_look_at(v, v + 3, v + 6, &unused))
        return expected(err, "eye and point looked at apart, and up not along the view");
    view->has_look_at = 1;
    return 0;
}

static int set_look_at(void *into, const char *value, struct base_err *err)
{
    return pt_cli_look_at(value, &((struct pt_cli *)into)->load.view, err);
}

static int set_param(void *into, const char *value, struct base_err *err)
{
    struct pt_cli_params *params = &((struct pt_cli *)into)->params;
    const char *equals = strchr(value, '=');
    if (!equals || equals == value)
        return expected(err, "KEY=VALUE");
    if (params->count == PT_CLI_MAX_PARAMS)
        return base_fail(err, BASE_EINVAL, "more than %d parameters", PT_CLI_MAX_PARAMS);
    char *text = strdup(value);
    if (!text)
        return base_fail_nomem(err, "parameters");
    text[equals - value] = '\0';
    params->text[params->count] = text;
    params->list[params->count++] = (struct lull_pair){text, text + (equals - value) + 1};
    return 0;
}

static int set_visible(void *into, const char *value, struct base_err *err)
{
    char param[64];
    double share;
    if (!base_parse_real(value, 0, 1, &share) || share == 0 || share == 1)
        return expected(err, "a share of viewers between 0 and 1");
    snprintf(param, sizeof param, "visible=%.17g", share);
    return set_param(into, param, err);
}

static int set_error(void *into, const char *value, struct base_err *err)
{
    char param[64];
    double times;
    if (!base_parse_real(value, 0.1, 100, &times))
        return expected(err, "how many times what is just seen, 0.1 to 100");
    snprintf(param, sizeof param, "error=%.17g", times);
    return set_param(into, param, err);
}

static int set_filter(void *into, const char *value, struct base_err *err)
{
    struct pt_integrator *by = &((struct pt_cli *)into)->render.integrator;
    size_t n = strcspn(value, ":");
    double radius = 0;
    by->filter = base_word_index(pt_filter_words, value, n);
    if (by->filter < 0)
        return expected(err, &(PT_FILTERS(PT_WORD_OR))[1]);
    if (value[n] == ':' && !base_parse_real(value + n + 1, 0.01, 16, &radius))
        return expected(err, "a radius from 0.01 to 16");
    by->filter_x = (float)radius;
    return 0;
}

static int set_aov(void *into, const char *value, struct base_err *err)
{
    static const char *const planes[] = {"albedo", "normal", "depth", NULL}; /* in the order of PT_FILM_ALBEDO … */
    struct pt_cli *cli = into;
    for (size_t n;; value += n + 1) {
        n = strcspn(value, ",");
        int i = base_word_index(planes, value, n);
        if (i < 0)
            return expected(err, "a list of albedo, normal, depth");
        cli->render.planes |= (uint32_t)PT_FILM_ALBEDO << i;
        if (value[n] == '\0')
            return 0;
    }
}

static int set_planes(void *into, const char *value, struct base_err *err)
{
    static const char *const names[] = {"color", "half", "moment2", "albedo", "normal", "depth", NULL};
    static const int planes[] = {SEQ_PLANE_COLOR,  SEQ_PLANE_HALF,   SEQ_PLANE_MOMENT2,
                                 SEQ_PLANE_ALBEDO, SEQ_PLANE_NORMAL, SEQ_PLANE_DEPTH};
    struct pt_cli *cli = into;
    char word[16];
    for (size_t n;; value += n + 1) {
        n = strcspn(value, ",");
        for (size_t i = 0; i < sizeof word; i++)
            word[i] = i < n ? (char)(value[i] >= 'A' && value[i] <= 'Z' ? value[i] - 'A' + 'a' : value[i]) : '\0';
        const int i = n < sizeof word ? base_word_index(names, word, n) : -1;
        if (i < 0)
            return expected(err, "a list of color, half, moment2, albedo, normal, depth");
        cli->sequence.planes |= 1u << planes[i];
        if (value[n] == '\0')
            return 0;
    }
}

static int set_denoise(void *into, const char *value, struct base_err *err)
{
    static const char *const words[] = {"blend", "full", NULL};
    struct pt_cli *cli = into;
    int i = value ? base_word_index(words, value, strlen(value)) : 0;
    if (i < 0)
        return expected(err, "blend or full");
    cli->picture = i == 0 ? PT_PICTURE_BLEND : PT_PICTURE_DENOISED;
    return 0;
}

static int set_debug_path(void *into, const char *value, struct base_err *err)
{
    struct pt_cli *cli = into;
    if (!get_list(value, ",", 3, 0, INT32_MAX, cli->debug))
        return expected(err, "X,Y,SAMPLE");
    cli->action = PT_CLI_DEBUG_PATH;
    return 0;
}

static int set_quote_pilot(void *into, const char *value, struct base_err *err)
{
    struct pt_render_config *r = &((struct pt_cli *)into)->render;
    const size_t length = strcspn(value, ":");
    char text[24];
    int64_t spp;
    snprintf(text, sizeof text, "%.*s", (int)length, value);
    if (length >= sizeof text || !base_parse_integer(text, 1, INT32_MAX, &spp) ||
        (value[length] != '\0' && !base_parse_real(value + length + 1, 0.01, 1e9, &r->pilot_s)))
        return expected(err, "SPP or SPP:SECONDS, samples per pixel from 1, seconds from 0.01");
    r->pilot_spp = (uint64_t)spp;
    return 0;
}

/* What the image depends on: options of several parts, or whose line has another name. */

static void identify_uniform(const void *from, struct base_identity *to)
{
    base_identity_add(to, "uniform", "%d", ((const struct pt_cli *)from)->render.uniform);
}

static void identify_block(const void *from, struct base_identity *to)
{
    const struct pt_render_config *r = &((const struct pt_cli *)from)->render;
    base_identity_add(to, "block", "%dx%d", r->block_width, r->block_height);
}

static void identify_seam(const void *from, struct base_identity *to)
{
    base_identity_add(to, "max-seam", "%g", ((const struct pt_cli *)from)->render.max_seam);
}

static void identify_params(const void *from, struct base_identity *to)
{
    const struct pt_cli_params *params = &((const struct pt_cli *)from)->params;
    for (uint32_t i = 0; i < params->count; i++)
        base_identity_add(to, "param", "%s=%s", params->list[i].key, params->list[i].value);
}

static void identify_size(const void *from, struct base_identity *to)
{
    const struct pt_render_config *r = &((const struct pt_cli *)from)->render;
    base_identity_add(to, "size", "%dx%d", r->width, r->height);
}

static void identify_crop(const void *from, struct base_identity *to)
{
    const int *crop = ((const struct pt_cli *)from)->render.crop;
    base_identity_add(to, "crop", "%d,%d,%d,%d", crop[0], crop[1], crop[2], crop[3]);
}

static void identify_look_at(const void *from, struct base_identity *to)
{
    const struct pt_view *view = &((const struct pt_cli *)from)->load.view;
    base_identity_add_reals(to, "look-at", view->look_at_world, view->has_look_at ? 9 : 0);
}

static void identify_light_selection(const void *from, struct base_identity *to)
{
    base_identity_add(to, "light-selection", "%s",
                      pt_light_selection_words[((const struct pt_cli *)from)->load.light_selection]);
}

static void identify_filter(const void *from, struct base_identity *to)
{
    const struct pt_integrator *i = &((const struct pt_cli *)from)->render.integrator;
    base_identity_add(to, "filter", "%d:%gx%g:%g", i->filter, (double)i->filter_x, (double)i->filter_y,
                      (double)i->filter_sigma);
}

static const char *const frame_seed_words[] = {"fresh", "fixed", NULL};
static const char *const effect_words[] = {"auto", "all", NULL};
static const char *const exr[] = {"exr", NULL}, *const png[] = {"png", NULL}, *const json[] = {"json", NULL},
                         *const html[] = {"html", "htm", NULL}, *const png_or_csv[] = {"png", "csv", NULL};

#define TO(member) BASE_TO(struct pt_cli, member)
#define TO_STOP_MAPS \
    { \
        BASE_STORE_TEXTS, offsetof(struct pt_cli, paths[PT_STOP_MAPS]), offsetof(struct pt_cli, stop_maps), \
            PT_CLI_MAX_STOP_MAPS, "stop maps" \
    }

const struct base_option pt_cli_options[] = {
    {.help = "When to stop:"},
    {"criterion", 'c', "NAME|PATH[:ID]", TO(criterion),
     .help = "Stopping criterion: a name (see --list-criteria), a shared object or a Python file; default observer"},
    {"visible", 0, "SHARE", .set = set_visible,
     .help = "Stop a block when at most this share of viewers would still see noise, of criteria that can tell (observer "
             "and denoised: default 0.35, ggn: the model's own)"},
    {"error", 0, "TIMES", .set = set_error,
     .help = "Stop a block when its error is at most so many times what is just seen, e.g. 4 for a draft, 2 for a good "
             "picture; instead of --visible (observer and denoised)"},
    {"mask", 0, "FILE.png", TO(mask), .input = BASE_FILE, .words = png,
     .help = "A grey picture of the image's size: lighter regions are rendered better. White takes a quarter of the quality "
             "parameter (error, visible or threshold), black leaves it; the lightest pixel of a block counts"},
    {"param", 'p', "KEY=VALUE", .set = set_param, .role = PT_ROLE_RULE, .identify = identify_params,
     .help = "Parameter of the criterion; may be repeated"},
    {"list-criteria", 0, NULL, TO(action), PT_CLI_LIST_CRITERIA,
     .help = "List the criteria that are found and their parameters, and exit"},
    {"spp-min", 0, "N", TO(render.spp_min), 1, INT32_MAX, .role = PT_ROLE_LIMIT,
     .help = "Samples per pixel before the first check (default 16)"},
    {"spp-max", 0, "N", TO(render.spp_max), 1, INT32_MAX, .role = PT_ROLE_END,
     .help = "Samples per pixel at which every block stops (default 10000)"},
    {"spp", 0, "N", TO(spp), 1, INT32_MAX, .role = BASE_DECIDES, .identify = identify_uniform,
     .help = "The same number of samples everywhere; a criterion, if given, is asked once at the end"},
    {"time-budget", 0, "SECONDS", TO(render.time_budget_s), 0, 1e9,
     .help = "Stop after so long; until then samples go where noise is seen most; 0 = no limit (default)"},
    {"block", 0, "N|WxH", .set = set_block, .role = BASE_DECIDES, .identify = identify_block,
     .help = "Block size in pixels (default 200)"},
    {"max-check-overhead", 0, "SHARE", TO(render.max_check_overhead), 0, 1,
     .help = "Leave out checks while they took more than this share of the time, e.g. 0.03; 0 = no bound (default). With a "
             "bound, as with a time budget, the result depends on the clock"},
    {"max-seam", 0, "RATIO", .set = set_seam, .role = PT_ROLE_LIMIT, .identify = identify_seam,
     .help = "Re-open stopped blocks beside one with more than RATIO times their samples, so that no seam shows; 0 = never "
             "(default)"},
    {.help = "What to render:"},
    {"size", 0, "WxH", .set = set_size, .role = BASE_DECIDES, .identify = identify_size,
     .help = "Image size, instead of the scene's"},
    {"crop", 0, "X0,Y0,X1,Y1", .set = set_crop, .role = BASE_DECIDES, .identify = identify_crop,
     .help = "Keep only these pixels. Blocks that the crop touches are rendered whole, so that they stop as in the full "
             "image"},
    {"look-at", 0, "\"EX EY EZ AX AY AZ UX UY UZ\"", .set = set_look_at, .role = BASE_DECIDES, .identify = identify_look_at,
     .help = "Look from E at A with U up, in the scene's world, instead of through the scene's camera"},
    {"fov", 0, "DEGREES", TO(load.view.fov_deg), 1e-12, 179.9, .role = BASE_DECIDES,
     .help = "Field of view over the image's short side, instead of the scene's"},
    {"light-selection", 0, NULL, TO(load.light_selection), .words = pt_light_selection_words, .role = BASE_DECIDES,
     .identify = identify_light_selection,
     .help = "How next-event estimation picks among many lights (default hierarchy: by distance and orientation too)"},
    {"sampler", 0, NULL, TO(render.integrator.sampler), .words = pt_sampler_words, .role = BASE_DECIDES,
     .help = "Instead of the scene's"},
    {"integrator", 0, NULL, TO(render.integrator.strategy), .words = pt_strategy_words, .role = BASE_DECIDES,
     .help = "path: next-event estimation with multiple importance sampling (default); bsdf-only: brute force, for "
             "checking"},
    {"max-depth", 0, "N", TO(render.integrator.max_depth), -1, 1000000, .role = BASE_DECIDES,
     .help = "Most bounces, instead of the scene's; -1 = unlimited"},
    {"filter", 0, &(PT_FILTERS(PT_WORD_OR) "[:RADIUS]")[1], .set = set_filter, .role = BASE_DECIDES,
     .identify = identify_filter, .help = "Pixel filter, instead of the scene's; radius in pixels"},
    {"seed", 0, "N", TO(render.integrator.seed), 0, UINT32_MAX, .role = BASE_DECIDES,
     .help = "Seed of all random numbers (default 0)"},
    {"effects", 0, NULL, TO(all_effects), .words = effect_words, .help = "all: use the general kernel (same image, slower)"},
    {"strict", 0, NULL, TO(load.strict), .help = "Unsupported scene features are errors"},
    {"threads", 't', "N", TO(threads), 1, 1024,
     .help = "Worker threads (default: all processors that it may use; of several processes on a host, their share)"},
    {"rank-timeout", 0, "SECONDS", TO(rank_timeout_s), 0.1, 1e6,
     .help = "Under mpirun: give up when a process has owed an answer for so long (default 120)"},
    {.help = "What to write:"},
    {"output", 'o', "FILE.exr", TO(paths[PT_OUTPUT]), .output = BASE_FILE, .words = exr,
     .help = "Multi-layer EXR (default: the scene's name in the current folder, if nothing else is asked for)"},
    {"preview", 0, "FILE.png", TO(paths[PT_PREVIEW]), .output = BASE_FILE, .words = png,
     .help = "The image as sRGB, also while rendering"},
    {"stop-map", 0, "FILE.png|FILE.csv", TO_STOP_MAPS, .output = BASE_FILE, .words = png_or_csv,
     .help = "Samples per block as a picture or a table; may be repeated"},
    {"report", 0, "FILE.json", TO(paths[PT_REPORT]), .output = BASE_FILE, .words = json, .help = "Everything about the run"},
    {"live", 0, NULL, TO(live),
     .help = "Write --report and --stop-map while rendering, too, and --preview more often, for python3 -m lull watch"},
    {"html", 0, "FILE.html", TO(paths[PT_PAGE]), .output = BASE_FILE, .words = html,
     .help =
         "All of that as one page for a browser: the picture beside maps of samples, error and time, the history of each "
         "block, what was run where"},
    {"quoted", 0, "FILE.json", TO(paths[PT_QUOTED]), .input = BASE_FILE, .words = json,
     .help = "What --quote --json printed before: the page compares it with what became of it"},
    {"aov", 0, "LIST", TO(render.planes), .set = set_aov, .role = BASE_DECIDES, .help = "More layers: albedo,normal,depth"},
    {"denoise", 0, "blend|full", .set = set_denoise, .optional = 1,
     .help =
         "Keep the denoised picture, and stop blocks by what is seen of it (criterion denoised): blend (default) keeps as "
         "much of the noisy one as the denoiser is wrong, full none"},
    {"reproducible", 0, NULL, TO(reproducible), .help = "Leave times out of the EXR: equal renders are equal files"},
    {"display-server", 0, "HOST[:PORT]", TO(display),
     .help = "Show the image while rendering in an image viewer that listens there (tev, HDRView); port 14158 if none is "
             "named"},
    {"no-progress", 0, NULL, TO(no_progress), .help = "Plain lines now and then, also on a terminal (as with NO_COLOR set)"},
    {"quiet", 'q', NULL, TO(quiet), .help = "No progress, no notes"},
    {.help = "Interrupting and going on:"},
    {"checkpoint", 0, "FILE", TO(paths[PT_CHECKPOINT]), .output = BASE_FILE, .kind = &pt_checkpoint_kind,
     .help = "Save the state of the render now and then, when it is interrupted, and at its end"},
    {"checkpoint-every", 0, "SECONDS", TO(checkpoint_every_s), 0, 1e9, .help = "How often (default 60)"},
    {"resume", 0, NULL, TO(resume),
     .help = "Go on from the checkpoint, also of a finished render, to more samples or by another --visible"},
    {.help = "What it will cost:"},
    {"quote", 0, NULL, TO(quote),
     .help = "Render a pilot only, say what samples and time the whole image will take, and exit; a --checkpoint of the "
             "pilot can be resumed by a render"},
    {"quote-pilot", 0, "SPP[:SECONDS]", .set = set_quote_pilot,
     .help = "The pilot ends at so many samples per pixel or after so long (default 128:30)"},
    {"quote-map", 0, "FILE.png", TO(quote_map), .output = BASE_FILE, .words = png,
     .help = "The predicted time of each block"},
    {"json", 0, NULL, TO(json), .help = "Print the quote as JSON"},
    {.help = "Frames that belong together (names have the frame's number in the place of %d or %04d):"},
    {"frames", 0, "LIST", TO(shot.frames),
     .help =
         "Render these frames of SCENE_%04d.pbrt, e.g. 1-24, 1,5,9 or 1-24:2, whose image (-o OUT_%04d.exr) is not there "
         "yet"},
    {"camera-path", 0, "FILE.csv", TO(shot.camera_path), .input = BASE_FILE,
     .help = "Frames of one scene: below the line frame;eye;at;up;fov one line for each, as for --look-at and --fov"},
    {"frame-seed", 0, NULL, TO(shot.same_seed), .words = frame_seed_words,
     .help = "fresh: each frame has noise of its own (default); fixed: --seed is that of every frame"},
    {"plan-shot", 0, "TABLE.csv", TO(shot.plan), .output = BASE_FILE,
     .help = "Render pilots of some frames only, write what samples each block of each frame needs, say what all will cost, "
             "and exit"},
    {"plan-every", 0, "N", TO(shot.plan_every), 1, 1000000, .help = "The pilots: every N-th frame and the last (default 8)"},
    {"shot-table", 0, "TABLE.csv", TO(shot.table), .input = BASE_FILE,
     .help = "Give every block the samples of this table, instead of asking a criterion"},
    {.help = "Looking inside:"},
    {"explain", 0, NULL, TO(action), PT_CLI_EXPLAIN,
     .help = "Print the scene's effects, why, and the kernel chosen, and exit"},
    {"debug-path", 0, "X,Y,SAMPLE", .set = set_debug_path, .help = "Print one path vertex by vertex, and exit"},
    {.help = "Recording (for training and evaluation):"},
    {"sequence", 0, "DIR", TO(sequence.directory),
     .help = "Record blocks at rising sample counts into DIR; run again to go on"},
    {"planes", 0, "LIST", .set = set_planes,
     .help = "Record whole frames, with these planes as a criterion is shown them (color, half, moment2, albedo, normal, "
             "depth; what the criterion reads always): all blocks at --levels, or without them each at the looks of the "
             "criterion until it stops"},
    {"past-stops", 0, NULL, TO(sequence.past_stops), .help = "Of whole frames: stopped blocks go on to --spp-max"},
    {"levels", 0, "KIND:FIRST:LAST:STEP", TO(sequence.levels),
     .help = "geometric:20:10000:1.15 (default) or linear:20:10000:20"},
    {"blocks", 0, "LIST", TO(sequence.blocks), .help = "Only these blocks, e.g. 0,3,8-11"},
    {"reference-spp", 0, "N", TO(sequence.reference_spp), 0, INT32_MAX,
     .help = "Samples of the reference, or of a whole frame's two, which are independent (default 0: no reference)"},
    {"name", 0, "SCENE[/VIEW]", TO(sequence.name), .help = "Scene and view in the manifest (default: by the file's name)"},
    {"order-seed", 0, "N", TO(render.order_seed), 0, UINT32_MAX, .hidden = 1, .help = ""},
    {0}};

int pt_cli_parse(struct pt_cli *cli, int argc, char **argv, struct base_err *err)
{
    static const struct base_options command = {
        .doc = "Renders a scene block by block and stops each block when its noise can no longer be seen.\v"
               "Exit status: 0 done, 1 memory ran out, 2 bad input or an output could not be written, 130 interrupted "
               "(everything is written all the same).",
        .args_doc = "SCENE.pbrt",
        .list = pt_cli_options,
        .args_max = 1,
        .args = offsetof(struct pt_cli, paths[PT_SCENE]),
        .args_are = BASE_ARGS_FILES,
        .mpi_version = job_mpi_version,
        .outputs = offsetof(struct pt_cli, outputs),
    };
    *cli = (struct pt_cli){
        .render = {.block_width = 200,
                   .block_height = 200,
                   .integrator = {.sampler = -1, .strategy = -1, .filter = -1, .max_depth = PT_CLI_SCENES_DEPTH}},
        .checkpoint_every_s = 60.0,
        .rank_timeout_s = 120.0};
    int rc = base_options_parse(&command, argc, argv, cli, err);
    cli->argv = argv;
    cli->argc = argc;
    if (!rc)
        rc = pt_cli_check(cli, err);
    if (rc)
        pt_cli_release(cli);
    return rc;
}

void pt_cli_release(struct pt_cli *cli)
{
    for (uint32_t i = 0; i < cli->params.count; i++)
        free(cli->params.text[i]);
    cli->params.count = 0;
}
