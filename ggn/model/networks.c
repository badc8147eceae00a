#include "model/networks.h"

#include "sight/measure.h"

const char *const ggn_preset_names[] = {"paper", "lull", NULL};

static const double SLOPE = 0.2; /* LeakyReLU */

struct ggn_hyper ggn_hyper_default(enum ggn_preset preset)
{
    return (struct ggn_hyper){.preset = preset, .height = 200, .width = 200, .window = 6, .k_r = 16, .k_m = 20, .k_d = 64};
}

int ggn_hyper_check(const struct ggn_hyper *p, struct base_err *err)
{
    const struct {
        const char *name;
        int value, min, max;
    } fields[] = {{"preset", (int)p->preset, GGN_PRESET_PAPER, GGN_PRESET_LULL},
                  {"height", p->height, 16, 1024},
                  {"width", p->width, 16, 1024},
                  {"window", p->window, 1, 16},
                  {"k_r", p->k_r, 1, 128},
                  {"k_m", p->k_m, 1, 128},
                  {"k_d", p->k_d, 1, 64},
                  {"picture", p->noise_map, 0, p->preset == GGN_PRESET_LULL},
                  {"scalars", p->scalars ? p->scalars - GGN_SCALARS + 1 : 0, 0, p->reach > 0}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++)
        if (fields[i].value < fields[i].min || fields[i].value > fields[i].max)
            return base_fail(err, BASE_EINVAL, "hyper-parameter %s = %d is not in %d..%d", fields[i].name, fields[i].value,
                             fields[i].min, fields[i].max);
    if (!(p->reach >= 0 && p->reach <= (p->preset == GGN_PRESET_LULL ? GGN_REACH_MAX : 0)))
        return base_fail(err, BASE_EINVAL, "hyper-parameter residual = %g is not in 0..%g", p->reach,
                         p->preset == GGN_PRESET_LULL ? GGN_REACH_MAX : 0);
    return 0;
}

static const char *const enc_name[5] = {"enc0", "enc1", "enc2", "enc3", "enc4"};
static const char *const dec_name[5] = {"dec0", "dec1", "dec2", "dec3", "dec4"};

/* The encoder of both networks, up to the first convolution of its last stage. A stage is Conv → LReLU → Conv → LReLU, with
 * MaxPool first and BN between from stage 1 on. stages: [4] get the values before the last. */
static int encode(struct ggn_graph *g, int width, int stages[4])
{
    int x = 0;
    for (int i = 0;; i++) {
        ggn_graph_stage(g, enc_name[i]);
        if (i)
            x = ggn_graph_maxpool(g, x, 2);
        x = ggn_graph_conv(g, x, -1, width << i, 3, 0, SLOPE);
        if (i)
            x = ggn_graph_bn(g, x);
        if (i == 4)
            return x;
        x = stages[i] = ggn_graph_conv(g, x, -1, width << i, 3, 0, SLOPE);
        ggn_graph_mark(g, x, enc_name[i]);
    }
}

/* Up to the size of value `like`: one zero row or column where that size is odd. */
static int up_like(struct ggn_graph *g, int x, int like)
{
    return ggn_graph_up(g, x, g->value[like].h & 1, g->value[like].w & 1);
}

static void build_denoiser(struct ggn_graph *g, const struct ggn_hyper *p)
{
    const int k = p->k_r;
    int skip[4];
    ggn_graph_begin(g, "denoiser", 3, p->height, p->width);
    int x = encode(g, k, skip);
    x = ggn_graph_conv(g, x, -1, 8 * k, 3, 0, SLOPE);
    x = up_like(g, x, skip[3]);
    ggn_graph_mark(g, x, "enc4");
    for (int i = 0; i < 3; i++) {
        ggn_graph_stage(g, dec_name[i]);
        x = ggn_graph_conv(g, x, skip[3 - i], 8 * k >> i, 3, 1, SLOPE);
        x = ggn_graph_bn(g, x);
        x = ggn_graph_conv(g, x, -1, 4 * k >> i, 3, 1, SLOPE);
        x = up_like(g, x, skip[2 - i]);
        ggn_graph_mark(g, x, dec_name[i]);
    }
    ggn_graph_stage(g, "dec3");
    x = ggn_graph_conv(g, x, skip[0], k, 3, 1, SLOPE);
    x = ggn_graph_conv(g, x, -1, k, 3, 1, SLOPE);
    x = ggn_graph_conv(g, x, -1, 3, 1, 0, 1);
    x = ggn_graph_sigmoid(g, x);
    ggn_graph_mark(g, x, "dec3");
}

