#include "render/host.h"

#include <lull/loader.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/version.h"
#include "picture/read.h"

int pt_host_result(int32_t code, const struct lull_error *why, struct base_err *err)
{
    return code == LULL_OK ? 0 : base_fail(err, code == LULL_E_MEMORY ? BASE_ENOMEM : BASE_EINVAL, "%s", why->message);
}

/* What loader and criteria are served with; that of a criterion lives as long as it. */
struct services {
    struct base_log *log;
    int32_t level; /* of what is passed on to it, LULL_LOG_ */
    struct base_threads *threads;
};

static void log_message(void *context, int32_t level, const char *text)
{
    const struct services *s = context;
    if (level <= s->level)
        base_log_note(s->log, "%s", text);
}

int pt_criterion_find(const char *spec, struct base_inputs *inputs, struct base_log *log, const struct lull_criterion **out,
                      struct base_err *err)
{
    struct services services = {log, LULL_LOG_WARNING, NULL};
    struct lull_search search = {.log = log_message, .log_context = &services};
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_found found;
    int rc = pt_host_result(lull_open(&search, spec, &found, &e), &e, err);
    if (!rc && inputs)
        rc = base_inputs_add(inputs, found.path, err);
    if (!rc)
        *out = found.criterion;
    return rc;
}

void pt_criterion_describe(const struct lull_criterion *t, FILE *out)
{
    fprintf(out, "%s %s - %s\n", t->id, t->version, t->name);
    for (const char *line = t->description; *line != '\0';) {
        int n = (int)strcspn(line, "\n");
        fprintf(out, "    %.*s\n", n, line);
        line += n + (line[n] != '\0');
    }
}

struct listing {
    FILE *out;
    int count;
};

static int32_t list_one(void *context, const struct lull_found *found)
{
    struct listing *l = context;
    const struct lull_criterion *t = found->criterion;
    pt_criterion_describe(t, l->out);
    fprintf(l->out, "    from %s\n", found->path);
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        fprintf(l->out, "    -p %s=%s  %s", p->name, p->default_value ? p->default_value : "?", p->help);
        if (p->type == LULL_PARAM_INT || p->type == LULL_PARAM_FLOAT)
            fprintf(l->out, " [%g to %g]", p->min, p->max);
        else if (p->type == LULL_PARAM_CHOICE)
            fprintf(l->out, " [%s]", p->choices);
        fprintf(l->out, "\n");
    }
    l->count++;
    return LULL_OK;
}

int pt_criterion_list(FILE *out, struct base_log *log)
{
    struct services services = {log, LULL_LOG_ERROR, NULL}; /* what loading does to this process, nobody asked */
    struct lull_search search = {.log = log_message, .log_context = &services};
    struct listing listing = {.out = out};
    lull_list(&search, list_one, &listing);
    return listing.count;
}

static int32_t run_tasks(void *context, uint64_t count, lull_task_fn fn, void *arg)
{
    const struct services *s = context;
    base_threads_tasks(s->threads, count, fn, arg);
    return LULL_OK;
}

int pt_criterion_create(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                        struct base_threads *threads, struct base_log *log, struct lull_host_criterion **out,
                        struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct services *s = malloc(sizeof *s);
    if (!s)
        return base_fail_nomem(err, "criterion");
    *s = (struct services){log, LULL_LOG_INFO, threads};
    struct lull_host_services services = {.struct_size = sizeof services,
                                          .threads = threads ? (uint32_t)base_threads_count(threads) : 1,
                                          .name = "lull-render " BASE_VERSION,
                                          .context = s,
                                          .log = log_message,
                                          .parallel_for = run_tasks,
                                          .release = free};
    return pt_host_result(lull_host_create(&services, table, pairs, pair_count, out, &e), &e, err);
}

/* Sums of the film and what they are divided by. */
static const struct {
    uint32_t abi, film; /* LULL_PLANE_, PT_FILM_ */
    size_t offset;      /* of the array in struct pt_film */
    uint32_t channels;
    int32_t normaliser;
} map[] = {{LULL_PLANE_COLOR, PT_FILM_COLOR, offsetof(struct pt_film, color), 3, LULL_NORM_SPP},
           {LULL_PLANE_HALF, PT_FILM_HALF, offsetof(struct pt_film, half), 3, LULL_NORM_HALF_SPP},
           {LULL_PLANE_MOMENT2, PT_FILM_MOMENT2, offsetof(struct pt_film, moment2), 1, LULL_NORM_SPP},
           {LULL_PLANE_ALBEDO, PT_FILM_ALBEDO, offsetof(struct pt_film, albedo), 3, LULL_NORM_SPP},
           {LULL_PLANE_NORMAL, PT_FILM_NORMAL, offsetof(struct pt_film, normal), 3, LULL_NORM_SPP},
           {LULL_PLANE_DEPTH, PT_FILM_DEPTH, offsetof(struct pt_film, depth), 1, LULL_NORM_ONE}};
