/*
 * Image files from memory. The first byte selects the format and what is wanted: the pixels as stored (textures), what a display
 * shows, one channel. OpenImageIO and the codecs behind it are not
 * built with the sanitizer: what is checked is our use of them, and that damage comes back as one line. Headers that claim
 * many pixels, though no more than may be, are passed by: filling them would take nearly all of the time.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "picture/oiio.h"
#include "picture/read.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Pixels that the header claims, 0 if it is not found. */
static double claimed(unsigned format, const uint8_t *p, size_t size)
{
    double width = 0, height = 0;
    if (format == 0 && size >= 24) { /* PNG: big endian after IHDR */
        width = p[16] * 16777216.0 + p[17] * 65536.0 + p[18] * 256.0 + p[19];
        height = p[20] * 16777216.0 + p[21] * 65536.0 + p[22] * 256.0 + p[23];
    } else if (format == 1 && size >= 16) { /* TGA: little endian */
        width = p[12] + 256.0 * p[13];
        height = p[14] + 256.0 * p[15];
    }
    for (size_t i = 0; format == 2 && i + 4 < size; i++) /* Radiance: "-Y height +X width", any signs and order */
        if ((p[i] == '+' || p[i] == '-') && (p[i + 1] == 'X' || p[i + 1] == 'Y')) {
            char number[16] = "";
            memcpy(number, p + i + 2, size - i - 2 < 15 ? size - i - 2 : 15);
            *(p[i + 1] == 'X' ? &width : &height) = strtod(number, NULL);
        }
    for (size_t i = 0; format == 3 && i + 8 < size; i++) /* JPEG: a frame header */
        if (p[i] == 0xff && p[i + 1] >= 0xc0 && p[i + 1] <= 0xc2) {
            height = p[i + 5] * 256.0 + p[i + 6];
            width = p[i + 7] * 256.0 + p[i + 8];
        }
    return width * height;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    enum { FEW = 1 << 12, MOST = PIC_MAX_PIXELS }; /* the reader's own limit is the second */
    static const char *const names[] = {"t.png", "t.tga", "t.hdr", "t.jpg"};
    struct pic_image image = {0};
    struct base_err err = {0};
    if (size == 0)
        return 0;
    double pixels = claimed(data[0] % 4, data + 1, size - 1);
    if (pixels > FEW && pixels <= MOST)
        return 0;
    const struct pic_request request = {.wanted = (enum pic_wanted)(data[0] / 4 % 3),
                                        .name = names[data[0] % 4],
                                        .data = data + 1,
                                        .size = size - 1,
                                        .channel = "R"};
    if (pic_library.read(&request, &image, &err) != 0) {
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
    pic_release(&image);
    return 0;
}