static void build_generator(struct ggn_graph *g, const struct ggn_hyper *p)
{
    const int k = p->k_m;
    int like[4];
    ggn_graph_begin(g, "generator", 3 * p->window, p->height, p->width);
    int x = encode(g, k, like);
    ggn_graph_stage(g, "dec0");
    x = ggn_graph_conv(g, x, -1, 8 * k, 3, 1, SLOPE);
    x = ggn_graph_bn(g, x);
    x = ggn_graph_conv(g, x, -1, 4 * k, 3, 1, SLOPE);
    x = up_like(g, x, like[3]);
    for (int i = 1; i < 4; i++) {
        ggn_graph_stage(g, dec_name[i]);
        x = ggn_graph_bn(g, x);
        x = ggn_graph_conv(g, x, -1, i < 3 ? 4 * k >> i : k, 3, 1, SLOPE);
        x = up_like(g, x, like[3 - i]);
    }
    ggn_graph_stage(g, "dec4");
    x = ggn_graph_conv(g, x, -1, 1, 1, 0, 1);
    ggn_graph_sigmoid(g, x);
}

static void build_discriminator(struct ggn_graph *g, const struct ggn_hyper *p)
{
    static const char *const conv[3] = {"conv1", "conv2", "conv3"};
    static const char *const pool[3] = {"pool1", "pool2", "pool3"};
    static const char *const fc[3] = {"fc1", "fc2", "fc3"};
    const int k = p->k_d;
    int x = 0;
    ggn_graph_begin(g, "discriminator", p->noise_map ? 4 : 2, p->height, p->width);
    const int scalars = p->scalars ? ggn_graph_input(g, p->scalars) : -1;
    for (int i = 0; i < 3; i++) {
        ggn_graph_stage(g, conv[i]);
        x = ggn_graph_conv_strided(g, x, k << i, 3, 2);
        ggn_graph_mark(g, x, conv[i]);
        x = ggn_graph_bn(g, x);
        x = ggn_graph_lrelu(g, x, SLOPE);
        x = ggn_graph_maxpool(g, x, 3);
        ggn_graph_mark(g, x, pool[i]);
    }
    x = ggn_graph_flatten(g, x);
    for (int i = 0; i < 3; i++) {
        ggn_graph_stage(g, fc[i]);
        x = ggn_graph_linear(g, x, scalars, 4 * k >> i);
        ggn_graph_mark(g, x, fc[i]);
        x = ggn_graph_bn(g, x);
        x = ggn_graph_lrelu(g, x, SLOPE);
        x = ggn_graph_dropout(g, x, 0.5);
    }
    ggn_graph_stage(g, "fc4");
    x = ggn_graph_linear(g, x, scalars, 1);
    if (p->preset == GGN_PRESET_PAPER) {
        x = ggn_graph_lrelu(g, x, SLOPE);
        ggn_graph_dropout(g, x, 0.5);
    }
}

int ggn_network_build(struct ggn_graph *graph, int net, const struct ggn_hyper *hyper, struct base_err *err)
{
    static void (*const build[GGN_NETS])(struct ggn_graph *, const struct ggn_hyper *) = {build_denoiser, build_generator,
                                                                                          build_discriminator};
    int rc = ggn_hyper_check(hyper, err);
    if (rc)
        return rc;
    build[net](graph, hyper);
    return ggn_graph_end(graph, err);
}
