"""Blender's Cycles as a host: pictures, passes, the add-on; run inside Blender or by a Python with the module bpy."""
import contextlib
import dataclasses
import json
import os
import runpy
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from blender_host import ROOT, SAME, TMP, NothingRendered, cube, layers, one_render, tmp, whole_picture  # noqa: E402
import bpy  # noqa: E402
import numpy as np  # noqa: E402
import lull  # noqa: E402
import tap  # noqa: E402
from lull import Rect, exr  # noqa: E402
from lull.blender import cycles, ui, view  # noqa: E402
from lull.blender.cycles import WAVE, Cycles, HostError, merge  # noqa: E402
from lull.blender.session import Session, Settings  # noqa: E402
from tap import raises  # noqa: E402


def test_described():
    """every public name has a docstring, every parameter and result a type"""
    assert not list(tap.undescribed(lull.blender)), list(tap.undescribed(lull.blender))


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
            waves = [(0, 16), (16, 16), (32, 480), (512, 88)]  # of one half, so from 2 * first on
            mean = sum(n * next(iter(host.render(rect, 2 * first, n, False)))["color"].astype(float) for first, n in waves) / 600
            whole = next(iter(host.render(rect, 0, 600, False)))["color"]
        assert scene.cycles.sampling_pattern == name and own == (not notes), (name, notes)
        assert abs(mean - whole).max() < SAME * 10, (name, abs(mean - whole).max())
        assert own or "sampling pattern is Sobol-Burley instead of the scene's" in notes[0]
        kept += own
    assert kept > 0


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
    """alpha and the view layer's passes are those of one render, also after a resume; Blender finds them by name"""
    scene = colourful()
    settings = Settings("null", spp_max=64, block=20, output=tmp("passes.exr"), checkpoint=tmp("passes.npz"))
    for spp in (32, 64):
        with Session(scene, dataclasses.replace(settings, spp_max=spp)) as session:
            session.host.seeds = (scene.cycles.seed, scene.cycles.seed)  # equal halves: one render of half the samples
            session.begin(resume=True)
            session.write(session.driver.run())
    assert any("Cryptomatte" in note for note in session.notes)
    found = layers(tmp("passes.exr"))
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = True
    with Cycles(scene, 64) as host:
        whole = Rect(0, 0, 40, 30)
        wanted, early = host._render_area(whole, 0, 32), host._render_area(whole, 0, WAVE)
    wanted.update({name: plane for name, plane in early.items() if name.startswith("Vector.")})  # of the first wave
    compared = set()
    for name, plane in wanted.items():
        if f"{layer.name}.{name}" in found:
            own, scale = found[f"{layer.name}.{name}"], max(1, abs(plane).max())
            assert abs(own - plane).max() < 1e-5 * scale, (name, abs(own - plane).max(), scale)
            compared.add(name.rpartition(".")[0])
    left_out = {n.rpartition(".")[0] for n in wanted} - compared
    assert left_out & {"DiffCol", "Diffuse Color"}  # switched on for the host's sake only
    others = {"DiffCol", "Diffuse Color", "Debug Sample Count", "Render Time"}
    assert all("Crypto" in n or n in others for n in left_out), left_out
    assert {"Combined", "Depth", "Normal", "Mist"} <= compared and len(compared) > 20
    assert (found["A"] == found[f"{layer.name}.Combined.A"]).all() and 0 < found["A"].mean() < 1
    shown = passes_in_blender(tmp("passes.exr"))
    assert set(shown["lull"]) == {"spp", "p_noisy", "error", "reason"}
    assert {"Combined", "Mist", "Normal"} <= set(shown[layer.name])


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
    """blocks and waves add up to a Cycles render for each half with the same samples"""
    scene = cube()
    with Session(scene, Settings("fixed", {"spp": "40"}, block=24)) as session:
        assert session.driver.run().outcome == "done" and len(session.frame.blocks) == 6
        mean = session.frame.mean()
    assert {b.spp for b in session.frame.blocks} == {48}  # the first pair of waves beyond
    whole = one_render(scene, 48)
    assert whole.std() > .01 and abs(mean - whole).max() < SAME * whole.max(), abs(mean - whole).max()


