# SPDX-License-Identifier: MIT
"""What a run leaves behind, in the form of the path tracer: EXR with layers, preview, stop map, report; and its progress
line."""
from __future__ import annotations

import ctypes as C
import math
import sys
import time
from typing import Mapping, Optional, TextIO

import numpy as np

from . import abi, exr
from .denoising import Denoised
from .driver import Driver
from .files import file_call, srgb, srgb_encoded, write_png
from .frame import Frame
from .host import HostFrame, reasons
from .library import bytes_of, encoded, library
from .program import say
from .version import SOFTWARE


def write_exr(path: str, driver: Driver, scene: str = "", software: str = SOFTWARE,
              more: Optional[Mapping[str, Optional[np.ndarray]]] = None, denoised: Optional[Denoised] = None) -> None:
    """R, G, B and the layer lull, which image programs show as spp, p_noisy, error and reason, then those of the frame;
    cut to the crop. more: further channels over the frame's view, or instead of its layers; None leaves one out.
    denoised: R, G, B are its picture, and the layers of docs/denoised.md are written."""
    frame = driver.frame
    values = {"p_noisy": lambda b: b.p_noisy, "error": lambda b: b.error, "reason": lambda b: reasons().index(b.reason)}
    channels = {**dict(zip("RGB", np.moveaxis(frame.mean(), -1, 0))), "lull.spp.V": frame.spp(),
                **{f"lull.{name}.V": frame.per_pixel(value) for name, value in values.items()},
                **(_denoised_layers(frame, denoised) if denoised else {}),
                **{name: frame.mean(name) for name in frame.layers}, **(more or {})}
    info = frame.criterion.info
    given = {p.name: frame.criterion.parameters.get(p.name, p.default) for p in info.parameters}
    settings = "".join(f" {key}={value}" for key, value in given.items() if value is not None)
    exr.write(path, {name: frame.cropped(plane) for name, plane in channels.items() if plane is not None},
              (frame.width, frame.height), frame.crop[:2], {
        "lull:scene": scene, "lull:criterion": f"{info.id} {info.version}{settings}",
        "lull:reasons": " ".join(f"{i}={name}" for i, name in enumerate(reasons())),
        "lull:block": f"{frame.layout.block_width}x{frame.layout.block_height}", "lull:seed": float(frame.seed),
        "lull:samples": float(driver.totals.samples), **_view(frame), "software": software})


# Greys of lull:view: from 2^_VIEW_LOW over so many octaves
_VIEW_LOW, _VIEW_OCTAVES, _VIEW_PER_OCTAVE = -14, 22, 16


def _view(frame: Frame) -> dict[str, str]:
    """How a frame shows greys, as lull-report reads it; {}: by the sRGB transfer alone."""
    if not frame.display and frame.shown["exposure"] == 1.0 and frame.shown["transfer"] == "srgb":
        return {}
    steps = np.arange(_VIEW_OCTAVES * _VIEW_PER_OCTAVE + 1) / _VIEW_PER_OCTAVE
    greys = np.append(0.0, np.exp2(_VIEW_LOW + steps))
    codes = srgb_encoded(frame.displayed(np.repeat(greys[:, None], 3, 1))[:, 1])
    return {"lull:view": f"{_VIEW_LOW} {_VIEW_PER_OCTAVE} " + " ".join(str(round(c)) for c in 65535 * codes)}


def _denoised_layers(frame: Frame, denoised: Denoised) -> dict[str, np.ndarray]:
    pictures = {"": denoised.picture, "noisy.": frame.mean(), "denoised.": denoised.denoised}
    layers = {f"{name}{c}": rgb[..., k] for name, rgb in pictures.items() for k, c in enumerate("RGB")}
    for name, errors in (("error", denoised.error), ("noisy_error", denoised.noisy_error)):
        by_block = {b.id: error for b, error in zip(frame.blocks, errors)}
        layers[f"lull.{name}.V"] = frame.per_pixel(lambda b: by_block[b.id])
    return {**layers, "lull.weight.V": denoised.weight}


def is_ours(path: str) -> bool:
    """Is this a picture of Lull's, or none at all? What is another program's must not be replaced unless somebody says
    so."""
    try:
        with open(encoded(path), "rb") as file:
            begin = file.read(4096)
    except OSError:
        return True
    return not begin or b"lull.spp" in begin


def shown(frame: Frame, denoised: Optional[Denoised] = None) -> np.ndarray:
    """[h, w, 3] uint8, cut to the crop: as the criterion takes it to be shown."""
    return srgb(frame.displayed(frame.cropped(denoised.picture if denoised else frame.mean())))


