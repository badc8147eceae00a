# SPDX-License-Identifier: MIT
"""The report of a study: CSV, JSON and pictures in a folder. Columns: FORMAT.md.

Of thresholds: thresholds.csv, one line per view of which all blocks are known, for `ggn label --human` and `ggn compare`;
thresholds-VIEW.json, the same per view with any blocks; blocks.csv, estimates.csv (per person), people.csv, report.json;
kinds.csv where kinds are shown: each against the noisy picture; thresholds.png, people.png, and for two intervals
curves.png. Of a validation: people.csv, judgements.csv, scenes.csv, report.json, shares.png."""
from __future__ import annotations

import math
import os
from dataclasses import asdict
from typing import Any, Iterable, Iterator, Sequence

from .definition import KINDS, VALIDATION
from .files import make_folder, print_json, replaced, write_line
from .people import People
from .psychometric import Estimate
from .summary import (Ceiling, Difference, Share, Threshold, against_noisy, ceiling, censored, intraclass, people_needed,
                      share, thresholds)

POWER_DIFFERENCE_PERCENT = 10


def spp(octaves: float) -> float:
    return 2.0**octaves


class _Report:
    def __init__(self, folder: str, people: People) -> None:
        self.folder, self.people, self.study = folder, people, people.study
        self.thresholds: Sequence[Threshold] = thresholds(people)

    def table(self, name: str, head: str, rows: Iterable[str]) -> None:
        with replaced(os.path.join(self.folder, name)) as file:
            file.writelines(row + "\n" for row in [*([head] if head else []), *rows])

    # --- thresholds ---

    def people_csv(self) -> None:
        head = "person;done;of;catch_passed;catch_total;untouched;settings;minutes;median_s;fast;dropped;excluded"
        self.table("people.csv", head, (
            f"{r.id};{r.done};{r.of};{r.catch_passed};{r.catch_total};{r.untouched};{r.settings};{r.minutes:.2f};"
            f"{r.median_s:.3f};{r.fast};{r.dropped};{r.excluded}" for r in self.people.results))

    def estimates_csv(self) -> None:
        head = "person;view;block;threshold;low;high;se_octaves;spread_octaves;spread_low;spread_high;trials"
        rows = ((r.id, self.people.cells[c], censored(e, self.people.cells[c]))
                for r in self.people.results for c, e in sorted(r.estimates.items()))
        self.table("estimates.csv", head, (
            f"{person};{cell.view.name};{cell.block.id};{self._figures(e)};{e.se:.4f};"
            f"{e.spread:.4f};{e.spread_lo:.4f};{e.spread_hi:.4f};{e.trials}" for person, cell, e in rows))

    def _cells(self, view: int) -> list[tuple[int, Threshold]]:
        """(id of the block, threshold) of a view."""
        first = self.people.first
        return [(self.people.cells[c].block.id, self.thresholds[c]) for c in range(first[view], first[view + 1])]

    def _figures(self, t: Threshold | Estimate) -> str:
        return f"{spp(t.t):.2f};{spp(t.lo):.2f};{spp(t.hi):.2f}"

    def blocks_csv(self) -> None:
        self.table("blocks.csv", "view;block;threshold;low;high;spread_octaves;people;trials;at_cap;at_floor", (
            f"{view.name};{id};{self._figures(t)};{t.spread:.4f};{t.people};{t.trials};{t.at_cap};{t.at_floor}"
            for v, view in enumerate(self.study.views) for id, t in self._cells(v)))

    def thresholds_csv(self) -> None:
        """Views whose blocks are 0, 1, … and all have a threshold."""
        whole = [(view.name, self._cells(v)) for v, view in enumerate(self.study.views)]
        rows = [f"{name};" + "".join(f"{spp(t.t):.2f};" for _, t in cells) for name, cells in whole
                if all(id == i and not math.isnan(t.t) for i, (id, t) in enumerate(cells))]
        if rows:
            self.table("thresholds.csv", "", rows)

    def view_json(self, v: int) -> None:
        view = self.study.views[v]
        blocks = [{"id": b.id, "x0": b.x0, "y0": b.y0, "threshold": spp(t.t), "low": spp(t.lo), "high": spp(t.hi),
                   "censored": t.censored()}
                  for b, (_, t) in zip(view.blocks, self._cells(v)) if not math.isnan(t.t)]
        if blocks:
            write_line(os.path.join(self.folder, f"thresholds-{view.name}.json"),
                       print_json({"scene": view.name, "source": "people", "blocks": blocks}, pretty=True))

    # --- kinds ---

    def _pooled_kinds(self) -> Iterator[tuple[str, Difference]]:
        found = ((kind, against_noisy(self.people, kind)) for kind in KINDS[1:])
        return ((kind, d) for kind, d in found if d.people > 0)

    def kinds_csv(self) -> None:
        if not any(view.kind for view in self.study.views):
            return
        def tail(d: Difference) -> str:
            return f"{d.octaves:.4f};{d.lo:.4f};{d.hi:.4f};{d.people}"
        rows = [f"{view.name};{view.kind};{block.id};{self._figures(t)};{tail(against_noisy(self.people, view.kind, c))}"
                for c, ((view, block), t) in enumerate(zip(self.people.cells, self.thresholds))]
        self.table("kinds.csv", "view;kind;block;threshold;low;high;octaves_above_noisy;octaves_low;octaves_high;people",
                   [*rows, *(f"(all);{kind};;;;;{tail(d)}" for kind, d in self._pooled_kinds())])

    # --- judgements ---

    def _shares(self) -> Iterator[tuple[str, list[Share]]]:
        """Per view and for all of each condition."""
        names = [*enumerate(view.name for view in self.study.views), (None, "(all)")]
        return ((name, [share(self.people, v, c) for c in range(len(self.study.conditions))]) for v, name in names)

    def judgements_csv(self) -> None:
        self.table("judgements.csv", "view;condition;same;judgements;share;low;high;rating", (
            f"{name};{condition};{s.same};{s.n};{s.share:.4f};{s.lo:.4f};{s.hi:.4f};{s.rating:.3f}"
            for name, shares in self._shares() for condition, s in zip(self.study.conditions, shares)))

    def scenes(self, separator: str) -> list[str]:
        """The form of the published tables: a row per scene, a column per method, per cent judged the same."""
        def cell(s: Share) -> str:
            return f"{100 * s.share:.0f} % [{100 * s.lo:.0f}, {100 * s.hi:.0f}]" if s.n else ""
        return [separator.join(row) for row in [["view", *self.study.conditions], *(
            [name, *map(cell, shares)] for name, shares in self._shares())]]

    def needed(self, condition: int) -> tuple[int, float]:
        """People for a difference of 10 %, from the pooled share, and the correlation within people; 0: nobody judged."""
        s, icc = share(self.people, None, condition), intraclass(self.people, condition)
        m = len(self.study.views) * self.study.repeats
        known = 0.0 if math.isnan(icc) else icc
        return people_needed(s.share, POWER_DIFFERENCE_PERCENT / 100, m, known) if s.n else 0, icc

    # --- the whole ---

    def censored(self, side: str) -> int:
        """Blocks."""
        return sum(side in t.censored() for t in self.thresholds)

    def people_that_count(self) -> int:
        return sum(r.done > 0 for r in self.people.counting())

    def report_json(self, agreement: Ceiling) -> None:
        s, results = self.study, self.people.results
        root: dict[str, Any] = {
            "format": "lull-study-report", "version": 1, "study": s.id, "task": s.task, "people": len(results),
            "people_that_count": self.people_that_count(), "min_catch_passed": s.min_catch_passed,
            "max_untouched": s.max_untouched, "min_ms": s.min_ms, "max_fast": s.max_fast,
            "fast_answers": sum(r.fast for r in results)}
        if s.fps:
            root["dropped_answers"] = sum(r.dropped for r in results)
        root["excluded"] = [{"person": r.id, "why": r.excluded} for r in results if r.excluded]
        if s.task != VALIDATION:
            root["censored_below"], root["censored_above"] = self.censored("below"), self.censored("above")
            root["noise_ceiling"] = asdict(agreement)
        else:
            root["conditions"] = []
            for c, name in enumerate(s.conditions):
                found, (people, icc) = share(self.people, None, c), self.needed(c)
                root["conditions"].append({
                    "name": name, "same": found.same, "judgements": found.n, "share": found.share, "low": found.lo,
                    "high": found.hi, "rating": found.rating, "icc": icc,
                    "people_for_10_percent": people if found.n else math.nan})
        write_line(os.path.join(self.folder, "report.json"), print_json(root, pretty=True))

    def print_figures(self, agreement: Ceiling) -> None:
        results = self.people.results
        fast, dropped = sum(r.fast for r in results), sum(r.dropped for r in results)
        print(f"{len(results)} people, {self.people_that_count()} count")
        for r in results:
            if r.excluded:
                print(f"  {r.id} does not count: {r.excluded}")
        if fast:
            print(f"{fast} answers in less than {self.study.min_ms:g} ms are left out")
        if dropped:
            print(f"{dropped} answers to clips with a frame that the screen never showed are left out")
        if self.study.task == VALIDATION:
            self._print_judgements()
            return
        print(f"{sum(not math.isnan(t.t) for t in self.thresholds)} of {len(self.thresholds)} blocks have a threshold")
        for side, what in (("above", "noise at the highest level"), ("below", "none at the lowest level")):
            if self.censored(side):
                print(f"{self.censored(side)} of them censored {side}: somebody sees {what}, so that their intervals are open")
        for kind, d in self._pooled_kinds():
            print(f"{kind}: {spp(d.octaves):.2f} × the samples of the noisy picture [{spp(d.lo):.2f}, {spp(d.hi):.2f}], "
                  f"{d.people} people, up to {d.blocks} blocks")
        a = agreement
        if a.people > 1:
            print(f"noise ceiling, {a.people} people, up to {a.blocks} blocks: r {a.pearson_lower:.2f} … "
                  f"{a.pearson_upper:.2f}, Spearman {a.spearman_lower:.2f} … {a.spearman_upper:.2f}, median |log2| "
                  f"{a.median_abs_log2_lower:.2f} octaves (one person against the others)")

    def _print_judgements(self) -> None:
        print("judged the same as the reference, with 95 % intervals (Wilson):", *self.scenes("\t"), sep="\n")
        for c, name in enumerate(self.study.conditions):
            needed, icc = self.needed(c)
            if needed:
                print(f"{name}: about {needed} people would show a difference of {POWER_DIFFERENCE_PERCENT} %"
                      f"{' (if people do not differ, which one person cannot tell)' if math.isnan(icc) else ''}")


def write_report(folder: str, people: People, pictures: bool) -> None:
    """Makes `folder` if need be. Also prints the main figures."""
    make_folder(folder)
    people.estimate()
    report, agreement = _Report(folder, people), Ceiling()
    report.people_csv()
    if people.study.task == VALIDATION:
        report.judgements_csv()
        report.table("scenes.csv", "", report.scenes(";"))
    else:
        for write in (report.estimates_csv, report.blocks_csv, report.thresholds_csv, report.kinds_csv):
            write()
        for v in range(len(people.study.views)):
            report.view_json(v)
        agreement = ceiling(people)
    report.report_json(agreement)
    if pictures and report.people_that_count() > 0:
        from .figures import write_pictures
        write_pictures(folder, people, report.thresholds)
    report.print_figures(agreement)
