/* Scenes written in the test itself. */
#ifndef PT_TEXT_SCENE_H
#define PT_TEXT_SCENE_H

#include "pbrt/load.h"

/* Loads scene text as the file "t.pbrt"; fails the test when that fails. Warnings go to *warnings (may be NULL). */
struct pt_scene *text_scene(const char *text, struct pt_scene_defaults *defaults, int *warnings);
/* Loads text that must fail; returns the code and the message. */
int text_scene_error(const char *text, int strict, struct base_err *err);
/* Loads text as the body of a world, with an 8 x 8 film and a camera at the origin. */
struct pt_scene *world_scene(const char *body);

#endif
