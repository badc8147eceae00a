#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lull's stops against Cycles' own adaptive sampling: exports the scenes, records them in Blender, prints the table.

    scripts/hosts/compare_cycles.py FOLDER [--size 240x180 --block 60 --spp 1024 --seeds 2] [-c CRITERION -d DIAL=V,V,…]

For each noise threshold of Cycles, means over the seeds: samples per pixel that a uniform render makes in its seconds
(Cycles' pass of sample counts is relative), processor seconds, visible difference of the worst block (`ggn visible`; range over
the seeds) from the mean of the other seeds' renders; then the setting of the criterion with the fewest samples whose worst
block is no worse, or where there is none, the setting with the best. Criteria are replayed on the recorded waves: they stop
as they would in a render. What lies in FOLDER already is not recorded again.
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
from lull import exr  # noqa: E402

OWN = "cube"  # Blender's default scene
SCENES = (OWN, "soft-shadow", "cornell-box", "glossy")
GGN = ROOT / "build/bin/ggn"


def worst(folder, image, reference, block):
    """Visible difference of the worst block: the model observer's error, 1 = just not visible."""
    paths = [folder / "reference.exr", folder / "image.exr"]
    for path, rgb in zip(paths, (reference, image)):
        exr.write(str(path), {c: rgb[..., i].astype(np.float32) for i, c in enumerate("RGB")}, rgb.shape[1::-1])
    said = subprocess.run([GGN, "visible", "-j", "-b", str(block), *paths], check=True, capture_output=True).stdout
    return json.loads(said)["worst"]


def record(folder, scene, seed, options):
    """The file with the waves of one scene and seed, made if it is not there."""
    blend = folder / f"{scene}.blend"
    blender = ["blender", "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1"]
    if scene != OWN and not blend.exists():
        subprocess.run([*blender, "--python", ROOT / "scripts/hosts/pbrt_to_blend.py", "--", ROOT / f"scenes/{scene}.pbrt",
                        blend], check=True, stdout=subprocess.DEVNULL)
    out = folder / f"{scene}-{options.size}-{options.block}-{options.spp}-{seed}.npz"
    if not out.exists():
        print(f"recording {out}", file=sys.stderr, flush=True)
        subprocess.run([*blender, *([blend] if scene != OWN else []), "--python",
                        ROOT / "scripts/hosts/compare_cycles_record.py", "--", out, options.size, str(options.block),
                        str(options.spp), str(seed)], check=True, stdout=subprocess.DEVNULL)
    return dict(np.load(out))


def replay(folder, data, reference, criterion, dial, value):
    """Mean samples per pixel, processor seconds (waves as recorded, and the criterion's), worst block."""
    waves, wave, block = data["waves"], int(data["wave"]), int(data["block"])
    height, width = waves.shape[1:3]

    def render(rects, first, count, _half):
        for r in rects:
            yield waves[first // wave, r.y0:r.y1, r.x0:r.x1]
    with lull.load(criterion, threads=1, **{dial: value}) as c:
        frame = lull.Frame(c, width, height, block=block, spp_max=wave * len(waves), wave=wave)
        driver = lull.Driver(frame, render)
        start = time.process_time()
        while driver.step() is None:
            pass
        judging_s = time.process_time() - start
        render_s = sum(data["wave-s"][:b.spp // wave, i].sum() for i, b in enumerate(frame.blocks))
        frame.close()
        return frame.spp().mean(), render_s + judging_s, worst(folder, frame.mean(), reference, block)


def compare(folder, scene, seeds, criterion, dial, values):
    """The lines of the table about one scene; seeds: what record gave for each."""
    total = sum(data["waves"].mean(0, dtype=float) for data in seeds)
    references = [(total - data["waves"].mean(0, dtype=float)) / (len(seeds) - 1) for data in seeds]
    runs = {v: np.array([replay(folder, d, r, criterion, dial, v) for d, r in zip(seeds, references)]) for v in values}
    for k, threshold in enumerate(seeds[0]["thresholds"]):
        own = np.array([(d[f"adaptive-s-{k}"] / d["sample-s"], d[f"adaptive-s-{k}"],
                         worst(folder, d[f"adaptive-{k}"], r, int(d["block"]))) for d, r in zip(seeds, references)])
        good = {v: run for v, run in runs.items() if run[:, 2].mean() <= own[:, 2].mean()}
        best = min(good or runs, key=lambda v: runs[v][:, 0].mean() if good else runs[v][:, 2].mean())
        yield f"| {scene} | {threshold:g} | {columns(own)} | {dial} {best} | {columns(runs[best])} |"


def columns(rows):
    spp, seconds, difference = rows.mean(0)
    return f"{spp:.0f} | {seconds:.1f} | {difference:.2f} ({rows[:, 2].min():.2f}–{rows[:, 2].max():.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", default=",".join(SCENES), help="of scenes/, and Blender's own 'cube'")
    parser.add_argument("--size", default="240x180")
    parser.add_argument("--block", type=int, default=60)
    parser.add_argument("--spp", type=int, default=1024, help="most samples of a pixel, of both")
    parser.add_argument("--seeds", type=int, default=2, help="at least 2: each is judged against the others")
    parser.add_argument("-c", "--criterion", default="observer")
    parser.add_argument("-d", "--dial", default="visible=.999,.97,.9,.7,.5,.25,.1,.05,.02,.01,.001,.0001")
    options = parser.parse_args()
    if options.seeds < 2:
        parser.error("--seeds: expected at least 2")
    options.folder.mkdir(parents=True, exist_ok=True)
    dial, values = options.dial.split("=")
    print(f"| scene | Cycles at | spp | CPU s | worst block | Lull, {options.criterion} | spp | CPU s | worst block |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    for scene in options.scenes.split(","):
        seeds = [record(options.folder, scene, seed, options) for seed in range(options.seeds)]
        for line in compare(options.folder, scene, seeds, options.criterion, dial, values.split(",")):
            print(line, flush=True)


main()
