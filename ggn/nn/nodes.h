/*
 * Sums of gradients over the images of a batch, the same bytes whoever computes which images.
 *
 * Images are the leaves of a binary tree: a node of 2^k images that begins at a multiple of 2^k is the sum of its halves. A
 * process that has the images [first, end) computes the largest such nodes that lie inside; siblings of different
 * processes are added where they meet, and what is left at the top is added from left to right. So every sum is made of the
 * same additions, by one process or by many, and few nodes travel.
 */
#ifndef GGN_NN_NODES_H
#define GGN_NN_NODES_H

#include <stddef.h>

#include "nn/real.h"

enum {
    GGN_TREE_DEPTH = 13, /* images of a batch: below 2^12 */
    GGN_NODES_MAX = 2 * GGN_TREE_DEPTH,
    GGN_TREE_WIDTH = 1024 /* elements summed at a time */
};

struct ggn_node {
    int first, size; /* images */
};

/* A sum in the making; level[k] is over 2^k images. */
struct ggn_tree {
    real level[GGN_TREE_DEPTH][GGN_TREE_WIDTH];
};

#define ggn_tree_add GGN_TYPED(ggn_tree_add)
#define ggn_nodes_fold GGN_TYPED(ggn_nodes_fold)

/* The nodes of the images [first, end), in order; returns how many (at most GGN_NODES_MAX). */
int ggn_nodes_list(struct ggn_node nodes[GGN_NODES_MAX], int first, int end);
/* Adds leaf[n], n <= GGN_TREE_WIDTH, of the i-th image of a node, images in order; returns a sum that after the node's last
 * image is that of the node. */
const real *ggn_tree_add(struct ggn_tree *tree, int i, const real *leaf, int n);

/* Nodes as they come, in the order of their images. */
struct ggn_fold {
    struct ggn_node node[GGN_TREE_DEPTH + 1];
    real *sum[GGN_TREE_DEPTH + 1]; /* borrows */
    int n;
};

/* Puts a node behind those that are there, adding siblings in place; sum[count]. `last`: nothing follows, all that is there
 * is added into fold->sum[0]. */
void ggn_nodes_fold(struct ggn_fold *fold, struct ggn_node node, real *sum, size_t count, int last);

#endif
