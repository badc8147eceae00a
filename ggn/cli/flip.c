/* `ggn flip REFERENCE TEST`: LDR-FLIP of two images. */
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "cli/commands.h"
#include "picture/read.h"
#include "observer/flip.h"
#include "picture/colour_map.h"
#include "picture/png.h"

struct options {
    const char *paths[2];
    const char *map_path;
    double ppd;
    int json;
};

static const char *const pictures[] = {"png", NULL}; /* endings */
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"json", 'j', NULL, TO(json), .help = "print {\"mean\": …, \"max\": …}"},
    {"output", 'o', "MAP.png", TO(map_path), .output = BASE_FILE, .words = pictures,
     .help = "write the error map as a picture (magma, black 0 … white 1)"},
    {"ppd", 'p', "N", TO(ppd), 1, 1000, .help = "pixels per degree of the viewer (67.02)"},
    {0}};

static int write_map(const char *path, const float *map, int width, int height, struct base_err *err)
{
    size_t n = (size_t)width * (size_t)height;
    uint8_t *rgb = malloc(3 * n);
    if (!rgb)
        return base_fail_nomem(err, path);
    for (size_t i = 0; i < n; i++)
        pic_colour(PIC_MAGMA, (double)map[i], rgb + 3 * i);
    int rc = pic_write_png(path, width, height, 3, rgb, err);
    free(rgb);
    return rc;
}

int ggn_cmd_flip(int argc, char **argv)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "REFERENCE TEST",
        .args_min = 2,
        .args_max = 2,
        .args_are = BASE_ARGS_FILES,
        .args = offsetof(struct options, paths),
        .doc =
            "Visible difference of two display images: LDR-FLIP (Andersson et al. 2020), mean and maximum over the pixels."};
    struct options o = {.ppd = GGN_FLIP_PPD};
    struct pic_image images[2] = {{0}, {0}};
    struct ggn_flip_stats stats;
    struct base_err err = {0};
    float *map = NULL;

    int rc = base_options_parse(&options, argc, argv, &o, &err);
    for (int i = 0; i < 2 && !rc; i++)
        rc = pic_read_display(o.paths[i], &images[i], &err);
    if (rc)
        goto out;
    for (int i = 0; i < 2; i++)
        ggn_cmd_tell_clipped(argv[0], o.paths[i], images[i].clipped);
    if (images[0].width != images[1].width || images[0].height != images[1].height) {
        rc = base_fail(&err, BASE_EINVAL, "%s is %dx%d, %s is %dx%d: the sizes must be equal", o.paths[0], images[0].width,
                       images[0].height, o.paths[1], images[1].width, images[1].height);
        goto out;
    }
    if (o.map_path) {
        map = malloc((size_t)images[0].width * (size_t)images[0].height * sizeof *map);
        if (!map) {
            rc = base_fail_nomem(&err, "error map");
            goto out;
        }
    }
    rc = ggn_flip(images[0].u8, images[1].u8, images[0].width, images[0].height, o.ppd, map, &stats, &err);
    if (!rc && map)
        rc = write_map(o.map_path, map, images[0].width, images[0].height, &err);
    if (!rc)
        printf(o.json ? "{\"mean\": %.6f, \"max\": %.6f}\n" : "mean %.6f\nmax  %.6f\n", stats.mean, stats.max);
out:
    free(map);
    pic_release(&images[0]);
    pic_release(&images[1]);
    return !rc ? GGN_EXIT_OK : ggn_cmd_fail(argv[0], &err);
}
