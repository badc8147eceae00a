/*
 * The subcommands of `ggn`: one file each, ggn/cli/NAME.c, with `int ggn_cmd_NAME(int argc, char **argv, struct base_err
 * *err)`.
 *
 * A subcommand parses its own argv by a table of options (base/options.h; argv[0] is "ggn NAME" already). It returns 0, a
 * negative code with the line that `ggn` says on standard error before it ends with 2 (bad usage, bad input, or an output
 * could not be written) or 1 (out of memory), or GGN_EXIT_INTERRUPTED: a command that takes long polls base_interrupted and
 * leaves its outputs whole.
 * To add one: write the file and add its line to GGN_COMMANDS. An underscore in the name is a hyphen on the command line.
 */
#ifndef GGN_CLI_COMMANDS_H
#define GGN_CLI_COMMANDS_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "job/job.h"
#include "picture/read.h"

/* X(name, one-line help), in the order `ggn --help` lists them. */
#define GGN_COMMANDS(X) \
    X(inspect, "print what a model file holds") \
    X(convert, "store a model's weights in another type") \
    X(flip, "visible difference of two images (LDR-FLIP)") \
    X(visible, "where the noise of an image is still seen, against a reference") \
    X(thresholds, "thresholds or stops of any file, as JSON") \
    X(compare, "stop maps or thresholds against (human) thresholds") \
    X(import, "pictures into block sequences") \
    X(label, "thresholds for recorded sequences: human, or a model observer's") \
    X(train, "train a stopping criterion on block sequences") \
    X(baseline, "train a published model before the network, as a criterion") \
    X(replay, "what models answer on recorded sequences, as JSON") \
    X(evaluate, "figures of models and baselines on recorded sequences") \
    X(cost, "what accuracy costs each criterion on recorded sequences") \
    X(reconstruct, "the picture with each block at its threshold")

#define GGN_DECLARE_COMMAND(name, help) int ggn_cmd_##name(int argc, char **argv, struct base_err *err);
GGN_COMMANDS(GGN_DECLARE_COMMAND)
#undef GGN_DECLARE_COMMAND

enum { GGN_EXIT_INTERRUPTED = 130 };

/* Under mpirun the processes of the job, else NULL. An error is said once, by rank 0. */
extern struct job *ggn_cmd_job;

/* Reads the two pictures that a command compares, of equal size; says on stderr how many pixels of one could not be shown as
 * they are. images: zeroed; the caller releases both, also after a failure. */
int ggn_cmd_read_pair(const char *command, const char *const paths[2], struct pic_image images[2], struct base_err *err);
/* Magma colours of gain times each of n values, [n][3]; the caller frees them. NULL without memory. */
uint8_t *ggn_cmd_magma(const float *map, double gain, size_t n);

#endif
