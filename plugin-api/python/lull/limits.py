# SPDX-License-Identifier: MIT
"""What numbers from outside may be, in the path tracer's ranges; one line for what they may not be."""
from __future__ import annotations

import operator
from typing import Any

import numpy as np

_SPP, _FINITE, _ABOVE_0 = (1, (1 << 31) - 1), float(np.finfo(float).max), 5e-324
# Whole numbers where the ends are
_RANGES: dict[str, tuple[float, float]] = {
    "width": (1, 32768), "height": (1, 32768), "crop": (-32768, 32768), "block": (1, 4096), "wave": _SPP, "spp_min": _SPP,
    "spp_max": _SPP, "spp": _SPP, "simulate_to": _SPP, "count": (0, _SPP[1]), "reason": (1, _SPP[1]), "seed": (0, (1 << 64) - 1),
    "threads": (1, 1 << 20), "time_budget_s": (0.0, 1e9), "max_seam": (0.0, 1e6), "max_check_overhead": (0.0, 1.0),
    "exposure": (_ABOVE_0, _FINITE), "gamma": (_ABOVE_0, _FINITE), "sample_clamp": (0.0, _FINITE), "checkpoint_every_s": (0.0, _FINITE), "check_step": (1, 1 << 32)}


def checked(name: str, value: object) -> Any:
    """value, if it is in the range of this name, as an int or a float; NaN is in none."""
    low, high = _RANGES[name]
    expected = (f"expected a {'whole' if isinstance(low, int) else 'finite'} number " +
                ("above 0" if low == _ABOVE_0 else f"from {low}") + ("" if high == _FINITE else f" to {high}"))
    try:
        if isinstance(value, (str, bytes)):  # which float() would read
            raise TypeError
        number = operator.index(value) if isinstance(low, int) else float(value)  # type: ignore[arg-type,call-overload]
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} {value!r}: {expected}") from None
    if not low <= number <= high:
        raise ValueError(f"{name} {value}: {expected}")
    return number


def flag(name: str, value: object) -> bool:
    """value, if it is a truth value."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} {value!r}: expected True or False")
    return bool(value)


def rectangle(name: str, value: object) -> tuple[int, int, int, int]:
    """Four whole numbers."""
    try:
        x0, y0, x1, y1 = value  # type: ignore[misc]
    except (TypeError, ValueError):
        raise TypeError(f"{name} {value!r}: expected x0, y0, x1, y1") from None
    low, high = _RANGES["crop"]
    try:
        ends = [operator.index(v) for v in (x0, y0, x1, y1)]
    except TypeError:
        raise TypeError(f"{name} {value!r}: expected whole numbers") from None
    if not all(low <= v <= high for v in ends):
        raise ValueError(f"{name} {value!r}: expected whole numbers from {low} to {high}")
    return ends[0], ends[1], ends[2], ends[3]


def unmasked(name: str, array: np.ndarray) -> np.ndarray:
    """array, if it has no mask: sums would hold what lies under it."""
    if isinstance(array, np.ma.MaskedArray):
        raise TypeError(f"{name}: a masked array: fill its holes first, array.filled(value)")
    return array
