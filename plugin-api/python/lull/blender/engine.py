# SPDX-License-Identifier: MIT
"""Blender's own Render button (F12): the engine *Lull (Cycles)*. In viewports, previews and bakes it is Cycles itself. A final
picture is rendered by a process of its own, from a copy of the file (lull.blender.child), since Cycles cannot be asked for waves
from within a render."""
from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Iterator, Optional

import bpy

from .child import PICTURE, SAMPLES, SCENE, TASK
from .passes import summed
from .session import REFUSED

try:
    from cycles import CyclesRender
    from cycles.engine import free, list_render_passes
except ImportError:  # a Blender without Cycles, whose panel says nothing either
    CyclesRender = None

_END_S = 60.0  # what is left to the process for an end after Esc: a wave, and the denoiser


def _program() -> list[str]:
    """What runs a line of Python with bpy: this Blender without a window, or the Python that has the module."""
    if not bpy.app.binary_path:
        return [sys.executable, "-c"]
    factory = ["--factory-startup"] if bpy.app.factory_startup else []
    return [bpy.app.binary_path, "-b", *factory, "-noaudio", "--python-exit-code", "2", "--python-expr"]


class Child:
    """The process; a context manager, at whose end it is gone. error: why it failed, one line, "" until then."""

    def __init__(self, folder: str):
        package = str(Path(__file__).resolve().parents[2])  # last: what else lies there is of another Python
        self._messages, write_end = os.pipe()
        code = (f"import sys; sys.path.append({package!r}); from lull.blender import child; "
                f"sys.exit(child.main({folder!r}, {write_end}))")
        self._errors = tempfile.TemporaryFile(dir=folder)
        try:
            self._process = subprocess.Popen([*_program(), code], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                             stderr=self._errors, pass_fds=[write_end], start_new_session=True)
        except BaseException:
            os.close(self._messages)
            raise
        finally:
            os.close(write_end)
        self._kill_at_s = 0.0
        self.error = ""

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._messages)
        self._errors.close()

    def messages(self) -> Iterator[dict[str, Any]]:
        """What it says, until it ends; an empty message each tenth of a second in which it says nothing."""
        unread, poll = b"", select.poll()
        poll.register(self._messages, select.POLLIN)
        while True:
            if not poll.poll(100):
                yield {}
                continue
            data = os.read(self._messages, 1 << 16)
            if not data:
                break
            *lines, unread = (unread + data).split(b"\n")
            yield from map(json.loads, lines)
        status = self._process.wait()
        if status and not self._kill_at_s:
            self._errors.seek(0)
            lines = self._errors.read().decode(errors="replace").split("\n")
            last = next((line for line in reversed(lines) if line.strip()), "no message")
            self.error = self.error or f"the process that renders ended with status {status}: {last.strip()}"

    def stop(self) -> None:
        """Asks it for an end, which keeps what is there; as often as one likes."""
        now_s = time.monotonic()
        if not self._kill_at_s:
            self._kill_at_s = now_s + _END_S
            self._process.terminate()
        elif now_s > self._kill_at_s:
            self._process.kill()


def save(folder: str, scene: bpy.types.Scene, view_layer: str) -> None:
    """What the process needs: a copy of the file as it is now, which stays as it is, and what is asked for."""
    scripts = (bpy.context.preferences.filepaths.use_scripts_auto_execute or
               not {"-y", "--enable-autoexec"}.isdisjoint(sys.argv))
    with open(os.path.join(folder, TASK), "w", encoding="utf-8") as file:
        json.dump({"scene": scene.name, "settings": asdict(replace(scene.lull.wanted(), view_layer=view_layer)),
                   "threads": scene.render.threads, "scripts": scripts}, file)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, SCENE), copy=True, check_existing=False)


