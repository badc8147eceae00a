#include "host/frame.h"

#include <math.h>
#include <string.h>

#include "base/json.h"

/* What it said, if anything. */
static void add_messages(cJSON *of, struct lull_host_criterion *criterion, int *failed)
{
    pthread_mutex_lock(&criterion->messages_lock);
    cJSON *list = criterion->message_count > 0 ? base_json_array(of, "messages", failed) : NULL;
    for (uint32_t i = 0; i < criterion->message_count; i++)
        base_json_text(list, NULL, criterion->messages[i], failed);
    pthread_mutex_unlock(&criterion->messages_lock);
}

static void add_criterion(cJSON *root, struct lull_host_criterion *criterion, int *failed)
{
    if (!criterion) {
        base_json_text(root, "criterion", NULL, failed);
        return;
    }
    const struct lull_criterion *t = criterion->table;
    cJSON *c = base_json_object(root, "criterion", failed);
    base_json_text(c, "id", t->id, failed);
    base_json_text(c, "version", t->version, failed);
    cJSON *params = base_json_object(c, "params", failed);
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        base_json_text(params, p->name, lull_host_parameter(t, p->name, criterion->pairs, criterion->pair_count, NULL),
                       failed);
    }
    add_messages(c, criterion, failed);
}

cJSON *lull_host_report_block(cJSON *list, const struct lull_host_block *b, const double *noisy_error, int *failed)
{
    cJSON *o = base_json_object(list, NULL, failed);
    base_json_number(o, "id", b->id, failed);
    base_json_number(o, "x0", b->x0, failed);
    base_json_number(o, "y0", b->y0, failed);
    base_json_number(o, "x1", b->x1, failed);
    base_json_number(o, "y1", b->y1, failed);
    base_json_number(o, "spp", (double)b->spp, failed);
    base_json_text(o, "reason", lull_host_reason(b->reason), failed);
    base_json_number(o, "p_noisy", b->p_noisy, failed);
    base_json_number(o, "error", b->error, failed);
    if (noisy_error)
        base_json_number(o, "noisy_error", *noisy_error, failed);
    return o;
}

static void add_blocks(cJSON *root, const struct lull_host_frame *f, const double *noisy_error, int *failed)
{
    cJSON *list = base_json_array(root, "blocks", failed);
    for (uint32_t i = 0; i < f->blocks.count; i++) {
        const struct lull_host_block *b = &f->blocks.list[i];
        cJSON *o = lull_host_report_block(list, b, noisy_error ? &noisy_error[i] : NULL, failed);
        base_json_number(o, "checks", b->checks, failed);
        base_json_number(o, "thread_s", b->thread_s, failed);
        base_json_number(o, "dial", f->criterion ? lull_host_mask_factor(b->step) : (double)NAN, failed);
    }
}

static double per_second(const struct lull_host_totals *t, uint64_t count)
{
    return t->render_s > 0.0 ? (double)count / t->render_s : (double)NAN;
}

static void add_totals(cJSON *root, const struct lull_host_totals *t, int has_rays, int *failed)
{
    cJSON *o = base_json_object(root, "totals", failed);
    base_json_number(o, "samples", (double)t->samples, failed);
    base_json_number(o, "render_s", t->render_s, failed);
    base_json_number(o, "criterion_s", t->criterion_s, failed);
    base_json_number(o, "criterion_thread_s", t->criterion_thread_s, failed);
    base_json_number(o, "paths", (double)t->paths, failed);
    base_json_number(o, "rays", has_rays ? (double)t->rays : (double)NAN, failed);
    base_json_number(o, "paths_per_s", per_second(t, t->paths), failed);
    base_json_number(o, "rays_per_s", has_rays ? per_second(t, t->rays) : (double)NAN, failed);
    base_json_number(o, "dropped_samples", (double)t->dropped, failed);
}

