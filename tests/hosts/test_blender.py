"""Blender's Cycles as a host; run inside Blender or by a Python with the module bpy. BUILD names the build folder."""
import contextlib
import dataclasses
import io
import json
import os
import runpy
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "plugin-api" / "python"), str(ROOT / "tests" / "hosts")]

import bpy  # noqa: E402
import numpy as np  # noqa: E402

import lull  # noqa: E402
import tap  # noqa: E402
from lull import Rect, checkpoint, exr, png  # noqa: E402
from lull.blender import cli, view  # noqa: E402
from lull.blender.cycles import Cycles, HostError  # noqa: E402
from lull.blender.session import Session, Settings, scene_output  # noqa: E402
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
    """The whole picture by a single call. spp_max as in the session: the tabulated pattern of new versions depends on it."""
    with Cycles(scene, spp_max) as host:
        return next(iter(host.render([Rect(0, 0, host.width, host.height)], 0, spp, False)))["color"]


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


def contents():
    return {p: p.read_bytes() for p in Path(TMP.name).rglob("*") if p.is_file()}


def start(*arguments, **environment):
    """The package as a program of its own."""
    return subprocess.Popen([os.environ.get("PYTHON", sys.executable), "-m", "lull.blender", *arguments], text=True,
                            env={**os.environ, "PYTHONPATH": str(ROOT / "plugin-api/python"), **environment},
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_lost_files():
    """what would cost the user a file is refused before the first wave: inputs, other kinds, one file for two outputs"""
    scene = cube(24, 24)
    png.write(tmp("wood.png"), np.full((24, 24, 3), 99, np.uint8))
    bpy.data.images.load(tmp("wood.png")).use_fake_user = True
    png.write(tmp("painted.png"), np.full((24, 24, 3), 99, np.uint8))
    blend = saved(scene, "keep.blend")
    for name, target in (("link.exr", "keep.blend"), ("way", "."), ("far.png", "new.png")):
        os.symlink(target, tmp(name))
    Path(tmp("text.npz")).write_text("a letter")
    before = contents()
    for arguments, wanted in ((["-o", blend], "ends in .exr"), (["--checkpoint", blend], "this is an input"),
                              (["--checkpoint", tmp("way/keep.blend")], "this is an input"),
                              (["-o", tmp("link.exr")], "this is an input"),
                              (["--mask", tmp("painted.png"), "--preview", tmp("painted.png")], "this is an input"),
                              (["--preview", tmp("wood.png")], "this is an input"),
                              (["-o", tmp("a.jpg"), "--report", tmp("a.jpg")], "ends in .exr"),
                              (["--preview", tmp("a.png"), "--stop-map", tmp("a.png")], "one of the two would be lost"),
                              (["--preview", tmp("a.png"), "--stop-map", tmp("way/a.png")], "one of the two would be lost"),
                              (["--preview", tmp("new.png"), "--stop-map", tmp("far.png")], "one of the two would be lost"),
                              (["-o", tmp("a.exr"), "--checkpoint", tmp("./a.exr")], "one of the two would be lost"),
                              (["-o", tmp("nowhere/a.exr")], "cannot write there: No such file"),
                              (["--frames", "1-2", "--report", tmp("nowhere/a.json")], "cannot write there: No such file"),
                              (["--checkpoint", tmp("text.npz")], "this is no checkpoint and would be replaced")):
        with NothingRendered():
            status, text = command(blend, "-c", "fixed", "-q", *arguments)
        assert status == 2 and wanted in text and text.count("\n") == 1, (arguments, status, text)
        assert contents() == before, arguments


def test_outputs_apart():
    """an output that cannot be written after all keeps no other from being written, and is kept elsewhere itself"""
    blend = saved(cube(24, 24), "apart.blend")
    os.mkdir(tmp("gone"))
    os.mkdir(tmp("spare"))
    tempfile.tempdir = tmp("spare")
    try:
        with FolderGone(tmp("gone")):
            status, text = command(blend, "-c", "fixed", "-q", "-o", tmp("gone/a.exr"), "--preview", tmp("apart.png"),
                                   "--report", tmp("apart.json"))
    finally:
        tempfile.tempdir = None
    kept = tmp(f"spare/lull-{os.getpid()}-a.exr")
    assert status == 2 and f"kept as {kept}" in text and exr.read_layers(kept)[0]["R"].shape == (24, 24), text
    assert os.path.getsize(tmp("apart.png")) > 50 and json.loads(Path(tmp("apart.json")).read_text())["blocks"]


def in_memory():
    """What lies in memory file systems."""
    with open("/proc/mounts") as mounts:
        folders = {line.split()[1] for line in mounts if line.split()[2] in ("tmpfs", "ramfs")} | {"/dev/shm"}
    return {os.path.join(folder, name) for folder in folders if os.access(folder, os.R_OK) for name in os.listdir(folder)
            if name.startswith(("lull", "wave", "blender"))}


def test_signals():
    """TERM, INT and HUP keep picture and checkpoint, status 130; kill -9 keeps the last checkpoint; nothing stays in memory"""
    blend = saved(cube(48, 24), "signals.blend")
    before = in_memory()
    common = (blend, "-c", "null", "--block", "24", "-q", "--checkpoint-every", "0")
    whole = start(*common, "--spp-max", "1600", "-o", tmp("whole.exr"))
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL):
        os.mkdir(tmp(f"tmp-{number}"))
        state, picture = tmp(f"{number}.npz"), tmp(f"{number}.exr")
        limit = "1600" if number == signal.SIGKILL else "10000000"
        run = start(*common, "--spp-max", limit, "-o", picture, "--checkpoint", state, TMPDIR=tmp(f"tmp-{number}"))
        while run.poll() is None and not os.path.exists(state):
            time.sleep(.01)
        run.send_signal(number)
        _, text = run.communicate()
        assert run.returncode == (-number if number == signal.SIGKILL else 130) and not text, (number, run.returncode, text)
        assert checkpoint.is_one(state) and os.path.exists(picture) == (number != signal.SIGKILL), number
        left = [p for p in Path(tmp(f"tmp-{number}")).rglob("*") if p.is_file() or number != signal.SIGKILL]
        assert not left and in_memory() <= before, (number, left, in_memory() - before)
    assert whole.wait() == 0
    assert start(*common, "--spp-max", "1600", "-o", picture, "--checkpoint", state, "--resume").wait() == 0
    assert Path(picture).read_bytes() == Path(tmp("whole.exr")).read_bytes()