class LullRender(bpy.types.RenderEngine):  # not a CyclesRender, in whose place Blender would put it
    """Cycles, each block until its noise can no longer be seen"""
    bl_idname, bl_label = "LULL", "Lull (Cycles)"
    bl_use_eevee_viewport = bl_use_preview = bl_use_exclude_layers = bl_use_custom_freestyle = True  # as Cycles
    session = None  # of Cycles

    def __del__(self) -> None:
        if self.session:
            free(self)

    def update(self, data: bpy.types.BlendData, depsgraph: bpy.types.Depsgraph) -> None:
        """Cycles gets the scene for a preview only."""
        if self.is_preview:
            CyclesRender.update(self, data, depsgraph)

    def bake(self, depsgraph: bpy.types.Depsgraph, thing: bpy.types.Object, kind: str, parts: int, width: int, height: int) -> None:
        """By Cycles."""
        CyclesRender.update(self, bpy.data, depsgraph)
        CyclesRender.bake(self, depsgraph, thing, kind, parts, width, height)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """By Cycles."""
        CyclesRender.view_update(self, context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """By Cycles."""
        CyclesRender.view_draw(self, context, depsgraph)

    def update_script_node(self, node: bpy.types.Node) -> None:
        """By Cycles."""
        CyclesRender.update_script_node(self, node)

    def update_custom_camera(self, camera: bpy.types.Camera) -> None:
        """By Cycles, since 5.0."""
        CyclesRender.update_custom_camera(self, camera)

    def update_render_passes(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
        """Those of Cycles that waves can be summed for, and the samples."""
        for name, channels, kind in [*list_render_passes(scene, view_layer), (SAMPLES, "X", "VALUE")]:
            if summed(name):
                self.register_pass(scene, view_layer, name, len(channels), channels, kind)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """A view layer of a frame."""
        if self.is_preview:
            CyclesRender.render(self, depsgraph)
            return
        if lost := [image.name for image in bpy.data.images if image.is_dirty and image.source == "FILE"]:
            self.report({"WARNING"}, f"painted and not saved, so rendered as before: {', '.join(lost)}")
        scene, view_layer = bpy.data.scenes[depsgraph.scene.name], depsgraph.view_layer_eval.name
        try:
            with tempfile.TemporaryDirectory(prefix="lull-", dir=bpy.app.tempdir or None) as folder:
                save(folder, scene, view_layer)
                with Child(folder) as child:
                    self._follow(child, os.path.join(folder, PICTURE), view_layer)
        except REFUSED as error:
            self.report({"ERROR"}, str(error))
        except KeyboardInterrupt:  # with the module bpy; Blender itself makes a break of it
            self.report({"ERROR"}, "interrupted")

    def _follow(self, child: Child, picture: str, view_layer: str) -> None:
        """Shows what the child says until it ends."""
        result = self.begin_result(0, 0, self.resolution_x, self.resolution_y, layer=view_layer)
        self.update_stats("", "Lull: starting")
        try:
            for message in child.messages():
                if self.test_break():
                    child.stop()
                self._show(message, result, picture)
                child.error = message.get("error", child.error)
        finally:
            self.end_result(result)
        if child.error:
            self.report({"ERROR"}, child.error)

    def _show(self, message: dict[str, Any], result: bpy.types.RenderResult, picture: str) -> None:
        if "text" in message:
            self.update_stats("", f"Lull: {message['text']}")
            self.update_progress(message["percent"] / 100)
        if "picture" in message:
            result.load_from_file(picture)
            self.update_result(result)
        for kind in {"info", "warning"} & message.keys():
            self.report({kind.upper()}, message[kind])


def _panels() -> Iterator[set[str]]:
    """The engines of every panel that Cycles has."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and "CYCLES" in engines:
            yield engines


def registered() -> Optional[type]:
    """The engine's class, this one or that of another copy of the package, if Blender knows it."""
    return bpy.types.RenderEngine.bl_rna_get_subclass_py(LullRender.bl_idname)


def register() -> None:
    """Makes the engine known, if it is not, and shows Cycles' panels with it."""
    if not CyclesRender or registered():
        return
    bpy.utils.register_class(LullRender)
    for engines in _panels():
        engines.add(LullRender.bl_idname)


def unregister() -> None:
    """Takes it away again."""
    if registered() is not LullRender:
        return
    for engines in _panels():
        engines.discard(LullRender.bl_idname)
    bpy.utils.unregister_class(LullRender)
