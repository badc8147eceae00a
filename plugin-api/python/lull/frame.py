# SPDX-License-Identifier: MIT
"""A picture in the making: a frame of the host library with the sums of its samples in numpy."""
from __future__ import annotations

import zlib
from typing import Any, Callable, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import abi, exr, limits
from .criterion import CHANNELS, Criterion, Plane, Rect, plane_names
from .files import LUMINANCE, srgb_decoded
from .host import Block, HostFrame
from .library import LullError, encoded

COUNTS = {"spp", "weight"}  # planes that the library makes
Sample = Union[np.ndarray, Mapping[str, np.ndarray]]


class Frame(HostFrame):
    """Owns, for the pixels that the blocks cover (`view`), float64 sums.

    criterion: borrowed while the frame lives. wave: samples that stay together in one half; checks are moved up to whole
    pairs of waves, where the halves are equal (criteria take that for granted), unless whole_waves is False. supplies:
    planes that the host will add besides "color" and its halves (of moment2, albedo, normal, depth); kept only if the
    criterion reads them. A criterion that reads "moment2" gets what the scatter of the waves says (`waves`) of a host that
    has none, or a display mapping. layers: names of further pictures [h, w] that the host will add under these names (alpha,
    a pass); never judged. weighted: with every sample comes "weight" [h, w], that of the reconstruction filter, and the other planes
    are multiplied by it: the mean is the sum of weight · value over the sum of weights, as in one long render. display: maps
    linear radiance [..., 3] to linear display values in [0, 1], for hosts whose view is not transfer(exposure · value); the
    criterion then judges these. denoised: what lull.denoise reads is kept, too: the halves, and of albedo and normal what
    the host supplies. settings: as HostFrame takes them (limits, mask, transfer …).
    sums: `color`, `half` [h, w, 3], `moment2` [h, w], … and the layers; `dropped`, `dropped_half` [h, w] uint32: samples
    left out for a value that is not finite. waves [h, w] uint32: how many are in sums["moment2"], each as the squared
    luminance of its mean times its samples; None where the host supplies the plane, or nobody reads it. y grows downwards.
    """

    def __init__(self, criterion: Criterion, width: int, height: int, *, wave: int = 16, whole_waves: bool = True,
                 supplies: Sequence[str] = (), layers: Sequence[str] = (), weighted: bool = False,
                 display: Optional[Callable[[np.ndarray], np.ndarray]] = None, denoised: bool = False, **settings: Any):
        self.wave, self.display = limits.checked("wave", wave), display
        kept, self.layers = _choose_planes(criterion, supplies, display is not None, denoised), _layers(layers)
        if display:
            settings.update(exposure=1.0, transfer="srgb")  # pixels come as shown
        super().__init__(criterion, width, height, kept, check_step=2 * self.wave if whole_waves else 1, **settings)
        shape = (self.view.height, self.view.width)
        self.sums = {name: np.zeros(shape + ((3,) if CHANNELS.get(name) == 3 else ()))
                     for name in (*self.planes, *self.layers) if name not in COUNTS}
        self.weights = {name: np.zeros(shape) for name in ("all", "half")} if weighted else {}
        self.dropped, self.dropped_half = np.zeros(shape, np.uint32), np.zeros(shape, np.uint32)
        of_host = "moment2" in supplies and not display
        self.waves = np.zeros(shape, np.uint32) if "moment2" in kept and not of_host else None

    # --- samples -------------------------------------------------------------------------------------------------------

    def add(self, block: Block, sample: Sample, count: int, half: bool) -> None:
        """Adds `count` samples per pixel of one block.

        sample: their mean, [h, w, 3 or more], or a mapping of plane names to means (moment2: of the squared luminance,
        [h, w]). half: they belong to half A; which samples do must not depend on their values. Bad input (TypeError,
        ValueError) changes nothing. A pixel whose color or weight is not finite leaves these samples out.
        """
        count, parts = limits.checked("count", count), self._parts(block, sample)
        at = self._slices(block.rect)
        bad = ~np.isfinite(parts["color"]).all(-1)
        if self.weights:
            bad |= ~np.isfinite(parts["weight"])
        if bad.any():
            self.dropped[at][bad] += count
            self.dropped_half[at][bad] += count * half
            block.dropped += count * int(bad.sum())
            self.totals.dropped += count * int(bad.sum())
            parts = {name: np.where(bad[..., None] if part.ndim == 3 else bad, 0.0, part) for name, part in parts.items()}
        weight = parts.pop("weight", None)
        self._add_wave(at, parts["color"], count, weight, ~bad)
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
        and, if the criterion reads half buffers, the mean of the half_spp of them that are in half A, [h, w, 3]. A pixel
        that is not finite in either has no samples until it is put again. Bad input changes nothing."""
        if self.weights:
            raise ValueError("a weighted frame takes its samples by add")
        spp, half_spp = limits.checked("count", spp), limits.checked("count", half_spp)
        if half_spp > spp:
            raise ValueError(f"half_spp {half_spp}: expected at most the {spp} of spp")
        parts, at = self._parts(block, mean), self._slices(block.rect)
        if "half" in self.sums:
            if half is None:
                raise ValueError("the criterion reads half buffers: half is missing")
            parts["half"] = _as_mean("half", half, block.rect)
        bad = ~np.isfinite([parts[name] for name in ("color", "half") if name in parts]).all((0, -1))
        if self.waves is not None and spp != block.spp:
            before = block.spp if spp > block.spp else 0
            if before == 0:  # begun anew
                self.sums["moment2"][at], self.waves[at] = 0.0, 0
            new = (spp * parts["color"] - (self.sums["color"][at] if before else 0.0)) / max(spp - before, 1)
            self._add_wave(at, new, spp - before, None, ~bad & (self.dropped[at] == 0) if before else ~bad)
        for name, part in parts.items():
            part = np.where(bad[..., None] if part.ndim == 3 else bad, 0.0, np.nan_to_num(part, posinf=0.0, neginf=0.0))
            self.sums[name][at] = (half_spp if name == "half" else spp) * part
        self.dropped[at], self.dropped_half[at] = spp * bad, half_spp * bad
        left_out = spp * int(bad.sum())
        self.totals.dropped += left_out - block.dropped
        block.spp, block.half_spp, block.dropped = spp, half_spp, left_out

    def _add_wave(self, at: tuple[slice, slice], color: np.ndarray, count: int, weight: Optional[np.ndarray],
                  good: np.ndarray) -> None:
        """One more mean of `count` samples, times `weight`, where it is good."""
        if self.waves is None:
            return
        good = good if weight is None else good & (weight > 0)
        square = (np.where(good[..., None], color, 0.0) @ LUMINANCE) ** 2
        share = np.divide(square, 1.0 if weight is None else weight, out=np.zeros_like(square), where=good)
        self.sums["moment2"][at] += count * share
        self.waves[at] += good

    def _parts(self, block: Block, sample: Sample) -> dict[str, np.ndarray]:
        """The planes of a host's sample, checked, in double precision."""
        if block.frame is not self.handle:
            raise ValueError(f"block {block.id} is another frame's")
        given = sample if isinstance(sample, Mapping) else {"color": sample}
        made = {"half"} | ({"moment2"} if self.waves is not None else set())
        wanted = [name for name in self.sums if name not in made] + ["weight"] * bool(self.weights)
        if missing := [name for name in wanted if name not in given]:
            raise ValueError(f"the render function gave no plane {missing[0]}")
        return {name: _as_mean(name, given[name], block.rect) for name in wanted}

    def _slices(self, rect: Rect) -> tuple[slice, slice]:
        return (slice(rect.y0 - self.view.y0, rect.y1 - self.view.y0), slice(rect.x0 - self.view.x0, rect.x1 - self.view.x0))

    def per_pixel(self, value: Callable[[Block], float], dtype: npt.DTypeLike = np.float64) -> np.ndarray:
        """[h, w]: value(block) at each of its pixels."""
        out = np.empty((self.view.height, self.view.width), dtype)
        for b in self.blocks:
            out[self._slices(b.rect)] = value(b)
        return out

    def mean(self, name: str = "color") -> np.ndarray:
        """Mean radiance [h, w, 3] float64 of the view, or the mean of another plane or layer; 0 where there is no sample."""
        total, half = self.sums[name], name == "half"
        if self.weights:
            kept = self.weights["half" if half else "all"]
        else:
            kept = self.per_pixel(lambda b: b.half_spp if half else b.spp) - (self.dropped_half if half else self.dropped)
        kept = kept[..., None] if total.ndim == 3 else kept
        return np.divide(total, kept, out=np.zeros_like(total), where=kept > 0)

    def spp(self) -> np.ndarray:
        """Samples per pixel [h, w] that are in the mean."""
        return (self.per_pixel(lambda b: b.spp) - self.dropped).astype(np.uint32)

    def displayed(self, linear: np.ndarray) -> np.ndarray:
        """What the criterion takes radiance [..., 3] to look like: linear display values, which the sRGB transfer shows."""
        if self.display:
            return self.display(linear)
        value, transfer = linear * self.shown["exposure"], self.shown["transfer"]
        if transfer == "srgb":
            return value
        return srgb_decoded(np.clip(value, 0.0, 1.0) ** (1 / self.shown["gamma"] if transfer == "gamma" else 1.0))

    def cropped(self, array: np.ndarray) -> np.ndarray:
        """The part of an array over the view that the crop asked for."""
        return array[self._slices(self.crop)]

    def planes_now(self, as_shown: bool = True) -> dict[str, Plane]:
        """What the criterion is shown: the sums; means where they have weights, or as they are displayed."""
        names, display = [name for name in self.sums if name in CHANNELS], self.display if as_shown else None
        made = {} if self.waves is None else {"moment2": Plane(self._moments(display))}
        names = [name for name in names if name not in made]
        if self.weights or display:
            shown = {name: display for name in ("color", "half") if display}
            means = {name: shown.get(name, np.asarray)(self.mean(name)) for name in names}
            return {name: Plane(np.ascontiguousarray(mean, np.float64)) for name, mean in means.items()} | made
        planes = {name: Plane(self.sums[name], "half_spp" if name == "half" else "spp") for name in names}
        return {**planes, **made, "dropped": Plane(self.dropped), "dropped_half": Plane(self.dropped_half)}

    def _moments(self, display: Optional[Callable[[np.ndarray], np.ndarray]]) -> np.ndarray:
        """The mean squared luminance [h, w] that independent samples would have, if their mean is as uncertain as the waves
        say: sum of w (x_w - x)^2 over ((k - 1) sum of w), of k waves with means x_w; none are said by fewer than two. Under
        a display mapping the uncertainty is what it shows of both sides of the mean."""
        assert self.waves is not None
        mean, n = self.mean(), np.maximum(self.spp(), 1.0)
        total = self.weights["all"] if self.weights else n
        y = mean @ LUMINANCE
        scatter = np.divide(self.sums["moment2"], total, out=np.zeros_like(y), where=total > 0) - y * y
        variance = np.maximum(scatter, 0.0) / np.maximum(self.waves.astype(float) - 1.0, 1.0) * (self.waves > 1)
        if not display:
            return y * y + (n - 1.0) * variance
        share = np.minimum(np.sqrt(variance) / np.where(y > 0, y, np.inf), 1.0)[..., None]
        lower, upper = (display(mean * (1.0 + side * share)) @ LUMINANCE for side in (-1.0, 1.0))
        return (display(mean) @ LUMINANCE) ** 2 + (n - 1.0) * (0.5 * (upper - lower)) ** 2

    # --- state ---------------------------------------------------------------------------------------------------------

    def identity(self) -> dict[str, str]:
        """All that the stops depend on beside the samples and the limits, by name, for lull.checkpoint."""
        return {"picture": f"{self.width}x{self.height}", "crop": ",".join(map(str, self.crop)),
                "block": f"{self.layout.block_width}x{self.layout.block_height}", "seed": str(self.seed),
                "planes": " ".join((*self.planes, *self.layers)), "weighted": str(bool(self.weights)),
                "spp-min": str(self.spp_min), "wave": str(self.wave),
                "mask": _crc(np.array(self.mask_factors)) if min(self.mask_factors) < 1 else "none",
                "check-step": str(self.check_step), "uniform": str(self.uniform),
                "max-seam": str(self.max_seam), "criterion": named(self.criterion),
                "criterion-files": _files_crc(self.criterion),
                **{name.replace("_", "-"): str(value) for name, value in self.shown.items()},
                "display": _crc(np.round(self.display(_RAMP), 4)) if self.display else "none"}

    def arrays(self) -> dict[str, np.ndarray]:
        """All that was accumulated, by name; to be written into when a checkpoint is read."""
        return {"dropped": self.dropped, "dropped_half": self.dropped_half,
                **({} if self.waves is None else {"waves": self.waves}),
                **{f"sum-{name}": s for name, s in self.sums.items()},
                **{f"weight-{name}": w for name, w in self.weights.items()}}


