/*
 * Packets for image viewers, in the protocol of tev (https://github.com/Tom94/tev, include/tev/Ipc.h; HDRView and others
 * know it too): little endian, u32 length of the whole packet, u8 type, then what the type says; strings end in NUL. A
 * writer puts one packet at a time into memory of its own and never allocates after viewer_init. Private. One thread.
 */
#ifndef LULL_HOST_VIEWER_H
#define LULL_HOST_VIEWER_H

#include <lull/host.h>

/* R, G, B, lull.spp, lull.p_noisy, lull.error */
enum { VIEWER_CHANNELS = 6 };

/* Blocks beyond so many are not drawn: they would be smaller than their lines. */
enum { VIEWER_MARKED_BLOCKS = 4096 };

/* How long one who takes nothing is waited for; a test waits for ever, to see that the renderer does not. */
extern double viewer_patience_s;

struct viewer_packet {
    char *name;  /* owns; of the image */
    uint8_t *at; /* owns */
    size_t size; /* of the packet there is */
};

/* Some rows of a block: the pixels from x, y on, and what all of them share. */
struct viewer_tile {
    int32_t x, y, width, height;
    const float *rgb; /* [height][stride][3], the first pixel */
    size_t stride;    /* pixels from row to row */
    float spp, p_noisy, error;
};

/* Memory for tiles of up to `pixels` pixels and drawings of `blocks` blocks. Returns 0, or -1 without memory. */
int viewer_init(struct viewer_packet *packet, const char *name, size_t pixels, uint32_t blocks);
void viewer_release(struct viewer_packet *packet);

/* An image of that name, black, in the place of one of that name; the viewer turns to it. */
void viewer_create(struct viewer_packet *packet, int32_t width, int32_t height);
void viewer_update(struct viewer_packet *packet, const struct viewer_tile *tile);
/* A frame around each block, in the place of those before: active blocks bright and double, stopped ones thin, with their
 * samples in figures made of lines, which every version of the viewers can draw. x0, y0: of the image's first pixel. */
void viewer_mark(struct viewer_packet *packet, const struct lull_host_block *blocks, uint32_t count, int32_t x0, int32_t y0);

#endif
