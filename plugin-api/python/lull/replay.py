# SPDX-License-Identifier: MIT
"""Asks criteria about recorded frames as a render asks them: each block at its own level, its neighbours at theirs.

    from lull import recording, replay
    frame = recording.read("data/chess")
    found = replay.Replay(frame, lull.load("observer", visible=0.5)).run()
    found.stops, found.answers                         # samples of each block at its stop, 0: none; everything it said

Looks fall on recorded levels, rounded up. A replay of the criterion that a frame was recorded with, at its looks, gives its
stops and answers again. `python3 -m lull replay` is this as a command.
"""
from __future__ import annotations

import argparse
import bisect
import ctypes as C
import json
import math
import sys
import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Callable, Mapping, Optional, Sequence

import numpy as np

from . import abi, limits
from .criterion import PLANES, Criterion, Plane, Rect, load
from .denoising import denoise as lull_denoise
from .files import Output, check_outputs, replaced
from .host import Block, HostFrame
from .library import LullError, call
from .recording import LOOK, Answer, Record, Recording, channels, read

SIMULATED = ("color", "half", "moment2")  # planes that lull_host_simulate makes
STEP = 1.15  # between looks that the criterion did not place, as the host library's
CACHED = 256 << 20  # bytes of pixels that are kept, for blocks that several of another size lie in


@dataclass
class Replayed:
    """What was found. stops: samples of each block where it was stopped, 0: never; answers: in the order in which they were
    given; reasons: why a block got no more samples ("criterion", …; "interrupt": its recording ends)."""
    stops: list[int]
    answers: list[Answer]
    reasons: list[str]


class _Levels:
    """Pixels of blocks of any size: levels that all recorded blocks below one have."""

    def __init__(self, recording: Recording, rects: Sequence[Rect], names: Sequence[str]):
        self.recording, self.rects, self.names = recording, rects, names
        below = [[(k, r) for k, r in enumerate(recording.blocks)
                  if r.x0 < rect.x1 and rect.x0 < r.x1 and r.y0 < rect.y1 and rect.y0 < r.y1] for rect in rects]
        self.parts = below
        levels = [set(recording.levels(k)) for k in range(len(recording.blocks))]
        self.of = [sorted(set.intersection(*(levels[k] for k, _ in parts))) if parts else [] for parts in below]
        self._kept: OrderedDict[tuple[int, int], dict[str, np.ndarray]] = OrderedDict()
        self._shared = sum(map(len, below)) > len(recording.blocks)

    def at_least(self, block: int, spp: int) -> int:
        """The first level from spp on; 0: there is none."""
        at = bisect.bisect_left(self.of[block], spp)
        return self.of[block][at] if at < len(self.of[block]) else 0

    def _planes(self, k: int, spp: int) -> dict[str, np.ndarray]:
        names = [*self.names, *(n for n in ("dropped", "dropped_half") if self.recording.has(k, spp, n))]
        if not self._shared:
            return self.recording.planes(k, spp, names)
        if (k, spp) not in self._kept:
            self._kept[k, spp] = self.recording.planes(k, spp, names)
            while sum(a.nbytes for planes in self._kept.values() for a in planes.values()) > CACHED and len(self._kept) > 1:
                self._kept.popitem(last=False)
        self._kept.move_to_end((k, spp))
        return self._kept[k, spp]

    def load(self, block: int, spp: int, shown: Mapping[str, np.ndarray], view: Rect) -> tuple[int, float, int]:
        """Puts its pixels into `shown`, which holds those of `view`; samples in HALF, thread seconds, dropped samples."""
        rect, half, seconds, dropped = self.rects[block], 0, 0.0, 0
        for k, r in self.parts[block]:
            x0, y0, x1, y1 = max(r.x0, rect.x0), max(r.y0, rect.y0), min(r.x1, rect.x1), min(r.y1, rect.y1)
            share = (x1 - x0) * (y1 - y0) / r.pixels
            planes, stats = self._planes(k, spp), self.recording.stats(k, spp)
            for name, to in shown.items():
                to[y0 - view.y0:y1 - view.y0, x0 - view.x0:x1 - view.x0] = (
                    planes[name][y0 - r.y0:y1 - r.y0, x0 - r.x0:x1 - r.x0] if name in planes else 0)
            half, seconds = self.recording.half_spp(k, spp), seconds + share * stats.get("seconds", math.nan)
            if "dropped" in stats:
                dropped += int(planes["dropped"][y0 - r.y0:y1 - r.y0, x0 - r.x0:x1 - r.x0].sum())
        return half, seconds, dropped


