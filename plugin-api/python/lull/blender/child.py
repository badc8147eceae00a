# SPDX-License-Identifier: MIT
"""The process in which the engine's pictures are rendered (lull.blender.engine): a copy of the file, which is its own.

Its folder holds scene.blend and task.json; picture.exr comes into it now and then, and at the end. What there is to say goes to
a file descriptor, a line of JSON each: text and percent of the progress, picture (there is a new one), info, warning, error.
"""
from __future__ import annotations

import json
import os
import shutil
import time

import bpy

from ..outputs import progress_text
from ..stopping import Stopping
from .session import REFUSED, Session, Settings

SCENE, TASK, PICTURE = "scene.blend", "task.json", "picture.exr"
SAMPLES = "Lull Samples"  # the pass of samples per pixel
_TELL_S = 0.5  # how often


class _Channel:
    """Messages to the parent process, and the picture."""

    def __init__(self, folder: str, descriptor: int):
        self._path, self._to = os.path.join(folder, PICTURE), os.fdopen(descriptor, "w")
        self._tell_at_s = self._show_at_s = 0.0

    def send(self, **message: object) -> None:
        print(json.dumps(message), file=self._to, flush=True)

    def show(self, session: Session) -> None:
        session.write_layer(self._path, SAMPLES)
        self.send(picture=True)

    def progress(self, session: Session) -> None:
        """Twice a second, and the picture for a twentieth of the time."""
        now_s = time.monotonic()
        if now_s >= self._tell_at_s:
            self.send(text=progress_text(session.driver).strip(), percent=session.driver.percent_shown)
            self._tell_at_s = now_s + _TELL_S
        if now_s >= self._show_at_s:
            self.show(session)
            self._show_at_s = time.monotonic() + max(1.0, 20 * (time.monotonic() - now_s))


def main(folder: str, descriptor: int) -> int:
    """The exit status: 0, or 1 after an error."""
    channel = _Channel(folder, descriptor)
    try:
        with Stopping() as stopping:
            return _render(folder, channel, stopping)
    except BrokenPipeError:  # nobody waits for it any more
        shutil.rmtree(folder, ignore_errors=True)
    except REFUSED as error:
        channel.send(error=str(error))
    return 1


def _open(folder: str) -> tuple[bpy.types.Scene, Settings]:
    with open(os.path.join(folder, TASK), encoding="utf-8") as file:
        task = json.load(file)
    bpy.ops.wm.open_mainfile(filepath=os.path.join(folder, SCENE), use_scripts=task["scripts"])
    scene = bpy.data.scenes[task["scene"]]
    scene.render.engine, scene.render.use_compositing = "CYCLES", False  # the compositor runs where the picture goes
    scene.render.threads_mode, scene.render.threads = "FIXED", task["threads"]
    return scene, Settings(**task["settings"])


def _render(folder: str, channel: _Channel, stopping: Stopping) -> int:
    scene, settings = _open(folder)
    with Session(scene, settings) as session:
        stopping.then = session.driver.interrupt
        if stopping.asked:
            session.driver.interrupt()
        for text in session.notes:
            channel.send(warning=text)
        quoted = ""
        while (result := session.step()) is None:
            if session.quote != quoted:
                quoted = session.quote
                channel.send(info=quoted)
            channel.progress(session)
        _, failed = session.write(result)  # no file: denoises the picture
        channel.show(session)
    channel.send(text=session.summary(), info=session.summary(), percent=100)
    if result.exception:
        failed.append(f"rendering failed, what was rendered is kept: {result.exception}")
    for text in failed:
        channel.send(error=text)
    return 1 if failed else 0
