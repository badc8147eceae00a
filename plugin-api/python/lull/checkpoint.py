# SPDX-License-Identifier: MIT
"""A run in the middle, as a file: sums, blocks, totals and the criterion's history. Going on from it, the same samples are
asked for and the same decisions made as without the break; with a higher spp_max a finished picture can be given more."""
from __future__ import annotations

import dataclasses
import json
import zipfile

import numpy as np

from .blocks import Block
from .driver import Driver, Totals
from .files import replaced

_STATE = {f.name for f in dataclasses.fields(Block)} - {"id", "rect", "column", "row"}


def _settings(driver: Driver) -> dict:
    frame, criterion = driver.frame, driver.frame.criterion
    return {"picture": [frame.width, frame.height], "crop": list(frame.crop),
            "block": [frame.block_width, frame.block_height], "seed": frame.seed,
            "planes": list(frame.planes), "wave": driver.wave, "mask": frame.dials,
            "criterion": [criterion.info.id, criterion.info.version, criterion.parameters]}


def _arrays(driver: Driver) -> dict[str, np.ndarray]:
    frame = driver.frame
    return {"dropped": frame.dropped, "dropped_half": frame.dropped_half,
            **{f"sum-{name}": s for name, s in frame.sums.items()}}


def save(path: str, driver: Driver) -> None:
    """Replaces the file as a whole."""
    frame = driver.frame
    state = {"settings": _settings(driver), "totals": dataclasses.asdict(driver.totals),
             "blocks": [{name: getattr(b, name) for name in _STATE} for b in frame.blocks]}
    histories = {f"history-{i}": np.frombuffer(data, np.uint8) for i, data in enumerate(frame.save_state())}
    arrays = {**_arrays(driver), **histories, "state": np.frombuffer(json.dumps(state).encode(), np.uint8)}
    with replaced(path) as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def load(path: str, driver: Driver) -> None:
    """Into a fresh driver of the same settings; ValueError says which setting differs. Blocks that were closed by a limit or
    an interrupt are active again as far as the limits of this driver allow."""
    frame = driver.frame
    try:
        with np.load(path, allow_pickle=False) as file:
            data = dict(file)
        state = json.loads(data.pop("state").tobytes())
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path}: not a checkpoint: {error}") from None
    for name, own in _settings(driver).items():
        if state["settings"].get(name) != json.loads(json.dumps(own)):
            raise ValueError(f"{path}: its {name} is {state['settings'].get(name)}, this render's {own}")
    arrays = _arrays(driver)
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
