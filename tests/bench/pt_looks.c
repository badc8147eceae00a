/*
 * What the criterion `denoised` believes at rising numbers of samples, and the pictures that it believes it of.
 *
 *   build/bench/pt_looks SCENE.pbrt SIZE BLOCK SEED FOLDER SPP,SPP,... [KEY=VALUE...]
 *
 * The scene is rendered once, SIZE x SIZE pixels without stopping any of its blocks of BLOCK pixels; FOLDER keeps the film of
 * each number of samples (SPP.film), from which the next run goes on without rendering. Each is shown to the criterion, with
 * these parameters, if any are given: one line of JSON a block. The pictures are written beside the films: SPP-noisy.png,
 * SPP-denoised.png, SPP-blend.png. All times are processor seconds, those of the denoiser's process among them.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "pbrt/load.h"
#include "render/checkpoint.h"
#include "render/host.h"
#include "render/output.h"
#include "support/pt_identity.h"

enum { LEVELS_MAX = 32, BLOCKS_MAX = 1024, PAIRS_MAX = 8 };

static struct {
    const char *scene, *folder;
    int size, block, seed, levels;
    uint64_t spp[LEVELS_MAX];
    struct lull_pair pairs[PAIRS_MAX];
    uint32_t pair_count;
} o;

static double halves[BLOCKS_MAX], crossed[BLOCKS_MAX];

static void die(const struct base_err *err)
{
    fprintf(stderr, "pt_looks: %s\n", err->text);
    exit(2);
}

static void hear(void *context, int32_t level, const char *text)
{
    unsigned id;
    double h, x;
    (void)context;
    if (level <= LULL_LOG_WARNING)
        fprintf(stderr, "pt_looks: %s\n", text);
    else if (sscanf(text, "criterion denoised: denoised: block %u at %*u spp: error %lf by its halves, %lf crossed", &id, &h,
                    &x) == 3 &&
             id < BLOCKS_MAX)
        halves[id] = h, crossed[id] = x;
}

/* A criterion of its own for every look: nothing is remembered. */
static struct lull_host_criterion *open_criterion(const char *name)
{
    const struct lull_host_services services = {
        .struct_size = sizeof services, .threads = 1, .name = "pt_looks", .log = hear};
    const struct lull_criterion *table;
    struct lull_host_criterion *c = NULL;
    struct lull_error e = {.struct_size = sizeof e};
    struct base_err err = {0};
    if (pt_criterion_find(name, NULL, NULL, &table, &err))
        die(&err);
    if (lull_host_create(&services, table, o.pairs, strcmp(name, "denoised") ? 0 : o.pair_count, &c, &e) != LULL_OK) {
        base_fail(&err, BASE_EINVAL, "%s", e.message);
        die(&err);
    }
    return c;
}

static void ask(struct pt_render *r, const char *name, struct lull_decision *d)
{
    static uint32_t all[BLOCKS_MAX];
    struct lull_host_criterion *c = open_criterion(name);
    struct lull_error e = {.struct_size = sizeof e};
    struct base_err err = {0};
    for (uint32_t i = 0; i < r->blocks->count; i++)
        all[i] = i;
    if (lull_host_join(r->frame, c, &e) != LULL_OK ||
        lull_host_evaluate(c, r->frame, &r->shown.view, all, NULL, r->blocks->count, d, &e) != LULL_OK) {
        base_fail(&err, BASE_EINVAL, "%s", e.message);
        die(&err);
    }
    lull_host_close(c);
}

static void name_picture(char path[1024], uint64_t spp, const char *kind)
{
    snprintf(path, 1024, "%s/%llu-%s.png", o.folder, (unsigned long long)spp, kind);
}

/* Three pictures of one number of samples, sRGB; the last is there when all are. */
static void write_pictures(const struct pt_render *r, uint64_t spp)
{
    static const char *const kinds[] = {"noisy", "denoised", "blend"};
    char path[1024];
    struct pt_denoised d;
    struct base_err err = {0};
    name_picture(path, spp, kinds[2]);
    if (access(path, F_OK) == 0)
        return;
    if (pt_denoised_make(r, PT_PICTURE_BLEND, NULL, NULL, NULL, &d, &err))
        die(&err);
    for (int k = 0; k < 3; k++) {
        struct pt_denoised shown = d;
        const struct pt_output_info info = {.denoised = &shown};
        shown.rgb = k == 1 ? d.denoised : d.rgb;
        name_picture(path, spp, kinds[k]);
        if (pt_output_preview(path, r, k ? &info : NULL, &err))
            die(&err);
    }
    pt_denoised_release(&d);
}

