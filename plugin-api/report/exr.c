#include "report/report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json.h"
#include "base/options.h"
#include "host/frame.h"
#include "picture/read.h"

enum { SCENE, CRITERION, EFFECTS, BLOCK, SEED, SECONDS, SOFTWARE, ATTRIBUTES };
enum { SPP, P_NOISY, ERROR, REASON, NOISY_ERROR, LAYERS };

/* More make a page that no browser shows. */
enum { MOST_BLOCKS = 1 << 18 };

static const char *const layer_names[LAYERS] = {"lull.spp.V", "lull.p_noisy.V", "lull.error.V", "lull.reason.V",
                                                "lull.noisy_error.V"};
static const double most_spp = 9007199254740992.0; /* 2^53 */

struct source {
    const char *path;
    struct pic_window window;
    struct pic_attribute attributes[ATTRIBUTES];
    struct lull_host_blocks blocks;
    double *noisy_error; /* by block; NULL: it was not denoised */
};

static int64_t cells(int32_t from, int32_t to, uint32_t size) { return (to - 1) / (int32_t)size - from / (int32_t)size + 1; }

static int lay_out(struct source *s, struct base_err *err)
{
    const struct pic_window *w = &s->window;
    struct lull_host_config config = {
        .struct_size = sizeof config, .width = (uint32_t)w->width, .height = (uint32_t)w->height};
    struct lull_error e = {.struct_size = sizeof e};
    int block[2];
    if (!base_parse_block(s->attributes[BLOCK].text, INT32_MAX, block))
        return base_fail(err, BASE_EINVAL, "%s: lull:block is '%s' (expected the size of its blocks, as 200x200)", s->path,
                         s->attributes[BLOCK].text);
    config.block_width = (uint32_t)block[0];
    config.block_height = (uint32_t)block[1];
    if (cells(w->x0, w->x1, config.block_width) * cells(w->y0, w->y1, config.block_height) > MOST_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: more than %d blocks of %s pixels (lull:block)", s->path, MOST_BLOCKS,
                         s->attributes[BLOCK].text);
    memcpy(config.crop, (const int32_t[]){w->x0, w->y0, w->x1, w->y1}, sizeof config.crop);
    return lull_host_lay_out(&config, NULL, 1, &s->blocks, &e) == LULL_OK
               ? 0
               : base_fail(err, e.code == LULL_E_MEMORY ? BASE_ENOMEM : BASE_EINVAL, "%s: %s", s->path, e.message);
}

/* The layer's value in a block, which has one; of samples, of which a pixel may have dropped some, the most. Returns whether
 * it is so. */
static int find_value(const struct source *s, const float *plane, int layer, const struct lull_host_block *b, double *value)
{
    const size_t stride = (size_t)(s->window.x1 - s->window.x0);
    const float *row = plane + (size_t)(b->y0 - s->window.y0) * stride + (b->x0 - s->window.x0);
    *value = (double)row[0];
    for (int32_t y = b->y0; y < b->y1; y++, row += stride) {
        for (int32_t x = 0; x < b->x1 - b->x0; x++) {
            const double v = (double)row[x];
            if (layer == SPP && !(v >= 0.0 && v <= most_spp))
                return 0;
            if (layer == SPP)
                *value = fmax(*value, v);
            else if (v != *value && !(isnan(v) && isnan(*value)))
                return 0;
        }
    }
    return layer != REASON || (*value >= 0.0 && *value < LULL_REASON_COUNT && *value == floor(*value));
}

static int take_layer(struct source *s, const struct pic_image *image, int layer, struct base_err *err)
{
    const struct pic_window *w = &s->window;
    if (!image->f32 || image->width != w->x1 - w->x0 || image->height != w->y1 - w->y0)
        return base_fail(err, BASE_EINVAL, "%s: its layer '%s' has another size", s->path, layer_names[layer]);
    for (uint32_t i = 0; i < s->blocks.count; i++) {
        struct lull_host_block *b = &s->blocks.list[i];
        double value;
        if (!find_value(s, image->f32, layer, b, &value))
            return base_fail(err, BASE_EINVAL,
                             "%s: its layer '%s' is not of blocks of %s pixels (lull:block), as %d,%d,%d,%d", s->path,
                             layer_names[layer], s->attributes[BLOCK].text, b->x0, b->y0, b->x1, b->y1);
        switch (layer) {
        case SPP: b->spp = (uint64_t)value; break;
        case P_NOISY: b->p_noisy = value; break;
        case ERROR: b->error = value; break;
        case REASON: b->reason = (int32_t)value; break;
        default: s->noisy_error[i] = value; break;
        }
    }
    return 0;
}