def write_preview(path: str, driver: Driver, denoised: Optional[Denoised] = None) -> None:
    """PNG, as the frame is shown."""
    write_png(path, shown(driver.frame, denoised))


def write_stop_map(path: str, frame: HostFrame, scene: str = "") -> None:
    """Each block in the colour of its samples, the count written into it; or with the ending .csv one line
    `name;spp;spp;…;` in the order of the blocks. scene: the file that gives the line its name."""
    file_call("host_stop_map", C.byref(frame.layout), encoded(path), encoded(scene))


def write_report(path: str, driver: Driver, scene: str = "", kernel: str = "", interrupted: bool = False,
                 mask: Optional[str] = None, denoised: Optional[Denoised] = None) -> None:
    """Everything about the run as JSON, as the path tracer's --report; null: not known. mask: its file."""
    file_call("host_report_write", driver.frame.handle.pointer,
              C.byref(_report(driver, scene, kernel, interrupted, mask, denoised)), encoded(path))


def _report(driver: Driver, scene: str, kernel: str, interrupted: bool, mask: Optional[str],
            denoised: Optional[Denoised]) -> abi.HostReport:
    frame = driver.frame
    flags = abi.REPORT_NO_RAYS | abi.REPORT_INTERRUPTED * interrupted | abi.REPORT_DENOISED * (denoised is not None)
    phases = (abi.HostPhase * len(driver.phases))(*((f"{name}_s".encode(), s) for name, s in driver.phases.items()))
    kept = {"noisy_weight": denoised.weight.mean(dtype=float), "noisy_error": denoised.noisy_error.ctypes.data} \
        if denoised else {}
    return abi.sized(
        abi.HostReport, flags=flags, scene=encoded(scene), mask=None if mask is None else encoded(mask),
        kernel=kernel.encode(), threads=driver.threads, processes=1, film_pixels=frame.view.pixels, scene_bytes=math.nan,
        film_bytes=sum(a.nbytes for a in frame.arrays().values()), phases=C.cast(phases, C.c_void_p),
        phase_count=len(phases), **kept)


def write_page(path: str, driver: Driver, scene: str = "", kernel: str = "", interrupted: bool = False,
               mask: Optional[str] = None, denoised: Optional[Denoised] = None) -> None:
    """The report as a page for people with the pictures in it, one HTML file, as the path tracer's --html."""
    frame, pictures = driver.frame, {"picture": shown(driver.frame, denoised)}
    if denoised:
        pictures |= {name: srgb(frame.displayed(frame.cropped(rgb))) for name, rgb in
                     (("noisy", frame.mean()), ("denoised", denoised.denoised))}
    report = bytes_of("host_report_text", frame.handle.pointer, C.byref(_report(driver, scene, kernel, interrupted, mask,
                                                                                denoised)))
    layers = (abi.HostLayer * len(pictures))(*((name.encode(), rgb.ctypes.data) for name, rgb in pictures.items()))
    height, width = pictures["picture"].shape[:2]
    file_call("host_page", report, None, layers, len(layers), width, height, encoded(path))


def progress_text(driver: Driver) -> str:
    """Share done, active blocks, their range of samples, speed, time left; without the criterion's predictions a bound."""
    text, percent, frame = C.create_string_buffer(256), C.c_double(driver.percent_shown), driver.frame
    forecast = frame.forecast(driver.threads)
    left_s = forecast.sampling_s + forecast.check_s if driver.samples_per_s else math.inf
    numbers = map(C.c_double, (frame.time_budget_s, left_s, driver.samples_per_s))
    library().lull_host_progress(C.byref(frame.layout), C.byref(frame.totals), C.byref(forecast), *numbers,
                                 C.byref(percent), text, C.c_uint64(len(text)))
    driver.percent_shown = percent.value
    return text.value.decode()


class Progress:
    """Prints the line: live on a terminal, now and then elsewhere. Give its `show` to the driver as after_call."""

    def __init__(self, out: Optional[TextIO] = None):
        self.out = out or sys.stderr
        self.live = self.out is not None and self.out.isatty()
        self._next_s = time.monotonic() + (0.0 if self.live else 2.0)

    def show(self, driver: Driver) -> None:
        """Five times a second on a terminal, elsewhere every 10 s; the first after 2 s there."""
        now = time.monotonic()
        if now >= self._next_s:
            say(f"\r{progress_text(driver)}\033[K" if self.live else progress_text(driver), self.out, "" if self.live else "\n")
            self._next_s = now + (0.2 if self.live else 10.0)

    def clear(self) -> None:
        """Removes the line from a terminal."""
        if self.live:
            say("\r\033[K", self.out, "")