def test_identity():
    """a checkpoint of another file, frame, camera, view or pattern is refused by name, and the pictures are not averaged"""
    def changed(change, name="other.blend"):
        scene = cube(24, 24)
        change(scene)
        return saved(scene, name)

    blend, state = changed(lambda s: None, "mine.blend"), tmp("mine.npz")
    common = ("-c", "null", "--spp-max", "32", "-q", "-o", tmp("id.exr"), "--checkpoint", state)
    assert command(blend, *common) == (0, "")
    kept = Path(state).read_bytes()

    def refused(wanted, path, *more):
        with NothingRendered():
            status, text = command(path, *common, "--resume", "--spp-max", "64", *more)
        assert status == 2 and f"its {wanted} is " in text and text.count("\n") == 1, (wanted, text)
        assert Path(state).read_bytes() == kept

    refused("files", changed(lambda s: setattr(bpy.data.objects["Light"].data, "energy", 1.)))
    for wanted, owner, name, value in (("view", "view_settings", "exposure", 1.), ("view", "view_settings", "look", "None"),
                                       ("seed", "cycles", "seed", 7)):
        scene = cube(24, 24)
        setattr(getattr(scene, owner), name, value)
        bpy.ops.wm.save_as_mainfile(filepath=blend)  # under the same name
        refused("files", blend)
    bpy.ops.wm.open_mainfile(filepath=changed(lambda s: None, "mine.blend"))


def test_identity_of_scene():
    """what the samples depend on is told apart without the file's help too"""
    def identity():
        with Session(bpy.context.scene, Settings("null", spp_max=16, checkpoint=tmp("x.npz"))) as session:
            return session.driver.identity

    scene = cube(24, 24)
    before = identity()
    bpy.data.objects["Camera"].location.x += .01
    bpy.context.view_layer.update()
    scene.view_settings.gamma, scene.cycles.seed = 1.25, 3
    scene.frame_current += 0
    after = identity()
    assert {n for n in before if before[n] != after[n]} >= {"camera", "view", "seed"}, after
    scene.frame_set(2)
    assert identity()["frame"] == "2" and {"files", "scene", "device", "renderer", "pattern", "view-layer"} <= after.keys()


