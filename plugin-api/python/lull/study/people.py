# SPDX-License-Identifier: MIT
"""What each person gave, out of the trials: an estimate per block or a judgement per pair, and whether they count; and where
a study stands while people take part. Cells are the blocks of all views in a row. The rules that exclude a person are in
FORMAT.md."""
from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field
from typing import Iterator, NamedTuple, TextIO

from .definition import ADJUSTMENT, TWO_INTERVAL, Block, Study, View
from .plan import CATCH_IDENTICAL, Slot, dropped_frames, make_plan
from .store import Store, Trial

MIN_TRIALS = 10  # of a block, catch trials included, fast ones not: fewer give no estimate
PLAIN = -1000.0  # the x of a catch trial: so far below any threshold that only a lapse answers wrong


class Cell(NamedTuple):
    view: View
    block: Block

    def cap(self) -> float:
        """log2 of the highest level."""
        return math.log2(self.block.levels[-1])

    def floor(self) -> float:
        """Of the lowest."""
        return math.log2(self.block.levels[0])


class Judgement(NamedTuple):
    view: int
    condition: int  # -1: a catch trial
    same: int
    rating: int


@dataclass
class Result:
    """Of one person."""
    id: str
    of: int = 0  # slots
    done: int = 0
    catch_passed: int = 0
    catch_total: int = 0
    settings: int = 0  # adjustment; so many of them left where they started
    untouched: int = 0
    fast: int = 0  # answers in less than min_ms: in no estimate
    dropped: int = 0  # answers to clips with a frame that was never drawn: in no estimate
    minutes: float = 0.0  # answering; pauses not counted
    median_s: float = math.nan  # of an answer
    last: str = ""  # when the latest was stored: UTC, ISO 8601
    excluded: str = ""  # why; "": counts
    estimates: dict = field(default_factory=dict)  # cell -> Estimate, by estimate()
    choices: list = field(default_factory=list)  # two intervals: (cell, Choice)
    set_to: list = field(default_factory=list)  # adjustment: (cell, octaves)
    judgements: list[Judgement] = field(default_factory=list)


class Answer(NamedTuple):
    slot: Slot
    trial: Trial
    is_fast: bool  # nobody can have looked in so short a time; catch trials count all the same


