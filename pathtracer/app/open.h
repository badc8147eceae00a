/*
 * What every action and every process of a job works with, opened in one order: threads, scene, criterion, render. The log
 * and the job are borrowed until pt_open_release.
 */
#ifndef PT_OPEN_H
#define PT_OPEN_H

#include "base/inputs.h"
#include "base/log.h"
#include "cli.h"
#include "integ/integrator.h"
#include "render/mask.h"
#include "render/render.h"
#include "scene/scene.h"

/* The criterion when none is named and the picture is not denoised. */
#define PT_OPEN_NOISY_CRITERION "observer"

struct pt_open {
    double start_s; /* wall time of the beginning … */
    double load_s;  /* … and how long until the scene was there */
    struct base_threads *threads;
    struct base_inputs scene_files, judging; /* what was read; judging: plugin, mask, shot table */
    struct pt_scene *scene;
    pt_kernel *kernel;
    const char *kernel_name;
    struct pt_render_config config;        /* what the command line says over what the scene says */
    enum pt_picture picture;               /* that is kept */
    const char *denoiser;                  /* library that makes it, as for lull_host_denoising */
    struct lull_plane mask;                /* data NULL: none */
    const struct pt_cli_params *params;    /* borrows; of the criterion, as given */
    struct lull_host_criterion *criterion; /* NULL: uniform, or a recording that asks none */
    struct base_identity identity;         /* of the image, for checkpoints and other processes; empty without */
    struct pt_render *render;              /* of an image or its quote */
};

/* Threads and scene. job: NULL = this process is alone. BASE_EINVAL when an input is not as it should be; *out may be
 * released after a failure, of both. */
int pt_open_scene(const struct pt_cli *cli, struct job *job, struct base_log *log, struct pt_open *out,
                  struct base_err *err);
/* Then, of what draws samples, the rest, after a look at where outputs will go. */
int pt_open_render(struct pt_cli *cli, struct job *job, struct base_log *log, struct pt_open *open, struct base_err *err);
void pt_open_release(struct pt_open *open);

#endif
