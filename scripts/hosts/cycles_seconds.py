# SPDX-License-Identifier: MIT
"""Blender, headless: renders the open file with Cycles on the processor and prints the processor seconds that it took.

    blender -b FILE.blend --python scripts/hosts/cycles_seconds.py -- SPP THREADS DEPTH OUT.png
"""
import sys
import time

import bpy

spp, threads, depth, out = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
render, cycles = scene.render, scene.cycles
render.engine, render.threads_mode, render.threads, render.filepath = "CYCLES", "FIXED", int(threads), out
cycles.device, cycles.samples = "CPU", int(spp)
cycles.use_adaptive_sampling = cycles.use_denoising = False
cycles.max_bounces = cycles.diffuse_bounces = int(depth)
cycles.caustics_reflective = cycles.caustics_refractive = False
start = time.process_time()
bpy.ops.render.render(write_still=True)
print("CYCLES_CPU_SECONDS %.4f" % (time.process_time() - start))
