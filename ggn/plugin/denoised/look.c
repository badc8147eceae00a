#include "plugin/denoised/look.h"

#include "plugin/denoised/cover.h"
#include "plugin/rect.h"

/* Pixels of a rectangle that more than one block share, at most: the denoiser takes 600 bytes a pixel while it works. */
static const int64_t MOST_SHARED = 1 << 20;

/* A side of a block with what is around it wherever it lies, as far as the area and its margin reach. */
static int64_t widened(int32_t side, int32_t area)
{
    const int64_t around = (int64_t)side + 2 * GD_REACH, whole = (int64_t)area + 2 * LULL_OIDN_MARGIN;
    return around < whole ? around : whole;
}

struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality, uint32_t threads)
{
    struct gd_form form = {.area = gp_rect_of_frame(frame), .blocks = frame->block_count};
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        form.width = gp_most(form.width, r->x1 - r->x0);
        form.height = gp_most(form.height, r->y1 - r->y0);
    }
    /* The largest block must fit with what is around it, wherever it lies; more blocks share a rectangle up to a limit. */
    const int32_t area_width = form.area.x1 - form.area.x0, area_height = form.area.y1 - form.area.y0;
    const int64_t width = widened(area_width, area_width), height = widened(area_height, area_height);
    const int64_t alone = widened(form.width, area_width) * widened(form.height, area_height);
    const int64_t shared = width * height < MOST_SHARED ? width * height : MOST_SHARED;
    form.most = alone > shared ? alone : shared;
    const int64_t rows = (form.most - 1) / width + 1;
    form.room.width = width < INT32_MAX ? (int32_t)width : INT32_MAX; /* there is no memory for it */
    form.room.height = rows < INT32_MAX ? (int32_t)rows : INT32_MAX;
    form.room.albedo = (frame->planes & LULL_PLANE_BIT(LULL_PLANE_ALBEDO)) != 0;
    form.room.normal = form.room.albedo && (frame->planes & LULL_PLANE_BIT(LULL_PLANE_NORMAL)) != 0;
    form.room.quality = (int32_t)quality;
    form.room.threads = (int32_t)threads;
    form.room.exposure = isfinite(frame->exposure) && frame->exposure > 0 ? (float)frame->exposure : 1.0f;
    return form;
}

int gd_look_open(struct gd_look *look, const struct gd_form *form, const char *library, struct base_err *err)
{
    *look = (struct gd_look){0};
    if (form->area.x1 > INT32_MAX / 2 || form->area.y1 > INT32_MAX / 2)
        return base_fail_nomem(err, "the pictures of blocks");
    look->asked = calloc(form->blocks, sizeof *look->asked);
    if (!look->asked)
        return base_fail_nomem(err, "the blocks");
    return lull_denoised_open(&look->pair, library, &form->room, err);
}

void gd_look_close(struct gd_look *look)
{
    lull_denoised_close(&look->pair);
    free(look->asked);
}

/* Whether the halves of a pixel are numbers; if so, whether they differ. */
static int is_good(const double mean[3], const double half[3], int *differ)
{
    int good = 1;
    for (int c = 0; c < 3; c++) {
        good &= isfinite((float)mean[c]) && isfinite((float)half[c]);
        *differ |= half[c] != mean[c] && isfinite(half[c]) && isfinite(mean[c]);
    }
    return good;
}

enum gd_halves gd_halves_of(const struct lull_view *view, const struct lull_block *block, struct lull_kit_tally *tally)
{
    const uint32_t planes = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF);
    struct lull_kit_tally count = {0};
    struct lull_kit_span s;
    double first[3] = {0};
    int differ = 0, structured = 0;
    for (lull_kit_span_begin(&s, view, block, planes); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            const double *mean = s.value[LULL_PLANE_COLOR][i];
            const int good = is_good(mean, s.value[LULL_PLANE_HALF][i], &differ);
            if (differ)
                return GD_HALVES_DIFFER;
            if (good && count.valid == 0)
                memcpy(first, mean, sizeof first);
            structured |= good && memcmp(first, mean, sizeof first) != 0;
            count.valid += good;
            count.bad += !good;
        }
    *tally = count;
    return structured ? GD_HALVES_STRUCTURED : GD_HALVES_PLAIN;
}

static struct lull_denoised_rect in_box(const struct gd_look *look, struct lull_rect r)
{
    return (struct lull_denoised_rect){r.x0 - look->box.x0, r.y0 - look->box.y0, r.x1 - look->box.x0, r.y1 - look->box.y0};
}