def test_scene_defaults():
    """Max Samples, Time Limit and the output path are the scene's unless the command line says otherwise"""
    scene = cube(24, 24)
    scene.cycles.samples, scene.cycles.time_limit = 48, 100
    assert scene_output(scene) == ""
    with Session(scene, Settings("null")) as session:
        assert (session.frame.spp_max, session.frame.time_budget_s) == (48, 100)
    with Session(scene, Settings("null", spp_max=9, spp_min=1, time_budget_s=0)) as session:
        assert (session.frame.spp_max, session.frame.time_budget_s) == (9, 0)
    scene.render.filepath = "//shots/cube_"
    blend = saved(scene, "defaults.blend")
    assert command(blend, "-c", "null", "-q") == (0, "")
    assert (exr.read_layers(tmp("shots/cube_0001.exr"))[0]["lull.spp.V"] == 48).all()
    status, text = command(blend, "-c", "null", "-q", "--frames", "2-2", "--spp-max", "16")
    assert status == 0 and (exr.read_layers(tmp("shots/cube_0002.exr"))[0]["lull.spp.V"] == 16).all(), text
    Path(tmp("shots/cube_0001.exr")).write_text("another program's")
    status, text = command(blend, "-c", "null", "-q")
    assert status == 2 and "another program's image would be replaced" in text, text


def test_engine():
    """a scene that another engine renders is refused"""
    scene = cube(24, 24)
    scene.render.engine = "BLENDER_WORKBENCH"
    raises(HostError, "Workbench, not with Cycles", Cycles, scene, 4)
    eevee = "BLENDER_EEVEE_NEXT" if (4, 2) <= bpy.app.version < (5, 0) else "BLENDER_EEVEE"
    scene.render.engine = eevee
    blend = saved(scene, "eevee.blend")
    with NothingRendered():
        status, text = command(blend, "-c", "null", "-q", "-o", tmp("eevee.exr"))
    assert status == 2 and "not with Cycles" in text and not os.path.exists(tmp("eevee.exr")), text


def test_pattern():
    """the user's sampling pattern is kept where waves of it add up to one render; else it is switched, and told"""
    scene, kept = cube(24, 16), 0
    names = ("SOBOL", "PROGRESSIVE_MULTI_JITTER", "SOBOL_BURLEY", "TABULATED_SOBOL", "BLUE_NOISE", "AUTOMATIC")
    for name in names:
        try:
            scene.cycles.sampling_pattern = name
        except TypeError:
            continue  # another version's
        with Cycles(scene, 600) as host:
            own, notes = host.pattern == name, [n for n in host.notes if "pattern" in n]
            rect = [Rect(0, 0, 24, 16)]
            waves = [(0, 16), (16, 16), (32, 480), (512, 88)]
            mean = sum(n * next(iter(host.render(rect, first, n, False)))["color"].astype(float) for first, n in waves) / 600
            whole = next(iter(host.render(rect, 0, 600, False)))["color"]
        assert scene.cycles.sampling_pattern == name and own == (not notes), (name, notes)
        assert abs(mean - whole).max() < SAME * 10, (name, abs(mean - whole).max())
        assert own or "sampling pattern is Sobol-Burley instead of the scene's" in notes[0]
        kept += own
    assert kept > 0


