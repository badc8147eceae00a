/* The page of a render that is over: a report, the picture that was kept with it, or both. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include <lull/host.h>

#include "base/colour.h"
#include "base/files.h"
#include "base/options.h"
#include "base/outputs.h"
#include "picture/read.h"
#include "report/exr.h"

enum { FAILED = 1, BAD_INPUT = 2, LAYERS = 3 };

struct settings {
    const char *args[2]; /* report, picture; of a picture alone it is both */
    const char *page, *quoted;
    struct base_outputs outputs;
};

static const char *const html[] = {"html", "htm", NULL}, *const json[] = {"json", NULL};

static const struct base_option list[] = {
    {"output", 'o', "FILE.html", BASE_TO(struct settings, page), .output = BASE_FILE, .words = html, .needed = 1,
     .help = "The page"},
    {"quoted", 0, "FILE.json", BASE_TO(struct settings, quoted), .input = BASE_FILE, .words = json,
     .help = "What lull-render --quote --json printed before: the page compares it with what became of it"},
    {0}};

static const struct base_options command = {
    .doc = "Writes the page of a render that is over, as lull-render --html does.\v"
           "Exit status: 0 done, 1 memory ran out, 2 bad input or the page could not be written.",
    .args_doc = "REPORT.json [PICTURE.exr]\nPICTURE.exr",
    .list = list,
    .args_min = 1,
    .args_max = 2,
    .args = offsetof(struct settings, args),
    .args_are = BASE_ARGS_FILES,
    .outputs = offsetof(struct settings, outputs),
};

static int read_text(const char *path, char **text, struct base_err *err)
{
    const size_t most = (size_t)1 << 30;
    size_t size;
    return path ? base_file_read(path, most, text, &size, err) : 0;
}

/* A picture alone is report and picture. */
static int read_report(struct settings *s, char **report, struct base_err *err)
{
    const char *ending = strrchr(s->args[0], '.');
    if (s->args[1] || !ending || strcasecmp(ending, ".exr") != 0)
        return read_text(s->args[0], report, err);
    s->args[1] = s->args[0];
    return report_from_exr(s->args[0], report, err);
}

/* Channels NAME.R, NAME.G and NAME.B as codes, the caller's; NULL: the file has them not. */
static uint8_t *read_layer(const char *path, const char *name, const struct pic_image *like)
{
    const size_t pixels = (size_t)like->width * (size_t)like->height;
    uint8_t *codes = malloc(3 * pixels);
    for (size_t c = 0; c < 3 && codes; c++) {
        char channel[32];
        struct pic_image image = {0};
        snprintf(channel, sizeof channel, "%s.%c", name, "RGB"[c]);
        int found = pic_read_channel(path, channel, &image, NULL) == 0 && image.f32 && image.width == like->width &&
                    image.height == like->height;
        for (size_t i = 0; found && i < pixels; i++)
            codes[3 * i + c] = base_srgb_code((double)image.f32[i]);
        pic_release(&image);
        if (!found) {
            free(codes);
            codes = NULL;
        }
    }
    return codes;
}

static int write_page(const struct settings *s, const char *report, const char *quote, struct base_err *err)
{
    static const char *const names[LAYERS] = {"picture", "noisy", "denoised"};
    struct lull_host_layer layers[LAYERS];
    uint8_t *codes[LAYERS] = {NULL};
    struct pic_image picture = {0};
    struct lull_error e = {.struct_size = sizeof e};
    uint32_t count = 0;
    int rc = s->args[1] ? pic_read_display(s->args[1], &picture, err) : 0;
    for (int i = 1; i < LAYERS && !rc && s->args[1]; i++)
        codes[i] = read_layer(s->args[1], names[i], &picture);
    for (int i = 0; i < LAYERS && !rc && s->args[1]; i++)
        if (i == 0 || codes[i])
            layers[count++] = (struct lull_host_layer){names[i], i == 0 ? picture.u8 : codes[i]};
    if (!rc && lull_host_page(report, quote, layers, count, (uint32_t)picture.width, (uint32_t)picture.height, s->page,
                              &e) != LULL_OK)
        rc = base_fail(err, BASE_EINVAL, "%s: %s", s->args[0], e.message);
    for (int i = 0; i < LAYERS; i++)
        free(codes[i]);
    pic_release(&picture);
    return rc;
}

int main(int argc, char **argv)
{
    struct settings s = {0};
    struct base_err err = {0};
    char *report = NULL, *quote = NULL;
    int rc = base_options_parse(&command, argc, argv, &s, &err);
    if (!rc)
        rc = read_report(&s, &report, &err);
    if (!rc)
        rc = read_text(s.quoted, &quote, &err);
    if (!rc)
        rc = write_page(&s, report, quote, &err);
    if (rc)
        fprintf(stderr, "lull-report: %s\n", err.text);
    free(report);
    free(quote);
    return rc == 0 ? 0 : rc == BASE_ENOMEM ? FAILED : BAD_INPUT;
}
