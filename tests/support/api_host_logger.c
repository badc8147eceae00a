#include "support/api_host_logger.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct api_host_heard heard;

void note(const char *format, ...)
{
    size_t n = strlen(heard.calls);
    va_list args;
    va_start(args, format);
    vsnprintf(heard.calls + n, sizeof heard.calls - n, format, args);
    va_end(args);
}

static int32_t said(int32_t code, struct lull_error *err)
{
    if (code != LULL_OK) {
        err->code = code;
        strcpy(err->message, "the moon is full");
    }
    return code;
}

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                      struct lull_instance **out, struct lull_error *err)
{
    if (heard.create != LULL_OK)
        return said(heard.create, err);
    struct lull_instance *in = calloc(1, sizeof *in);
    assert_true(in && stride == sizeof *pairs);
    in->host = host;
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(pairs[i].key, "threshold") == 0)
            in->quality = strtod(pairs[i].value, NULL);
    note("create %g of %u; ", in->quality, count);
    *out = in;
    return LULL_OK;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *needs, struct lull_error *err)
{
    assert_int_equal(needs->struct_size, sizeof *needs);
    (void)in;
    *needs = heard.needs;
    return said(heard.require, err);
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *opened, struct lull_error *err)
{
    heard.frame = *opened;
    const uint32_t kept = opened->block_count < MOST ? opened->block_count : MOST;
    memcpy(heard.rects, opened->blocks, kept * sizeof *opened->blocks);
    note("begin %g; ", in->quality);
    return said(heard.begin, err);
}

static double at(const struct lull_view *seen, int plane, int x, int y, int channel)
{
    const struct lull_plane *p = &seen->planes[plane];
    const char *data = p->data;
    data += (x - seen->x0) * p->stride_x + (y - seen->y0) * p->stride_y + channel * p->stride_c;
    return p->type == LULL_TYPE_U32 ? (double)*(const uint32_t *)(const void *)data : *(const double *)(const void *)data;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    assert_true(block_stride == sizeof *blocks && decision_stride == sizeof *decisions);
    heard.view = *view;
    memcpy(heard.planes, view->planes, sizeof heard.planes);
    memcpy(heard.all, view->all, view->all_count * sizeof *view->all);
    memcpy(heard.due, blocks, count * sizeof *blocks);
    heard.count = count;
    heard.preset = decisions[0];
    heard.corner[0] = at(view, LULL_PLANE_COLOR, 8, 6, 1);
    heard.corner[1] = at(view, LULL_PLANE_HALF, 8, 6, 2);
    heard.corner[2] = at(view, LULL_PLANE_MOMENT2, 8, 6, 0);
    heard.corner[3] = at(view, LULL_PLANE_NORMAL, 8, 6, 2);
    heard.corner[4] = at(view, LULL_PLANE_DEPTH, 8, 6, 0);
    heard.pixel_spp = view->planes[LULL_PLANE_SPP].data ? at(view, LULL_PLANE_SPP, 8, 6, 0) : -1;
    for (int i = 0; i < 2; i++)
        heard.weight[i] = view->planes[LULL_PLANE_WEIGHT].data ? at(view, LULL_PLANE_WEIGHT, 8 + i, 6, 0) : -1;
    note("ask %g of", in->quality);
    for (uint32_t k = 0; k < count; k++) {
        note(" %u%s", blocks[k].id, blocks[k].flags & LULL_BLOCK_FINAL ? "!" : "");
        decisions[k] = heard.answer[blocks[k].id];
    }
    note("; ");
    return said(in->quality == heard.fails_at && in->quality > 0 ? LULL_E_INTERNAL : heard.evaluate, err);
}

static void end_frame(struct lull_instance *in) { note("end %g; ", in->quality); }

static void destroy(struct lull_instance *in)
{
    note("destroy %g; ", in->quality);
    free(in);
}

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    unsigned char bytes[3] = {1, 2, (unsigned char)(16 * in->quality)};
    assert_int_equal(writer->write(writer, bytes, 1), LULL_OK);
    assert_int_equal(writer->write(writer, bytes, 0), LULL_OK);
    assert_int_equal(writer->write(writer, bytes + 1, 2), LULL_OK);
    return said(heard.save, err);
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    (void)in;
    memset(heard.state, 0, sizeof heard.state);
    int32_t code = reader->read(reader, heard.state, 2);
    if (code == LULL_OK)
        code = reader->read(reader, heard.state + 2, 1);
    if (code != LULL_OK)
        strcpy(err->message, "cut");
    return code == LULL_OK ? said(heard.load, err) : code;
}

static const void *get_extension(const char *id)
{
    static const struct lull_state state = {.struct_size = sizeof state, .save = save, .load = load};
    return strcmp(id, LULL_EXT_STATE) == 0 ? &state : NULL;
}

const struct lull_param parameters[2] = {
    {.name = "visible", .help = "h", .min = 0.001, .max = 1, .type = LULL_PARAM_FLOAT},
    {.name = "threshold", .help = "h", .default_value = "0.5", .min = 0.25, .max = 4, .type = LULL_PARAM_FLOAT}};
struct lull_criterion table = {.struct_size = sizeof table,
                               .id = "logger",
                               .name = "l",
                               .version = "3",
                               .description = "d",
                               .params = parameters,
                               .param_count = 2,
                               .param_stride = sizeof parameters[0],
                               .create = create,
                               .requirements = requirements,
                               .begin_frame = begin_frame,
                               .evaluate = evaluate,
                               .end_frame = end_frame,
                               .destroy = destroy,
                               .get_extension = get_extension};

int32_t gather(const struct lull_writer *writer, const void *data, uint64_t size)
{
    char **end = writer->context;
    memcpy(*end, data, (size_t)size);
    *end += size;
    return LULL_OK;
}
