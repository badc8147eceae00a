# SPDX-License-Identifier: MIT
"""One frame of a Blender scene rendered by blocks, with what it leaves behind. Used by the command line and the operator."""
from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any, Callable, Optional

import bpy

from .. import checkpoint, outputs, png, stopmap
from ..criterion import Criterion, load
from ..driver import Driver, Result
from ..frame import Frame
from .cycles import Cycles
from .view import display_of, is_plain


@dataclass
class Settings:
    """What a user chooses. Files are named without a frame number; "" = not written."""
    criterion: str = "observer"
    parameters: dict[str, str] = field(default_factory=dict)
    spp_min: int = 16
    spp_max: int = 4096
    time_budget_s: float = 0.0
    block: Optional[int] = None  # pixels; None: the criterion's own size
    wave: int = 16
    mask: str = ""
    output: str = ""
    preview: str = ""
    stop_map: str = ""
    report: str = ""


def numbered(path: str, suffix: str) -> str:
    """The file's name with a suffix before its ending."""
    base, ending = os.path.splitext(path)
    return base + suffix + ending


class Session:
    """The scene's current frame in the making. Use as a context manager; call run() or driver.step() inside.

    unsaved: why the checkpoint could not be written, if so.
    """

    def __init__(self, scene: bpy.types.Scene, settings: Settings, criterion: Optional[Criterion] = None,
                 after_call: Optional[Callable[[Driver], None]] = None):
        self.scene, self.settings = scene, settings
        parameters: dict[str, Any] = settings.parameters
        self._own = None if criterion else load(settings.criterion, **parameters)
        judge = criterion or self._own
        assert judge is not None
        self.host = Cycles(scene, settings.spp_max)
        exposure = 2.0 ** scene.view_settings.exposure if is_plain(scene) else 1.0
        self.frame = Frame(judge, self.host.width, self.host.height, block=settings.block,
                           crop=self.host.crop(), spp_min=settings.spp_min, spp_max=settings.spp_max,
                           time_budget_s=settings.time_budget_s, deterministic=settings.time_budget_s <= 0,
                           seed=scene.cycles.seed, exposure=exposure, display=display_of(scene),
                           mask=png.read_grey(settings.mask) if settings.mask else None)
        self.driver = Driver(self.frame, self.host.render, wave=settings.wave, threads=self.host.threads,
                             after_call=after_call)
        self.unsaved: Optional[OSError] = None

    def __enter__(self) -> Session:
        self.host.__enter__()
        return self

    def __exit__(self, *_) -> None:
        self.host.__exit__()
        self.frame.close()
        if self._own:
            self._own.close()

    def run(self, state: str = "", resume: bool = False) -> Result:
        """driver.run(), which keeps its state in the file `state`, and goes on from it if it is there; "" = no file."""
        if state and resume and os.path.exists(state):
            checkpoint.load(state, self.driver)
        if state:
            self.driver.suspend = lambda _: self._save(state)
        result = self.driver.run()
        if state and result.outcome == "done":
            self._save(state)
        return result

    def _save(self, state: str) -> None:
        """The picture is worth more than its checkpoint: an error is kept for later."""
        try:
            checkpoint.save(state, self.driver)
        except OSError as error:
            self.unsaved = error

    def write(self, result: Result, suffix: str = "") -> list[str]:
        """Writes the files of the settings; suffix: a frame's number. Returns their names."""
        s, scene = self.settings, bpy.data.filepath or self.scene.name
        kernel = f"Cycles, Blender {bpy.app.version_string}"
        interrupted = result.outcome in ("interrupt", "failed")
        writers = ((s.output, lambda p: outputs.write_exr(p, self.driver, scene, f"lull for Python 1.0; {kernel}")),
                   (s.preview, lambda p: outputs.write_preview(p, self.driver)),
                   (s.stop_map, lambda p: stopmap.write(p, self.frame.blocks, scene)),
                   (s.report, lambda p: outputs.write_report(p, self.driver, scene, kernel, interrupted,
                                                                       s.mask or None)))
        written = []
        for path, write in writers:
            if path:
                write(numbered(path, suffix))
                written.append(numbered(path, suffix))
        return written
