# SPDX-License-Identifier: MIT
"""The psychometric curves of one person from two-interval forced choices, one per block, and small-sample intervals.

x = log2 of the samples per pixel. Without bias and lapses P(correct | x) = 1/2 + 1/2 Phi((t - x)/s): three in four are
correct at the threshold t, s is the spread in octaves. As in signal detection theory that is Phi(d(x)), d being what
separates the intervals; a bias b for one interval makes it Phi(d + b) when the noise comes first and Phi(d - b) when it
comes second (Green & Swets 1966; Yeshurun, Carrasco, Maloney 2008), and with probability `lapse` the answer is a guess.

Lapse and bias belong to the person, the spread to the block but not far from the person's own, t to the block alone. The
joint posterior is taken over a grid: t uniform from two octaves below the lowest level to two above the highest, the others
with the priors below. So every block helps to know the person, and what is not known of the person widens the intervals."""
from __future__ import annotations

import math
from typing import NamedTuple, Sequence

import numpy as np
from scipy.special import ndtr, ndtri, stdtrit

# Steps of 1/12 octave are a small part of any standard error that 30 trials reach. The priors: spreads around half an octave
# as in the published raw trials, a block's with the person's or one step from it; lapses mostly below a tenth; biases mostly
# below half of a d' of 1. Habits are pairs of bias and lapse.
PER_OCTAVE, MARGIN = 12, 2
SPREADS = np.array([0.15, 0.22, 0.33, 0.5, 0.75, 1.1, 1.6])
SPREAD_PRIOR = np.array([0.05, 0.1, 0.2, 0.3, 0.2, 0.1, 0.05])
LAPSES, LAPSE_PRIOR = np.array([0.0, 0.03, 0.08, 0.2]), np.array([0.4, 0.4, 0.15, 0.05])
BIASES, BIAS_PRIOR = np.array([-0.8, -0.4, 0.0, 0.4, 0.8]), np.array([0.06, 0.24, 0.4, 0.24, 0.06])
OWN_SPREAD = 0.8  # that a block's spread is the person's; the rest on its neighbours
PRIOR = SPREAD_PRIOR[:, None] * np.outer(BIAS_PRIOR, LAPSE_PRIOR).ravel()  # [spread][habit]
RAREST = 1e-9  # nothing is impossible: a finger slips
_NEAR = np.eye(len(SPREADS), k=1) + np.eye(len(SPREADS), k=-1)
GIVEN = OWN_SPREAD * np.eye(len(SPREADS)) + (1 - OWN_SPREAD) * _NEAR / _NEAR.sum(0)  # [a block's spread][the person's]
_MIDDLES = (np.log2(SPREADS)[1:] + np.log2(SPREADS)[:-1]) / 2
_ENDS = 2 * np.log2(SPREADS)[[0, -1]] - _MIDDLES[[0, -1]]
SPREAD_EDGES = np.array([_ENDS[0], *_MIDDLES, _ENDS[1]])  # octaves
# d against z = (t - x)/s: tabulated once, since its inverse of the normal distribution is dear
_Z = np.linspace(-8, 8, 1025)
_D = ndtri(np.clip(0.5 + 0.5 * ndtr(_Z), 1e-15, 1 - 1e-15))


class Choice(NamedTuple):
    x: float  # octaves
    first: bool  # the noise was in the first interval
    correct: bool


class Curve(NamedTuple):
    """One block: what was chosen; lowest and highest level, octaves."""
    choices: Sequence[Choice]
    x_min: float
    x_max: float


class Estimate(NamedTuple):
    """Octaves; NaN where nothing is known. An end of the interval that is infinite is open."""
    trials: int
    t: float  # posterior median, central 95 %, standard deviation
    lo: float
    hi: float
    se: float
    spread: float  # the same of s
    spread_lo: float = math.nan
    spread_hi: float = math.nan


def p_correct(x: np.ndarray, t: float, spread: float) -> np.ndarray:
    """P(correct) at x without bias and lapses."""
    return 0.5 + 0.5 * ndtr((t - x) / spread)


def t975(df: int) -> float:
    """The 97.5 % quantile of Student's t."""
    return float(stdtrit(df, 0.975))


def wilson(k: int, n: int) -> tuple[float, float]:
    """Wilson's score interval, 95 %, for k of n (Wilson 1927)."""
    z = float(ndtri(0.975))
    p, d = k / n, 1 + z * z / n
    centre, half = (p + z * z / (2 * n)) / d, z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / d
    return 0.0 if k == 0 else centre - half, 1.0 if k == n else centre + half


def _grid(curve: Curve) -> np.ndarray:
    steps = math.ceil((curve.x_max - curve.x_min + 2 * MARGIN) * PER_OCTAVE) + 1
    return curve.x_min - MARGIN + np.arange(steps) / PER_OCTAVE


def _likelihood(curve: Curve) -> np.ndarray:
    """[t][spread][habit], up to a factor."""
    grid, kinds = _grid(curve), np.unique(np.array(curve.choices, float), axis=0, return_counts=True)
    log = np.zeros((len(grid), *PRIOR.shape))
    for (x, first, correct), count in zip(*kinds):
        d = np.interp((grid[:, None] - x) / SPREADS, _Z, _D)
        p = ndtr(d[..., None] + (BIASES if first else -BIASES))
        right = np.minimum(0.5 * LAPSES + (1 - LAPSES) * p[..., None], 1 - RAREST).reshape(log.shape)
        log += count * np.log(right if correct else 1 - right)
    return np.exp(log - log.max())


def _quantiles(weights: np.ndarray, edges: np.ndarray) -> list[float]:
    """Median and central 95 % of a distribution over cells, linear within a cell."""
    return [float(q) for q in np.interp((0.5, 0.025, 0.975), [0, *np.cumsum(weights / weights.sum())], edges)]


def estimate(curves: Sequence[Curve]) -> list[Estimate]:
    """Of all blocks of one person."""
    evidence = [np.log(np.maximum(GIVEN.T @ _likelihood(curve).sum(0), np.finfo(float).tiny)) for curve in curves]
    posterior, found = np.log(PRIOR) + sum(evidence), []
    for curve, own in zip(curves, evidence):
        others = posterior - own  # what everything but the block tells
        joint = _likelihood(curve) * (GIVEN @ np.exp(others - others.max()))
        of_t, of_s, grid = joint.sum((1, 2)), joint.sum((0, 2)), _grid(curve)
        mean = np.average(grid, weights=of_t)
        t, lo, hi = _quantiles(of_t, np.append(grid, grid[-1] + 1 / PER_OCTAVE) - 0.5 / PER_OCTAVE)
        se = math.sqrt(np.average((grid - mean) ** 2, weights=of_t))
        found.append(Estimate(len(curve.choices), t, lo, hi, se, *(2.0**q for q in _quantiles(of_s, SPREAD_EDGES))))
    return found
