# SPDX-License-Identifier: MIT
"""The add-on: Render properties → Lull, with settings per scene, a button, and the stop map as an image of Blender's."""
import os
import tempfile
from typing import Optional

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from .. import outputs, stopmap
from ..library import LullError, criteria, search_path
from .cli import summary
from .cycles import HostError
from .session import Session, Settings

REFUSED = (HostError, LullError, ValueError, OSError, RuntimeError)
_items: list[tuple[str, str, str]] = []  # kept: Blender does not copy the texts of dynamic enums
_with_visible: set[str] = set()  # criteria whose dial is the share of viewers


def _criteria(_self, _context) -> list[tuple[str, str, str]]:
    if not _items:
        found = [c for c in criteria() if c.id != "null"]
        found.sort(key=lambda c: (c.id != "observer", c.id))
        _items.extend((c.id, c.name, c.description) for c in found)
        _with_visible.update(c.id for c in found if c.parameter("visible"))
        if not _items:
            _items.append(("none", "none found", f"No criteria in {', '.join(search_path())}: set LULL_PLUGIN_PATH"))
    return _items


class LullSettings(bpy.types.PropertyGroup):
    """Kept with the scene."""
    criterion: EnumProperty(name="Criterion", items=_criteria, description="What decides that a block may stop")
    visible: FloatProperty(name="Visible To", default=.25, min=.0001, max=.9999, subtype="FACTOR", precision=3,
                           description="Stop a block when at most this share of viewers would still see its noise")
    parameters: StringProperty(name="Parameters", description="KEY=VALUE pairs of the criterion, with spaces between; for "
                               "example first-spp=64")
    spp_min: IntProperty(name="Min Samples", default=16, min=1, description="Samples before the first decision")
    spp_max: IntProperty(name="Max Samples", default=4096, min=1, description="Every block stops here")
    time_budget_s: FloatProperty(name="Time Limit", default=0, min=0, subtype="TIME_ABSOLUTE", unit="TIME_ABSOLUTE",
                                 description="Seconds for the frame, 0 = none; the first limit reached wins")
    block: IntProperty(name="Block Size", default=0, min=0, max=4096, subtype="PIXEL",
                       description="Pixels; 0 = what the criterion was made for")
    mask: StringProperty(name="Mask", subtype="FILE_PATH", description="A PNG of the picture's size: lighter regions are "
                         "rendered better")
    folder: StringProperty(name="Output", subtype="DIR_PATH", description="Folder for picture, stop map and report; empty: "
                           "a temporary one")
    state: StringProperty(options={"SKIP_SAVE"})

    def chosen(self, folder: str) -> Settings:
        """As the session wants them; ValueError for a pair without '='."""
        pairs = self.parameters.split()
        if bad := [p for p in pairs if "=" not in p]:
            raise ValueError(f"parameter {bad[0]}: expected KEY=VALUE")
        dial = {"visible": f"{self.visible:.6g}"} if self.criterion in _with_visible else {}
        return Settings(self.criterion, {**dial, **dict(p.split("=", 1) for p in pairs)}, self.spp_min, self.spp_max,
                        self.time_budget_s, self.block or None, mask=bpy.path.abspath(self.mask) if self.mask else "",
                        output=os.path.join(folder, "lull.exr"), stop_map=os.path.join(folder, "lull-stop-map.png"),
                        report=os.path.join(folder, "lull-report.json"))


class LULL_OT_render(bpy.types.Operator):
    """Render with Cycles, each block until its noise can no longer be seen. Esc keeps what there is"""
    bl_idname = "lull.render"
    bl_label = "Render Until Noise Is Invisible"

    animation: BoolProperty(name="Animation", default=False, description="The scene's frame range, into numbered files")

    _session: Optional[Session] = None
    _timer = None

    @classmethod
    def poll(cls, context):
        return context.scene is not None and hasattr(context.scene, "cycles")

    def _begin(self, context) -> bool:
        """The next frame."""
        scene = context.scene
        frame = next(self._frames)
        self._suffix = "" if frame is None else f"_{frame:04}"
        if frame is not None:
            scene.frame_set(frame)
        try:
            self._session = Session(scene, scene.lull.chosen(self._folder))
            self._session.__enter__()
        except REFUSED as error:
            self._session = None
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _plan(self, context) -> bool:
        scene = context.scene
        folder = scene.lull.folder
        self._folder = bpy.path.abspath(folder) if folder else tempfile.mkdtemp(prefix="lull-")
        frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step) if self.animation else [None]
        self._left = len(frames)
        self._frames = iter(frames)
        return self._begin(context)

    def _end(self, context, result) -> bool:
        """Writes the frame; whether there is another one to render."""
        session, settings = self._session, context.scene.lull
        session.__exit__()
        try:
            written = session.write(result, self._suffix)
        except OSError as error:
            self.report({"ERROR"}, str(error))
            return False
        settings.state = summary(session)
        for name, path in (("Lull", written[0]), ("Lull Stop Map", written[1])):
            image = bpy.data.images.get(name) or bpy.data.images.new(name, 1, 1)
            image.source, image.filepath = "FILE", path
            image.reload()
        if result.exception:
            self.report({"ERROR"}, f"Rendering failed, what was rendered is kept: {result.exception}")
        else:
            self.report({"INFO"}, settings.state)
        self._left -= 1
        return self._left > 0 and result.outcome not in ("interrupt", "failed")

    def execute(self, context):
        more = self._plan(context)
        if not more:
            return {"CANCELLED"}
        while more:
            more = self._end(context, self._session.driver.run()) and self._begin(context)
        return {"FINISHED"}

    def invoke(self, context, _event):
        if not self._plan(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.05, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        driver = self._session.driver
        if event.type == "ESC":
            driver.interrupt()
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        result = driver.step()
        text = outputs.progress_text(driver)
        context.scene.lull.state = text
        context.workspace.status_text_set(None if result else f"Lull: {text}   Esc: stop and keep")
        for area in context.screen.areas:
            area.tag_redraw()
        if result is None or (self._end(context, result) and self._begin(context)):
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self._timer)
        return {"FINISHED"}


class LULL_PT_render(bpy.types.Panel):
    bl_label = "Lull"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {"CYCLES"}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context):
        layout, settings = self.layout, context.scene.lull
        layout.use_property_split, layout.use_property_decorate = True, False
        dial = ("visible",) if settings.criterion in _with_visible else ()
        for names in (("criterion", *dial, "parameters"), ("spp_min", "spp_max", "time_budget_s"),
                      ("block", "mask", "folder")):
            column = layout.column(align=True)
            for name in names:
                column.prop(settings, name)
        layout.operator("lull.render", icon="RENDER_STILL")
        layout.operator("lull.render", text="Render Animation", icon="RENDER_ANIMATION").animation = True
        if settings.state:
            for line in settings.state.replace("  ", "\n").splitlines():
                layout.label(text=line)
        if image := bpy.data.images.get("Lull Stop Map"):
            image.preview_ensure()
            layout.template_icon(icon_value=image.preview.icon_id, scale=10)


CLASSES = (LullSettings, LULL_OT_render, LULL_PT_render)


def register() -> None:
    for c in CLASSES:
        bpy.utils.register_class(c)
    bpy.types.Scene.lull = PointerProperty(type=LullSettings)


def unregister() -> None:
    del bpy.types.Scene.lull
    for c in reversed(CLASSES):
        bpy.utils.unregister_class(c)