enum { PLANES = sizeof map / sizeof map[0] };

uint32_t pt_host_film_planes(const struct lull_requirements *needs)
{
    uint32_t planes = PT_FILM_COLOR;
    for (int i = 0; i < PLANES; i++)
        if (needs->planes_used & LULL_PLANE_BIT(map[i].abi))
            planes |= map[i].film;
    return planes;
}

uint32_t pt_host_planes_of(uint32_t film_planes)
{
    uint32_t planes = LULL_PLANE_BIT(LULL_PLANE_COLOR);
    for (int i = 0; i < PLANES; i++)
        if (film_planes & map[i].film)
            planes |= LULL_PLANE_BIT(map[i].abi);
    return planes;
}

/* Rows of so many pixels. NULL data: no such plane. */
static struct lull_plane plane_of(const void *data, int width, uint32_t channels, size_t size, int32_t type,
                                  int32_t normaliser)
{
    int64_t pixel = (int64_t)(channels * size);
    if (!data)
        return (struct lull_plane){0};
    return (struct lull_plane){.data = data,
                               .stride_x = pixel,
                               .stride_y = pixel * width,
                               .stride_c = (int64_t)size,
                               .scale = 1.0,
                               .type = type,
                               .normaliser = normaliser,
                               .channels = channels};
}

void pt_host_show(const struct pt_film *film, struct pt_host_view *v)
{
    const int width = film->x1 - film->x0;
    v->dropped = plane_of(film->dropped, width, 1, sizeof *film->dropped, LULL_TYPE_U32, LULL_NORM_ONE);
    v->dropped_half = plane_of(film->dropped_half, width, 1, sizeof *film->dropped_half, LULL_TYPE_U32, LULL_NORM_ONE);
    memset(v->planes, 0, sizeof v->planes);
    for (int i = 0; i < PLANES; i++) {
        const double *data = *(double *const *)((const char *)film + map[i].offset);
        v->planes[map[i].abi] = plane_of(data, width, map[i].channels, sizeof *data, LULL_TYPE_F64, map[i].normaliser);
    }
    v->view = (struct lull_host_view){.struct_size = sizeof v->view,
                                      .plane_count = LULL_PLANE_COUNT,
                                      .x0 = film->x0,
                                      .y0 = film->y0,
                                      .x1 = film->x1,
                                      .y1 = film->y1,
                                      .planes = v->planes,
                                      .dropped = &v->dropped,
                                      .dropped_half = film->dropped_half ? &v->dropped_half : NULL};
}

static float sample(const struct pic_image *image, size_t i)
{
    float v = image->u8 ? (float)image->u8[i] / 255.0f : image->f32[i];
    return v > 0.0f ? fminf(v, 1.0f) : 0.0f;
}

int pt_mask_read(const char *path, int width, int height, struct lull_plane *out, struct base_err *err)
{
    struct pic_image image;
    int rc = pic_read(path, &image, err);
    if (rc)
        return rc == BASE_EIO ? (err->code = BASE_EINVAL) : rc;
    if (image.width != width || image.height != height) {
        rc = base_fail(err, BASE_EINVAL, "--mask %s: it has %dx%d pixels, the image %dx%d", path, (int)image.width,
                       (int)image.height, width, height);
        goto out;
    }
    size_t pixels = (size_t)width * (size_t)height, channels = (size_t)image.channels, colours = channels < 3 ? 1 : 3;
    float *grey = malloc(pixels * sizeof *grey);
    if (!grey) {
        rc = base_fail_nomem(err, "mask");
        goto out;
    }
    for (size_t i = 0; i < pixels; i++) {
        float sum = 0.0f;
        for (size_t c = 0; c < colours; c++)
            sum += sample(&image, channels * i + c);
        grey[i] = sum / (float)colours;
    }
    *out = plane_of(grey, width, 1, sizeof *grey, LULL_TYPE_F32, LULL_NORM_ONE);
out:
    pic_release(&image);
    return rc;
}

void pt_mask_release(struct lull_plane *mask)
{
    free((void *)(uintptr_t)mask->data);
    *mask = (struct lull_plane){0};
}