/* How many took part, and what went between them. */
static void add_processes(cJSON *root, const struct lull_host_report *r, int *failed)
{
    base_json_number(root, "processes", r->processes, failed);
    if (!(r->flags & LULL_REPORT_MESSAGES))
        return;
    base_json_number(root, "messages", (double)r->messages, failed);
    base_json_number(root, "message_bytes", (double)r->message_bytes, failed);
    base_json_number(root, "message_wait_s", r->message_wait_s, failed);
}

/* The first few dropped samples, so that their paths can be replayed. */
static void add_dropped(cJSON *root, const struct lull_host_frame *f, int *failed)
{
    cJSON *list = base_json_array(root, "dropped", failed);
    for (uint32_t i = 0; i < f->dropped_count; i++) {
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_number(o, "x", f->dropped[i].x, failed);
        base_json_number(o, "y", f->dropped[i].y, failed);
        base_json_number(o, "sample", f->dropped[i].sample, failed);
    }
}

/* The response at each check, by block: [samples, error, p_noisy]. */
static void add_history(cJSON *root, const struct lull_host_frame *f, int *failed)
{
    uint32_t responses = 0;
    for (uint32_t i = 0; i < f->blocks.count && f->answer_room > 0; i++)
        responses += f->answer_count[i];
    if (responses == 0)
        return;
    cJSON *list = base_json_array(root, "history", failed);
    for (uint32_t i = 0; i < f->blocks.count; i++) {
        cJSON *block = base_json_array(list, NULL, failed);
        for (uint32_t k = 0; k < f->answer_count[i]; k++) {
            const struct lull_host_answer *a = &f->answers[(size_t)i * f->answer_room + k];
            base_json_numbers(block, NULL, (const double[]){(double)a->spp, a->error, a->p_noisy}, 3, failed);
        }
    }
}

/* Where it was made, as far as the renderer says. */
static void add_origin(cJSON *root, const struct lull_host_report *r, int *failed)
{
    if (!LULL_HAS(struct lull_host_report, r, command_count))
        return;
    base_json_text(root, "software", r->software, failed);
    base_json_text(root, "processor", r->processor, failed);
    cJSON *command = base_json_array(root, "command", failed);
    for (uint64_t i = 0; i < r->command_count; i++)
        base_json_text(command, NULL, r->command[i], failed);
}

/* The caller deletes it. */
static cJSON *make(const struct lull_host_frame *f, const struct lull_host_report *r, int *failed)
{
    const int32_t *c = f->config.crop;
    const double crop[] = {c[0], c[1], c[2], c[3]}, size[] = {f->blocks.block_width, f->blocks.block_height};
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "scene", r->scene, failed);
    base_json_number(root, "width", f->config.width, failed);
    base_json_number(root, "height", f->config.height, failed);
    if (crop[2] != 0 && (crop[2] - crop[0] != f->config.width || crop[3] - crop[1] != f->config.height))
        base_json_numbers(root, "crop", crop, 4, failed);
    if (size[0] == size[1])
        base_json_number(root, "block", size[0], failed);
    else
        base_json_numbers(root, "block", size, 2, failed);
    base_json_number(root, "seed", (double)f->config.seed, failed);
    base_json_number(root, "threads", r->threads, failed);
    add_processes(root, r, failed);
    add_criterion(root, f->criterion, failed);
    base_json_text(root, "mask", r->mask, failed);
    cJSON *effects = base_json_array(root, "effects", failed);
    for (uint32_t i = 0; i < r->effect_count; i++)
        base_json_text(effects, NULL, r->effects[i], failed);
    add_blocks(root, f, r->flags & LULL_REPORT_DENOISED ? r->noisy_error : NULL, failed);
    add_history(root, f, failed);
    add_totals(root, &f->totals, !(r->flags & LULL_REPORT_NO_RAYS), failed);
    const uint64_t phases = LULL_HAS(struct lull_host_report, r, phase_count) ? r->phase_count : 0;
    cJSON *seconds = phases > 0 ? base_json_object(root, "phases", failed) : NULL;
    for (uint64_t i = 0; i < phases; i++)
        base_json_number(seconds, r->phases[i].name, r->phases[i].seconds, failed);
    base_json_bool(root, "interrupted", (r->flags & LULL_REPORT_INTERRUPTED) != 0, failed);
    base_json_text(root, "kernel", r->kernel, failed);
    if (r->flags & LULL_REPORT_DENOISED)
        base_json_number(root, "noisy_weight", r->noisy_weight, failed);
    add_dropped(root, f, failed);
    cJSON *memory = base_json_object(root, "memory", failed);
    base_json_number(memory, "film_bytes", (double)r->film_bytes, failed);
    base_json_number(memory, "film_bytes_per_pixel", (double)r->film_bytes / (double)r->film_pixels, failed);
    base_json_number(memory, "scene_bytes", r->scene_bytes, failed);
    add_origin(root, r, failed);
    return root;
}

