# SPDX-License-Identifier: MIT
"""The command line: python3 -m lull.blender FILE.blend [options], which runs Blender in the background, or the module bpy if
that can be imported; the same options after `--` when Blender was started by hand."""
from __future__ import annotations

import argparse
import os
import re
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, Optional, Sequence

from .. import NEEDED

if NEEDED:  # this is a program: one line, no traceback
    print(NEEDED, file=sys.stderr, flush=True)
    sys.exit(2)

from .. import denoising, quote
from ..criterion import Criterion, load
from ..driver import Result
from ..library import encoded
from ..outputs import Progress
from ..program import INTERRUPTED, run
from ..stopping import Stopping

if TYPE_CHECKING:  # launch() does without bpy
    import bpy

    from .session import Session, Settings

# As Blender names them
DEVICES = ("CPU", "CUDA", "OPTIX", "HIP", "ONEAPI", "METAL")
LAST_FRAME = 1048574  # of Blender


class _Parser(argparse.ArgumentParser):
    def parse_args(self, args: Sequence[str]) -> argparse.Namespace:  # type: ignore[override]
        return super().parse_args(["--denoise=blend" if a == "--denoise" else a for a in args])  # and not the next word

    def error(self, message: str) -> NoReturn:
        print(f"lull: {message} (--help says more)", file=sys.stderr)
        sys.exit(2)


