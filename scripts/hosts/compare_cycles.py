#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lull's stops against Cycles' own adaptive sampling, on what compare_cycles_record.py recorded.

    scripts/hosts/compare_cycles.py [-c CRITERION] DIAL=V,V,… RECORDED.npz ...

For each noise threshold of Cycles: processor seconds, the samples per pixel that a uniform render makes in them (Cycles' pass of
sample counts is relative), and the visible difference of the worst block (the
model observer: 1 = a viewer just sees it); then the setting of the criterion with the fewest samples whose worst block is no
worse, with its samples and seconds. Criteria are replayed on the recorded waves: they stop as they would in a render.
"""
import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin-api" / "python"))
import lull  # noqa: E402

# ggn/observer/observer.json
LEVEL, EXPONENT, OFFSET = 0.24949, 0.49735, 2.0
LUMINANCE = np.array([.2126729, .7151522, .0721750])


def lightness(rgb):
    """CIE L* of what a display shows, [h, w]."""
    y = np.clip(rgb, 0, 1) @ LUMINANCE
    return np.where(y > 216 / 24389, 116 * np.cbrt(y) - 16, 24389 / 27 * y)


def filtered(image, taps):
    """Separable filter, edges repeated."""
    r = len(taps) // 2
    padded = np.pad(image, r, mode="edge")
    rows = sum(t * padded[k:k + image.shape[0]] for k, t in enumerate(taps))
    return sum(t * rows[:, k:k + image.shape[1]] for k, t in enumerate(taps))


def visible_difference(test, reference):
    """Of one block against its reference, over the limit at which people stop seeing it (ggn/observer/visibility.h)."""
    a, b = lightness(test), lightness(reference)
    gauss = np.array([.009620057, .205423697, .569912492, .205423697, .009620057])
    noise = (filtered(a - b, gauss) ** 4).mean() ** .25
    box = np.full(5, .2)
    texture = np.sqrt(np.maximum(filtered(b * b, box) - filtered(b, box) ** 2, 0)).mean()
    return noise / (LEVEL * (texture + OFFSET) ** EXPONENT)


def worst(image, reference, block):
    height, width = image.shape[:2]
    cells = [np.s_[y:y + block, x:x + block] for y in range(0, height, block) for x in range(0, width, block)]
    return max(visible_difference(image[c], reference[c]) for c in cells)


def replay(data, criterion, dial, value):
    """Mean samples per pixel, processor seconds (waves as recorded, and the criterion's), worst block."""
    waves, wave, block = data["waves"], int(data["wave"]), int(data["block"])
    height, width = waves.shape[1:3]

    def render(rects, first, count, _half):
        for r in rects:
            yield waves[first // wave, r.y0:r.y1, r.x0:r.x1]
    with lull.load(criterion, **{dial: value}) as c:
        frame = lull.Frame(c, width, height, block=block, spp_max=wave * len(waves))
        driver = lull.Driver(frame, render, wave=wave)
        start, judging = time.process_time(), 0.0
        while driver.step() is None:
            pass
        judging = time.process_time() - start
        seconds = sum(data["wave-s"][:b.spp // wave, i].sum() for i, b in enumerate(frame.blocks))
        frame.close()
        return frame.spp().mean(), seconds + judging, worst(frame.mean(), data["reference"], block)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("-c", "--criterion", default="observer")
    parser.add_argument("dial", metavar="DIAL=V,V,…")
    parser.add_argument("recorded", nargs="+")
    options = parser.parse_args()
    dial, values = options.dial.split("=")
    print("| scene | Cycles at | spp | CPU s | worst block | Lull, " + options.criterion + " | spp | CPU s | worst block |")
    print("|---|---|---|---|---|---|---|---|---|")
    for path in options.recorded:
        data = dict(np.load(path))
        runs = [(value, *replay(data, options.criterion, dial, value)) for value in values.split(",")]
        for k, threshold in enumerate(data["thresholds"]):
            own = worst(data[f"adaptive-{k}"], data["reference"], int(data["block"]))
            good = [r for r in runs if r[3] <= own * 1.02] or [min(runs, key=lambda r: r[3])]
            value, spp, seconds, difference = min(good, key=lambda r: r[1])
            uniform = float(data[f"adaptive-s-{k}"] / data["whole-s"]) * int(data["wave"]) * len(data["waves"])
            print(f"| {Path(path).stem} | {threshold:g} | {uniform:.0f} | {float(data[f'adaptive-s-{k}']):.1f} | {own:.2f} | "
                  f"{dial} {value} | {spp:.0f} | {seconds:.1f} | {difference:.2f} |")


main()
