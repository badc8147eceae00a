# SPDX-License-Identifier: MIT
"""`ggn cost`: what accuracy costs each criterion, over its quality parameters, from recorded sequences."""
from __future__ import annotations

import math
from typing import Any, Callable, Optional, Sequence

from ..study import stats
from ..study.files import Refused, print_json, replaced
from ..study.options import Command, Option, real, word
from . import rules
from .options import HOW, JUDGES, THRESHOLDS, WHERE, forwarded, inputs_of, needed, protect
from .replayed import SPLITS, Block, Method, Replay

HERE = (Option("cadence", "R", "simulate all levels, this far apart, and ask networks and baselines as often", real(1.02, 16)),
        Option("precision", "f32|f64", "of the networks' arithmetic (f32)", word("f32", "f64")))
RECORDED = Option("recorded", "", "recorded levels only; blocks that show noise in the last one are left out")
REPLAYED = (*WHERE, *JUDGES, *(o for o in HOW if o.name != "recorded"), RECORDED, *HERE)
COMMAND = Command(
    "ggn cost", "", 0, 0,
    "Replays recorded blocks through every criterion over the range of its quality parameters and writes, scene by scene, what was "
    "spent until the blocks stop and how good the picture is then, as JSON. scripts/lab cost puts measured prices on the checks and "
    "draws it.",
    (*REPLAYED, THRESHOLDS,
     Option("split", "|".join(SPLITS), "which of its views (test)", word(*SPLITS)),
     Option("output", "FILE", "write there instead of printing", letter="o"),
     Option("scores", "", "of the networks' own settings only: p of every window, and the stops")))

SHARES = (0.9, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.02, 0.01, 0.004)
GROWTHS = (1.05, 1.1, 1.25, 1.5, 2.0)
THRESHOLD = {"halfbuf": (0.03, 0.021, 0.015, 0.011, 0.0075, 0.0053, 0.004, 0.0028, 0.002, 0.0014, 0.001),
             "variance": (0.64, 0.45, 0.32, 0.23, 0.16, 0.113, 0.08, 0.057, 0.04, 0.03, 0.02, 0.014, 0.01)}
DEFAULT = {"halfbuf": 0.004, "variance": 0.03}  # of the criteria


# --- figures ---

def path_s(block: Block, pixels: float) -> float:
    """Seconds a path, from the last case that tells it."""
    known = [s / spp for s, spp in zip(block.seconds, block.spp) if s > 0]
    return known[-1] / pixels if known else math.nan


def at_stop(block: Block, column: Sequence[float], stop: float, power: float) -> float:
    """By `power` of the samples from the case at or before it."""
    k = max((i for i, spp in enumerate(block.spp) if spp <= stop), default=0)
    return column[k] * math.pow(block.spp[k] / stop, power)


def figures(blocks: Sequence[Block], stops: Sequence[float], checks: Sequence[float], pixels: float) -> dict[str, float]:
    """Means over the blocks, the visible difference of the worst, and the samples everywhere that make none worse."""
    rates = [path_s(b, pixels) * pixels for b in blocks]
    needs = [b.threshold for b in blocks]
    worst = max(need / stop for need, stop in zip(needs, stops))
    flip = [at_stop(b, b.flip, stop, 0.5) for b, stop in zip(blocks, stops)]
    samples, seconds = stats.mean(stops), [stop * rate for stop, rate in zip(stops, rates)]
    uniform = max(needs) / worst
    known = [v for v in flip if not math.isnan(v)]
    return {"blocks": len(blocks), "samples": samples, "sampling_s": stats.mean(seconds), "checks_full": stats.mean(checks),
            "noisy": stats.share([stop < need for stop, need in zip(stops, needs)]),
            "early": stats.share([stop < 0.8 * need for stop, need in zip(stops, needs)]),
            "worst": math.sqrt(worst), "uniform_spp": uniform,
            "time_ratio": sum(seconds) / (sum(rates) * uniform) if sum(rates) else math.nan,
            "samples_ratio": sum(stops) / (len(blocks) * uniform), "flip": stats.mean(flip),
            "flip_worst": max(known, default=0.0),
            "relmse": stats.mean([at_stop(b, b.relmse, stop, 1.0) for b, stop in zip(blocks, stops)])}


# --- settings ---

