# SPDX-License-Identifier: MIT
"""Mitsuba 3 as a host: `lull.mitsuba.render(scene)` instead of `mi.render(scene)`.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    picture = lull.mitsuba.render(mi.load_file("scene.xml"), "observer", spp_max=2048, checkpoint="scene.npz")
    picture.image, picture.spp, picture.layers["A"]
    print(lull.mitsuba.quote(scene, "observer"))       # what the quality parameter costs, and coarser and finer ones

Blocks are crops of the film, rendered with a border as wide as the reconstruction filter reaches; the weights of the filter
are summed with the samples, so that the picture is that of one long render with any filter. Each wave of each block has a
seed of its own: waves are independent renders, alternate waves make the half buffers, and no sample depends on what else is
rendered with it. Use a sampler of independent samples: stratified ones stratify within a wave only.
"""
from __future__ import annotations

import functools
import re
import zlib
from typing import Any, Iterator, Sequence, Union

import numpy as np

from . import limits, scenes
from .criterion import Criterion, Rect
from .scenes import Picture

# Planes that criteria can read, and the channels of an AOV of that name
_AOVS = {"albedo": ("albedo.R", "albedo.G", "albedo.B"), "normal": ("normal.X", "normal.Y", "normal.Z"),
         "depth": ("depth.T",)}


