/* `ggn visible REFERENCE IMAGE...`: in which blocks the model observer still sees noise. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"
#include "cli/commands.h"
#include "sight/remaining.h"
#include "picture/png.h"

enum { MAX_IMAGES = 1024, MAX_SIZES = 8 };

struct options {
    const char *paths[1 + MAX_IMAGES];
    int path_count;
    const char *map_path, *observer_path, *second_path;
    struct sizes {
        int block[MAX_SIZES], count;
    } sizes;
    int json;
};

static int set_sizes(void *into, const char *value, struct base_err *err)
{
    struct sizes *sizes = &((struct options *)into)->sizes;
    char text[128];
    int64_t n;
    sizes->count = 0;
    if (strlen(value) >= sizeof text)
        return base_fail(err, BASE_EINVAL, "expected at most %d sizes", MAX_SIZES);
    strcpy(text, value);
    for (char *one = text, *comma; one; one = comma) {
        comma = strchr(one, ',');
        if (comma)
            *comma++ = '\0';
        if (sizes->count == MAX_SIZES || !base_parse_integer(one, 1, 32768, &n))
            return base_fail(err, BASE_EINVAL, "expected at most %d sizes from 1 to 32768", MAX_SIZES);
        sizes->block[sizes->count++] = (int)n;
    }
    return 0;
}

static const char *const pictures[] = {"png", NULL}; /* endings */
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"block", 'b', "PIXELS,...", .set = set_sizes,
     .help = "side of the blocks in pixels (200); several sizes one after the other"},
    {"json", 'j', NULL, TO(json),
     .help = "print JSON, with every block: an object, or of several images or sizes a list of them"},
    {"observer", 'O', "FILE", TO(observer_path), .input = BASE_FILE,
     .help = "parameters of the observer (those this was built with)"},
    {"output", 'o', "MAP.png", TO(map_path), .output = BASE_FILE, .words = pictures,
     .help = "write where: black nothing, light yellow twice what is just seen; blocks with visible noise are framed"},
    {"second", 's', "FILE", TO(second_path), .input = BASE_FILE,
     .help = "another reference, as good and independent of the first: the noise of both is taken out"},
    {0}};

