/* Colours by the primaries and the white that a file names, as CIE 1931 x, y. Pure, thread-safe. */
#ifndef PICTURE_PRIMARIES_H
#define PICTURE_PRIMARIES_H

#ifdef __cplusplus
extern "C" {
#endif

/* Red, green, blue, white of Rec. 709. */
#define PIC_REC709_PRIMARIES \
    { \
        0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f \
    }

/* m: linear light of these primaries to that of Rec. 709, by way of XYZ, without chromatic adaptation. 0 when they and their
 * white span no colour space: numbers that are not finite, primaries on a line, a white outside of them. */
int pic_primaries_to_rec709(const float primaries[8], double m[3][3]);

#ifdef __cplusplus
}
#endif

#endif
