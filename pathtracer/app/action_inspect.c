#include "actions.h"

#include <stdio.h>

#include "base/clock.h"
#include "integ/integrator.h"

enum { ROUNDS = 5, RUNS = 32 };

/* Thread seconds per path of runs all over the image. */
static double time_runs(pt_kernel *kernel, const struct pt_scene *scene, const struct pt_render_config *config,
                        uint32_t sample)
{
    struct pt_path_result results[PT_RUN];
    int count = config->width < PT_RUN ? config->width : PT_RUN;
    uint32_t places = (uint32_t)(config->width - count + 1);
    double start = base_clock_thread_s();
    for (uint32_t i = 0; i < RUNS; i++) {
        uint32_t x = (i * 5 % RUNS) * places / RUNS, y = i * (uint32_t)config->height / RUNS;
        kernel(scene, &config->integrator, x, y, count, sample, results);
    }
    return (base_clock_thread_s() - start) / (RUNS * count);
}

/* Interleaved, and the least of the rounds, because other programs may be running. */
static void print_times(const struct pt_scene *scene, const struct pt_render_config *config, pt_kernel *chosen)
{
    pt_kernel *const kernels[2] = {chosen, pt_kernel_select(PT_FX_ALL, NULL, NULL)};
    double best_s[2] = {1e30, 1e30};
    for (uint32_t round = 0; round < ROUNDS; round++)
        for (int k = 0; k < 2; k++) {
            double s = time_runs(kernels[k], scene, config, round);
            if (s < best_s[k])
                best_s[k] = s;
        }
    printf("time: %.2f us per path and thread; the general kernel takes %.2f times as long for the same image\n",
           best_s[0] * 1e6, best_s[1] / best_s[0]);
}

void pt_action_explain(const struct pt_scene *scene, const struct pt_render_config *config, const char *scene_name)
{
    pt_effects effects = scene->effects, covers = 0;
    const char *name = "";
    pt_kernel *kernel = pt_kernel_select(effects, &covers, &name);
    printf("effects of %s:\n  %-13s %-3s %-6s  %-32s  %s\n", scene_name, "effect", "on", "kernel", "first asked for by",
           "costs, where it is compiled in");
    for (int i = 0; i < PT_FX_COUNT; i++) {
        const struct pt_effect_reason *why = &scene->effect_reasons[i];
        char where[300] = "-";
        if (why->line > 0)
            snprintf(where, sizeof where, "%s:%d", why->file, why->line);
        else if (effects >> i & 1)
            snprintf(where, sizeof where, "the scene as a whole, or --effects");
        printf("  %-13s %-3s %-6s  %-32s  %s\n", pt_effects_name(i), effects >> i & 1 ? "on" : "off",
               covers >> i & 1 ? "has it" : "-", where, pt_effects_cost(i));
    }
    printf("kernel: %s\n", name);
    print_times(scene, config, kernel);
    printf("light selection: %s, %d emitters\n", scene->light_tree ? "hierarchy" : "power", (int)scene->emitter_count);
    printf("scene: %lld triangles, %d quadrics, %d instances, %d lights, %d materials, %d textures, %.1f MB\n",
           scene->stats.triangles, scene->quadric_count, scene->instance_count, scene->light_count, scene->material_count,
           scene->texture_count, (double)scene->stats.bytes * 1e-6);
}

int pt_action_debug_path(const struct pt_scene *scene, const struct pt_render_config *config, const int at[3],
                         struct base_err *err)
{
    if (at[0] >= config->width || at[1] >= config->height)
        return base_fail(err, BASE_EINVAL, "--debug-path %d,%d,%d: the image has %dx%d pixels", at[0], at[1], at[2],
                         config->width, config->height);
    pt_kernel_trace(scene, &config->integrator, (uint32_t)at[0], (uint32_t)at[1], (uint32_t)at[2], stdout, NULL);
    return 0;
}
