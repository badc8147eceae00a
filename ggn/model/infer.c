#include "model/infer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "nn/bf16.h"
#include "nn/exec.h"
#include "nn/loss.h"

enum { MAX_WINDOW = 16 };

struct history_head {
    uint32_t count; /* images held */
    uint32_t next;  /* ring position of the next image */
    uint32_t window, area;
    uint64_t spp[MAX_WINDOW];
    uint8_t broken[MAX_WINDOW]; /* the denoiser did not give numbers: a model whose weights overflow */
};

struct ggn_infer {
    const struct ggn_model *model; /* borrows */
    struct ggn_exec_f32 *r, *m, *d;
    float of_byte[256];
};

static size_t area_of(const struct ggn_hyper *h)
{
    return (size_t)h->height * (size_t)h->width;
}

/* Per image 3 noisy planes of bytes, then 3 denoised planes of 16 bits, padded to keep those aligned. */
static size_t image_bytes(size_t area)
{
    return (3 * area + 15) / 16 * 16 + 6 * area;
}

size_t ggn_history_bytes(const struct ggn_hyper *h)
{
    return sizeof(struct history_head) + (size_t)h->window * image_bytes(area_of(h));
}

void ggn_history_clear(void *history)
{
    memset(history, 0, sizeof(struct history_head));
}

int ggn_history_count(const void *history)
{
    return (int)((const struct history_head *)history)->count;
}

int ggn_history_valid(const void *history, size_t bytes, const struct ggn_hyper *h)
{
    struct history_head head;

    if (bytes != ggn_history_bytes(h))
        return 0;
    memcpy(&head, history, sizeof head);
    if (head.count == 0 && head.next == 0 && head.window == 0)
        return 1; /* cleared */
    return head.window == (uint32_t)h->window && head.area == (uint32_t)area_of(h) && head.count <= head.window &&
           head.next < head.window && (head.count == head.window || head.next == head.count);
}

/* Ring position of image i, oldest first. */
static int ring_of(const struct history_head *head, const struct ggn_hyper *h, int i)
{
    return ((int)head->next + h->window - (int)head->count + i) % h->window;
}

uint64_t ggn_history_spp(const void *history, const struct ggn_hyper *h, int i)
{
    const struct history_head *head = history;
    return head->spp[ring_of(head, h, i)];
}

static uint8_t *noisy_of(const void *history, const struct ggn_hyper *h, int ring)
{
    return (uint8_t *)(size_t)history + sizeof(struct history_head) + (size_t)ring * image_bytes(area_of(h));
}

static uint16_t *denoised_of(const void *history, const struct ggn_hyper *h, int ring)
{
    return (uint16_t *)(void *)(noisy_of(history, h, ring) + (3 * area_of(h) + 15) / 16 * 16);
}

int ggn_infer_has_bf16(void)
{
    return ggn_bf16_available();
}

static int exec_flags(enum ggn_precision precision)
{
    return precision == GGN_PRECISION_BF16 ? GGN_EXEC_BF16 : 0;
}

size_t ggn_infer_bytes(const struct ggn_model *model, enum ggn_precision precision, int workers)
{
    size_t bytes = sizeof(struct ggn_infer);

    for (int net = 0; net < GGN_NETS; net++)
        bytes += ggn_exec_bytes_f32(&model->graph[net], 1, exec_flags(precision), workers);
    return bytes;
}

struct ggn_infer *ggn_infer_create(const struct ggn_model *model, enum ggn_precision precision, struct ggn_threads *threads,
                                   struct ggn_err *err)
{
    struct ggn_infer *f = calloc(1, sizeof *f);
    const int flags = exec_flags(precision);

    if (!f) {
        ggn_fail_nomem(err, "inference");
        return NULL;
    }
    f->model = model;
    for (int i = 0; i < 256; i++)
        f->of_byte[i] = (float)i / 255.0f;
    f->r = ggn_exec_create_f32(&model->graph[GGN_NET_R], NULL, 1, flags, threads, err);
    f->m = f->r ? ggn_exec_create_f32(&model->graph[GGN_NET_M], NULL, 1, flags, threads, err) : NULL;
    f->d = f->m ? ggn_exec_create_f32(&model->graph[GGN_NET_D], NULL, 1, flags, threads, err) : NULL;
    if (f->d)
        return f;
    ggn_infer_destroy(f);
    return NULL;
}

void ggn_infer_destroy(struct ggn_infer *f)
{
    if (!f)
        return;
    ggn_exec_destroy_f32(f->r);
    ggn_exec_destroy_f32(f->m);
    ggn_exec_destroy_f32(f->d);
    free(f);
}

