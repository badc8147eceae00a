#include "picture/png.h"

#include <png.h>
#include <stdlib.h>

#include "base/files.h"

int pic_write_png(const char *path, int32_t width, int32_t height, int channels, const uint8_t *pixels, struct base_err *err)
{
    static const png_uint_32 formats[] = {PNG_FORMAT_GRAY, PNG_FORMAT_GA, PNG_FORMAT_RGB, PNG_FORMAT_RGBA};
    if (width < 1 || height < 1 || channels < 1 || channels > 4 || width > (INT32_MAX - 1) / channels)
        return base_fail(err, BASE_EINVAL, "%s: cannot write %dx%d pixels of %d channels as PNG", path, width, height,
                         channels);
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)width,
                       .height = (png_uint_32)height,
                       .format = formats[channels - 1]};
    struct base_file_out file;
    int rc = base_file_begin(&file, path, err);
    if (rc)
        return rc;
    if (png_image_write_to_stdio(&image, file.file, 0, pixels, 0, NULL) || ferror(file.file))
        return base_file_commit(&file, err); /* which says why a write failed */
    base_file_abort(&file);
    return base_fail(err, BASE_EIO, "%s: %s", path, image.message);
}

int pic_png_bytes(int32_t width, int32_t height, const uint8_t *rgb, uint8_t **bytes, size_t *size, struct base_err *err)
{
    png_image image = {
        .version = PNG_IMAGE_VERSION, .width = (png_uint_32)width, .height = (png_uint_32)height, .format = PNG_FORMAT_RGB};
    png_alloc_size_t most = PNG_IMAGE_PNG_SIZE_MAX(image);
    uint8_t *png = malloc(most);
    if (!png)
        return base_fail_nomem(err, "a picture as PNG");
    if (!png_image_write_to_memory(&image, png, &most, 0, rgb, 0, NULL)) {
        free(png);
        return base_fail(err, BASE_EINVAL, "%s", image.message);
    }
    *bytes = png;
    *size = most;
    return 0;
}