static int32_t check_report(const struct lull_host_report *r, struct lull_error *err)
{
    if (r->struct_size < offsetof(struct lull_host_report, software))
        return lull_error_set(err, LULL_E_VERSION, "the report is smaller than in version 1.0");
    if (r->effect_count > 0 && !r->effects)
        return lull_error_set(err, LULL_E_INVALID, "the report: effects is NULL, effect_count is %u", r->effect_count);
    if (LULL_HAS(struct lull_host_report, r, command_count) && r->command_count > 0 && !r->command)
        return lull_error_set(err, LULL_E_INVALID, "the report: command is NULL, command_count is %llu",
                              (unsigned long long)r->command_count);
    if (LULL_HAS(struct lull_host_report, r, phase_count) && r->phase_count > 0 && !r->phases)
        return lull_error_set(err, LULL_E_INVALID, "the report: phases is NULL, phase_count is %llu",
                              (unsigned long long)r->phase_count);
    for (uint64_t i = 0; LULL_HAS(struct lull_host_report, r, phase_count) && i < r->phase_count; i++) {
        if (!r->phases[i].name)
            return lull_error_set(err, LULL_E_INVALID, "the report: phases[%llu].name is NULL", (unsigned long long)i);
    }
    return LULL_OK;
}

int32_t lull_host_report_write(const struct lull_host_frame *f, const struct lull_host_report *r, const char *path,
                               struct lull_error *err)
{
    struct base_err e = {0};
    int failed = 0;
    int32_t code = lull_host_given(err, "frame", f, "report", r, "path", path, NULL);
    if (code == LULL_OK)
        code = check_report(r, err);
    if (code != LULL_OK)
        return code;
    cJSON *root = make(f, r, &failed);
    int rc = base_json_write(path, root, failed, &e);
    cJSON_Delete(root);
    return rc ? lull_host_translate(&e, err) : LULL_OK;
}

int32_t lull_host_report_text(const struct lull_host_frame *f, const struct lull_host_report *r,
                              const struct lull_writer *writer, struct lull_error *err)
{
    int failed = 0;
    int32_t code =
        lull_host_given(err, "frame", f, "report", r, "writer", writer, "write", writer ? writer->write : NULL, NULL);
    if (code == LULL_OK)
        code = check_report(r, err);
    if (code != LULL_OK)
        return code;
    cJSON *root = make(f, r, &failed);
    char *text = failed ? NULL : cJSON_Print(root);
    cJSON_Delete(root);
    if (!text)
        return lull_host_no_memory(err, "report");
    code = writer->write(writer, text, strlen(text));
    cJSON_free(text);
    return code == LULL_OK ? code : lull_error_set(err, code, "the report could not be written");
}

void lull_host_drop(struct lull_host_frame *f, uint32_t x, uint32_t y, uint32_t sample)
{
    if (f->dropped_count < LULL_HOST_DROPPED_KEPT)
        f->dropped[f->dropped_count++] = (struct lull_host_sample){x, y, sample};
}

const struct lull_host_sample *lull_host_dropped(const struct lull_host_frame *f, uint32_t *count)
{
    *count = f->dropped_count;
    return f->dropped;
}
