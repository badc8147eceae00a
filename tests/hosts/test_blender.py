"""Blender's Cycles as a host; run inside Blender or by a Python with the module bpy. BUILD names the build folder."""
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "plugin-api" / "python"), str(ROOT / "tests" / "hosts")]

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import lull  # noqa: E402
import tap  # noqa: E402
from lull import Rect, exr, png  # noqa: E402
from lull.blender import cli, view  # noqa: E402
from lull.blender.cycles import Cycles, HostError  # noqa: E402
from lull.blender.session import Session, Settings  # noqa: E402
from tap import Skip, raises  # noqa: E402

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


def one_render(scene, spp, spp_max=4096):
    """The whole picture by a single call."""
    with Cycles(scene, spp_max) as host:
        return next(iter(host.render([Rect(0, 0, host.width, host.height)], 0, spp, False)))


def command(*arguments, **named):
    """Runs the command line in this process: its status and its error text."""
    import contextlib
    import io
    error = io.StringIO()
    with contextlib.redirect_stderr(error):
        status = cli.main(list(arguments))
    return status, error.getvalue()


def test_same_picture():
    """blocks and waves add up to one Cycles render with the same samples"""
    scene = cube()
    with Session(scene, Settings("fixed", {"spp": "40"}, block=24)) as session:
        assert session.driver.run().outcome == "done" and len(session.frame.blocks) == 6
        mean = session.frame.mean()
    assert {b.spp for b in session.frame.blocks} == {64}
    whole = one_render(scene, 64)
    assert whole.std() > .01 and abs(mean - whole).max() < SAME * whole.max(), abs(mean - whole).max()


def test_borders():
    """any border holds the pixels of the whole picture, whatever the rounding"""
    for width, height in ((53, 31), (97, 64), (101, 77)):
        scene = cube(width, height)
        whole = one_render(scene, 1)
        rng = np.random.default_rng(width)
        with Cycles(scene, 4096) as host:
            for _ in range(12):
                x0, x1 = sorted(rng.choice(width + 1, 2, False).tolist())
                y0, y1 = sorted(rng.choice(height + 1, 2, False).tolist())
                part = next(iter(host.render([Rect(x0, y0, x1, y1)], 0, 1, False)))
                assert (part == whole[y0:y1, x0:x1]).all(), (width, height, x0, y0, x1, y1)


def test_restored():
    """every setting is put back, also after a failure"""
    scene = cube()

    def all_settings():
        owners = (scene.render, scene.render.image_settings, scene.cycles, *scene.view_layers)
        names = [(o, n) for o in owners for n in dir(o) if isinstance(getattr(o, n), (bool, int, float, str))]
        return {(str(type(o)), n): getattr(o, n) for o, n in names}
    before = all_settings()
    with Cycles(scene, 4):
        assert all_settings() != before
    after = all_settings()
    assert after == before, {n: (before[n], after[n]) for n in before if before[n] != after[n]}
    try:
        with Cycles(scene, 4):
            raise KeyError
    except KeyError:
        pass
    assert all_settings() == before


def test_region():
    """the scene's own render region is the crop: its blocks are rendered whole, the file holds the region"""
    scene = cube()
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = .4, .5, .5, .9
    with Session(scene, Settings("fixed", {"spp": "16"}, block=24, output=tmp("r.exr"))) as session:
        result = session.driver.run()
        session.write(result)
        assert session.frame.crop == Rect(28, 5, 35, 23) and session.frame.view == Rect(24, 0, 48, 24)
        mean = session.frame.cropped(session.frame.mean())
    subprocess.run(["oiiotool", tmp("r.exr"), "--compression", "none", "-o", tmp("s.exr")], check=True)
    pixels, origin = exr.read(tmp("s.exr"))
    assert origin == (28, 5) and abs(pixels - mean).max() < 1e-6
    render.use_border = False
    assert abs(one_render(scene, 32)[5:23, 28:35] - mean).max() < SAME * 10  # two waves: the first check


def test_animation():
    """the command renders frames of an animation, with the same dial, into numbered files"""
    cube()
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    status, text = command(tmp("cube.blend"), "-c", "halfbuf", "-p", "threshold=.02", "--frames", "1-2", "--block", "24",
                           "-q", "--spp-max", "64", "-o", tmp("f.exr"), "--preview", tmp("f.png"), "--stop-map", tmp("f-map.png"),
                           "--report", tmp("f.json"))
    assert status == 0 and not text, text
    first, second = (png.read_grey(tmp(f"f_000{k}.png")) for k in (1, 2))
    assert abs(first - second).max() > .05
    report = json.loads(Path(tmp("f_0002.json")).read_text())
    assert report["kernel"].startswith("Cycles") and report["criterion"]["params"]["threshold"] == ".02"
    assert all(os.path.getsize(tmp(f"f{ending}")) > 100 for ending in ("_0001.exr", "_0002.exr", "-map_0001.png"))


