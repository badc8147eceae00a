#include "render/quote.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/json.h"
#include "render/output.h"
#include "shade/bsdf.h"

enum { MOST_EXPENSIVE = 5, REPLAYED = 256 };

struct expensive_block {
    uint32_t index;
    double share;       /* of the time of all blocks */
    double bounces;     /* vertices per path */
    const char *mostly; /* what most of them are */
    double mostly_share;
};

/* What the paths of a block meet: those of REPLAYED pixels spread over it, replayed by the tracing kernel. */
static void take_census(const struct pt_render *r, const struct lull_host_block *b, struct expensive_block *expensive)
{
    uint64_t met[PT_MET_COUNT] = {0}, all = 0, most = 0;
    uint32_t width = (uint32_t)(b->x1 - b->x0), pixels = width * (uint32_t)(b->y1 - b->y0);
    for (uint32_t i = 0; i < REPLAYED; i++) {
        uint32_t at = (uint32_t)((uint64_t)i * pixels / REPLAYED);
        uint32_t x = (uint32_t)b->x0 + at % width, y = (uint32_t)b->y0 + at / width;
        pt_kernel_trace(r->scene, &r->config.integrator, x, y, i, NULL, met);
    }
    expensive->mostly = "nothing";
    for (int k = 0; k < PT_MET_COUNT; k++) {
        all += met[k];
        if (met[k] > most) {
            most = met[k];
            expensive->mostly = k == PT_MET_MEDIUM ? "scattering in a medium" : pt_bsdf_models[k].words;
        }
    }
    expensive->bounces = (double)all / REPLAYED;
    expensive->mostly_share = all > 0 ? (double)most / (double)all : 0.0;
}

/* The blocks that cost most, the most expensive first. Returns their number. */
static uint32_t find_most_expensive(const struct pt_quote *q, const struct pt_render *r,
                                    struct expensive_block out[MOST_EXPENSIVE])
{
    const struct lull_host_quote_row *row = pt_quote_asked(q);
    uint32_t n = 0;
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        uint32_t at = n < MOST_EXPENSIVE ? n++ : MOST_EXPENSIVE;
        for (; at > 0 && row->blocks[out[at - 1].index].thread_s < row->blocks[i].thread_s; at--)
            if (at < MOST_EXPENSIVE)
                out[at] = out[at - 1];
        if (at < MOST_EXPENSIVE)
            out[at] = (struct expensive_block){.index = i,
                                               .share = row->thread_s > 0.0 ? row->blocks[i].thread_s / row->thread_s : 0.0};
    }
    for (uint32_t k = 0; k < n; k++)
        take_census(r, &r->blocks->list[out[k].index], &out[k]);
    return n;
}

const char *pt_quote_duration(double s, char text[32])
{
    if (s < 99.5)
        snprintf(text, 32, s < 9.95 ? "%.1f s" : "%.0f s", s);
    else if (s < 99.5 * 60)
        snprintf(text, 32, s < 9.95 * 60 ? "%.1f min" : "%.0f min", s / 60);
    else
        snprintf(text, 32, "%.1f h", s / 3600);
    return text;
}

/* 12,345; with + where --spp-max ended it. */
const char *pt_quote_thousands(double value, int more, char text[32])
{
    char digits[24];
    int n = snprintf(digits, sizeof digits, "%.0f", value), used = 0;
    for (int i = 0; i < n; i++) {
        text[used++] = digits[i];
        if ((n - i - 1) % 3 == 0 && i + 1 < n)
            text[used++] = ',';
    }
    if (more)
        text[used++] = '+';
    text[used] = '\0';
    return text;
}

static void print_row(FILE *out, const struct lull_host_quote_row *row)
{
    char who[32], least[32], mean[32], most[32], samples[112], time[32], low[32], high[32], from_to[80], wall[160];
    if (!row->parameter)
        snprintf(who, sizeof who, "%s", row->name);
    else if (strcmp(row->parameter, "error") == 0)
        snprintf(who, sizeof who, "%3.3g x  %s", row->value, row->name);
    else if (strcmp(row->parameter, "visible") == 0)
        snprintf(who, sizeof who, "%3.3g %%  %s", 100 * row->value, row->name);
    else
        snprintf(who, sizeof who, "%.3g  %s", row->value, row->name);
    if (!row->told) {
        fprintf(out, "%-26s  not known: the pilot has met too little\n", who);
        return;
    }
    snprintf(samples, sizeof samples, "%6s / %6s / %7s", pt_quote_thousands(row->spp_min, 0, least),
             pt_quote_thousands(row->spp_mean, row->unknown > 0 || row->capped > 0, mean),
             pt_quote_thousands(row->spp_max, row->unknown > 0 || row->capped > 0, most));
    snprintf(from_to, sizeof from_to, "(%s to %s)", pt_quote_duration(row->wall_low_s, low),
             pt_quote_duration(row->wall_high_s, high));
    snprintf(wall, sizeof wall, "%-8s %s", pt_quote_duration(row->wall_s, time), from_to);
    fprintf(out, "%-26s  %-26s  %-30s  %.2f x\n", who, samples, wall, row->against_uniform);
}

