"""What the tests of the Blender host share: a small scene, the command line, faults. BUILD names the build folder."""
import contextlib
import io
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "plugin-api" / "python"), str(ROOT / "tests" / "hosts")]

import bpy  # noqa: E402

from lull import Rect, exr  # noqa: E402
from lull.blender import cli  # noqa: E402
from lull.blender.cycles import WAVE, Cycles  # noqa: E402
from lull.driver import in_half  # noqa: E402

os.environ["LULL_PLUGIN_PATH"] = str(ROOT / os.environ.get("BUILD", "build") / "lib" / "lull")
TMP = tempfile.TemporaryDirectory()
# Waves are read back as 32-bit floats and summed in double: what is left is the rounding of each wave's mean.
SAME = 2e-6


def tmp(name):
    return os.path.join(TMP.name, name)


def cube(width=70, height=46):
    """The default cube, which has moved a little by frame 2."""
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    box = bpy.data.objects["Cube"]
    for frame, angle in ((1, 0), (2, .5)):
        box.rotation_euler.z = angle
        box.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(1)
    return scene


def whole_picture(host, spp):
    """The whole picture by a single call for each half. With a session's own host, and hence with its ray tree: Blender 3.4 builds
    one for each host on several threads, not always the same one, and a ray through an edge may then meet the other face."""
    kept = [0, 0]
    for first in range(0, spp, WAVE):
        kept[in_half(first // WAVE)] += min(WAVE, spp - first)
    whole = [Rect(0, 0, host.width, host.height)]
    return sum(n * next(iter(host.render(whole, 0, n, half)))["color"].astype(float) for half, n in enumerate(kept) if n) / spp


def one_render(scene, spp):
    """The same with a host, and a tree, of its own: for the cube, whose few faces make one tree only."""
    with Cycles(scene, 4096) as host:
        return whole_picture(host, spp)


def command(*arguments, **named):
    """Runs the command line in this process: its status and its error text."""
    error = io.StringIO()
    with contextlib.redirect_stderr(error):
        status = cli.main(list(arguments))
    return status, error.getvalue()


class FolderGone:
    """A folder that goes away with the first wave."""

    def __init__(self, folder):
        self.folder = folder

    def __enter__(self):
        self.render = Cycles.render
        Cycles.render = lambda host, *arguments: (shutil.rmtree(self.folder, True), self.render(host, *arguments))[1]

    def __exit__(self, *_):
        Cycles.render = self.render


class NothingRendered:
    """Any wave is an error."""

    def __enter__(self):
        self.render, Cycles.render = Cycles.render, None

    def __exit__(self, *_):
        Cycles.render = self.render


def saved(scene, name):
    bpy.ops.wm.save_as_mainfile(filepath=tmp(name))
    return tmp(name)


def layers(path):
    """The channels of an EXR of ours, [h, w] float32."""
    subprocess.run(["oiiotool", path, "--compression", "none", "-o", tmp("layers.exr")], check=True)
    return exr.read(tmp("layers.exr"))[0]


def start(*arguments, **environment):
    """The package as a program of its own."""
    return subprocess.Popen([os.environ.get("PYTHON", sys.executable), "-m", "lull.blender", *arguments], text=True,
                            env={**os.environ, "PYTHONPATH": str(ROOT / "plugin-api/python"), **environment},
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
