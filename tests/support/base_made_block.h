/* A small sequence of one block: three levels (the second full) and a reference, in a folder of the group's own. */
#ifndef TESTS_SUPPORT_BASE_MADE_BLOCK_H
#define TESTS_SUPPORT_BASE_MADE_BLOCK_H

#include "sequence/block.h"

enum { MADE_W = 37, MADE_H = 21, MADE_P = MADE_W * MADE_H };

extern double made_mean[3 * MADE_P], made_half[3 * MADE_P];
extern uint8_t made_display[3 * MADE_P];
/* Fills the planes as those of level `seed`. */
void made_fill(int seed);
/* Adds all four levels to a new builder. */
void made_build(struct seq_builder *w);

extern char made_dir[], made_path[64]; /* the folder, and the block's file in it */
/* Before and after a group of tests. */
int made_begin(void **state);
int made_end(void **state);

#endif
