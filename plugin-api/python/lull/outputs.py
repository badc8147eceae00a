# SPDX-License-Identifier: MIT
"""What a run leaves behind, in the form of the path tracer: EXR with layers, preview, report; and its progress line."""
from __future__ import annotations

import json
import math
import sys
import time
from typing import Mapping, Optional

import numpy as np

from . import exr, png, srgb
from .blocks import REASONS
from .driver import Driver
from .files import replaced
from .frame import Frame


def write_exr(path: str, driver: Driver, scene: str = "", software: str = "lull for Python 1.0",
              more: Optional[Mapping[str, Optional[np.ndarray]]] = None) -> None:
    """R, G, B and the layer lull, which image programs show as spp, p_noisy, error and reason, then those of the frame;
    cut to the crop. more: further channels over the frame's view, or instead of its layers; None leaves one out."""
    frame = driver.frame
    rgb = frame.cropped(frame.mean())
    channels = {"R": rgb[..., 0], "G": rgb[..., 1], "B": rgb[..., 2], "lull.spp.V": frame.cropped(frame.spp())}
    for name, value in (("p_noisy", lambda b: b.p_noisy), ("error", lambda b: b.error),
                        ("reason", lambda b: REASONS.index(b.reason))):
        channels[f"lull.{name}.V"] = frame.cropped(frame.per_pixel(value))
    for name in frame.layers:
        channels[name] = frame.cropped(frame.mean(name))
    for name, plane in (more or {}).items():
        if plane is None:
            del channels[name]
        else:
            channels[name] = frame.cropped(plane)
    info = frame.criterion.info
    settings = "".join(f" {key}={value}" for key, value in frame.criterion.parameters.items())
    exr.write(path, channels, (frame.width, frame.height), frame.crop[:2], {
        "lull:scene": scene, "lull:criterion": f"{info.id} {info.version}{settings}",
        "lull:reasons": " ".join(f"{i}={name}" for i, name in enumerate(REASONS)),
        "lull:block": f"{frame.block_width}x{frame.block_height}", "lull:seed": float(frame.seed),
        "lull:samples": float(driver.totals.samples), "software": software})


def is_ours(path: str) -> bool:
    """Is this a picture of Lull's, or none at all? What is another program's must not be replaced unless somebody says
    so."""
    try:
        with open(path, "rb") as file:
            begin = file.read(4096)
    except OSError:
        return True
    return not begin or b"lull.spp" in begin


def shown(frame: Frame) -> np.ndarray:
    """[h, w, 3] uint8, cut to the crop: the display mapping of the frame if it has one, then the sRGB transfer."""
    mean = frame.cropped(frame.mean())
    return srgb.codes(frame.display(mean) if frame.display else mean)


def write_preview(path: str, driver: Driver) -> None:
    """PNG, as the frame is shown."""
    png.write(path, shown(driver.frame))


def _number(value: float) -> Optional[float]:
    return value if math.isfinite(value) else None


def report(driver: Driver, scene: str = "", kernel: str = "", interrupted: bool = False, mask: Optional[str] = None) -> dict:
    """Everything about the run; members and meanings as in the path tracer's --report. null: not known. mask: its file."""
    frame, totals, criterion = driver.frame, driver.totals, driver.frame.criterion
    bytes_kept = sum(a.nbytes for a in frame.arrays().values())
    square = frame.block_width == frame.block_height
    return {
        "scene": scene, "width": frame.width, "height": frame.height,
        "block": frame.block_width if square else [frame.block_width, frame.block_height], "seed": frame.seed,
        "threads": driver.threads, "processes": 1,
        "criterion": {"id": criterion.info.id, "version": criterion.info.version,
                      "params": {p.name: criterion.parameters.get(p.name, p.default) for p in criterion.info.parameters}},
        "mask": mask, "effects": [],
        "blocks": [{"id": b.id, "x0": b.rect.x0, "y0": b.rect.y0, "x1": b.rect.x1, "y1": b.rect.y1, "spp": b.spp,
                    "reason": b.reason, "p_noisy": _number(b.p_noisy), "error": _number(b.error), "checks": b.checks,
                    "thread_s": b.thread_s, "dial": dial} for b, dial in zip(frame.blocks, frame.dials)],
        "totals": {"samples": totals.samples, "render_s": totals.render_s, "criterion_s": totals.criterion_s,
                   "criterion_thread_s": totals.criterion_thread_s,
                   "paths": totals.samples, "rays": None,
                   "paths_per_s": totals.samples / totals.render_s if totals.render_s > 0 else None, "rays_per_s": None,
                   "dropped_samples": sum(b.dropped for b in frame.blocks)},
        "interrupted": interrupted, "kernel": kernel, "dropped": [],
        "memory": {"film_bytes": bytes_kept, "film_bytes_per_pixel": bytes_kept / frame.view.pixels, "scene_bytes": None},
    }


