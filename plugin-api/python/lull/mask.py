# SPDX-License-Identifier: MIT
"""A region that the user wants better: a grey picture that scales the criterion's dial per block.

Black leaves the dial as it is, white takes a quarter of it, grey g in between 4^(-g), in steps of an eighth. The lightest
pixel of a block counts, so that painting over a part of a block is enough. The dial is the parameter `visible` (share of
viewers) if it has a value, else `threshold`. The path tracer's --mask does the same.
"""
from __future__ import annotations

from typing import Optional, Sequence

import numpy as np

from . import limits
from .blocks import Block
from .criterion import Criterion
from .library import Parameter

WHITE_SCALE = 0.25
STEPS = 8


def dial_scales(mask: Optional[np.ndarray], blocks: Sequence[Block], width: int, height: int) -> list[float]:
    """The factor of the dial for each block. mask: [height, width] in [0, 1]."""
    if mask is None:
        return [1.0] * len(blocks)
    mask = np.asarray(limits.unmasked("mask", mask), np.float64)
    if mask.shape != (height, width):
        raise ValueError(f"mask of shape {mask.shape}: expected the picture's, [{height}, {width}]")
    if not ((mask >= 0) & (mask <= 1)).all():
        raise ValueError("mask: expected values in [0, 1]")
    lightest = [float(mask[b.rect.y0:b.rect.y1, b.rect.x0:b.rect.x1].max()) for b in blocks]
    return [WHITE_SCALE ** (int(g * STEPS + 0.5) / STEPS) for g in lightest]


def dial_of(criterion: Criterion) -> tuple[Parameter, float]:
    """The criterion's dial and its value."""
    known = [p for p in map(criterion.info.parameter, ("visible", "threshold")) if p]
    for parameter in known:
        value = criterion.parameters.get(parameter.name, parameter.default)
        if value is not None:
            return parameter, float(value)
    raise ValueError(f"criterion {criterion.info.id}: a mask scales '{known[0].name}', which has no value: give it one"
                     if known else f"criterion {criterion.info.id} has no dial 'visible' or 'threshold' for a mask to scale")


def judges_of(criterion: Criterion, scales: Sequence[float]) -> tuple[list[Criterion], list[Criterion]]:
    """Instances made for scales other than 1, and the instance for each block."""
    by_scale = {1.0: criterion}
    for scale in sorted(set(scales) - {1.0}):
        dial, value = dial_of(criterion)
        by_scale[scale] = criterion.with_parameters(**{dial.name: min(max(value * scale, dial.min), dial.max)})
    return [j for s, j in by_scale.items() if s != 1.0], [by_scale[s] for s in scales]
