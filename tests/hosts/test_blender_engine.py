"""The engine behind Blender's Render button (F12); run like test_blender.py."""
import contextlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from blender_host import ROOT, command, cube, layers, saved, start, tmp  # noqa: E402
import bpy  # noqa: E402
import lull  # noqa: E402
import tap  # noqa: E402
from lull.blender import child, engine  # noqa: E402
from tap import Skip, raises  # noqa: E402

STOPS = ("-c", "halfbuf", "-p", "threshold=.02", "--block", "24", "-q")


def scene_of(width=70, height=46):
    """The cube, set to our engine, with an EXR of all passes as its output."""
    scene = cube(width, height)
    scene.render.engine, scene.cycles.samples = "LULL", 64
    scene.lull.criterion, scene.lull.block, scene.lull.parameters = "halfbuf", 24, "threshold=.02"
    settings = scene.render.image_settings
    for name, value in (("media_type", "MULTI_LAYER_IMAGE"), ("file_format", "OPEN_EXR_MULTILAYER"), ("color_depth", "32"),
                        ("use_exr_interleave", True)):
        if hasattr(settings, name):
            setattr(settings, name, value)
    return scene


def render(scene, name, **how):
    """What the button writes."""
    scene.render.filepath = tmp(name)
    try:
        assert bpy.ops.render.render(write_still=True, **how) == {"FINISHED"}
    except RuntimeError as error:
        raise RuntimeError(str(error).strip()) from None


def same(ours, theirs, layer):
    """Have both the same pixels in all passes of a view layer? ours: of the button; theirs: of the command line."""
    passes = {name.removeprefix(f"{layer}."): plane for name, plane in ours.items() if name.startswith(f"{layer}.")}
    assert (passes.pop("Lull Samples.X") == theirs["lull.spp.V"]).all()
    assert passes.keys() == {name.removeprefix(f"{layer}.") for name in theirs if name.startswith(f"{layer}.")}
    assert all((plane == theirs[f"{layer}.{name}"]).all() for name, plane in passes.items()) and passes["Combined.G"].std() > .01
    return passes


def test_same_picture():
    """F12 gives the command line's pixels in every pass of every view layer, and leaves the file and its settings as they are"""
    scene = scene_of()
    scene.render.film_transparent = True
    first, second = scene.view_layers[0], scene.view_layers.new("fog")
    first.use_pass_z = first.use_pass_diffuse_direct = first.use_pass_cryptomatte_object = second.use_pass_mist = True
    blend = saved(scene, "button.blend")
    before, folders = Path(blend).read_bytes(), os.listdir(bpy.app.tempdir)
    render(scene, "button.exr")
    assert Path(blend).read_bytes() == before and bpy.data.filepath == blend and scene.render.engine == "LULL"
    assert os.listdir(bpy.app.tempdir) == folders
    ours = layers(tmp("button.exr"))
    for layer, some in ((first.name, "Depth.Z"), ("fog", "Mist.Z")):
        process = start(blend, *STOPS, "--view-layer", layer, "-o", tmp("command.exr"))  # in which only the file names the engine
        assert "6 blocks converged" in "".join(process.communicate()) and process.returncode == 0, process.returncode
        assert some in same(ours, theirs := layers(tmp("command.exr")), layer) and theirs["lull.spp.V"].std() > 0
    status, text = command(blend, *STOPS, "--view-layer", "mist", "-o", tmp("command.exr"))
    assert status == 2 and "no view layer 'mist': ViewLayer, fog" in text, text


def test_region():
    """a render region has the pixels that Blender gives it, and the command line's"""
    for region in ((.239, .9, .111, .89), (.3, .79, 0, .6)):  # edges in the second half of a pixel, among others
        scene = scene_of()
        scene.render.use_border = scene.render.use_crop_to_border = True
        for name, edge in zip(("min_x", "max_x", "min_y", "max_y"), region):
            setattr(scene.render, f"border_{name}", edge)
        blend = saved(scene, "region.blend")
        render(scene, "region.exr")
        assert command(blend, *STOPS, "-o", tmp("command.exr")) == (0, "")
        same(layers(tmp("region.exr")), layers(tmp("command.exr")), "ViewLayer")


def test_animation():
    """Ctrl-F12 renders frame by frame, each as the command line does"""
    scene = scene_of(48, 32)
    scene.frame_start, scene.frame_end, scene.render.filepath = 1, 2, tmp("button_")
    blend = saved(scene, "shot.blend")
    assert bpy.ops.render.render(animation=True) == {"FINISHED"}
    assert command(blend, *STOPS, "--frames", "1-2", "-o", tmp("command.exr")) == (0, "")
    shot = [same(layers(tmp(f"button_000{n}.exr")), layers(tmp(f"command_000{n}.exr")), "ViewLayer") for n in (1, 2)]
    assert (shot[0]["Combined.G"] != shot[1]["Combined.G"]).any()


def test_denoised():
    """the panel's Denoise holds for the button too"""
    scene = scene_of(24, 24)
    scene.lull.parameters, scene.lull.criterion, scene.lull.denoise, scene.lull.kept = "", "observer", True, "full"
    with tap.denoiser("constant", os.environ.get("BUILD", "build")):
        render(scene, "denoised.exr")
    assert abs(layers(tmp("denoised.exr"))["ViewLayer.Combined.G"] - .5).max() < 1e-6


