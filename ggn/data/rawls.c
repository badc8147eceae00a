#include "data/rawls.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/files.h"
#include "base/half.h"

/* The start of the line after a line "DATA", or NULL. */
static const char *find_data(const char *p, const char *end)
{
    while (p < end) {
        const char *eol = memchr(p, '\n', (size_t)(end - p));
        if (!eol)
            return NULL;
        if (eol - p == 4 && memcmp(p, "DATA", 4) == 0)
            return eol + 1;
        p = eol + 1;
    }
    return NULL;
}

int ggn_rawls_parse(const char *path, const char *data, size_t size, struct pic_image *image, struct base_err *err)
{
    static const char head[] = "IHDR\n12\n", comments[] = "\nCOMMENTS\n";
    const size_t fixed = sizeof head - 1 + 12 + sizeof comments - 1;
    if (size < fixed || memcmp(data, head, sizeof head - 1) != 0 || memcmp(data + 20, comments, sizeof comments - 1) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a rawls image", path);
    const uint8_t *start = (const uint8_t *)data;
    uint32_t width = base_get_u32(start + 8), height = base_get_u32(start + 12), channels = base_get_u32(start + 16);
    if (width < 1 || height < 1 || width > PIC_MAX_SIDE || height > PIC_MAX_SIDE ||
        (size_t)width * height > PIC_MAX_PIXELS || (channels != 1 && channels != 3))
        return base_fail(err, BASE_EINVAL, "%s: %ux%u with %u channels cannot be used", path, width, height, channels);
    const char *end = data + size, *p = find_data(data + fixed, end);
    p = p ? memchr(p, '\n', (size_t)(end - p)) : NULL; /* the line with the size says nothing new */
    size_t row = (size_t)width * channels * 4 + 1;
    if (!p || (size_t)(end - (p + 1)) < row * height - 1)
        return base_fail(err, BASE_EINVAL, "%s: truncated", path);
    float *out = malloc((size_t)width * height * 3 * sizeof *out);
    if (!out)
        return base_fail_nomem(err, path);
    float *to = out;
    p++;
    for (uint32_t y = 0; y < height; y++, p++)
        for (uint32_t x = 0; x < width; x++, p += 4 * channels)
            for (uint32_t c = 0; c < 3; c++) {
                *to = base_f32_of_bits(base_get_u32((const uint8_t *)(p + 4 * (channels == 3 ? c : 0))));
                if (!isfinite(*to++)) {
                    free(out);
                    return base_fail(err, BASE_EINVAL, "%s: pixel %u,%u is not finite", path, x, y);
                }
            }
    *image = (struct pic_image){.width = (int)width, .height = (int)height, .channels = 3, .is_float_file = 1, .f32 = out};
    return 0;
}

int ggn_rawls_read(const char *path, struct pic_image *image, struct base_err *err)
{
    char *data;
    size_t size;
    int rc = base_file_read(path, (size_t)1 << 31, &data, &size, err);
    if (rc)
        return rc;
    rc = ggn_rawls_parse(path, data, size, image, err);
    free(data);
    return rc;
}
