# SPDX-License-Identifier: MIT
"""Blender's Cycles as a host: rectangles of the current frame at ranges of samples, through the public API only.

Relies on what Cycles does with persistent data, a fixed seed, a pattern that allows it and a sample offset: samples [first,
first + count) of a pixel are those that one long render would take, whatever border is rendered, so that waves add up to it.
Each half is such a render, with a seed of its own. Halves of one sequence would be less even than the whole: at the edge of
a bright lamp they differ by far more than the picture is wrong.
The pixels come back through an uncompressed EXR, because the Render Result cannot be read in background mode; the file has
no name and lies in memory, so that it is gone with the process however that ends. Every setting that is touched is put
back on exit.
"""
from __future__ import annotations

import contextlib
import os
import sys
import time
from typing import Container, Iterator, Sequence

import bpy
import numpy as np

from .. import exr
from ..criterion import Rect
from ..program import open_closed
from .passes import Passes
from .view import unnamed_file

# Sobol-Burley under its names in 3.x and 4.x: its waves add up to one render. The others' tables depend on the total
# number of samples; they are usable where Cycles can be told that total apart from the subset to render (4.4 and later).
# Blender 4.3 lists Sobol-Burley for developers only, and its waves do not add up there either (off by 0.006 of white).
PATTERNS = ("SOBOL", "SOBOL_BURLEY")


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Without a window Blender prints a page per call: not to be seen for every wave."""
    if not bpy.app.background:
        yield
        return
    open_closed()
    with contextlib.suppress(AttributeError, OSError):  # closed; full, or nobody reads it
        sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


# Of the view layer: the picture, and what its denoiser would read
PLANES = {"color": [f"Combined.{c}" for c in "RGB"], "albedo": [f"Denoising Albedo.{c}" for c in "RGB"],
          "normal": [f"Denoising Normal.{c}" for c in "XYZ"]}

WAVE = 8  # samples

# Names of the colour passes by which Cycles divides light, in 4.x and in 5.x
COLOURS = {"diffuse": {"DiffCol", "Diffuse Color"}, "glossy": {"GlossCol", "Glossy Color"},
           "transmission": {"TransCol", "Transmission Color"}, "subsurface": {"SubsurfaceCol", "Subsurface Color"}}


def _joined(rects: Sequence[Rect], axis: int) -> list[Rect]:
    """Neighbours along an axis (0: x, 1: y) that are equal across it as one."""
    out: list[Rect] = []
    for r in sorted(rects, key=lambda r: (r[1 - axis], r[3 - axis], r[axis])):
        if out and (out[-1][1 - axis], out[-1][3 - axis], out[-1][axis + 2]) == (r[1 - axis], r[3 - axis], r[axis]):
            out[-1] = out[-1]._replace(**{"xy"[axis] + "1": r[axis + 2]})
        else:
            out.append(r)
    return out


def merge(rects: Sequence[Rect]) -> list[Rect]:
    """The same pixels in fewer rectangles: rows of neighbours first, then equal rows below each other."""
    return _joined(_joined(rects, 0), 1)


# What runs scripts before a render reads the scene's settings
_BEFORE = ("render_init", "render_pre", "frame_change_pre", "depsgraph_update_pre")

# Whose scenes are rendered: Cycles', and those of the add-on's own engine, which renders with Cycles
ENGINES = ("CYCLES", "LULL")


def _seconds(text: str) -> float:
    """Of a time as Cycles writes it, 01:02:03.45."""
    return sum(float(part) * 60.0 ** n for n, part in enumerate(reversed(text.split(":"))))


class HostError(Exception):
    """The scene cannot be rendered; one line for people."""


def _label(owner: object, name: str, value: str) -> str:
    """How the interface calls a value of an enum."""
    items = owner.bl_rna.properties[name].enum_items  # type: ignore[attr-defined]
    return items[value].name if value in items else value.replace("_", " ").title()


def _gpus() -> bpy.types.AddonPreferences:
    """Cycles' preferences: which processors it may use."""
    addon = bpy.context.preferences.addons.get("cycles")
    if addon is None:
        raise HostError("Cycles is not available: enable the add-on 'Cycles Render Engine' in the preferences")
    return addon.preferences


