# SPDX-License-Identifier: MIT
"""A run in the middle, as a file: sums, blocks, totals and the criterion's history. Going on from it, the same samples are
asked for and the same decisions made as without the break; with a higher spp_max a finished picture can be given more.
What the picture depends on (Driver.identity) is kept with it: another scene, view or criterion is refused by name."""
from __future__ import annotations

import ctypes as C
import os
import time
import zipfile
from typing import Optional

import numpy as np

from . import limits
from .driver import Driver, Result
from .files import replaced
from .library import call, encoded

_OWN = ("identity", "state")  # the library's parts, as bytes


def _identity(driver: Driver) -> bytes:
    return encoded("".join(f"{name}={value}\n" for name, value in driver.identity.items()))


def save(path: str, driver: Driver) -> None:
    """Replaces the file as a whole."""
    parts = dict(zip(_OWN, (np.frombuffer(data, np.uint8) for data in (_identity(driver), driver.frame.save_state()))))
    with replaced(path) as file:
        np.savez(file, **driver.frame.arrays(), **parts)  # type: ignore[arg-type]


def is_one(path: str) -> bool:
    """Is there a file of this kind? What is none must not be replaced by one."""
    try:
        with open(encoded(path), "rb") as opened, zipfile.ZipFile(opened) as file:
            return {f"{name}.npy" for name in _OWN} <= set(file.namelist())
    except (OSError, zipfile.BadZipFile):
        return False


def check(path: str) -> None:
    """ValueError for a file that would be replaced and is no checkpoint."""
    if os.path.exists(encoded(path)) and os.path.getsize(encoded(path)) > 0 and not is_one(path):
        raise ValueError(f"{path}: this is no checkpoint and would be replaced: choose another name")


def load(path: str, driver: Driver) -> None:
    """Into a fresh driver of the same identity; LullError names what differs. Blocks that were closed by a limit or an
    interrupt are active again as far as the limits of this frame allow."""
    try:
        with open(encoded(path), "rb") as opened, np.load(opened, allow_pickle=False) as file:
            data = dict(file)
        saved, state = (data[name].tobytes() for name in _OWN)
    except OSError:
        raise
    except Exception as error:  # numpy and zipfile name the same damage by many kinds
        raise ValueError(f"{path}: not a checkpoint: {error}") from None
    call("host_same_identity", saved, C.c_uint64(len(saved)), _identity(driver), encoded(path))
    arrays = driver.frame.arrays()
    for name, to in arrays.items():
        if name not in data or data[name].shape != to.shape or data[name].dtype != to.dtype:
            raise ValueError(f"{path}: {name} is missing or of another shape")
    driver.frame.load_state(state, path)
    for name, to in arrays.items():
        to[:] = data[name]


class Keeper:
    """Keeps a driver's state in a file while it runs: every_s seconds apart (0: only at the end), before active blocks are
    closed, and at the end. unsaved: why that failed last; the picture is worth more than its checkpoint."""

    def __init__(self, path: str, driver: Driver, every_s: float = 60.0):
        self.path, self.every_s = path, limits.checked("checkpoint_every_s", every_s)
        self.unsaved: Optional[OSError] = None
        self._saved_s = time.monotonic()
        driver.suspend = self.save
        driver.watchers.append(self._watch)

    def save(self, driver: Driver) -> None:
        """Now; where that fails `unsaved` says why, and nothing is raised."""
        try:
            save(self.path, driver)
            self.unsaved = None
        except OSError as error:
            self.unsaved = error
        self._saved_s = time.monotonic()

    def _watch(self, driver: Driver, result: Optional[Result]) -> None:
        due = result is None and 0 < self.every_s <= time.monotonic() - self._saved_s
        if due or (result is not None and result.outcome == "done"):
            self.save(driver)
