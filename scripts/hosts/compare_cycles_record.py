# SPDX-License-Identifier: MIT
"""Blender, headless: everything that scripts/hosts/compare_cycles.py compares about one scene, as arrays.

    blender -b FILE.blend --python scripts/hosts/compare_cycles_record.py -- OUT.npz WIDTHxHEIGHT BLOCK SPP REFERENCE_SPP

A reference with another seed; Cycles' adaptive sampling at three noise thresholds; the same samples by blocks in waves of 16, with
the processor seconds of each call.
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
from lull.blocks import grid  # noqa: E402

THRESHOLDS = (0.1, 0.05, 0.01)
WAVE = 16

out, size, block, spp, reference_spp = sys.argv[sys.argv.index("--") + 1:]
width, height = (int(v) for v in size.split("x"))
block, spp, reference_spp = int(block), int(spp), int(reference_spp)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
picture = Rect(0, 0, width, height)
found = {"block": block, "wave": WAVE, "thresholds": THRESHOLDS}


def adaptive(threshold):
    """Cycles' own: picture, processor seconds."""
    render, cycles = scene.render, scene.cycles
    path = os.path.join(os.path.dirname(os.path.abspath(out)), "adaptive.exr")
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "NONE"
    cycles.use_adaptive_sampling, cycles.adaptive_threshold, cycles.adaptive_min_samples = True, threshold, 0
    cycles.samples, cycles.use_denoising, cycles.sample_offset = spp, False, 0
    render.filepath, render.use_file_extension, render.use_border = path, False, False
    start = time.process_time()
    bpy.ops.render.render(write_still=True)
    seconds = time.process_time() - start
    pixels, _ = exr.read(path)
    os.unlink(path)
    return pixels, seconds


for k, threshold in enumerate(THRESHOLDS):
    found[f"adaptive-{k}"], found[f"adaptive-s-{k}"] = adaptive(threshold)
with Cycles(scene, spp) as host:
    start = time.process_time()
    found["whole"] = next(iter(host.render([picture], 0, spp, False)))
    found["whole-s"] = time.process_time() - start
    rects = [b.rect for b in grid(width, height, block, block)]
    sums = np.zeros((spp // WAVE, height, width, 3), np.float32)
    seconds = np.zeros((spp // WAVE, len(rects)))
    for n in range(spp // WAVE):
        for i, r in enumerate(rects):
            start = time.process_time()
            sums[n, r.y0:r.y1, r.x0:r.x1] = next(iter(host.render([r], WAVE * n, WAVE, False)))
            seconds[n, i] = time.process_time() - start
    found["waves"], found["wave-s"] = sums, seconds
    scene.cycles.seed += 1
    found["reference"] = next(iter(host.render([picture], 0, reference_spp, False)))
np.savez(out, **found)
