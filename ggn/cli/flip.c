/* `ggn flip REFERENCE TEST`: how far two images are apart, by LDR-FLIP, SSIM and relMSE. */
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "cli/commands.h"
#include "picture/png.h"
#include "sight/flip.h"
#include "sight/quality.h"

struct options {
    const char *paths[2];
    const char *map_path;
    double ppd;
    int json;
};

static const char *const pictures[] = {"png", NULL}; /* endings */
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"json", 'j', NULL, TO(json), .help = "print {\"mean\": …, \"max\": …, \"ssim\": …, \"relmse\": …}"},
    {"output", 'o', "MAP.png", TO(map_path), .output = BASE_FILE, .words = pictures,
     .help = "write the error map as a picture (magma, black 0 … white 1)"},
    {"ppd", 'p', "N", TO(ppd), 1, 1000, .help = "pixels per degree of the viewer (67.02)"},
    {0}};

int ggn_cmd_flip(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "REFERENCE TEST",
        .args_min = 2,
        .args_max = 2,
        .args_are = BASE_ARGS_FILES,
        .args = offsetof(struct options, paths),
        .doc =
            "Visible difference of two display images: LDR-FLIP (Andersson et al. 2020), mean and maximum over the pixels; "
            "beside it their SSIM (Wang et al. 2004) and the relative mean square error of their light."};
    struct options o = {.ppd = GGN_FLIP_PPD};
    struct pic_image images[2] = {{0}, {0}};
    struct ggn_flip_stats stats;
    float *map = NULL;
    double ssim = 0.0;
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc)
        rc = ggn_cmd_read_pair(argv[0], o.paths, images, err);
    if (!rc && o.map_path && !(map = malloc((size_t)images[0].width * (size_t)images[0].height * sizeof *map)))
        rc = base_fail_nomem(err, "error map");
    if (!rc)
        rc = ggn_flip(images[0].u8, images[1].u8, images[0].width, images[0].height, o.ppd, map, &stats, err);
    if (!rc && map) {
        uint8_t *rgb = ggn_cmd_magma(map, 1.0, (size_t)images[0].width * (size_t)images[0].height);
        rc = rgb ? pic_write_png(o.map_path, images[0].width, images[0].height, 3, rgb, err)
                 : base_fail_nomem(err, o.map_path);
        free(rgb);
    }
    if (!rc)
        rc = ggn_quality_ssim(&images[0], &images[1], &ssim, err);
    if (!rc)
        printf(o.json ? "{\"mean\": %.6f, \"max\": %.6f, \"ssim\": %.6f, \"relmse\": %.6g}\n"
                      : "mean   %.6f\nmax    %.6f\nssim   %.6f\nrelmse %.6g\n",
               stats.mean, stats.max, ssim, ggn_quality_relmse(&images[0], &images[1]));
    free(map);
    pic_release(&images[0]);
    pic_release(&images[1]);
    return rc;
}
