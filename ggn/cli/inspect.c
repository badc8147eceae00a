/* `ggn inspect`: what is in a model file. */
#include <cjson/cJSON.h>
#include <stdio.h>

#include "base/options.h"
#include "cli/commands.h"
#include "model/inference.h"

struct options {
    const char *path;
    int json, tensors;
};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {{"json", 'j', NULL, TO(json), .help = "print the description as stored (JSON)"},
                                          {"tensors", 't', NULL, TO(tensors), .help = "list the tensors too"},
                                          {0}};

static void print_tensors(const struct ggn_container *c)
{
    for (int i = 0; i < c->n_entries; i++) {
        const struct ggn_entry *e = &c->entry[i];
        char shape[64];
        int used = 0;
        for (int d = 0; d < e->rank; d++)
            used += snprintf(shape + used, sizeof shape - (size_t)used, "%s%u", d ? "x" : "", e->dim[d]);
        printf("  %-38s %-16s %-5s offset %llu\n", e->name, shape, ggn_type_names[e->type], (unsigned long long)e->offset);
    }
}

static int print_model(const struct ggn_model *m, const struct ggn_container *c, struct base_err *err)
{
    const struct ggn_hyper *h = &m->hyper;
    char *provenance = cJSON_Print(m->provenance);
    if (!provenance)
        return base_fail_nomem(err, "provenance");
    printf("preset       %s\n", ggn_preset_names[h->preset]);
    printf("block        %d x %d pixels, window of %d images\n", h->width, h->height, h->window);
    printf("widths       denoiser %d, generator %d, discriminator %d\n", h->k_r, h->k_m, h->k_d);
    printf("noise picture of half buffers: %s\n",
           h->noise_map && h->reach > 0 ? "taken where the host has them" : "not taken");
    if (h->reach > 0)
        printf("residual     corrects the law of visible noise by up to %g octaves of noise; told %d scalars\n", h->reach,
               h->scalars);
    for (int net = 0; net < GGN_NETS; net++)
        printf("%-12s %zu parameters, %.0f MAC\n", m->graph[net].name, m->graph[net].n_params,
               ggn_graph_mac(&m->graph[net]));
    printf("decision     %.3f GMAC, history %.2f MB per block, workspace %.1f MB per thread\n",
           1e-9 * (ggn_graph_mac(&m->graph[0]) + 2 * ggn_graph_mac(&m->graph[1]) + ggn_graph_mac(&m->graph[2])),
           1e-6 * 9.0 * (h->window + 1) * h->width *
               h->height, /* of 3 channels 8 bits noisy and 16 denoised, and a spare slot */
           1e-6 * (double)ggn_inference_bytes(m, 1));
    printf("calibration  p = sigmoid(%g * %s + %g), stops below %g in %d checks in a row, spacing %g\n", m->policy.scale,
           h->reach > 0 ? "octaves" : "logit", m->policy.shift, m->policy.threshold, m->policy.passes, m->policy.ratio);
    printf("file         %zu bytes, version %d, %d tensors\n", c->size, GGN_CONTAINER_VERSION, c->n_entries);
    printf("provenance   %s\n", provenance);
    cJSON_free(provenance);
    return 0;
}

int ggn_cmd_inspect(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {.list = list,
                                                .args_doc = "FILE",
                                                .args_min = 1,
                                                .args_max = 1,
                                                .args = offsetof(struct options, path),
                                                .doc = "Prints what a model file (.ggn) holds and checks it."};
    struct options o = {0};
    struct ggn_container c;
    struct ggn_model *model = NULL;
    if (base_options_parse(&options, argc, argv, &o, err) || ggn_container_read(&c, o.path, err))
        return err->code;
    int rc = ggn_model_parse(&c, o.path, &model, err);
    if (!rc && o.json)
        printf("%s\n", c.json);
    else if (!rc)
        rc = print_model(model, &c, err);
    if (!rc && o.tensors)
        print_tensors(&c);
    ggn_model_destroy(model);
    ggn_container_release(&c);
    return rc;
}
