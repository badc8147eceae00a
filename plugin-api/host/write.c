#include "host/frame.h"

#include <stdlib.h>

#include "base/colour.h"
#include "base/files.h"
#include "base/paths.h"
#include "picture/png.h"
#include "picture/read.h"

int32_t lull_host_check_outputs(const struct lull_host_output *outputs, uint32_t output_count, const char *const *inputs,
                                uint32_t input_count, struct lull_error *err)
{
    struct base_outputs list = {0};
    struct base_inputs read = BASE_INPUTS_EMPTY;
    struct base_err e = {0};
    int rc = 0;
    if ((output_count > 0 && !outputs) || (input_count > 0 && !inputs))
        return lull_host_given(err, "outputs", output_count > 0 ? outputs : (const void *)"", "inputs", inputs, NULL);
    for (uint32_t i = 0; i < output_count && !rc; i++)
        rc = base_outputs_add(&list, outputs[i].option, outputs[i].path, &e);
    for (uint32_t i = 0; i < input_count && !rc; i++)
        rc = base_inputs_add(&read, inputs[i], &e);
    if (!rc)
        rc = base_outputs_protect(&list, &read, &e);
    base_inputs_release(&read);
    return rc ? lull_host_translate(&e, err) : LULL_OK;
}

struct lull_host_file {
    struct base_file_out out;
};

int32_t lull_host_file_begin(const char *path, struct lull_host_file **out, int32_t *descriptor, struct lull_error *err)
{
    struct base_err e = {0};
    int32_t code = lull_host_given(err, "path", path, "out", out, "descriptor", descriptor, NULL);
    if (code != LULL_OK)
        return code;
    struct lull_host_file *f = malloc(sizeof *f);
    if (!f)
        return lull_host_no_memory(err, path);
    if (base_file_begin(&f->out, path, &e) != 0) {
        free(f);
        return lull_host_translate(&e, err);
    }
    *descriptor = fileno(f->out.file);
    *out = f;
    return LULL_OK;
}

int32_t lull_host_file_commit(struct lull_host_file *f, struct lull_error *err)
{
    struct base_err e = {0};
    int32_t code = lull_host_given(err, "file", f, NULL);
    if (code != LULL_OK)
        return code;
    int rc = base_file_commit(&f->out, &e);
    free(f);
    return rc ? lull_host_translate(&e, err) : LULL_OK;
}

void lull_host_file_abort(struct lull_host_file *f)
{
    if (f)
        base_file_abort(&f->out);
    free(f);
}

void lull_host_srgb(const double *linear, uint64_t count, uint8_t *codes)
{
    for (uint64_t i = 0; i < count; i++)
        codes[i] = base_srgb_code(linear[i]);
}

int32_t lull_host_write_png(const char *path, uint32_t width, uint32_t height, const uint8_t *rgb, struct lull_error *err)
{
    struct base_err e = {0};
    int32_t code = lull_host_given(err, "path", path, "rgb", rgb, NULL);
    if (code != LULL_OK)
        return code;
    if (width == 0 || height == 0 || width > INT32_MAX || height > INT32_MAX)
        return lull_error_set(err, LULL_E_INVALID, "%s: a picture of %ux%u pixels: expected 1 to 2^31 - 1", path, width,
                              height);
    return pic_write_png(path, (int32_t)width, (int32_t)height, 3, rgb, &e) ? lull_host_translate(&e, err) : LULL_OK;
}

/* `needed` is looked for first: a file without it is refused before its picture is decoded. */
static int read_shown(const char *path, const char *layer, const char *needed, struct pic_image *out, struct base_err *err)
{
    struct pic_image values;
    int rc = needed ? pic_read_channel(path, needed, &values, err) : 0;
    if (rc)
        return rc;
    if (needed)
        pic_release(&values);
    if (!layer)
        return pic_read_display(path, out, err);
    rc = pic_read_layer(path, layer, out, err);
    if (!rc && (rc = pic_encode(path, out, err)) != 0)
        pic_release(out);
    return rc;
}

int32_t lull_host_read_shown(const char *path, const char *layer, const char *needed, uint32_t *width, uint32_t *height,
                             const struct lull_writer *rgb, struct lull_error *err)
{
    struct base_err e = {0};
    struct pic_image image;
    int32_t code = lull_host_given(err, "path", path, "width", width, "height", height, "rgb", rgb, NULL);
    if (code != LULL_OK)
        return code;
    if (read_shown(path, layer, needed, &image, &e) != 0)
        return lull_host_translate(&e, err);
    code = rgb->write(rgb, image.u8, 3 * (uint64_t)image.width * (uint64_t)image.height);
    if (code == LULL_OK) {
        *width = (uint32_t)image.width;
        *height = (uint32_t)image.height;
    } else
        lull_error_set(err, code, "%s: the caller did not take its pixels", path);
    pic_release(&image);
    return code;
}
