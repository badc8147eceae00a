# SPDX-License-Identifier: MIT
"""The picture that people keep: denoised, or between that and the noisy one, by Open Image Denoise (docs/denoised.md)."""
from __future__ import annotations

import ctypes as C
from typing import Mapping, NamedTuple, Optional, Union

import numpy as np

from . import abi
from .criterion import Criterion, Plane, load
from .host import HostFrame
from .library import LullError, call, encoded

KINDS = ("blend", "full")  # what is kept, as --denoise names it


class Denoised(NamedTuple):
    """Arrays over the pixels of the frame's `view`, rows from the top, float32, and one value per block.

    picture: [height, width, 3], what is kept, linear radiance as frame.mean(): the blend, or the denoised picture alone.
    denoised: [height, width, 3], likewise; beside a blend the mean of the denoised halves. weight: [height, width] in [0, 1],
    the share of the noisy picture in `picture`. error, noisy_error: [blocks] float64, what is seen of the error of `picture`
    and of the noisy one, in the order of frame.blocks; 1 is just seen, NaN not known.
    """
    picture: np.ndarray
    denoised: np.ndarray
    weight: np.ndarray
    error: np.ndarray
    noisy_error: np.ndarray


def check(library: str = "") -> None:
    """LullError, which says how to get one, if there is no Open Image Denoise. library: its file or folder; "": LULL_OIDN
    and the usual places."""
    call("host_denoiser", encoded(library) or None)


def criterion_of(kind: str) -> str:
    """The criterion that nobody chose: kind is one of KINDS, or "" for the noisy picture. ValueError for another."""
    if kind and kind not in KINDS:
        raise ValueError(f"denoise '{kind}': expected one of {', '.join(KINDS)}")
    return "denoised" if kind else "observer"


def parameters_of(kind: str, criterion: Union[str, Criterion], given: Mapping[str, object]) -> dict[str, object]:
    """given, and that the criterion judges the picture that is kept."""
    return {**({"picture": "denoised"} if kind == "full" and criterion == "denoised" else {}), **given}


def denoise(frame: HostFrame, planes: Optional[Mapping[str, Plane]] = None, *, full: bool = False, library: str = "",
            threads: int = 0) -> Denoised:
    """Denoises a frame as it is at this moment, also a closed one; with the planes albedo and normal, if it has both
    (`Frame` keeps them with denoised=True).

    planes: as for HostFrame.check, linear radiance; default the frame's own. full: the denoised picture alone; a blend
    needs halves. threads: 0 = all processors. Pixels without samples are black. Errors that the frame's own criterion has
    not told are asked of `denoised`, which denoises the halves of each block, and of `observer`. LullError: no denoiser, or
    one that fails.
    """
    size = frame.view.height, frame.view.width
    picture, denoised, weight = (np.zeros((*size, *last), np.float32) for last in ((3,), (3,), ()))
    view = frame.view_of(frame.planes_now(as_shown=False) if planes is None else planes)
    how = abi.sized(abi.HostDenoising, flags=abi.DENOISE_FULL * full, threads=threads, library=encoded(library) or None)
    out = abi.sized(abi.HostPicture, rgb=picture.ctypes.data, denoised=denoised.ctypes.data, weight=weight.ctypes.data)
    call("host_denoise", frame.handle.pointer, C.byref(view), C.byref(how), C.byref(out))
    kept = {"picture": "denoised" if full else "blend", **({"library": library} if library else {})}
    return Denoised(picture, denoised, weight, _errors(frame, "denoised", kept, planes),
                    _errors(frame, "observer", {}, planes))


def _errors(frame: HostFrame, criterion: str, parameters: Mapping[str, object],
            planes: Optional[Mapping[str, Plane]]) -> np.ndarray:
    """Each block's, as a criterion sees it: the frame's own if it is that one, else a new one; NaN if it cannot be asked."""
    own = frame.criterion
    if own.info.id == criterion and own.parameters.get("picture", "blend") == parameters.get("picture", "blend"):
        return np.array([b.error for b in frame.blocks])
    try:
        with load(criterion, threads=own.threads, log=lambda *_: None, **parameters) as judge:
            return np.array([d.error for d in frame.evaluate(range(len(frame.blocks)), planes, judge)])
    except LullError:
        return np.full(len(frame.blocks), np.nan)