class People:
    def __init__(self, study: Study, store: Store) -> None:
        """Reads and judges all trials."""
        self.study = study
        self.cells = [Cell(view, block) for view in study.views for block in view.blocks]
        self.first = [sum(len(view.blocks) for view in study.views[:v]) for v in range(len(study.views) + 1)]
        self.results = [self._result(person.id, make_plan(study, person.seed), store.trials(person.row))
                        for person in store.people()]

    def counting(self) -> Iterator[Result]:
        return (r for r in self.results if not r.excluded)

    def _result(self, person: str, plan: list[Slot], trials: list[Trial]) -> Result:
        last = {t.slot: t for t in trials if 0 <= t.slot < len(plan)}  # of every slot the last revision
        answers = [Answer(plan[t.slot], t, t.ms < self.study.min_ms) for t in last.values()]
        r = Result(person, len(plan), len(answers), fast=sum(a.is_fast for a in answers))
        r.minutes = sum(t.ms for t in last.values()) / 60000
        r.last = max((t.at for t in last.values()), default="")
        if answers:
            r.median_s = statistics.median(t.ms for t in last.values()) / 1000
        read = {ADJUSTMENT: self._setting, TWO_INTERVAL: self._choice}.get(self.study.task, self._judgement)
        for a in answers:
            read(r, a)
        r.excluded = self._exclude(r)
        return r

    def _cell(self, slot: Slot) -> int:
        return self.first[slot.view] + slot.block

    def _choice(self, r: Result, a: Answer) -> None:
        correct = a.trial.answer == a.slot.side + 1
        dropped = bool(dropped_frames(self.study, a.slot, a.trial.frame_ms))
        r.catch_total += a.slot.catch != 0
        r.catch_passed += a.slot.catch != 0 and correct
        r.dropped += dropped
        if not a.is_fast and not dropped:
            x = PLAIN if a.slot.catch else math.log2(a.trial.level)
            r.choices.append((self._cell(a.slot), (x, a.slot.side == 0, correct)))

    def _setting(self, r: Result, a: Answer) -> None:
        cell = self._cell(a.slot)
        r.settings += 1
        r.untouched += self.cells[cell].block.levels[a.slot.start] == a.trial.level
        if not a.is_fast:
            r.set_to.append((cell, math.log2(a.trial.level)))

    def _judgement(self, r: Result, a: Answer) -> None:
        r.catch_total += a.slot.catch != 0
        r.catch_passed += a.slot.catch != 0 and a.trial.answer == (a.slot.catch == CATCH_IDENTICAL)
        if not a.is_fast:
            r.judgements.append(Judgement(a.slot.view, a.slot.condition, a.trial.answer, a.trial.rating))

    def _exclude(self, r: Result) -> str:
        s = self.study
        if r.catch_total > 0 and r.catch_passed < s.min_catch_passed * r.catch_total:
            return f"{r.catch_passed} of {r.catch_total} catch trials passed"
        if r.settings > 0 and r.untouched > s.max_untouched * r.settings:
            return f"{r.untouched} of {r.settings} settings left where they started"
        return f"{r.fast} of {r.done} answers in less than {s.min_ms:g} ms" if r.fast > s.max_fast * r.done else ""

    # --- estimates, the longest part of a report ---

    def estimate(self) -> None:
        for r in self.results:
            if self.study.task == TWO_INTERVAL:
                self._estimate_choices(r)
            elif self.study.task == ADJUSTMENT:
                self._estimate_settings(r)

    def _estimate_choices(self, r: Result) -> None:
        """The blocks with enough choices, together."""
        from .psychometric import Choice, Curve, estimate
        curves = {}
        for c, cell in enumerate(self.cells):
            choices = [Choice(*choice) for at, choice in r.choices if at == c]
            if len(choices) >= MIN_TRIALS:
                curves[c] = Curve(choices, math.log2(cell.block.levels[0]), cell.cap())
        r.estimates = dict(zip(curves, estimate(list(curves.values()))))

    def _estimate_settings(self, r: Result) -> None:
        """The mean of log2 of the settings; the interval from the scatter of all blocks around their own means, Student's
        t. A setting at the highest or the lowest level is one that might have gone on."""
        from .psychometric import Estimate, t975
        of_cell: dict[int, list[float]] = {}
        for cell, x in sorted(r.set_to):
            of_cell.setdefault(cell, []).append(x)
        df = sum(len(x) - 1 for x in of_cell.values())
        sd = math.sqrt(sum((v - statistics.fmean(x))**2 for x in of_cell.values() for v in x) / df) if df else math.nan
        for cell, x in of_cell.items():
            t, se = statistics.fmean(x), sd / math.sqrt(len(x))
            half = t975(df) * se if df else math.nan
            lo = -math.inf if self.cells[cell].floor() in x else t - half
            hi = math.inf if self.cells[cell].cap() in x else t + half
            r.estimates[cell] = Estimate(len(x), t, lo, hi, se, sd)


# --- where a study stands ---

def print_status(out: TextIO, people: People) -> None:
    """A line on all of them, and a line for each person in order of arrival."""
    results, last = people.results, max((r.last for r in people.results), default="")
    finished, begun = sum(r.done == r.of for r in results), sum(r.done > 0 for r in results)
    out.write(f"{people.study.task}: {len(results)} people, {finished} finished, {begun - finished} under way, "
              f"{len(results) - begun} without an answer{'; last answer ' + last if last else ''}\n")
    if results:
        out.write(f"{'person':8}  {'done':>10}  {'catch':>7}  {'median s':>8}  {'fast':>4}  {'minutes':>7}  last answer\n")
    for r in results:
        median = "-" if math.isnan(r.median_s) else f"{r.median_s:.1f}"
        done, passed = f"{r.done}/{r.of}", f"{r.catch_passed}/{r.catch_total}"
        out.write(f"{r.id:8}  {done:>10}  {passed:>7}  {median:>8}  {r.fast:4}  {r.minutes:7.1f}  "
                  f"{r.last or '-'}{f'  {r.dropped} with frames that were never shown' if r.dropped else ''}"
                  f"{'  does not count: ' + r.excluded if r.excluded else ''}\n")
