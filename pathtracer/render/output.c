#define _GNU_SOURCE /* memmem */
#include "render/output.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/colour.h"
#include "base/files.h"
#include "base/json.h"
#include "picture/png.h"
#include "base/version.h"
#include "image/exr.h"

void pt_denoised_release(struct pt_denoised *d)
{
    free(d->rgb);
    *d = (struct pt_denoised){0};
}

uint32_t pt_denoised_planes(enum pt_picture picture)
{
    return (picture != PT_PICTURE_NOISY ? PT_FILM_ALBEDO | PT_FILM_NORMAL : 0) |
           (picture == PT_PICTURE_BLEND ? PT_FILM_HALF : 0);
}

int pt_denoised_make(const struct pt_render *r, enum pt_picture picture, const char *library, int (*cancelled)(void *data),
                     void *data, struct pt_denoised *out, struct base_err *err)
{
    const size_t n = r->film.pixels;
    struct lull_error e = {.struct_size = sizeof e};
    *out = (struct pt_denoised){.rgb = malloc(7 * n * sizeof(float))};
    int rc = out->rgb ? 0 : base_fail_nomem(err, "the denoised picture");
    if (!rc) {
        out->denoised = out->rgb + 3 * n;
        out->weight = out->rgb + 6 * n;
        const struct lull_host_denoising how = {.struct_size = sizeof how,
                                                .flags = picture == PT_PICTURE_DENOISED ? LULL_DENOISE_FULL : 0,
                                                .threads = (uint32_t)base_threads_count(r->threads),
                                                .library = library,
                                                .context = data,
                                                .cancelled = cancelled};
        const struct lull_host_picture made = {
            .struct_size = sizeof made, .rgb = out->rgb, .denoised = out->denoised, .weight = out->weight};
        rc = pt_host_result(lull_host_denoise(r->frame, &r->shown.view, &how, &made, &e), &e, err);
    }
    for (size_t i = 0; !rc && i < n; i++)
        out->weight_mean += (double)out->weight[i] / (double)n;
    if (rc)
        pt_denoised_release(out);
    return rc;
}

/* The block that a pixel is in. Blocks of the list form a full rectangle of grid cells. */
static const struct lull_host_block *block_at(const struct lull_host_blocks *b, int x, int y)
{
    int column = x / b->block_width - b->list[0].x0 / b->block_width;
    int row = y / b->block_height - b->list[0].y0 / b->block_height;
    return &b->list[(uint32_t)row * b->list_columns + (uint32_t)column];
}

/* What an EXR may hold of a pixel; of three numbers the first. */
enum { SPP = 3, P_NOISY, ERROR, REASON, ALBEDO, NORMAL = 10, DEPTH = 13, NOISY, DENOISED = 17, WEIGHT = 20, JUDGED, ALL };
/* What a part of it takes, beside planes of the film: a denoised picture; an error of the noisy one. */
enum { A_DENOISER = PT_FILM_ALL + 1, A_JUDGE = 2 * A_DENOISER };

static const struct {
    uint32_t needs; /* 0: always there */
    int count;
    const char *names[7]; /* V: a value, as Blender wants to know */
} parts[] = {{0, 7, {"R", "G", "B", "lull.spp.V", "lull.p_noisy.V", "lull.error.V", "lull.reason.V"}},
             {PT_FILM_ALBEDO, 3, {"albedo.R", "albedo.G", "albedo.B"}},
             {PT_FILM_NORMAL, 3, {"normal.X", "normal.Y", "normal.Z"}},
             {PT_FILM_DEPTH, 1, {"depth.Z"}},
             {A_DENOISER, 7, {"noisy.R", "noisy.G", "noisy.B", "denoised.R", "denoised.G", "denoised.B", "lull.weight.V"}},
             {A_JUDGE, 1, {"lull.noisy_error.V"}}};

struct exr_source {
    const struct pt_render *render;
    const struct pt_output_info *info;
    const char *names[ALL];
    int written[ALL], count; /* which of all numbers have these names */
};

