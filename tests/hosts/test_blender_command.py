"""The command line of the Blender host: what it writes, refuses, tells and keeps; run like test_blender.py."""
import base64
import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from blender_host import (ROOT, TMP, FolderGone, NothingRendered, command, cube, layers, one_render, saved, start,  # noqa: E402
                          tmp)
import bpy  # noqa: E402
import numpy as np  # noqa: E402
import tap  # noqa: E402
from lull import checkpoint  # noqa: E402
from lull.blender.cycles import Cycles, HostError  # noqa: E402
from lull.blender.session import Session, Settings, scene_output  # noqa: E402
from lull.blender.view import read_grey  # noqa: E402
from lull.files import write_png  # noqa: E402
from tap import Skip, raises  # noqa: E402


def contents():
    return {p: p.read_bytes() for p in Path(TMP.name).rglob("*") if p.is_file()}


def test_lost_files():
    """what would cost the user a file is refused before the first wave: inputs, other kinds, one file for two outputs"""
    scene = cube(24, 24)
    write_png(tmp("wood.png"), np.full((24, 24, 3), 99, np.uint8))
    bpy.data.images.load(tmp("wood.png")).use_fake_user = True
    write_png(tmp("painted.png"), np.full((24, 24, 3), 99, np.uint8))
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
    assert status == 2 and f"kept as {kept}" in text and layers(kept)["R"].shape == (24, 24), text
    assert os.path.getsize(tmp("apart.png")) > 50 and json.loads(Path(tmp("apart.json")).read_text())["blocks"]


def in_memory():
    """What lies in memory file systems."""
    with open("/proc/mounts") as mounts:
        folders = {line.split()[1] for line in mounts if line.split()[2] in ("tmpfs", "ramfs")} | {"/dev/shm"}
    return {os.path.join(folder, name) for folder in folders if os.access(folder, os.R_OK) for name in os.listdir(folder)
            if name.startswith(("lull", "wave", "blender"))}


def test_signals():
    """TERM, INT and HUP keep picture and checkpoint (status 130), kill -9 the last checkpoint; nothing stays in memory"""
    blend = saved(cube(48, 24), "signals.blend")
    before = in_memory()
    common = (blend, "-c", "null", "--block", "24", "-q", "--checkpoint-every", "0")
    whole = start(*common, "--spp-max", "6400", "-o", tmp("whole.exr"))
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL):
        os.mkdir(tmp(f"tmp-{number}"))
        state, picture = tmp(f"{number}.npz"), tmp(f"{number}.exr")
        run = start(*common, "--spp-max", "6400", "-o", picture, "--checkpoint", state, TMPDIR=tmp(f"tmp-{number}"))
        while run.poll() is None and not os.path.exists(state):
            time.sleep(.01)
        run.send_signal(number)
        _, text = run.communicate()
        assert run.returncode == (-number if number == signal.SIGKILL else 130) and not text, (number, run.returncode, text)
        assert checkpoint.is_one(state) and os.path.exists(picture) == (number != signal.SIGKILL), number
        left = [p for p in Path(tmp(f"tmp-{number}")).rglob("*") if p.is_file() or number != signal.SIGKILL]
        assert not left and in_memory() <= before, (number, left, in_memory() - before)
    assert whole.wait() == 0
    assert start(*common, "--spp-max", "6400", "-o", picture, "--checkpoint", state, "--resume").wait() == 0
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
        assert status == 2 and f"made with {wanted}=" in text and text.count("\n") == 1, (wanted, text)
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
    assert (layers(tmp("shots/cube_0001.exr"))["lull.spp.V"] == 48).all()
    status, text = command(blend, "-c", "null", "-q", "--frames", "2-2", "--spp-max", "16")
    assert status == 0 and (layers(tmp("shots/cube_0002.exr"))["lull.spp.V"] == 16).all(), text
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


def test_quote():
    """the quality parameter's cost is told at the first check and by --quote, coarser ones too; a render goes on from the quote"""
    blend = saved(cube(48, 32), "quote.blend")
    common = (blend, "--block", "16", "--spp-max", "256", "--visible", ".2")
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        assert command(*common, "-q", "--quote", "--checkpoint", tmp("quote.npz")) == (0, "")
    table = [line for line in output.getvalue().splitlines() if "have not met their light yet" not in line]
    settings = [tuple(r.split()[:2]) for r in table[1:]]
    assert "spp min / mean / max" in table[0] and settings == [
        ("error", "8"), ("error", "4"), ("error", "2"), ("visible", "0.35"), ("visible", "0.2"), ("visible", "0.05")], table
    assert "chosen" in table[5] and not os.path.exists("quote.exr")
    for both in (("--error", "2"), ("-p", "error=2")):
        status, text = command(*common, *both, "-q", "--quote")
        assert (status, text.count("\n")) == (2, 1) and "error and visible each say when a block stops: leave out one" in text, text
    assert all(re.search(r" [0-9.]+ (s|min) \([0-9.]+ (s|min) to [0-9.]+ (s|min)\)", row) for row in table[1:]), table
    means = [float(r.split("/")[1].replace(",", "")) for r in table[1:]]
    assert means == sorted(means) and means[0] < means[-1], table
    assert command(*common, "-q", "--checkpoint", tmp("quote.npz"), "--resume", "-o", tmp("after.exr")) == (0, "")
    status, text = command(*common, "-o", tmp("plain.exr"))
    assert status == 0 and re.search(r"visible 0\.2 takes (about|more than can be told yet)", text) and "error 4 would take" in text, text
    assert Path(tmp("after.exr")).read_bytes() == Path(tmp("plain.exr")).read_bytes()