static void look(struct pt_render *r, uint64_t spp)
{
    struct lull_decision noisy[BLOCKS_MAX], d[BLOCKS_MAX];
    double before_s = base_clock_process_s(), spent;
    ask(r, "denoised", d);
    spent = base_clock_process_s() - before_s;
    ask(r, "observer", noisy);
    for (uint32_t i = 0; i < r->blocks->count; i++)
        printf("{\"spp\": %llu, \"block\": %u, \"error\": %.6f, \"halves\": %.6f, \"crossed\": %.6f, \"noisy\": %.6f, "
               "\"look_s\": %.4f}\n",
               (unsigned long long)spp, i, d[i].error, halves[i], crossed[i], noisy[i].error, spent / r->blocks->count);
    fflush(stdout);
}

/* The film of every number of samples: rendered, or as it was kept. */
static void run(const struct pt_render_config *config, struct pt_scene *scene, struct base_threads *threads)
{
    const struct pt_render_hooks hooks = {0};
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    struct base_err err = {0};
    struct pt_render *r = NULL;
    int stopped = 0;
    for (int k = 0; k < o.levels; k++) {
        char path[1024], settings[64];
        snprintf(settings, sizeof settings, "size=%d block=%d seed=%d\n", o.size, o.block, o.seed);
        snprintf(path, sizeof path, "%s/%llu.film", o.folder, (unsigned long long)o.spp[k]);
        if (!r && pt_render_create(config, scene, kernel, threads, NULL, &r, &err))
            die(&err);
        if (access(path, F_OK) == 0) {
            pt_render_destroy(r); /* a checkpoint wants a fresh one */
            r = NULL;
            if (pt_render_create(config, scene, kernel, threads, NULL, &r, &err) ||
                pt_checkpoint_load(path, r, PT_IDENTITY(settings), &err))
                die(&err);
        } else if (pt_render_advance(r, o.spp[k], &hooks, &stopped, &err) ||
                   pt_checkpoint_save(path, r, PT_IDENTITY(settings), &err)) {
            die(&err);
        }
        write_pictures(r, o.spp[k]);
        look(r, o.spp[k]);
    }
    pt_render_destroy(r);
}

static void read_words(int argc, char **argv)
{
    if (argc < 7) {
        fprintf(stderr, "usage: pt_looks SCENE.pbrt SIZE BLOCK SEED FOLDER SPP,SPP,... [KEY=VALUE...]\n");
        exit(2);
    }
    o.scene = argv[1], o.folder = argv[5];
    o.size = atoi(argv[2]), o.block = atoi(argv[3]), o.seed = atoi(argv[4]);
    for (char *at = strtok(argv[6], ","); at && o.levels < LEVELS_MAX; at = strtok(NULL, ","))
        o.spp[o.levels++] = strtoull(at, NULL, 10);
    for (int i = 7; i < argc && o.pair_count < PAIRS_MAX; i++, o.pair_count++) {
        o.pairs[o.pair_count].key = strtok(argv[i], "=");
        o.pairs[o.pair_count].value = strtok(NULL, "");
    }
    mkdir(o.folder, 0777);
}

int main(int argc, char **argv)
{
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    struct pt_scene *scene;
    read_words(argc, argv);
    const struct pt_load_options load = {.width = o.size, .height = o.size};
    if (pt_scene_load(o.scene, &load, &scene, &defaults, &err))
        die(&err);
    struct base_threads *threads = base_threads_create(base_threads_available(), &err);
    struct pt_render_config config = {.width = o.size,
                                      .height = o.size,
                                      .crop = {0, 0, o.size, o.size},
                                      .block_width = o.block,
                                      .block_height = o.block,
                                      .spp_min = o.spp[o.levels - 1],
                                      .spp_max = o.spp[o.levels - 1],
                                      .uniform = 1,
                                      .planes = PT_FILM_HALF | PT_FILM_ALBEDO | PT_FILM_NORMAL,
                                      .integrator = defaults.integrator};
    config.integrator.seed = (uint32_t)o.seed;
    if (!threads)
        die(&err);
    run(&config, scene, threads);
    base_threads_destroy(threads);
    pt_scene_destroy(scene);
    return 0;
}