static void print_most_expensive(FILE *out, const struct pt_quote *q, const struct pt_render *r)
{
    struct expensive_block expensive[MOST_EXPENSIVE];
    uint32_t n = find_most_expensive(q, r, expensive);
    const struct lull_host_quote_row *row = pt_quote_asked(q);
    fprintf(out, "\nblocks that take most of the time, as asked:\n");
    for (uint32_t k = 0; k < n; k++) {
        const struct lull_host_block *b = &r->blocks->list[expensive[k].index];
        const struct lull_host_stop_at *stop = &row->blocks[expensive[k].index].stop;
        double paths = (double)b->spp * (double)(b->x1 - b->x0) * (double)(b->y1 - b->y0);
        char spp[32], low[32], high[32];
        fprintf(out, "  block %u (%d,%d to %d,%d): ", b->id, b->x0, b->y0, b->x1, b->y1);
        if (row->told)
            fprintf(out, "%.0f %%, %s spp (%s to %s), ", 100 * expensive[k].share, pt_quote_thousands(stop->spp, 0, spp),
                    pt_quote_thousands(stop->low, 0, low), pt_quote_thousands(stop->high, 0, high));
        fprintf(out, "%.2f us per path of %.1f vertices, %.0f %% of them %s\n", paths > 0 ? b->thread_s / paths * 1e6 : 0.0,
                expensive[k].bounces, 100 * expensive[k].mostly_share, expensive[k].mostly);
    }
}

/* Their noise comes from light that few of their pixels have met: what they need is known to an octave either way only. */
static void print_unmet(FILE *out, const struct lull_host_quote_row *row, const struct pt_render *r)
{
    if (row->unmet == 0)
        return;
    fprintf(out, "\n%u of %u blocks have not met their light yet (a longer --quote-pilot says more):", row->unmet,
            r->blocks->count);
    for (uint32_t i = 0; i < r->blocks->count; i++)
        if (row->blocks[i].unmet)
            fprintf(out, " %u", r->blocks->list[i].id);
    fprintf(out, "\n");
}

void pt_quote_text(FILE *out, const struct pt_quote *q, const struct pt_render *r, const struct pt_quote_info *info)
{
    const struct lull_host_quote_row *asked = pt_quote_asked(q);
    char time[64], took[32], load[32];
    snprintf(time, sizeof time, "time, %d thread%s", q->threads, q->threads > 1 ? "s" : "");
    fprintf(out, "%-26s  %-26s  %-30s  %s\n", "times just seen, viewers", "spp min / mean / max", time, "against uniform");
    for (uint32_t i = 0; i < q->row_count; i++)
        print_row(out, &q->rows[i]);
    if (asked->unknown > 0 && asked->told)
        fprintf(out,
                "criterion %s does not say when it expects to stop %u of %u blocks: those are counted with --spp-max, "
                "so that all is at most\n",
                lull_host_table(r->criterion)->id, asked->unknown, r->blocks->count);
    print_most_expensive(out, q, r);
    print_unmet(out, asked, r);
    fprintf(out, "\npilot: %.0f spp on average in %s, loading %s, %.1f of %d threads at work%s\n",
            (double)r->totals->samples / (double)r->film.pixels, pt_quote_duration(lull_host_elapsed_s(r->frame), took),
            pt_quote_duration(info->load_s, load), r->busy_threads, q->threads, info->interrupted ? "; interrupted" : "");
    fprintf(out, "memory: film %.1f MB, scene %.1f MB\n", (double)r->film.bytes * 1e-6, (double)info->scene_bytes * 1e-6);
}

static void add_known(cJSON *to, const char *key, double value, int told, int *failed)
{
    base_json_number(to, key, told ? value : (double)NAN, failed);
}

static void add_range(cJSON *to, const char *key, double value, double low, double high, int told, int *failed)
{
    cJSON *o = base_json_object(to, key, failed);
    add_known(o, "expected", value, told, failed);
    add_known(o, "low", low, told, failed);
    add_known(o, "high", high, told, failed);
}

static void add_row(cJSON *list, const struct lull_host_quote_row *row, uint32_t count, int *failed)
{
    const int told = row->told != 0;
    cJSON *o = base_json_object(list, NULL, failed), *blocks;
    if (row->parameter)
        base_json_number(o, row->parameter, row->value, failed);
    base_json_text(o, "name", row->name, failed);
    base_json_bool(o, "as_asked", row->asked, failed);
    base_json_bool(o, "told", told, failed);
    add_known(o, "spp_min", row->spp_min, told, failed);
    add_range(o, "spp_mean", row->spp_mean, row->spp_mean_low, row->spp_mean_high, told, failed);
    add_known(o, "spp_max", row->spp_max, told, failed);
    add_range(o, "thread_s", row->thread_s, row->thread_low_s, row->thread_high_s, told, failed);
    add_range(o, "wall_s", row->wall_s, row->wall_low_s, row->wall_high_s, told, failed);
    add_known(o, "against_uniform", row->against_uniform, told, failed);
    base_json_number(o, "unknown_blocks", row->unknown, failed);
    base_json_number(o, "unmet_blocks", row->unmet, failed);
    base_json_number(o, "blocks_at_spp_max", row->capped, failed);
    blocks = base_json_array(o, "blocks", failed);
    for (uint32_t i = 0; i < count; i++) {
        const struct lull_host_quote_block *b = &row->blocks[i];
        cJSON *block = base_json_object(blocks, NULL, failed);
        add_range(block, "spp", b->stop.spp, b->stop.low, b->stop.high, 1, failed);
        add_range(block, "thread_s", b->thread_s, b->thread_low_s, b->thread_high_s, 1, failed);
        base_json_bool(block, "known", b->stop.known != 0, failed);
        base_json_bool(block, "met_light", !row->blocks[i].unmet, failed);
    }
}

