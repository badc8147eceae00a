# SPDX-License-Identifier: MIT
"""What numbers from outside may be, in the path tracer's ranges; one line for what they may not be."""
from __future__ import annotations

import operator

import numpy as np

MAX_SPP, FINITE = (1 << 31) - 1, float(np.finfo(float).max)


def whole(name: str, value: object, low: int, high: int) -> int:
    """value, if it is an integer in [low, high]."""
    try:
        n = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} {value!r}: expected a whole number from {low} to {high}") from None
    if not low <= n <= high:
        raise ValueError(f"{name} {n}: expected a whole number from {low} to {high}")
    return n


def real(name: str, value: object, low: float, high: float = FINITE, above: bool = False) -> float:
    """value, if it is a number in [low, high], or above low; NaN is not."""
    expected = f"expected a finite number {'above' if above else 'from'} {low:g}" + f" to {high:g}" * (high < FINITE)
    try:
        x = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise TypeError(f"{name} {value!r}: {expected}") from None
    if not low <= x <= high or above and x == low:
        raise ValueError(f"{name} {value}: {expected}")
    return x


def unmasked(name: str, array: np.ndarray) -> np.ndarray:
    """array, if it has no mask: sums would hold what lies under it."""
    if isinstance(array, np.ma.MaskedArray):
        raise TypeError(f"{name}: a masked array: fill its holes first, array.filled(value)")
    return array