def test_quote():
    """the dial's cost is told at the first check and by --quote, coarser ones too; a render goes on from the quote"""
    blend = saved(cube(48, 32), "quote.blend")
    common = (blend, "--block", "16", "--spp-max", "256", "--visible", ".2")
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        assert command(*common, "-q", "--quote", "--checkpoint", tmp("quote.npz")) == (0, "")
    table = output.getvalue().splitlines()
    assert "spp min / mean / max" in table[0] and [float(r.split()[0]) for r in table[1:]] == [.9, .5, .25, .2, .05], table
    assert "chosen" in table[4] and not os.path.exists("quote.exr")
    means = [float(r.split("/")[1].replace(",", "")) for r in table[1:]]
    assert means == sorted(means) and means[0] < means[-1], table
    assert command(*common, "-q", "--checkpoint", tmp("quote.npz"), "--resume", "-o", tmp("after.exr")) == (0, "")
    status, text = command(*common, "-o", tmp("plain.exr"))
    assert status == 0 and "visible 0.2 takes about" in text and "visible 0.9 would take" in text, text
    assert Path(tmp("after.exr")).read_bytes() == Path(tmp("plain.exr")).read_bytes()


def colourful(width=40, height=30):
    """The cube with a checker, indirect light, indices and every pass that this version has."""
    scene = cube(width, height)
    box, layer = bpy.data.objects["Cube"], scene.view_layers[0]
    material = box.material_slots[0].material
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    checker = material.node_tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value, checker.inputs["Color1"].default_value = 7, (.8, .3, .01, 1)
    material.node_tree.links.new(checker.outputs["Color"], shader.inputs["Base Color"])
    bpy.ops.mesh.primitive_plane_add(size=9, location=(0, 0, -1))
    box.pass_index = material.pass_index = 3
    scene.render.film_transparent = True
    for owner in (layer, layer.cycles):
        for name in dir(owner):
            if name.startswith("use_pass_") and not owner.is_property_readonly(name):
                with contextlib.suppress(AttributeError):
                    setattr(owner, name, True)
    layer.use_pass_diffuse_color = False  # the host has to switch it on, and to leave it out
    return scene


def test_passes():
    """alpha and every pass of the view layer are those of one Cycles render, also after a resume; Blender finds them by name"""
    scene = colourful()
    settings = Settings("null", spp_max=48, block=20, output=tmp("passes.exr"), checkpoint=tmp("passes.npz"))
    for spp in (32, 48):
        with Session(scene, dataclasses.replace(settings, spp_max=spp)) as session:
            session.begin(resume=True)
            session.write(session.run())
    assert any("Cryptomatte" in note for note in session.notes)
    found, _, _ = exr.read_layers(tmp("passes.exr"))
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = True
    with Cycles(scene, 48) as host:
        whole = Rect(0, 0, 40, 30)
        wanted, early = host._render_area(whole, 0, 48), host._render_area(whole, 0, 16)
    wanted.update({name: plane for name, plane in early.items() if name.startswith("Vector.")})  # of the first wave
    compared = set()
    for name, plane in wanted.items():
        if f"{layer.name}.{name}" in found:
            own, scale = found[f"{layer.name}.{name}"], max(1, abs(plane).max())
            assert abs(own - plane).max() < 1e-5 * scale, (name, abs(own - plane).max(), scale)
            compared.add(name.rpartition(".")[0])
    left_out = {n.rpartition(".")[0] for n in wanted} - compared
    assert all("Crypto" in n or n in ("DiffCol", "Diffuse Color", "Debug Sample Count", "Render Time") for n in left_out), left_out
    assert {"Combined", "Depth", "Normal", "Mist"} <= compared and len(compared) > 20
    assert (found["A"] == found[f"{layer.name}.Combined.A"]).all() and 0 < found["A"].mean() < 1
    shown = passes_in_blender(tmp("passes.exr"))
    assert set(shown["lull"]) == {"spp", "p_noisy", "error", "reason"} and {"Combined", "Mist", "Normal"} <= set(shown[layer.name])


def test_told():
    """what is not done as the scene says is told: denoising, the compositor, further view layers"""
    scene = cube(24, 24)
    scene.cycles.use_denoising = False
    assert not [n for n in Cycles(scene, 4).notes if "pattern" not in n]
    scene.cycles.use_denoising = True
    scene.view_layers.new("Second")
    if bpy.app.version < (5, 0):
        scene.use_nodes = True
    else:
        scene.compositing_node_group = bpy.data.node_groups.new("c", "CompositorNodeTree")
    blend = saved(scene, "told.blend")
    status, text = command(blend, "-c", "null", "--spp-max", "16", "-o", tmp("told.exr"))
    for wanted in ("not denoised", "compositor is not run", "only the view layer 'ViewLayer' is rendered, not Second"):
        assert status == 0 and "lull: " in text and wanted in text, text
    assert command(blend, "-c", "null", "--spp-max", "16", "-o", tmp("told.exr"), "-q") == (0, "")


