/*
 * What every action and every process of a job works with, opened in one order: threads, a scene, a frame of it with its
 * criterion and render. The frames of a shot follow each other in one pt_open; the scene stays while it is the same. The
 * command line, the log and the job are borrowed until pt_open_release, a frame until pt_open_end_frame.
 */
#ifndef PT_OPEN_H
#define PT_OPEN_H

#include "base/paths.h"
#include "base/log.h"
#include "frame.h"
#include "integ/integrator.h"
#include "render/render.h"
#include "scene/scene.h"

/* The criterion when none is named and the picture is not denoised. */
#define PT_OPEN_NOISY_CRITERION "observer"

struct pt_open {
    const struct pt_cli *cli;
    struct base_log *log;
    struct base_threads *threads;

    /* the scene */
    char scene_path[4096];
    struct pt_view view;
    struct base_inputs scene_files; /* what was read … */
    uint32_t scene_crc;             /* … and its checksum, of a shot */
    struct pt_scene *scene;
    struct pt_scene_defaults found; /* what it says of the image */
    pt_kernel *kernel;
    const char *kernel_name;

    /* the frame */
    const struct pt_shot_frame *frame;
    double start_s;                        /* wall time of the beginning … */
    double load_s;                         /* … and how long until the scene was there */
    struct pt_render_config config;        /* what command line and frame say over what the scene says */
    struct base_inputs judging;            /* what was read: plugin, mask, shot table */
    enum pt_picture picture;               /* that is kept */
    const char *denoiser;                  /* library that makes it, as for lull_host_denoising */
    struct lull_plane mask;                /* data NULL: none */
    struct pt_cli_params params;           /* of the criterion; text is the command line's */
    struct lull_host_criterion *criterion; /* NULL: uniform, or a recording that asks none */
    struct base_identity identity;         /* of the image, for checkpoints and other processes; empty without */
    struct pt_render *render;              /* of an image or its quote */
};

/* Threads. job: NULL = this process is alone. *out may be released after a failure, of the others, too. */
int pt_open_init(struct pt_open *out, const struct pt_cli *cli, struct job *job, struct base_log *log, struct base_err *err);
/* The frame's scene, unless it is open already. BASE_EINVAL when an input is not as it should be. */
int pt_open_scene(struct pt_open *open, const struct pt_shot_frame *frame, struct base_err *err);
/* Then, of what draws samples, the rest, after a look at where outputs will go. */
int pt_open_frame(struct pt_open *open, struct job *job, struct base_err *err);
/* The criterion that the command line names, or the usual one for its picture: a table that lives for ever. */
int pt_open_find_criterion(struct pt_open *open, const struct lull_criterion **table, struct base_err *err);
/* What a next frame needs of its own. */
void pt_open_end_frame(struct pt_open *open);
void pt_open_release(struct pt_open *open);

#endif