def test_quote_of_frames():
    """--frames --quote ends with the price of all frames together"""
    scene = cube(24, 24)
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 5, 2
    blend, output = saved(scene, "shot.blend"), io.StringIO()
    with contextlib.redirect_stdout(output):
        assert command(blend, "--frames", "all", "--quote", "--spp-max", "64", "-q") == (0, "")
    lines = output.getvalue().splitlines()
    means = [float(r.split("/")[1].replace(",", "")) for r in lines if r.endswith("chosen")]
    assert len(means) == 3 and re.fullmatch(r"3 frames, by 3 pilots: (about|at most) [0-9.]+ (s|min) "
                                            r"\([0-9.]+ (s|min) to [0-9.]+ (s|min)\), [0-9,]+ spp on average", lines[-1]), lines
    assert abs(float(re.search(r"([0-9,]+) spp on", lines[-1])[1].replace(",", "")) - sum(means) / 3) <= 1, lines
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        assert command(blend, "-c", "fixed", "--frames", "1-2", "--quote", "--spp-max", "64", "-q") == (0, "")
    assert output.getvalue().endswith("2 frames: the criterion cannot tell what they cost\n"), output.getvalue()


def test_watching():
    """--html writes the page, its picture as the view shows it, as lull-report does of the EXR; --display-server shows it in a viewer"""
    scene = cube(48, 32)
    scene.view_settings.view_transform, scene.view_settings.exposure = "Filmic", 1.5
    blend = saved(scene, "page.blend")
    with subprocess.Popen([os.environ.get("PYTHON", sys.executable), "tests/cli/viewer.py", tmp("port"), tmp("seen.json")]) as viewer:
        while not os.path.exists(tmp("port")) or not Path(tmp("port")).read_text().strip():
            time.sleep(.05)
        port = Path(tmp("port")).read_text().strip()
        assert command(blend, "-q", "--spp-max", "32", "--block", "16", "--html", tmp("page.html"), "-o", tmp("page.exr"), "--preview",
                       tmp("page.png"), "--display-server", f"127.0.0.1:{port}") == (0, "")
        viewer.wait(20)
    seen = json.loads(Path(tmp("seen.json")).read_text())
    assert seen["updates"] > 0, seen
    subprocess.run([f"{os.environ.get('BUILD', 'build')}/bin/lull-report", tmp("page.exr"), "-o", tmp("later.html")], check=True)
    for page in ("page.html", "later.html"):
        text = Path(tmp(page)).read_text()
        picture = re.search(r'data-layer="picture" src="data:image/png;base64,([^"]*)"', text)
        Path(tmp("inside.png")).write_bytes(base64.b64decode(picture[1]))
        assert abs(read_grey(tmp("inside.png")) - read_grey(tmp("page.png"))).max() <= 1.001 / 255, page
        assert re.search(r'"visible":"[0-9.]+"', text), page


