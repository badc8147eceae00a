# SPDX-License-Identifier: MIT
"""Blender, headless: what scripts/hosts/compare_cycles.py compares about one scene and one seed, as arrays.

    blender -b FILE.blend --python scripts/hosts/compare_cycles_record.py -- OUT.npz WIDTHxHEIGHT BLOCK SPP SEED

Cycles' adaptive sampling at three noise thresholds, and the same samples by blocks in waves of 16, with the processor seconds
of each call. The two take turns, so that a machine that is busier or warmer for a while is so for both; one thread renders.
"""
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin-api" / "python"))
from lull import Rect, exr  # noqa: E402
from lull.blender.cycles import Cycles  # noqa: E402
from lull.files import replaced  # noqa: E402

THRESHOLDS = (0.1, 0.05, 0.01)
WAVE = 16


def cpu_seconds(call, *arguments):
    """What the call gave, and its processor seconds."""
    start = time.process_time()
    found = call(*arguments)
    return found, time.process_time() - start


def adaptive(scene, threshold, spp, path):
    """Cycles' own picture of the scene, [h, w, 3]."""
    render, cycles = scene.render, scene.cycles
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "NONE"
    cycles.use_adaptive_sampling, cycles.adaptive_threshold, cycles.adaptive_min_samples = True, threshold, 0
    cycles.samples, cycles.use_denoising, cycles.sample_offset = spp, False, 0
    render.filepath, render.use_file_extension, render.use_border = path, False, False
    bpy.ops.render.render(write_still=True)
    try:
        channels, _ = exr.read(path)
        return np.stack([channels[c] for c in "RGB"], -1)
    finally:
        os.unlink(path)


def by_blocks(host, rects, found, waves):
    """Some of the waves, into found."""
    for n in waves:
        for i, r in enumerate(rects):
            (picture,), found["wave-s"][n, i] = cpu_seconds(list, host.render([r], WAVE * n, WAVE, False))
            found["waves"][n, r.y0:r.y1, r.x0:r.x1] = picture["color"]


def record(scene, out, width, height, block, spp, seed):
    render = scene.render
    render.engine, render.threads_mode, render.threads, scene.cycles.seed = "CYCLES", "FIXED", 1, seed
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    rects = [Rect(x, y, min(x + block, width), min(y + block, height)) for y in range(0, height, block)
             for x in range(0, width, block)]
    count = spp // WAVE
    found = {"block": block, "wave": WAVE, "thresholds": THRESHOLDS, "wave-s": np.zeros((count, len(rects))),
             "waves": np.zeros((count, height, width, 3), np.float32)}
    turns = np.array_split(range(count), len(THRESHOLDS))
    for k, (threshold, waves) in enumerate(zip(THRESHOLDS, turns)):
        picture, seconds = cpu_seconds(adaptive, scene, threshold, spp, out + ".exr")
        found[f"adaptive-{k}"], found[f"adaptive-s-{k}"] = picture, seconds
        with Cycles(scene, spp) as host:
            by_blocks(host, rects, found, waves)
    with Cycles(scene, spp) as host:  # an eighth tells the price of a sample without blocks
        _, seconds = cpu_seconds(list, host.render([Rect(0, 0, width, height)], 0, spp // 8, False))
        found["sample-s"] = seconds / (spp // 8)
    with replaced(out) as file:
        np.savez(file, **found)


to, size, *numbers = sys.argv[sys.argv.index("--") + 1:]
record(bpy.context.scene, os.path.abspath(to), *(int(v) for v in size.split("x")), *(int(v) for v in numbers))
