/* `ggn visible REFERENCE IMAGE`: in which blocks the model observer still sees noise. */
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "cli/commands.h"
#include "sight/remaining.h"
#include "picture/png.h"

struct options {
    const char *paths[2];
    const char *map_path, *observer_path, *second_path;
    int block, json;
};

static const char *const pictures[] = {"png", NULL}; /* endings */
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"block", 'b', "PIXELS", TO(block), 1, 32768, .help = "side of the blocks in pixels (200)"},
    {"json", 'j', NULL, TO(json), .help = "print one JSON object, with every block"},
    {"observer", 'O', "FILE", TO(observer_path), .input = BASE_FILE,
     .help = "parameters of the observer (those this was built with)"},
    {"output", 'o', "MAP.png", TO(map_path), .output = BASE_FILE, .words = pictures,
     .help = "write where: black nothing, light yellow twice what is just seen; blocks with visible noise are framed"},
    {"second", 's', "FILE", TO(second_path), .input = BASE_FILE,
     .help = "another reference, as good and independent of the first: the noise of both is taken out"},
    {0}};

struct result {
    const struct ggn_remaining *blocks;
    int count;
    const struct ggn_observer *observer;
};

static const struct ggn_remaining *worst_of(const struct result *r)
{
    const struct ggn_remaining *worst = r->blocks;
    for (int i = 1; i < r->count; i++)
        worst = r->blocks[i].error > worst->error ? r->blocks + i : worst;
    return worst;
}

static int visible_count(const struct result *r)
{
    int count = 0;
    for (int i = 0; i < r->count; i++)
        count += r->blocks[i].error > 1.0;
    return count;
}

static double viewers(const struct result *r, const struct ggn_remaining *b)
{
    return ggn_observer_p_noisy(r->observer, b->error);
}

static void print_text(const struct result *r)
{
    const struct ggn_remaining *worst = worst_of(r);
    printf("blocks with visible noise  %d of %d\n", visible_count(r), r->count);
    printf("worst block                at %d,%d (%dx%d): %.3f of what is just seen, %.0f %% of viewers see it\n", worst->x,
           worst->y, worst->width, worst->height, worst->error, 100.0 * viewers(r, worst));
}

static void print_json(const struct result *r)
{
    printf("{\"visible\": %d, \"worst\": %.6f, \"blocks\": [", visible_count(r), worst_of(r)->error);
    for (int i = 0; i < r->count; i++) {
        const struct ggn_remaining *b = r->blocks + i;
        printf("%s\n {\"x\": %d, \"y\": %d, \"width\": %d, \"height\": %d, ", i ? "," : "", b->x, b->y, b->width, b->height);
        printf("\"error\": %.6f, \"viewers\": %.6f}", b->error, viewers(r, b));
    }
    printf("]}\n");
}

static void frame(uint8_t *rgb, int stride, const struct ggn_remaining *b)
{
    for (int y = 0; y < b->height; y++)
        for (int x = 0; x < b->width; x++)
            if (x < 2 || y < 2 || x >= b->width - 2 || y >= b->height - 2)
                for (int c = 0; c < 3; c++)
                    rgb[3 * ((size_t)(b->y + y) * (size_t)stride + (size_t)(b->x + x)) + (size_t)c] = 255;
}

static int run(const struct options *o, const struct pic_image images[4], struct base_err *err)
{
    int width = images[1].width, height = images[1].height, count = ggn_remaining_count(width, height, o->block);
    const struct pic_image *const references[2] = {&images[0], o->second_path ? &images[2] : NULL};
    struct ggn_observer observer = ggn_observer_default;
    struct ggn_remaining *blocks = NULL;
    float *map = NULL;
    int rc = 0;
    if (o->observer_path)
        rc = ggn_observer_read(o->observer_path, NULL, &observer, err);
    if (!rc && (!(blocks = malloc((size_t)count * sizeof *blocks)) ||
                (o->map_path && !(map = malloc((size_t)width * (size_t)height * sizeof *map)))))
        rc = base_fail_nomem(err, "blocks of an image");
    if (!rc)
        rc = ggn_remaining(&observer, references, &images[1], o->block, blocks, map, err);
    struct result result = {blocks, count, &observer};
    if (!rc && map) {
        uint8_t *rgb = ggn_cmd_magma(map, 0.5, (size_t)width * (size_t)height);
        for (int i = 0; rgb && i < count; i++)
            if (blocks[i].error > 1.0)
                frame(rgb, width, blocks + i);
        rc = rgb ? pic_write_png(o->map_path, width, height, 3, rgb, err) : base_fail_nomem(err, o->map_path);
        free(rgb);
    }
    if (!rc)
        (o->json ? print_json : print_text)(&result);
    free(map);
    free(blocks);
    return rc;
}

int ggn_cmd_visible(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "REFERENCE IMAGE",
        .args_min = 2,
        .args_max = 2,
        .args_are = BASE_ARGS_FILES,
        .args = offsetof(struct options, paths),
        .doc = "Where the noise of an image is still seen, against a reference of the same view: the model observer's error "
               "of each block, 1 where noise is just not seen, and the share of viewers who see it."};
    struct options o = {.block = 200};
    struct pic_image images[4] = {{0}}; /* reference, image; second reference, image */
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc)
        rc = ggn_cmd_read_pair(argv[0], o.paths, images, err);
    if (!rc && o.second_path)
        rc = ggn_cmd_read_pair(argv[0], (const char *const[]){o.second_path, o.paths[1]}, images + 2, err);
    if (!rc)
        rc = run(&o, images, err);
    for (int i = 0; i < 4; i++)
        pic_release(&images[i]);
    return rc;
}
