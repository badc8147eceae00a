/*
 * Open Image Denoise by dlopen, in the process of its own that denoise/oidn.h tells of: a dozen prototypes of ours, no
 * header of theirs. One thread.
 */
#ifndef DENOISE_PROGRAM_LIBRARY_H
#define DENOISE_PROGRAM_LIBRARY_H

#include "denoise/program/shared.h"

struct library; /* lives as long as the process: the library's threads outlive their device for a moment */

/* Finds it; path: a file, a folder, or "" for the usual places. */
int library_open(const char *path, struct library **out, struct base_err *err);
/* Makes a device of as many threads, unless there is one from before. Unless the width is 0, denoises the colors of s, whose
 * pictures are finite, into its outs. After a failure the process is of no more use. */
int library_denoise(struct library *library, struct shared *s, struct base_err *err);

#endif
