# SPDX-License-Identifier: MIT
"""The kinds of pictures: from what a file says to a figure."""
from __future__ import annotations

import math
import statistics
from typing import Any, Callable, Iterable, Sequence

import numpy as np

from ..study.files import Refused
from .canvas import Figure, LogNorm, MaxNLocator, ScalarMappable
from .charts import COLOURS, Chart, Rule, Series, figure_of, new_figure
from .sources import Blocks, Cost, Evaluation, Table, Wanted

TRAINING, VALIDATION, AUC = "#3366aa", "#cc5522", "#228833"
SAMPLES = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000, 100000)
MOST_MAPS, LABELLED_MAPS, LABELLED_COLUMNS, SHOWN_BLOCKS = 100, 6, 16, 6


# --- training ---

def curves(table: Table, _: Wanted) -> Figure:
    """Learning curves: a chart for the denoiser, two for generator and discriminator."""
    def series(rows: list[dict[str, float]], column: str, title: str, colour: str) -> Series:
        return Series([r["step"] for r in rows], [r[column] for r in rows], title, colour, marker="o", size=3)

    denoiser, judge = table.phase("denoiser"), table.phase("judge")
    charts = []
    if denoiser:
        charts.append(Chart([series(denoiser, "loss", "training", TRAINING),
                             series(denoiser, "validation_loss", "validation", VALIDATION)],
                            "Denoiser: 1 - SSIM", "step", y_range=(0, None)))
    if judge:
        charts += [Chart([series(judge, "loss", "training", TRAINING),
                          series(judge, "validation_loss", "validation, calibrated", VALIDATION)],
                         "Generator and discriminator: cross-entropy", "step", y_range=(0, None)),
                   Chart([series(judge, "accuracy", "training accuracy", TRAINING),
                          series(judge, "validation_accuracy", "validation accuracy", VALIDATION),
                          series(judge, "validation_auc", "validation AUC", AUC)],
                         "Accuracy and AUC", "step", y_range=(0.5, 1), key="lower right")]
    if not charts:
        raise Refused(f"{table.path}: no rows of a phase denoiser or judge")
    return figure_of(charts, (480 * len(charts), 400))


# --- decisions ---

