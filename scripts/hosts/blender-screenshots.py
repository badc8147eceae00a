# SPDX-License-Identifier: MIT
"""Blender in a window: renders with the add-on and keeps a picture of its panel beside the stop map; and one made while it
renders, OUT-rendering.png, beside the picture so far.

    xvfb-run -a -s "-screen 0 1280x760x24" blender FILE.blend -noaudio -p 0 0 1280 760 \\
        --python scripts/hosts/blender-screenshots.py -- OUT.png [CRITERION]
"""
import sys
import tempfile
from pathlib import Path

import bpy

out, criterion = (sys.argv[sys.argv.index("--") + 1:] + ["observer"])[:2]
during = str(Path(out).resolve())[:-len(".png")] + "-rendering.png"
if "lull" not in bpy.context.preferences.addons:  # else the add-on is tried as it is installed
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin-api" / "python"))
    import lull
    lull.register()
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.lull.criterion, scene.lull.folder = criterion, tempfile.mkdtemp(prefix="lull-")
scene.lull.block, scene.cycles.samples = 80, 1024
for panel in bpy.types.Panel.__subclasses__():  # the other panels would push ours out of the picture
    if getattr(panel, "bl_context", "") == "render" and panel.__name__ != "LULL_PT_render" and panel.is_registered:
        bpy.utils.unregister_class(panel)


def area(kind):
    return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)


def begin():
    window = bpy.context.window_manager.windows[0]
    left = area("VIEW_3D")
    with bpy.context.temp_override(window=window, area=left):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=.62)
    right = max((a for a in window.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.x)
    right.type = "PROPERTIES"
    left = area("VIEW_3D")
    left.type = "IMAGE_EDITOR"
    with bpy.context.temp_override(window=window, area=left):
        bpy.ops.lull.render("INVOKE_DEFAULT")
    bpy.app.timers.register(show, first_interval=1)


def properties():
    for a in bpy.context.window_manager.windows[0].screen.areas:
        if a.type == "PROPERTIES":
            a.spaces[0].context = "RENDER"


def show():
    properties()
    if "takes about" not in scene.lull.state and "Lull Stop Map" not in bpy.data.images:
        return .5  # before the first check
    bpy.app.timers.register(show_stops, first_interval=4)


def show_stops():
    if "Lull Stop Map" not in bpy.data.images:
        if not Path(during).exists():
            bpy.ops.screen.screenshot(filepath=during)
        return 1
    area("IMAGE_EDITOR").spaces[0].image = bpy.data.images["Lull Stop Map"]
    bpy.app.timers.register(keep, first_interval=3)


def keep():
    bpy.ops.screen.screenshot(filepath=str(Path(out).resolve()))
    bpy.ops.wm.quit_blender()


bpy.app.timers.register(begin, first_interval=2)