def passes_in_blender(path):
    """The layers of a file and their passes, as a node of the compositor offers them."""
    scene = bpy.context.scene
    if bpy.app.version < (5, 0):
        scene.use_nodes, tree = True, None
        tree = scene.node_tree
    else:
        tree = bpy.data.node_groups.new("layers", "CompositorNodeTree")
        scene.compositing_node_group = tree
    node, out = tree.nodes.new("CompositorNodeImage"), {}
    node.image = bpy.data.images.load(path)
    for name in ("lull", scene.view_layers[0].name):
        node.layer = name
        out[name] = [o.name for o in node.outputs]
    return out


def test_same_picture():
    """blocks and waves add up to one Cycles render with the same samples"""
    scene = cube()
    with Session(scene, Settings("fixed", {"spp": "40"}, block=24)) as session:
        assert session.driver.run().outcome == "done" and len(session.frame.blocks) == 6
        mean = session.frame.mean()
    assert {b.spp for b in session.frame.blocks} == {64}
    whole = one_render(scene, 64)
    assert whole.std() > .01 and abs(mean - whole).max() < SAME * whole.max(), abs(mean - whole).max()


def exported(name, width=48, height=36):
    """A scene of ours, as scripts/hosts/pbrt_to_blend.py makes it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    arguments, sys.argv = sys.argv, ["", "--", str(ROOT / f"scenes/{name}.pbrt"), tmp(f"{name}.blend"), f"{width}x{height}"]
    try:
        runpy.run_path(str(ROOT / "scripts/hosts/pbrt_to_blend.py"))
    finally:
        sys.argv = arguments
    bpy.ops.wm.open_mainfile(filepath=tmp(f"{name}.blend"))
    return bpy.context.scene


def test_exported_scenes():
    """three scenes of ours: where blocks stopped, the picture is that of one Cycles render with the same samples"""
    for name, threshold in (("cornell-box", ".01"), ("soft-shadow", ".006"), ("glossy", ".02")):
        scene = exported(name)
        with Session(scene, Settings("halfbuf", {"threshold": threshold, "tail-share": "1"}, block=24, spp_max=96)) as session:
            assert session.driver.run().outcome == "done"
            mean, blocks = session.frame.mean(), session.frame.blocks
        counts = sorted({b.spp for b in blocks})
        assert len(blocks) == 4 and len(counts) > 1, (name, counts)
        for spp in counts:
            whole = one_render(scene, spp, 96)
            assert whole.std() > .01
            for r in (b.rect for b in blocks if b.spp == spp):
                here = np.s_[r.y0:r.y1, r.x0:r.x1]
                assert abs(mean[here] - whole[here]).max() < SAME * whole.max(), (name, spp)


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
                part = next(iter(host.render([Rect(x0, y0, x1, y1)], 0, 1, False)))["color"]
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
    assert (exr.read(tmp("s.exr"), ("lull.spp.V",))[0] == 32).all()
    render.use_border = False
    assert abs(one_render(scene, 32)[5:23, 28:35] - mean).max() < SAME * 10  # two waves: the first check
    render.use_border, render.border_max_x = True, render.border_min_x
    raises(HostError, "holds no pixel", Cycles, scene, 4)


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


def test_frames_of_scene():
    """--frames all is the scene's own range, step by step"""
    scene = cube(24, 24)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 5, 2
    bpy.ops.wm.save_as_mainfile(filepath=tmp("range.blend"))
    status, text = command(tmp("range.blend"), "-c", "fixed", "--frames", "all", "-q", "--report", tmp("all.json"))
    assert status == 0 and not text, text
    assert sorted(p.name for p in Path(TMP.name).glob("all_*")) == ["all_0001.json", "all_0003.json", "all_0005.json"]


