# SPDX-License-Identifier: MIT
"""Blender, headless: renders with Cycles what it is told line by line, and answers with processor seconds (scripts/lab peers).

    build/hosts/bpy/bin/python3 scripts/hosts/peer_cycles.py         or         blender -b --factory-startup --python …

A line of standard input is a JSON object: "file" and "out"; "seed"; "spp", the most samples; "threshold", of adaptive sampling (left
out: uniform); "denoise", with Blender's own Open Image Denoise. With "host", a list of options, the scene is rendered by lull.blender
instead. The answer is a line that begins with PEER: seconds (user and system, of this process and those it waited for) of the render,
from the scene as it is opened to the written file, or what went wrong.
"""
import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "plugin-api" / "python"))
import bpy  # noqa: E402

from lull.blender import cli  # noqa: E402


def cpu_s():
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


def equal_terms(scene, seed):
    """What both renderers do: one thread, a box filter of a pixel, nothing clamped or blurred, all caustics."""
    render, cycles = scene.render, scene.cycles
    render.engine, render.threads_mode, render.threads = "CYCLES", "FIXED", 1
    cycles.device, cycles.seed, cycles.use_animated_seed = "CPU", seed, False
    cycles.pixel_filter_type, cycles.blur_glossy = "BOX", 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    settings = render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR", "32", "NONE"


def own(scene, told):
    """By Cycles alone."""
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling = told["spp"], "threshold" in told
    if "threshold" in told:
        cycles.adaptive_threshold, cycles.adaptive_min_samples = told["threshold"], 0
    cycles.use_denoising = bool(told.get("denoise"))
    if cycles.use_denoising:
        cycles.denoiser, cycles.denoising_input_passes = "OPENIMAGEDENOISE", "RGB_ALBEDO_NORMAL"
    scene.render.filepath, scene.render.use_file_extension = told["out"], False
    bpy.ops.render.render(write_still=True)


def answer(told):
    """Seconds of what was told."""
    bpy.ops.wm.open_mainfile(filepath=told["file"])
    scene = bpy.context.scene
    equal_terms(scene, told["seed"])
    if "host" not in told:
        start = cpu_s()
        own(scene, told)
        return cpu_s() - start
    scene.cycles.samples = told["spp"]
    start = cpu_s()
    if cli.main([*told["host"], "-q", "-o", told["out"]]) != 0:
        raise RuntimeError("lull.blender failed")
    return cpu_s() - start


for line in sys.stdin:
    try:
        reply = {"s": answer(json.loads(line))}
    except Exception as why:  # whatever Blender raises is told to who asked
        reply = {"error": f"{type(why).__name__}: {why}"}
    print("\nPEER " + json.dumps(reply), flush=True)
