/*
 * Image files for textures, from memory. The first byte selects the format. OpenImageIO and the codecs behind it are not
 * built with the sanitizer: what is checked is our use of them, and that damage comes back as one line.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "image/oiio.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const names[] = {"t.png", "t.tga", "t.hdr", "t.jpg"};
    struct pt_oiio_image image = {0};
    struct base_err err = {0};
    if (size == 0)
        return 0;
    if (pt_oiio_read_memory(names[data[0] % 4], data + 1, size - 1, &image, &err) != 0) {
        if (err.text[0] == '\0' || strchr(err.text, '\n'))
            abort();
        return 0;
    }
    size_t n = (size_t)image.width * (size_t)image.height * (size_t)image.channels;
    float sum = 0;
    for (size_t i = 0; i < n; i += 97)
        sum += image.u8 ? (float)image.u8[i] : image.f32[i];
    volatile float seen = sum;
    (void)seen;
    pt_oiio_release(&image);
    return 0;
}
