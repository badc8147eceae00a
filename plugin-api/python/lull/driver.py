# SPDX-License-Identifier: MIT
"""The wave loop for a host that can render rectangles.

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
from typing import Callable, Iterable, Mapping, NamedTuple, Optional, Sequence, Sized

from . import abi, limits
from .criterion import Rect
from .display import Display
from .frame import Frame, Sample
from .host import Block
from .library import LullError
from .program import say

Render = Callable[[Sequence[Rect], int, int, bool], Iterable[Sample]]

# Length of a call of the render function, about: short enough for progress, Ctrl-C and a time budget.
CALL_S = 1.0
_MISCOUNT = "the render function gave %s pictures for %d rectangles"


def in_half(wave: int) -> bool:
    """Is this wave in half A? The parity of some bits of its number: simply taking every second one would halve a dimension
    of a Sobol' sequence. Two successive waves 2k, 2k + 1 are always split."""
    return bin(wave & 0x1F4A7C1B).count("1") % 2 == 0


class Result(NamedTuple):
    """How a run ended. outcome: "done", "time", "interrupt" or "failed" (`exception` is what the render function raised)."""
    outcome: str
    exception: Optional[BaseException] = None


Watcher = Callable[["Driver", Optional[Result]], None]


class Driver:
    """Samples every active block up to its next check, lets the frame ask about all of them at once.

    threads: of the host, for the report and the time left. identity: what the samples depend on (scene, frame, camera, the
    renderer's version …), by name: a checkpoint is only resumed where all of it and of Frame.identity() is the same.
    after_call: called after each call of the render function (progress, a partial picture). watchers: a list of what is
    called after each step with the driver and its result (lull.checkpoint.Keeper, lull.quote.once_quoted). suspend: called
    before active blocks are closed for time, interrupt or failure, the moment for lull.checkpoint.save. display_server: "HOST" or
    "HOST:PORT" of an image viewer that shows the picture while it is made (lull.display).
    """

    def __init__(self, frame: Frame, render: Optional[Render], *, threads: int = 1,
                 identity: Optional[Mapping[str, str]] = None, after_call: Optional[Callable[[Driver], None]] = None,
                 suspend: Optional[Callable[[Driver], None]] = None, warn: Callable[[str], None] = say,
                 display_server: str = ""):
        self.frame, self.render, self.threads = frame, render, limits.checked("threads", threads)
        self.after_call, self.suspend, self.warn = after_call, suspend, warn
        self.identity, self.totals = self._identity(identity or {}), frame.totals
        self.samples_per_s = 0.0  # recent, 0 = not known yet
        self.phases: dict[str, float] = {}  # what a host's seconds went to, by name, for the report
        self.percent_shown = 0.0  # of the work, by the progress line, which never goes back
        self.interrupted = False
        self.display = Display(frame, display_server) if display_server else None
        self.watchers: list[Watcher] = [self.display.watch] if self.display else []

    def _identity(self, of_host: Mapping[str, str]) -> dict[str, str]:
        own = self.frame.identity()
        for name, value in of_host.items():
            if not isinstance(name, str) or not isinstance(value, str):
                raise TypeError(f"identity: expected text for text, not {name!r}: {value!r}")
            if name in own:
                raise ValueError(f"identity: '{name}' is the package's own name: choose another")
        return {**of_host, **own}

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
        result = self._step()
        for watcher in self.watchers:
            watcher(self, result)
        return result

    def _step(self) -> Optional[Result]:
        if not self.frame.active:
            return Result("done")
        try:
            if not self._wave():
                self._ask(self.frame.check)
                return None
        except KeyboardInterrupt:
            self.interrupted = True
        except Exception as error:  # whatever a host raises: keep the picture, let the caller decide
            return self._close(abi.REASON_INTERRUPT, Result("failed", error))
        if self.interrupted:
            return self._close(abi.REASON_INTERRUPT, Result("interrupt"))
        if 0 < self.frame.time_budget_s <= self.totals.elapsed_s:
            return self._close(abi.REASON_TIME, Result("time"))
        return None

    def _wave(self) -> bool:
        """One call of the render function, for the blocks that have fewest samples; False when every active block is at its
        check."""
        frame = self.frame
        pieces: dict[tuple[int, int], list[Block]] = {}  # by first sample and count
        for b in frame.blocks:
            if b.active and b.spp < b.next_spp:
                end = min(b.next_spp, (b.spp // frame.wave + 1) * frame.wave)
                pieces.setdefault((b.spp, end - b.spp), []).append(b)
        if not pieces:
            return False
        (first, count), blocks = min(pieces.items(), key=lambda piece: piece[0])
        left_s = frame.time_budget_s - self.totals.elapsed_s if frame.time_budget_s > 0 else math.inf
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
        assert self.render, "a driver without a render function overrides render_blocks"
        half = in_half(first // self.frame.wave)
        start_s, pixels, done = time.monotonic(), sum(b.rect.pixels for b in blocks), 0
        try:
            given, wanted = self.render([b.rect for b in blocks], first, count, half), len(blocks)
            if isinstance(given, Sized) and len(given) > wanted:
                raise ValueError(_MISCOUNT % (len(given), wanted))
            samples = iter(given)
            for n, b in enumerate(blocks):
                sample = next(samples, None)
                if sample is None:
                    raise ValueError(_MISCOUNT % (n, wanted))
                self.frame.add(b, sample, count, half)
                done += b.rect.pixels * count
            if next(samples, None) is not None:
                raise ValueError(_MISCOUNT % (f"more than {wanted}", wanted))
        finally:
            call_s = time.monotonic() - start_s
            self.totals.render_s += call_s
            self.totals.samples += done
            self.totals.paths += done
            for b in blocks:
                b.thread_s += self.threads * call_s * b.rect.pixels / pixels
            if done:
                rate = done / max(call_s, 1e-6)
                self.samples_per_s = 0.7 * self.samples_per_s + 0.3 * rate if self.samples_per_s else rate

    def _ask(self, call: Callable[..., None], *arguments: int) -> None:
        """An error of the criterion costs time, never quality: it is told once."""
        try:
            call(*arguments)
        except LullError as error:
            if self.totals.failed_checks <= 1:
                self.warn(str(error))

    def _close(self, reason: int, result: Result) -> Result:
        """The active blocks get no more samples."""
        if self.suspend:
            self.suspend(self)
        self._ask(self.frame.stop, reason)
        return result