class Replay:
    """A recorded frame as a host of a criterion.

    block: blocks of another size, pixels, of a recording whose blocks are in step. spp_max: the most samples of the render
    that is replayed, by default that of the recording. go_on: after all stops the criterion is asked about each stopped
    block at every further level. simulate_to: levels beyond the recording are made up to so many samples, where the
    criterion asks for them (lull_host_simulate); never for `denoised`, nor for criteria that require other planes.
    ValueError for what makes no sense.
    """

    def __init__(self, recording: Recording, criterion: Criterion, *, block: Optional[int] = None,
                 spp_max: Optional[int] = None, go_on: bool = False, simulate_to: int = 0):
        self.recording, self.go_on, self.simulate_to = recording, go_on, simulate_to
        settings = recording.settings()
        if block is not None:
            if not recording.in_step:
                raise ValueError(f"{recording.folder}: its blocks are not in step: no others can be cut from them")
            del settings["layout"]
            settings["block"] = block
        if simulate_to:
            limits.checked("simulate_to", simulate_to)
        most = settings["spp_max"] if spp_max is None else limits.checked("spp_max", spp_max)
        settings["spp_max"] = max(most, simulate_to)
        settings["spp_min"] = min(settings["spp_min"], settings["spp_max"])
        needed = [name for name, bit in PLANES.items() if criterion.needs.planes_required >> bit & 1]
        lacking = [name for name in needed if name not in (*recording.names, "spp", "weight")]
        if lacking:
            raise ValueError(f"criterion {criterion.info.id} reads {', '.join(lacking)}, which {recording.folder} has not "
                             "recorded")
        if simulate_to and (criterion.info.id == "denoised" or not set(needed) <= set(SIMULATED)):
            raise ValueError(f"criterion {criterion.info.id}: no levels can be simulated for it")
        names = [name for name in recording.names if not simulate_to or name in SIMULATED]
        self.frame = HostFrame(criterion, recording.width, recording.height, names, **settings)
        self.levels = _Levels(recording, [b.rect for b in self.frame.blocks], names)
        size = self.frame.view.height, self.frame.view.width
        self.shown = {name: np.zeros((*size, channels(name))) for name in names}
        if any(recording.has(k, spp, "dropped") for k in range(len(recording.blocks)) for spp in recording.levels(k)):
            self.shown.update(dropped=np.zeros((*size, 1)), dropped_half=np.zeros((*size, 1)))
        self.answers: list[Answer] = []
        self.stops = [0] * len(self.frame.blocks)
        self._made = [False] * len(self.frame.blocks)  # what is shown of it was simulated

    def run(self, progress: Optional[Callable[[float], None]] = None) -> Replayed:
        """Until every block has stopped or its recording ends. progress(share) is called now and then."""
        frame = self.frame
        while frame.active:
            for i in frame.active:
                self._advance(i, frame.blocks[i].next_spp)
            due, final = frame.due()
            if due:
                self._ask(due, final)
            if progress:
                progress(1 - len(frame.active) / len(frame.blocks) * (0.5 if self.go_on else 1))
        reasons = [b.reason for b in frame.blocks]
        if self.go_on:
            self._go_on(progress)
        frame.close()
        return Replayed(list(self.stops), self.answers, reasons)

    def _advance(self, i: int, spp: int) -> bool:
        """Shows the block at its next level from spp on; 0: there is none, and it is closed."""
        b, most = self.frame.blocks[i], self.frame.spp_max
        wanted = min(spp, most)
        if b.spp >= wanted:
            return True
        level = 0 if self._made[i] else self.levels.at_least(i, wanted)
        if level and level <= most:
            self._load(i, level)
            return True
        if wanted <= self.simulate_to and self.levels.of[i]:
            if not self._made[i]:
                self._load(i, self.levels.of[i][-1])
            self._simulate(b, wanted)
            self._made[i] = True
            return True
        abi.HostBlock.reason.__set__(b, abi.REASON_INTERRUPT)
        return False

    def _load(self, i: int, spp: int) -> None:
        b = self.frame.blocks[i]
        b.half_spp, b.thread_s, b.dropped = self.levels.load(i, spp, self.shown, self.frame.view)
        b.spp = spp

    def _simulate(self, b: Block, spp: int) -> None:
        v, r = self.frame.view, b.rect
        at = slice(r.y0 - v.y0, r.y1 - v.y0), slice(r.x0 - v.x0, r.x1 - v.x0)
        planes = {name: np.ascontiguousarray(self.shown[name][at]) for name in SIMULATED if name in self.shown}
        call("host_simulate", C.byref(abi.sized(
            abi.HostSimulation, pixels=r.pixels, spp=b.spp, half_spp=b.half_spp, to_spp=spp,
            rgb_to_xyz=tuple(self.recording.frame["rgb_to_xyz"]), **{name: a.ctypes.data for name, a in planes.items()})))
        for name in set(planes) - {"color"}:
            self.shown[name][at] = planes[name]
        b.thread_s *= spp / b.spp
        b.spp, b.half_spp = spp, spp // 2 if "half" in planes else 0

    def _view(self) -> dict[str, Plane]:
        return {name: Plane(a.astype(np.uint32) if name.startswith("dropped") else a) for name, a in self.shown.items()}

    def _ask(self, due: Sequence[int], final: Sequence[bool], after_stop: bool = False) -> None:
        decisions = self.frame.ask(due, final, self._view())
        for i, d in zip(due, decisions):
            b = self.frame.blocks[i]
            self.answers.append(Answer(i, b.spp, d.action, d.error, d.p_noisy, d.next_spp, d.predicted_spp, d.flags,
                                       after_stop, self._made[i]))
        self.frame.apply(due, decisions)
        for i in due:
            b = self.frame.blocks[i]
            if not after_stop and b.reason in ("criterion", "dropped"):
                self.stops[i] = b.spp

    def _go_on(self, progress: Optional[Callable[[float], None]]) -> None:
        """Stopped blocks at all that was recorded beyond."""
        blocks = [i for i, spp in enumerate(self.stops) if spp]
        while blocks:
            moved = []
            for i in blocks:
                b = self.frame.blocks[i]
                abi.HostBlock.reason.__set__(b, abi.REASON_NONE)
                following = self.levels.at_least(i, b.spp + 1) if not self._made[i] else 0
                if self._advance(i, following or math.ceil(STEP * b.spp)) and b.asked_spp != b.spp:
                    moved.append(i)
            if moved:
                self._ask(moved, [False] * len(moved), True)
            blocks = moved
            if progress:
                progress(1 - 0.5 * len(moved) / len(self.stops))