struct result {                   /* of one image and one size of blocks */
    struct ggn_remaining *blocks; /* owns */
    int count, image, block;
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

static void print_text(const struct result *r, const char *path)
{
    const struct ggn_remaining *worst = worst_of(r);
    if (path)
        printf("%s, blocks of %d\n", path, r->block);
    printf("blocks with visible noise  %d of %d\n", visible_count(r), r->count);
    printf("worst block                at %d,%d (%dx%d): %.3f of what is just seen, %.0f %% of viewers see it\n", worst->x,
           worst->y, worst->width, worst->height, worst->error, 100.0 * viewers(r, worst));
}

static void print_json(const struct result *r, const char *path)
{
    printf("{");
    if (path)
        printf("\"image\": %d, \"block\": %d, ", r->image, r->block);
    printf("\"visible\": %d, \"worst\": %.6f, \"blocks\": [", visible_count(r), worst_of(r)->error);
    for (int i = 0; i < r->count; i++) {
        const struct ggn_remaining *b = r->blocks + i;
        printf("%s\n {\"x\": %d, \"y\": %d, \"width\": %d, \"height\": %d, ", i ? "," : "", b->x, b->y, b->width, b->height);
        printf("\"error\": %.6f, \"viewers\": %.6f}", b->error, viewers(r, b));
    }
    printf("]}");
}

static void frame(uint8_t *rgb, int stride, const struct ggn_remaining *b)
{
    for (int y = 0; y < b->height; y++)
        for (int x = 0; x < b->width; x++)
            if (x < 2 || y < 2 || x >= b->width - 2 || y >= b->height - 2)
                for (int c = 0; c < 3; c++)
                    rgb[3 * ((size_t)(b->y + y) * (size_t)stride + (size_t)(b->x + x)) + (size_t)c] = 255;
}

static int write_map(const char *path, const struct result *r, const float *map, const struct pic_image *image,
                     struct base_err *err)
{
    uint8_t *rgb = ggn_cmd_magma(map, 0.5, (size_t)image->width * (size_t)image->height);
    for (int i = 0; rgb && i < r->count; i++)
        if (r->blocks[i].error > 1.0)
            frame(rgb, image->width, r->blocks + i);
    int rc = rgb ? pic_write_png(path, image->width, image->height, 3, rgb, err) : base_fail_nomem(err, path);
    free(rgb);
    return rc;
}

/* r->image by blocks of r->block. */
static int judge(const struct options *o, const struct pic_image *const references[2], const struct pic_image *image,
                 struct result *r, struct base_err *err)
{
    float *map = o->map_path ? malloc((size_t)image->width * (size_t)image->height * sizeof *map) : NULL;
    r->count = ggn_remaining_count(image->width, image->height, r->block);
    r->blocks = malloc((size_t)r->count * sizeof *r->blocks);
    int rc = r->blocks && (map || !o->map_path) ? 0 : base_fail_nomem(err, "blocks of an image");
    if (!rc)
        rc = ggn_remaining(r->observer, references, image, r->block, r->blocks, map, err);
    if (!rc && map)
        rc = write_map(o->map_path, r, map, image, err);
    free(map);
    return rc;
}

/* results: of each size of blocks. */
static int judge_image(const char *command, const struct options *o, struct result *results, struct base_err *err)
{
    const char *const path = o->paths[1 + results->image];
    struct pic_image images[4] = {{0}}; /* reference, image; second reference, image */
    int rc = ggn_cmd_read_pair(command, (const char *const[]){o->paths[0], path}, images, err);
    if (!rc && o->second_path)
        rc = ggn_cmd_read_pair(command, (const char *const[]){o->second_path, path}, images + 2, err);
    const struct pic_image *const references[2] = {&images[0], o->second_path ? &images[2] : NULL};
    for (int i = 0; i < o->sizes.count && !rc; i++)
        rc = judge(o, references, &images[1], results + i, err);
    for (int i = 0; i < 4; i++)
        pic_release(&images[i]);
    return rc;
}

static void print_all(const struct options *o, const struct result *results, int count)
{
    for (int i = 0; i < count; i++) {
        const char *path = count > 1 ? o->paths[1 + results[i].image] : NULL;
        if (o->json && path)
            printf("%s", i ? ",\n" : "[");
        (o->json ? print_json : print_text)(results + i, path);
    }
    if (o->json)
        printf(count > 1 ? "]\n" : "\n");
}

/* All is judged before anything is said. */
static int run(const char *command, const struct options *o, const struct ggn_observer *observer, struct base_err *err)
{
    const int images = o->path_count - 1, count = images * o->sizes.count;
    struct result *results = calloc((size_t)count, sizeof *results);
    int rc = results ? 0 : base_fail_nomem(err, "images");
    if (!rc && count > 1 && o->map_path)
        rc = base_fail(err, BASE_EINVAL, "--output: a map is of one image and one size of blocks");
    for (int i = 0; i < count && results; i++)
        results[i] =
            (struct result){.image = i / o->sizes.count, .block = o->sizes.block[i % o->sizes.count], .observer = observer};
    for (int i = 0; i < images && !rc; i++)
        rc = judge_image(command, o, results + i * o->sizes.count, err);
    if (!rc)
        print_all(o, results, count);
    for (int i = 0; i < count && results; i++)
        free(results[i].blocks);
    free(results);
    return rc;
}

int ggn_cmd_visible(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "REFERENCE IMAGE...",
        .args_min = 2,
        .args_max = 1 + MAX_IMAGES,
        .args_are = BASE_ARGS_FILES,
        .args = offsetof(struct options, paths),
        .arg_count = offsetof(struct options, path_count),
        .doc = "Where the noise of an image is still seen, against a reference of the same view: the model observer's error "
               "of each block, 1 where noise is just not seen, and the share of viewers who see it."};
    struct options o = {.sizes = {{200}, 1}};
    struct ggn_observer observer = ggn_observer_default;
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc && o.observer_path)
        rc = ggn_observer_read(o.observer_path, NULL, &observer, err);
    return rc ? rc : run(argv[0], &o, &observer, err);
}