# Radiance that tells one display mapping from another: greys from black to far beyond white, and the primaries
_RAMP = np.concatenate([np.multiply.outer(np.append(0, np.exp2(np.linspace(-12, 8, 200))), w)
                        for w in ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])


def _crc(array: np.ndarray) -> str:
    return f"crc {zlib.crc32(np.ascontiguousarray(array, '<f8').tobytes()):08x}"


def named(criterion: Criterion) -> str:
    """Its id, version and parameters."""
    info = criterion.info
    return " ".join([info.id, info.version, *(f"{key}={value}" for key, value in sorted(criterion.parameters.items()))])


def _files_crc(criterion: Criterion) -> str:
    """Of the criterion's library and of the files that its parameters name."""
    files = (criterion.parameters.get(p.name) for p in criterion.info.parameters if p.type == "file")
    crc = 0
    for path in (criterion.info.path, *filter(None, files)):
        with open(encoded(path), "rb") as file:
            crc = zlib.crc32(file.read(), crc)
    return f"crc {crc:08x}"


def _choose_planes(criterion: Criterion, supplies: Sequence[str], has_display: bool,
                   denoised: bool) -> tuple[str, ...]:
    """Planes that the criterion is shown: what it or the denoiser reads of what there is."""
    if unknown := set(supplies) - {"moment2", "albedo", "normal", "depth"}:
        raise ValueError(f"planes {', '.join(sorted(unknown))}: a host supplies moment2, albedo, normal or depth")
    required, used = plane_names(criterion.needs.planes_required), plane_names(criterion.needs.planes_used)
    offered = {"color", "half", *supplies} - ({"moment2"} if has_display else set())
    if missing := sorted(required - offered - COUNTS):
        why = "is not there with a display mapping" if {*missing} <= {*supplies} else "this host does not supply"
        raise LullError(abi.E_PLANE, f"criterion {criterion.info.id} reads {', '.join(missing)}, which {why}: choose "
                        f"another criterion (observer, halfbuf), or write a host with Frame(supplies={missing})")
    offered |= {"moment2"}  # of the waves
    read = used | {"color"} | ({"half", "albedo", "normal"} if denoised else set())
    return tuple(name for name in CHANNELS if name in offered & read)


def _layers(names: Sequence[str]) -> tuple[str, ...]:
    taken = {*CHANNELS, "R", "G", "B"}
    if wrong := [n for n in names if not isinstance(n, str) or not n or n in taken or n.startswith("lull.")]:
        raise ValueError(f"layer {wrong[0]!r}: expected a name that is none of {', '.join(sorted(taken))} and not of lull.")
    for name in names:
        exr.check_name(name)
    if len(set(names)) < len(names):
        raise ValueError(f"layers {', '.join(names)}: expected each name once")
    return tuple(names)


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