Pictures = Mapping[str, np.ndarray]


def denoise(recording: Recording, layer: str, by: Optional[Callable[[Pictures], Pictures]] = None,
            progress: Optional[Callable[[float], None]] = None) -> None:
    """Adds denoised planes to a recording, look by look; those that are there are not made again. layer: what they are, such
    as the denoiser with its version. by: gets the whole picture as it was at the look, planes by name [height, width,
    channels], and gives "denoised", perhaps "denoised_half" and "denoised_rest", [height, width, 3]; by default what
    lull.denoise gives, alone and with albedo and normal if they were recorded. Where blocks are not in step each has its own
    samples, as in the render."""
    names = [*recording.names, *(["rest"] if "half" in recording.names else [])]
    whole = Rect(0, 0, recording.width, recording.height)
    shown = {name: np.zeros((whole.height, whole.width, channels(name)), np.float64) for name in names}
    spps = [0] * len(recording.blocks)
    for number, look in enumerate(recording.looks, 1):
        for k, spp in look:
            r = recording.blocks[k]
            for name in names:
                if name != "rest" or recording.has(k, spp, name):
                    shown[name][r.y0:r.y1, r.x0:r.x1] = recording.planes(k, spp, [name])[name]
            spps[k] = spp
        if not recording.has_added(layer, number):
            made = by(shown) if by else {"denoised": _denoised(recording, shown, spps)}
            recording.add(layer, number, [
                Record(LOOK, spp, recording.half_spp(k, spp), k, r, {n: a[r.y0:r.y1, r.x0:r.x1] for n, a in made.items()})
                for k, spp in sorted(set(look)) for r in [recording.blocks[k]]])
        if progress:
            progress(number / len(recording.looks))


def _denoised(recording: Recording, shown: Mapping[str, np.ndarray], spps: Sequence[int]) -> np.ndarray:
    """What lull.denoise makes of a picture, alone."""
    names = [name for name in ("color", "half", "albedo", "normal") if name in shown]
    with load("fixed", threads=1) as nobody:
        frame = HostFrame(nobody, recording.width, recording.height, names, **recording.settings())
        for k, b in enumerate(frame.blocks):
            b.spp, b.half_spp = spps[k], recording.half_spp(k, spps[k]) if spps[k] else 0
        return lull_denoise(frame, {name: Plane(shown[name]) for name in names}, full=True).denoised


# --- the command ------------------------------------------------------------------------------------------------------


def _number(value: float) -> Optional[float]:
    return value if math.isfinite(value) else None


