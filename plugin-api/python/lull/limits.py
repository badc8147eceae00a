# SPDX-License-Identifier: MIT
"""What numbers from outside may be, in the path tracer's ranges; one line for what they may not be."""
from __future__ import annotations

import operator

import numpy as np

MAX_SIDE, MAX_PIXELS, MAX_BLOCK = 32768, 1 << 28, 4096  # of a picture and of a block
MAX_BLOCKS = 1 << 20  # a block is an object here: more of them would fill the memory before the first sample
MAX_SPP, MAX_TIME_S, MAX_SEAM = (1 << 31) - 1, 1e9, 1e6
MAX_SEED = (1 << 64) - 1
FINITE = float(np.finfo(float).max)


def whole(name: str, value: object, low: int, high: int) -> int:
    """value, if it is an integer in [low, high]."""
    try:
        n = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} {value!r}: expected a whole number from {low} to {high}") from None
    if not low <= n <= high:
        raise ValueError(f"{name} {n}: expected a whole number from {low} to {high}")
    return n


def real(name: str, value: object, low: float, high: float = FINITE) -> float:
    """value, if it is a number in [low, high]; NaN is not."""
    expected = f"expected a number from {low:g} to {high:g}" if high < FINITE else f"expected a finite number from {low:g}"
    try:
        x = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise TypeError(f"{name} {value!r}: {expected}") from None
    if not low <= x <= high:
        raise ValueError(f"{name} {value}: {expected}")
    return x


def positive(name: str, value: object) -> float:
    """value, if it is a finite number above 0."""
    x = real(name, value, 0)
    if x == 0:
        raise ValueError(f"{name} {value}: expected a number above 0")
    return x


def picture(width: object, height: object) -> tuple[int, int]:
    """A picture's size in pixels."""
    w, h = whole("width", width, 1, MAX_SIDE), whole("height", height, 1, MAX_SIDE)
    if w * h > MAX_PIXELS:
        raise ValueError(f"a picture of {w}x{h}: expected at most 2^28 pixels in all")
    return w, h


def unmasked(name: str, array: np.ndarray) -> np.ndarray:
    """array, if it has no mask: sums would hold what lies under it."""
    if isinstance(array, np.ma.MaskedArray):
        raise TypeError(f"{name}: a masked array: fill its holes first, array.filled(value)")
    return array