def _whole(text: str) -> int:
    """As the programs in C take it: digits, no blanks, no underscores."""
    if not re.fullmatch(r"[+-]?[0-9]+", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(text)


def _real(text: str) -> float:
    """A decimal number without blanks or underscores."""
    if not re.fullmatch(r"[+-]?([0-9]+[.]?|[0-9]*[.][0-9]+)([eE][+-]?[0-9]+)?", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number")
    return float(text)


def parser() -> argparse.ArgumentParser:
    """Of the options, with their help."""
    p = _Parser("python3 -m lull.blender", description="Render a Blender scene with Cycles, block by "
                                "block, each until its noise can no longer be seen.")
    p.add_argument("file", nargs="?", help="the .blend file (inside Blender: default the open one)")
    p.add_argument("-c", "--criterion", default="", help="name or PATH[:ID] of a criterion (default observer; with "
                   "--denoise denoised)")
    p.add_argument("-p", "--param", action="append", default=[], metavar="KEY=VALUE", help="parameter of the criterion")
    p.add_argument("--visible", metavar="SHARE", help="stop when at most this share of viewers would still see noise")
    p.add_argument("--error", metavar="TIMES", help="stop when the error is at most so many times what is just seen, e.g. 4 for a "
                   "draft, 2 for a good picture; instead of --visible")
    p.add_argument("--denoise", default="", choices=denoising.KINDS, metavar="[=blend|full]", help="keep the denoised "
                   "picture, and stop blocks by what is seen of it: blend (default) keeps as much of the noisy one as the "
                   "denoiser is wrong, full none; needs Open Image Denoise 2")
    p.add_argument("--spp-min", type=_whole, default=16, metavar="N", help="samples before the first check (default 16)")
    p.add_argument("--spp-max", type=_whole, metavar="N", help="most samples of a block (default: the scene's Max Samples)")
    p.add_argument("--time-budget", type=_real, metavar="SECONDS", help="per frame; 0 = no limit (default: the scene's Time "
                   "Limit)")
    p.add_argument("--block", type=_whole, metavar="N", help="block size in pixels (default: the criterion's own, else 200, "
                   "less where that would be fewer than 12 blocks)")
    p.add_argument("--mask", default="", metavar="FILE.png", help="lighter regions are rendered better")
    p.add_argument("--frames", metavar="FIRST-LAST", help="an animation; 'all' = the scene's range (default: current frame)")
    p.add_argument("--device", choices=DEVICES, help="what Cycles renders on (default: what the scene says)")
    p.add_argument("--scene", metavar="NAME", help="which scene of the file (default: the active one)")
    p.add_argument("--view-layer", default="", metavar="NAME", help="which view layer of the scene (default: the first that is "
                   "used)")
    p.add_argument("-o", "--output", default="", metavar="FILE.exr", help="picture with layers for samples and noise "
                   "(default, if nothing else is asked for: where the scene's output path says, else the .blend's name in "
                   "the current folder)")
    p.add_argument("--preview", default="", metavar="FILE.png", help="as it is shown (curve per channel)")
    p.add_argument("--stop-map", default="", metavar="FILE.png|FILE.csv", help="samples per block")
    p.add_argument("--report", default="", metavar="FILE.json", help="everything about the run")
    p.add_argument("--html", default="", metavar="FILE.html", help="the same as a page for people, with the picture")
    p.add_argument("--display-server", default="", metavar="HOST[:PORT]", help="show the picture in an image viewer while it "
                   "is made: tev or HDRView (port 14158)")
    p.add_argument("--checkpoint", default="", metavar="FILE", help="keep the state there now and then, and when the "
                   "render ends or is interrupted")
    p.add_argument("--checkpoint-every", type=_real, default=60, metavar="SECONDS", help="how often (default 60)")
    p.add_argument("--resume", action="store_true", help="go on from the checkpoint, if it is there; with a higher "
                   "--spp-max a finished picture gets more samples")
    p.add_argument("--quote", action="store_true", help="render a pilot of 128 samples or 30 seconds, print what the "
                   "quality parameter will cost at its own and at other settings, and end; a render can go on from its "
                   "--checkpoint")
    p.add_argument("-q", "--quiet", action="store_true", help="no progress and no notes")
    p.add_argument("--blender", default="blender", metavar="PROGRAM", help="which Blender to run (default: on PATH)")
    return p


def launch() -> int:
    """From a plain Python: with bpy if it can be imported, else by starting Blender."""
    return run("lull", lambda: _launch(sys.argv[1:]))


def _launch(argv: list[str]) -> int:
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
        folder = str(Path(__file__).resolve().parents[2])  # last: what else lies there is of another Python
        code = f"import sys; sys.path.append({folder!r}); from lull.blender import cli; sys.exit(cli.main())"
        sys.stdout.flush()
        os.execv(program, [program, "-b", "--factory-startup", "-noaudio", "--python-exit-code", "2", "--python-expr", code,
                           "--", *argv])
    return _main(argv)


def _frames(text: Optional[str], scene: bpy.types.Scene) -> list[Optional[int]]:
    if not text:
        return [None]
    if text == "all":
        return list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    ends = re.fullmatch(r"(-?[0-9]+)(?:-(-?[0-9]+))?", text)
    first, last = (int(ends[1]), int(ends[2] or ends[1])) if ends else (0, -1)
    if not -LAST_FRAME <= first <= last <= LAST_FRAME:  # for others frame_set() takes the last one that there is
        raise ValueError(f"--frames {text}: expected FIRST-LAST, from {-LAST_FRAME} to {LAST_FRAME}, or all")
    return list(range(first, last + 1))


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Inside Blender (options after `--`) or with bpy. Exit status: 0 done, 1 rendering failed, 2 bad input or an output
    could not be written, 130 interrupted, 141 nobody reads its output."""
    if argv is None:
        argv = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    return run("lull", lambda: _main(argv))


def _main(argv: Sequence[str]) -> int:
    from .session import REFUSED
    options = parser().parse_args(argv)
    try:
        with Stopping() as stopping:
            return _render(options, stopping)
    except REFUSED as error:
        print(f"lull: {error}", file=sys.stderr)
        return 2


def _scene(options: argparse.Namespace) -> bpy.types.Scene:
    """The scene that the options name, opened and set as they say."""
    import bpy

    from . import engine
    from .cycles import choose_device
    engine.register()  # a file may name it
    if options.file:
        bpy.ops.wm.open_mainfile(filepath=encoded(os.path.abspath(options.file)).decode("utf-8", "surrogateescape"))
    if options.scene and options.scene not in bpy.data.scenes:
        raise ValueError(f"--scene {options.scene}: the file has {', '.join(bpy.data.scenes.keys())}")
    scene = bpy.data.scenes[options.scene] if options.scene else bpy.context.scene
    if options.device:
        choose_device(options.device)
        scene.cycles.device = "CPU" if options.device == "CPU" else "GPU"
    return scene


def _settings(options: argparse.Namespace, scene: bpy.types.Scene, frame: Optional[int]) -> Settings:
    """Of one frame."""
    import bpy

    from .session import Settings, default_output
    bad = [pair for pair in options.param if "=" not in pair]
    if bad:
        raise ValueError(f"--param {bad[0]}: expected KEY=VALUE")
    parameters = dict(pair.split("=", 1) for pair in options.param)
    if options.visible is not None:
        parameters["visible"] = options.visible
    if options.error is not None:
        parameters["error"] = options.error
    settings = Settings(options.criterion, parameters, options.spp_min, options.spp_max, options.time_budget, options.block,
                        mask=options.mask, output=options.output, preview=options.preview, stop_map=options.stop_map,
                        report=options.report, page=options.html, checkpoint=options.checkpoint,
                        display_server=options.display_server, denoise=options.denoise,
                        view_layer=options.view_layer).numbered(frame)
    if not (options.quote or settings.output or settings.preview or settings.stop_map or settings.report or settings.page):
        stem = Path(options.file or bpy.data.filepath or "untitled").stem
        settings.output = default_output(scene, frame, f"{stem}.exr")
    return settings


def _render(options: argparse.Namespace, stopping: Stopping) -> int:
    from .session import check_files
    if options.resume and not options.checkpoint:
        raise ValueError("--resume needs --checkpoint FILE")
    if not options.checkpoint_every >= 0:
        raise ValueError(f"--checkpoint-every {options.checkpoint_every}: expected a number from 0")
    scene = _scene(options)
    frames = [(frame, _settings(options, scene, frame)) for frame in _frames(options.frames, scene)]
    status, costs = 0, []
    with load(frames[0][1].criterion, **frames[0][1].parameters) as criterion:
        check_files([settings for _, settings in frames], criterion)
        for frame, settings in frames:
            if frame is not None:
                scene.frame_set(frame)
            status = max(status, _render_frame(options, scene, settings, criterion, stopping, costs))
            if status in (1, INTERRUPTED) or stopping.asked:
                return INTERRUPTED if stopping.asked and status in (0, INTERRUPTED) else status
    if options.quote and len(frames) > 1:
        unknown = f"{len(frames)} frames: the criterion cannot tell what they cost"
        print(quote.shot(list(enumerate(costs)), len(frames)) or unknown, flush=True)
    return status


def _render_frame(options: argparse.Namespace, scene: bpy.types.Scene, settings: Settings, criterion: Criterion,
                  stopping: Stopping, costs: list[Optional[quote.Row]]) -> int:
    """The exit status of one frame. costs: gets what a quote tells."""
    from .session import Session
    progress = None if options.quiet else Progress()

    def note(text: str) -> None:
        if progress:
            progress.clear()
            print(f"lull: {text}", file=sys.stderr, flush=True)

    with Session(scene, settings, criterion, progress.show if progress else None) as session:
        stopping.then = session.driver.interrupt
        session.begin(options.resume, options.checkpoint_every)
        if stopping.asked:
            session.driver.interrupt()
        for text in session.notes:
            note(text)
        quoted = warned = False
        while (result := session.step()) is None and not (options.quote and quote.pilot_done(session.driver)):
            if session.quote and not quoted and not options.quote:
                quoted = True
                note(session.quote)
            if session.unsaved and not warned:
                warned = True
                note(f"{session.unsaved}; the render goes on")
        if options.quote or result is None:
            return _print_quote(session, result, progress, costs)
        written, failed = session.write(result)
    if progress:
        progress.clear()
    print("lull:", session.summary(), "; ".join(written))
    return _end(session, result, failed)


def _print_quote(session: Session, result: Optional[Result], progress: Optional[Progress],
                costs: list[Optional[quote.Row]]) -> int:
    if progress:
        progress.clear()
    if result is not None and result.outcome in ("interrupt", "failed"):
        return _end(session, result, [])
    costs.append(quote.chosen(session.driver))
    print(quote.table(session.driver), flush=True)
    if session.keeper:
        session.keeper.save(session.driver)
    return _end(session, result, [])


def _end(session: Session, result: Optional[Result], failed: Sequence[str]) -> int:
    """Says what went wrong; the exit status."""
    for text in [*failed, *([str(session.unsaved)] if session.unsaved else [])]:
        print(f"lull: {text}", file=sys.stderr)
    if result is not None and result.exception:
        print(f"lull: rendering failed, what was rendered is kept: {result.exception}", file=sys.stderr)
        return 1
    if failed or session.unsaved:
        return 2
    return INTERRUPTED if result is not None and result.outcome == "interrupt" else 0