def as_json(recording: Recording, criterion: Criterion, found: Replayed, block: Optional[int]) -> dict[str, Any]:
    """What the command writes."""
    info = criterion.info
    return {"recording": recording.folder, "scene": recording.manifest["scene"], "camera": recording.manifest["camera"],
            "criterion": {"id": info.id, "version": info.version, "path": info.path,
                          "parameters": {p.name: criterion.parameters.get(p.name, p.default) for p in info.parameters}},
            "block": block, "stops": found.stops, "reasons": found.reasons,
            "columns": list(Answer._fields),
            "answers": [[_number(v) if isinstance(v, float) else v for v in a] for a in found.answers]}


class _Progress:
    """A line on a terminal: the share that is done, and what is left of the time."""

    def __init__(self, name: str, quiet: bool):
        self.name, self.live, self.begin_s, self.next_s = name, not quiet and sys.stderr.isatty(), time.monotonic(), 0.0

    def __call__(self, share: float) -> None:
        now = time.monotonic()
        if self.live and now >= self.next_s:
            left = f", {(now - self.begin_s) * (1 - share) / share:.0f} s left" if share > 0 else ""
            print(f"\r{self.name}: {100 * share:.0f} %{left}\033[K", end="", file=sys.stderr, flush=True)
            self.next_s = now + 0.2

    def end(self) -> None:
        """Removes it."""
        if self.live:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def _pair(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise argparse.ArgumentTypeError(f"{text}: expected KEY=VALUE")
    return key, value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python3 -m lull replay", epilog="Exit status: 0 done, 2 bad input or an output could not be written.",
        description="Asks a criterion about a recorded frame (lull-render --sequence DIR --planes LIST), as a render asks it: "
        "each block at its own level, its neighbours at theirs; looks fall on recorded levels, rounded up. Prints where blocks "
        "stopped.")
    add = parser.add_argument
    add("recording", metavar="DIR", help="a recorded frame")
    add("-c", "--criterion", metavar="NAME|PATH[:ID]",
        help="whom to ask (default: who was asked while recording, with its parameters)")
    add("-p", "--param", metavar="KEY=VALUE", type=_pair, action="append", default=[],
        help="parameter of the criterion; may be repeated")
    add("-o", "--output", metavar="FILE.json", default="", help="every answer: block, samples, action, error, p, next")
    add("--block", type=int, metavar="N", help="blocks of so many pixels, of a recording whose blocks are in step")
    add("--spp-max", type=int, metavar="N", help="samples at which every block ends (default: the recording's)")
    add("--go-on", action="store_true", help="ask about stopped blocks at all further levels, too")
    add("--simulate-to", type=int, default=0, metavar="N",
        help="make levels beyond the recording up to N samples (criteria of color, half and moment2; never denoised); such "
        "answers are marked")
    add("-t", "--threads", type=int, metavar="N", help="worker threads of the criterion (default: all processors)")
    add("-q", "--quiet", action="store_true", help="no progress, print nothing")
    return parser


def _replay(o: argparse.Namespace) -> None:
    check_outputs([Output("--output", o.output, (".json",))])
    recording = read(o.recording)
    asked = recording.criterion if not o.criterion else None
    if not o.criterion and not asked:
        raise ValueError(f"{o.recording}: nobody was asked while recording: -c NAME says whom to ask")
    given = {**(asked["parameters"] if asked else {}), **dict(o.param)}
    criterion = load(o.criterion or asked["spec"], threads=o.threads, **given)  # type: ignore[index]
    progress = _Progress(criterion.info.id, o.quiet)
    try:
        found = Replay(recording, criterion, block=o.block, spp_max=o.spp_max, go_on=o.go_on,
                       simulate_to=o.simulate_to).run(progress)
    finally:
        progress.end()
    if o.output:
        with replaced(o.output) as file:
            file.write((json.dumps(as_json(recording, criterion, found, o.block)) + "\n").encode())
    if not o.quiet:
        stopped = [spp for spp in found.stops if spp]
        print(f"{criterion.info.id}: {len(stopped)} of {len(found.stops)} blocks stopped" +
              (f", at {min(stopped)} to {max(stopped)} samples" if stopped else "") + f"; {len(found.answers)} answers")


def main(arguments: Sequence[str]) -> int:
    """The command; its exit status."""
    o = _parser().parse_args(arguments)
    try:
        _replay(o)
    except (LullError, ValueError, TypeError, OSError) as error:
        print(f"lull replay: {error}", file=sys.stderr)
        return 2
    return 0
