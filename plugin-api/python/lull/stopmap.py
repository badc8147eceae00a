# SPDX-License-Identifier: MIT
"""The stop map: each block in the colour of its sample count, the count written into it, and a legend; or a table."""
from __future__ import annotations

import math
import os
from typing import Sequence

import numpy as np

from . import png
from .blocks import Block, bounds
from .files import replaced

# Smith and van der Walt's viridis (2015), at 17 even steps
_VIRIDIS = np.array([(68, 1, 84), (72, 21, 104), (72, 40, 120), (69, 58, 130), (62, 74, 137), (55, 91, 141), (48, 106, 142),
                     (42, 121, 142), (33, 145, 140), (31, 154, 138), (34, 168, 132), (53, 183, 121), (83, 197, 104),
                     (122, 209, 81), (165, 219, 54), (210, 226, 27), (253, 231, 37)], float)
# Seven rows of five pixels per character, leftmost pixel in bit 4
_GLYPHS = {"0": "0e11131519110e", "1": "040c040404040e", "2": "0e11010204081f", "3": "1f02040201110e", "4": "02060a121f0202",
           "5": "1f101e0101110e", "6": "0608101e11110e", "7": "1f010204080808", "8": "0e11110e11110e", "9": "0e11110f01020c",
           "s": "00000e100e011e", "p": "00001e111e1010"}
_LEGEND, _MIN_BLOCK, _MAX_ENLARGE, _MIN_WIDTH = 44, 48, 16, 160  # pixels; the largest factor


def viridis(t: np.ndarray) -> np.ndarray:
    """Colours [..., 3] uint8 of t in [0, 1], dark blue to yellow."""
    at = np.clip(t, 0, 1) * 16
    return np.stack([np.interp(at, np.arange(17), _VIRIDIS[:, c]) for c in range(3)], -1).round().astype(np.uint8)


def _text(picture: np.ndarray, x: int, y: int, scale: int, ink: Sequence[int], text: str) -> None:
    for n, c in enumerate(text):
        rows = np.frombuffer(bytes.fromhex(_GLYPHS.get(c, "00" * 7)), np.uint8)
        dots = (rows[:, None] >> np.arange(4, -1, -1) & 1).astype(bool).repeat(scale, 0).repeat(scale, 1)
        left = x + 6 * scale * n
        part = picture[max(y, 0):y + 7 * scale, max(left, 0):left + 5 * scale]
        part[dots[:part.shape[0], :part.shape[1]]] = ink


def _paint_block(part: np.ndarray, spp: int, colour: np.ndarray, digits: int) -> None:
    """part: the block's pixels [h, w, 3]; digits: of the longest number, so that all are written in the same size."""
    part[:] = colour
    part[-1], part[:, -1] = colour * 3 // 4, colour * 3 // 4
    r, g, b = (int(v) for v in colour)
    ink = (0, 0, 0) if 2 * r + 5 * g + b > 8 * 120 else (255, 255, 255)
    height, width, text = *part.shape[:2], str(spp)
    for scale in (4, 3, 2, 1):
        if (6 * digits - 1) * scale * 5 <= width * 4 and 7 * scale * 3 <= height * 2:
            _text(part, (width - (6 * len(text) - 1) * scale) // 2, (height - 7 * scale) // 2, scale, ink, text)
            break


def _paint_legend(part: np.ndarray, low: int, high: int) -> None:
    part[:] = 255
    left, right = 8, part.shape[1] - 8
    part[6:20, left:right] = viridis(np.linspace(0, 1, right - left) if high > low else np.full(right - left, 0.5))
    for at in (0, 1, 0.5) if part.shape[1] >= 360 and high > low else (0, 1):
        text = f"{low * (high / low) ** at:.0f}" + (" spp" if at == 0 else "")
        _text(part, left + int(at * (right - left - 12 * len(text))), 25, 2, (0, 0, 0), text)


def draw(blocks: Sequence[Block]) -> np.ndarray:
    """The picture, [height, width, 3] uint8; small blocks are enlarged until their numbers fit."""
    area = bounds(blocks)
    counts = [max(b.spp, 1) for b in blocks]
    low, high = min(counts), max(counts)
    enlarge = -(-_MIN_BLOCK // max(b.rect.width for b in blocks))
    enlarge = min(max(enlarge, -(-_MIN_WIDTH // area.width)), _MAX_ENLARGE)
    picture = np.zeros((area.height * enlarge + _LEGEND, area.width * enlarge, 3), np.uint8)
    for b, count in zip(blocks, counts):
        t = math.log(count / low) / math.log(high / low) if high > low else 0.5
        x0, y0, x1, y1 = ((v - o) * enlarge for v, o in zip(b.rect, (area.x0, area.y0) * 2))
        _paint_block(picture[y0:y1, x0:x1], b.spp, viridis(np.array(t)).astype(int), len(str(high)))
    _paint_legend(picture[area.height * enlarge:], low, high)
    return picture


def write(path: str, blocks: Sequence[Block], scene: str = "") -> None:
    """A picture, or with the ending .csv one line `name;spp;spp;…;` in the order of the blocks."""
    if not path.lower().endswith(".csv"):
        png.write(path, draw(blocks))
        return
    name = os.path.splitext(os.path.basename(scene))[0]
    with replaced(path) as file:
        file.write(f"{name};{''.join(f'{b.spp};' for b in blocks)}\n".encode())