class Costing:
    """The points of one data set and split."""

    def __init__(self, r: Replay, split: str, o: dict[str, Any]):
        self.r, self.split, self.points = r, split, []  # type: Replay, str, list[dict[str, Any]]
        self.own_only = "cadence" in o or "scores" in o
        self.cadence: Optional[float] = o.get("cadence")
        self.scores = "scores" in o
        # whose thresholds lie beyond the recording: nothing is known there
        self.here = [i for i in r.of(split) if not ("recorded" in o and r.blocks[i].censored)]
        scenes = {v["scene"]: None for v in r.views}
        self.scenes = {s: found for s in scenes if (found := [i for i in self.here if r.blocks[i].scene == s])}
        if not self.here:
            raise Refused(f"{o['data']}: no labelled block in the split '{split}'")

    def put(self, criterion: str, dial: str, value: float, stops: Sequence[float], checks: Callable[[int], float]) -> dict[str, Any]:
        blocks, pixels = self.r.blocks, self.r.response["pixels"]
        self.points.append({
            "criterion": criterion, "dial": dial, "value": value, "stops": [math.floor(stops[i] + 0.5) for i in self.here],
            "scenes": {s: figures([blocks[i] for i in at], [stops[i] for i in at], [checks(i) for i in at], pixels)
                       for s, at in self.scenes.items()}})
        return self.points[-1]

    def put_method(self, m: Method, dial: str, value: float) -> dict[str, Any]:
        return self.put(m.name, dial, value, m.stops, m.checks)

    def vary(self, m: Method, dial: str, values: Sequence[float]) -> None:
        """At these cuts; its own is what it has afterwards."""
        own = m.cut
        for value in values:
            m.run(value)
            self.put_method(m, dial, value)
        m.run(own)

    def uniform(self) -> None:
        """The same samples everywhere: as the host's own limit, and as the criterion `fixed`, which is asked once."""
        for spp in (16.0 * 2**k for k in range(11)):
            stops = [spp] * len(self.r.blocks)
            self.put("uniform", "spp", spp, stops, lambda _: 0)
            self.put("fixed", "spp", spp, stops, lambda _: 1)
        self.put("limit", "none", 0, [b.threshold for b in self.r.blocks], lambda _: 0)

    def errors(self) -> None:
        for name in ("variance", "halfbuf"):
            values = (DEFAULT[name],) if self.cadence else THRESHOLD[name]
            m = self.r.errors(name)
            if m:
                self.vary(m, "threshold", values)
                m.name, m.guards = f"{name}, no guard", None
                self.vary(m, "threshold", values)

    def observer(self) -> None:
        usual = self.r.visible
        points = [(True, usual, self.cadence)] if self.cadence else [
            *[(halves, share, rules.GROWTH) for halves in (True, False) for share in SHARES], *[(True, usual, g) for g in GROWTHS]]
        for n, (halves, share, growth) in enumerate(points):
            m = self.r.observer(halves, share, growth)
            by_growth = bool(self.cadence) or n >= 2 * len(SHARES)
            if m:
                self.put_method(m, "growth" if by_growth else "visible", growth if by_growth else share)

    def model(self, m: Method) -> None:
        point = self.put_method(m, "own", m.cut)
        if self.scores:
            assert m.scores is not None
            point |= {"scores": [v for i in self.here for v in m.scores[i]], "cut": m.cut}
        if not self.own_only:
            self.vary(m, "visible", SHARES)

    def baseline(self, m: Method) -> None:
        self.put_method(m, "own", m.cut)
        if self.cadence:
            return
        self.vary(m, "visible", SHARES)
        for m.passes in range(1, 5):  # checks in a row that must pass
            m.run(m.cut)
            self.put_method(m, "passes", m.passes)

    def listed(self) -> dict[str, Any]:
        """The blocks of each scene, and their places in lists of stops."""
        keys = ("threshold", "cap", "censored", "simulated", "reference")
        return {scene: {"blocks": [
            {"place": self.here.index(i), "view": self.r.blocks[i].view, "id": self.r.blocks[i].id,
             **{k: getattr(self.r.blocks[i], k) for k in keys},
             "us_per_path": 1e6 * path_s(self.r.blocks[i], self.r.response["pixels"])} for i in at]} for scene, at in self.scenes.items()}


def run(program: str, _: Sequence[str], o: dict[str, Any]) -> None:
    needed(o, "data", "DATA")
    protect(inputs_of(o), [o.get("output")])
    words = [*forwarded(o, REPLAYED), "--no-ssim", "--window=6"]
    r = Replay(program, COMMAND.name, words, halves="no_pictures" not in o, quiet=True)
    c = Costing(r, o.get("split", "test"), o)
    more = (" " + o["precision"] if o.get("precision", "f32") != "f32" else "") + (", no halves" if "no_pictures" in o else "")
    if not c.scores:
        c.uniform()
        c.errors()
        c.observer()
    for m in r.answered("model", lambda method: method["name"][:32] + more):
        c.model(m)
    if not c.scores:
        for m in r.answered("baseline", lambda method: method["name"]):
            c.baseline(m)
        for m in r.from_files(o.get("thresholds", []), c.split):
            c.put(m.name, "own", 0, m.stops, lambda _: 0)
    text = print_json({"split": c.split, "labels": r.response["labels"], "ratio": r.response["ratio"], "scenes": c.listed(),
                       "points": c.points}, True)
    if "output" not in o:
        print(text)
    else:
        with replaced(o["output"]) as file:
            file.write(text + "\n")
