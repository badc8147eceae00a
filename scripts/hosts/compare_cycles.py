#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lull's stops against Cycles' own adaptive sampling: exports the scenes, records them with Blender, compares, prints the table.

    nice -n 10 scripts/hosts/compare_cycles.py FOLDER [--size 320x240 --block 80 --spp 1024 --seeds 3] [-c CRITERION -d DIAL=V,V,…]

For each noise threshold of Cycles, means over the seeds: samples per pixel that a uniform render makes in its seconds (Cycles' pass
of sample counts is relative), processor seconds, visible difference of the worst block (the model observer: 1 = a viewer just
sees it; range over the seeds) from the mean of the other seeds' renders; then the setting of the criterion with the fewest
samples whose worst block is no worse. Criteria are replayed on the recorded waves: they stop as they would in a render. What lies
in FOLDER already is not recorded again.
"""
import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "plugin-api" / "python"))
import lull  # noqa: E402

SCENES = ("cube", "soft-shadow", "cornell-box", "glossy")  # the first one is Blender's own
OBSERVER = json.loads((ROOT / "ggn/observer/observer.json").read_text())
OFFSET = 2.0  # L*, ggn/observer/observer.h
LUMINANCE = np.array([.2126729, .7151522, .0721750])
GAUSS = np.array([.009620057, .205423697, .569912492, .205423697, .009620057])  # ggn/observer/visibility.c


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
    noise = (filtered(a - b, GAUSS) ** 4).mean() ** .25
    box = np.full(5, .2)
    texture = np.sqrt(np.maximum(filtered(b * b, box) - filtered(b, box) ** 2, 0)).mean()
    return noise / (OBSERVER["level"] * (texture + OFFSET) ** OBSERVER["exponent"])


def worst(image, reference, block):
    height, width = image.shape[:2]
    cells = [np.s_[y:y + block, x:x + block] for y in range(0, height, block) for x in range(0, width, block)]
    return max(visible_difference(image[c], reference[c]) for c in cells)


def record(folder, scene, seed, options):
    """The file with the waves of one scene and seed, made if it is not there."""
    blend = folder / f"{scene}.blend"
    blender = ["blender", "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1"]
    if scene != SCENES[0] and not blend.exists():
        subprocess.run([*blender, "--python", ROOT / "scripts/hosts/pbrt_to_blend.py", "--", ROOT / f"scenes/{scene}.pbrt",
                        blend], check=True, stdout=subprocess.DEVNULL)
    out = folder / f"{scene}-{options.size}-{options.block}-{options.spp}-{seed}.npz"
    if not out.exists():
        print(f"recording {out}", file=sys.stderr, flush=True)
        subprocess.run([*blender, *([blend] if scene != SCENES[0] else []), "--python",
                        ROOT / "scripts/hosts/compare_cycles_record.py", "--", out, options.size, str(options.block),
                        str(options.spp), str(seed)], check=True, stdout=subprocess.DEVNULL)
    return dict(np.load(out))


def replay(data, reference, criterion, dial, value):
    """Mean samples per pixel, processor seconds (waves as recorded, and the criterion's), worst block."""
    waves, wave, block = data["waves"], int(data["wave"]), int(data["block"])
    height, width = waves.shape[1:3]

    def render(rects, first, count, _half):
        for r in rects:
            yield waves[first // wave, r.y0:r.y1, r.x0:r.x1]
    with lull.load(criterion, threads=1, **{dial: value}) as c:
        frame = lull.Frame(c, width, height, block=block, spp_max=wave * len(waves))
        driver = lull.Driver(frame, render, wave=wave)
        start = time.process_time()
        while driver.step() is None:
            pass
        judging_s = time.process_time() - start
        render_s = sum(data["wave-s"][:b.spp // wave, i].sum() for i, b in enumerate(frame.blocks))
        frame.close()
        return frame.spp().mean(), render_s + judging_s, worst(frame.mean(), reference, block)


def compare(scene, seeds, criterion, dial, values):
    """The lines of the table about one scene; seeds: what record gave for each."""
    total = sum(data["waves"].mean(0, dtype=float) for data in seeds)
    references = [(total - data["waves"].mean(0, dtype=float)) / (len(seeds) - 1) for data in seeds]
    runs = {v: np.array([replay(d, r, criterion, dial, v) for d, r in zip(seeds, references)]) for v in values}
    for k, threshold in enumerate(seeds[0]["thresholds"]):
        own = np.array([(d[f"adaptive-s-{k}"] / d["sample-s"], d[f"adaptive-s-{k}"],
                         worst(d[f"adaptive-{k}"], r, int(d["block"]))) for d, r in zip(seeds, references)])
        good = {v: run for v, run in runs.items() if run[:, 2].mean() <= own[:, 2].mean()}
        best = min(good or runs, key=lambda v: runs[v][:, 0].mean() if good else runs[v][:, 2].mean())
        yield f"| {scene} | {threshold:g} | {columns(own)} | {dial} {best} | {columns(runs[best])} |"


def columns(rows):
    spp, seconds, difference = rows.mean(0)
    return f"{spp:.0f} | {seconds:.1f} | {difference:.2f} ({rows[:, 2].min():.2f}–{rows[:, 2].max():.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--block", type=int, default=80)
    parser.add_argument("--spp", type=int, default=1024, help="most samples of a pixel, of both")
    parser.add_argument("--seeds", type=int, default=3, help="at least 2: each is judged against the others")
    parser.add_argument("-c", "--criterion", default="observer")
    parser.add_argument("-d", "--dial", default="visible=.999,.99,.97,.95,.9,.8,.7,.6,.5,.4,.3,.25,.2,.15,.1,.07,.05,.03,.02,.01")
    options = parser.parse_args()
    if options.seeds < 2:
        parser.error("--seeds: expected at least 2")
    options.folder.mkdir(parents=True, exist_ok=True)
    dial, values = options.dial.split("=")
    print(f"| scene | Cycles at | spp | CPU s | worst block | Lull, {options.criterion} | spp | CPU s | worst block |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    for scene in SCENES:
        seeds = [record(options.folder, scene, seed, options) for seed in range(options.seeds)]
        for line in compare(scene, seeds, options.criterion, dial, values.split(",")):
            print(line, flush=True)


main()
