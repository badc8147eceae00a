# SPDX-License-Identifier: MIT
"""The files that pictures are drawn from, as they are read: no matplotlib here."""
from __future__ import annotations

import codecs
import csv
import math
from typing import Any, NamedTuple, Optional, Sequence

from ..study.files import Refused, lines_of, loads, read_file

MOST_BYTES = 1 << 30


class Blocks(NamedTuple):
    """Thresholds of blocks from two sides, samples per pixel; row by row."""
    names: tuple[str, str]
    truth: Sequence[float]
    model: Sequence[float]
    censored: Sequence[bool]  # the true one is only known to be no smaller
    views: Sequence[str]
    places: Sequence[tuple[int, int]]  # column, row in the view


class Windows(NamedTuple):
    """What a method said of a block, from window to window."""
    name: str  # of the block
    threshold: float
    spp: Sequence[float]
    noisy: Sequence[Optional[int]]
    score: Sequence[float]


class Wanted(NamedTuple):
    """What of a file: ""; the first that there is."""
    split: str = ""
    method: str = ""


def number(value: Any) -> float:
    """null and empty cells are not known."""
    return math.nan if value in (None, "") else float(value)


def chosen(what: str, asked: str, names: Sequence[str], usual: str) -> str:
    if asked and asked not in names:
        raise Refused(f"--{what} {asked}: expected {', '.join(names)}")
    return asked or (usual if usual in names else names[0])


class Table:
    """A CSV: of a training, of ggn compare, or the stops of ggn evaluate."""

    def __init__(self, path: str, text: str):
        self.path = path
        lines = lines_of(path, text)
        self.rows = list(csv.DictReader(lines, delimiter=";" if ";" in lines[0] else ","))
        self.columns = set(self.rows[0]) if self.rows else set()

    def kinds(self) -> Sequence[str]:
        if {"phase", "step", "loss"} <= self.columns:
            return ("curves",)
        if {"view", "block", "true_spp", "model_spp", "column", "row"} <= self.columns:
            return ("scatter", "histogram", "maps")
        return ("scatter", "histogram") if {"view", "threshold", "stop", "censored"} <= self.columns else ()

    def phase(self, name: str) -> list[dict[str, float]]:
        """The rows of a phase, as numbers."""
        return [{k: number(v) for k, v in row.items() if k != "phase"} for row in self.rows if row["phase"] == name]

    def blocks(self, _: Wanted) -> Blocks:
        rows, two = self.rows, ("true_spp", "model_spp") if "true_spp" in self.columns else ("threshold", "stop")
        names = ("reference", "model") if two[0] == "true_spp" else two
        return Blocks(names, [number(r[two[0]]) for r in rows], [number(r[two[1]]) for r in rows],
                      [r.get("censored", "0") != "0" for r in rows], [r["view"] for r in rows],
                      [(int(r.get("column", 0)), int(r.get("row", 0))) for r in rows])


class Evaluation:
    """figures.json of ggn evaluate."""

    def __init__(self, path: str, figures: dict[str, Any]):
        self.path, self.figures = path, figures

    def kinds(self) -> Sequence[str]:
        return ("roc", "scatter", "histogram", "maps", "scores")

    def split(self, wanted: Wanted) -> str:
        return chosen("split", wanted.split, list(self.figures["splits"]), "test")

    def method(self, wanted: Wanted, names: Sequence[str]) -> str:
        """The last one that is no other's name is what was evaluated."""
        return chosen("method", wanted.method, names, names[-1])

    def of(self, split: str) -> list[dict[str, Any]]:
        return [block for block in self.figures["stops"] if block["split"] == split]

    def blocks(self, wanted: Wanted) -> Blocks:
        split = self.split(wanted)
        found = self.of(split)
        method = self.method(wanted, list(self.figures["splits"][split]))
        return Blocks((f"threshold, {split}", method), [number(b["threshold"]) for b in found],
                      [number(b["spp"][method]) for b in found], [bool(b["censored"]) for b in found],
                      [b["view"] for b in found], [(int(b["column"]), int(b["row"])) for b in found])

    def methods(self, split: str) -> list[str]:
        """Those that have scores."""
        return list(self.of(split)[0]["windows"]["scores"])

    def windows(self, split: str, method: str) -> list[Windows]:
        return [Windows(f"{b['view']} {b['block']}", number(b["threshold"]), [number(v) for v in b["windows"]["spp"]],
                        b["windows"]["noisy"], [number(v) for v in b["windows"]["scores"][method]]) for b in self.of(split)]

    def cut(self, split: str, method: str) -> float:
        return number(self.figures["splits"][split][method].get("cut"))


class Cost:
    """What ggn cost writes: points of criteria over their dials, with figures for each scene."""

    def __init__(self, path: str, figures: dict[str, Any]):
        self.path, self.points = path, figures["points"]

    def kinds(self) -> Sequence[str]:
        return ("frontier",)

    def scenes(self, criterion: str, dials: Sequence[str]) -> list[dict[str, dict[str, float]]]:
        """Of each point of a criterion on one of these dials: {scene: figures}."""
        return [{scene: {k: number(v) for k, v in f.items()} for scene, f in p["scenes"].items()}
                for p in self.points if p["criterion"] == criterion and p["dial"] in dials]

    def criteria(self) -> list[str]:
        return list(dict.fromkeys(p["criterion"] for p in self.points))


def read(path: str) -> Any:
    """A Table, an Evaluation or a Cost; Refused when it is none of them."""
    data = read_file(path, MOST_BYTES)
    data = data[len(codecs.BOM_UTF8):] if data.startswith(codecs.BOM_UTF8) else data  # of a program of Windows
    source: Any = None
    try:
        if data.lstrip()[:1] == b"{":
            figures = loads(data)
            source = (Evaluation(path, figures) if {"splits", "stops"} <= set(figures) else
                      Cost(path, figures) if "points" in figures else None)
        else:
            source = Table(path, data.decode())
    except (ValueError, csv.Error) as error:
        raise Refused(f"{path}: {error}") from None
    if source is None or not source.kinds():
        raise Refused(f"{path}: nothing to draw: expected the CSV of a training, blocks.csv of ggn compare, figures.json or "
                      "the stops of ggn evaluate, or what ggn cost wrote")
    return source