def roc_curve(score: Sequence[float], noisy: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Shares of converged and of noisy windows whose score is at least a cut, from (0, 0) on."""
    order = np.argsort(-np.asarray(score, float), kind="stable")
    falling, labels = np.asarray(score, float)[order], np.asarray(noisy)[order]
    ends = np.append(np.flatnonzero(np.diff(falling)), len(falling) - 1)  # equal scores are called together
    hits, misses = np.cumsum(labels == 1)[ends], np.cumsum(labels == 0)[ends]
    shares = [np.append(0, n / n[-1]) if n[-1] else np.zeros(len(n) + 1) for n in (misses, hits)]
    return shares[0], shares[1]


def roc(e: Evaluation, wanted: Wanted) -> Figure:
    split, series = e.split(wanted), []
    methods = e.methods(split)
    for name in [chosen] if (chosen := wanted.method and e.method(wanted, methods)) else methods:
        pairs = [(s, n) for w in e.windows(split, name) for s, n in zip(w.score, w.noisy)
                 if n is not None and not math.isnan(s)]
        if pairs:
            series.append(Series(*roc_curve([s for s, _ in pairs], [n for _, n in pairs]), name))
    if not series:
        raise Refused(f"{e.path}: no window of the split {split} was judged")
    diagonal = Series((0, 1), (0, 1), colour="#999999", line="--")
    return figure_of([Chart([*series, diagonal], f"all windows of the {split} scenes pooled",
                            "share of converged images called noisy", "share of noisy images called noisy",
                            x_range=(0, 1), y_range=(0, 1), square=True, key="lower right")], (720, 680))


def scores(e: Evaluation, wanted: Wanted) -> Figure:
    """Scores of blocks spread over the split by their places in the list; dashed: the threshold."""
    split = e.split(wanted)
    method = e.method(wanted, e.methods(split))
    found = e.windows(split, method)
    shown = found[::max(1, -(-len(found) // SHOWN_BLOCKS))]
    series = [Series(w.spp, w.score, w.name, colour, marker="o", size=3) for w, colour in zip(shown, COLOURS)]
    if all(math.isnan(v) for s in series for v in s.y):
        raise Refused(f"{e.path}: {method} judged no window of the split {split}")
    rules = [Rule("x", w.threshold, colour=colour) for w, colour in zip(shown, COLOURS)]
    return figure_of([Chart(series, "", "samples per pixel (dashed: threshold)", method, x_log=10, key="outside",
                            rules=[*rules, Rule("y", e.cut(split, method), title="cut", line=":")])], (900, 560))


# --- thresholds ---

def known(b: Blocks, path: str) -> tuple[np.ndarray, np.ndarray]:
    """log2 of both sides, of blocks whose thresholds are known."""
    pairs = [(t, m) for t, m, c in zip(b.truth, b.model, b.censored) if not c and t > 0 and m > 0]
    if not pairs:
        raise Refused(f"{path}: no block with a threshold below the cap")
    truth, model = np.log2(np.array(pairs)).T
    return truth, model


def regression(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Least squares y = a + b x, and Pearson's r; NaN where x, or y, is all the same."""
    mx, my = x - x.mean(), y - y.mean()
    xx, yy, xy = mx @ mx, my @ my, mx @ my
    b = xy / xx if xx > 0 else math.nan
    return y.mean() - b * x.mean(), b, xy / math.sqrt(xx * yy) if xx * yy > 0 else math.nan


def scatter(source: Any, wanted: Wanted) -> Figure:
    """Predicted against true thresholds, with their regression in log2."""
    blocks = source.blocks(wanted)
    truth, model = known(blocks, source.path)
    a, b, r = regression(truth, model)
    lo = 2 ** (math.floor(4 * min(truth.min(), model.min())) / 4 - 0.05)
    hi = 2 ** (math.ceil(4 * max(truth.max(), model.max())) / 4 + 0.05)
    ends = np.array([lo, hi])
    series = [Series(ends, ends, "equal", "#444444"), Series(ends, 2 * ends, "one octave", "#999999", "--"),
              Series(ends, ends / 2, colour="#999999", line="--"),
              Series(2 ** truth, 2 ** model, "blocks", "#1f77b4", line="", marker="o")]
    if not math.isnan(b):
        series.append(Series(ends, 2 ** (a + b * np.log2(ends)), f"regression in log2, r = {r:.3f}", "#d95f02"))
    return figure_of([Chart(series, "", f"{blocks.names[0]} (spp)", f"{blocks.names[1]} (spp)", x_log=2, y_log=2,
                            x_range=(lo, hi), y_range=(lo, hi), square=True, key="upper left", ticks=SAMPLES)], (760, 720))


def histogram(source: Any, wanted: Wanted) -> Figure:
    """Of log2(predicted / true), in quarters of an octave; what is beyond four octaves is at the ends."""
    blocks = source.blocks(wanted)
    truth, model = known(blocks, source.path)
    quarters = np.floor(4 * np.clip(model - truth, -4, 4) + 0.5) / 4
    figure = figure_of([Chart([], blocks.names[1], "log2(predicted / true): left of 0 stops early, right of 0 wastes samples",
                              "blocks", x_range=(-4.15, 4.15), key="",
                              rules=[Rule("x", 0), Rule("x", math.log2(0.8), "early stop", True, line="-", colour="#d62728")])],
                       (760, 480))
    places, counts = np.unique(quarters, return_counts=True)
    axes = figure.axes[0]
    axes.bar(places, counts, 0.23, color="#1f77b4", alpha=0.8)
    axes.set_ylim(0, 1.08 * counts.max())
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def maps(source: Any, wanted: Wanted) -> Figure:
    """Of each view its blocks' thresholds on the left and on the right, on one scale of colours for all."""
    b = source.blocks(wanted)
    views = list(dict.fromkeys(b.views))[:MOST_MAPS]
    both = np.array([b.truth, b.model], float)
    if not np.isfinite(both).any():
        raise Refused(f"{source.path}: no block has a threshold")
    lo, hi = float(np.nanmin(both)), float(np.nanmax(both))
    norm = LogNorm(lo, hi if hi > lo else 2 * lo)
    across, cell = min(len(views), 5), 900 if len(views) == 1 else 360
    down = -(-len(views) // across)
    figure = new_figure(across * cell + 60, down * cell * 6 // 10 + 60)
    figure.suptitle(f"threshold (spp) per block: left {b.names[0]}, right {b.names[1]}", fontsize=10)
    for n, view in enumerate(views):
        mine = [i for i, name in enumerate(b.views) if name == view]
        columns, rows = (1 + max(b.places[i][k] for i in mine) for k in (0, 1))
        image = np.full((rows, 2 * columns + 1), math.nan)
        for i in mine:
            for side in (0, 1):
                image[b.places[i][1], b.places[i][0] + side * (columns + 1)] = both[side, i]
        axes = figure.add_subplot(down, across, n + 1)
        axes.imshow(image, "viridis", norm)
        axes.set_title(view, fontsize=9)
        axes.set_axis_off()
        if len(views) <= LABELLED_MAPS and columns <= LABELLED_COLUMNS:
            for row, column in np.argwhere(np.isfinite(image)):
                axes.text(column, row, f"{image[row, column]:.0f}", ha="center", va="center", color="white",
                          fontsize=10 if len(views) == 1 else 7)
    figure.colorbar(ScalarMappable(norm, "viridis"), ax=figure.axes, format="{x:g}")
    return figure


# --- cost ---

PANELS = {"noisy": ("share of blocks that still show noise", statistics.fmean, 0, (0, 1)),
          "early": ("share of blocks stopped early, below 0.8 of the threshold", statistics.fmean, 0, (0, 1)),
          "worst": ("visible difference of the worst block", statistics.median, 10, (0.1, 10)),
          "flip": ("mean FLIP", statistics.fmean, 0, (0, None)),
          "relmse": ("relMSE", statistics.median, 10, (1e-6, None))}  # label, mean over the scenes, scale, range


def over_scenes(values: Iterable[float], how: Callable[[Iterable[float]], float] = statistics.median) -> float:
    """Of those that are known."""
    finite = [v for v in values if v is not None and math.isfinite(v)]
    return how(finite) if finite else math.nan


def frontier_charts(panels: Sequence[str], x_label: str,
                    series: Callable[[str, Callable[[Iterable[float]], float]], Sequence[Series]]) -> list[Chart]:
    """A chart for each of PANELS; series(panel, mean over scenes): its curves, against the cost relative to the limit."""
    return [Chart(series(panel, PANELS[panel][1]), "", x_label, PANELS[panel][0], x_log=10, y_log=PANELS[panel][2],
                  x_range=(0.1, 40), y_range=PANELS[panel][3], rules=[Rule("x", 1, "the limit", colour="#000000")],
                  key="" if n else "upper right") for n, panel in enumerate(panels)]


def frontier(cost: Cost, _: Wanted) -> Figure:
    """Quality against samples, both over the dial of each criterion; a filled point: a setting of its own."""
    limit = cost.scenes("limit", ("none",))
    if not limit:
        raise Refused(f"{cost.path}: it has no criterion 'limit' to compare with")

    def series(panel: str, how: Callable[[Iterable[float]], float]) -> list[Series]:
        lines = []
        for n, name in enumerate(c for c in cost.criteria() if c not in ("limit", "fixed") and ", no " not in c):
            for dials, line in ((("visible", "threshold", "spp"), "-"), (("own",), "")):
                points = [(over_scenes(f["samples"] / limit[0][scene]["samples"] for scene, f in p.items()),
                           over_scenes((f[panel] for f in p.values()), how)) for p in cost.scenes(name, dials)]
                if points:
                    lines.append(Series(*zip(*points), name if line or not cost.scenes(name, ("visible", "threshold")) else "",
                                        COLOURS[n % len(COLOURS)], line, "o", 4 if line else 8, not line))
        return lines

    return figure_of(frontier_charts(("noisy", "worst"), "samples against stopping every block at its threshold", series),
                     (1280, 480))


KINDS: dict[str, Callable[[Any, Wanted], Figure]] = {
    "curves": curves, "roc": roc, "scatter": scatter, "histogram": histogram, "maps": maps, "scores": scores,
    "frontier": frontier}