def test_mask():
    """a painted block gets more samples, and the report says why"""
    cube(48, 24)
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    painted = np.zeros((24, 48, 3), np.uint8)
    painted[5, 7] = 255
    png.write(tmp("mask.png"), painted)
    blocks = []
    for mask in ((), ("--mask", tmp("mask.png"))):
        status, text = command(tmp("cube.blend"), "-c", "halfbuf", "-p", "threshold=.003", "--block", "24", "-q", "--report",
                               tmp("m.json"), "--spp-max", "256", *mask)
        assert status == 0, text
        blocks.append([(b["spp"], b["dial"]) for b in json.loads(Path(tmp("m.json")).read_text())["blocks"]])
    plain, masked = blocks
    assert masked[0][0] > plain[0][0] and masked[1] == plain[1] and [b[1] for b in masked] == [.25, 1], blocks
    assert json.loads(Path(tmp("m.json")).read_text())["mask"] == tmp("mask.png")


def test_resume():
    """a checkpoint goes on to the picture of an unbroken run"""
    cube(48, 24)
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    common = (tmp("cube.blend"), "-c", "null", "--block", "24", "-q")
    state = ("--checkpoint", tmp("run.npz"))
    assert command(*common, "--spp-max", "64", "-o", tmp("whole.exr")) == (0, "")
    assert command(*common, "--spp-max", "32", "-o", tmp("part.exr"), *state) == (0, "")
    assert command(*common, "--spp-max", "64", "-o", tmp("on.exr"), *state, "--resume") == (0, "")
    whole, part, on = (Path(tmp(n + ".exr")).read_bytes() for n in ("whole", "part", "on"))
    assert whole == on != part
    os.mkdir(tmp("folder"))
    with FolderGone(tmp("folder")):
        status, text = command(*common, "--spp-max", "64", "-o", tmp("lost.exr"), "--checkpoint", tmp("folder/run.npz"))
    assert status == 2 and "folder/run.npz" in text and os.path.exists(tmp("lost.exr"))  # the picture is kept all the same
    status, text = command(*common, "--resume")
    assert status == 2 and "--checkpoint" in text


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


def test_device():
    """a scene for a GPU that is not there is refused, not rendered on something else; --device chooses"""
    if bpy.context.preferences.addons["cycles"].preferences.has_active_device():
        raise Skip("a GPU is switched on")
    scene = cube(24, 24)
    scene.cycles.device = "GPU"
    bpy.ops.wm.save_as_mainfile(filepath=tmp("gpu.blend"))
    common = (tmp("gpu.blend"), "-c", "fixed", "-q", "-o", tmp("gpu.exr"))
    for device, wanted in (((), "has none switched on"), (("--device", "CUDA"), "device CUDA"), (("--device", "METAL"), "METAL")):
        status, text = command(*common, *device)
        assert status == 2 and wanted in text and len(text.strip().splitlines()) == 1, (status, text)
        assert not os.path.exists(tmp("gpu.exr"))
    assert command(*common, "--device", "CPU") == (0, "") and os.path.exists(tmp("gpu.exr"))


