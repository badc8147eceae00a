# SPDX-License-Identifier: MIT
"""LuxCore as a host: `lull.luxcore.render(scene, settings)` instead of a RenderSession.

    lux = lull.luxcore.start()                              # the module pyluxcore, without its log
    scene, settings = lux.Scene(), lux.Properties("scene.cfg")
    scene.Parse(lux.Properties("scene.scn"))
    picture = lull.luxcore.render(scene, settings, "observer", spp_max=2048, checkpoint="scene.npz")
    picture.image, picture.spp, picture.layers["A"]
    print(lull.luxcore.quote(scene, settings, "observer"))  # what the quality parameter costs, and coarser and finer ones

Each wave of each block is a session of its own on the film's subregion, with the engine PATHCPU and a seed of its own: waves
are independent renders, and alternate waves make the half buffers. LuxCore's threads end a wave a little after its last
sample, so pixels have a sample more or less: LuxCore's own count is each pixel's weight, and no mean is off. For the same
reason a seed does not give the same bytes twice.
"""
from __future__ import annotations

import contextlib
import functools
import os
import time
import zlib
from typing import Any, Iterable, Iterator, Sequence, Union

import numpy as np  # before pyluxcore, which else aborts

from . import scenes
from .criterion import Criterion, Rect
from .program import open_closed
from .scenes import Picture

# LuxCore's outputs beside SAMPLECOUNT, by plane or layer, with their channels
_OUTPUTS = {"color": ("RGB", 3), "albedo": ("ALBEDO", 3), "normal": ("AVG_SHADING_NORMAL", 3), "A": ("ALPHA", 1)}
# What a wave sets itself, or what writes files
_OWN = ("film.outputs.", "film.filter.", "film.subregion", "film.imagepipeline", "film.noiseestimation.", "batch.",
        "periodicsave.", "resumerendering.", "renderengine.")
# What needs the whole film, or is made anew by each session
_REFUSED = ("path.photongi.indirect.enabled", "path.photongi.caustic.enabled", "path.hybridbackforward.enable")
_SAMPLERS = ("SOBOL", "RANDOM")
_POLL_S = 0.001  # LuxCore looks whether it is done when it is asked


def start() -> Any:
    """The module pyluxcore, ready and without its log. Call it once, before anything else of LuxCore."""
    open_closed()  # LuxCore writes to descriptors by their numbers
    with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
        import pyluxcore
        pyluxcore.Init()
    pyluxcore.SetLogHandler(None)
    return pyluxcore


