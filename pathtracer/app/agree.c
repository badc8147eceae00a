#include "agree.h"

#include <stdio.h>
#include <zlib.h>

#include "base/version.h"
#include "render/host.h"

int pt_agree_crc(const char *path, uint32_t *crc, struct base_err *err)
{
    struct base_inputs one = BASE_INPUTS_EMPTY;
    int rc = base_inputs_add(&one, path, err);
    if (!rc)
        rc = base_inputs_crc32(&one, crc, err);
    base_inputs_release(&one);
    return rc;
}

/* Everything that decides the bytes of the image, and nothing else. A criterion's model is in its saved state. */
int pt_agree_settings(struct pt_session *s, const struct pt_render_config *c, struct base_err *err)
{
    uint32_t scene_crc = 0, judging_crc = 0;
    if (!s->cli.checkpoint && !s->job)
        return 0;
    int rc = base_inputs_crc32(&s->scene_files, &scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&s->judging, &judging_crc, err);
    if (rc)
        return rc;
    const struct pt_integrator *i = &c->integrator;
    size_t room = sizeof s->settings,
           used = (size_t)snprintf(s->settings, room,
                                   "scene-crc=%08x\nsize=%dx%d\ncrop=%d,%d,%d,%d\nblock=%dx%d\nspp-min=%llu\nspp-max=%"
                                   "llu\nuniform=%d\nmax-seam=%g\n"
                                   "aov=%u\nseed=%u\nsampler=%d\nintegrator=%d\nfilter=%d:%gx%g:%g\n"
                                   "light-selection=%s\nmax-depth=%d\nrr-depth=%d\nclamp=%g\n",
                                   scene_crc, c->width, c->height, c->crop[0], c->crop[1], c->crop[2], c->crop[3],
                                   c->block_width, c->block_height, (unsigned long long)c->spp_min,
                                   (unsigned long long)c->spp_max, c->uniform, c->max_seam, c->planes, i->seed, i->sampler,
                                   i->strategy, i->filter, (double)i->filter_x, (double)i->filter_y, (double)i->filter_sigma,
                                   pt_light_selection_words[s->cli.light_selection], i->max_depth, i->rr_depth,
                                   (double)i->max_component);
    const struct pt_view *view = &s->cli.view;
    used += (size_t)snprintf(s->settings + used, room - used, "fov=%.17g\nlook-at=", view->fov_deg);
    for (int k = 0; view->has_look_at && k < 9; k++)
        used += (size_t)snprintf(s->settings + used, room - used, "%.17g ", view->look_at_world[k]);
    const struct lull_criterion *t = s->criterion ? lull_host_table(s->criterion) : NULL;
    used +=
        (size_t)snprintf(s->settings + used, room - used, "\ncriterion=%s %s\n", t ? t->id : "none", t ? t->version : "");
    if (used < room)
        used += (size_t)snprintf(s->settings + used, room - used, "plugin-and-mask-crc=%08x\n", judging_crc);
    for (uint32_t k = 0; k < s->cli.param_count && used < room; k++)
        used +=
            (size_t)snprintf(s->settings + used, room - used, "param=%s=%s\n", s->cli.params[k].key, s->cli.params[k].value);
    return used < room ? 0 : base_fail(err, BASE_EINVAL, "the criterion's parameters are too long");
}

static int32_t add_to_crc(const struct lull_writer *to, const void *data, uint64_t size)
{
    uint32_t *crc = to->context;
    *crc = (uint32_t)crc32_z(*crc, data, (size_t)size);
    return LULL_OK;
}

int pt_agree_job(const struct pt_session *s, char *text, size_t room, struct base_err *err)
{
    uint32_t crc = (uint32_t)crc32(0, NULL, 0);
    struct lull_writer adder = {.struct_size = sizeof adder, .context = &crc, .write = add_to_crc};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = s->render && s->criterion ? lull_host_save_history(s->criterion, &adder, &e) : LULL_OK;
    if (code != LULL_OK)
        return pt_host_fail(code, &e, err);
    snprintf(text, room, "version=%s\n%scriterion-model-crc=%08x\n", BASE_VERSION, s->settings, (unsigned)crc);
    return 0;
}

int pt_agree_handshake(const struct pt_session *s, struct base_err *err)
{
    char text[PT_AGREE_JOB];
    int rc = s->job ? pt_agree_job(s, text, sizeof text, err) : 0;
    return rc ? rc : job_handshake(s->job, text, base_threads_count(s->threads), s->render && s->criterion, err);
}