def test_programs():
    """from a shell: the package as a program, and Blender itself with --python-expr"""
    cube(24, 24)
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "plugin-api/python")}
    program = [os.environ.get("PYTHON", sys.executable), "-m", "lull.blender", tmp("cube.blend"), "-c", "fixed", "-q", "-o"]
    expression = ["-b", tmp("cube.blend"), "-noaudio", "--python-use-system-env", "--python-expr",
                  "from lull.blender import cli; cli.main()", "--", "-c", "fixed", "-q", "-o"]
    starts = [program] + ([[bpy.app.binary_path, *expression]] if bpy.app.binary_path else [])
    for n, start in enumerate(starts):
        done = subprocess.run([*start, tmp(f"p{n}.exr")], env=environment, text=True, capture_output=True)
        assert done.returncode == 0 and os.path.getsize(tmp(f"p{n}.exr")) > 1000, done.stderr
    if bpy.app.binary_path:
        done = subprocess.run([*program, tmp("p.exr"), "--blender", "no-blender"], env=environment, text=True,
                              capture_output=True)
        assert done.returncode == 2 and "no program 'no-blender'" in done.stderr and done.stderr.count("\n") == 1, done.stderr


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
    """Ctrl-C keeps what is there, status 130"""
    cube(200, 160)
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    timer = threading.Timer(1.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    status, _ = command(tmp("cube.blend"), "-c", "null", "--spp-max", "100000", "-o", tmp("i.exr"), "--report",
                        tmp("i.json"), "-q")
    timer.cancel()
    report = json.loads(Path(tmp("i.json")).read_text())
    assert status == 130 and report["interrupted"] and {b["reason"] for b in report["blocks"]} == {"interrupt"}
    assert 0 < report["blocks"][0]["spp"] < 100000 and os.path.getsize(tmp("i.exr")) > 1000


def test_failing_render():
    """a wave that Cycles cannot render ends the run and keeps what is there"""
    scene = cube()
    with Session(scene, Settings("null", spp_max=256, block=24, output=tmp("k.exr"))) as session:
        session.driver.after_call = lambda d: setattr(scene, "camera", None)
        result = session.driver.run()
        written, failed = session.write(result)
    assert result.outcome == "failed" and "camera" in str(result.exception) and written == [tmp("k.exr")] and not failed
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


def brightest(name):
    image = bpy.data.images.get(name)
    return max(image.pixels[:][::4], default=0) if image else 0


def test_addon():
    """the package is an add-on: it installs from a zip, its operator renders, its panel is there"""
    if not bpy.app.background or not hasattr(bpy.ops.preferences, "addon_install"):
        raise Skip("no preferences")
    subprocess.run([ROOT / "scripts/hosts/blender-addon", tmp("lull.zip")], check=True)
    scene = cube()
    lull.register()
    try:
        scene.lull.criterion, scene.lull.block, scene.lull.folder = "halfbuf", 24, TMP.name
        scene.lull.parameters, scene.cycles.samples = "threshold=.02", 64
        seen, render = [], Cycles.render
        Cycles.render = lambda *arguments: (seen.append(brightest("Lull")), render(*arguments))[1]
        try:
            assert bpy.ops.lull.render() == {"FINISHED"} and "blocks converged" in scene.lull.state
        finally:
            Cycles.render = render
        assert seen[0] == 0 and seen[-1] > .1 and brightest("Lull Stop Map") > 0, seen  # there while it renders
        assert "Lull Stop Map" in bpy.data.images and os.path.getsize(tmp("lull.exr")) > 1000
        scene.frame_start, scene.frame_end, scene.lull.folder = 1, 2, tmp("frames")
        os.mkdir(tmp("frames"))
        assert bpy.ops.lull.render(animation=True) == {"FINISHED"}
        assert {"lull_0001.exr", "lull_0002.exr", "lull_0002-report.json"} <= set(os.listdir(tmp("frames")))
        scene.lull.criterion, scene.lull.visible, scene.lull.parameters = "observer", .5, "growth=2"
        assert scene.lull.chosen(scene).parameters == {"visible": "0.5", "growth": "2"}
        scene.lull.parameters = "visible=.1"
        assert scene.lull.chosen(scene).parameters == {"visible": ".1"}
        for name, value, wanted in (("parameters", "threshold", "expected KEY=VALUE"), ("parameters", "", "No such file"),
                                    ("mask", tmp("lull.exr"), "this is an input")):
            setattr(scene.lull, name, value)
            scene.lull.folder = TMP.name if name == "mask" else tmp("mistyped") if not value else scene.lull.folder
            try:
                with NothingRendered():
                    raise AssertionError(bpy.ops.lull.render())
            except RuntimeError as error:
                assert wanted in str(error), error
    finally:
        lull.unregister()
    code = ("import bpy; bpy.ops.preferences.addon_install(filepath=%r); bpy.ops.preferences.addon_enable(module='lull'); "
            "print('ADDON', hasattr(bpy.types.Scene, 'lull'))" % tmp("lull.zip"))
    if bpy.app.binary_path:
        out = subprocess.run([bpy.app.binary_path, "-b", "--factory-startup", "-noaudio", "--python-expr", code], text=True,
                             env={**os.environ, "BLENDER_USER_SCRIPTS": TMP.name}, capture_output=True).stdout
        assert "ADDON True" in out, out


tap.main(dict(globals()))
