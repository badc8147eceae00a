# SPDX-License-Identifier: MIT
"""When a block stops, by scores and by the law of visible noise: the rules of ggn/model/stopper.h and of the criterion
`observer`, on recorded levels. tests/e2e/ggn_replay.sh holds them against renders."""
from __future__ import annotations

import bisect
import math
from typing import Any, Optional, Sequence

GROWTH = 1.5  # largest ratio of samples between two checks of the criterion `observer`
FIRST_SPP = 16.0  # of its checks
STUDY_CAP, SIMULATED_CAP, STUDY_REFERENCE = 10000.0, 20000.0, 20000.0  # spp; ggn/sight/observer.h


def from_study(spp: float) -> float:
    """A threshold of the study in samples of the observer."""
    return SIMULATED_CAP if spp >= STUDY_CAP else 1 / (1 / spp - 1 / STUDY_REFERENCE)


def to_study(spp: float) -> float:
    return min(1 / (1 / spp + 1 / STUDY_REFERENCE), STUDY_CAP)


# --- names ---

def of_view(views: Sequence[dict[str, Any]], name: str) -> Optional[dict[str, Any]]:
    """The view of this name, or else of one that is the same: SIN3D's own files have the ending _part6, which others leave
    out (ggn/data/thresholds.h)."""
    return next((v for v in views if v["name"] == name), None) or next(
        (v for v in views if v["name"].removesuffix("_part6") == name.removesuffix("_part6")), None)


# --- scores ---

class Ladder:
    """Where a block stops, for any cut: at the first case that ends a row of `passes` scores below it and is not held, else at
    the cap. score: NaN where it was not judged. guard: of each case; it is held where the guard is above the limit."""

    def __init__(self, spp: Sequence[float], score: Sequence[float], cap: float, passes: int = 1,
                 guard: Optional[Sequence[float]] = None, limit: float = 0.0):
        self.spp, self.cap, self.less = [], cap, []  # less: minus the highest cut at which the block still goes on; rising
        row: list[float] = []
        for i, value in enumerate(score):
            if math.isnan(value):
                continue
            row = [*row, value][-passes:]
            if len(row) == passes and not (guard and guard[i] > limit):
                self.spp.append(spp[i])
                self.less.append(max(-max(row), self.less[-1] if self.less else -math.inf))

    def stop(self, cut: float) -> float:
        at = bisect.bisect_right(self.less, -cut)
        return self.spp[at] if at < len(self.less) else self.cap


# --- the law ---

def p_noisy(error: float, spread: float) -> float:
    """Share of viewers who still see noise of `error` times what is just seen."""
    return 0.5 * math.erfc(-2 * math.log2(error) / (spread * math.sqrt(2))) if error > 0 else 0.0


def error_at(share: float, spread: float) -> float:
    """Its inverse."""
    below, above = 1e-6, 1e6
    for _ in range(60):
        middle = math.sqrt(below * above)
        if p_noisy(middle, spread) < share:
            below = middle
        else:
            above = middle
    return math.sqrt(below * above)


def between(x0: float, y0: float, x1: float, y1: float, x: float) -> float:
    """y at x on the line through two points in log-log, in plain scales where a point has no place there; beyond the points
    the nearer y."""
    t = 0.0 if x <= x0 else 1.0 if x >= x1 else math.log(x / x0) / math.log(x1 / x0)
    return y0 * math.pow(y1 / y0, t) if y0 > 0 and y1 > 0 else y0 + t * (y1 - y0)


def law_stop(spp: Sequence[float], error: Sequence[float], cap: float, stop_error: float, first_spp: float, growth: float,
             correction: Optional[Sequence[float]] = None) -> tuple[float, int]:
    """(Where the law stops a block, how often it asked), asking at sample counts of its own: where its error falls to
    stop_error. correction: octaves of noise that a network adds from a case to the next, where it is asked at the latest."""
    at, checks, i, k, last = max(first_spp, spp[0]), 1, 0, 0, len(spp) - 1
    while at < cap:
        while i < last and spp[i + 1] <= at:
            i += 1
        while k + 1 < last and spp[k + 1] < at:
            k += 1
        n = min(k + 1, last)
        ratio = between(spp[k], error[k], spp[n], error[n], at) / stop_error * (2.0 ** correction[i] if correction else 1)
        if ratio <= 1:
            break
        step = min(max(at * ratio * ratio, 1.04 * at), growth * at)
        at = math.ceil(min(step, spp[i + 1]) if correction and i < last else step)
        checks += 1
    return min(at, cap), checks
