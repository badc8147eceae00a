# SPDX-License-Identifier: MIT
"""What the scene's view settings (exposure, Filmic, AgX, looks, curves) make of linear radiance, for lull.Frame.

Blender's colour management cannot be called from Python, but it can save a picture: a ramp of greys is saved through it once
and read back. The curve is applied to each channel, which leaves out what a view does across channels (Filmic and AgX take
colour out of highlights): the noise of luminance is judged as it is shown, that of saturated highlights nearly so.
"""
from __future__ import annotations

import contextlib
import os
from typing import Callable, Iterator, Optional

import bpy
import numpy as np

from ..files import srgb_decoded

LOW, HIGH, STEPS = -14.0, 8.0, 2048  # log2 of the darkest and the brightest grey of the ramp, and their number


@contextlib.contextmanager
def unnamed_file() -> Iterator[str]:
    """A file in memory that Blender writes and we read: its path, for this process. It has no name in any folder, so that it
    is gone with the process however that ends."""
    handle = os.memfd_create("lull")
    try:
        yield f"/proc/self/fd/{handle}"
    finally:
        os.close(handle)


def is_plain(scene: bpy.types.Scene) -> bool:
    """Exposure and the sRGB transfer are all there is: the criterion can be told so exactly."""
    view = scene.view_settings
    return (scene.display_settings.display_device == "sRGB" and view.view_transform == "Standard" and
            view.look in ("None", "") and view.gamma == 1.0 and not view.use_curve_mapping)


def view_text(scene: bpy.types.Scene) -> str:
    """The settings in words, for people and for comparing."""
    view = scene.view_settings
    curves = [(round(p.location.x, 6), round(p.location.y, 6)) for c in view.curve_mapping.curves for p in c.points] \
        if view.use_curve_mapping and view.curve_mapping else []
    return (f"{scene.display_settings.display_device}, {view.view_transform}, look {view.look or 'None'}, exposure "
            f"{view.exposure:g}, gamma {view.gamma:g}{f', curves {curves}' if curves else ''}")


def display_of(scene: bpy.types.Scene) -> Optional[Callable[[np.ndarray], np.ndarray]]:
    """None if the view is plain; else linear radiance [..., 3] -> linear display values in [0, 1]."""
    if is_plain(scene):
        return None
    greys = np.concatenate(([0.0], np.exp2(np.linspace(LOW, HIGH, STEPS - 1))))
    encoded = _save_ramp(scene, greys)
    shown = srgb_decoded(encoded)
    return lambda linear: np.interp(linear, greys, shown)


def read_grey(path: str) -> np.ndarray:
    """[height, width] in [0, 1] of a picture file: the mean of its colours as stored, rows from the top."""
    try:
        image = bpy.data.images.load(path)
    except RuntimeError:
        raise ValueError(f"{path}: cannot be read as a picture") from None
    try:
        image.colorspace_settings.name, image.alpha_mode = "Non-Color", "CHANNEL_PACKED"
        (width, height), channels = image.size, image.channels
        if not width * height:
            raise ValueError(f"{path}: cannot be read as a picture")
        pixels = np.empty(width * height * channels, np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    return pixels.reshape(height, width, channels)[::-1, :, :min(channels, 3)].mean(-1, dtype=np.float64)


def _save_ramp(scene: bpy.types.Scene, greys: np.ndarray) -> np.ndarray:
    """Display codes in [0, 1] of the greys."""
    settings = scene.render.image_settings
    names = [n for n in ("media_type", "file_format", "color_mode", "color_depth", "color_management")
             if hasattr(settings, n)]
    before = {name: getattr(settings, name) for name in names}
    image = bpy.data.images.new("lull ramp", len(greys), 1, float_buffer=True)
    try:
        image.colorspace_settings.name = "Linear" if bpy.app.version < (4, 0) else "Linear Rec.709"
        image.pixels.foreach_set(np.stack([greys, greys, greys, np.ones_like(greys)], -1).astype(np.float32).ravel())
        for name, value in {"media_type": "IMAGE", "file_format": "PNG", "color_mode": "RGB", "color_depth": "16",
                            "color_management": "FOLLOW_SCENE"}.items():
            if name in before:
                setattr(settings, name, value)
        with unnamed_file() as path:
            image.save_render(path, scene=scene)
            return read_grey(path)[0]
    finally:
        bpy.data.images.remove(image)
        for name, value in before.items():
            setattr(settings, name, value)
