# SPDX-License-Identifier: MIT
"""A picture in the making: its blocks, the sums of their samples, and the criterion that is asked about them."""
from __future__ import annotations

import time
import zlib
from pathlib import Path
from typing import Callable, Mapping, Optional, Sequence, Union

import numpy as np

from .blocks import Block, bounds, default_block, grid
from .criterion import CHANNELS, SRGB_TO_XYZ, BlockState, Criterion, Decision, Plane, Rect
from .mask import dial_scales, judges_of

LUMINANCE = np.array(SRGB_TO_XYZ[3:6])
COUNTS = {"spp", "weight"}
Sample = Union[np.ndarray, Mapping[str, np.ndarray]]


class Frame:
    """Owns the blocks and, for the pixels that they cover (`view`), float64 sums; opens the criterion's frame.

    criterion: borrowed while the frame lives. block: pixels, one number or (width, height); default the criterion's own
    size, else 200, or less where that would be fewer than 12 blocks (blocks.default_block). crop: blocks that it touches
    are rendered whole. supplies: planes that the host will add besides "color" and its halves (of moment2, albedo, normal,
    depth); kept only if the criterion reads them.
    display: maps linear radiance [..., 3] to linear display values in [0, 1], for hosts whose view is not
    transfer(exposure · value); the criterion then judges these. mask: [height, width] in [0, 1], see lull.mask.
    dials: for each block, the factor that the mask gives the criterion's dial.
    sums: `color`, `half` [h, w, 3], `moment2` [h, w], …; `dropped`, `dropped_half` [h, w]: samples left out for a value
    that is not finite. y grows downwards.
    """

    def __init__(self, criterion: Criterion, width: int, height: int, *, block: Union[int, tuple[int, int], None] = None,
                 crop: Optional[Rect] = None, supplies: Sequence[str] = (), spp_min: int = 16, spp_max: int = 10000,
                 time_budget_s: float = 0.0, seed: int = 0, exposure: float = 1.0, transfer: str = "srgb",
                 gamma: float = 2.2, sample_clamp: float = 0.0, independent: bool = False,
                 shared: bool = False, deterministic: bool = True,
                 display: Optional[Callable[[np.ndarray], np.ndarray]] = None, mask: Optional[np.ndarray] = None):
        if not 1 <= spp_min <= spp_max:
            raise ValueError(f"spp_min {spp_min}, spp_max {spp_max}: expected 1 <= spp_min <= spp_max")
        needs = criterion.needs
        self.criterion, self.width, self.height, self.seed = criterion, width, height, seed
        self.block_width, self.block_height = _block_size(criterion, block, width, height)
        self.spp_min, self.spp_max, self.time_budget_s, self.display = spp_min, spp_max, time_budget_s, display
        self.crop = Rect(*crop) if crop else Rect(0, 0, width, height)
        self.blocks = grid(width, height, self.block_width, self.block_height, crop)
        self.view = bounds(self.blocks)
        self.planes = self._choose_planes(supplies)
        shape = (self.view.height, self.view.width)
        self.sums = {name: np.zeros(shape + ((3,) if CHANNELS[name] == 3 else ()))
                     for name in self.planes if name not in COUNTS}
        self.dropped, self.dropped_half = np.zeros(shape, np.uint32), np.zeros(shape, np.uint32)
        self.dials = dial_scales(mask, self.blocks, width, height)
        self._owned, self._judge = judges_of(criterion, self.dials)
        # what the criterion is told of the pixels: with a display mapping they come as shown
        self.shown = {"exposure": 1.0 if display else float(exposure), "transfer": "srgb" if display else transfer,
                      "gamma": float(gamma), "sample_clamp": float(sample_clamp), "independent": independent,
                      "shared": shared}
        for judge in {id(j): j for j in self._judge}.values():
            judge.begin_frame(width, height, [b.rect for b in self.blocks], self.planes, spp_min=spp_min, spp_max=spp_max,
                              seed=seed, time_budget_s=time_budget_s, deterministic=deterministic, **self.shown)
        self.first_spp = max(spp_min, needs.first_spp)
        self._begin_s = time.monotonic()

    def _choose_planes(self, supplies: Sequence[str]) -> tuple[str, ...]:
        """Planes that the criterion is shown: what it reads of what there is. spp and weight are made from the blocks."""
        if unknown := set(supplies) - {"moment2", "albedo", "normal", "depth"}:
            raise ValueError(f"planes {', '.join(sorted(unknown))}: a host supplies moment2, albedo, normal or depth")
        offered = {"color", "half", *supplies} - ({"moment2"} if self.display else set())
        shown = offered & (self.criterion.needs.used | {"color"}) | self.criterion.needs.required & COUNTS
        return tuple(name for name in CHANNELS if name in shown)

    # --- samples -------------------------------------------------------------------------------------------------------

    def add(self, block: Block, sample: Sample, count: int, half: bool) -> None:
        """Adds `count` samples per pixel of one block.

        sample: their mean, [h, w, 3 or more], or a mapping of plane names to means (moment2: of the squared luminance,
        [h, w]). half: they belong to half A; which samples do must not depend on their values. Bad input (TypeError,
        ValueError) changes nothing. A pixel whose color is not finite leaves these samples out.
        """
        given = sample if isinstance(sample, Mapping) else {"color": sample}
        rect = block.rect
        parts = {}
        for name in self.sums.keys() - {"half"}:
            if name not in given:
                raise ValueError(f"the render function gave no plane {name}")
            parts[name] = _as_mean(name, given[name], rect)
        at = self._slices(rect)
        bad = ~np.isfinite(parts["color"]).all(-1)
        if bad.any():
            self.dropped[at][bad] += count
            self.dropped_half[at][bad] += count * half
            block.dropped += count * int(bad.sum())
            parts = {name: np.where(bad[..., None] if part.ndim == 3 else bad, 0.0, part) for name, part in parts.items()}
        for name, part in parts.items():
            self.sums[name][at] += count * (part if name == "color" else np.nan_to_num(part, posinf=0.0, neginf=0.0))
        if half and "half" in self.sums:
            self.sums["half"][at] += count * parts["color"]
            block.half_spp += count
        block.spp += count

    def put(self, block: Block, mean: Sample, spp: int, half: Optional[np.ndarray] = None, half_spp: int = 0) -> None:
        """Replaces what is known of one block, for a host that accumulates itself: the mean of all its samples (as in add)
        and, if the criterion reads half buffers, the mean of the half_spp of them that are in half A, [h, w, 3]."""
        given = mean if isinstance(mean, Mapping) else {"color": mean}
        parts = {name: (_as_mean(name, given[name], block.rect), spp) for name in self.sums if name != "half"}
        if "half" in self.sums:
            if half is None:
                raise ValueError("the criterion reads half buffers: half is missing")
            parts["half"] = (_as_mean("half", half, block.rect), half_spp)
        for name, (part, count) in parts.items():
            self.sums[name][self._slices(block.rect)] = count * part
        block.spp, block.half_spp = spp, half_spp

    def _slices(self, rect: Rect) -> tuple[slice, slice]:
        return (slice(rect.y0 - self.view.y0, rect.y1 - self.view.y0), slice(rect.x0 - self.view.x0, rect.x1 - self.view.x0))

    def per_pixel(self, value: Callable[[Block], float], dtype=np.float64) -> np.ndarray:
        """[h, w]: value(block) at each of its pixels."""
        out = np.empty((self.view.height, self.view.width), dtype)
        for b in self.blocks:
            out[self._slices(b.rect)] = value(b)
        return out

    def mean(self) -> np.ndarray:
        """Mean radiance [h, w, 3] float64 of the view; black where there is no sample."""
        n = np.maximum(self.per_pixel(lambda b: b.spp) - self.dropped, 1)
        return self.sums["color"] / n[..., None]

    def spp(self) -> np.ndarray:
        """Samples per pixel [h, w] that are in the mean."""
        return (self.per_pixel(lambda b: b.spp) - self.dropped).astype(np.uint32)

    def cropped(self, array: np.ndarray) -> np.ndarray:
        """The part of an array over the view that the crop asked for."""
        return array[self._slices(self.crop)]

    # --- asking --------------------------------------------------------------------------------------------------------

    def _planes_now(self) -> dict[str, Plane]:
        spp = self.per_pixel(lambda b: b.spp, np.uint32)
        n = {name: spp for name in self.sums}
        n["half"] = self.per_pixel(lambda b: b.half_spp, np.uint32)
        sums = self.sums
        if self.dropped.any():
            # as if the samples left out had been like the others: sum / spp is the mean of what was kept
            left_out = {name: self.dropped_half if name == "half" else self.dropped for name in sums}
            sums = {name: _scaled(s, n[name] / np.maximum(n[name] - left_out[name], 1.0)) for name, s in sums.items()}
        planes = {name: Plane(s, "half_spp" if name == "half" else "spp") for name, s in sums.items()}
        if self.display:
            for name in {"color", "half"} & sums.keys():
                mean = _scaled(sums[name], 1.0 / np.maximum(n[name], 1.0))
                planes[name] = Plane(np.ascontiguousarray(self.display(mean), np.float64))
        return {**planes, **{name: Plane(spp) for name in COUNTS & set(self.planes)}}

    def evaluate(self, due: Sequence[int], final: Sequence[bool] = ()) -> list[Decision]:
        """Asks about blocks[i] for i in due. final: those get no more samples. Raises LullError; nothing is noted."""
        last = dict(zip(due, final))
        states = [BlockState(b.rect, b.spp, b.half_spp, not b.active, last.get(i, False), b.thread_s)
                  for i, b in enumerate(self.blocks)]
        planes = self._planes_now()
        answers: dict[int, Decision] = {}
        elapsed_s = time.monotonic() - self._begin_s
        for judge in {id(self._judge[i]): self._judge[i] for i in due}.values():
            own = [i for i in due if self._judge[i] is judge]
            answers.update(zip(own, judge.evaluate(planes, states, own, self.view, elapsed_s)))
        return [answers[i] for i in due]

    # --- state ---------------------------------------------------------------------------------------------------------

    def identity(self) -> dict[str, str]:
        """All that the stops depend on beside the samples and the limits, by name, for lull.checkpoint."""
        return {"picture": f"{self.width}x{self.height}", "crop": ",".join(map(str, self.crop)),
                "block": f"{self.block_width}x{self.block_height}", "seed": str(self.seed), "planes": " ".join(self.planes),
                "spp-min": str(self.spp_min), "mask": _crc(np.array(self.dials)) if min(self.dials) < 1 else "none",
                "criterion": _named(self.criterion), "criterion-files": _files_crc(self.criterion),
                **{name.replace("_", "-"): str(value) for name, value in self.shown.items()},
                "display": _crc(np.round(self.display(_RAMP), 4)) if self.display else "none"}

    def save_state(self) -> list[bytes]:
        """The history of every instance of the criterion that is in use (one, unless there is a mask)."""
        return [judge.save_state() for judge in {id(j): j for j in self._judge}.values()]

    def load_state(self, states: Sequence[bytes]) -> None:
        judges = list({id(j): j for j in self._judge}.values())
        if len(states) != len(judges):
            raise ValueError(f"{len(states)} states for {len(judges)} instances of the criterion")
        for judge, state in zip(judges, states):
            judge.load_state(state)

    def close(self) -> None:
        """Ends the criterion's frame; the picture stays readable."""
        self.criterion.end_frame()
        for judge in self._owned:
            judge.close()


