"""Run inside Blender or with bpy by blender.sh: `install ZIP FOLDER` puts the add-on in place as Preferences do, for
whatever starts after; `use FOLDER` renders with what was put in place. Prints one line for each step that held."""
import os
import sys
from pathlib import Path

import bpy

ARGUMENTS = sys.argv[sys.argv.index("--") + 1:]
EXTENSION = bpy.app.version >= (4, 2, 0)
MODULE = "bl_ext.user_default.lull" if EXTENSION else "lull"


def install(archive: str, _folder: str) -> None:
    if EXTENSION:
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    else:
        bpy.ops.preferences.addon_install(filepath=archive)
        bpy.ops.preferences.addon_enable(module=MODULE)
    assert MODULE in bpy.context.preferences.addons
    bpy.ops.wm.save_userpref()
    print("HELD installed", flush=True)


def use(folder: str) -> None:
    if getattr(bpy.app, "module", False):  # which starts without anybody's preferences
        bpy.ops.wm.read_userpref()
    assert MODULE in bpy.context.preferences.addons, "it was not kept"
    package = sys.modules[MODULE]
    own = Path(package.__file__).resolve().parent
    assert folder in str(own), own
    print("HELD kept", flush=True)
    found = {info.id: info for info in sys.modules[f"{MODULE}.library"].criteria()}
    assert {"denoised", "fixed", "ggn", "halfbuf", "observer", "variance"} == set(found), found
    assert all(str(own) in info.path for info in found.values()), found
    assert os.access(own / "lib/lull/modules/lull-denoiser", os.X_OK)
    print("HELD criteria", flush=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 64
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 48, 36, 100
    scene.lull.block = 24
    for criterion in ("observer", "ggn", *(("denoised",) if EXTENSION else ())):  # by the denoiser of these Blenders
        scene.lull.folder = os.path.join(folder, criterion)
        os.mkdir(scene.lull.folder)
        scene.lull.criterion = criterion
        assert bpy.ops.lull.render() == {"FINISHED"} and "blocks converged" in scene.lull.state, scene.lull.state
        assert os.path.getsize(os.path.join(scene.lull.folder, "lull.exr")) > 1000
        print("HELD rendered by", criterion, flush=True)
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "cube.blend"))


{"install": install, "use": use}[ARGUMENTS[0]](*ARGUMENTS[1:])
