# SPDX-License-Identifier: MIT
"""One frame of a Blender scene rendered by blocks, with what it leaves behind. Used by the command line and the operator."""
from __future__ import annotations

import os
import time
import zlib
from dataclasses import dataclass, field, replace
from typing import Any, Callable, Optional, Sequence

import bpy
import numpy as np

from .. import checkpoint, denoising, exr, outputs, quote
from ..criterion import Criterion, load
from ..driver import Driver, Result
from ..files import Output, check_outputs, write_each
from ..frame import Frame
from ..library import LullError, encoded
from ..version import SOFTWARE
from . import shown
from .cycles import WAVE, Cycles, HostError
from .view import display_of, is_plain, read_grey, view_text

# What a session raises for a scene or for settings that cannot be, one line for people
REFUSED = (HostError, LullError, ValueError, OSError, RuntimeError)

# Blender's own output path, which nobody has chosen
_UNSET = ("", "/tmp/", "/tmp\\")


@dataclass
class Settings:
    """What a user chooses for a frame. Files: "" = not written."""
    criterion: str = ""  # "": observer, or what judges the denoised picture
    parameters: dict[str, Any] = field(default_factory=dict)
    spp_min: int = 16
    spp_max: Optional[int] = None  # None: the scene's Max Samples
    time_budget_s: Optional[float] = None  # None: the scene's Time Limit
    block: Optional[int] = None  # pixels; None: the criterion's own size
    mask: str = ""
    output: str = ""
    preview: str = ""
    stop_map: str = ""
    report: str = ""
    page: str = ""
    checkpoint: str = ""
    display_server: str = ""  # "HOST" or "HOST:PORT" of an image viewer; "": none
    denoise: str = ""  # of lull.denoising.KINDS; "": the noisy picture is kept
    view_layer: str = ""  # "": the first that is used

    def __post_init__(self) -> None:
        self.criterion = self.criterion or denoising.criterion_of(self.denoise)
        self.parameters = denoising.parameters_of(self.denoise, self.criterion, self.parameters)

    def numbered(self, frame: Optional[int]) -> Settings:
        """The same with the frame's number before the ending of every file."""
        if frame is None:
            return self
        names = ("output", "preview", "stop_map", "report", "page", "checkpoint")
        files: dict[str, Any] = {name: _numbered(getattr(self, name), f"_{frame:04}") for name in names}
        return replace(self, **files)

    def outputs(self) -> list[Output]:
        """The files, each with the option that names it and its endings."""
        return [Output("--output", self.output, (".exr",)), Output("--preview", self.preview, (".png",)),
                Output("--stop-map", self.stop_map, (".png", ".csv")), Output("--report", self.report, (".json",)),
                Output("--html", self.page, (".html", ".htm")), Output("--checkpoint", self.checkpoint)]


def _numbered(path: str, suffix: str) -> str:
    base, ending = os.path.splitext(path)
    return base + suffix + ending if path else ""


def scene_output(scene: bpy.types.Scene, frame: Optional[int] = None) -> str:
    """Where Blender would write this frame, as an EXR; "" if the scene names no place of its own."""
    render, frame = scene.render, scene.frame_current if frame is None else frame
    if render.filepath in _UNSET:
        return ""
    path = bpy.path.abspath(render.frame_path(frame=frame))
    if render.file_extension and path.lower().endswith(render.file_extension):
        path = path[:-len(render.file_extension)]
    return f"{path}_{frame:04}.exr" if render.is_movie_format else f"{path}.exr"


def default_output(scene: bpy.types.Scene, frame: Optional[int], otherwise: str) -> str:
    """The picture's name when nobody gave one: what the scene says, else `otherwise`. ValueError if another program's
    picture is there."""
    path = scene_output(scene, frame)
    if path:
        os.makedirs(os.path.dirname(path), exist_ok=True)  # as Blender does
    else:
        path = otherwise if frame is None else _numbered(otherwise, f"_{frame:04}")
    if not outputs.is_ours(path):
        raise ValueError(f"{path}: another program's image would be replaced; -o FILE.exr names the output")
    return path


def scene_inputs() -> list[str]:
    """The files that the open scene is read from; not what the add-on shows of the render before."""
    paths = [bpy.data.filepath, *bpy.utils.blend_paths(absolute=True, packed=False, local=False)]
    for image in filter(None, map(bpy.data.images.get, (shown.PICTURE, shown.STOP_MAP))):
        if (path := bpy.path.abspath(image.filepath)) in paths:
            paths.remove(path)  # once: another image may read the same file
    return sorted({os.path.realpath(p) for p in paths if p and os.path.isfile(encoded(p))})


