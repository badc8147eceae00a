#include "image/exr.h"

#include <openexr.h>

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"

enum { MAX_CHANNELS = 64 };

static void ignore_message(exr_const_context_t file, exr_result_t code, const char *text)
{
    (void)file;
    (void)code;
    (void)text;
}

static exr_result_t write_header(exr_context_t file, const struct pt_exr_image *image)
{
    int part = 0;
    exr_result_t rc = exr_add_part(file, "lull", EXR_STORAGE_SCANLINE, &part);
    const exr_attr_box2i_t display = {.max.x = image->width - 1, .max.y = image->height - 1}, /* EXR's include their last */
        stored = {.min.x = image->x0, .min.y = image->y0, .max.x = image->x1 - 1, .max.y = image->y1 - 1};
    const exr_attr_v2f_t centre = {.x = 0.0f, .y = 0.0f};
    if (rc == EXR_ERR_SUCCESS)
        rc = exr_initialize_required_attr(file, part, &display, &stored, 1.0f, &centre, 1.0f, EXR_LINEORDER_INCREASING_Y,
                                          EXR_COMPRESSION_ZIP);
    for (int c = 0; c < image->channel_count && rc == EXR_ERR_SUCCESS; c++)
        rc = exr_add_channel(file, part, image->channels[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    for (int i = 0; i < image->attribute_count && rc == EXR_ERR_SUCCESS; i++) {
        const struct pt_exr_attribute *a = &image->attributes[i];
        rc = a->text ? exr_attr_set_string(file, part, a->name, a->text)
                     : exr_attr_set_double(file, part, a->name, a->number);
    }
    return rc == EXR_ERR_SUCCESS ? exr_write_header(file) : rc;
}

/* Which of our channels the library calls `name` (it sorts them). */
static int channel_index(const struct pt_exr_image *image, const char *name)
{
    for (int c = 0; c < image->channel_count; c++)
        if (strcmp(image->channels[c], name) == 0)
            return c;
    return 0;
}

/* The library asks for channels in its own order; ours are planes over the lines of the chunk. */
static exr_result_t write_chunk(exr_context_t file, const struct pt_exr_image *image, exr_encode_pipeline_t *pipe, int y,
                                int lines, float *pixels)
{
    size_t width = (size_t)(image->x1 - image->x0), plane = width * (size_t)lines;
    exr_chunk_info_t chunk;
    exr_result_t rc = exr_write_scanline_chunk_info(file, 0, y, &chunk);
    if (rc != EXR_ERR_SUCCESS)
        return rc;
    int first = y == image->y0;
    rc = first ? exr_encoding_initialize(file, 0, &chunk, pipe) : exr_encoding_update(file, 0, &chunk, pipe);
    if (rc != EXR_ERR_SUCCESS)
        return rc;
    for (int line = 0; line < chunk.height; line++) {
        float *rows[MAX_CHANNELS];
        for (int c = 0; c < image->channel_count; c++)
            rows[c] = pixels + (size_t)c * plane + (size_t)line * width;
        image->row(image->data, y + line, rows);
    }
    for (int i = 0; i < pipe->channel_count; i++) {
        exr_coding_channel_info_t *ch = &pipe->channels[i];
        ch->encode_from_ptr = (const uint8_t *)(pixels + (size_t)channel_index(image, ch->channel_name) * plane);
        ch->user_pixel_stride = (int32_t)sizeof(float);
        ch->user_line_stride = (int32_t)(width * sizeof(float));
        ch->user_bytes_per_element = sizeof(float);
        ch->user_data_type = EXR_PIXEL_FLOAT;
    }
    if (first)
        rc = exr_encoding_choose_default_routines(file, 0, pipe);
    return rc == EXR_ERR_SUCCESS ? exr_encoding_run(file, 0, pipe) : rc;
}

static exr_result_t write_pixels(exr_context_t file, const struct pt_exr_image *image)
{
    int32_t lines = 1;
    exr_encode_pipeline_t pipe = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_result_t rc = exr_get_scanlines_per_chunk(file, 0, &lines);
    if (rc != EXR_ERR_SUCCESS)
        return rc;
    float *pixels = calloc((size_t)image->channel_count * (size_t)(image->x1 - image->x0) * (size_t)lines, sizeof *pixels);
    if (!pixels)
        return EXR_ERR_OUT_OF_MEMORY;
    for (int y = image->y0; y < image->y1 && rc == EXR_ERR_SUCCESS; y += lines)
        rc = write_chunk(file, image, &pipe, y, lines, pixels);
    exr_encoding_destroy(file, &pipe);
    free(pixels);
    return rc;
}

struct sink {
    int fd, reason; /* reason: errno of a write that failed; 0: none did */
};

/* The library jumps about in the file: its head comes last. */
static int64_t write_at(exr_const_context_t file, void *data, const void *bytes, uint64_t size, uint64_t offset,
                        exr_stream_error_func_ptr_t fail)
{
    struct sink *sink = data;
    (void)file;
    (void)fail;
    uint64_t done = 0;
    while (done < size) {
        errno = EIO;
        ssize_t n = pwrite(sink->fd, (const char *)bytes + done, (size_t)(size - done), (off_t)(offset + done));
        if (n <= 0) {
            sink->reason = errno;
            return -1;
        }
        done += (uint64_t)n;
    }
    return (int64_t)size;
}

int pt_exr_is_whole(const char *path)
{
    exr_context_t file = NULL;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_attr_box2i_t stored;
    int32_t lines = 1;
    init.error_handler_fn = ignore_message;
    int whole = base_file_check_input(path, NULL) == 0 && exr_start_read(&file, path, &init) == EXR_ERR_SUCCESS &&
                exr_get_data_window(file, 0, &stored) == EXR_ERR_SUCCESS &&
                exr_get_scanlines_per_chunk(file, 0, &lines) == EXR_ERR_SUCCESS;
    for (int64_t y = whole ? stored.min.y : 0; whole && y <= stored.max.y; y += lines) {
        exr_chunk_info_t chunk;
        whole = exr_read_scanline_chunk_info(file, 0, (int)y, &chunk) == EXR_ERR_SUCCESS;
    }
    if (file)
        exr_finish(&file);
    return whole;
}

int pt_exr_write(const char *path, const struct pt_exr_image *image, struct base_err *err)
{
    struct base_file_out out;
    if (image->channel_count < 1 || image->channel_count > MAX_CHANNELS)
        return base_fail(err, BASE_EINVAL, "%s: %d channels, at most %d can be written", path, image->channel_count,
                         MAX_CHANNELS);
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    exr_context_t file = NULL;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = ignore_message;
    struct sink sink = {.fd = fileno(out.file)};
    init.user_data = &sink;
    init.write_fn = write_at;
    exr_result_t code = exr_start_write(&file, out.tmp_path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (code == EXR_ERR_SUCCESS)
        code = write_header(file, image);
    if (code == EXR_ERR_SUCCESS)
        code = write_pixels(file, image);
    exr_result_t finish = file ? exr_finish(&file) : EXR_ERR_SUCCESS;
    if (code == EXR_ERR_SUCCESS)
        code = finish;
    if (code == EXR_ERR_SUCCESS)
        return base_file_commit(&out, err);
    base_file_abort(&out);
    if (sink.reason)
        return base_fail(err, BASE_EIO, "%s: write failed: %s", path, strerror(sink.reason));
    if (code == EXR_ERR_OUT_OF_MEMORY)
        return base_fail_nomem(err, path);
    return base_fail(err, BASE_EIO, "%s: cannot write EXR: %s", path, exr_get_default_error_message(code));
}
