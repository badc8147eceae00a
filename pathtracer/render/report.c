#include "render/output.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fio.h"

/* NaN and infinity have no form in JSON: null says "not known". */
static void add_number(cJSON *object, const char *key, double value)
{
    if (isfinite(value))
        cJSON_AddNumberToObject(object, key, value);
    else
        cJSON_AddNullToObject(object, key);
}

/* One number for square blocks, [width, height] for others. */
static void add_block_size(cJSON *root, int width, int height)
{
    if (width == height) {
        add_number(root, "block", width);
        return;
    }
    cJSON *block = cJSON_AddArrayToObject(root, "block");
    cJSON_AddItemToArray(block, cJSON_CreateNumber(width));
    cJSON_AddItemToArray(block, cJSON_CreateNumber(height));
}

static void add_criterion(cJSON *root, const struct pt_render *r, const struct pt_output_info *info)
{
    if (r->criterion == NULL) {
        cJSON_AddNullToObject(root, "criterion");
        return;
    }
    const struct lull_criterion *t = pt_criterion_table(r->criterion);
    cJSON *c = cJSON_AddObjectToObject(root, "criterion");
    cJSON_AddStringToObject(c, "id", t->id);
    cJSON_AddStringToObject(c, "version", t->version);
    cJSON *params = cJSON_AddObjectToObject(c, "params");
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        const char *value = p->default_value;
        for (uint32_t k = 0; k < info->param_count; k++)
            if (strcmp(info->params[k].key, p->name) == 0)
                value = info->params[k].value;
        if (value != NULL)
            cJSON_AddStringToObject(params, p->name, value);
        else
            cJSON_AddNullToObject(params, p->name);
    }
}

static void add_blocks(cJSON *root, const struct pt_render *r)
{
    cJSON *list = cJSON_AddArrayToObject(root, "blocks");
    for (uint32_t i = 0; i < r->blocks.count; i++) {
        const struct pt_block *b = &r->blocks.list[i];
        cJSON *o = cJSON_CreateObject();
        cJSON_AddItemToArray(list, o);
        add_number(o, "id", b->id);
        add_number(o, "x0", b->x0);
        add_number(o, "y0", b->y0);
        add_number(o, "x1", b->x1);
        add_number(o, "y1", b->y1);
        add_number(o, "spp", (double)b->spp);
        cJSON_AddStringToObject(o, "reason", pt_block_reason_name(b->reason));
        add_number(o, "p_noisy", b->p_noisy);
        add_number(o, "error", b->error);
        add_number(o, "checks", b->checks);
        add_number(o, "thread_s", b->thread_s);
    }
}

static void add_totals(cJSON *root, const struct pt_render *r)
{
    const struct pt_render_totals *t = &r->totals;
    cJSON *o = cJSON_AddObjectToObject(root, "totals");
    add_number(o, "samples", (double)t->samples);
    add_number(o, "render_s", t->render_s);
    add_number(o, "criterion_s", t->criterion_s);
    add_number(o, "paths", (double)t->paths);
    add_number(o, "rays", (double)t->rays);
    add_number(o, "paths_per_s", t->render_s > 0.0 ? (double)t->paths / t->render_s : NAN);
    add_number(o, "rays_per_s", t->render_s > 0.0 ? (double)t->rays / t->render_s : NAN);
    add_number(o, "dropped_samples", (double)t->dropped);
}

/* The first few dropped samples, for --debug-path. */
static void add_dropped(cJSON *root, const struct pt_render *r)
{
    cJSON *list = cJSON_AddArrayToObject(root, "dropped");
    for (uint32_t i = 0; i < r->dropped_count; i++) {
        cJSON *o = cJSON_CreateObject();
        cJSON_AddItemToArray(list, o);
        add_number(o, "x", r->dropped[i].x);
        add_number(o, "y", r->dropped[i].y);
        add_number(o, "sample", r->dropped[i].sample);
    }
}

static void add_memory(cJSON *root, const struct pt_render *r, const struct pt_output_info *info)
{
    cJSON *o = cJSON_AddObjectToObject(root, "memory");
    add_number(o, "film_bytes", (double)r->film.bytes);
    add_number(o, "film_bytes_per_pixel", (double)r->film.bytes / (double)r->film.pixels);
    add_number(o, "scene_bytes", info->scene_bytes >= 0 ? (double)info->scene_bytes : NAN);
}

int pt_output_report(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct pt_err *err)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "scene", info->scene);
    add_number(root, "width", r->config.width);
    add_number(root, "height", r->config.height);
    add_block_size(root, r->config.block_width, r->config.block_height);
    add_number(root, "seed", r->config.integrator.seed);
    add_number(root, "threads", info->threads);
    add_criterion(root, r, info);
    cJSON *effects = cJSON_AddArrayToObject(root, "effects");
    for (int i = 0; i < PT_FX_COUNT; i++)
        if (info->effects >> i & 1)
            cJSON_AddItemToArray(effects, cJSON_CreateString(pt_effects_name(i)));
    add_blocks(root, r);
    add_totals(root, r);
    cJSON_AddBoolToObject(root, "interrupted", info->interrupted);
    cJSON_AddStringToObject(root, "kernel", info->kernel);
    add_dropped(root, r);
    add_memory(root, r, info);
    char *text = cJSON_Print(root);
    cJSON_Delete(root);
    if (text == NULL)
        return pt_fail_nomem(err, "report");
    struct pt_fio_out out;
    int rc = pt_fio_begin(&out, path, err);
    if (rc == PT_OK) {
        fprintf(out.file, "%s\n", text);
        rc = pt_fio_commit(&out, err);
    }
    cJSON_free(text);
    return rc;
}
