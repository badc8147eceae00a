# SPDX-License-Identifier: MIT
"""8-bit sRGB codes of linear light (IEC 61966-2-1): those of Lull's programs, on every processor."""
from __future__ import annotations

import functools
import math
from fractions import Fraction

import numpy as np


@functools.lru_cache(maxsize=None)
def limits() -> np.ndarray:
    """[255]: the smallest double of each code from 1 on. Exact: x >= a^2.4 is decided by x^5 >= a^12, without rounding."""
    found = []
    for code in range(1, 256):
        encoded = Fraction(2 * code - 1, 510)
        if encoded <= Fraction("0.04045"):
            power, wanted = 1, encoded / Fraction("12.92")
            x = float(wanted)
        else:
            base = (encoded + Fraction("0.055")) / Fraction("1.055")
            power, wanted = 5, base ** 12
            x = float(base) ** 2.4
        # the library's power is some last digits beside it
        while Fraction(x) ** power >= wanted:
            x = float(np.nextafter(x, -math.inf))
        while Fraction(x) ** power < wanted:
            x = float(np.nextafter(x, math.inf))
        found.append(x)
    return np.array(found)


def codes(linear: np.ndarray) -> np.ndarray:
    """floor(255 oetf(clamp(linear, 0, 1)) + 0.5) as uint8; NaN gives 0."""
    linear = np.asarray(linear, np.float64)
    return np.where(np.isnan(linear), 0, np.searchsorted(limits(), linear, side="right")).astype(np.uint8)
