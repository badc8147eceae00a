# SPDX-License-Identifier: MIT
"""The add-on: Render properties → Lull, with settings per scene, a button, and picture and stop map as images of
Blender's."""
import os
import textwrap
import time
from typing import Optional

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from .. import outputs, quote
from ..criterion import load
from ..denoising import criterion_of
from ..driver import Result
from ..library import criteria, search_path
from . import engine, shown
from .cycles import ENGINES
from .session import REFUSED, Session, Settings, check_files, default_output

_items: list[tuple[str, str, str]] = []  # kept: Blender does not copy the texts of dynamic enums
_running = False  # a render is in the making: its settings are not to be shown, since it lends some of the scene's
_visible: dict[str, float] = {}  # criteria whose quality parameter is the share of viewers, with their default, 0 = none
_by_error: set[str] = set()  # criteria that can stop at a multiple of what is just seen


def _criteria(_self: object, _context: object) -> list[tuple[str, str, str]]:
    if not _items:
        found = [c for c in criteria() if c.id != "null"]
        found.sort(key=lambda c: (c.id != "observer", c.id))
        _items.extend((c.id, c.name, c.description) for c in found)
        _visible.update((c.id, float(p.default or 0)) for c in found if (p := c.parameter("visible")) and p.type == "float")
        _by_error.update(c.id for c in found if c.parameter("error"))
        if not _items:
            _items.append(("none", "none found", f"No criteria in {', '.join(search_path())}: set LULL_PLUGIN_PATH"))
    return _items


def _choose_criterion(settings: bpy.types.PropertyGroup, _context: object) -> None:
    """The one that judges the picture that is kept now, unless another was chosen."""
    if settings.criterion in ("observer", "denoised"):
        settings.criterion = criterion_of("blend" if settings.denoise else "")


class LullSettings(bpy.types.PropertyGroup):
    """Kept with the scene."""
    criterion: EnumProperty(name="Criterion", items=_criteria, description="What decides that a block may stop")
    quality: EnumProperty(name="Quality", default="final", items=[
        ("draft", "Draft", "The error is at most 4 times what is just seen: about a sixteenth of the samples"),
        ("good", "Good", "At most 2 times what is just seen: about a quarter of the samples"),
        ("final", "Final", "Nothing is seen, by the share of viewers below")])
    share: FloatProperty(options={"HIDDEN"})  # as chosen; 0 = not at all
    visible: FloatProperty(name="Visible To", min=0, max=.9999, subtype="FACTOR", precision=3,
                           get=lambda self: self.share or _visible.get(self.criterion, 0.0),
                           set=lambda self, value: setattr(self, "share", value),
                           description="Stop a block when at most this share of viewers would still see its noise; 0 = the "
                           "criterion's own")
    denoise: BoolProperty(name="Denoise", default=False, update=_choose_criterion, description="Keep the denoised picture; "
                          "the criterion 'Denoised picture' stops by what is seen of it. Needs Open Image Denoise")
    kept: EnumProperty(name="Keep", items=[
        ("blend", "Blend", "As much of the noisy picture as the denoiser is wrong"), ("full", "Denoised", "Nothing of it")])
    parameters: StringProperty(name="Parameters", description="KEY=VALUE pairs of the criterion, with spaces between; for "
                               "example first-spp=64")
    spp_min: IntProperty(name="Min Samples", default=16, min=1, description="Samples before the first decision")
    block: IntProperty(name="Block Size", default=0, min=0, max=4096, subtype="PIXEL",
                       description="Pixels; 0 = what the criterion was made for, less where that would be fewer than 12 "
                       "blocks")
    mask: StringProperty(name="Mask", subtype="FILE_PATH", description="A PNG of the picture's size: lighter regions are "
                         "rendered better")
    folder: StringProperty(name="Output", subtype="DIR_PATH", description="Folder for picture, stop map and report; empty: "
                           "where the scene's output path says, else a temporary one")
    state: StringProperty(options={"SKIP_SAVE"})

    def wanted(self) -> Settings:
        """As the session wants them, without files; ValueError for a pair without '='."""
        pairs = self.parameters.split()
        if bad := [p for p in pairs if "=" not in p]:
            raise ValueError(f"parameter {bad[0]}: expected KEY=VALUE")
        quality = {"visible": f"{self.share:.6g}"} if self.share and self.criterion in _visible else {}
        if self.criterion in _by_error and self.quality != "final":
            quality = {"error": {"draft": "4", "good": "2"}[self.quality]}
        return Settings(self.criterion, {**quality, **dict(p.split("=", 1) for p in pairs)}, self.spp_min,
                        block=self.block or None, mask=bpy.path.abspath(self.mask) if self.mask else "",
                        denoise=self.kept if self.denoise else "")

    def chosen(self, scene: bpy.types.Scene, frame: Optional[int] = None) -> Settings:
        """With the files that the buttons write; ValueError for a name that is taken."""
        settings = self.wanted()
        if self.folder:
            settings.output = os.path.join(bpy.path.abspath(self.folder), "lull.exr")
            settings = settings.numbered(frame)
        else:
            settings.output = default_output(scene, frame, os.path.join(bpy.app.tempdir, "lull.exr"))
        base = settings.output[:-len(".exr")]
        settings.stop_map, settings.report = f"{base}-stop-map.png", f"{base}-report.json"
        return settings