def test_bad_input():
    """what cannot be rendered is said in one line, status 2, and nothing is written"""
    cube()
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    scene = cube()
    scene.camera = None
    bpy.ops.wm.save_as_mainfile(filepath=tmp("blind.blend"))
    png.write(tmp("mask.png"), np.zeros((4, 4, 3), np.uint8))
    out = tmp("bad.exr")
    for arguments, wanted in (([tmp("blind.blend")], "no camera"),
                              ([tmp("cube.blend"), "-c", "nobody"], "no criterion 'nobody'"),
                              ([tmp("cube.blend"), "-c", "/none.so"], "no such file"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "-p", "x"], "KEY=VALUE"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "-p", "x=1"], "no parameter 'x'"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--mask", tmp("mask.png")], "mask of shape (4, 4)"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--mask", tmp("none.png")], "none.png"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--frames", "b-a"], "--frames"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--scene", "None"], "--scene"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--spp-min", "9", "--spp-max", "3"], "spp_min"),
                              ([tmp("none.blend")], "none.blend")):
        status, text = command(*arguments, "-o", out, "-q")
        assert status == 2 and wanted in text and len(text.strip().splitlines()) == 1, (arguments, status, text)
        assert not os.path.exists(out)


def test_no_cycles():
    """without Cycles, with stereo views or without a view layer the host says so"""
    scene = cube()
    raises(HostError, "Cycles is not available", Cycles, type("Scene", (), {"name": "x"})(), 4)
    scene.render.use_multiview = True
    raises(HostError, "stereoscopy", Cycles, scene, 4)
    scene.render.use_multiview = False
    scene.view_layers[0].use = False
    raises(HostError, "no view layer", Cycles, scene, 4)


def test_interrupt():
    """Ctrl-C keeps what is there, status 1"""
    cube(200, 160)
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    timer = threading.Timer(1.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    status, _ = command(tmp("cube.blend"), "-c", "null", "--spp-max", "100000", "-o", tmp("i.exr"), "--report",
                        tmp("i.json"), "-q")
    timer.cancel()
    report = json.loads(Path(tmp("i.json")).read_text())
    assert status == 1 and report["interrupted"] and {b["reason"] for b in report["blocks"]} == {"interrupt"}
    assert 0 < report["blocks"][0]["spp"] < 100000 and os.path.getsize(tmp("i.exr")) > 1000


def test_failing_render():
    """a wave that Cycles cannot render ends the run and keeps what is there"""
    scene = cube()
    with Session(scene, Settings("null", spp_max=256, block=24, output=tmp("k.exr"))) as session:
        session.driver.after_call = lambda d: setattr(scene, "camera", None)
        result = session.driver.run()
        written = session.write(result)
    assert result.outcome == "failed" and "camera" in str(result.exception) and written == [tmp("k.exr")]
    assert session.frame.blocks[0].spp == 16 and session.frame.mean().max() > 0


def test_view():
    """the criterion judges what the view shows"""
    scene = cube()
    scene.view_settings.view_transform = "Standard"
    assert view.display_of(scene) is None
    scene.view_settings.exposure = 1.0
    assert view.display_of(scene) is None
    scene.view_settings.gamma = 1.3
    shown, linear = view.display_of(scene), np.linspace(0, 1.2, 50)
    assert abs(shown(linear) - np.clip(2 * linear, 0, 1) ** (1 / 1.3)).max() < .02
    scene.view_settings.gamma = 1.0
    scene.view_settings.view_transform = "Filmic" if bpy.app.version < (4, 0) else "AgX"
    shown = view.display_of(scene)
    values = shown(np.array([0., .01, .18, 1., 4., 100.]))
    assert (np.diff(values) > 0).all() and values[0] < .001 and values[3] < .9 and values[5] > .9, values


def test_addon():
    """the package is an add-on: it installs from a zip, its operator renders, its panel is there"""
    if not bpy.app.background or not hasattr(bpy.ops.preferences, "addon_install"):
        raise Skip("no preferences")
    subprocess.run([ROOT / "scripts/hosts/blender-addon", tmp("lull.zip")], check=True)
    scene = cube()
    lull.register()
    try:
        scene.lull.criterion, scene.lull.block, scene.lull.folder = "halfbuf", 24, TMP.name
        scene.lull.parameters, scene.lull.spp_max = "threshold=.02", 64
        assert bpy.ops.lull.render() == {"FINISHED"} and "blocks converged" in scene.lull.state
        assert "Lull Stop Map" in bpy.data.images and os.path.getsize(tmp("lull.exr")) > 1000
        scene.lull.parameters = "threshold"
        try:
            raise AssertionError(bpy.ops.lull.render())
        except RuntimeError as error:
            assert "expected KEY=VALUE" in str(error)
    finally:
        lull.unregister()
    code = ("import bpy; bpy.ops.preferences.addon_install(filepath=%r); bpy.ops.preferences.addon_enable(module='lull'); "
            "print('ADDON', hasattr(bpy.types.Scene, 'lull'))" % tmp("lull.zip"))
    if bpy.app.binary_path:
        out = subprocess.run([bpy.app.binary_path, "-b", "--factory-startup", "-noaudio", "--python-expr", code], text=True,
                             env={**os.environ, "BLENDER_USER_SCRIPTS": TMP.name}, capture_output=True).stdout
        assert "ADDON True" in out, out


tap.main(dict(globals()))
