#include "train/start.h"

#include <string.h>

static const struct ggn_tensor *tensor(const struct ggn_graph *g, const char *name)
{
    for (int i = 0; i < g->n_tensors; i++)
        if (!strcmp(g->tensor[i].name, name))
            return &g->tensor[i];
    return NULL;
}

void ggn_train_fold(const struct ggn_graph *m, float *params, int window, double g, int back)
{
    const struct ggn_tensor *t = &m->tensor[0]; /* [K, 3S, 3, 3] */
    const size_t taps = (size_t)t->dim[2] * (size_t)t->dim[3], in = (size_t)t->dim[1];
    for (size_t o = 0; g > 0 && o < (size_t)t->dim[0]; o++)
        for (size_t c = 0; c < 3; c++)
            for (size_t k = 0; k < taps; k++) {
                float *w = params + t->offset + o * in * taps + k;
                float *newest = w + (3 * (size_t)(window - 1) + c) * taps;
                double sum = 0;
                for (size_t s = 0; s + 1 < (size_t)window; s++) {
                    float *image = w + (3 * s + c) * taps;
                    double plain = back ? (double)*image : g * (double)*image;
                    sum += plain;
                    *image = (float)(back ? plain / g : plain);
                }
                *newest = (float)((double)*newest + (back ? sum : -sum));
            }
}

/* Output channel o of a 3×3 convolution copies input channel i. */
static void copy_channel(const struct ggn_tensor *w, float *params, int o, int i, int transposed)
{
    const size_t c_out = (size_t)w->dim[transposed ? 1 : 0], c_in = (size_t)w->dim[transposed ? 0 : 1];
    for (size_t c = 0; c < c_in; c++) {
        size_t at = transposed ? c * c_out + (size_t)o : (size_t)o * c_in + c;
        float *taps = params + w->offset + 9 * at;
        memset(taps, 0, 9 * sizeof *taps);
        if (c == (size_t)i)
            taps[4] = 1;
    }
}

void ggn_train_identity(const struct ggn_graph *r, float *params)
{
    const struct ggn_tensor *in0 = tensor(r, "enc0.0.weight"), *in1 = tensor(r, "enc0.1.weight");
    const struct ggn_tensor *out0 = tensor(r, "dec3.0.weight"), *out1 = tensor(r, "dec3.1.weight");
    const struct ggn_tensor *last = tensor(r, "dec3.2.weight"), *bias = tensor(r, "dec3.2.bias");
    if (!in0 || !in1 || !out0 || !out1 || !last || !bias || in0->dim[0] < 3)
        return;
    const int k = in0->dim[0];
    for (int c = 0; c < 3; c++) {
        copy_channel(in0, params, c, c, 0);
        copy_channel(in1, params, c, c, 0);
        copy_channel(out0, params, c, k + c, 1); /* channels k… of the joined input are skip 0 */
        copy_channel(out1, params, c, c, 1);
        params[bias->offset + (size_t)c] = -2;
        for (int i = 0; i < k; i++) {
            float *w = &params[last->offset + (size_t)(c * k + i)];
            *w = i == c ? 4 : 0.1F * *w;
        }
    }
}
