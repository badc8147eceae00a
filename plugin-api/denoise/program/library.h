/*
 * Open Image Denoise by dlopen, in the process of its own that denoise/oidn.h tells of: a dozen prototypes of ours, no
 * header of theirs. One thread.
 */
#ifndef DENOISE_PROGRAM_LIBRARY_H
#define DENOISE_PROGRAM_LIBRARY_H

#include "denoise/program/shared.h"

/* Finds the library ("": the usual places), makes a device, fills s->version and, unless the width is 0, denoises the colors
 * of s, whose pictures are finite, into its outs. */
int library_denoise(const char *path, struct shared *s, struct base_err *err);

#endif
