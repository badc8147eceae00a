# SPDX-License-Identifier: MIT
"""What all people together gave: a threshold per block, how well people agree, shares of judgements, and how many people it
takes. Only people who count (people.py) enter."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.special import ndtri
from scipy.stats import rankdata

from .people import Cell, People
from .psychometric import Estimate, t975, wilson

NAN = math.nan


@dataclass
class Threshold:
    """Of a cell, octaves; NaN without people."""
    t: float = NAN  # mean over people of their estimates
    lo: float = NAN  # 95 %: Student's t over people, or with one person their own interval; infinite where somebody's is
    hi: float = NAN
    spread: float = NAN  # geometric mean of theirs
    people: int = 0
    trials: int = 0
    at_cap: int = 0  # so many still see noise at the highest level
    at_floor: int = 0  # so many see none at the lowest one

    def censored(self) -> str:
        """On which sides it may lie beyond the levels: "", "below", "above" or both."""
        return " and ".join(side for side, end in (("below", self.lo), ("above", self.hi)) if math.isinf(end))


def censored(e: Estimate, cell: Cell) -> Estimate:
    """A threshold that is not known to lie between the levels is at the nearest one, and its interval has no end there."""
    if e.t >= cell.cap():
        return e._replace(t=cell.cap(), lo=min(e.lo, cell.cap()), hi=math.inf, se=NAN)
    return e._replace(t=cell.floor(), lo=-math.inf, hi=max(e.hi, cell.floor()), se=NAN) if e.t <= cell.floor() else e


def estimates(people: People, member: str = "t") -> np.ndarray:
    """[person that counts][cell]; NaN without one."""
    return np.array([[getattr(censored(r.estimates[c], cell), member) if c in r.estimates else NAN
                      for c, cell in enumerate(people.cells)] for r in people.counting()]).reshape(-1, len(people.cells))


def _student(values: np.ndarray) -> tuple[float, float, float]:
    """The mean and Student's interval, which takes two values."""
    if len(values) == 0:
        return NAN, NAN, NAN
    mean = float(values.mean())
    half = t975(len(values) - 1) * float(values.std(ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else NAN
    return mean, mean - half, mean + half


def thresholds(people: People) -> list[Threshold]:
    found = []
    for c, cell in enumerate(people.cells):
        own = [censored(r.estimates[c], cell) for r in people.counting() if c in r.estimates]
        if not own:
            found.append(Threshold())
            continue
        t, lo, hi = _student(np.array([e.t for e in own]))
        lows, highs = ([end for end in ends if not math.isnan(end)] for ends in ([e.lo for e in own], [e.hi for e in own]))
        at_cap, at_floor = (sum(e.t == end for e in own) for end in (cell.cap(), cell.floor()))
        # Nobody's place among the levels is known where all are censored: then people do not scatter, but each might have.
        if lows and (len(own) == 1 or at_cap == len(own) or -math.inf in lows):
            lo = sum(lows) / len(lows)
        if highs and (len(own) == 1 or at_floor == len(own) or math.inf in highs):
            hi = sum(highs) / len(highs)
        with np.errstate(divide="ignore"):
            spread = float(np.exp2(np.mean(np.log2([e.spread for e in own]))))
        found.append(Threshold(t, lo, hi, spread, len(own), sum(e.trials for e in own), at_cap, at_floor))
    return found


# --- kinds ---

@dataclass
class Difference:
    """How many octaves of samples more one kind takes than the noisy picture of the same block and scene: each person's mean
    over the blocks of which they have both, then the mean over people with Student's interval (NaN below two; infinite where
    one of the two thresholds is censored on that side)."""
    octaves: float
    lo: float
    hi: float
    people: int
    blocks: int


def against_noisy(people: People, kind: str, only: Optional[int] = None) -> Difference:
    """only: of one cell, else of all blocks of the kind."""
    def noisy(c: int) -> Optional[int]:
        view, block = people.cells[c]
        return next((n for n, (v, b) in enumerate(people.cells)
                     if v.kind == "noisy" and b.id == block.id and v.scene() == view.scene()), None)
    pairs = [(c, noisy(c)) for c, cell in enumerate(people.cells) if cell.view.kind == kind and only in (None, c)]
    pairs = [(c, n) for c, n in pairs if n is not None]
    table = estimates(people)
    more = np.array([table[:, c] - table[:, n] for c, n in pairs]).reshape(len(pairs), len(table)).T
    blocks = (~np.isnan(more)).sum(1)
    own = np.nansum(more[blocks > 0], 1) / blocks[blocks > 0]
    mean, lo, hi = _student(own)
    low, high = estimates(people, "lo"), estimates(people, "hi")
    for person, (c, n) in ((p, pair) for p, of_person in enumerate(more) for pair, x in zip(pairs, of_person) if x == x):
        lo = -math.inf if math.isinf(low[person, c]) or math.isinf(high[person, n]) else lo
        hi = math.inf if math.isinf(high[person, c]) or math.isinf(low[person, n]) else hi
    return Difference(mean, lo, hi, people=len(own), blocks=int(blocks.max(initial=0)))


# --- agreement ---

@dataclass
class Ceiling:
    """Agreement of people over blocks, in log2 of the thresholds. Each person against the mean of the others says how well
    the best possible prediction could do on one person (lower bound of the noise ceiling); against the mean with them in it
    is the upper bound (Nili et al. 2014). Means over people; NaN below two people or three blocks."""
    people: int = 0
    blocks: int = 0  # that at least two people have
    pearson_lower: float = NAN
    pearson_upper: float = NAN
    spearman_lower: float = NAN
    spearman_upper: float = NAN
    median_abs_log2_lower: float = NAN
    median_abs_log2_upper: float = NAN
    within_half_lower: float = NAN  # share of blocks within half an octave, an octave
    within_one_lower: float = NAN


def pearson(x: np.ndarray, y: np.ndarray) -> float:
    """NaN where one of them does not vary."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return float(np.corrcoef(x, y)[0, 1]) if np.ptp(x) > 0 and np.ptp(y) > 0 else NAN


def ceiling(people: People) -> Ceiling:
    table, figures, c = estimates(people), [], Ceiling()
    for person, own in enumerate(table):
        others = np.delete(table, person, axis=0)
        known = ~np.isnan(own) & (~np.isnan(others)).any(0)
        if known.sum() < 3:
            continue
        of_person: dict[str, float] = {}
        for name, rest in (("lower", others), ("upper", table)):
            mean = np.nanmean(rest[:, known], 0)
            errors = np.abs(own[known] - mean)
            of_person |= {"pearson_" + name: pearson(own[known], mean), "median_abs_log2_" + name: np.median(errors),
                          "spearman_" + name: pearson(rankdata(own[known]), rankdata(mean))}
            if name == "lower":
                of_person |= {"within_half_lower": np.mean(errors <= 0.5), "within_one_lower": np.mean(errors <= 1.0)}
        figures.append(of_person)
        c.blocks = max(c.blocks, int(known.sum()))
    c.people = len(figures)
    for name in figures[0] if figures else ():
        setattr(c, name, float(np.mean([f[name] for f in figures])))
    return c


# --- judgements ---

@dataclass
class Share:
    """Of "same"."""
    same: int = 0
    n: int = 0
    share: float = NAN
    lo: float = NAN  # Wilson, 95 %
    hi: float = NAN
    rating: float = NAN  # mean


def share(people: People, view: Optional[int], condition: int) -> Share:
    """view None: all."""
    found = [j for r in people.counting() for j in r.judgements if j.condition == condition and view in (None, j.view)]
    n, same = len(found), sum(j.same for j in found)
    return Share(same, n, same / n, *wilson(same, n), rating=sum(j.rating for j in found) / n) if n else Share()


def intraclass(people: People, condition: int) -> float:
    """Correlation of the judgements of one condition within people (one-way analysis of variance, not below 0); NaN below
    two people or two judgements each."""
    found = [[j.same for j in r.judgements if j.condition == condition] for r in people.counting()]
    groups = [np.array(same) for same in found if same]
    sizes = np.array([len(g) for g in groups])
    if len(groups) < 2 or sizes.sum() - len(groups) < 1:
        return NAN
    everything = np.concatenate(groups)
    between = sum(len(g) * (g.mean() - everything.mean())**2 for g in groups) / (len(groups) - 1)
    within = sum(((g - g.mean())**2).sum() for g in groups) / (sizes.sum() - len(groups))
    n0 = (sizes.sum() - (sizes**2).sum() / sizes.sum()) / (len(groups) - 1)
    total = between + (n0 - 1) * within
    return max(float((between - within) / total), 0.0) if total > 0 else 0.0


def people_needed(p: float, difference: float, m: int, icc: float) -> int:
    """People needed to show that two conditions differ by `difference` of share (two-sided 5 %, power 80 %), when one has
    the share p and each person judges m pictures of each condition:
        n = (z.975 + z.80)^2 (p q + p' q') / difference^2 · (1 + (m - 1) icc) / m"""
    z = float(ndtri(0.975) + ndtri(0.8))
    other = p - difference if p - difference >= 0 else p + difference
    judgements = z * z * (p * (1 - p) + other * (1 - other)) / difference**2
    return math.ceil(judgements * (1 + (m - 1) * icc) / m)
