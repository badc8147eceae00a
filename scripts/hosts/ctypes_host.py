#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A host in plain Python: the package lull (plugin-api/python) with a made-up renderer of four blocks.

    scripts/hosts/ctypes_host.py build/lib/lull/halfbuf.so [KEY=VALUE ...]

Noise by block: none, a little, much, rare bright ones.
"""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin-api" / "python"))
try:
    import numpy as np

    import lull
except ImportError as error:
    sys.exit(f"ctypes_host: {error}: it needs numpy")

LUMINANCE = np.array([.2126729, .7151522, .0721750])
SIGMA = {(0, 0): 0.0, (32, 0): .1, (0, 32): .5, (32, 32): .1}
rng = np.random.default_rng(1)


def render(rects, first, count, half):
    """The mean of `count` samples for each rectangle, and of their squared luminance."""
    for r in rects:
        value = .4 * (1 + SIGMA[r.x0, r.y0] * rng.standard_normal((count, r.height, r.width, 1))) * np.ones(3)
        if (r.x0, r.y0) == (32, 32):
            value[rng.random(value.shape[:3]) < 1e-5] += 300.0
        yield {"color": value.mean(0), "moment2": ((value @ LUMINANCE) ** 2).mean(0)}


def demonstrate(path, parameters):
    with lull.load(path, **parameters) as criterion:
        print(f"{criterion.info.id} {criterion.info.version}: {criterion.info.name}")
        frame = lull.Frame(criterion, 64, 64, block=32, supplies=["moment2"], spp_min=16, spp_max=1024)
        lull.Driver(frame, render).run()
        for b in frame.blocks:
            print(f"  block {b.id}: {b.spp:4} spp, {b.checks} checks, {b.reason}, error {b.error:.4g}")
        frame.close()


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help") or any("=" not in a for a in sys.argv[2:]):
        sys.exit(__doc__)
    try:
        demonstrate(sys.argv[1], dict(a.split("=", 1) for a in sys.argv[2:]))
    except lull.LullError as error:
        sys.exit(f"ctypes_host: {error}")
