# SPDX-License-Identifier: MIT
"""Requests to stop, for programs: the first SIGINT, SIGTERM or SIGHUP asks for an end, a second one kills; SIGXCPU, the soft
limit of processor time, asks for one too. As in the path tracer."""
from __future__ import annotations

import signal
from typing import Any, Callable, Optional


class Stopping:
    """Use as a context manager in the main thread. asked: a signal has come; then: called from its handler."""

    def __init__(self) -> None:
        self.asked = False
        self.then: Optional[Callable[[], None]] = None
        self._before: dict[int, Any] = {}

    def _ask(self, number: int, _frame: object) -> None:
        self.asked = True
        signal.signal(number, signal.SIG_IGN if number == signal.SIGXCPU else signal.SIG_DFL)  # which comes again each second
        if self.then:
            self.then()

    def __enter__(self) -> Stopping:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU):
            if signal.getsignal(number) is not signal.SIG_IGN:  # nohup
                self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
