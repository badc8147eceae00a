# SPDX-License-Identifier: MIT
"""The wave loop for a host that can render rectangles: the same schedule, limits and reasons as in the path tracer.

    frame = lull.Frame(lull.load("observer"), width, height)
    result = lull.Driver(frame, render).run()

`render(rects, first, count, half)` renders the rectangles, all of them for the samples [first, first + count), and returns
(or yields) for each, in order, the mean of these samples: [h, w, 3] floats, or a mapping of planes (see Frame.add). `half`
says that the samples belong to half A; most hosts need not care. Which rectangles come in one call follows the clock: what
one of them gets must depend on the rectangle, first and count only.
"""
from __future__ import annotations

import math
import signal
import time
from dataclasses import dataclass
from typing import Callable, Iterable, Iterator, Mapping, Optional, Sequence

from . import limits
from .blocks import Block, next_check, reopen
from .criterion import Decision, Rect
from .frame import Frame, Sample
from .library import LullError

Render = Callable[[Sequence[Rect], int, int, bool], Iterable[Sample]]

# Length of a call of the render function, about: short enough for progress, Ctrl-C and a time budget.
CALL_S = 1.0


def in_half(wave: int) -> bool:
    """Is this wave in half A? The parity of some bits of its number: simply taking every second one would halve a dimension
    of a Sobol' sequence. Two successive waves 2k, 2k + 1 are always split. With waves of four samples these are the path
    tracer's halves."""
    return bin(wave & 0x1F4A7C1B).count("1") % 2 == 0


@dataclass
class Totals:
    """Sums over the run; seconds are wall seconds, but criterion_thread_s: processor seconds of the checks, all threads."""
    samples: int = 0
    render_s: float = 0.0
    criterion_s: float = 0.0
    criterion_thread_s: float = 0.0
    checks: int = 0
    failed_checks: int = 0
    skipped_checks: int = 0

    @property
    def elapsed_s(self) -> float:
        return self.render_s + self.criterion_s


@dataclass
class Result:
    """How a run ended. outcome: "done", "time", "interrupt" or "failed" (`exception` is what the render function raised)."""
    outcome: str
    exception: Optional[BaseException] = None