static void choose_channels(struct exr_source *s)
{
    const int denoised = s->info->denoised != NULL;
    const uint32_t there =
        s->render->config.planes | (denoised ? A_DENOISER : 0u) | (denoised && s->info->noisy_error ? A_JUDGE : 0u);
    for (int k = 0, c = 0; c < ALL; k++)
        for (int i = 0; i < parts[k].count; i++, c++)
            if (!parts[k].needs || (parts[k].needs & there)) {
                s->names[s->count] = parts[k].names[i];
                s->written[s->count++] = c;
            }
}

/* All that there is: 0 for what there is not. What is kept takes the place of the noisy picture. */
static void read_pixel(const struct exr_source *s, int x, int y, float v[ALL])
{
    const struct pt_render *r = s->render;
    const struct pt_film *f = &r->film;
    const struct pt_denoised *d = s->info->denoised;
    const struct lull_host_block *b = block_at(r->blocks, x, y);
    const size_t i = pt_film_index(f, x, y);
    const double n = b->spp > 0 ? (double)b->spp : 1.0;
    double mean[3];
    pt_film_mean(f, i, b->spp, mean);
    for (size_t c = 0; c < 3; c++) {
        v[c] = d ? d->rgb[3 * i + c] : (float)mean[c];
        v[ALBEDO + c] = f->albedo ? (float)(f->albedo[3 * i + c] / n) : 0.0f;
        v[NORMAL + c] = f->normal ? (float)(f->normal[3 * i + c] / n) : 0.0f;
        v[NOISY + c] = (float)mean[c];
        v[DENOISED + c] = d ? d->denoised[3 * i + c] : 0.0f;
    }
    v[SPP] = (float)(b->spp - f->dropped[i]);
    v[P_NOISY] = (float)b->p_noisy;
    v[ERROR] = (float)b->error;
    v[REASON] = (float)b->reason;
    v[DEPTH] = f->depth ? (float)f->depth[i] : 0.0f;
    v[WEIGHT] = d ? d->weight[i] : 0.0f;
    v[JUDGED] = s->info->noisy_error ? (float)s->info->noisy_error[b - r->blocks->list] : 0.0f;
}

static void exr_row(void *data, int y, float *const *rows)
{
    const struct exr_source *s = data;
    const int *crop = s->render->config.crop;
    for (int x = crop[0]; x < crop[2]; x++) {
        float v[ALL];
        read_pixel(s, x, y, v);
        for (int c = 0; c < s->count; c++)
            rows[c][x - crop[0]] = v[s->written[c]];
    }
}

static void effect_names(pt_effects effects, char *text, size_t room)
{
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; i < PT_FX_COUNT; i++)
        if (effects >> i & 1 && used < room)
            used += (size_t)snprintf(text + used, room - used, "%s%s", used ? "," : "", pt_effects_name(i));
}

static void criterion_text(const struct pt_render *r, const struct pt_output_info *info, char *text, size_t room)
{
    if (!r->criterion) {
        snprintf(text, room, "none");
        return;
    }
    const struct lull_criterion *t = lull_host_table(r->criterion);
    size_t used = (size_t)snprintf(text, room, "%s %s", t->id, t->version);
    for (uint32_t i = 0; i < info->param_count && used < room; i++)
        used += (size_t)snprintf(text + used, room - used, " %s=%s", info->params[i].key, info->params[i].value);
}

int pt_output_exr(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct base_err *err)
{
    struct exr_source source = {.render = r, .info = info};
    char effects[512], criterion[2048], reasons[256];
    size_t used = 0;
    for (int i = 0; i < LULL_REASON_COUNT; i++)
        used += (size_t)snprintf(reasons + used, sizeof reasons - used, "%s%d=%s", i ? " " : "", i, lull_host_reason(i));
    char block[48];
    snprintf(block, sizeof block, "%dx%d", r->config.block_width, r->config.block_height);
    effect_names(info->effects, effects, sizeof effects);
    criterion_text(r, info, criterion, sizeof criterion);
    const struct pt_exr_attribute attributes[] = {
        {"lull:scene", info->of.scene, 0.0},
        {"lull:criterion", criterion, 0.0},
        {"lull:effects", effects, 0.0},
        {"lull:reasons", reasons, 0.0},
        {"lull:block", block, 0.0},
        {"lull:seed", NULL, (double)r->config.integrator.seed},
        {"lull:samples", NULL, (double)r->totals->samples},
        {"software", "lull-render " BASE_VERSION, 0.0},
        {"lull:seconds", NULL, lull_host_elapsed_s(r->frame)}, /* last: left out of reproducible files */
    };
    choose_channels(&source);
    const int *crop = r->config.crop;
    struct pt_exr_image image = {
        .width = r->config.width,
        .height = r->config.height,
        .x0 = crop[0],
        .y0 = crop[1],
        .x1 = crop[2],
        .y1 = crop[3],
        .channel_count = source.count,
        .channels = source.names,
        .attribute_count = (int)(sizeof attributes / sizeof attributes[0]) - (info->reproducible ? 1 : 0),
        .attributes = attributes,
        .row = exr_row,
        .data = &source,
    };
    return pt_exr_write(path, &image, err);
}