def check_files(frames: Sequence[Settings], criterion: Criterion) -> None:
    """Before anything is rendered: OSError or ValueError for what cannot be written, or must not be."""
    first = frames[0]
    inputs = [*scene_inputs(), first.mask, criterion.info.path, *first.parameters.values()]
    for settings in frames:
        check_outputs(settings.outputs(), [path for path in inputs if path])
    for path in {s.checkpoint for s in frames} - {""}:
        checkpoint.check(path)


def _identity(scene: bpy.types.Scene, host: Cycles) -> dict[str, str]:
    """What the samples depend on beside the frame's own settings, for the checkpoint."""
    crc = 0
    for path in scene_inputs():
        with open(encoded(path), "rb") as file:
            while data := file.read(1 << 20):
                crc = zlib.crc32(data, crc)
    camera, view = scene.camera, zlib.crc32(np.array(scene.camera.matrix_world, "<f4").tobytes())
    return {"files": f"{os.path.basename(bpy.data.filepath) or 'unsaved'} {crc:08x}", "scene": scene.name,
            "frame": str(scene.frame_current), "camera": f"{camera.name} {view:08x}", "view": view_text(scene),
            "view-layer": host.layer.name, "film": "transparent" if scene.render.film_transparent else "opaque",
            "pattern": host.pattern, "seeds": f"{host.seeds[1]} {host.seeds[0]}", "device": host.device(),
            "renderer": f"Blender {bpy.app.version_string} {bpy.app.build_hash.decode(errors='replace')}"}