def test_halves():
    """at the edges of a bright lamp the halves differ as much as the picture is wrong, although Cycles' samples are even there"""
    scene = cube(32, 24)
    material = bpy.data.objects["Cube"].material_slots[0].material
    lamp = material.node_tree.nodes.new("ShaderNodeEmission")
    lamp.inputs["Strength"].default_value = 20
    output = next(n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL")
    material.node_tree.links.new(lamp.outputs[0], output.inputs["Surface"])
    with Session(scene, Settings("halfbuf", {"threshold": "1e-9"}, block=32, spp_max=256)) as session:
        assert session.driver.run().outcome == "done"
        mean, half = session.frame.mean(), session.frame.mean("half")
    wrong = np.sqrt(((mean - one_render(scene, 4096)) ** 2).mean())
    apart = np.sqrt(((half - mean) ** 2).mean())
    assert .5 * wrong < apart < 2 * wrong, (apart, wrong)


def test_animated_seed():
    """a driver, a key or a script that sets the seed leaves the halves apart and is there again afterwards"""
    def script(scene, *_):
        scene.cycles.seed, scene.render.border_max_x = 7, .5
    for animate in (lambda scene: setattr(scene.driver_add("cycles.seed").driver, "expression", "frame"),
                    lambda scene: scene.keyframe_insert("cycles.seed", frame=1),
                    lambda scene: setattr(scene.driver_add("cycles.sample_offset").driver, "expression", "0"),
                    lambda _: bpy.app.handlers.frame_change_pre.append(script),
                    lambda _: bpy.app.handlers.render_init.append(script)):
        scene = cube(32, 24)
        animate(scene)
        scene.frame_set(1)
        with Session(scene, Settings("halfbuf", {"threshold": "1e-9"}, block=32, spp_max=32)) as session:
            assert session.driver.run().outcome == "done"
            mean, half = session.frame.mean(), session.frame.mean("half")
            assert np.abs(mean - half).max() > 1e-3
            assert np.abs(mean - whole_picture(session.host, 32)).max() < SAME
        assert not any(curve.mute for curve in cycles.curves_of(scene))
        assert all(hook == script for hook in bpy.app.handlers.frame_change_pre)


def test_phases():
    """the report says what the seconds went to: together not more than the wall clock, and most of it"""
    scene = cube(320, 180)
    settings = Settings("halfbuf", {"threshold": "1e-9"}, block=80, spp_max=192, report=tmp("phases.json"))
    begin_s = time.monotonic()
    with Session(scene, settings) as session:
        result = session.driver.run()
    wall_s = time.monotonic() - begin_s
    session.write(result)
    report = json.loads(Path(tmp("phases.json")).read_text())
    phases = report["phases"]
    assert list(phases) == ["samples_s", "synchronisation_s", "copies_s", "looks_s"] and min(phases.values()) > 0, phases
    assert .8 * wall_s < sum(phases.values()) <= wall_s, (phases, wall_s)
    assert phases["samples_s"] > .5 * wall_s and phases["looks_s"] == report["totals"]["criterion_s"], (phases, wall_s)


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
    """three scenes of ours: where blocks stopped, the picture is that of a Cycles render for each half with the same samples"""
    for name, threshold in (("cornell-box", ".012"), ("soft-shadow", ".006"), ("glossy", ".02")):
        scene = exported(name)
        settings = Settings("halfbuf", {"threshold": threshold, "tail-share": "1"}, block=24, spp_max=96)
        with Session(scene, settings) as session:
            assert session.driver.run().outcome == "done"
            mean, blocks = session.frame.mean(), session.frame.blocks
            wholes = {spp: whole_picture(session.host, spp) for spp in sorted({b.spp for b in blocks})}
        assert len(blocks) == 4 and len(wholes) > 1, (name, list(wholes))
        for spp, whole in wholes.items():
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
                part = next(iter(host.render([Rect(x0, y0, x1, y1)], 0, 1, True)))["color"]
                assert (part == whole[y0:y1, x0:x1]).all(), (width, height, x0, y0, x1, y1)


def test_merge():
    """merged rectangles hold the same pixels"""
    grid = [Rect(x, y, min(x + 16, 70), min(y + 16, 50)) for y in range(0, 50, 16) for x in range(0, 70, 16)]
    rng = np.random.default_rng(4)
    for _ in range(50):
        chosen = [r for r in grid if rng.random() < .6]
        before, after = np.zeros((50, 70), int), np.zeros((50, 70), int)
        for rects, seen in ((chosen, before), (merge(chosen), after)):
            for r in rects:
                seen[r.y0:r.y1, r.x0:r.x1] += 1
        assert (before == after).all()
    assert merge(grid) == [Rect(0, 0, 70, 50)]


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
    stored, origin = exr.read(tmp("s.exr"))
    assert origin == (28, 5) and abs(np.stack([stored[c] for c in "RGB"], -1) - mean).max() < 1e-6
    assert (stored["lull.spp.V"] == 2 * WAVE).all()
    render.use_border = False
    assert abs(one_render(scene, 2 * WAVE)[5:23, 28:35] - mean).max() < SAME * 10  # two waves: the first check
    render.use_border, render.border_max_x = True, render.border_min_x
    raises(HostError, "holds no pixel", Cycles, scene, 4)
    render.use_border, render.resolution_percentage = False, 1
    raises(HostError, "1 % of its resolution are no pixel", Cycles, scene, 4)


def test_no_cycles():
    """without Cycles, with stereo views or without a view layer the host says so"""
    scene = cube()
    raises(HostError, "Cycles is not available", Cycles, type("Scene", (), {"name": "x"})(), 4)
    scene.render.use_multiview = True
    raises(HostError, "stereoscopy", Cycles, scene, 4)
    scene.render.use_multiview = False
    scene.view_layers[0].use = False
    raises(HostError, "no view layer", Cycles, scene, 4)


def test_failing_render():
    """a wave that Cycles cannot render ends the run and keeps what is there"""
    scene = cube()
    with Session(scene, Settings("null", spp_max=256, block=24, output=tmp("k.exr"))) as session:
        session.driver.after_call = lambda d: setattr(scene, "camera", None)
        result = session.driver.run()
        written, failed = session.write(result)
    assert result.outcome == "failed" and "camera" in str(result.exception) and written == [tmp("k.exr")] and not failed
    assert session.frame.blocks[0].spp == WAVE and session.frame.mean().max() > 0


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


def one_line(call):
    try:
        call()
    except RuntimeError as error:
        raise RuntimeError(str(error).replace("\n", " ")) from None


def brightest(name):
    image = bpy.data.images.get(name)
    return max(image.pixels[:][::4], default=0) if image else 0


def test_addon():
    """the package is an add-on: its operator renders, its panel is there"""
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
        assert bpy.ops.lull.render() == {"FINISHED"}  # over the one before, which is shown
        scene.frame_start, scene.frame_end, scene.lull.folder = 1, 2, tmp("frames")
        os.mkdir(tmp("frames"))
        assert bpy.ops.lull.render(animation=True) == {"FINISHED"}
        assert {"lull_0001.exr", "lull_0002.exr", "lull_0002-report.json"} <= set(os.listdir(tmp("frames")))
        assert "2 frames, by 2 pilots: " in scene.lull.state and "spp on average" in scene.lull.state, scene.lull.state
        scene.lull.criterion, scene.lull.parameters = "observer", ""
        assert abs(scene.lull.visible - float(lull.find("observer").parameter("visible").default)) < 1e-6
        assert scene.lull.chosen(scene).parameters == {}  # the criterion's own
        scene.lull.visible, scene.lull.parameters = .5, "growth=2"
        assert scene.lull.chosen(scene).parameters == {"visible": "0.5", "growth": "2"}
        scene.lull.quality = "draft"
        assert scene.lull.chosen(scene).parameters == {"error": "4", "growth": "2"}
        scene.lull.quality = "final"
        scene.lull.parameters = "visible=.1"
        assert scene.lull.chosen(scene).parameters == {"visible": ".1"}
        scene.lull.parameters, scene.lull.denoise = "", True
        wanted = scene.lull.chosen(scene)
        assert (wanted.criterion, wanted.denoise, wanted.parameters) == ("denoised", "blend", {"visible": "0.5"})
        scene.lull.kept = "full"
        assert scene.lull.chosen(scene).parameters == {"picture": "denoised", "visible": "0.5"}
        scene.lull.folder, scene.cycles.samples = TMP.name, 32
        with tap.denoiser("constant", os.environ.get("BUILD", "build")):
            assert bpy.ops.lull.render() == {"FINISHED"} and "denoised, 0%" in scene.lull.state, scene.lull.state
        assert abs(layers(tmp("lull.exr"))["G"] - .5).max() < 1e-6
        scene.lull.denoise = False
        assert scene.lull.criterion == "observer" and scene.lull.chosen(scene).denoise == ""
        step = Session.step
        Session.step = lambda session: 1 / 0 if session.driver.totals.samples else step(session)
        try:
            raises(RuntimeError, "division", lambda: one_line(bpy.ops.lull.render))
        finally:
            Session.step = step
        assert not ui._running and scene.render.engine == "CYCLES" and not scene.render.use_border
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


tap.main(dict(globals()))