int pt_output_is_ours(const char *path)
{
    static const char mark[] = "lull.spp"; /* a layer of each, named in the header's first attribute */
    char begin[4096];
    FILE *f;
    if (access(path, F_OK) != 0)
        return 1;
    if (base_file_open(path, &f, NULL) != 0)
        return 0;
    size_t n = fread(begin, 1, sizeof begin, f);
    fclose(f);
    return n == 0 || memmem(begin, n, mark, sizeof mark - 1) != NULL;
}

/* sRGB codes of a picture over the crop: `shown` over the film's pixels, NULL: the noisy one. The caller's. */
static uint8_t *encode(const struct pt_render *r, const float *shown, struct base_err *err)
{
    const int *crop = r->config.crop;
    uint8_t *pixels = malloc((size_t)(crop[2] - crop[0]) * (size_t)(crop[3] - crop[1]) * 3), *out = pixels;
    if (!pixels)
        base_fail_nomem(err, "picture");
    for (int y = crop[1]; pixels && y < crop[3]; y++) {
        for (int x = crop[0]; x < crop[2]; x++, out += 3) {
            const size_t i = pt_film_index(&r->film, x, y);
            double rgb[3];
            pt_film_mean(&r->film, i, block_at(r->blocks, x, y)->spp, rgb);
            for (int c = 0; c < 3; c++)
                out[c] = base_srgb_code(shown ? (double)shown[3 * i + (size_t)c] : rgb[c]);
        }
    }
    return pixels;
}

int pt_output_preview(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct base_err *err)
{
    const int *crop = r->config.crop;
    uint8_t *pixels = encode(r, info && info->denoised ? info->denoised->rgb : NULL, err);
    int rc = pixels ? pic_write_png(path, crop[2] - crop[0], crop[3] - crop[1], 3, pixels, err) : BASE_ENOMEM;
    free(pixels);
    return rc;
}

int pt_output_result(int32_t code, const struct lull_error *why, struct base_err *err)
{
    return code == LULL_E_IO ? base_fail(err, BASE_EIO, "%s", why->message) : pt_host_result(code, why, err);
}

int pt_output_stop_map(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    return pt_output_result(lull_host_stop_map(r->blocks, path, info->of.scene, &e), &e, err);
}

/* effects: room for PT_FX_COUNT names. */
static struct lull_host_report describe(const struct pt_render *r, const struct pt_output_info *info, const char **effects)
{
    uint32_t n = 0;
    for (int i = 0; i < PT_FX_COUNT; i++)
        if (info->effects >> i & 1)
            effects[n++] = pt_effects_name(i);
    struct lull_host_report report = info->of;
    report.struct_size = sizeof report;
    report.effects = effects;
    report.effect_count = n;
    report.threads = (uint32_t)pt_render_threads(r);
    report.processes = (uint32_t)job_count(r->config.job);
    report.film_bytes = r->film.bytes;
    report.film_pixels = r->film.pixels;
    report.software = "lull-render " BASE_VERSION;
    if (info->denoised) {
        report.flags |= LULL_REPORT_DENOISED;
        report.noisy_weight = info->denoised->weight_mean;
        report.noisy_error = info->noisy_error;
    }
    if (r->config.job) {
        const struct job_traffic traffic = job_traffic(r->config.job);
        report.flags |= LULL_REPORT_MESSAGES;
        report.messages = traffic.messages;
        report.message_bytes = traffic.bytes;
        report.message_wait_s = traffic.waiting_s;
    }
    return report;
}

