/* Camera rays. Pure, thread-safe. */
#ifndef PT_SHADE_CAMERA_H
#define PT_SHADE_CAMERA_H

#include "scene/scene.h"

/* Derives the camera's ray constants from its kind, size, fov and screen window. */
void pt_camera_init(struct pt_camera *camera);

#endif
