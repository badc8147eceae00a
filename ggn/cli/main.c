/* `ggn`: looks the subcommand up and hands over. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/interrupt.h"
#include "base/options.h"
#include "cli/commands.h"
#include "picture/draw.h"

struct command {
    const char *name;
    int (*run)(int argc, char **argv, struct base_err *err);
    const char *help;
};

#define COMMAND_ENTRY(name, help) {#name, ggn_cmd_##name, help},
static const struct command commands[] = {GGN_COMMANDS(COMMAND_ENTRY)};
#undef COMMAND_ENTRY

enum { N_COMMANDS = sizeof commands / sizeof commands[0], FAILED = 1, BAD_INPUT = 2 };

struct job *ggn_cmd_job;

static char last_words[512]; /* what a process other than rank 0 would have said */

/* Is this a crop, and where does it begin in its picture? */
static int crop_corner(const char *path, int corner[2])
{
    struct pic_window w;
    if (pic_read_header(path, &w, NULL, 0, NULL) != 0)
        return 0;
    corner[0] = w.x0;
    corner[1] = w.y0;
    return w.x1 - w.x0 < w.width || w.y1 - w.y0 < w.height;
}

int ggn_cmd_read_pair(const char *command, const char *const paths[2], struct pic_image images[2], struct base_err *err)
{
    int rc = 0, at[2][2];
    for (int i = 0; i < 2 && !rc; i++)
        rc = pic_read_light(paths[i], &images[i], err);
    for (int i = 0; i < 2 && !rc; i++)
        if (images[i].clipped > 0)
            fprintf(stderr, "%s: %s: %zu pixels are NaN, infinite or negative; they are compared as black or white\n",
                    command, paths[i], images[i].clipped);
    if (!rc && (images[0].width != images[1].width || images[0].height != images[1].height))
        rc = base_fail(err, BASE_EINVAL, "%s is %dx%d, %s is %dx%d: the sizes must be equal", paths[0], images[0].width,
                       images[0].height, paths[1], images[1].width, images[1].height);
    if (!rc && crop_corner(paths[0], at[0]) && crop_corner(paths[1], at[1]) && memcmp(at[0], at[1], sizeof at[0]) != 0)
        rc = base_fail(err, BASE_EINVAL, "%s begins at pixel %d,%d, %s at %d,%d: crops must show the same pixels", paths[0],
                       at[0][0], at[0][1], paths[1], at[1][0], at[1][1]);
    return rc;
}

uint8_t *ggn_cmd_magma(const float *map, double gain, size_t n)
{
    uint8_t *rgb = malloc(3 * n);
    for (size_t i = 0; i < n && rgb; i++)
        pic_colour(PIC_MAGMA, gain * (double)map[i], rgb + 3 * i);
    return rgb;
}

/* Says "COMMAND: text"; returns the exit status that err->code stands for. */
static int fail(const char *command, const struct base_err *err)
{
    if (job_rank(ggn_cmd_job) > 0)
        snprintf(last_words, sizeof last_words, "%s", err->text);
    else
        fprintf(stderr, "%s: %s\n", command, err->text);
    return err->code == BASE_EINVAL || err->code == BASE_EIO ? BAD_INPUT : FAILED;
}

static const struct command *find(const char *typed)
{
    for (int i = 0; i < N_COMMANDS; i++)
        if (!strcmp(typed, commands[i].name))
            return &commands[i];
    return NULL;
}

static int refuse(const char *text)
{
    fprintf(stderr, "ggn: %s (ggn --help lists the commands)\n", text);
    return BAD_INPUT;
}

/* `ggn` with options only. */
static int main_options(int argc, char **argv)
{
    char doc[2048];
    size_t used = (size_t)snprintf(doc, sizeof doc,
                                   "Learned stopping criterion for path tracing: data, training, evaluation.\vCommands:\n");
    for (int i = 0; i < N_COMMANDS && used < sizeof doc; i++)
        used += (size_t)snprintf(doc + used, sizeof doc - used, "  %-12s %s\n", commands[i].name, commands[i].help);
    if (used < sizeof doc)
        snprintf(doc + used, sizeof doc - used, "\n`ggn COMMAND --help` says more.");
    static const struct base_option none[] = {{0}};
    struct base_options options = {.doc = doc, .args_doc = "COMMAND [OPTION...]", .list = none};
    struct base_err err = {0};
    if (base_options_parse(&options, argc, argv, NULL, &err))
        return fail("ggn", &err);
    return refuse("a command is needed");
}

static int run(const struct command *command, int argc, char **argv)
{
    struct base_err err = {0}, other = {0};
    if (job_open(&ggn_cmd_job, &err))
        return fail(argv[0], &err);
    job_watch(ggn_cmd_job, 0, &base_interrupted);
    const int alone = ggn_cmd_job && command->run != ggn_cmd_label; /* label shares out its work; others would do it anew */
    int rc = alone ? base_fail(&err, BASE_EINVAL, "works in one process: start it without mpirun")
                   : command->run(argc, argv, &err);
    const int status = rc < 0 ? fail(argv[0], &err) : rc;
    /* The worst status is that of the job, and the first failure of another process is told. */
    const int all = job_close(ggn_cmd_job, status, last_words, &other);
    ggn_cmd_job = NULL;
    if (all != status && other.code)
        fprintf(stderr, "%s: %s\n", argv[0], other.text);
    return all;
}

int main(int argc, char **argv)
{
    char name[64], text[128];
    base_interrupt_begin();
    if (argc < 2 || argv[1][0] == '-')
        return main_options(argc, argv);
    const struct command *command = find(argv[1]);
    if (!command) {
        snprintf(text, sizeof text, "%.64s: unknown command", argv[1]);
        return refuse(text);
    }
    snprintf(name, sizeof name, "ggn %s", argv[1]);
    argv[1] = name;
    int status = run(command, argc - 1, argv + 1);
    if (fflush(stdout) || ferror(stdout)) {
        fprintf(stderr, "%s: cannot write standard output\n", name);
        return status ? status : BAD_INPUT;
    }
    return status;
}
