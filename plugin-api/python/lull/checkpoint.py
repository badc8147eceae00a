# SPDX-License-Identifier: MIT
"""A run in the middle, as a file: sums, blocks, totals and the criterion's history. Going on from it, the same samples are
asked for and the same decisions made as without the break; with a higher spp_max a finished picture can be given more.
What the picture depends on (Driver.identity) is kept with it: another scene, view or criterion is refused by name."""
from __future__ import annotations

import dataclasses
import json
import os
import time
import zipfile
from typing import Optional

import numpy as np

from . import limits
from .blocks import Block
from .driver import Driver, Result, Totals
from .files import replaced

_STATE = {f.name for f in dataclasses.fields(Block)} - {"id", "rect", "column", "row"}


def save(path: str, driver: Driver) -> None:
    """Replaces the file as a whole."""
    frame = driver.frame
    state = {"identity": driver.identity, "totals": dataclasses.asdict(driver.totals),
             "blocks": [{name: getattr(b, name) for name in _STATE} for b in frame.blocks]}
    histories = {f"history-{i}": np.frombuffer(data, np.uint8) for i, data in enumerate(frame.save_state())}
    arrays = {**frame.arrays(), **histories, "state": np.frombuffer(json.dumps(state).encode(), np.uint8)}
    with replaced(path) as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def _read(path: str) -> tuple[dict[str, np.ndarray], dict]:
    """The arrays and the state; ValueError for a file that is none."""
    try:
        with np.load(path, allow_pickle=False) as file:
            data = dict(file)
        state = json.loads(data.pop("state").tobytes())
        if not {"identity", "totals", "blocks"} <= state.keys():
            raise ValueError("it was made by another version of Lull")
    except (ValueError, KeyError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path}: not a checkpoint: {error}") from None
    return data, state


def is_one(path: str) -> bool:
    """Is there a file of this kind? What is none must not be replaced by one."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return {"totals", "blocks"} <= json.loads(file["state"].tobytes()).keys()
    except (OSError, ValueError, KeyError, EOFError, AttributeError, zipfile.BadZipFile):
        return False


def check(path: str) -> None:
    """ValueError for a file that would be replaced and is no checkpoint."""
    if os.path.exists(path) and os.path.getsize(path) > 0 and not is_one(path):
        raise ValueError(f"{path}: this is no checkpoint and would be replaced: choose another name")


def load(path: str, driver: Driver) -> None:
    """Into a fresh driver of the same identity; ValueError names what differs. Blocks that were closed by a limit or an
    interrupt are active again as far as the limits of this driver allow."""
    frame = driver.frame
    data, state = _read(path)
    theirs, own = state["identity"], driver.identity
    for name in [*own, *theirs]:
        if theirs.get(name) != own.get(name):
            raise ValueError(f"{path}: its {name} is {theirs.get(name, 'not known')}, this render's is "
                             f"{own.get(name, 'not known')}: give it the same, or start anew with another checkpoint")
    arrays = frame.arrays()
    for name, to in arrays.items():
        if name not in data or data[name].shape != to.shape or data[name].dtype != to.dtype:
            raise ValueError(f"{path}: {name} is missing or of another shape")
    frame.load_state([data[f"history-{i}"].tobytes() for i in range(sum(n.startswith("history-") for n in data))])
    for name, to in arrays.items():
        to[:] = data[name]
    for b, saved in zip(frame.blocks, state["blocks"]):
        for name in _STATE:
            setattr(b, name, saved[name])
        if b.reason in ("spp-max", "time", "interrupt", "uniform") and b.spp < frame.spp_max:
            b.reason, b.next_spp = "none", driver.at_wave(max(b.spp + 1, b.next_spp))
    driver.totals = Totals(**state["totals"])


class Keeper:
    """Keeps a driver's state in a file while it runs: every_s seconds apart, before active blocks are closed, and at the end
    (finish). unsaved: why that failed last; the picture is worth more than its checkpoint."""

    def __init__(self, path: str, driver: Driver, every_s: float = 60.0):
        self.path, self.every_s = path, limits.real("checkpoint_every_s", every_s, 0)
        self.unsaved: Optional[OSError] = None
        self._saved_s = time.monotonic()
        driver.suspend = self.save

    def save(self, driver: Driver) -> None:
        try:
            save(self.path, driver)
            self.unsaved = None
        except OSError as error:
            self.unsaved = error
        self._saved_s = time.monotonic()

    def now_and_then(self, driver: Driver) -> None:
        """For Driver.after_call. every_s 0: only at the end."""
        if 0 < self.every_s <= time.monotonic() - self._saved_s:
            self.save(driver)

    def finish(self, driver: Driver, result: Result) -> None:
        if result.outcome == "done":
            self.save(driver)
