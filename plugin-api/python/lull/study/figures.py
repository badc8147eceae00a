# SPDX-License-Identifier: MIT
"""The pictures of a report: each a figure of matplotlib, whose size does not depend on the data."""
from __future__ import annotations

import math
import os
from typing import Iterator, Sequence

import numpy as np

from ..plot.canvas import Figure
from ..plot.charts import new_figure, save
from .definition import TWO_INTERVAL, VALIDATION
from .people import People
from .psychometric import p_correct
from .summary import Threshold, estimates, share

BLUE, RED, ACROSS, MOST_CURVES = "#3b6ea5", "#c0504d", 4, 48


def thresholds_figure(people: People, thresholds: Sequence[Threshold]) -> Figure:
    """Thresholds of all blocks, view after view, with their intervals; arrows where these have no end."""
    figure = new_figure(900, 420)
    axes = figure.add_subplot(xlabel="block, view after view", ylabel="samples per pixel")
    axes.set_xlim(-0.5, len(thresholds) - 0.5)
    axes.set_yscale("log", base=2)
    known = [(c, t) for c, t in enumerate(thresholds) if not math.isnan(t.t)]
    spp = np.exp2([[t.t, t.lo if math.isfinite(t.lo) else t.t, t.hi if math.isfinite(t.hi) else t.t] for _, t in known]).T
    axes.errorbar([c for c, _ in known], spp[0], (spp[0] - spp[1], spp[2] - spp[0]), fmt="o", ms=4, lw=1, color=BLUE)
    for side, arrow in (("below", "v"), ("above", "^")):
        open_ended = [(c, 2.0 ** t.t) for c, t in known if side in t.censored()]
        axes.plot([c for c, _ in open_ended], [y for _, y in open_ended], arrow, ms=8, mfc="none", color=BLUE)
    return figure


def people_figure(people: People, thresholds: Sequence[Threshold]) -> Figure:
    """Each person's thresholds against the mean of all; of who does not count, none."""
    figure = new_figure(560, 560)
    spp = "samples per pixel"
    axes = figure.add_subplot(xlabel="mean over people, " + spp, ylabel="one person, " + spp, box_aspect=1)
    axes.set_xscale("log", base=2)
    axes.set_yscale("log", base=2)
    mean = np.exp2([t.t for t in thresholds])
    for own in estimates(people):
        axes.plot(mean, np.exp2(own), "o", ms=4)
    axes.axline((1, 1), (2, 2), color="0.6", lw=1)
    return figure


def curves_figure(people: People, thresholds: Sequence[Threshold]) -> Figure:
    """Of each block the shares of correct answers of all people that count, and the curve at their mean threshold and
    spread."""
    known = [c for c, t in enumerate(thresholds) if not math.isnan(t.t)][:MOST_CURVES]
    across = min(len(known), ACROSS)
    down = -(-len(known) // across)
    figure = new_figure(250 * across, 240 * down)
    for i, c in enumerate(known):
        view, block = people.cells[c]
        axes = figure.add_subplot(down, across, i + 1, ylim=(0.35, 1.05), xscale="log")
        axes.set_title(f"{view.name}, block {block.id}: {2.0 ** thresholds[c].t:.0f}", fontsize=8)
        levels = np.array(block.levels)
        choices = [(x, correct) for r in people.counting() for at, (x, _, correct) in r.choices if at == c]
        answers = [[correct for x, correct in choices if x == math.log2(level)] for level in levels]
        seen = [(level, np.mean(a), 9 + 6 * len(a)) for level, a in zip(levels, answers) if a]
        axes.scatter([s[0] for s in seen], [s[1] for s in seen], [s[2] for s in seen], color=BLUE)
        axes.plot(levels, p_correct(np.log2(levels), thresholds[c].t, thresholds[c].spread), color=RED)
        axes.tick_params(labelsize=7)
    return figure


def shares_figure(people: People) -> Figure:
    """Per view and pooled: the share of "same" of each condition with its interval."""
    study, figure = people.study, new_figure(900, 420)
    rows = [*enumerate(view.name for view in study.views), (None, "(all)")]
    axes = figure.add_subplot(ylabel="judged the same, %", ylim=(0, 100), xlim=(-0.6, len(rows) - 0.4))
    for c, name in enumerate(study.conditions):
        aside = 0.6 * ((c + 0.5) / len(study.conditions) - 0.5)
        found = [(at + aside, s) for at, s in enumerate(share(people, v, c) for v, _ in rows) if s.n]
        spans = [[100 * (s.share - s.lo) for _, s in found], [100 * (s.hi - s.share) for _, s in found]]
        axes.errorbar([x for x, _ in found], [100 * s.share for _, s in found], spans, fmt="o", ms=5, lw=1, label=name)
    axes.set_xticks(range(len(rows)), [name for _, name in rows])
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize=8)
    return figure


def figures(people: People, thresholds: Sequence[Threshold]) -> Iterator[tuple[str, Figure]]:
    if people.study.task == VALIDATION:
        yield "shares.png", shares_figure(people)
    elif any(not math.isnan(t.t) for t in thresholds):
        yield "thresholds.png", thresholds_figure(people, thresholds)
        yield "people.png", people_figure(people, thresholds)
        if people.study.task == TWO_INTERVAL:
            yield "curves.png", curves_figure(people, thresholds)


def write_pictures(folder: str, people: People, thresholds: Sequence[Threshold]) -> None:
    for name, figure in figures(people, thresholds):
        save(figure, os.path.join(folder, name))