class Film(scenes.Film):
    """The film of a pyluxcore.Scene that is rendered by pyluxcore.Properties, in waves of its blocks. Both are the
    caller's, and stay as they are. Pixels are boxes: no filter of LuxCore's. Planes and layers: albedo, normal, alpha."""
    splats = False
    layers = ("A",)
    supplies = ("albedo", "normal")

    def __init__(self, scene: Any, settings: Any, seed: int = 0):
        import pyluxcore
        self._lux, self.scene, self._properties, self.seed = pyluxcore, scene, settings, seed
        size = pyluxcore.RenderConfig(settings, scene).GetFilmSize()
        self.width, self.height, (x0, x1, y0, y1) = size[:3]  # ends included, rows from the bottom
        self.crop = Rect(x0, self.height - 1 - y1, x1 + 1, self.height - y0)
        self._check_settings()
        self._planes = {name: np.zeros((self.height, self.width, channels)[:2 + (channels > 1)], np.float32)
                        for name, (_, channels) in _OUTPUTS.items()}
        self._counts = np.zeros((self.height, self.width), np.uint32)

    def _setting(self, name: str) -> str:
        """The first value of a property, or "" if it is not set."""
        if not self._properties.IsDefined(name):
            return ""
        return str(self._properties.Get(name).GetString())

    def _check_settings(self) -> None:
        engine, sampler = self._setting("renderengine.type") or "PATHCPU", self._setting("sampler.type") or "SOBOL"
        if engine != "PATHCPU":
            raise ValueError(f"renderengine.type {engine}: blocks are rendered by PATHCPU: set that")
        if sampler not in _SAMPLERS:
            raise ValueError(f"sampler.type {sampler}: a block has no film to explore: use {' or '.join(_SAMPLERS)}")
        for name in _REFUSED:
            if self._setting(name) in ("1", "true"):
                raise ValueError(f"{name}: it needs more than a block: switch it off")
        if float(self._setting("path.clamping.variance.maxvalue") or 0) > 0:
            raise ValueError("path.clamping.variance.maxvalue: it clamps by all samples of the film: set it to 0")

    def identity(self) -> dict[str, str]:
        """What the samples depend on, for the checkpoint: LuxCore, its settings and the scene's. The vertices of meshes
        made in memory are not among them."""
        def crc(lines: Iterable[str]) -> str:
            return f"crc {zlib.crc32(chr(10).join(sorted(lines)).encode()):08x}"
        settings = [t for t in str(self._properties).splitlines() if not t.startswith((*_OWN, "native.", "screen."))]
        # ids that nobody gave are random
        scene = [t for t in str(self.scene.ToProperties()).splitlines() if ".id = " not in t]
        return {"renderer": f"LuxCore {self._lux.Version()}", "settings": crc(settings), "scene": crc(scene)}

    def render(self, rects: Sequence[Rect], first: int, count: int, _half: bool) -> Iterator[dict[str, np.ndarray]]:
        """The driver's render function: for each rectangle the mean of `count` samples times their weight, by plane."""
        for r in rects:
            self._run(self._properties_of(r, first, count))
            at = np.s_[self.height - r.y1:self.height - r.y0, r.x0:r.x1]  # LuxCore's rows start at the bottom
            weight = self._counts[at][::-1] / count
            planes = {name: plane[at][::-1].astype(np.float64) for name, plane in self._planes.items()}
            yield {"weight": weight, **{name: (plane.T * weight.T).T for name, plane in planes.items()}}

    def _properties_of(self, r: Rect, first: int, count: int) -> Any:
        lux, made = self._lux, self._lux.Properties()
        made.SetFromString("".join(f"{t}\n" for t in str(self._properties).splitlines() if not t.startswith(_OWN)))
        sampler = (self._setting("sampler.type") or "SOBOL").lower()
        own = {"renderengine.type": "PATHCPU", "renderengine.seed": 1 + scenes.seed_of(self.seed, first, r) % 0x7fffffff,
               "film.filter.type": "NONE", "film.subregion": [r.x0, r.x1 - 1, self.height - r.y1, self.height - 1 - r.y0],
               "batch.haltspp": count, f"sampler.{sampler}.adaptive.strength": 0.0}
        for i, name in enumerate(("SAMPLECOUNT", *(output for output, _ in _OUTPUTS.values()))):
            own |= {f"film.outputs.{i}.type": name, f"film.outputs.{i}.filename": "never.exr"}
        for name, value in own.items():
            made.Set(lux.Property(name, value if isinstance(value, list) else [value]))
        return made

    def _run(self, properties: Any) -> None:
        """One session; its outputs are then in the film's arrays, rows from the bottom."""
        config = self._lux.RenderConfig(properties, self.scene)
        session = self._lux.RenderSession(config)
        session.Start()
        try:
            while not session.HasDone():
                time.sleep(_POLL_S)
                session.UpdateStats()
        finally:
            session.Stop()
        film, types = session.GetFilm(), self._lux.FilmOutputType
        film.GetOutputUInt(types.SAMPLECOUNT, self._counts, 0, False)
        for name, (output, _) in _OUTPUTS.items():
            film.GetOutputFloat(getattr(types, output), self._planes[name], 0, False)


def _no_mask(path: str) -> np.ndarray:
    raise ValueError(f"mask {path}: LuxCore reads no pictures for others: give an array")


def quote(scene: Any, settings: Any, criterion: Union[str, Criterion] = "", **more: Any) -> str:
    """What the quality parameter will cost (lull.scenes.quote). more: as render takes it."""
    return scenes.quote(functools.partial(render, scene, settings), criterion, more)


def render(scene: Any, settings: Any, criterion: Union[str, Criterion] = "", *, seed: int = 0, wave: int = 16,
           denoise: str = "", **more: Any) -> Picture:
    """Renders a pyluxcore.Scene by settings, pyluxcore.Properties of the film, the paths and the sampler; each block until
    the criterion stops it. The film's subregion is kept to. more: as lull.scenes.render takes it (limits, mask as an array,
    checkpoint, resume, the criterion's parameters …), which also says what is raised."""
    return scenes.render(lambda: Film(scene, settings, seed), criterion, seed=seed, wave=wave, denoise=denoise,
                         read_mask=_no_mask, **more)
