# SPDX-License-Identifier: MIT
"""What `ggn replay` prints, as blocks and methods."""
from __future__ import annotations

import math
import os
import subprocess
import sys
from typing import Any, Callable, Optional, Sequence

from ..study.files import Refused, loads
from . import rules
from .stats import NAN, quantile

SPLITS = ("train", "validation", "test", "people", "none")


def ggn(program: str, command: str, *words: Any, quiet: bool = False) -> Any:
    """The JSON that `ggn WORDS…` prints. Its messages are printed as those of `command`; quiet: only what stops it."""
    done = subprocess.run([program, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, check=False)
    messages = [line.replace(f"ggn {words[0]}: ", "", 1) for line in os.fsdecode(done.stderr).splitlines()]
    failed = messages.pop() if done.returncode and messages else f"ggn {words[0]} ended with {done.returncode}"
    for line in [] if quiet else messages:
        print(f"{command}: {line}", file=sys.stderr)
    if done.returncode == 1:
        raise MemoryError
    if done.returncode in (130, -2):
        raise KeyboardInterrupt
    if done.returncode:
        raise Refused(failed)
    return loads(done.stdout)


def _numbers(values: Sequence[Optional[float]]) -> list[float]:
    return [NAN if v is None else float(v) for v in values]


COLUMNS = ("spp", "seconds", "dammertz", "half_unsettled", "rse", "rse_unsettled", "flip", "ssim", "relmse", "error",
           "error_means")


class Block:
    """A labelled block, and lists of what was measured at each of its cases, rising in spp."""

    def __init__(self, views: Sequence[dict[str, Any]], from_json: dict[str, Any]):
        view = views[from_json["view"]]
        self.view, self.scene, self.split = view["name"], view["scene"], view["split"]
        self.spread, self.tiles = view["spread"], view["tiles"]
        self.id, self.place = from_json["id"], (from_json["column"], from_json["row"])
        self.threshold, self.cap = float(from_json["threshold"]), float(from_json["cap"])
        self.censored, self.simulated, self.reference = (from_json[k] for k in ("censored", "simulated", "reference"))
        self.area = math.sqrt(from_json["pixels"] / (view["width"] * view["height"]))  # of the picture, as lengths
        self.noisy = from_json["noisy"]  # 1, 0, or None: not known
        self.spp, self.seconds, self.dammertz, self.half_unsettled, self.rse, self.rse_unsettled, self.flip, self.ssim, \
            self.relmse, self.error, self.error_means = (_numbers(from_json[k]) for k in COLUMNS)

    def case(self, stop: float) -> int:
        """At which it stops: the first of at least so many samples, the last if none."""
        return next((i for i, spp in enumerate(self.spp) if spp >= stop), len(self.spp) - 1)

    def compared(self, spp: float) -> float:
        """As thresholds are compared: of views that people judged in samples of their study."""
        return rules.to_study(spp) if self.split == "people" else spp


class Method:
    """Something that stops blocks. scores: for each block those of its cases (higher: noisier), or None: stops alone."""

    def __init__(self, name: str, blocks: Sequence[Block], scores: Optional[list[list[float]]] = None, passes: int = 1,
                 guards: Optional[list[list[float]]] = None, oracle: bool = False):
        self.name, self.blocks, self.scores, self.passes, self.guards, self.oracle = name, blocks, scores, passes, guards, oracle
        self.cut, self.limit = NAN, 0.0  # it goes on while score >= cut, and is held while the guard is above the limit
        self.stops: list[float] = []
        self.asked: Optional[list[int]] = None  # checks until the stop, of a method that asks at counts of its own

    def ladders(self, limit: float) -> list[rules.Ladder]:
        assert self.scores is not None
        return [rules.Ladder(b.spp, s, b.cap, self.passes, self.guards[i] if self.guards else None, limit)
                for i, (b, s) in enumerate(zip(self.blocks, self.scores))]

    def run(self, cut: float) -> None:
        self.cut = cut
        self.stops = [ladder.stop(cut) for ladder in self.ladders(self.limit)]

    def tune(self, split: str, early_rate: float) -> None:
        """Chooses the cut on the blocks of a split: the one that spends fewest samples with at most early_rate of the blocks
        stopped below 0.8 of their threshold; if none does, the smallest early rate. The guard's limit is chosen with it."""
        assert self.scores is not None
        here = [i for i, b in enumerate(self.blocks) if b.split == split]
        scores = sorted(v for i in here for v in self.scores[i] if not math.isnan(v))
        if not scores:
            raise Refused(f"{self.name}: nothing to tune on in the split '{split}'")
        tries = 400
        cuts = [scores[k * len(scores) // tries] for k in range(tries)] + [math.nextafter(scores[-1], math.inf)]
        limits = (0.0, 1e-4, 1e-3, 1e-2, math.inf) if self.guards else (math.inf,)
        ladders = {limit: self.ladders(limit) for limit in limits}
        least = [0.8 * b.threshold for b in self.blocks]
        best = (True, math.inf, math.inf)
        for cut in cuts:
            for limit in limits:
                stops = {i: ladders[limit][i].stop(cut) for i in here}
                early = sum(stop < least[i] for i, stop in stops.items()) / len(here)
                price = (early > early_rate, early if early > early_rate else 0.0, sum(stops.values()))
                if price < best:
                    best, self.cut, self.limit = price, cut, limit
        Method.run(self, self.cut)

    def checks(self, index: int) -> float:
        """Until the block stopped."""
        if self.asked:
            return self.asked[index]
        scores, block = (self.scores[index] if self.scores else ()), self.blocks[index]
        return sum(spp <= self.stops[index] and not math.isnan(s) for spp, s in zip(block.spp, scores))

    def passed(self, index: int, case: int) -> bool:
        assert self.scores is not None
        return self.scores[index][case] < self.cut and not (self.guards and self.guards[index][case] > self.limit)


class LawMethod(Method):
    """A method that asks at sample counts of its own, where the law of visible noise expects the end."""

    def __init__(self, name: str, blocks: Sequence[Block], scores: list[list[float]], law: list[list[float]],
                 stop_error: Callable[[Block, float], float], first_spp: float, growth: float, passes: int = 1,
                 corrections: Optional[list[list[float]]] = None):
        super().__init__(name, blocks, scores, passes)
        self.law, self.stop_error, self.first_spp, self.growth, self.corrections = law, stop_error, first_spp, growth, corrections

    def run(self, cut: float) -> None:
        self.cut = cut
        found = [rules.law_stop(b.spp, law, b.cap, self.stop_error(b, cut), self.first_spp, self.growth,
                                self.corrections[i] if self.corrections else None)
                 for i, (b, law) in enumerate(zip(self.blocks, self.law))]
        self.stops = [stop for stop, _ in found]
        self.asked = None if self.corrections else [checks for _, checks in found]


class Replay:
    """One run of `ggn replay`."""

    def __init__(self, program: str, command: str, words: Sequence[Any], halves: bool = True, quiet: bool = False):
        response = ggn(program, command, "replay", *words, quiet=quiet)
        self.program, self.command, self.response, self.halves = program, command, response, halves
        self.views: list[dict[str, Any]] = response["views"]
        self.blocks = [Block(self.views, b) for b in response["blocks"]]
        self.visible: float = response["visible"]

    def of(self, split: str) -> list[int]:
        return [i for i, b in enumerate(self.blocks) if b.split == split]

    def answered(self, kind: str, name: Callable[[dict[str, Any]], str]) -> list[Method]:
        """The models, or the baselines, by their own policies."""
        return [self._answered(m, name(m)) for m in self.response["methods"] if m["kind"] == kind]

    def _answered(self, m: dict[str, Any], name: str) -> Method:
        policy, scores = m["policy"], [_numbers(s) for s in m["scores"]]
        if "corrections" not in m:
            method = Method(name, self.blocks, scores, m["passes"])
        else:
            def stop_error(_: Block, cut: float) -> float:
                odds = math.inf if cut >= 1 else -math.inf if cut <= 0 else math.log(cut / (1 - cut))
                return 2.0 ** min((odds - policy["shift"]) / policy["scale"], 1023)
            law = [b.error if self.halves else b.error_means for b in self.blocks]
            method = LawMethod(name, self.blocks, scores, law, stop_error, policy["first_spp"], policy["ratio"],
                               m["passes"], [_numbers(c) for c in m["corrections"]])
        method.run(policy["threshold"])
        return method

    def errors(self, name: str) -> Optional[Method]:
        """The criterion halfbuf or variance, without a cut; None where a case lacks its error."""
        scores = [[v * b.area for v in b.dammertz] if name == "halfbuf" else b.rse for b in self.blocks]
        guards = [b.half_unsettled if name == "halfbuf" else b.rse_unsettled for b in self.blocks]
        return None if any(math.isnan(v) for s in scores for v in s) else Method(name, self.blocks, scores, 1, guards)

    def observer(self, halves: bool, visible: float, growth: float = rules.GROWTH) -> Optional[Method]:
        """The criterion observer; None where a case lacks what it sees."""
        law = [b.error if halves else b.error_means for b in self.blocks]
        if any(math.isnan(v) for error in law for v in error):
            return None
        scores = [[rules.p_noisy(v, b.spread) for v in error] for b, error in zip(self.blocks, law)]
        method = LawMethod("observer" if halves else "observer, no halves", self.blocks, scores, law,
                           lambda b, share: rules.error_at(share, b.spread), rules.FIRST_SPP, growth)
        method.run(visible)
        return method

    def fixed(self, name: str, stops: list[float], oracle: bool = False) -> Method:
        method = Method(name, self.blocks, oracle=oracle)
        method.stops = stops
        return method

    def constant(self) -> Method:
        split = "train" if self.of("train") else "validation"
        median = quantile([b.threshold for b in self.blocks if b.split == split], 0.5)
        return self.fixed("constant (training median)", [b.cap if math.isnan(median) else min(median, b.cap) for b in self.blocks])

    def scene_mean(self) -> Method:
        sums: dict[str, list[float]] = {}
        for b in self.blocks:
            sums.setdefault(b.scene, []).append(b.threshold)
        return self.fixed("scene's mean (oracle)", [sum(sums[b.scene]) / len(sums[b.scene]) for b in self.blocks], True)

    def from_files(self, paths: Sequence[str], split: str) -> list[Method]:
        """The thresholds of each file, which has to have all views of `split`."""
        files = ggn(self.program, self.command, "thresholds", *paths) if paths else []
        return [self._from_file(path, views, split) for path, views in zip(paths, files)]

    def _from_file(self, path: str, views: Sequence[dict[str, Any]], split: str) -> Method:
        stops = []
        for b in self.blocks:
            view = rules.of_view(views, b.view)
            if not view and b.split == split:
                raise Refused(f"{path}: not all views of the split '{split}' are in it")
            if view and len(view["spp"]) != b.tiles:
                folder = next(v["folder"] for v in self.views if v["name"] == b.view)
                raise Refused(f"{path}: '{view['name']}' has {len(view['spp'])} thresholds, {folder} has {b.tiles} blocks")
            known = view["spp"][b.id] if view else None
            converts = view and view["of_study"] and b.split == "people"
            stops.append(b.cap if known is None else min(rules.from_study(known) if converts else known, b.cap))
        return self.fixed(os.path.basename(path)[:47], stops)