static int32_t write_text(const struct lull_writer *writer, const void *data, uint64_t size)
{
    return fwrite(data, 1, (size_t)size, writer->context) == size ? LULL_OK : LULL_E_MEMORY;
}

/* The report as text, the caller's; NULL: no memory. */
static char *report_text(const struct pt_render *r, const struct pt_output_info *info)
{
    const char *effects[PT_FX_COUNT];
    const struct lull_host_report report = describe(r, info, effects);
    char *text = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    const struct lull_writer writer = {.struct_size = sizeof writer, .context = file, .write = write_text};
    int32_t code = file ? lull_host_report_text(r->frame, &report, &writer, NULL) : LULL_E_MEMORY;
    if (file && fclose(file) == 0 && code == LULL_OK)
        return text;
    free(text);
    return NULL;
}

/* Of a render that goes on: the same, and how far it is. */
static int write_report_so_far(const char *path, const struct pt_render *r, const struct pt_output_info *info,
                               struct base_err *err)
{
    char *text = report_text(r, info);
    cJSON *root = text ? cJSON_Parse(text) : NULL;
    int failed = !root;
    cJSON *progress = base_json_object(root, "progress", &failed);
    base_json_number(progress, "share", info->progress->share, &failed);
    base_json_number(progress, "left_s", info->progress->left_s, &failed);
    base_json_bool(progress, "known", info->progress->known, &failed);
    int rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    free(text);
    return rc;
}

int pt_output_report(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct base_err *err)
{
    const char *effects[PT_FX_COUNT];
    if (info->progress)
        return write_report_so_far(path, r, info, err);
    const struct lull_host_report report = describe(r, info, effects);
    struct lull_error e = {.struct_size = sizeof e};
    return pt_output_result(lull_host_report_write(r->frame, &report, path, &e), &e, err);
}

int pt_output_page(const char *path, const struct pt_render *r, const struct pt_output_info *info, struct base_err *err)
{
    static const char *const names[3] = {"picture", "noisy", "denoised"};
    const struct pt_denoised *d = info->denoised;
    const float *const shown[3] = {d ? d->rgb : NULL, NULL, d ? d->denoised : NULL};
    const uint32_t count = d ? 3 : 1;
    const int *crop = r->config.crop;
    struct lull_host_layer layers[3];
    uint8_t *codes[3] = {NULL};
    char *report = report_text(r, info);
    int rc = report ? 0 : base_fail_nomem(err, "page");
    for (uint32_t i = 0; i < count && !rc; i++) {
        codes[i] = encode(r, shown[i], err);
        layers[i] = (struct lull_host_layer){names[i], codes[i]};
        rc = codes[i] ? 0 : BASE_ENOMEM;
    }
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = rc ? LULL_OK
                      : lull_host_page(report, info->quote, layers, count, (uint32_t)(crop[2] - crop[0]),
                                       (uint32_t)(crop[3] - crop[1]), path, &e);
    for (int i = 0; i < 3; i++)
        free(codes[i]);
    free(report);
    return rc ? rc : pt_output_result(code, &e, err);
}

void pt_output_or_keep(pt_output_writer *write, const char *path, const struct pt_render *r,
                       const struct pt_output_info *info, struct base_err *err)
{
    struct base_err why = {0}, again = {0};
    const struct base_err before = *err; /* of the files that could not be written either */
    char kept[4096];
    if (!path || write(path, r, info, &why) == 0)
        return;
    const char *folder = getenv("TMPDIR");
    int n = snprintf(kept, sizeof kept, "%s/lull-%ld-%s", folder && folder[0] != '\0' ? folder : "/tmp", (long)getpid(),
                     base_file_name(path));
    const int is_kept = n < (int)sizeof kept && write(kept, r, info, &again) == 0;
    if (before.code)
        base_fail(err, before.code, "%.400s; %.100s%s%.100s", before.text, path, is_kept ? " kept as " : " is lost",
                  is_kept ? kept : "");
    else if (is_kept)
        base_fail(err, why.code, "%.320s; kept as %.160s", why.text, kept);
    else
        *err = why;
}
