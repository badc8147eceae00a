/* The page of a render that is over: a report, the picture that was kept with it, or both. Or the sheet of a shot. */
#include <stdio.h>
#include <stdlib.h>

#include <lull/host_draft.h>

#include "base/files.h"
#include "base/interrupt.h"
#include "base/options.h"
#include "base/paths.h"
#include "base/threads.h"
#include "picture/read.h"
#include "report/report.h"

enum { FAILED = 1, BAD_INPUT = 2, LAYERS = 3 };

struct settings {
    const char *args[REPORT_MOST_FRAMES]; /* report, picture; of a picture alone it is both; of a sheet its frames */
    const char *page, *quoted;
    double fps;
    struct base_outputs outputs;
};

static const char *const html_or_png[] = {"html", "htm", "png", NULL}, *const json[] = {"json", NULL};

static const struct base_option list[] = {
    {"output", 'o', "FILE.html|FILE.png", BASE_TO(struct settings, page), .output = BASE_FILE, .words = html_or_png,
     .needed = 1, .help = "The page; or, as an animated PNG, the frames of a shot, each beside its samples"},
    {"fps", 0, "N", BASE_TO(struct settings, fps), 1, 240, .help = "Frames of a shot per second (default 24)"},
    {"quoted", 0, "FILE.json", BASE_TO(struct settings, quoted), .input = BASE_FILE, .words = json,
     .help = "What lull-render --quote --json printed before: the page compares it with what became of it"},
    {0}};

static const struct base_options command = {
    .doc = "Writes the page of a render that is over, as lull-render --html does, or the frames of a shot as a moving "
           "picture.\v"
           "Exit status: 0 done, 1 memory ran out, 2 bad input or the page could not be written.",
    .args_doc = "REPORT.json [PICTURE.exr]\nPICTURE.exr\nFRAME.exr...",
    .list = list,
    .args_min = 1,
    .args_max = REPORT_MOST_FRAMES,
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
    if (s->args[1] || !base_file_has_ending(s->args[0], "exr"))
        return read_text(s->args[0], report, err);
    s->args[1] = s->args[0];
    return report_from_exr(s->args[0], report, err);
}

static int write_page(const struct settings *s, const char *report, const char *quote, struct base_err *err)
{
    static const char *const names[LAYERS] = {"picture", "noisy", "denoised"};
    static struct report_view view;
    struct lull_host_layer layers[LAYERS];
    uint8_t *codes[LAYERS] = {NULL};
    struct pic_image picture = {0};
    struct lull_error e = {.struct_size = sizeof e};
    uint32_t count = 0;
    int rc = s->args[1] ? report_view_picture(s->args[1], &view, &picture, err) : 0;
    for (int i = 1; i < LAYERS && !rc && s->args[1]; i++)
        codes[i] = report_view_layer(s->args[1], names[i], &view, &picture);
    for (int i = 0; i < LAYERS && !rc && s->args[1]; i++)
        if (i == 0 || codes[i])
            layers[count++] = (struct lull_host_layer){names[i], i == 0 ? picture.u8 : codes[i]};
    if (!rc && lull_host_page(report, quote, layers, count, (uint32_t)picture.width, (uint32_t)picture.height, s->page,
                              &e) != LULL_OK)
        rc = base_fail(err, BASE_EINVAL, "%s%s%s: %s", s->args[0], s->quoted ? " with --quoted " : "",
                       s->quoted ? s->quoted : "", e.message);
    for (int i = 0; i < LAYERS; i++)
        free(codes[i]);
    pic_release(&picture);
    return rc;
}

static int make_sheet(const struct settings *s, struct base_err *err)
{
    int count = 0;
    while (count < REPORT_MOST_FRAMES && s->args[count])
        if (!base_file_has_ending(s->args[count++], "exr"))
            return base_fail(err, BASE_EINVAL, "%s: a sheet is made of the frames' .exr files", s->args[count - 1]);
    if (s->quoted)
        return base_fail(err, BASE_EINVAL, "--quoted belongs to a page");
    return report_sheet(s->args, count, s->fps > 0.0 ? s->fps : 24.0, s->page, err);
}

static int make_page(struct settings *s, struct base_err *err)
{
    char *report = NULL, *quote = NULL;
    int rc = 0;
    if (s->args[1] && s->args[2])
        rc = base_fail(err, BASE_EINVAL, "%s: a page has one picture; a sheet of frames is a .png", s->args[2]);
    else if (s->fps > 0.0)
        rc = base_fail(err, BASE_EINVAL, "--fps belongs to a sheet, which is a .png");
    if (!rc)
        rc = read_report(s, &report, err);
    if (!rc)
        rc = read_text(s->quoted, &quote, err);
    if (!rc)
        rc = write_page(s, report, quote, err);
    free(report);
    free(quote);
    return rc;
}

static int run_program(int argc, char **argv)
{
    static struct settings s;
    struct base_err err = {0};
    base_interrupt_begin();
    int rc = base_options_parse(&command, argc, argv, &s, &err);
    if (!rc)
        rc = base_file_has_ending(s.page, "png") ? make_sheet(&s, &err) : make_page(&s, &err);
    if (rc)
        fprintf(stderr, "lull-report: %s\n", err.text);
    return rc == 0 ? 0 : rc == BASE_ENOMEM ? FAILED : BAD_INPUT;
}

int main(int argc, char **argv) { return base_threads_main(argc, argv, run_program); }