def write_report(path: str, *arguments, **named) -> None:
    with replaced(path) as file:
        file.write(json.dumps(report(*arguments, **named), indent="\t").encode() + b"\n")


# --- progress ----------------------------------------------------------------------------------------------------------


def _clock(seconds: float) -> str:
    t = math.ceil(min(seconds, 3.6e7))
    return f"{t // 3600}:{t // 60 % 60:02}:{t % 60:02}" if t >= 3600 else f"{t // 60}:{t % 60:02}"


def _share(driver: Driver, share: float, known: bool) -> str:
    """The share done, which never falls: a prediction that grows holds it where it was. What is only a lower bound says so,
    and says nothing while it is below a hundredth."""
    percent = math.floor(100 * share)
    bound = not known and percent >= driver.percent_told
    driver.percent_told = max(driver.percent_told, percent)
    return "  ?%" if bound and percent < 1 else f"{'>=' if bound else ''}{driver.percent_told:3}%"


def progress_text(driver: Driver) -> str:
    """Share done, active blocks, their range of samples, speed, time left; without the criterion's predictions a bound."""
    frame, done, expected, known = driver.frame, 0.0, 0.0, True
    active = [b for b in frame.blocks if b.active]
    for b in frame.blocks:
        end = float(b.spp)
        if b.active:
            predicted = b.asked_spp > 0 and math.isfinite(b.predicted_spp) and not driver.uniform
            known &= predicted or driver.uniform
            end = min(max(b.predicted_spp, b.next_spp) if predicted else frame.spp_max, frame.spp_max)
        done += b.rect.pixels * b.spp
        expected += b.rect.pixels * end
    share = done / expected if expected else 1.0
    left_s = (expected - done) / driver.samples_per_s if driver.samples_per_s else math.inf
    if frame.time_budget_s > 0:
        budget_left_s = max(0.0, frame.time_budget_s - driver.totals.elapsed_s)
        if budget_left_s < left_s:
            left_s, share = budget_left_s, min(1.0, driver.totals.elapsed_s / frame.time_budget_s)
    low, high = min((b.spp for b in active), default=0), max((b.spp for b in active), default=0)
    left = _clock(left_s) if math.isfinite(left_s) else "unknown"
    return (f"{_share(driver, share, known)}  {len(active)} of {len(frame.blocks)} blocks active  "
            f"spp {low}..{high}  {driver.samples_per_s * 1e-6:.2f} Mpaths/s  "
            f"ETA {'' if known or not math.isfinite(left_s) else 'at most '}{left}")


class Progress:
    """Prints the line: live on a terminal, now and then elsewhere. Give its `show` to the driver as after_call."""

    def __init__(self, out=None):
        self.out = out or sys.stderr
        self.live = self.out.isatty()
        self._next_s = time.monotonic() + (0.0 if self.live else 2.0)

    def show(self, driver: Driver) -> None:
        now = time.monotonic()
        if now < self._next_s:
            return
        self.out.write(f"\r{progress_text(driver)}\033[K" if self.live else progress_text(driver) + "\n")
        self.out.flush()
        self._next_s = now + (0.2 if self.live else 10.0)

    def clear(self) -> None:
        if self.live:
            self.out.write("\r\033[K")
            self.out.flush()
