#include "render/output.h"

#include <math.h>
#include <string.h>

#include "base/json.h"

/* One number for square blocks, [width, height] for others. */
static void add_block_size(cJSON *root, int width, int height, int *failed)
{
    if (width == height) {
        base_json_number(root, "block", width, failed);
        return;
    }
    cJSON *block = base_json_array(root, "block", failed);
    base_json_number(block, NULL, width, failed);
    base_json_number(block, NULL, height, failed);
}

static void add_criterion(cJSON *root, const struct pt_render *r, const struct pt_output_info *info, int *failed)
{
    if (!r->criterion) {
        base_json_text(root, "criterion", NULL, failed);
        return;
    }
    const struct lull_criterion *t = r->criterion->table;
    cJSON *c = base_json_object(root, "criterion", failed);
    base_json_text(c, "id", t->id, failed);
    base_json_text(c, "version", t->version, failed);
    cJSON *params = base_json_object(c, "params", failed);
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        const char *value = p->default_value;
        for (uint32_t k = 0; k < info->param_count; k++)
            if (strcmp(info->params[k].key, p->name) == 0)
                value = info->params[k].value;
        base_json_text(params, p->name, value, failed);
    }
}

static void add_blocks(cJSON *root, const struct pt_render *r, int *failed)
{
    cJSON *list = base_json_array(root, "blocks", failed);
    for (uint32_t i = 0; i < r->blocks.count; i++) {
        const struct pt_block *b = &r->blocks.list[i];
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_number(o, "id", b->id, failed);
        base_json_number(o, "x0", b->x0, failed);
        base_json_number(o, "y0", b->y0, failed);
        base_json_number(o, "x1", b->x1, failed);
        base_json_number(o, "y1", b->y1, failed);
        base_json_number(o, "spp", (double)b->spp, failed);
        base_json_text(o, "reason", pt_block_reason_name(b->reason), failed);
        base_json_number(o, "p_noisy", b->p_noisy, failed);
        base_json_number(o, "error", b->error, failed);
        base_json_number(o, "checks", b->checks, failed);
        base_json_number(o, "thread_s", b->thread_s, failed);
        base_json_number(o, "dial", r->criterion ? pt_mask_scale(r->criterion->step[i]) : NAN, failed);
    }
}

static void add_totals(cJSON *root, const struct pt_render *r, int *failed)
{
    const struct pt_render_totals *t = &r->totals;
    cJSON *o = base_json_object(root, "totals", failed);
    base_json_number(o, "samples", (double)t->samples, failed);
    base_json_number(o, "render_s", t->render_s, failed);
    base_json_number(o, "criterion_s", t->criterion_s, failed);
    base_json_number(o, "criterion_thread_s", r->criterion_thread_s, failed);
    base_json_number(o, "paths", (double)t->paths, failed);
    base_json_number(o, "rays", (double)t->rays, failed);
    base_json_number(o, "paths_per_s", t->render_s > 0.0 ? (double)t->paths / t->render_s : NAN, failed);
    base_json_number(o, "rays_per_s", t->render_s > 0.0 ? (double)t->rays / t->render_s : NAN, failed);
    base_json_number(o, "dropped_samples", (double)t->dropped, failed);
}

/* How many took part, and what went between them. */
static void add_processes(cJSON *root, const struct pt_crew *crew, int *failed)
{
    base_json_number(root, "processes", pt_crew_processes(crew), failed);
    if (!crew)
        return;
    const struct pt_crew_traffic *traffic = pt_crew_traffic(crew);
    base_json_number(root, "messages", (double)traffic->messages, failed);
    base_json_number(root, "message_bytes", (double)traffic->bytes, failed);
    base_json_number(root, "message_wait_s", traffic->waiting_s, failed);
}

/* The first few dropped samples, for --debug-path. */
static void add_dropped(cJSON *root, const struct pt_render *r, int *failed)
{
    cJSON *list = base_json_array(root, "dropped", failed);
    for (uint32_t i = 0; i < r->dropped_count; i++) {
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_number(o, "x", r->dropped[i].x, failed);
        base_json_number(o, "y", r->dropped[i].y, failed);
        base_json_number(o, "sample", r->dropped[i].sample, failed);
    }
}

static void add_memory(cJSON *root, const struct pt_render *r, const struct pt_output_info *info, int *failed)
{
    cJSON *o = base_json_object(root, "memory", failed);
    base_json_number(o, "film_bytes", (double)r->film.bytes, failed);
    base_json_number(o, "film_bytes_per_pixel", (double)r->film.bytes / (double)r->film.pixels, failed);
    base_json_number(o, "scene_bytes", info->scene_bytes >= 0 ? (double)info->scene_bytes : NAN, failed);
}

int pt_output_report(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct base_err *err)
{
    int failed = 0;
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "scene", info->scene, &failed);
    base_json_number(root, "width", r->config.width, &failed);
    base_json_number(root, "height", r->config.height, &failed);
    add_block_size(root, r->config.block_width, r->config.block_height, &failed);
    base_json_number(root, "seed", r->config.integrator.seed, &failed);
    base_json_number(root, "threads", info->threads, &failed);
    add_processes(root, r->config.crew, &failed);
    add_criterion(root, r, info, &failed);
    base_json_text(root, "mask", info->mask, &failed);
    cJSON *effects = base_json_array(root, "effects", &failed);
    for (int i = 0; i < PT_FX_COUNT; i++)
        if (info->effects >> i & 1)
            base_json_text(effects, NULL, pt_effects_name(i), &failed);
    add_blocks(root, r, &failed);
    add_totals(root, r, &failed);
    base_json_bool(root, "interrupted", info->interrupted, &failed);
    base_json_text(root, "kernel", info->kernel, &failed);
    add_dropped(root, r, &failed);
    add_memory(root, r, info, &failed);
    int rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    return rc;
}