/* What is no number is as the pixel to the left, which may be a copy itself; or black. */
static void replace(struct lull_denoised_pair *pair, size_t at, int before)
{
    for (int k = 0; k < 2; k++)
        for (size_t c = 3 * at; c < 3 * at + 3; c++)
            pair->half[k][c] = before ? pair->half[k][c - 3] : 0.0f;
}

/* The pixels of `rect`, which are of block b, go into the rectangle. Nothing is copied across a line of the grid, where
 * another rectangle could begin. */
static void read_part(struct gd_look *look, struct lull_rect rect, const struct lull_view *view, const struct lull_block *b,
                      struct lull_kit_tally *tally)
{
    const double n = (double)b->spp, h = (double)b->half_spp;
    struct lull_denoised_pair *pair = &look->pair;
    const size_t row = (size_t)pair->width;
    const uint32_t planes = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) |
                            (pair->albedo ? LULL_PLANE_BIT(LULL_PLANE_ALBEDO) : 0) |
                            (pair->normal ? LULL_PLANE_BIT(LULL_PLANE_NORMAL) : 0);
    struct lull_block part = *b;
    struct lull_kit_span s;
    part.x0 = rect.x0, part.y0 = rect.y0, part.x1 = rect.x1, part.y1 = rect.y1;
    if (rect.x0 >= rect.x1 || rect.y0 >= rect.y1)
        return;
    for (lull_kit_span_begin(&s, view, &part, planes); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            const int32_t x = s.x + i - look->box.x0;
            const size_t at = (size_t)(s.y - look->box.y0) * row + (size_t)x;
            const int good = lull_denoised_put(pair, at, s.value[LULL_PLANE_COLOR][i], s.value[LULL_PLANE_HALF][i], n, h);
            tally->valid += good;
            tally->bad += !good;
            if (!good)
                replace(pair, at, s.x + i > b->x0 && x % LULL_OIDN_GRID != 0);
            for (size_t c = 0; c < 3; c++) {
                if (s.planes & LULL_PLANE_BIT(LULL_PLANE_ALBEDO))
                    pair->albedo[3 * at + c] = (float)s.value[LULL_PLANE_ALBEDO][i][c];
                if (s.planes & LULL_PLANE_BIT(LULL_PLANE_NORMAL))
                    pair->normal[3 * at + c] = (float)s.value[LULL_PLANE_NORMAL][i][c];
            }
        }
}

static const struct lull_block *block_at(const struct lull_kit_batch *batch, uint32_t i)
{
    return lull_kit_at(batch->blocks, batch->block_stride, i);
}

static int cancelled(void *data)
{
    const struct lull_host *host = *(const struct lull_host **)data;
    return host->cancelled(host);
}

int gd_look_run(struct gd_look *look, const struct gd_form *form, const struct lull_kit_batch *batch,
                const struct lull_rect *box, const uint32_t *members, uint32_t count, struct lull_kit_tally *tally,
                struct base_err *err)
{
    const struct lull_host *host = lull_kit_read_of(batch->in)->host;
    const struct lull_view *view = batch->view;
    const struct lull_rect seen = {view->x0, view->y0, view->x1, view->y1};
    struct lull_kit_tally around = {0};
    look->box = *box;
    look->known =
        view->all ? gp_rect_common(gp_rect_common(*box, form->area), seen) : gp_rect_of(block_at(batch, members[0]));
    lull_denoised_begin(&look->pair, box->x1 - box->x0, box->y1 - box->y0);
    /* Blocks are read as the question has them, what is around them as view->all has it. */
    for (uint32_t k = 0; k < count; k++)
        look->asked[block_at(batch, members[k])->id] = 1;
    for (uint32_t i = 0; view->all && i < view->all_count; i++) {
        const struct lull_block *other = lull_kit_at(view->all, view->all_stride, i);
        if (other->id < form->blocks && !look->asked[other->id] && other->spp > 0)
            read_part(look, gp_rect_common(gp_rect_of(other), look->known), view, other, &around);
    }
    for (uint32_t k = 0; k < count; k++) {
        const struct lull_block *b = block_at(batch, members[k]);
        read_part(look, gp_rect_of(b), view, b, &tally[b->id]);
        look->asked[b->id] = 0;
    }
    lull_denoised_mirror(&look->pair, in_box(look, look->known));
    return lull_denoised_run(&look->pair, host && host->cancelled ? cancelled : NULL, &host, err);
}

struct lull_denoised_rect gd_look_place(const struct gd_look *look, const struct lull_block *block)
{
    return in_box(look, gp_rect_of(block));
}
