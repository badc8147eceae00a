# SPDX-License-Identifier: MIT
"""What the criterion's dial will cost, told from the checks of a render that has begun: samples and time at its setting
and at coarser and finer ones. As `lull-render --quote` does, with one more instance of the criterion per setting, each
asked about the blocks as they are; neither the frame nor the render's own instances change."""
from __future__ import annotations

import math
from dataclasses import dataclass

from .criterion import BlockState, Criterion
from .driver import Driver
from .library import LullError
from .mask import dial_of

# The dial `visible` by name, with the criterion's own default; other dials are asked at twice and at four times their value.
NAMED = {0.9: "coarse", 0.5: "draft", 0.05: "final"}


@dataclass
class Row:
    """One setting. spp: of the least block, of the picture and of the dearest block; time_s: of the whole render, from its
    start. at_most: the criterion did not predict every block, those count with the most samples."""
    dial: str
    value: float
    name: str
    spp: tuple[float, float, float]
    time_s: float
    at_most: bool
    chosen: bool


def pilot_done(driver: Driver, spp: int = 128, seconds: float = 30.0) -> bool:
    """Is enough known? Every active block was checked at `spp` samples or later, or once and `seconds` have passed."""
    asked = [b.asked_spp for b in driver.frame.blocks if b.active]
    return not asked or min(asked) >= spp or min(asked) > 0 and driver.totals.elapsed_s >= seconds


def _predictions(driver: Driver, dial: str, value: float) -> list[float]:
    """Samples at which each block will stop, NaN where the criterion does not say."""
    frame = driver.frame
    states = [BlockState(b.rect, b.spp, b.half_spp, False, False, b.thread_s) for b in frame.blocks]
    planes, ends = frame.planes_now(), [math.nan] * len(states)
    for scale in set(frame.dials):
        parameter = frame.criterion.info.parameter(dial)
        judge: Criterion = frame.criterion.with_parameters(**{dial: min(max(value * scale, parameter.min), parameter.max)})
        try:
            judge.begin_frame(frame.width, frame.height, [b.rect for b in frame.blocks], frame.planes, spp_min=frame.spp_min,
                              spp_max=frame.spp_max, seed=frame.seed, **frame.shown)
            due = [i for i, factor in enumerate(frame.dials) if factor == scale and frame.blocks[i].spp > 0]
            for i, answer in zip(due, judge.evaluate(planes, states, due, frame.view, 0.0)):
                ends[i] = float(states[i].spp) if answer.stop else answer.predicted_spp
        finally:
            judge.close()
    return ends


def _settings(driver: Driver) -> list[tuple[float, str]]:
    parameter, value = dial_of(driver.frame.criterion)
    names = dict(NAMED) if parameter.name == "visible" else {4 * value: "coarse", 2 * value: "draft"}
    if parameter.name == "visible" and parameter.default is not None:
        names.setdefault(float(parameter.default), "default")
    names.setdefault(value, "chosen")
    return sorted(((v, name) for v, name in names.items() if parameter.min <= v <= parameter.max), reverse=True)


def rows(driver: Driver) -> list[Row]:
    """Coarse to fine; [] if the criterion has no dial or cannot be asked. Every active block has been checked once at
    least."""
    frame, out = driver.frame, []
    try:
        parameter, chosen = dial_of(frame.criterion)
        settings = _settings(driver)
        asked = [(value, name, _predictions(driver, parameter.name, value)) for value, name in settings]
    except (LullError, ValueError):
        return []
    spent, rate = driver.totals.samples, driver.totals.samples / max(driver.totals.render_s, 1e-9)
    for value, name, ends in asked:
        spp = [min(max(e, b.spp) if math.isfinite(e) else frame.spp_max, frame.spp_max) for e, b in zip(ends, frame.blocks)]
        samples = sum(n * b.rect.pixels for n, b in zip(spp, frame.blocks))
        time_s = driver.totals.elapsed_s + max(samples - spent, 0) / max(rate, 1e-9)
        out.append(Row(parameter.name, value, name, (min(spp), samples / frame.view.pixels, max(spp)), time_s,
                       any(math.isnan(e) for e in ends), value == chosen))
    return out


def time_text(seconds: float) -> str:
    """As people say it: 43 s, 5.8 min, 2.1 h."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def table(driver: Driver) -> str:
    """The rows as a table, or one line that says why there is none."""
    found = rows(driver)
    if not found:
        return f"criterion {driver.frame.criterion.info.id} has no dial whose cost could be told"
    lines = [f"{found[0].dial:>9}               spp min / mean / max        time"]
    for r in found:
        counts = " / ".join(f"{n:7,.0f}" for n in r.spp)
        lines.append(f"{r.value:9.4g}  {r.name:8}  {counts}   {'at most ' if r.at_most else ''}{time_text(r.time_s)}"
                     f"{'  <- chosen' if r.chosen else ''}")
    return "\n".join(lines)


def line(driver: Driver) -> str:
    """One line for the first check: what the dial costs, and what coarser ones would; "" if that cannot be told."""
    found = rows(driver)
    own = next((r for r in found if r.chosen), None)
    if own is None:
        return ""
    coarser = [r for r in found if r.value > own.value][::-1]
    parts = [f"{r.dial} {r.value:g} would take {'at most ' if r.at_most else 'about '}{time_text(r.time_s)}"
             for r in coarser]
    return (f"{own.dial} {own.value:g} takes {'at most' if own.at_most else 'about'} {time_text(own.time_s)}, "
            f"{own.spp[1]:,.0f} spp" + "".join(f"; {p}" for p in parts))
