# SPDX-License-Identifier: MIT
"""The blocks of a picture and what is known about each; the same grid, schedule and reasons as in the path tracer."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, Optional, Sequence

import numpy as np

from . import limits
from .criterion import Rect

# Why a block got no more samples; the index is what the EXR's lull.reason.V holds.
REASONS = ("none", "criterion", "spp-max", "uniform", "time", "interrupt", "dropped")
# Checks that the criterion did not place grow by this factor: a block overshoots its threshold by 15 % at most.
CHECK_RATIO = 1.15
# A picture in fewer blocks than this has little to stop early: its default block is smaller. A block of fewer pixels a side
# holds too few to judge, so the default stays above.
ENOUGH_BLOCKS, LEAST_DEFAULT = 12, 16


@dataclass
class Block:
    """One block. It is active while its reason is "none"."""
    id: int  # place in the whole picture's grid, row by row
    rect: Rect
    column: int = 0  # of the grid
    row: int = 0
    spp: int = 0  # samples per pixel so far
    half_spp: int = 0  # of these in half A
    next_spp: int = 0  # where the next check is
    reason: str = "none"
    checks: int = 0
    stop_votes: int = 0  # STOP answers in a row, counted for blocks that dropped samples
    asked_spp: int = 0  # samples at the last answer, 0 = none yet
    p_noisy: float = math.nan  # of the last answer, as are error and predicted_spp; NaN = not known
    error: float = math.nan
    predicted_spp: float = math.nan
    thread_s: float = 0.0
    dropped: int = 0  # samples with non-finite values

    @property
    def active(self) -> bool:
        return self.reason == "none"


def default_block(width: int, height: int, largest: int = 200) -> int:
    """The block size, up to `largest`, with which a picture has ENOUGH_BLOCKS: the largest one that leaves no block at an
    edge narrower than half of it, if there is one. Never below LEAST_DEFAULT, however small the picture."""
    def count(size: int) -> int:
        return -(-width // size) * -(-height // size)

    def even(size: int) -> bool:
        return all(length <= size or length % size == 0 or 2 * (length % size) >= size for length in (width, height))

    if count(largest) >= ENOUGH_BLOCKS:
        return largest
    fine = [size for size in range(largest - 1, LEAST_DEFAULT - 1, -1) if count(size) >= ENOUGH_BLOCKS]
    return next(filter(even, fine), fine[0] if fine else min(LEAST_DEFAULT, largest))


def grid(width: int, height: int, block_width: int, block_height: int, crop: Optional[Rect] = None) -> list[Block]:
    """The blocks that the crop touches, whole, row by row. The grid starts at the upper left corner whatever the crop."""
    width, height = limits.picture(width, height)
    block_width = limits.whole("block width", block_width, 1, limits.MAX_BLOCK)
    block_height = limits.whole("block height", block_height, 1, limits.MAX_BLOCK)
    x0, y0, x1, y1 = (limits.whole("crop", v, -limits.MAX_SIDE, limits.MAX_SIDE) for v in crop or (0, 0, width, height))
    if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
        raise ValueError(f"crop {x0},{y0},{x1},{y1}: no block is left; expected 0 <= x0 < x1 <= {width} and "
                         f"0 <= y0 < y1 <= {height}")
    if -(-(x1 - x0) // block_width) * -(-(y1 - y0) // block_height) > limits.MAX_BLOCKS:
        raise ValueError(f"a picture of {width}x{height} in blocks of {block_width}x{block_height}: expected at most 2^20 "
                         "blocks: take larger ones")
    columns = -(-width // block_width)
    return [Block(row * columns + column,
                  Rect(column * block_width, row * block_height, min(width, (column + 1) * block_width),
                       min(height, (row + 1) * block_height)), column, row)
            for row in range(y0 // block_height, -(-y1 // block_height))
            for column in range(x0 // block_width, -(-x1 // block_width))]


def next_check(spp: int, asked: int, spp_max: int) -> int:
    """Samples at the check after one at spp: `asked` if the criterion named one, else a geometric step."""
    following = asked if asked > spp else math.ceil(spp * CHECK_RATIO)
    return min(max(following, spp + 1), spp_max)


def reopen(blocks: Sequence[Block], max_seam: float, at: Callable[[int], int] = int) -> int:
    """Re-opens stopped blocks beside one with more than max_seam times their samples, up to that ratio. Returns how many.
    at: moves a check to where one can be."""
    placed = {(b.column, b.row): b for b in blocks}
    reopened = 0
    for b in blocks:
        if b.reason not in ("criterion", "dropped"):
            continue
        near = (placed.get((b.column + dx, b.row + dy)) for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)))
        need = math.ceil(max((n.spp for n in near if n), default=0) / max_seam)
        if need > b.spp:
            b.reason, b.next_spp = "none", at(need)
            reopened += 1
    return reopened


def merge(rects: Sequence[Rect]) -> list[Rect]:
    """The same pixels in fewer rectangles: rows of neighbours first, then equal rows below each other."""
    rows: list[Rect] = []
    for r in sorted(rects, key=lambda r: (r.y0, r.y1, r.x0)):
        last = rows[-1] if rows else None
        if last and (last.y0, last.y1, last.x1) == (r.y0, r.y1, r.x0):
            rows[-1] = last._replace(x1=r.x1)
        else:
            rows.append(r)
    merged: list[Rect] = []
    for r in sorted(rows, key=lambda r: (r.x0, r.x1, r.y0)):
        last = merged[-1] if merged else None
        if last and (last.x0, last.x1, last.y1) == (r.x0, r.x1, r.y0):
            merged[-1] = last._replace(y1=r.y1)
        else:
            merged.append(r)
    return merged


def bounds(blocks: Sequence[Block]) -> Rect:
    """The smallest rectangle that holds all blocks."""
    corners = np.array([b.rect for b in blocks])
    return Rect(*map(int, (*corners[:, :2].min(0), *corners[:, 2:].max(0))))