class Film(scenes.Film):
    """One sensor's film, cropped to blocks. Use as a context manager: the crop is put back. layers: names of its channels
    beside R, G and B; supplies: planes that criteria can read, among its channels; denoised: a scene without AOVs gets
    those that the denoiser reads."""

    def __init__(self, scene: Any, sensor: int = 0, seed: int = 0, denoised: bool = False):
        import mitsuba as mi
        if mi.variant() is None:
            raise ValueError("no Mitsuba variant is set: call mitsuba.set_variant first")
        sensors = scene.sensors()
        if not 0 <= sensor < len(sensors):
            raise ValueError(f"sensor {sensor}: the scene has {len(sensors)}")
        self._mi, self.scene, self.sensor, self.seed = mi, scene, sensors[sensor], seed
        self.integrator = _checked_integrator(mi, scene)
        self._parameters = mi.traverse(self.sensor)
        self.film = self.sensor.film()
        self.width, self.height = (int(v) for v in self.film.size())
        self.crop = Rect(*(int(v) for v in self.film.crop_offset()),
                         *(int(o) + int(s) for o, s in zip(self.film.crop_offset(), self.film.crop_size())))
        self.splats = self.film.rfilter().radius() > 0.5 + 1e-3  # neighbouring pixels share samples
        # a film that samples its own border does so for every crop
        self.border = 0 if self.film.sample_border() else int(self.film.rfilter().border_size())
        if not self._keeps_to_crops():
            raise ValueError(f"the sensor {self.sensor.class_name()} has other rays where its film is cropped, and cannot be "
                             "rendered by blocks: render the sensors of a batch one by one")
        self._channels = self._find_channels()
        self.layers = [name for name in self._channels if name not in ("R", "G", "B", "W")]
        if denoised and not self.integrator.aov_names():
            self.integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "i": self.integrator})
            self._channels = self._find_channels()
        self.supplies = [plane for plane, names in _AOVS.items() if set(names) <= set(self._channels)]

    def _keeps_to_crops(self) -> bool:
        """Does a pixel have the same ray in a crop as in the whole film?"""
        quarter, rays = Rect(0, 0, -(-self.width // 2), -(-self.height // 2)), []
        for area in (Rect(0, 0, self.width, self.height), quarter):
            self._set_crop(area)
            at = [.6 * quarter.width / area.width, .7 * quarter.height / area.height]
            ray, _ = self.sensor.sample_ray(0.0, .5, at, [.5, .5])
            rays.append(np.ravel([ray.o, ray.d]))
        self._set_crop(self.crop)
        return np.allclose(*rays, rtol=1e-3, atol=1e-4)

    def _find_channels(self) -> list[str]:
        """Of the film's sums, in order; ValueError if it makes other colours of them."""
        self.film.prepare(self.integrator.aov_names())
        names, shown = ([channel.name for channel in self.film.bitmap(raw=raw).struct_()] for raw in (True, False))
        if shown[:3] != ["R", "G", "B"] or names[:3] != ["R", "G", "B"] or "W" not in names:
            raise ValueError(f"the film has the channels {', '.join(shown)}: expected RGB, pixel_format rgb or rgba")
        return names

    def check_waves(self, wave: int, spp_max: int) -> None:
        """ValueError if the sampler does not take waves of this size, or the one that is left at the end."""
        wave, spp_max = limits.checked("wave", wave), limits.checked("spp_max", spp_max)
        for count in {min(wave, spp_max), spp_max % wave or wave}:
            self._check_wave(count)

    def _check_wave(self, wave: int) -> None:
        sampler = self.sensor.sampler().clone()
        sampler.set_sample_count(wave)
        if sampler.sample_count() != wave:
            raise ValueError(f"the scene's sampler makes {sampler.sample_count()} samples of a wave of {wave}: use the "
                             "sampler 'independent', or another wave and an spp_max that is a multiple of it")

    def identity(self) -> dict[str, str]:
        """What the samples depend on, for the checkpoint: Mitsuba, its settings, and every parameter of the scene."""
        values = []
        for name, value in self._mi.traverse(self.scene):
            if not name.endswith(("film.crop_size", "film.crop_offset")):
                array = np.array(getattr(value, "matrix", value))
                values.append(zlib.crc32(str(value).encode() if array.dtype == object else array.tobytes()))
        # a scene's parts change their order and addresses from run to run, its samplers their counts from wave to wave
        text = re.sub(r"object_\d+|0x[0-9a-f]+", "", str(self.scene))
        lines = sorted(t for t in text.splitlines() if not re.search(r"sample_count|wavefront|crop_", t))
        crc = zlib.crc32("\n".join(lines).encode(), zlib.crc32(np.array(sorted(values), "<u4").tobytes()))
        index = next(i for i, sensor in enumerate(self.scene.sensors()) if sensor == self.sensor)
        return {"sensor": str(index), "integrator": " ".join(str(self.integrator).split()),
                "filter": " ".join(str(self.film.rfilter()).split()), "sampler": self.sensor.sampler().class_name(),
                "renderer": f"Mitsuba {self._mi.__version__} {self._mi.variant()}", "scene": f"crc {crc:08x}"}

    def _set_crop(self, rect: Rect) -> None:
        self._parameters["film.crop_size"] = [rect.width, rect.height]
        self._parameters["film.crop_offset"] = [rect.x0, rect.y0]
        self._parameters.update()

    def __exit__(self, *_: object) -> None:
        self._set_crop(self.crop)

    def render(self, rects: Sequence[Rect], first: int, count: int, _half: bool) -> Iterator[dict[str, np.ndarray]]:
        """The driver's render function: for each rectangle the mean of `count` samples times their weight, by plane."""
        self._check_wave(count)
        for r in rects:
            yield self._render_block(r, first, count)

    def _render_block(self, r: Rect, first: int, count: int) -> dict[str, np.ndarray]:
        area = Rect(max(r.x0 - self.border, 0), max(r.y0 - self.border, 0), min(r.x1 + self.border, self.width),
                    min(r.y1 + self.border, self.height))
        self._set_crop(area)
        self.integrator.render(self.scene, self.sensor, seed=scenes.seed_of(self.seed, first, r), spp=count, develop=False)
        sums = np.array(self.film.develop(raw=True))[r.y0 - area.y0:r.y1 - area.y0, r.x0 - area.x0:r.x1 - area.x0]
        means = dict(zip(self._channels, np.moveaxis(sums.astype(np.float64) / count, -1, 0)))
        planes = {plane: np.stack([means[name] for name in names], -1) if len(names) > 1 else means[names[0]]
                  for plane, names in _AOVS.items() if plane in self.supplies}
        return {"color": np.stack([means[name] for name in "RGB"], -1), "weight": means["W"], **planes,
                **{name: means[name] for name in self.layers}}


def _checked_integrator(mi: Any, scene: Any) -> Any:
    integrator = scene.integrator()
    if integrator is None:
        raise ValueError("the scene has no integrator: add one, such as path")
    if isinstance(integrator, mi.AdjointIntegrator):
        raise ValueError(f"the integrator {integrator.class_name()} (ptracer) splats light over the whole film, which "
                         "cannot be rendered by blocks: use path or volpath")
    return integrator


def _read_mask(path: str) -> np.ndarray:
    """[height, width] in [0, 1] of a picture file: the mean of its colours, as stored."""
    import mitsuba as mi
    try:
        stored = np.array(mi.Bitmap(path))
    except RuntimeError as error:
        raise ValueError(f"{path}: cannot be read as a mask: {str(error).splitlines()[-1].strip()}") from None
    colours = np.atleast_3d(stored)[..., :1 if stored.ndim == 2 or stored.shape[2] < 3 else 3].mean(-1)
    return colours / np.iinfo(stored.dtype).max if stored.dtype.kind == "u" else colours


def quote(scene: Any, criterion: Union[str, Criterion] = "", **settings: Any) -> str:
    """What the quality parameter will cost (lull.scenes.quote). settings: as render takes them."""
    return scenes.quote(functools.partial(render, scene), criterion, settings)


def render(scene: Any, criterion: Union[str, Criterion] = "", *, sensor: int = 0, seed: int = 0, wave: int = 8,
           denoise: str = "", **settings: Any) -> Picture:
    """Renders a mi.Scene, one sensor of it; each block until the criterion stops it. The film's crop is kept to. settings:
    as lull.scenes.render takes them (limits, mask, checkpoint, resume, the criterion's parameters …), which also says what
    is raised."""
    return scenes.render(lambda: Film(scene, sensor, seed, bool(denoise)), criterion, seed=seed, wave=wave, denoise=denoise,
                         read_mask=_read_mask, **settings)
