/* `ggn flip REFERENCE TEST`: LDR-FLIP of two images. */
#include <argp.h>
#include <stdio.h>
#include <stdlib.h>

#include "cli/commands.h"
#include "data/image.h"
#include "observer/flip.h"

struct options {
    const char *paths[2];
    const char *map_path;
    double ppd;
    int json;
};

static const struct argp_option option_table[] = {
    {"json", 'j', NULL, 0, "print {\"mean\": …, \"max\": …}", 0},
    {"output", 'o', "MAP.png", 0, "write the error map as a picture (magma, black 0 … white 1)", 0},
    {"ppd", 'p', "N", 0, "pixels per degree of the viewer (default 67.02)", 0},
    {0},
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct options *o = state->input;
    char *end;

    switch (key) {
    case 'j':
        o->json = 1;
        return 0;
    case 'o':
        o->map_path = arg;
        return 0;
    case 'p':
        o->ppd = strtod(arg, &end);
        if (end == arg || *end != '\0' || !(o->ppd >= 1.0 && o->ppd <= 1000.0))
            argp_error(state, "--ppd %s: expected 1 … 1000", arg);
        return 0;
    case ARGP_KEY_ARG:
        if (state->arg_num >= 2)
            return ARGP_ERR_UNKNOWN;
        o->paths[state->arg_num] = arg;
        return 0;
    case ARGP_KEY_END:
        if (state->arg_num < 2)
            argp_error(state, "REFERENCE and TEST are needed");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static int write_map(const char *path, const float *map, int width, int height, struct base_err *err)
{
    size_t n = (size_t)width * (size_t)height;
    uint8_t *rgb = malloc(3 * n);
    if (!rgb)
        return base_fail_nomem(err, path);
    for (size_t i = 0; i < n; i++)
        ggn_colormap_rgb(GGN_MAGMA, (double)map[i], rgb + 3 * i);
    int rc = ggn_image8_write_png(path, rgb, width, height, err);
    free(rgb);
    return rc;
}

int ggn_cmd_flip(int argc, char **argv)
{
    static const struct argp argp = {
        .options = option_table,
        .parser = parse,
        .args_doc = "REFERENCE TEST",
        .doc = "Visible difference of two display images: LDR-FLIP (Andersson et al. 2020), mean and maximum over the pixels.",
    };
    struct options o = {.ppd = GGN_FLIP_PPD};
    struct ggn_image8 images[2] = {{0}, {0}};
    struct ggn_flip_stats stats;
    struct base_err err = {0};
    float *map = NULL;

    argp_parse(&argp, argc, argv, 0, NULL, &o);
    int rc = 0;
    for (int i = 0; i < 2 && !rc; i++)
        rc = ggn_image8_read(o.paths[i], &images[i], &err);
    if (rc)
        goto out;
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
    rc = ggn_flip(images[0].data, images[1].data, images[0].width, images[0].height, o.ppd, map, &stats, &err);
    if (!rc && map)
        rc = write_map(o.map_path, map, images[0].width, images[0].height, &err);
    if (!rc)
        printf(o.json ? "{\"mean\": %.6f, \"max\": %.6f}\n" : "mean %.6f\nmax  %.6f\n", stats.mean, stats.max);
out:
    free(map);
    ggn_image8_release(&images[0]);
    ggn_image8_release(&images[1]);
    return !rc ? GGN_EXIT_OK : ggn_cmd_fail(argv[0], &err);
}