def test_errors():
    """what goes wrong in the process is told in one line, and nothing is written"""
    scene = scene_of(24, 24)
    program, camera = engine._program, scene.camera
    try:
        for wanted, parameters, runs in (("threshold", "threshold=x", program), ("expected KEY=VALUE", "threshold", program),
                                         ("no such program", "", lambda: ["/no such program"]),
                                         ("status 3: ouch", "", lambda: ["/bin/sh", "-c", "echo ouch >&2; exit 3 #"]),
                                         ("status -9: no message", "", lambda: ["/bin/sh", "-c", "kill -9 $$ #"])):
            scene.lull.parameters, engine._program = parameters, runs
            raises(RuntimeError, wanted, render, scene, "wrong.exr")
            assert not os.path.exists(tmp("wrong.exr"))
        scene.camera, scene.lull.parameters, engine._program = None, "", program
        raises(RuntimeError, "camera", render, scene, "wrong.exr")
    finally:
        scene.camera, engine._program = camera, program
    assert not os.path.exists(tmp("wrong.exr"))


@contextlib.contextmanager
def rendering():
    """A process that would render for hours, after its first picture, and its messages."""
    scene = scene_of()
    scene.lull.parameters, scene.cycles.samples = "threshold=1e-9", 1 << 20
    with tempfile.TemporaryDirectory(dir=tmp("")) as folder:
        engine.save(folder, scene, scene.view_layers[0].name)
        with engine.Child(folder) as process:
            messages = process.messages()
            told = next(message for message in messages if "percent" in message)
            assert "blocks active" in told["text"] and "spp" in told["text"] and "ETA" in told["text"], told
            next(message for message in messages if "picture" in message)
            yield folder, process, messages


def test_stop():
    """Esc ends the process, which keeps what is there and says so"""
    with rendering() as (folder, process, messages):
        process.stop()
        rest = [message for message in messages if process.stop() or message]
        assert rest[-2] == {"picture": True} and "blocks converged" in rest[-1]["info"] and not process.error, rest[-3:]
        assert os.path.getsize(os.path.join(folder, child.PICTURE)) > 1000
    with rendering() as (folder, process, _):
        os.close(process._messages)  # as when Blender is killed
        process._messages = os.open(os.devnull, os.O_RDONLY)
        process._process.wait(20)
        assert not os.path.exists(folder)
        os.mkdir(folder)


def test_scripts():
    """drivers in Python are run where Blender's preference says so, else it is told that they are not"""
    preferences = bpy.context.preferences.filepaths
    for runs in (False, True):
        scene = scene_of(24, 24)
        bpy.data.objects["Cube"].driver_add("location", 2).driver.expression = "len([z for z in 'ab'])"
        preferences.use_scripts_auto_execute = runs
        try:
            with tempfile.TemporaryDirectory(dir=tmp("")) as folder:
                engine.save(folder, scene, scene.view_layers[0].name)
                with engine.Child(folder) as process:
                    told = [message["warning"] for message in process.messages() if "warning" in message]
        finally:
            preferences.use_scripts_auto_execute = False
        assert runs != any("Auto Run Python Scripts" in text for text in told) and not process.error, (runs, told)


def test_panels():
    """Cycles' panels show with the engine, and no longer after it is gone; the buttons work with it"""
    def shown():
        return [panel for panel in bpy.types.Panel.__subclasses__() if "LULL" in getattr(panel, "COMPAT_ENGINES", ())]

    assert len(shown()) > 50 and "CYCLES_RENDER_PT_sampling" in {panel.__name__ for panel in shown()}
    lull.unregister()
    try:
        assert not shown() and not engine.registered()
    finally:
        lull.register()
    scene = scene_of(24, 24)
    scene.lull.folder = tmp("buttons")
    os.mkdir(scene.lull.folder)
    assert bpy.ops.lull.render() == {"FINISHED"} and scene.render.engine == "LULL"
    assert layers(tmp("buttons/lull.exr"))["G"].std() > .01


def test_program():
    """blender -b FILE -E LULL -f 1 with the add-on; Ctrl-C ends it soon"""
    if not bpy.app.binary_path:
        raise Skip("the module bpy is no program")
    scene = scene_of(48, 32)
    scene.render.engine, scene.cycles.samples = "CYCLES", 1 << 20
    scene.lull.parameters = "threshold=1e-9"
    blend = saved(scene, "program.blend")
    os.makedirs(tmp("scripts/addons"))
    os.symlink(ROOT / "plugin-api/python/lull", tmp("scripts/addons/lull"))
    environment = {**os.environ, "BLENDER_USER_SCRIPTS": tmp("scripts"), "BLENDER_USER_CONFIG": tmp("config")}

    def run(*arguments):
        return subprocess.Popen([bpy.app.binary_path, "-b", "--addons", "lull", "-noaudio", blend, "-E", "LULL", "-o", tmp("p_#"),
                                 *arguments], env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    short = run("--python-expr", "import bpy; bpy.context.scene.cycles.samples = 32", "-f", "1")
    text, _ = short.communicate()
    assert short.returncode == 0 and "Lull: 0 of 4 blocks converged, 32..32 spp" in text, text
    assert (layers(tmp("p_1.exr"))["ViewLayer.Lull Samples.X"] == 32).all()
    os.remove(tmp("p_1.exr"))
    long = run("-f", "1")
    for line in long.stdout:
        if "blocks active" in line:
            break
    long.send_signal(2)
    started_s = time.monotonic()
    text, _ = long.communicate()
    assert time.monotonic() - started_s < 20 and "blocks converged" in text and not os.path.exists(tmp("p_1.exr")), text


lull.register()
tap.main(dict(globals()))
