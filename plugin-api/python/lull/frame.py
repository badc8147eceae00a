# SPDX-License-Identifier: MIT
"""A picture in the making: its blocks, the sums of their samples, and the criterion that is asked about them."""
from __future__ import annotations

import time
import zlib
from pathlib import Path
from typing import Callable, Mapping, Optional, Sequence, Union

import numpy as np

from . import abi, limits
from .blocks import Block, bounds, default_block, grid
from .criterion import CHANNELS, SRGB_TO_XYZ, BlockState, Criterion, Decision, Plane, Rect
from .library import LullError
from .mask import dial_scales, judges_of

LUMINANCE = np.array(SRGB_TO_XYZ[3:6])
COUNTS = {"spp", "weight"}
Sample = Union[np.ndarray, Mapping[str, np.ndarray]]


class Frame:
    """Owns the blocks and, for the pixels that they cover (`view`), float64 sums; opens the criterion's frame.

    criterion: borrowed while the frame lives; if a frame is open on it, this one makes an instance of its own. block:
    pixels, one number or (width, height); default the criterion's own size, else 200, or less where that would be fewer
    than 12 blocks (blocks.default_block). crop: blocks that it touches are rendered whole. supplies: planes that the host
    will add besides "color" and its halves (of moment2, albedo, normal, depth); kept only if the criterion reads them.
    layers: names of further pictures [h, w] that the host will add under these names (alpha, a pass); never judged.
    weighted: with every sample comes "weight" [h, w], that of the reconstruction filter, and the other planes are multiplied
    by it: the mean is the sum of weight · value over the sum of weights, as in one long render.
    display: maps linear radiance [..., 3] to linear display values in [0, 1], for hosts whose view is not
    transfer(exposure · value); the criterion then judges these. mask: [height, width] in [0, 1], see lull.mask.
    dials: for each block, the factor that the mask gives the criterion's dial.
    sums: `color`, `half` [h, w, 3], `moment2` [h, w], … and the layers; `dropped`, `dropped_half` [h, w]: samples left out
    for a value that is not finite. y grows downwards.
    """

    def __init__(self, criterion: Criterion, width: int, height: int, *, block: Union[int, tuple[int, int], None] = None,
                 crop: Optional[Rect] = None, supplies: Sequence[str] = (), layers: Sequence[str] = (),
                 weighted: bool = False, spp_min: int = 16, spp_max: int = 10000,
                 time_budget_s: float = 0.0, seed: int = 0, exposure: float = 1.0, transfer: str = "srgb",
                 gamma: float = 2.2, sample_clamp: float = 0.0, independent: bool = False,
                 shared: bool = False, deterministic: bool = True,
                 display: Optional[Callable[[np.ndarray], np.ndarray]] = None, mask: Optional[np.ndarray] = None):
        width, height = limits.picture(width, height)
        spp_max = limits.whole("spp_max", spp_max, 1, limits.MAX_SPP)
        spp_min = limits.whole("spp_min", spp_min, 1, limits.MAX_SPP)
        if spp_min > spp_max:
            raise ValueError(f"spp_min {spp_min}, spp_max {spp_max}: expected 1 <= spp_min <= spp_max")
        self.criterion, self.width, self.height, self.seed = criterion, width, height, seed
        self.block_width, self.block_height = _block_size(criterion, block, width, height)
        self.spp_min, self.spp_max, self.display = spp_min, spp_max, display
        self.time_budget_s = limits.real("time_budget_s", time_budget_s, 0, limits.MAX_TIME_S)
        exposure, gamma = limits.positive("exposure", exposure), limits.positive("gamma", gamma)
        sample_clamp = limits.real("sample_clamp", sample_clamp, 0)
        self.blocks = grid(width, height, self.block_width, self.block_height, crop)
        self.crop = Rect(*crop) if crop else Rect(0, 0, width, height)
        self.view = bounds(self.blocks)
        self.planes, self.layers = self._choose_planes(supplies), _layers(layers)
        shape = (self.view.height, self.view.width)
        self.sums = {name: np.zeros(shape + ((3,) if CHANNELS.get(name) == 3 else ()))
                     for name in (*self.planes, *self.layers) if name not in COUNTS}
        self.weights = {name: np.zeros(shape) for name in ("all", "half")} if weighted else {}
        self.dropped, self.dropped_half = np.zeros(shape, np.uint32), np.zeros(shape, np.uint32)
        self.dials = dial_scales(mask, self.blocks, width, height)
        own = criterion.with_parameters() if criterion.open_frame else None
        self._owned, self._judge = judges_of(own or criterion, self.dials)
        self._owned += [own] if own else []
        # what the criterion is told of the pixels: with a display mapping they come as shown
        self.shown = {"exposure": 1.0 if display else exposure, "transfer": "srgb" if display else transfer,
                      "gamma": gamma, "sample_clamp": sample_clamp, "independent": independent, "shared": shared}
        self._frame_of: dict[Criterion, int] = {}
        for judge in self._judges():
            judge.begin_frame(width, height, [b.rect for b in self.blocks], self.planes, spp_min=spp_min, spp_max=spp_max,
                              seed=seed, time_budget_s=self.time_budget_s, deterministic=deterministic, **self.shown)
            self._frame_of[judge] = judge.open_frame
        self.first_spp = max(spp_min, criterion.needs.first_spp)
        self._begin_s = time.monotonic()

    def _judges(self) -> list[Criterion]:
        """The instances of the criterion in use: one, unless there is a mask."""
        return list(dict.fromkeys(self._judge))

    def _choose_planes(self, supplies: Sequence[str]) -> tuple[str, ...]:
        """Planes that the criterion is shown: what it reads of what there is. spp and weight are made from the blocks."""
        if unknown := set(supplies) - {"moment2", "albedo", "normal", "depth"}:
            raise ValueError(f"planes {', '.join(sorted(unknown))}: a host supplies moment2, albedo, normal or depth")
        offered = {"color", "half", *supplies} - ({"moment2"} if self.display else set())
        if missing := self.criterion.needs.required - offered - COUNTS:
            what, names = f"criterion {self.criterion.info.id} reads {', '.join(sorted(missing))}", sorted(missing)
            why = "is not there with a display mapping" if missing <= {*supplies} else "this host does not supply"
            raise LullError(abi.E_PLANE, f"{what}, which {why}: choose another criterion (observer, halfbuf), or write a host "
                            f"with Frame(supplies={names})")
        shown = offered & (self.criterion.needs.used | {"color"}) | self.criterion.needs.required & COUNTS
        return tuple(name for name in CHANNELS if name in shown)

    # --- samples -------------------------------------------------------------------------------------------------------

    def add(self, block: Block, sample: Sample, count: int, half: bool) -> None:
        """Adds `count` samples per pixel of one block.

        sample: their mean, [h, w, 3 or more], or a mapping of plane names to means (moment2: of the squared luminance,
        [h, w]). half: they belong to half A; which samples do must not depend on their values. Bad input (TypeError,
        ValueError) changes nothing. A pixel whose color is not finite leaves these samples out.
        """
        parts = self._parts(block, sample)
        at = self._slices(block.rect)
        bad = ~np.isfinite(parts["color"]).all(-1)
        if bad.any():
            self.dropped[at][bad] += count
            self.dropped_half[at][bad] += count * half
            block.dropped += count * int(bad.sum())
            parts = {name: np.where(bad[..., None] if part.ndim == 3 else bad, 0.0, part) for name, part in parts.items()}
        weight = parts.pop("weight", None)
        for name, part in parts.items():
            self.sums[name][at] += count * (part if name == "color" else np.nan_to_num(part, posinf=0.0, neginf=0.0))
        if weight is not None:
            self.weights["all"][at] += count * weight
        if half and "half" in self.sums:
            self.sums["half"][at] += count * parts["color"]
            if weight is not None:
                self.weights["half"][at] += count * weight
            block.half_spp += count
        block.spp += count

    def put(self, block: Block, mean: Sample, spp: int, half: Optional[np.ndarray] = None, half_spp: int = 0) -> None:
        """Replaces what is known of one block, for a host that accumulates itself: the mean of all its samples (as in add)
        and, if the criterion reads half buffers, the mean of the half_spp of them that are in half A, [h, w, 3]."""
        if self.weights:
            raise ValueError("a weighted frame takes its samples by add")
        parts = {name: (part, spp) for name, part in self._parts(block, mean).items()}
        if "half" in self.sums:
            if half is None:
                raise ValueError("the criterion reads half buffers: half is missing")
            parts["half"] = (_as_mean("half", half, block.rect), half_spp)
        for name, (part, count) in parts.items():
            self.sums[name][self._slices(block.rect)] = count * part
        block.spp, block.half_spp = spp, half_spp

    def _parts(self, block: Block, sample: Sample) -> dict[str, np.ndarray]:
        """The planes of a host's sample, checked, in double precision."""
        given = sample if isinstance(sample, Mapping) else {"color": sample}
        wanted = [name for name in self.sums if name != "half"] + ["weight"] * bool(self.weights)
        if missing := [name for name in wanted if name not in given]:
            raise ValueError(f"the render function gave no plane {missing[0]}")
        return {name: _as_mean(name, given[name], block.rect) for name in wanted}

    def _slices(self, rect: Rect) -> tuple[slice, slice]:
        return (slice(rect.y0 - self.view.y0, rect.y1 - self.view.y0), slice(rect.x0 - self.view.x0, rect.x1 - self.view.x0))

    def per_pixel(self, value: Callable[[Block], float], dtype=np.float64) -> np.ndarray:
        """[h, w]: value(block) at each of its pixels."""
        out = np.empty((self.view.height, self.view.width), dtype)
        for b in self.blocks:
            out[self._slices(b.rect)] = value(b)
        return out

    def kept(self, half: bool = False) -> np.ndarray:
        """[h, w]: by what the sums (of half A) are divided, the samples that are in them or their weights."""
        if self.weights:
            return self.weights["half" if half else "all"]
        if half:
            return self.per_pixel(lambda b: b.half_spp) - self.dropped_half
        return self.per_pixel(lambda b: b.spp) - self.dropped

    def mean(self, name: str = "color") -> np.ndarray:
        """Mean radiance [h, w, 3] float64 of the view, or the mean of another plane or layer; 0 where there is no sample."""
        kept = self.kept(name == "half")
        return _divided(self.sums[name], kept)

    def spp(self) -> np.ndarray:
        """Samples per pixel [h, w] that are in the mean."""
        return (self.per_pixel(lambda b: b.spp) - self.dropped).astype(np.uint32)

    def cropped(self, array: np.ndarray) -> np.ndarray:
        """The part of an array over the view that the crop asked for."""
        return array[self._slices(self.crop)]

    # --- asking --------------------------------------------------------------------------------------------------------

    def planes_now(self) -> dict[str, Plane]:
        """What a criterion is shown of the frame as it is."""
        spp = self.per_pixel(lambda b: b.spp, np.uint32)
        n = {name: spp for name in self.sums}
        n["half"] = self.per_pixel(lambda b: b.half_spp, np.uint32)
        sums = {name: s for name, s in self.sums.items() if name in CHANNELS}
        if self.weights or self.dropped.any():
            # as if all samples had been like those that were kept, and of weight 1: sum / spp is their mean
            sums = {name: _scaled(self.mean(name), n[name]) for name in sums}
        planes = {name: Plane(s, "half_spp" if name == "half" else "spp") for name, s in sums.items()}
        if self.display:
            for name in {"color", "half"} & sums.keys():
                planes[name] = Plane(np.ascontiguousarray(self.display(self.mean(name)), np.float64))
        return {**planes, **{name: Plane(spp) for name in COUNTS & set(self.planes)}}

    def evaluate(self, due: Sequence[int], final: Sequence[bool] = ()) -> list[Decision]:
        """Asks about blocks[i] for i in due. final: those get no more samples. Raises LullError; nothing is noted."""
        last = dict(zip(due, final))
        states = [BlockState(b.rect, b.spp, b.half_spp, not b.active, last.get(i, False), b.thread_s)
                  for i, b in enumerate(self.blocks)]
        planes = self.planes_now()
        answers: dict[int, Decision] = {}
        elapsed_s = time.monotonic() - self._begin_s
        self._check_open()
        for judge in dict.fromkeys(self._judge[i] for i in due):
            own = [i for i in due if self._judge[i] is judge]
            answers.update(zip(own, judge.evaluate(planes, states, own, self.view, elapsed_s)))
        return [answers[i] for i in due]

    # --- state ---------------------------------------------------------------------------------------------------------

    def identity(self) -> dict[str, str]:
        """All that the stops depend on beside the samples and the limits, by name, for lull.checkpoint."""
        return {"picture": f"{self.width}x{self.height}", "crop": ",".join(map(str, self.crop)),
                "block": f"{self.block_width}x{self.block_height}", "seed": str(self.seed),
                "planes": " ".join((*self.planes, *self.layers)), "weighted": str(bool(self.weights)),
                "spp-min": str(self.spp_min), "mask": _crc(np.array(self.dials)) if min(self.dials) < 1 else "none",
                "criterion": _named(self.criterion), "criterion-files": _files_crc(self.criterion),
                **{name.replace("_", "-"): str(value) for name, value in self.shown.items()},
                "display": _crc(np.round(self.display(_RAMP), 4)) if self.display else "none"}

    def arrays(self) -> dict[str, np.ndarray]:
        """All that was accumulated, by name; to be written into when a checkpoint is read."""
        return {"dropped": self.dropped, "dropped_half": self.dropped_half,
                **{f"sum-{name}": s for name, s in self.sums.items()},
                **{f"weight-{name}": w for name, w in self.weights.items()}}

    def save_state(self) -> list[bytes]:
        """The history of every instance of the criterion that is in use (one, unless there is a mask)."""
        self._check_open()
        return [judge.save_state() for judge in self._judges()]

    def load_state(self, states: Sequence[bytes]) -> None:
        self._check_open()
        judges = self._judges()
        if len(states) != len(judges):
            raise ValueError(f"{len(states)} states for {len(judges)} instances of the criterion")
        for judge, state in zip(judges, states):
            judge.load_state(state)

    def _check_open(self) -> None:
        """What another frame's view would answer is wrong without a sign of it."""
        if any(judge.open_frame != number for judge, number in self._frame_of.items()) or not self._frame_of:
            raise LullError(abi.E_STATE, f"criterion {self.criterion.info.id}: this frame was closed, or begin_frame opened "
                            "another in its place: make a new Frame")

    def close(self) -> None:
        """Ends the criterion's frame; the picture stays readable."""
        for judge, number in self._frame_of.items():
            if judge.open_frame == number:
                judge.end_frame()
        self._frame_of.clear()
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