# Radiance that tells one display mapping from another: greys from black to far beyond white, and the primaries
_RAMP = np.concatenate([np.multiply.outer(np.append(0, np.exp2(np.linspace(-12, 8, 200))), w)
                        for w in ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])


def _crc(array: np.ndarray) -> str:
    return f"crc {zlib.crc32(np.ascontiguousarray(array, '<f8').tobytes()):08x}"


def _named(criterion: Criterion) -> str:
    """Its id, version and parameters."""
    info = criterion.info
    return " ".join([info.id, info.version, *(f"{key}={value}" for key, value in sorted(criterion.parameters.items()))])


def _files_crc(criterion: Criterion) -> str:
    """Of the criterion's library and of the files that its parameters name."""
    named = (criterion.parameters.get(p.name) for p in criterion.info.parameters if p.type == "file")
    crc = 0
    for path in (criterion.info.path, *filter(None, named)):
        crc = zlib.crc32(Path(path).read_bytes(), crc)
    return f"crc {crc:08x}"


def _scaled(array: np.ndarray, by: np.ndarray) -> np.ndarray:
    """array [h, w] or [h, w, channels] times by [h, w]."""
    return array * (by[..., None] if array.ndim == 3 else by)


def _block_size(criterion: Criterion, block: Union[int, tuple[int, int], None], width: int, height: int) -> tuple[int, int]:
    """Of blocks, for a picture of width x height."""
    needs = criterion.needs
    own = (needs.block_width or 200, needs.block_height or 200)
    fixed = needs.block_width and not needs.flexible
    if block is None:
        return own if fixed else (default_block(width, height, min(own)),) * 2
    chosen = (block, block) if isinstance(block, int) else block
    if fixed and chosen != own:
        raise ValueError(f"criterion {criterion.info.id} judges blocks of {own[0]}x{own[1]} pixels only")
    return chosen


def _as_mean(name: str, array: np.ndarray, rect: Rect) -> np.ndarray:
    """[h, w, 3] or [h, w] float of one plane of a block, checked."""
    if not isinstance(array, np.ndarray) or array.dtype.kind != "f":
        what = array.dtype if isinstance(array, np.ndarray) else type(array).__name__
        raise TypeError(f"plane {name}: expected a numpy array of floating-point numbers, not {what}")
    channels = CHANNELS[name]
    if array.shape[:2] != (rect.height, rect.width) or array.ndim != (3 if channels == 3 else 2) or \
            (channels == 3 and array.shape[2] < 3):
        expected = f"[{rect.height}, {rect.width}" + (", 3]" if channels == 3 else "]")
        raise ValueError(f"plane {name}: shape {array.shape}, expected {expected}")
    return array[..., :3] if channels == 3 else array
