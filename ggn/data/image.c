#include "data/image.h"

#include <stdlib.h>
#include <string.h>

#include "base/png.h"

void ggn_image8_release(struct ggn_image8 *image)
{
    free(image->data);
    *image = (struct ggn_image8){0};
}

void ggn_imagef_release(struct ggn_imagef *image)
{
    free(image->data);
    *image = (struct ggn_imagef){0};
}

int ggn_image8_write_png(const char *path, const uint8_t *data, int width, int height, struct base_err *err)
{
    size_t length = strlen(path);
    if (length < 4 || strcmp(path + length - 4, ".png") != 0)
        return base_fail(err, BASE_EINVAL, "%s: a picture's name must end in .png", path);
    return base_png_write(path, width, height, 3, data, err);
}

void ggn_colormap_rgb(enum ggn_colormap map, double v, uint8_t rgb[3])
{
    static const uint8_t knots[2][9][3] = {
        [GGN_MAGMA] = {{0, 0, 4},
                       {29, 17, 71},
                       {81, 18, 124},
                       {130, 38, 129},
                       {182, 54, 121},
                       {230, 81, 100},
                       {251, 136, 97},
                       {254, 194, 135},
                       {252, 253, 191}},
        [GGN_VIRIDIS] = {{68, 1, 84},
                         {71, 45, 123},
                         {59, 82, 139},
                         {44, 114, 142},
                         {33, 144, 140},
                         {39, 173, 129},
                         {93, 200, 99},
                         {170, 220, 50},
                         {253, 231, 37}},
    };
    double x = v > 0.0 ? (v < 1.0 ? 8.0 * v : 8.0) : 0.0;
    int i = x < 7.0 ? (int)x : 7;
    for (int c = 0; c < 3; c++) {
        double a = knots[map][i][c], b = knots[map][i + 1][c];
        rgb[c] = (uint8_t)(a + (b - a) * (x - i) + 0.5);
    }
}