def _divided(total: np.ndarray, by: np.ndarray) -> np.ndarray:
    """total [h, w] or [h, w, channels] over by [h, w]; 0 where that is not above 0."""
    by = by[..., None] if total.ndim == 3 else by
    return np.divide(total, by, out=np.zeros_like(total), where=by > 0)


def _scaled(array: np.ndarray, by: np.ndarray) -> np.ndarray:
    """array [h, w] or [h, w, channels] times by [h, w]."""
    return array * (by[..., None] if array.ndim == 3 else by)


def _layers(names: Sequence[str]) -> tuple[str, ...]:
    taken = {*CHANNELS, "R", "G", "B"}
    if wrong := [n for n in names if not isinstance(n, str) or not n or n in taken or n.startswith("lull.")]:
        raise ValueError(f"layer {wrong[0]!r}: expected a name that is none of {', '.join(sorted(taken))} and not of lull.")
    if len(set(names)) < len(names):
        raise ValueError(f"layers {', '.join(names)}: expected each name once")
    return tuple(names)


def _block_size(criterion: Criterion, block: Union[int, tuple[int, int], None], width: int, height: int) -> tuple[int, int]:
    """Of blocks, for a picture of width x height."""
    needs = criterion.needs
    own = (needs.block_width or 200, needs.block_height or 200)
    fixed = needs.block_width and not needs.flexible
    if block is None:
        return own if fixed else (default_block(width, height, min(own)),) * 2
    if not isinstance(block, (tuple, list)):
        block = (block, block)
    if len(block) != 2:
        raise ValueError(f"block {block}: expected one number or (width, height)")
    chosen = (limits.whole("block", block[0], 1, limits.MAX_BLOCK), limits.whole("block", block[1], 1, limits.MAX_BLOCK))
    if fixed and chosen != own:
        raise ValueError(f"criterion {criterion.info.id} judges blocks of {own[0]}x{own[1]} pixels only")
    return chosen


def _as_mean(name: str, array: np.ndarray, rect: Rect) -> np.ndarray:
    """[h, w, 3] or [h, w] float64 of one plane of a block, checked."""
    if not isinstance(array, np.ndarray) or array.dtype.kind != "f":
        what = array.dtype if isinstance(array, np.ndarray) else type(array).__name__
        raise TypeError(f"plane {name}: expected a numpy array of floating-point numbers, not {what}")
    limits.unmasked(f"plane {name}", array)
    channels = CHANNELS.get(name, 1)
    if array.shape[:2] != (rect.height, rect.width) or array.ndim != (3 if channels == 3 else 2) or \
            (channels == 3 and array.shape[2] < 3):
        expected = f"[{rect.height}, {rect.width}" + (", 3]" if channels == 3 else "]")
        raise ValueError(f"plane {name}: shape {array.shape}, expected {expected}")
    return (array[..., :3] if channels == 3 else array).astype(np.float64, copy=False)  # half floats end at 65,504
