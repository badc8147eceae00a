/*
 * The pictures that people are shown in a study: chooses blocks and levels, and writes every picture as a lossless PNG,
 * DIR/vVIEW/NAME.png, of a block bID-WHAT.png.
 *
 * A view is a folder. With a manifest.json it is a recorded sequence: its levels, and where a block has independent halves
 * also simulated ones up to SEQ_STUDY_CAP (data/stimuli.h). Without one it holds pictures of one size: `reference.png`
 * (or any extension that is read), and for thresholds one picture per level whose name ends in its samples per pixel
 * (`view-00256.png`), for a validation one picture per condition, named like it. Renders with --denoise give a view of each
 * kind that is asked for. Folders of frames in the place of pictures, reference/0001.exr …, 256/0001.exr …, are a clip: in
 * DIR the frames of a block lie below each other in one picture, which is fetched and decoded whole before it is shown.
 */
#ifndef GGN_DATA_SHOWN_H
#define GGN_DATA_SHOWN_H

#include "base/threads.h"
#include "data/shown_view.h"

/* shown: zeroed; released by the caller, also after a failure, when some of the pictures may be there. */
int ggn_shown_make(const struct ggn_shown_request *request, struct ggn_shown *shown, struct base_threads *threads,
                   struct base_err *err);

#endif
