# SPDX-License-Identifier: MIT
"""The command line: python3 -m lull.blender FILE.blend [options], which runs Blender in the background, or the module bpy if
that can be imported; the same options after `--` when Blender was started by hand."""
from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path
from typing import Optional, Sequence


# As Blender names them
DEVICES = ("CPU", "CUDA", "OPTIX", "HIP", "ONEAPI", "METAL")


def parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser("python3 -m lull.blender", description="Render a Blender scene with Cycles, block by "
                                "block, each until its noise can no longer be seen.")
    p.add_argument("file", nargs="?", help="the .blend file (inside Blender: default the open one)")
    p.add_argument("-c", "--criterion", default="observer", help="name or PATH[:ID] of a criterion (default observer)")
    p.add_argument("-p", "--param", action="append", default=[], metavar="KEY=VALUE", help="parameter of the criterion")
    p.add_argument("--visible", metavar="SHARE", help="stop when at most this share of viewers would still see noise")
    p.add_argument("--spp-min", type=int, default=16, metavar="N", help="samples before the first check (default 16)")
    p.add_argument("--spp-max", type=int, default=4096, metavar="N", help="most samples of a block (default 4096)")
    p.add_argument("--time-budget", type=float, default=0, metavar="SECONDS", help="per frame; 0 = no limit (default)")
    p.add_argument("--block", type=int, metavar="N", help="block size in pixels (default: the criterion's own, else 200, "
                   "less where that would be fewer than 12 blocks)")
    p.add_argument("--mask", default="", metavar="FILE.png", help="lighter regions are rendered better")
    p.add_argument("--frames", metavar="FIRST-LAST", help="an animation; 'all' = the scene's range (default: current frame)")
    p.add_argument("--device", choices=DEVICES, help="what Cycles renders on (default: what the scene says)")
    p.add_argument("--scene", metavar="NAME", help="which scene of the file (default: the active one)")
    p.add_argument("-o", "--output", default="", metavar="FILE.exr", help="picture with layers for samples and noise "
                   "(default: the .blend's name in the current folder, if nothing else is asked for)")
    p.add_argument("--preview", default="", metavar="FILE.png", help="as it is shown (curve per channel)")
    p.add_argument("--stop-map", default="", metavar="FILE.png|FILE.csv", help="samples per block")
    p.add_argument("--report", default="", metavar="FILE.json", help="everything about the run")
    p.add_argument("--checkpoint", default="", metavar="FILE.npz", help="keep the state there at the end, however it ends")
    p.add_argument("--resume", action="store_true", help="go on from the checkpoint, if it is there; with a higher --spp-max "
                   "a finished picture gets more samples")
    p.add_argument("-q", "--quiet", action="store_true", help="no progress")
    p.add_argument("--blender", default="blender", metavar="PROGRAM", help="which Blender to run (default: on PATH)")
    return p


def launch(argv: Optional[Sequence[str]] = None) -> int:
    """From a plain Python: with bpy if it can be imported, else by starting Blender."""
    argv = list(sys.argv[1:] if argv is None else argv)
    options = parser().parse_args(argv)
    if not options.file or not os.path.isfile(options.file):
        print(f"lull: {options.file or 'FILE.blend'}: no such file", file=sys.stderr)
        return 2
    try:
        import bpy  # noqa: F401
    except ImportError:
        program = shutil.which(options.blender)
        if not program:
            print(f"lull: no program '{options.blender}': install Blender or name it with --blender", file=sys.stderr)
            return 2
        package = str(Path(__file__).resolve().parents[2])
        code = f"import sys; sys.path.insert(0, {package!r}); from lull.blender import cli; sys.exit(cli.main())"
        sys.stdout.flush()
        os.execv(program, [program, "-b", "--factory-startup", "-noaudio", "--python-exit-code", "2", "--python-expr", code,
                           "--", *argv])
    return main(argv)


def _frames(text: Optional[str], scene) -> list[Optional[int]]:
    if not text:
        return [None]
    if text == "all":
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    first, _, last = text.partition("-")
    try:
        frames: list[Optional[int]] = list(range(int(first), int(last or first) + 1))
    except ValueError:
        frames = []
    if not frames:
        raise ValueError(f"--frames {text}: expected FIRST-LAST or all")
    return frames


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Inside Blender (options after `--`) or with bpy. Exit status: 0 done, 1 interrupted or failed, 2 bad input."""
    from ..library import LullError
    from .cycles import HostError
    if argv is None:
        argv = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    options = parser().parse_args(argv)
    try:
        return _render(options)
    except (HostError, LullError, ValueError, OSError, RuntimeError) as error:
        print(f"lull: {error}", file=sys.stderr)
        return 2


def _render(options: argparse.Namespace) -> int:
    import bpy

    from ..criterion import load
    from ..outputs import Progress
    from .cycles import choose_device
    from .session import Session, Settings, numbered
    if options.file:
        bpy.ops.wm.open_mainfile(filepath=os.path.abspath(options.file))
    if options.scene and options.scene not in bpy.data.scenes:
        raise ValueError(f"--scene {options.scene}: the file has {', '.join(bpy.data.scenes.keys())}")
    scene = bpy.data.scenes[options.scene] if options.scene else bpy.context.scene
    if options.device:
        choose_device(options.device)
        scene.cycles.device = "CPU" if options.device == "CPU" else "GPU"
    if options.resume and not options.checkpoint:
        raise ValueError("--resume needs --checkpoint FILE.npz")
    bad = [pair for pair in options.param if "=" not in pair]
    if bad:
        raise ValueError(f"--param {bad[0]}: expected KEY=VALUE")
    parameters = dict(pair.split("=", 1) for pair in options.param)
    if options.visible is not None:
        parameters["visible"] = options.visible
    output = options.output
    if not (output or options.preview or options.stop_map or options.report):
        output = Path(options.file or bpy.data.filepath or "untitled").stem + ".exr"
    settings = Settings(options.criterion, parameters, options.spp_min, options.spp_max, options.time_budget, options.block,
                        mask=options.mask, output=output, preview=options.preview, stop_map=options.stop_map,
                        report=options.report)
    with load(settings.criterion, **parameters) as criterion:
        for frame in _frames(options.frames, scene):
            if frame is not None:
                scene.frame_set(frame)
            progress = None if options.quiet else Progress()
            with Session(scene, settings, criterion, progress.show if progress else None) as session:
                suffix = "" if frame is None else f"_{frame:04}"
                result = session.run(options.checkpoint and numbered(options.checkpoint, suffix), options.resume)
                written = session.write(result, suffix)
            if progress:
                progress.clear()
            print("lull:", summary(session), "; ".join(written))
            if session.unsaved:
                raise session.unsaved
            if result.exception:
                print(f"lull: rendering failed, what was rendered is kept: {result.exception}", file=sys.stderr)
            if result.outcome in ("interrupt", "failed"):
                return 1
    return 0


def summary(session) -> str:
    """One line about a finished frame."""
    blocks = session.frame.blocks
    converged = sum(b.reason == "criterion" for b in blocks)
    counts = sorted(b.spp for b in blocks)
    mean = session.driver.totals.samples / session.frame.view.pixels
    return f"{converged} of {len(blocks)} blocks converged, {counts[0]}..{counts[-1]} spp, mean {mean:.0f}"