static void add_pilot(cJSON *root, const struct pt_render *r, const struct pt_quote_info *info, int *failed)
{
    cJSON *o = base_json_object(root, "pilot", failed);
    base_json_number(o, "spp_mean", (double)r->totals->samples / (double)r->film.pixels, failed);
    base_json_number(o, "elapsed_s", lull_host_elapsed_s(r->frame), failed);
    base_json_number(o, "load_s", info->load_s, failed);
    base_json_number(o, "busy_threads", r->busy_threads, failed);
    base_json_bool(o, "interrupted", info->interrupted, failed);
    o = base_json_object(root, "memory", failed);
    base_json_number(o, "film_bytes", (double)r->film.bytes, failed);
    base_json_number(o, "scene_bytes", (double)info->scene_bytes, failed);
}

static void add_most_expensive(cJSON *root, const struct pt_quote *q, const struct pt_render *r, int *failed)
{
    struct expensive_block expensive[MOST_EXPENSIVE];
    uint32_t n = find_most_expensive(q, r, expensive);
    cJSON *list = base_json_array(root, "dearest", failed);
    for (uint32_t k = 0; k < n; k++) {
        cJSON *o = base_json_object(list, NULL, failed);
        base_json_number(o, "id", r->blocks->list[expensive[k].index].id, failed);
        base_json_number(o, "share", expensive[k].share, failed);
        base_json_number(o, "vertices_per_path", expensive[k].bounces, failed);
        base_json_text(o, "mostly", expensive[k].mostly, failed);
        base_json_number(o, "mostly_share", expensive[k].mostly_share, failed);
    }
}

int pt_quote_json(FILE *out, const struct pt_quote *q, const struct pt_render *r, const struct pt_quote_info *info,
                  struct base_err *err)
{
    int failed = 0;
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "scene", info->scene, &failed);
    base_json_number(root, "width", r->config.width, &failed);
    base_json_number(root, "height", r->config.height, &failed);
    base_json_number(root, "threads", q->threads, &failed);
    base_json_text(root, "criterion", r->criterion ? lull_host_table(r->criterion)->id : NULL, &failed);
    cJSON *rows = base_json_array(root, "rows", &failed);
    for (uint32_t i = 0; i < q->row_count; i++)
        add_row(rows, &q->rows[i], r->blocks->count, &failed);
    cJSON *blocks = base_json_array(root, "blocks", &failed);
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        cJSON *o = base_json_object(blocks, NULL, &failed);
        base_json_number(o, "id", b->id, &failed);
        base_json_number(o, "x0", b->x0, &failed);
        base_json_number(o, "y0", b->y0, &failed);
        base_json_number(o, "x1", b->x1, &failed);
        base_json_number(o, "y1", b->y1, &failed);
        base_json_number(o, "pilot_spp", (double)b->spp, &failed);
        base_json_number(o, "thread_s_per_spp", q->rows[0].blocks[i].sample_s, &failed);
    }
    add_most_expensive(root, q, r, &failed);
    add_pilot(root, r, info, &failed);
    char *text = failed ? NULL : cJSON_Print(root);
    cJSON_Delete(root);
    if (!text)
        return base_fail_nomem(err, "quote");
    fprintf(out, "%s\n", text);
    cJSON_free(text);
    return 0;
}

int pt_quote_map(const char *path, const struct pt_quote *q, const struct pt_render *r, struct base_err *err)
{
    const struct lull_host_quote_row *row = pt_quote_asked(q);
    struct lull_error e = {.struct_size = sizeof e};
    double *values = calloc(r->blocks->count, sizeof *values), most_s = 0.0;
    if (!values)
        return base_fail_nomem(err, "quote map");
    for (uint32_t i = 0; i < r->blocks->count; i++)
        most_s = fmax(most_s, row->blocks[i].thread_s);
    int minutes = most_s >= 60.0;
    for (uint32_t i = 0; i < r->blocks->count; i++)
        values[i] = row->blocks[i].thread_s / (minutes ? 60.0 : 1.0);
    int32_t code = lull_host_value_map(r->blocks, values, minutes ? "min" : "s", path, &e);
    free(values);
    return pt_output_result(code, &e, err);
}
