# SPDX-License-Identifier: MIT
"""What the criterion's quality parameter will cost, told from the checks of a render that has begun: samples and time at
its setting and at coarser and finer ones, as `lull-render --quote` tells them (lull/host.h). Neither the frame nor the
render's own instance changes."""
from __future__ import annotations

from typing import Callable, NamedTuple, Optional, Sequence

from .criterion import Criterion, load
from .driver import Driver, Result, Watcher
from .library import LullError, Parameter

# Settings by name, as lull-render tells them: how many times what is just seen, coarse to fine, and shares of viewers.
TIMES = {8.0: "rough", 4.0: "draft", 2.0: "good", 1.0: "just seen", 0.5: "strict"}
SHARES = {0.5: "draft", 0.05: "strict"}


class Row(NamedTuple):
    """One setting. spp: of the least block, of the picture and of the most expensive block; time_s: of the whole render from
    its start, wall seconds on free processors. at_most: the criterion did not predict every block, those count with the most
    samples."""
    parameter: str
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


def _quality_of(criterion: Criterion) -> tuple[Parameter, float]:
    """What a mask scales and a quote varies; KeyError when the criterion has no such parameter, or no value for it."""
    for parameter in filter(None, map(criterion.info.parameter, ("error", "visible", "threshold"))):
        if (value := criterion.parameters.get(parameter.name, parameter.default)) is not None:
            return parameter, float(value)
    raise KeyError


def _settings(criterion: Criterion, parameter: Parameter, value: float) -> list[tuple[str, float, str]]:
    """(parameter, value, name), coarse to fine; of thresholds twice and four times the value."""
    coarser = [("error", v, name) for v, name in TIMES.items() if v > 1] if criterion.info.parameter("error") else []
    names = {"error": dict(TIMES), "visible": dict(SHARES)}.get(parameter.name, {4 * value: "rough", 2 * value: "draft"})
    if parameter.name == "error":
        coarser = []
    elif coarser:
        del names[0.5]
    if parameter.name == "visible" and parameter.default is not None:
        names.setdefault(float(parameter.default), "default")
    names.setdefault(value, "chosen")
    return coarser + [(parameter.name, v, names[v]) for v in sorted(names, reverse=True) if parameter.min <= v <= parameter.max]


def _is_dear(driver: Driver) -> bool:
    """Each further setting would denoise every block once more."""
    return driver.frame.criterion.info.id == "denoised"


def rows(driver: Driver) -> list[Row]:
    """Coarse to fine, or what the denoised and the noisy picture take; [] if the criterion has no quality parameter or cannot
    be asked. Every active block has been checked once at least."""
    frame, noisy = driver.frame, None
    try:
        parameter, chosen = _quality_of(frame.criterion)
        own = parameter.name, chosen
        settings = _settings(frame.criterion, parameter, chosen)
        if _is_dear(driver):
            noisy = load("observer", threads=frame.criterion.threads, log=frame.criterion.log, **{parameter.name: chosen})
            settings = [s for s in settings if s[0] == "error" and s[1] > 1 and s[:2] != own] + [(*own, "denoised")]
            settings.sort(key=lambda s: -s[1] if s[0] == "error" else 0)
        costs = frame.quote(driver.threads, [s[:2] for s in settings], own, noisy)
    except (LullError, KeyError):
        return []
    return [Row(name, value, text, (cost.spp_min, cost.spp_mean, cost.spp_max), cost.wall_s, cost.unknown > 0, bool(cost.asked))
            for (name, value, text), cost in zip(settings + [(*own, "noisy")] * (noisy is not None), costs)]


def once_quoted(tell: Callable[[str], None]) -> Watcher:
    """For Driver.watchers: passes the line on once, when every block was checked, unless it is empty."""
    done = False

    def watch(driver: Driver, _result: Optional[Result]) -> None:
        nonlocal done
        if not done and all(b.asked_spp > 0 or not b.active for b in driver.frame.blocks):
            done = True
            if text := line(driver):
                tell(text)
    return watch


def time_text(seconds: float) -> str:
    """As people say it: 43 s, 5.8 min, 2.1 h."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def table(driver: Driver) -> str:
    """The rows as a table, or one line that says why there is none."""
    found = rows(driver)
    if not found:
        return f"criterion {driver.frame.criterion.info.id} has no quality parameter whose cost could be told"
    lines = ["  setting                   spp min / mean / max        time"]
    for r in found:
        counts = " / ".join(f"{n:7,.0f}" for n in r.spp)
        lines.append(f"{r.parameter:>9} {r.value:<5.4g}  {r.name:9} {counts}   {'at most ' if r.at_most else ''}{time_text(r.time_s)}"
                     f"{'  <- chosen' if r.chosen else ''}")
    return "\n".join(lines)


def chosen(driver: Driver) -> Optional[Row]:
    """What the frame costs as it is asked for, or None."""
    return next((r for r in rows(driver) if r.chosen), None)


def pilots(frames: int, every: int = 8) -> list[int]:
    """Which frames of a shot to ask before it is rendered: every so many, and the last."""
    return sorted({*range(0, frames, every), frames - 1})


def shot(costs: Sequence[tuple[int, Optional[Row]]], frames: int) -> str:
    """One line for a shot whose pilots cost so much, by their places in it, from the first frame to the last; what lies
    between two costs in between. "" if one is not known."""
    known = [(at, row) for at, row in costs if row]
    if not known or len(known) < len(costs):
        return ""
    time_s = spp = 0.0
    for (at, row), (after, other) in zip(known, known[1:]):
        for frame in range(at, after):
            share = (frame - at) / (after - at)
            time_s += (1 - share) * row.time_s + share * other.time_s
            spp += (1 - share) * row.spp[1] + share * other.spp[1]
    last = known[-1][1]
    most = "at most" if any(row.at_most for _, row in known) else "about"
    return (f"{frames} frames, by {len(known)} pilots: {most} {time_text(time_s + last.time_s)}, "
            f"{(spp + last.spp[1]) / frames:,.0f} spp on average")


def line(driver: Driver) -> str:
    """One line for the first check: what the quality parameter costs, and what coarser ones would; "" if that cannot be
    told, or not without denoising every block."""
    found = [] if _is_dear(driver) else rows(driver)
    own = next((r for r in found if r.chosen), None)
    if own is None:
        return ""
    parts = [f"{r.parameter} {r.value:g} would take {'at most ' if r.at_most else 'about '}{time_text(r.time_s)}"
             for r in reversed(found[:found.index(own)])]
    takes = f"takes {'at most' if own.at_most else 'about'} {time_text(own.time_s)}"
    return "; ".join([f"{own.parameter} {own.value:g} {takes}, {own.spp[1]:,.0f} spp", *parts])