def test_denoise():
    """--denoise keeps the blend, by Cycles' own denoising passes, and stops by it; the noisy picture is there if that fails"""
    scene = cube(48, 32)
    blend = saved(scene, "denoise.blend")
    with tap.denoiser("box", os.environ.get("BUILD", "build")):
        assert command(blend, "--denoise", "-q", "--block", "16", "--spp-max", "64", "-o", tmp("b.exr"), "--preview", tmp("b.png"),
                       "--report", tmp("b.json")) == (0, "")
        seen, report = layers(tmp("b.exr")), json.loads(Path(tmp("b.json")).read_text())
        weight = seen["lull.weight.V"]
        assert report["criterion"]["id"] == "denoised" and abs(report["noisy_weight"] - weight.mean()) < 1e-5
        mixed = weight * seen["noisy.G"] + (1 - weight) * seen["denoised.G"]
        assert abs(seen["G"] - mixed).max() < 1e-5 and (seen["G"] == seen["ViewLayer.Combined.G"]).all()
        assert not [name for name in seen if "Denoising" in name]  # nobody asked for these passes
    with tap.denoiser("auxiliary", os.environ.get("BUILD", "build")):
        bpy.ops.wm.open_mainfile(filepath=blend)
        scene = bpy.context.scene
        scene.view_layers[0].cycles.denoising_store_passes = True
        settings = Settings("fixed", {"spp": "16"}, spp_max=16, block=24, denoise="full", output=tmp("full.exr"))
        with Session(scene, settings) as session:
            result = session.driver.run()
            assert result.outcome == "done" and session.write(result)[1] == []
        seen = layers(tmp("full.exr"))
        passes = [[seen[f"ViewLayer.Denoising {name}"] for name in names] for names in
                  (("Albedo.R", "Albedo.G", "Albedo.B"), ("Normal.X", "Normal.Y", "Normal.Z"))]
        for c, albedo, normal in zip("RGB", *passes):
            assert abs(seen[c] - albedo - normal).max() < 1e-5
        assert np.max(passes[0]) > .5 and np.min(passes[1]) < -.5
    saved(scene, "denoise.blend")
    assert bpy.context.scene.view_layers[0].cycles.denoising_store_passes
    with tap.denoiser("/nowhere", "build"), NothingRendered():
        status, text = command(blend, "--denoise=full", "-o", tmp("no.exr"))
        assert status == 2 and "/nowhere" in text and text.count("\n") == 1 and not os.path.exists(tmp("no.exr")), text
    with tap.denoiser("crash", os.environ.get("BUILD", "build")):
        status, text = command(blend, "--denoise", "-c", "fixed", "-p", "spp=16", "-q", "-o", tmp("noisy.exr"))
        assert status == 2 and "the picture is the noisy one: Open Image Denoise" in text and "noisy.R" not in layers(tmp("noisy.exr"))


def test_really_denoised():
    """with Open Image Denoise itself the blend is nearer to a long render than the noisy picture with the same samples"""
    scene = cube(64, 48)
    bpy.data.objects["Light"].data.shadow_soft_size = 3
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    truth = one_render(scene, 2048)
    with tap.denoiser("real", "build"):
        with Session(scene, Settings("fixed", {"spp": "16"}, spp_max=16, block=32, denoise="blend", output=tmp("r.exr"))) as session:
            assert session.write(session.driver.run())[1] == []
            noisy, kept = (np.sqrt(((p - truth) ** 2).mean()) for p in (session.frame.mean(), session.denoised.picture))
    assert kept < .7 * noisy, (kept, noisy)


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


def test_animation():
    """the command renders frames of an animation, with the same quality parameter, into numbered files"""
    cube()
    bpy.ops.wm.save_as_mainfile(filepath=tmp("cube.blend"))
    status, text = command(tmp("cube.blend"), "-c", "halfbuf", "-p", "threshold=.02", "--frames", "1-2", "--block", "24",
                           "-q", "--spp-max", "64", "-o", tmp("f.exr"), "--preview", tmp("f.png"), "--stop-map",
                           tmp("f-map.png"),
                           "--report", tmp("f.json"))
    assert status == 0 and not text, text
    first, second = (read_grey(tmp(f"f_000{k}.png")) for k in (1, 2))
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
    write_png(tmp("mask.png"), painted)
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
    write_png(tmp("mask.png"), np.zeros((4, 4, 3), np.uint8))
    out = tmp("bad.exr")
    for arguments, wanted in (([tmp("blind.blend")], "no camera"),
                              ([tmp("cube.blend"), "-c", "nobody"], "no criterion nobody"),
                              ([tmp("cube.blend"), "-c", "/none.so"], "no such file"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "-p", "x"], "KEY=VALUE"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "-p", "x=1"], "no parameter 'x'"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--mask", tmp("mask.png")], "mask of shape (4, 4)"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--mask", tmp("none.png")], "none.png"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--frames", "b-a"], "--frames"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--frames", "1- 2"], "--frames"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--frames", "1048575"], "--frames 1048575: expected FIRST-LAST, from"),
                              ([tmp("cube.blend"), "-c", "halfbuf", "--frames", "1-99999999999"], "--frames 1-99999999999: expected"),
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
    for device, wanted in (((), "has none switched on"), (("--device", "CUDA"), "device CUDA"),
                           (("--device", "METAL"), "METAL")):
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
                  "import sys; from lull.blender import cli; sys.exit(cli.main())", "--", "-c", "fixed", "-q", "-o"]
    starts = [program] + ([[bpy.app.binary_path, *expression]] if bpy.app.binary_path else [])
    for n, start in enumerate(starts):
        done = subprocess.run([*start, tmp(f"p{n}.exr")], env=environment, text=True, capture_output=True)
        assert done.returncode == 0 and os.path.getsize(tmp(f"p{n}.exr")) > 1000, done.stderr
    if bpy.app.binary_path:
        done = subprocess.run([*program, tmp("p.exr"), "--blender", "no-blender"], env=environment, text=True,
                              capture_output=True)
        assert done.returncode == 2 and "no program 'no-blender'" in done.stderr, done.stderr
        assert done.stderr.count("\n") == 1, done.stderr


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


tap.main(dict(globals()))