class Session:
    """The frame that the scene is at, in the making. Use as a context manager; call step() until it returns a result.

    notes: lines for people about what is done otherwise than the scene says. quote: what the quality parameter
    costs and what coarser ones would, one line, "" before the first check.
    """

    def __init__(self, scene: bpy.types.Scene, settings: Settings, criterion: Optional[Criterion] = None,
                 after_call: Optional[Callable[[Driver], None]] = None):
        self.scene, self.settings = scene, settings
        self._own = None if criterion else load(settings.criterion, **settings.parameters)
        judge = criterion or self._own
        assert judge is not None
        spp_max = scene.cycles.samples if settings.spp_max is None else settings.spp_max
        time_s = scene.cycles.time_limit if settings.time_budget_s is None else settings.time_budget_s
        self.denoised: Optional[denoising.Denoised] = None  # at the end
        if settings.denoise:
            denoising.check(settings.parameters.get("library", ""))
        self.host = Cycles(scene, spp_max, bool(settings.denoise), settings.view_layer)
        self.notes = self.host.notes
        exposure, display = 2.0 ** scene.view_settings.exposure if is_plain(scene) else 1.0, display_of(scene)
        self.host.__enter__()
        try:
            self.frame = Frame(judge, self.host.width, self.host.height, wave=WAVE, block=settings.block, crop=self.host.crop,
                               layers=self.host.passes.names, spp_max=spp_max, time_budget_s=time_s,
                               deterministic=time_s <= 0, denoised=bool(settings.denoise),
                               supplies=("albedo", "normal") if settings.denoise else (),
                               spp_min=min(settings.spp_min, spp_max) if settings.spp_max is None else settings.spp_min,
                               mask=read_grey(settings.mask) if settings.mask else None, seed=scene.cycles.seed,
                               exposure=exposure, display=display)
            self.driver = Driver(self.frame, self.host.render, threads=self.host.threads, after_call=after_call,
                                 display_server=settings.display_server,
                                 identity=_identity(scene, self.host) if settings.checkpoint else None)
        except BaseException:
            self.host.__exit__()
            raise
        self._setup_s, self._denoising_s = self.host.render_s, 0.0
        self._before = (0.0, 0.0)  # seconds of rendering and of checks that a checkpoint brought
        self.quote = ""
        self.driver.watchers.append(quote.once_quoted(lambda line: setattr(self, "quote", line)))
        self.keeper: Optional[checkpoint.Keeper] = None

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.host.__exit__()
        self.frame.close()
        if self._own:
            self._own.close()

    # --- rendering -----------------------------------------------------------------------------------------------------

    def begin(self, resume: bool = False, every_s: float = 60.0) -> None:
        """Goes on from the checkpoint, if it is there; keeps it from now on. every_s 0: after every step."""
        state = self.settings.checkpoint
        if state and resume and os.path.exists(encoded(state)):
            checkpoint.load(state, self.driver)
            self.host.passes.remember(self.frame)
            self._before = (self.driver.totals.render_s, self.driver.totals.criterion_s)
        if state:
            self.keeper = checkpoint.Keeper(state, self.driver, every_s or 1e-9)

    @property
    def unsaved(self) -> Optional[OSError]:
        """Why the checkpoint could not be written, if so."""
        return self.keeper.unsaved if self.keeper else None

    def step(self) -> Optional[Result]:
        """One call of the renderer or one round of checks; the end, or None."""
        return self.driver.step()

    def summary(self) -> str:
        """One line about the finished frame."""
        blocks = self.frame.blocks
        converged = sum(b.reason == "criterion" for b in blocks)
        counts = sorted(b.spp for b in blocks)
        mean = self.driver.totals.samples / self.frame.view.pixels
        line = f"{converged} of {len(blocks)} blocks converged, {counts[0]}..{counts[-1]} spp, mean {mean:.0f}"
        return f"{line}; denoised, {self.denoised.weight.mean():.0%} is the noisy picture" if self.denoised else line

    def phases(self) -> dict[str, float]:
        """What the wall seconds of this session went to: samples, inside Cycles; synchronisation, all else of Blender's
        renders; copies of their pixels; looks of the criterion; denoising, of the picture."""
        host, totals = self.host, self.driver.totals
        rendered_s, looks_s = totals.render_s - self._before[0], totals.criterion_s - self._before[1]
        return {"samples": host.samples_s, "synchronisation": max(0.0, host.render_s - host.samples_s),
                "copies": max(0.0, rendered_s - (host.render_s - self._setup_s)), "looks": looks_s,
                **({"denoising": self._denoising_s} if self.settings.denoise else {})}

    def write(self, result: Result) -> tuple[list[str], list[str]]:
        """Denoises the picture if that is asked for, and writes the files of the settings. Returns their names, and a line
        for each that could not be written."""
        begin_s = time.monotonic()
        failed = self._denoise()
        self._denoising_s = time.monotonic() - begin_s
        self.driver.phases = self.phases()
        s, scene = self.settings, bpy.data.filepath or self.scene.name
        kernel = f"Cycles, Blender {bpy.app.version_string}"
        interrupted = result.outcome in ("interrupt", "failed")
        kept = self.denoised
        written, unwritten = write_each((
            (s.output, lambda p: outputs.write_exr(p, self.driver, scene, f"{SOFTWARE}; {kernel}",
                                                    self.host.passes.finished(self.frame, self._rgb()), kept)),
            (s.preview, lambda p: outputs.write_preview(p, self.driver, kept)),
            (s.stop_map, lambda p: outputs.write_stop_map(p, self.frame, scene)),
            (s.report, lambda p: outputs.write_report(p, self.driver, scene, kernel, interrupted, s.mask or None, kept)),
            (s.page, lambda p: outputs.write_page(p, self.driver, scene, kernel, interrupted, s.mask or None, kept))))
        return written, failed + unwritten

    def write_layer(self, path: str, samples: str) -> None:
        """What there is of the view layer, in an EXR that a render result of Blender's takes as it is: its passes, and one with
        the name `samples` for samples per pixel."""
        frame, own, name = self.frame, self.host.passes.prefix, self.host.layer.name
        planes = {**{layer: frame.mean(layer) for layer in frame.layers}, **self.host.passes.finished(frame, self._rgb()),
                  f"{own}.{samples}.X": frame.spp()}
        exr.write(path, {name + channel.removeprefix(own): frame.cropped(plane) for channel, plane in planes.items()
                         if channel.startswith(own) and plane is not None}, (frame.width, frame.height), frame.crop[:2])

    def _rgb(self) -> np.ndarray:
        return self.denoised.picture if self.denoised else self.frame.mean()

    def _denoise(self) -> list[str]:
        """A line if that failed."""
        s = self.settings
        try:
            if s.denoise:
                self.denoised = denoising.denoise(self.frame, full=s.denoise == "full", threads=self.host.threads,
                                                  library=s.parameters.get("library", ""))
        except LullError as error:
            return [f"the picture is the noisy one: {error}"]
        return []
