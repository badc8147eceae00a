# SPDX-License-Identifier: MIT
"""What the criterion's quality parameter will cost, told from the checks of a render that has begun: samples and time at
its setting and at coarser and finer ones, as `lull-render --quote` tells them (lull/host.h). Neither the frame nor the
render's own instance changes."""
from __future__ import annotations

from typing import Callable, NamedTuple, Optional, Sequence

from .driver import Driver, Result, Watcher
from .library import LullError, find


class Row(NamedTuple):
    """One setting. spp: of the least block, of the picture and of the most expensive block; time_s: of the whole render from
    its start, wall seconds on free processors; low, high: (spp, time_s) of the picture at the ends of the interval that 8 of
    10 blocks stop in. at_most: the criterion did not predict every block, those count with the most samples. unmet: blocks
    whose light most of their pixels have not met yet. told: False where that is too little: no number is to be believed.
    parameter "": the criterion has none that is set."""
    parameter: str
    value: float
    name: str
    spp: tuple[float, float, float]
    time_s: float
    low: tuple[float, float]
    high: tuple[float, float]
    at_most: bool
    unmet: int
    told: bool
    chosen: bool


def pilot_done(driver: Driver, spp: int = 128, seconds: float = 30.0) -> bool:
    """Is enough known? Every active block was checked at `spp` samples or later, or once and `seconds` have passed."""
    asked = [b.asked_spp for b in driver.frame.blocks if b.active]
    return not asked or min(asked) >= spp or min(asked) > 0 and driver.totals.elapsed_s >= seconds


def _is_dear(driver: Driver) -> bool:
    """Each further setting would denoise every block once more."""
    return driver.frame.criterion.info.id == "denoised"


def rows(driver: Driver) -> list[Row]:
    """Coarse to fine, or what the denoised and the noisy picture take; [] if the criterion has no quality parameter or cannot
    be asked. Every active block has been checked once at least."""
    frame = driver.frame
    try:
        costs = frame.quote(driver.threads, find("observer") if _is_dear(driver) else None)
    except LullError:
        return []
    rows = [Row((c.parameter or b"").decode(), c.value, c.name.decode(), (c.spp_min, c.spp_mean, c.spp_max), c.wall_s,
                (c.spp_mean_low, c.wall_low_s), (c.spp_mean_high, c.wall_high_s), c.unknown > 0, c.unmet, bool(c.told),
                bool(c.asked)) for c in costs]
    return rows if any(r.parameter for r in rows) else []


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


def _cost_text(row: Row) -> str:
    """at most 5.8 min (4.0 min to 8.1 min)."""
    if not row.told:
        return "more than can be told yet: too little was met"
    return f"{'at most' if row.at_most else 'about'} {time_text(row.time_s)} ({time_text(row.low[1])} to {time_text(row.high[1])})"


def _unmet_text(driver: Driver, row: Row) -> str:
    """"" where every block has met its light."""
    return f"{row.unmet} of {len(driver.frame.blocks)} blocks have not met their light yet" if row.unmet else ""


def table(driver: Driver) -> str:
    """The rows as a table, or one line that says why there is none."""
    found = rows(driver)
    if not found:
        return f"criterion {driver.frame.criterion.info.id} has no quality parameter whose cost could be told"
    lines = ["  setting                   spp min / mean / max        time (8 of 10 blocks)"]
    for r in found:
        setting = f"{r.parameter:>9} {r.value:<5.4g}" if r.parameter else " " * 15
        counts = " / ".join(f"{n:7,.0f}" for n in r.spp) + f"   {_cost_text(r).removeprefix('about ')}"
        cost = counts if r.told else "  not known: the pilot has met too little"
        lines.append(f"{setting}  {r.name:9} {cost}{'  <- chosen' if r.chosen else ''}")
    if text := next((_unmet_text(driver, r) for r in found if r.chosen), ""):
        lines.append(f"{text}: a longer pilot says more")
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
    numbers = [(r.spp[1], r.time_s, r.low[1], r.high[1]) for _, r in known]
    sums = list(numbers[-1])
    for k, ((at, _), (after, _)) in enumerate(zip(known, known[1:])):
        for frame in range(at, after):
            share = (frame - at) / (after - at)
            sums = [s + (1 - share) * a + share * b for s, a, b in zip(sums, numbers[k], numbers[k + 1])]
    spp, time_s, low_s, high_s = sums
    begin = f"{frames} frames, by {len(known)} pilots: "
    if not all(row.told for _, row in known):
        return f"{begin}not known, they have met too little"
    most = "at most" if any(row.at_most for _, row in known) else "about"
    return (f"{begin}{most} {time_text(time_s)} ({time_text(low_s)} to {time_text(high_s)}), {spp / frames:,.0f} spp on average")


def line(driver: Driver) -> str:
    """One line for the first check: what the quality parameter costs, and what coarser ones would; "" if that cannot be
    told, or not without denoising every block."""
    found = [] if _is_dear(driver) else rows(driver)
    own = next((r for r in found if r.chosen), None)
    if own is None:
        return ""
    parts = [f"{r.parameter} {r.value:g} would take {_cost_text(r)}" for r in reversed(found[:found.index(own)]) if r.told]
    spp = f", {own.spp[1]:,.0f} spp" if own.told else ""
    setting = f"{own.parameter} {own.value:g}" if own.parameter else driver.frame.criterion.info.id
    return "; ".join(filter(None, [f"{setting} takes {_cost_text(own)}{spp}", *parts, _unmet_text(driver, own)]))