class Driver:
    """Samples every active block up to its next check, asks about all of them at once, stops or schedules each.

    wave: samples that stay together in one half; checks are moved up to whole pairs of waves, where the halves are equal
    (criteria take that for granted), unless whole_waves is False.
    uniform: every block gets spp_max samples and the criterion is asked once at the end. max_check_overhead: share of the
    time that checks may take, 0 = any. max_seam: most ratio of samples of neighbouring blocks, 0 = any. threads: of the
    host, for the report. identity: what the samples depend on (scene, frame, camera, the renderer's version …), by name: a
    checkpoint is only resumed where all of it and of Frame.identity() is the same. after_call: called after each call of
    the render function (progress, a partial picture). suspend: called before active blocks are closed for time, interrupt
    or failure, the moment for lull.checkpoint.save.
    """

    def __init__(self, frame: Frame, render: Render, *, wave: int = 16, whole_waves: bool = True, uniform: bool = False,
                 max_check_overhead: float = 0.0, max_seam: float = 0.0, threads: int = 1,
                 identity: Optional[Mapping[str, str]] = None,
                 after_call: Optional[Callable[[Driver], None]] = None,
                 suspend: Optional[Callable[[Driver], None]] = None, warn: Callable[[str], None] = print):
        wave = limits.whole("wave", wave, 1, limits.MAX_SPP)
        max_check_overhead = limits.real("max_check_overhead", max_check_overhead, 0, 1)
        if limits.real("max_seam", max_seam, 0, limits.MAX_SEAM) and max_seam < 1:
            raise ValueError(f"max_seam {max_seam}: expected 0 or a number from 1 to {limits.MAX_SEAM:g}")
        if uniform and min(frame.dials) < 1:
            raise ValueError("mask: uniform takes the same samples everywhere")
        self.frame, self.render, self.wave, self.whole_waves, self.uniform = frame, render, wave, whole_waves, uniform
        self.max_check_overhead, self.max_seam, self.threads = max_check_overhead, max_seam, threads
        self.after_call, self.suspend, self.warn = after_call, suspend, warn
        self.identity = self._identity(identity or {})
        self.totals = Totals()
        self.samples_per_s = 0.0  # recent, 0 = not known yet
        self.percent_told = 0  # of the work, by the progress line, which never goes back
        self.interrupted = False
        first = frame.spp_max if uniform else frame.first_spp
        for b in frame.blocks:
            b.next_spp = self.at_wave(first)

    def _identity(self, of_host: Mapping[str, str]) -> dict[str, str]:
        own = {**self.frame.identity(), "wave": str(self.wave), "whole-waves": str(self.whole_waves),
               "uniform": str(self.uniform), "max-seam": str(float(self.max_seam))}
        for name, value in of_host.items():
            if not isinstance(name, str) or not isinstance(value, str):
                raise TypeError(f"identity: expected text for text, not {name!r}: {value!r}")
            if name in own:
                raise ValueError(f"identity: '{name}' is the package's own name: choose another")
        return {**of_host, **own}

    def at_wave(self, spp: int) -> int:
        """The first place for a check that is not before spp."""
        if self.whole_waves:
            spp = -(-spp // (2 * self.wave)) * 2 * self.wave
        return min(spp, self.frame.spp_max)

    @property
    def active(self) -> list[int]:
        return [i for i, b in enumerate(self.frame.blocks) if b.active]

    def interrupt(self) -> None:
        """Ends the run after the current call; from a signal handler or another thread."""
        self.interrupted = True

    def run(self) -> Result:
        """Renders until all blocks are stopped, time is up, interrupt() was called (Ctrl-C does) or the render function
        raised. What was rendered stays in the frame in any case."""
        previous = None
        try:
            previous = signal.signal(signal.SIGINT, lambda *_: self.interrupt())
        except ValueError:
            pass  # not the main thread: the caller's matter
        try:
            while (result := self.step()) is None:
                pass
        finally:
            if previous is not None:
                signal.signal(signal.SIGINT, previous)
        return result

    def step(self) -> Optional[Result]:
        """One call of the render function or one round of checks, for hosts with an event loop. The end, or None."""
        if not self.active:
            return Result("done")
        try:
            if not self._wave():
                self._check()
                if self.max_seam:
                    reopen(self.frame.blocks, self.max_seam, self.at_wave)
                return None
        except KeyboardInterrupt:
            self.interrupted = True
        except Exception as error:  # whatever a host raises: keep the picture, let the caller decide
            self._close("interrupt")
            return Result("failed", error)
        if self.interrupted:
            self._close("interrupt")
            return Result("interrupt")
        if 0 < self.frame.time_budget_s <= self.totals.elapsed_s:
            self._close("time")
            return Result("time")
        return None

    # --- rendering -----------------------------------------------------------------------------------------------------

    def _pieces(self) -> Iterator[tuple[int, int, list[Block]]]:
        """The next piece of every block that has not reached its check: (first, count, blocks), lowest first."""
        pieces: dict[tuple[int, int], list[Block]] = {}
        for b in self.frame.blocks:
            if b.active and b.spp < b.next_spp:
                end = min(b.next_spp, (b.spp // self.wave + 1) * self.wave)
                pieces.setdefault((b.spp, end - b.spp), []).append(b)
        for (first, count), blocks in sorted(pieces.items(), key=lambda p: p[0]):
            yield first, count, blocks

    def _wave(self) -> bool:
        """One call of the render function; False when every active block is at its check."""
        piece = next(self._pieces(), None)
        if piece is None:
            return False
        first, count, blocks = piece
        left_s = self.frame.time_budget_s - self.totals.elapsed_s if self.frame.time_budget_s > 0 else math.inf
        room = self.samples_per_s * min(CALL_S, max(left_s, 0.0)) / count if self.samples_per_s else math.inf
        chosen: list[Block] = []
        for b in blocks:
            if chosen and b.rect.pixels > room:
                break
            room -= b.rect.pixels
            chosen.append(b)
        self.render_blocks(chosen, first, count)
        if self.after_call:
            self.after_call(self)
        return True

    def render_blocks(self, blocks: list[Block], first: int, count: int) -> None:
        """One call of the render function. A host that accumulates itself overrides this and uses Frame.put."""
        half = in_half(first // self.wave)
        start_s, pixels, done = time.monotonic(), sum(b.rect.pixels for b in blocks), 0
        try:
            samples = iter(self.render([b.rect for b in blocks], first, count, half))
            for n, b in enumerate(blocks):
                sample = next(samples, None)
                if sample is None:
                    raise ValueError(f"the render function gave {n} pictures for {len(blocks)} rectangles")
                self.frame.add(b, sample, count, half)
                done += b.rect.pixels * count
        finally:
            call_s = time.monotonic() - start_s
            self.totals.render_s += call_s
            self.totals.samples += done
            for b in blocks:
                b.thread_s += self.threads * call_s * b.rect.pixels / pixels
            if done:
                rate = done / max(call_s, 1e-6)
                self.samples_per_s = 0.7 * self.samples_per_s + 0.3 * rate if self.samples_per_s else rate

    # --- checks --------------------------------------------------------------------------------------------------------

    def _settle(self, b: Block, answer: Decision) -> None:
        """A block that dropped samples stops at the second STOP in a row, and never counts as converged."""
        stop = answer.stop and b.spp >= self.frame.spp_min
        b.stop_votes = b.stop_votes + 1 if stop else 0
        if self.uniform:
            b.reason = "uniform"
        elif stop and b.dropped == 0:
            b.reason = "criterion"
        elif stop and b.stop_votes > 1:
            b.reason = "dropped"
        elif b.spp >= self.frame.spp_max:
            b.reason = "spp-max"
        else:
            b.reason = "none"
            b.next_spp = self.at_wave(next_check(b.spp, answer.next_spp, self.frame.spp_max))

    def _ask(self, due: Sequence[int], final: Sequence[bool]) -> list[Decision]:
        """Asks and notes the answers. An error of the criterion costs time, never quality: all continue."""
        start_s, start_cpu_s = time.monotonic(), time.process_time()
        try:
            answers = self.frame.evaluate(due, final)
        except LullError as error:
            answers = [Decision() for _ in due]
            self.totals.failed_checks += 1
            if self.totals.failed_checks == 1:
                self.warn(str(error))
        self.totals.criterion_s += time.monotonic() - start_s
        self.totals.criterion_thread_s += time.process_time() - start_cpu_s
        self.totals.checks += len(due)
        for i, answer in zip(due, answers):
            b = self.frame.blocks[i]
            b.checks += 1
            b.asked_spp = b.spp
            b.p_noisy, b.error, b.predicted_spp = answer.p_noisy, answer.error, answer.predicted_spp
        return answers

    def _check(self) -> None:
        """All active blocks are at their next check."""
        limit, reopens = self.frame.spp_max, self.frame.criterion.info.reopens and not self.uniform
        skip = 0 < self.max_check_overhead * self.totals.elapsed_s < self.totals.criterion_s
        due, final = [], []
        for i, b in enumerate(self.frame.blocks):
            again = reopens and b.reason == "criterion" and b.spp < limit
            at_end = b.active and b.spp >= limit
            if not (b.active or again):
                continue
            if skip and not at_end:
                self.totals.skipped_checks += 1
                if b.active:
                    self._settle(b, Decision())
                continue
            due.append(i)
            final.append(at_end)
        if not any(self.frame.blocks[i].active for i in due):
            return
        for i, answer in zip(due, self._ask(due, final)):
            self._settle(self.frame.blocks[i], answer)

    def _close(self, reason: str) -> None:
        """The active blocks get no more samples: the criterion is asked once more, for the report."""
        if self.suspend:
            self.suspend(self)
        due = [i for i in self.active if self.frame.blocks[i].spp not in (0, self.frame.blocks[i].asked_spp)]
        if due:
            self._ask(due, [True] * len(due))
        for i in self.active:
            self.frame.blocks[i].reason = reason
