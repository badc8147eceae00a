# SPDX-License-Identifier: MIT
"""How charts look: series of numbers with matplotlib. The size of a picture does not depend on the data."""
from __future__ import annotations

import math
from typing import NamedTuple, Optional, Sequence

from ..study.files import Refused, replaced  # noqa: F401 (what draw may raise)
from .canvas import Axes, Figure, FigureCanvasAgg, FixedLocator, FuncFormatter, NullLocator

Range = tuple[Optional[float], Optional[float]]  # None: as far as the series go
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2", "#bcbd22", "#7f7f7f")


class Series(NamedTuple):
    x: Sequence[float]
    y: Sequence[float]  # NaN: no point
    title: str = ""  # "": not in the key
    colour: str = ""  # "": the next of COLOURS
    line: str = "-"  # matplotlib's; "": the points stand apart
    marker: str = ""
    size: float = 4.0  # of a marker
    filled: bool = True
    spans: Sequence[tuple[float, float]] = ()  # ends of a vertical bar through each point


class Rule(NamedTuple):
    """A straight line across the chart."""
    axis: str  # "x": vertical, at this x
    at: float
    text: str = ""  # beside it: at its right end, or on its right
    left: bool = False  # on its left
    title: str = ""  # in the key
    line: str = "--"
    colour: str = "#444444"


class Chart(NamedTuple):
    series: Sequence[Series]
    title: str = ""
    x_label: str = ""
    y_label: str = ""
    x_log: int = 0  # base; 0: linear
    y_log: int = 0
    x_range: Range = (None, None)
    y_range: Range = (None, None)
    rules: Sequence[Rule] = ()
    square: bool = False
    key: str = "best"  # matplotlib's places; "outside": to the right; "": none
    key_title: str = ""
    ticks: Sequence[float] = ()  # of both axes where they are logarithmic, else of x; (): its own


def new_figure(width: int, height: int) -> Figure:
    """Pixels."""
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: str) -> None:
    """A PNG, which becomes `path` when it is whole; else Refused."""
    with replaced(path) as file:
        figure.savefig(file.buffer, format="png", metadata={"Software": None})


def _axis(axes: Axes, name: str, log: int, ticks: Sequence[float]) -> None:
    axis = axes.xaxis if name == "x" else axes.yaxis
    if log:
        (axes.set_xscale if name == "x" else axes.set_yscale)("log", base=log)
    if log == 2 or ticks:  # samples are read as such, not as powers
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    if ticks and (log or name == "x"):
        axis.set_major_locator(FixedLocator(ticks))
        axis.set_minor_locator(NullLocator())


def _series(axes: Axes, s: Series, colour: str) -> None:
    how = {"color": colour, "label": s.title or None, "marker": s.marker or None, "markersize": s.size,
           "markerfacecolor": colour if s.filled else "none", "linestyle": s.line or "none", "linewidth": 1.6}
    if s.spans:
        ends = [[abs(y - span[i]) for y, span in zip(s.y, s.spans)] for i in (0, 1)]
        axes.errorbar(s.x, s.y, ends, elinewidth=1, capsize=3, **how)
    else:
        axes.plot(s.x, s.y, **how)


def _rule(axes: Axes, rule: Rule) -> None:
    how = {"color": rule.colour, "linestyle": rule.line, "linewidth": 1.2, "label": rule.title or None}
    small = {"fontsize": 8, "color": rule.colour}
    if rule.axis == "x":
        axes.axvline(rule.at, **how)
        axes.annotate(rule.text, (rule.at, 1), (-3 if rule.left else 3, -4), textcoords="offset points", va="top",
                      ha="right" if rule.left else "left", xycoords=axes.get_xaxis_transform(), **small)
    else:
        axes.axhline(rule.at, **how)
        axes.annotate(rule.text, (1, rule.at), (-4, -4), textcoords="offset points", va="top", ha="right",
                      xycoords=axes.get_yaxis_transform(), **small)


def put_chart(axes: Axes, c: Chart) -> None:
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_title(c.title, fontsize=10)
    axes.set_xlabel(c.x_label)
    axes.set_ylabel(c.y_label)
    for spine in axes.spines.values():
        spine.set_color("#444444")
    _axis(axes, "x", c.x_log, c.ticks)
    _axis(axes, "y", c.y_log, c.ticks)
    if c.square:
        axes.set_box_aspect(1)
    for i, s in enumerate(c.series):
        _series(axes, s, s.colour or COLOURS[i % len(COLOURS)])
    for rule in c.rules:
        if math.isfinite(rule.at):
            _rule(axes, rule)
    axes.set_xlim(*c.x_range)  # of what is drawn, where it is open
    axes.set_ylim(*c.y_range)
    if c.key and (any(s.title for s in c.series) or any(r.title for r in c.rules)):
        place = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)} if c.key == "outside" else {"loc": c.key}
        axes.legend(fontsize=8, framealpha=0.8, title=c.key_title or None, title_fontsize=8, **place)


def figure_of(charts: Sequence[Chart], size: tuple[int, int], across: int = 4) -> Figure:
    """Charts side by side, in rows of `across`."""
    figure, across = new_figure(*size), min(len(charts), across)
    for i, chart in enumerate(charts):
        put_chart(figure.add_subplot(-(-len(charts) // across), across, i + 1), chart)
    return figure


def draw(path: str, charts: Sequence[Chart], size: tuple[int, int], across: int = 4) -> None:
    save(figure_of(charts, size, across), path)
