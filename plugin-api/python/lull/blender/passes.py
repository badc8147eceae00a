# SPDX-License-Identifier: MIT
"""The passes of a view layer, summed over waves: alpha and all that Cycles averages over samples, what it takes from the
first sample or wave alone, and light that it divides by a colour. Cryptomatte, which ranks objects by their share, cannot
be summed so; the shadow catcher's pass, a ratio of two that are not given, is the mean of the waves' ratios."""
from __future__ import annotations

import re
from typing import Iterable, Mapping, Optional

import numpy as np

from ..criterion import Rect
from ..frame import Frame

# Under their names up to 4.x and in 5.x. Motion vectors are divided by how many samples met something, which no pass tells:
# the first wave's are kept.
_FIRST = {"Depth", "Position", "IndexOB", "IndexMA", "Object Index", "Material Index", "Vector"}
_LIGHT = re.compile(r"(Diff|Gloss|Trans|Subsurface)(?:Dir|Ind)|"
                    r"((?:Diffuse|Glossy|Transmission|Subsurface) )(?:Direct|Indirect)")
_LEFT_OUT = re.compile(r"Crypto.*|Debug Sample Count|Render Time|Noisy.*")


def _colour_of(name: str) -> Optional[str]:
    """The pass that Cycles has divided this one by."""
    found = _LIGHT.fullmatch(name)
    return None if not found else f"{found[1]}Col" if found[1] else f"{found[2]}Color"


def summed(name: str) -> bool:
    """Is this a pass that waves can be summed for?"""
    return not _LEFT_OUT.fullmatch(name)


class Passes:
    """names: what to give the frame as layers. prefix: the view layer's name; channels: those of a wave, without it; size:
    the picture's; hidden: passes that the user has not switched on; transparent: the film is, alpha is wanted."""

    def __init__(self, prefix: str, channels: Iterable[str], size: tuple[int, int], hidden: set[str], transparent: bool):
        kept = [c for c in channels if summed(c.rpartition(".")[0]) and not c.startswith("Combined.")]
        self.prefix, self._hidden, self._transparent = "View Layer" if prefix.split(".")[0] == "lull" else prefix, hidden, transparent
        self._kept = {self._named(c): c for c in kept}
        self.names = [*self._kept, *(["A"] if transparent else [])]
        self._first = {name: np.zeros((size[1], size[0]), np.float32) for name, c in self._kept.items()
                       if c.rpartition(".")[0] in _FIRST}

    def _named(self, channel: str) -> str:
        return f"{self.prefix}.{channel}"

    def _divisor(self, channel: str, have: Mapping[str, np.ndarray]) -> Optional[np.ndarray]:
        """The colour that a channel of light was divided by."""
        name, _, letter = channel.rpartition(".")
        colour = _colour_of(name)
        return have.get(f"{colour}.{letter}") if colour else None

    def sample(self, channels: Mapping[str, np.ndarray], area: Rect, first: int) -> dict[str, np.ndarray]:
        """What the frame sums for a wave of an area: light is multiplied by its colour again, and what comes from the first
        sample is the same in every wave."""
        out = {"A": channels["Combined.A"]} if self._transparent else {}
        at = np.s_[area.y0:area.y1, area.x0:area.x1]
        for name, channel in self._kept.items():
            value, divisor = channels[channel], self._divisor(channel, channels)
            if name in self._first:
                if first == 0:
                    self._first[name][at] = value
                value = self._first[name][at]
            out[name] = value if divisor is None else value * divisor
        return out

    def remember(self, frame: Frame) -> None:
        """What came from the first sample, of a frame that goes on from a checkpoint."""
        v = frame.view
        for name, plane in self._first.items():
            plane[v.y0:v.y1, v.x0:v.x1] = frame.mean(name)

    def finished(self, frame: Frame, rgb: np.ndarray) -> dict[str, Optional[np.ndarray]]:
        """Channels for the picture's file, over the view: light divided by its colour, the picture rgb as the view layer's
        Combined, which is what Blender looks for. None: summed for another one's sake only."""
        means = {channel: frame.mean(name) for name, channel in self._kept.items()}
        out: dict[str, Optional[np.ndarray]] = {}
        for name, channel in self._kept.items():
            divisor = self._divisor(channel, means)
            if divisor is not None:
                out[name] = np.divide(means[channel], divisor, out=np.zeros_like(divisor), where=divisor > 0)
            if channel.rpartition(".")[0] in self._hidden:
                out[name] = None
        for k, letter in enumerate("RGB"):
            out[self._named(f"Combined.{letter}")] = rgb[..., k]
        out[self._named("Combined.A")] = frame.mean("A") if self._transparent else np.ones(rgb.shape[:2])
        return out
