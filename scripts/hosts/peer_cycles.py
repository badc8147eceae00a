# SPDX-License-Identifier: MIT
"""Blender, headless: renders with Cycles what each line requests, and responds with its seconds (scripts/lab peers, artists).

    build/hosts/bpy/bin/python3 scripts/hosts/peer_cycles.py         or         blender -b --factory-startup --python …

A line of standard input is a JSON object: "file" and "out"; "seed"; "spp", the most samples; "threshold", of adaptive sampling (left
out: uniform); "time_limit", in seconds; "denoise", with Blender's own Open Image Denoise. With "host", a list of options, the scene is
rendered by lull.blender instead. The answer is a line that begins with PEER: seconds of the render, from the scene as it is opened to the
written file, "s" of the processor (user and system, of this process and those it waited for), "wall_s" of the clock; or what went wrong.
"""
import json
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin-api" / "python"))
import bpy  # noqa: E402

from lull.blender import cli  # noqa: E402


class Watch:
    """Seconds since it was made."""

    def __init__(self):
        self.start = self.now()

    @staticmethod
    def now():
        t = os.times()
        return t.user + t.system + t.children_user + t.children_system, time.monotonic()

    def read(self):
        spent, wall = (b - a for a, b in zip(self.start, self.now()))
        return {"s": spent, "wall_s": wall}


def equal_terms(scene, seed):
    """What both renderers do: a box filter of a pixel, nothing clamped or blurred, all caustics; and one thread, where Blender holds
    to it (the module bpy 5.0.1 takes all)."""
    render, cycles = scene.render, scene.cycles
    render.engine, render.threads_mode, render.threads = "CYCLES", "FIXED", 1
    cycles.device, cycles.seed, cycles.use_animated_seed = "CPU", seed, False
    cycles.pixel_filter_type, cycles.blur_glossy = "BOX", 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "NONE"


def own(scene, request):
    """By Cycles alone."""
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling = request["spp"], "threshold" in request
    if "threshold" in request:
        cycles.adaptive_threshold, cycles.adaptive_min_samples = request["threshold"], 0
    cycles.time_limit = request.get("time_limit", 0)
    cycles.use_denoising = bool(request.get("denoise"))
    if cycles.use_denoising:
        cycles.denoiser, cycles.denoising_input_passes = "OPENIMAGEDENOISE", "RGB_ALBEDO_NORMAL"
    scene.render.filepath, scene.render.use_file_extension = request["out"], False
    bpy.ops.render.render(write_still=True)


def respond(request):
    """What one request took."""
    bpy.ops.wm.open_mainfile(filepath=request["file"])
    scene = bpy.context.scene
    equal_terms(scene, request["seed"])
    if "host" not in request:
        watch = Watch()
        own(scene, request)
        return watch.read()
    scene.cycles.samples = request["spp"]
    watch = Watch()
    if cli.main([*request["host"], "-q", "-o", request["out"]]) != 0:
        raise RuntimeError("lull.blender failed")
    return watch.read()


for line in sys.stdin:
    try:
        reply = respond(json.loads(line))
    except Exception as why:  # whatever Blender raises goes into the response
        reply = {"error": f"{type(why).__name__}: {why}"}
    print("\nPEER " + json.dumps(reply), flush=True)
