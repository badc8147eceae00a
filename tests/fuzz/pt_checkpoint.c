/* Checkpoints with any content: the bytes get a fitting CRC, so that the checks behind it are reached. */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <zlib.h>

#include "render/checkpoint.h"
#include "support/pt_identity.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void no_kernel(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                      uint32_t sample, struct pt_path_result *out)
{
    (void)scene, (void)settings, (void)x, (void)y, (void)sample;
    for (int i = 0; i < count; i++)
        out[i] = (struct pt_path_result){.rays = 1};
}

static const char *write_file(const uint8_t *data, size_t size)
{
    static char path[64];
    snprintf(path, sizeof path, "/tmp/pt_checkpoint_%ld.ckp", (long)getpid());
    uint32_t crc = (uint32_t)crc32_z(0, data, size);
    FILE *f = fopen(path, "wb");
    if (!f)
        abort();
    fwrite(data, 1, size, f);
    fwrite(&crc, 1, sizeof crc, f);
    fclose(f);
    return path;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct pt_render_config config = {.width = 4,
                                      .height = 3,
                                      .crop = {0, 0, 4, 3},
                                      .block_width = 2,
                                      .block_height = 2,
                                      .spp_min = 4,
                                      .spp_max = 4,
                                      .uniform = 1,
                                      .planes = PT_FILM_HALF};
    struct pt_render *render = NULL;
    struct base_err err = {0};
    struct base_threads *threads = base_threads_create(1, &err);
    if (!threads || pt_render_create(&config, NULL, no_kernel, threads, NULL, &render, &err) != 0)
        abort();
    const char *path = write_file(data, size);
    int rc = pt_checkpoint_load(path, render, PT_IDENTITY("seed=1\n"), &err);
    if (!rc) { /* whatever was accepted can be finished */
        struct pt_render_hooks hooks = {0};
        enum pt_render_outcome outcome;
        if (pt_render_run(render, &hooks, &outcome, &err) != 0)
            abort();
    } else if (err.text[0] == '\0' || strchr(err.text, '\n')) {
        abort();
    }
    unlink(path);
    pt_render_destroy(render);
    base_threads_destroy(threads);
    return 0;
}
