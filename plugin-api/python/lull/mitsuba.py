# SPDX-License-Identifier: MIT
"""Mitsuba 3 as a host: `lull.mitsuba.render(scene)` instead of `mi.render(scene)`.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    picture = lull.mitsuba.render(mi.load_file("scene.xml"), "observer", spp_max=2048)
    picture.image, picture.spp

Blocks are crops of the film. Each wave of each area has a seed of its own, so that waves are independent renders whose mean
is the picture, and alternate waves make the half buffers. Use a sampler of independent samples: stratified ones stratify
within a wave only. Splatting integrators (ptracer) do not work by crops.
"""
from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any, Callable, Iterator, Optional, Sequence, Union

import numpy as np

from .blocks import merge
from .criterion import Criterion, Rect, load
from .driver import Driver, Result
from .frame import Frame


@dataclass
class Picture:
    """What render gives back: image [height, width, 3] float64 linear, spp [height, width] uint32."""
    image: np.ndarray
    spp: np.ndarray
    result: Result
    driver: Driver  # for lull.outputs and lull.checkpoint


class Film:
    """One sensor's film, cropped to rectangles. Use as a context manager: the crop is put back."""

    def __init__(self, scene: Any, sensor: int = 0, seed: int = 0):
        import mitsuba as mi
        if mi.variant() is None:
            raise ValueError("no Mitsuba variant is set: call mitsuba.set_variant first")
        sensors = scene.sensors()
        if not 0 <= sensor < len(sensors):
            raise ValueError(f"sensor {sensor}: the scene has {len(sensors)}")
        self._mi, self.scene, self.sensor, self.seed = mi, scene, sensors[sensor], seed
        self._parameters = mi.traverse(self.sensor)
        film = self.sensor.film()
        self.width, self.height = (int(v) for v in film.size())
        self.crop = Rect(*(int(v) for v in film.crop_offset()),
                         *(int(o) + int(s) for o, s in zip(film.crop_offset(), film.crop_size())))
        self.splats = film.rfilter().radius() > 0.5 + 1e-3  # neighbouring pixels share samples

    def check_wave(self, wave: int) -> None:
        """ValueError if the sampler does not take waves of this size."""
        sampler = self.sensor.sampler().clone()
        sampler.set_sample_count(wave)
        if sampler.sample_count() != wave:
            raise ValueError(f"the scene's sampler makes {sampler.sample_count()} samples of a wave of {wave}: use the "
                             "sampler 'independent', or another wave")

    def _set_crop(self, rect: Rect) -> None:
        self._parameters["film.crop_size"] = [rect.width, rect.height]
        self._parameters["film.crop_offset"] = [rect.x0, rect.y0]
        self._parameters.update()

    def __enter__(self) -> Film:
        return self

    def __exit__(self, *_) -> None:
        self._set_crop(self.crop)

    def render(self, rects: Sequence[Rect], first: int, count: int, _half: bool) -> Iterator[np.ndarray]:
        """The driver's render function: the mean of `count` samples, [h, w, 3] float32 per rectangle."""
        areas = {area: self._render_area(area, first, count) for area in merge(rects)}
        for r in rects:
            area, pixels = next((a, p) for a, p in areas.items() if a.x0 <= r.x0 < a.x1 and a.y0 <= r.y0 < a.y1)
            yield pixels[r.y0 - area.y0:r.y1 - area.y0, r.x0 - area.x0:r.x1 - area.x0]

    def _render_area(self, area: Rect, first: int, count: int) -> np.ndarray:
        self._set_crop(area)
        seed = zlib.crc32(struct.pack("<qqii", self.seed, first, area.x0, area.y0))
        pixels = np.array(self._mi.render(self.scene, sensor=self.sensor, spp=count, seed=seed))
        if pixels.ndim != 3 or pixels.shape[2] < 3:
            raise ValueError(f"the film has {pixels.shape[2] if pixels.ndim == 3 else 1} channels: expected RGB")
        return pixels[..., :3]


def render(scene: Any, criterion: Union[str, Criterion] = "observer", *, sensor: int = 0, spp_min: int = 16,
           spp_max: int = 1024, time_budget_s: float = 0.0, block: Optional[int] = None, wave: int = 8, seed: int = 0,
           mask: Optional[np.ndarray] = None, after_call: Optional[Callable[[Driver], None]] = None,
           **parameters: Any) -> Picture:
    """Renders a mi.Scene; each block until the criterion stops it.

    criterion: a name, a path or a lull.Criterion; parameters are its own (threshold=…). The film's crop is kept to. An
    exception while rendering is not raised: see Picture.result. Raises LullError and ValueError for bad input.
    """
    judge = criterion if isinstance(criterion, Criterion) else load(criterion, **parameters)
    try:
        with Film(scene, sensor, seed) as film:
            film.check_wave(wave)
            frame = Frame(judge, film.width, film.height, block=block, crop=film.crop, spp_min=spp_min, spp_max=spp_max,
                          time_budget_s=time_budget_s, deterministic=time_budget_s <= 0, seed=seed, independent=True,
                          shared=film.splats, mask=mask)
            driver = Driver(frame, film.render, wave=wave, after_call=after_call)
            result = driver.run()
            frame.close()
    finally:
        if judge is not criterion:
            judge.close()
    return Picture(frame.cropped(frame.mean()), frame.cropped(frame.spp()), result, driver)