class LULL_OT_render(bpy.types.Operator):
    """Render with Cycles, each block until its noise can no longer be seen. Esc keeps what there is"""
    bl_idname = "lull.render"
    bl_label = "Render Until Noise Is Invisible"

    animation: BoolProperty(name="Animation", default=False, description="The scene's frame range, into numbered files; "
                            "pilots of some frames say first what all will cost")

    _session: Session = None  # type: ignore[assignment] # until the first frame begins
    _timer = None
    _price = ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """There is a scene, and Cycles."""
        return context.scene is not None and hasattr(context.scene, "cycles")

    def _plan(self, context: bpy.types.Context) -> bool:
        """What is asked for, looked at before the first sample."""
        scene = context.scene
        frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step) if self.animation else [None]
        try:
            self._frames = [(frame, scene.lull.chosen(scene, frame)) for frame in frames]
            if not self._frames:
                raise ValueError("the scene's frame range is empty")
            with load(self._frames[0][1].criterion, **self._frames[0][1].parameters) as criterion:
                check_files([settings for _, settings in self._frames], criterion)
        except REFUSED as error:
            self.report({"ERROR"}, str(error))
            return False
        self._count, self._costs = len(self._frames), []
        self._pilots = quote.pilots(self._count) if self._count > 1 else []
        return self._begin(context)

    def _begin(self, context: bpy.types.Context) -> bool:
        """The next pilot or frame."""
        scene = context.scene
        self._pilot = self._pilots.pop(0) if self._pilots else None
        frame, settings = self._frames.pop(0) if self._pilot is None else self._frames[self._pilot]
        if frame is not None:
            scene.frame_set(frame)
        try:
            session = Session(scene, settings)
        except REFUSED as error:
            self.report({"ERROR"}, str(error))
            return False
        self._session, self._quoted, self._show_at_s = session, False, 0.0
        session.begin()
        for note in session.notes:
            self.report({"WARNING"}, note)
        return True

    def _step(self, context: bpy.types.Context) -> Optional[Result]:
        """The end, or None; now and then the picture is shown."""
        global _running
        session = self._session
        result = session.step()
        if self._pilot is not None:
            context.scene.lull.state = f"What will it cost? Pilot {len(self._costs) + 1}, {len(self._pilots)} more"
            if result is None and quote.pilot_done(session.driver):
                result = Result("done")
            _running = result is None
            return result
        if session.quote and not self._quoted:
            self._quoted = True
            self.report({"INFO"}, session.quote)
        now_s = time.monotonic()
        if result is None and now_s >= self._show_at_s:
            shown.show_picture(session.frame)
            if context.screen:
                shown.show_in_editors(context.screen)
            self._show_at_s = time.monotonic() + max(1.0, 20 * (time.monotonic() - now_s))  # a twentieth of the time
        _running = result is None
        context.scene.lull.state = "\n".join([outputs.progress_text(session.driver).strip(), *session.notes,
                                              *session.quote.split("; "), self._price])
        return result

    def _step_or_cancel(self, context: bpy.types.Context) -> Optional[Result]:
        """An error of ours must not leave the scene's settings changed, nor the panel waiting."""
        try:
            return self._step(context)
        except BaseException:
            self.cancel(context)
            raise

    def _end_pilot(self, context: bpy.types.Context, result: Result) -> bool:
        """Keeps what it says; whether the shot goes on."""
        session, ended = self._session, result.outcome in ("interrupt", "failed")
        assert self._pilot is not None
        if not ended:
            self._costs.append((self._pilot, quote.chosen(session.driver)))
        session.__exit__()
        if ended:
            context.scene.lull.state = "Stopped before the first frame"
            if result.exception:
                self.report({"ERROR"}, f"Rendering failed: {result.exception}")
        elif not self._pilots:
            unknown = f"{self._count} frames: the criterion cannot tell what they cost"
            self._price = quote.shot(self._costs, self._count) or unknown
            self.report({"INFO"}, self._price)
        return not ended

    def _end(self, context: bpy.types.Context, result: Result) -> bool:
        """Writes the frame; whether there is another one to render."""
        if self._pilot is not None:
            return self._end_pilot(context, result)
        session, settings = self._session, context.scene.lull
        session.__exit__()
        written, failed = session.write(result)
        shown.show_picture(session.frame, session.denoised)
        for name, path in ((shown.PICTURE, session.settings.output), (shown.STOP_MAP, session.settings.stop_map)):
            if path in written:
                shown.keep(name, path)
        settings.state = "\n".join([session.summary(), *session.notes, *written, self._price])
        for text in failed:
            self.report({"ERROR"}, text)
        if result.exception:
            self.report({"ERROR"}, f"Rendering failed, what was rendered is kept: {result.exception}")
        elif not failed:
            self.report({"INFO"}, session.summary())
        return bool(self._frames) and result.outcome not in ("interrupt", "failed")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """From a script: pilots and every frame, before it returns."""
        more = self._plan(context)
        if not more:
            return {"CANCELLED"}
        while more:
            while (result := self._step_or_cancel(context)) is None:
                pass
            more = self._end(context, result) and self._begin(context)
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """From the button: begins the first frame; modal() goes on."""
        if not self._plan(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.05, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """A step for each tick of the timer; Esc ends the render and keeps the picture."""
        driver = self._session.driver
        if event.type == "ESC":
            driver.interrupt()
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        result = self._step_or_cancel(context)
        context.workspace.status_text_set(None if result else f"Lull: {outputs.progress_text(driver)}   Esc: stop and keep")
        for area in context.screen.areas:
            area.tag_redraw()
        if result is None or (self._end(context, result) and self._begin(context)):
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self._timer)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes, or opens another file."""
        global _running
        _running = False
        if self._session:
            self._session.__exit__()


class LULL_PT_render(bpy.types.Panel):
    """Cycles stops each block when its noise can no longer be seen"""
    bl_label = "Lull"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = set(ENGINES)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """The scene renders with Cycles, or with our engine."""
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context: bpy.types.Context) -> None:
        """Settings, buttons, the state of the render and the small pictures."""
        layout, settings, cycles = self.layout, context.scene.lull, context.scene.cycles
        layout.use_property_split, layout.use_property_decorate = True, False
        if _running:
            layout.label(text="Esc: stop and keep", icon="INFO")
        else:
            quality = ("quality",) if settings.criterion in _by_error else ()
            if settings.criterion in _visible and (settings.quality == "final" or not quality):
                quality += ("visible",)
            for properties in (((settings, "criterion"), *((settings, d) for d in quality), (settings, "parameters")),
                               ((settings, "spp_min"), (cycles, "samples"), (cycles, "time_limit")),
                               ((settings, "denoise"), *(((settings, "kept"),) if settings.denoise else ())),
                               ((settings, "block"), (settings, "mask"), (settings, "folder"))):
                column = layout.column(align=True)
                for owner, name in properties:
                    column.prop(owner, name, **({"text": "Max Samples"} if name == "samples" else {}))
            layout.operator("lull.render", icon="RENDER_STILL")
            layout.operator("lull.render", text="Render Animation", icon="RENDER_ANIMATION").animation = True
        column = layout.column(align=True)
        column.scale_y = 0.8
        letters = max(20, int(context.region.width / (7 * context.preferences.system.ui_scale)) - 6)  # about, of a line
        for line in settings.state.splitlines():
            for part in textwrap.wrap(line, letters):
                column.label(text=part)
        pictures = layout.row()
        for name in (shown.PICTURE, shown.STOP_MAP):
            if icon := shown.icon(name):
                pictures.template_icon(icon_value=icon, scale=10)


CLASSES = (LullSettings, LULL_OT_render, LULL_PT_render)


def register() -> None:
    """Blender switches the add-on on: classes, and the settings of each scene."""
    shown.register()
    for c in CLASSES:
        bpy.utils.register_class(c)
    engine.register()
    bpy.types.Scene.lull = PointerProperty(type=LullSettings)


def unregister() -> None:
    """Blender switches the add-on off."""
    engine.unregister()
    shown.unregister()
    del bpy.types.Scene.lull
    for c in reversed(CLASSES):
        bpy.utils.unregister_class(c)