static int read_layer(struct source *s, int layer, struct base_err *err)
{
    struct pic_image image = {0};
    struct base_err why = {0};
    int rc = pic_read_channel(s->path, layer_names[layer], &image, &why);
    if (rc == BASE_EINVAL && layer == NOISY_ERROR)
        return 0;
    if (rc)
        return base_fail(err, rc, "%s (expected a picture of Lull's, or its report before it)", why.text);
    if (layer == SPP)
        rc = lay_out(s, err);
    if (!rc && layer == NOISY_ERROR && !(s->noisy_error = calloc(s->blocks.count, sizeof *s->noisy_error)))
        rc = base_fail_nomem(err, s->path);
    if (!rc)
        rc = take_layer(s, &image, layer, err);
    pic_release(&image);
    return rc;
}

static double number(const char *text)
{
    char *end;
    const double value = strtod(text, &end);
    return end == text ? (double)NAN : value;
}

/* "ID VERSION KEY=VALUE …", as the file says it. A value may hold spaces: the last one before the next '=' ends it. */
static void add_criterion(cJSON *root, char *text, int *failed)
{
    char *version = strchr(text, ' ');
    if (!version) { /* none was asked */
        base_json_text(root, "criterion", NULL, failed);
        return;
    }
    *version++ = '\0';
    char *key = strchr(version, ' ');
    if (key)
        *key++ = '\0';
    cJSON *o = base_json_object(root, "criterion", failed);
    base_json_text(o, "id", text, failed);
    base_json_text(o, "version", version, failed);
    cJSON *params = base_json_object(o, "params", failed);
    for (char *value = key ? strchr(key, '=') : NULL; value; value = key ? strchr(key, '=') : NULL) {
        *value++ = '\0';
        char *next = strchr(value, '='), *space = NULL;
        for (char *at = value; next && at < next; at++)
            space = *at == ' ' ? at : space;
        if (space)
            *space = '\0';
        base_json_text(params, key, value, failed);
        key = space ? space + 1 : NULL;
    }
}

static void add_effects(cJSON *root, char *text, int *failed)
{
    cJSON *list = base_json_array(root, "effects", failed);
    char *rest;
    for (char *name = strtok_r(text, ",", &rest); name; name = strtok_r(NULL, ",", &rest))
        base_json_text(list, NULL, name, failed);
}

/* Returns the samples of all. */
static double add_blocks(cJSON *root, const struct source *s, int *failed)
{
    double samples = 0.0;
    cJSON *list = base_json_array(root, "blocks", failed);
    for (uint32_t i = 0; i < s->blocks.count; i++) {
        const struct lull_host_block *b = &s->blocks.list[i];
        lull_host_report_block(list, b, s->noisy_error ? &s->noisy_error[i] : NULL, failed);
        samples += (double)b->spp * (b->x1 - b->x0) * (b->y1 - b->y0);
    }
    return samples;
}

/* NULL: no memory. */
static char *make(struct source *s)
{
    const struct pic_window *w = &s->window;
    struct pic_attribute *a = s->attributes;
    int failed = 0;
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "scene", a[SCENE].text, &failed);
    base_json_number(root, "width", w->width, &failed);
    base_json_number(root, "height", w->height, &failed);
    base_json_numbers(root, "crop", (const double[]){w->x0, w->y0, w->x1, w->y1}, 4, &failed);
    base_json_number(root, "seed", number(a[SEED].text), &failed);
    add_criterion(root, a[CRITERION].text, &failed);
    add_effects(root, a[EFFECTS].text, &failed);
    const double samples = add_blocks(root, s, &failed);
    cJSON *totals = base_json_object(root, "totals", &failed);
    base_json_number(totals, "samples", samples, &failed);
    base_json_number(totals, "elapsed_s", number(a[SECONDS].text), &failed);
    base_json_text(root, "software", *a[SOFTWARE].text ? a[SOFTWARE].text : NULL, &failed);
    char *text = failed ? NULL : cJSON_PrintUnformatted(root);
    cJSON_Delete(root);
    return text;
}

int report_from_exr(const char *path, char **report, struct base_err *err)
{
    static const char *const names[ATTRIBUTES] = {"lull:scene", "lull:criterion", "lull:effects", "lull:block",
                                                  "lull:seed",  "lull:seconds",   "software"};
    struct source s = {.path = path};
    *report = NULL;
    for (int i = 0; i < ATTRIBUTES; i++)
        s.attributes[i].name = names[i];
    int rc = pic_read_header(path, &s.window, s.attributes, ATTRIBUTES, err);
    for (int layer = 0; layer < LAYERS && !rc; layer++)
        rc = read_layer(&s, layer, err);
    if (!rc && !(*report = make(&s)))
        rc = base_fail_nomem(err, path);
    free(s.blocks.list);
    free(s.noisy_error);
    return rc;
}
