/*
 * Where the blocks of a render will stop and how long that takes: the one prediction behind the progress line and --quote.
 *
 * A criterion says at n samples per pixel that it expects to stop a block at p (predicted_spp). Where a render really stops
 * follows from p, from the checks in between and from how far such a prediction can be trusted, which depends on p / n.
 * Time: every block has its own thread seconds per sample, known from the samples it has. Pure functions, thread-safe.
 */
#ifndef PT_RENDER_OUTLOOK_H
#define PT_RENDER_OUTLOOK_H

#include <stdint.h>

#include "render/blocks.h"

/* What a criterion said about a block last. */
struct pt_outlook_said {
    uint64_t spp;     /* samples when it was asked; 0 = it never was */
    double predicted; /* samples at which it expects to stop; NaN = it does not say */
    int stopped;      /* it said stop: `predicted` is where, at most spp */
    int unmet;        /* its noise sits in few pixels or grows: light that most of its pixels have not met yet */
};

struct pt_outlook_stop {
    double spp;       /* samples per pixel at which the block is expected to stop */
    double low, high; /* 8 of 10 blocks stop between them */
    int known;        /* 0: nobody predicted anything; spp and high are spp_max, low what the block has */
};

/* Predictions are taken as they are: from a hundred samples on they were neither low nor high (docs/quote.md). The interval
 * widens with the octaves from the samples at hand to the predicted ones, and to an octave either way for a block that is
 * `unmet`. It does not stop before `spp`: samples that it has or gets in any case, 0 … spp_max. */
struct pt_outlook_stop pt_outlook_stop(const struct pt_outlook_said *said, uint64_t spp, uint64_t spp_max);
/* Of a block of a render that is going on; uniform: it stops at spp_max. A stopped block: where it did. */
struct pt_outlook_stop pt_outlook_of_block(const struct pt_block *block, int uniform, uint64_t spp_max);

/* More checks of a block that stops at `spp`: as many per octave as the criterion asks for now. */
double pt_outlook_checks(const struct pt_block *block, double spp);

/* Work that is left in one block, whose samples all cost the same. */
struct pt_outlook_work {
    double spp;      /* more samples per pixel, >= 0 */
    double thread_s; /* for all of them */
    int rows;        /* of pixels: what threads share a block by */
};

/* Wall seconds of `count` blocks sampled side by side, each until it has its samples: a block's rows are all that can be
 * done at once, so the last blocks leave threads idle. Sorts `work`. threads >= 1; as many processors are taken
 * to be free. */
double pt_outlook_wall_s(struct pt_outlook_work *work, uint32_t count, int threads);
/* Threads that are busy while this many rows are to be done. */
double pt_outlook_busy(long rows, int threads);

#endif