/* Bytes into 3 planes of an executor's input, from plane `first`. */
static void set_bytes(const struct ggn_infer *f, const struct ggn_exec_f32 *e, int first, const uint8_t *rgb)
{
    const struct ggn_value *v = &e->graph->value[0];

    for (int c = 0; c < 3; c++)
        for (int y = 0; y < v->h; y++) {
            float *row = ggn_exec_plane_f32(e, 0, 0, first + c) + (long)y * v->row;
            for (int x = 0; x < v->w; x++)
                row[x] = f->of_byte[*rgb++];
        }
}

static void set_denoised(const struct ggn_exec_f32 *e, int first, const uint16_t *image)
{
    const struct ggn_value *v = &e->graph->value[0];

    for (int c = 0; c < 3; c++)
        for (int y = 0; y < v->h; y++, image += v->w) {
            float *row = ggn_exec_plane_f32(e, 0, 0, first + c) + (long)y * v->row;
            for (int x = 0; x < v->w; x++)
                row[x] = (float)image[x] * (1.0f / 65535.0f);
        }
}

static void denoise(struct ggn_infer *f, const uint8_t *rgb)
{
    set_bytes(f, f->r, 0, rgb);
    ggn_exec_forward_f32(f->r, f->model->weights[GGN_NET_R], 1, GGN_EVAL);
}

void ggn_infer_push(struct ggn_infer *f, void *history, const uint8_t *rgb, uint64_t spp)
{
    const struct ggn_hyper *h = &f->model->hyper;
    struct history_head *head = history;
    const int out = f->r->graph->n_values - 1;
    const struct ggn_value *v = &f->r->graph->value[out];

    if (head->count && ggn_history_spp(history, h, (int)head->count - 1) == spp)
        return;
    head->window = (uint32_t)h->window;
    head->area = (uint32_t)area_of(h);
    denoise(f, rgb);
    memcpy(noisy_of(history, h, (int)head->next), rgb, 3 * area_of(h));
    uint16_t *image = denoised_of(history, h, (int)head->next);
    head->broken[head->next] = 0;
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < v->h; y++, image += v->w) {
            const float *row = ggn_exec_plane_f32(f->r, out, 0, c) + (long)y * v->row;
            for (int x = 0; x < v->w; x++) {
                int number = row[x] >= 0; /* a sigmoid: 0..1 unless it is NaN */
                head->broken[head->next] |= (uint8_t)!number;
                image[x] = (uint16_t)(int)((number ? row[x] : 0) * 65535.0f + 0.5f);
            }
        }
    head->spp[head->next] = spp;
    head->next = (head->next + 1) % (uint32_t)h->window;
    head->count += head->count < (uint32_t)h->window;
}

/* The generator's map of its present input, into plane c of the discriminator's input. */
static void map_into(struct ggn_infer *f, int c)
{
    const int out = f->m->graph->n_values - 1;
    const struct ggn_value *v = &f->m->graph->value[out];

    ggn_exec_forward_f32(f->m, f->model->weights[GGN_NET_M], 1, GGN_EVAL);
    for (int y = 0; y < v->h; y++)
        memcpy(ggn_exec_plane_f32(f->d, 0, 0, c) + (long)y * v->row, ggn_exec_plane_f32(f->m, out, 0, 0) + (long)y * v->row,
               (size_t)v->w * sizeof(float));
}

int ggn_infer_decide(struct ggn_infer *f, const void *history, double *p_noisy, double *logit)
{
    const struct ggn_hyper *h = &f->model->hyper;
    const struct history_head *head = history;

    if (head->count < (uint32_t)h->window)
        return GGN_EINVAL;
    int broken = 0;
    for (int i = 0; i < h->window; i++)
        broken |= head->broken[i];
    for (int i = 0; i < h->window; i++)
        set_denoised(f->m, 3 * i, denoised_of(history, h, ring_of(head, h, i)));
    map_into(f, 0);
    for (int i = 0; i < h->window; i++)
        set_bytes(f, f->m, 3 * i, noisy_of(history, h, ring_of(head, h, i)));
    map_into(f, 1);
    ggn_exec_forward_f32(f->d, f->model->weights[GGN_NET_D], 1, GGN_EVAL);
    double z = broken ? NAN : (double)*ggn_exec_plane_f32(f->d, f->d->graph->n_values - 1, 0, 0);
    if (logit)
        *logit = z;
    /* an error costs time, never quality */
    *p_noisy = isfinite(z) ? ggn_sigmoid(f->model->calibration.scale * z + f->model->calibration.shift) : 1;
    return GGN_OK;
}

void ggn_infer_denoise(struct ggn_infer *f, const uint8_t *rgb, float *out)
{
    const int last = f->r->graph->n_values - 1;
    const struct ggn_value *v = &f->r->graph->value[last];

    denoise(f, rgb);
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < v->h; y++, out += v->w)
            memcpy(out, ggn_exec_plane_f32(f->r, last, 0, c) + (long)y * v->row, (size_t)v->w * sizeof *out);
}
