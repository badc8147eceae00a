# SPDX-License-Identifier: MIT
"""Pictures inside Blender: the render in the making as an image and as a small picture for the panel, and the stop map."""
from __future__ import annotations

from typing import Optional

import bpy
import bpy.utils.previews
import numpy as np

from .. import outputs
from ..denoising import Denoised
from ..frame import Frame

PICTURE, STOP_MAP = "Lull", "Lull Stop Map"
_SIDE = 256  # pixels of a small picture
_small: Optional[bpy.utils.previews.ImagePreviewCollection] = None


def _picture(width: int, height: int) -> bpy.types.Image:
    """The image of the render, of this size and without a file."""
    image = bpy.data.images.get(PICTURE) or bpy.data.images.new(PICTURE, width, height, float_buffer=True)
    if image.source != "GENERATED" or tuple(image.size) != (width, height):
        image.source, image.use_generated_float = "GENERATED", True
        image.generated_width, image.generated_height = width, height
    image.colorspace_settings.name = "Linear" if bpy.app.version < (4, 0) else "Linear Rec.709"
    image.use_view_as_render = True
    return image


def _rgba(rgb: np.ndarray) -> np.ndarray:
    """[h, w, 4] float32 from below, as Blender has it."""
    return np.concatenate((rgb, np.ones_like(rgb[..., :1])), -1)[::-1].astype(np.float32)


def _show_small(name: str, rgb: np.ndarray) -> None:
    """rgb: [h, w, 3] display values in [0, 1]. The panel's pictures are square: the rest is transparent."""
    if _small is None:
        return
    step = -(-max(rgb.shape[:2]) // _SIDE)
    rgba, side = _rgba(rgb[::step, ::step]), -(-max(rgb.shape[:2]) // step)
    square = np.zeros((side, side, 4), np.float32)
    y, x = (side - rgba.shape[0]) // 2, (side - rgba.shape[1]) // 2
    square[y:y + rgba.shape[0], x:x + rgba.shape[1]] = rgba
    picture = _small.get(name) or _small.new(name)
    picture.image_size = (side, side)
    picture.image_pixels_float.foreach_set(square.ravel())


def show_picture(frame: Frame, denoised: Optional[Denoised] = None) -> None:
    """The frame as far as it is, or its denoised picture."""
    mean = frame.cropped(denoised.picture if denoised else frame.mean())
    image = _picture(mean.shape[1], mean.shape[0])
    image.pixels.foreach_set(_rgba(mean).ravel())
    image.update()
    _show_small(PICTURE, outputs.shown(frame, denoised) / 255)


def show_in_editors(screen: bpy.types.Screen) -> None:
    """Image editors that show nothing, or Blender's own result, show the picture."""
    for area in screen.areas:
        if area.type == "IMAGE_EDITOR":
            space = area.spaces.active
            if space.image is None or space.image.type == "RENDER_RESULT":
                space.image = bpy.data.images[PICTURE]


def keep(name: str, path: str) -> None:
    """The image comes from this file from now on, so that it is there when the .blend is opened again."""
    image = bpy.data.images.get(name) or bpy.data.images.new(name, 1, 1)
    image.source, image.filepath = "FILE", path
    image.reload()
    if name == STOP_MAP:
        width, height = image.size
        rgba = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(rgba)
        _show_small(name, rgba.reshape(height, width, 4)[::-1, :, :3])


def icon(name: str) -> int:
    """Of the small picture; 0 = there is none."""
    return _small[name].icon_id if _small is not None and name in _small else 0


def register() -> None:
    """Makes room for the small pictures."""
    global _small
    _small = bpy.utils.previews.new()


def unregister() -> None:
    """Frees the small pictures."""
    global _small
    if _small is not None:
        bpy.utils.previews.remove(_small)
    _small = None
