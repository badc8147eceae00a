#include "nn/nodes.h"

#include "nn/real.h"

#ifndef GGN_DOUBLE
int ggn_nodes_list(struct ggn_node nodes[GGN_NODES_MAX], int first, int end)
{
    int n = 0;

    while (first < end) {
        int size = 1;
        while (first % (2 * size) == 0 && first + 2 * size <= end)
            size *= 2;
        nodes[n++] = (struct ggn_node){first, size};
        first += size;
    }
    return n;
}
#endif

const real *ggn_tree_add(struct ggn_tree *t, int i, const real *leaf, int n)
{
    int full = 0;

    while (i >> full & 1)
        full++;
    for (int k = 0; k < n; k++) {
        real sum = leaf[k];
        for (int level = 0; level < full; level++)
            sum = t->level[level][k] + sum;
        t->level[full][k] = sum;
    }
    return t->level[full];
}

static void add(real *to, const real *from, size_t count)
{
    for (size_t k = 0; k < count; k++)
        to[k] += from[k];
}

void ggn_nodes_fold(struct ggn_fold *f, struct ggn_node node, real *sum, size_t count, int last)
{
    f->node[f->n] = node;
    f->sum[f->n++] = sum;
    while (f->n > 1 && f->node[f->n - 2].size == f->node[f->n - 1].size &&
           f->node[f->n - 2].first % (2 * f->node[f->n - 1].size) == 0) {
        f->n--;
        f->node[f->n - 1].size *= 2;
        add(f->sum[f->n - 1], f->sum[f->n], count);
    }
    for (int i = 1; last && i < f->n; i++)
        add(f->sum[0], f->sum[i], count);
}