def choose_device(name: str) -> None:
    """Switches on every device of this kind in Blender's preferences, for this session."""
    gpus = _gpus()
    try:
        gpus.compute_device_type = "NONE" if name == "CPU" else name
    except TypeError:
        raise HostError(f"device {name}: this Blender's Cycles cannot use such a device") from None
    gpus.refresh_devices()
    for device in gpus.devices:
        device.use = device.type == name
    if name != "CPU" and not gpus.has_active_device():
        raise HostError(f"device {name}: Cycles finds none on this machine")


def curves_of(scene: bpy.types.Scene) -> Iterator[bpy.types.FCurve]:
    """Drivers and curves of the scene's own properties."""
    if (data := scene.animation_data) is None:
        return
    yield from data.drivers
    for action in filter(None, [data.action, *(strip.action for track in data.nla_tracks for strip in track.strips)]):
        bags = [bag for layer in getattr(action, "layers", ()) for strip in layer.strips for bag in strip.channelbags]
        for owner in bags or [action]:
            yield from getattr(owner, "fcurves", ())


class Cycles:
    """Use as a context manager around everything that renders. scene: borrowed; spp_max: the most samples of a pixel;
    denoised: its denoising passes are rendered, too; view_layer: which one, by name, "" = the first that is used. notes: lines
    for people about what is done otherwise than the scene says."""

    def __init__(self, scene: bpy.types.Scene, spp_max: int, denoised: bool = False, view_layer: str = ""):
        if not hasattr(scene, "cycles"):
            raise HostError("Cycles is not available: enable the add-on 'Cycles Render Engine' in the preferences")
        if scene.render.engine not in ENGINES:
            engine = _label(scene.render, "engine", scene.render.engine)
            raise HostError(f"scene '{scene.name}' renders with {engine}, not with Cycles: choose Cycles as its "
                            "render engine, or another scene")
        if scene.camera is None:
            raise HostError(f"scene '{scene.name}' has no camera: add one, or set the scene's active camera")
        if scene.cycles.device == "GPU" and not _gpus().has_active_device():
            raise HostError(f"scene '{scene.name}' renders on a GPU and Cycles has none switched on: choose a device, or "
                            "CPU")
        render = scene.render
        if render.use_multiview:
            raise HostError(f"scene '{scene.name}' renders several views: turn stereoscopy off")
        if view_layer and view_layer not in scene.view_layers:
            raise HostError(f"scene '{scene.name}' has no view layer '{view_layer}': {', '.join(scene.view_layers.keys())}")
        if not view_layer and not any(layer.use for layer in scene.view_layers):
            raise HostError(f"scene '{scene.name}' has no view layer that is used for rendering")
        self.scene, self.spp_max, self.denoised = scene, spp_max, denoised
        self.seeds = (scene.cycles.seed ^ 0x3504F333, scene.cycles.seed)  # of half B, of half A
        self.width = render.resolution_x * render.resolution_percentage // 100
        self.height = render.resolution_y * render.resolution_percentage // 100
        if not self.width * self.height:
            raise HostError(f"scene '{scene.name}': {render.resolution_percentage} % of its resolution are no pixel")
        self.threads, self.crop = render.threads, self._region()
        self.notes: list[str] = []
        self.layer = scene.view_layers[view_layer] if view_layer else next(layer for layer in scene.view_layers if layer.use)
        if bpy.app.autoexec_fail:
            self.notes.append("the file's Python scripts and drivers are not run, as Blender's preference Auto Run Python Scripts "
                              "says")
        if scene.cycles.use_denoising and not denoised:
            self.notes.append("the picture is not denoised: --denoise, or the panel's Denoise, keeps the denoised one")
        nodes = scene.compositing_node_group if hasattr(scene, "compositing_node_group") else scene.use_nodes
        if nodes and render.use_compositing:
            self.notes.append("the scene's compositor is not run: give it the picture by an Image node in place of Render "
                              "Layers")
        if any(getattr(self.layer, f"use_pass_cryptomatte_{kind}") for kind in ("object", "material", "asset")):
            self.notes.append("Cryptomatte passes are left out: render them apart, a few samples are enough")
        if not view_layer and (others := [layer.name for layer in scene.view_layers if layer.use and layer != self.layer]):
            self.notes.append(f"only the view layer '{self.layer.name}' is rendered, not {', '.join(others)}")
        self.pattern = self._choose_pattern()
        self._touched: list[tuple[object, str, object]] = []
        self._wave = contextlib.ExitStack()
        self._asked: list[tuple[object, str, object]] = []  # what the wave in the making needs
        self.render_s = self.samples_s = 0.0  # wall seconds of all renders, and of their samples

    def device(self) -> str:
        """What it renders on, by name."""
        if self.scene.cycles.device == "CPU":
            return "CPU"
        gpus = _gpus()
        return f"{gpus.compute_device_type}: {', '.join(d.name for d in gpus.devices if d.use)}"

    def _region(self) -> Rect:
        """The scene's own render region in pixels from the top, or the whole picture."""
        r = self.scene.render
        if not r.use_border:
            return Rect(0, 0, self.width, self.height)
        x0, x1 = (int(np.float32(x) * np.float32(self.width)) for x in (r.border_min_x, r.border_max_x))  # as Blender cuts
        y1, y0 = (self.height - int(np.float32(y) * np.float32(self.height)) for y in (r.border_min_y, r.border_max_y))
        if x0 >= x1 or y0 >= y1:
            raise HostError(f"scene '{self.scene.name}': its render region holds no pixel")
        return Rect(x0, y0, x1, y1)

    def __enter__(self) -> Cycles:
        render, cycles = self.scene.render, self.scene.cycles
        path = self._wave.enter_context(unnamed_file())
        try:
            self._set(render, engine="CYCLES", use_persistent_data=True, use_single_layer=False, use_border=True, use_crop_to_border=True,
                      use_compositing=False, use_sequencer=False, use_overwrite=True, use_placeholder=False,
                      use_file_extension=False, filepath=path)
            for name in ("border_min_x", "border_min_y", "border_max_x", "border_max_y"):
                self._set(render, **{name: getattr(render, name)})  # to be put back
            self._set(render.image_settings, media_type="MULTI_LAYER_IMAGE", file_format="OPEN_EXR_MULTILAYER",
                      color_mode="RGBA", color_depth="32", exr_codec="NONE", use_exr_interleave=True,
                      color_management="FOLLOW_SCENE")
            self._set(cycles, use_adaptive_sampling=False, use_denoising=False, use_layer_samples="IGNORE", time_limit=0.0,
                      use_sample_subset=True, sample_offset=0, samples=1, sample_subset_length=1)
            self._set(cycles, sampling_pattern=self.pattern, seed=cycles.seed)
            for layer in self.scene.view_layers:
                self._set(layer, use=layer == self.layer)
            for hook in (getattr(bpy.app.handlers, name) for name in _BEFORE):
                hook.append(self._hold)
                self._wave.callback(hook.remove, self._hold)
            self._set(self.layer, use_pass_combined=True)
            self._find_passes()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _set(self, owner: object, **settings: object) -> None:
        """Sets those of the settings that this Blender has, to be put back on exit. What animates them would set them back in
        each render: halves of one seed would be equal."""
        known = {name: value for name, value in settings.items() if hasattr(owner, name)}
        self._touched += [(owner, name, getattr(owner, name)) for name in known]  # before one changes another
        for curve in curves_of(self.scene):
            if not curve.mute and self._animates(curve, owner, known):
                self._touched.append((curve, "mute", False))
                curve.mute = True
        for name, value in known.items():
            setattr(owner, name, value)

    def _animates(self, curve: bpy.types.FCurve, owner: object, names: Container[str]) -> bool:
        place, _, name = curve.data_path.rpartition(".")
        try:
            return name in names and self.scene.path_resolve(place) == owner
        except ValueError:  # what it animated is gone
            return False

    def _hold(self, *_: object) -> None:
        """After the file's own scripts, and other add-ons', which may set the seed of each frame."""
        for owner, name, value in self._asked:
            if getattr(owner, name) != value:
                setattr(owner, name, value)

    def _find_passes(self) -> None:
        """Switches on the colours by which Cycles divides light, and asks one sample of one pixel which passes there are."""
        hidden = set()
        for family, names in COLOURS.items():
            colour = f"use_pass_{family}_color"
            if not getattr(self.layer, colour) and (getattr(self.layer, f"use_pass_{family}_direct") or
                                                    getattr(self.layer, f"use_pass_{family}_indirect")):
                self._set(self.layer, **{colour: True})
                hidden |= names
        x, y = self.crop[:2]
        borrowed = self.denoised and not self.layer.cycles.denoising_store_passes
        if borrowed:
            self._set(self.layer.cycles, denoising_store_passes=True)
        channels = [name for name in self._render_area(Rect(x, y, x + 1, y + 1), 0, 1)
                    if not (borrowed and name.startswith("Denoising "))]
        self.passes = Passes(self.layer.name, channels, (self.width, self.height), hidden,
                             self.scene.render.film_transparent)

    def _choose_pattern(self) -> str:
        """The scene's own sampling pattern if its waves add up to one render, else one whose waves do."""
        cycles = self.scene.cycles
        own = cycles.sampling_pattern
        if own in PATTERNS or hasattr(cycles, "use_sample_subset"):
            return own
        for name in PATTERNS:
            try:
                cycles.sampling_pattern = name
            except TypeError:
                continue  # no such pattern in this version
            cycles.sampling_pattern = own
            self.notes.append(f"the sampling pattern is {_label(cycles, 'sampling_pattern', name)} instead of the scene's "
                              f"{_label(cycles, 'sampling_pattern', own)}, whose waves do not add up to one render")
            return name
        raise HostError("this Cycles has no pattern whose waves add up to one render: use Blender 3.x, or 4.4 or later")

    def __exit__(self, *_: object) -> None:
        self._asked = []
        for owner, name, value in self._touched:  # in order: what a file format allows depends on the format
            setattr(owner, name, value)
        self._touched.clear()
        self._wave.close()

    # --- rendering -----------------------------------------------------------------------------------------------------

    def render(self, rects: Sequence[Rect], first: int, count: int, half: bool) -> Iterator[dict[str, np.ndarray]]:
        """The driver's render function: means of samples [first, first + count) of waves of WAVE, float32, per rectangle:
        "color" [h, w, 3], the planes of PLANES likewise, and the passes [h, w]."""
        planes = PLANES if self.denoised else {"color": PLANES["color"]}
        own_first = first // (2 * WAVE) * WAVE  # in its half, as every pair of waves is split
        areas = {area: self._render_area(area, own_first, count, half) for area in merge(rects)}
        for r in rects:
            area, channels = next((a, c) for a, c in areas.items() if a.x0 <= r.x0 < a.x1 and a.y0 <= r.y0 < a.y1)
            at = np.s_[r.y0 - area.y0:r.y1 - area.y0, r.x0 - area.x0:r.x1 - area.x0]
            part = {name: plane[at] for name, plane in channels.items()}
            yield {**{plane: np.stack([part[name] for name in names], -1) for plane, names in planes.items()},
                   **self.passes.sample(part, r, first)}

    def _render_area(self, area: Rect, first: int, count: int, half: bool = True) -> dict[str, np.ndarray]:
        """The view layer's channels, [h, w] float32; of half A, whose seed is the scene's, or of B."""
        render, cycles, subset = self.scene.render, self.scene.cycles, hasattr(self.scene.cycles, "use_sample_subset")
        # Blender cuts border · size down to whole pixels, in single precision: aim inside the pixel. Rows are from below.
        asked = [(render, "border_min_x", (area.x0 + 0.25) / self.width), (render, "border_max_x", (area.x1 + 0.25) / self.width),
                 (render, "border_min_y", (self.height - area.y1 + 0.25) / self.height),
                 (render, "border_max_y", (self.height - area.y0 + 0.25) / self.height), (cycles, "seed", self.seeds[half]),
                 (cycles, "sample_offset", first), (cycles, "samples", self.spp_max if subset else count),
                 *([(cycles, "sample_subset_length", count)] if subset else [])]
        for owner, name, value in asked:
            setattr(owner, name, value)
        self._asked = [(owner, name, getattr(owner, name)) for owner, name, _ in asked]  # in single precision, as it is kept
        begin_s = time.monotonic()
        with _silence():
            status = bpy.ops.render.render(write_still=True, scene=self.scene.name)
        self.render_s += time.monotonic() - begin_s
        if "FINISHED" not in status:
            raise HostError("Cycles did not finish the wave")
        self.samples_s += _seconds(exr.texts(render.filepath).get(f"cycles.{self.layer.name}.render_time", "0"))
        channels, _ = exr.read(render.filepath)
        own = f"{self.layer.name}."
        channels = {name.removeprefix(own): plane for name, plane in channels.items() if name.startswith(own)}
        shape = channels["Combined.R"].shape
        if shape != (area.height, area.width):
            raise HostError(f"Cycles rendered {shape[1]}x{shape[0]} pixels for a border of {area.width}x{area.height}")
        return channels
