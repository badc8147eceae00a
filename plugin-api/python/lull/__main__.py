# SPDX-License-Identifier: MIT
"""python3 -m lull: what it finds, one line each. Exit status 2 without the library or any criterion. python3 -m lull watch:
watch.py; python3 -m lull plot: plot/main.py; python3 -m lull replay: replay.py."""
import importlib.util
import os
import shutil
import sys
from pathlib import Path

from .program import run

if sys.argv[1:2] == ["watch"]:
    from .watch import main as watch
    sys.exit(run("lull watch", lambda: watch(sys.argv[2:])))
if sys.argv[1:2] == ["plot"]:
    from .plot.main import main as plot
    sys.exit(plot(sys.argv[2:]))
if sys.argv[1:2] == ["replay"]:
    from .replay import main as replay
    sys.exit(replay(sys.argv[2:]))

from . import __version__, abi, criteria  # noqa: E402 (needs numpy)
from .criterion import load  # noqa: E402
from .library import LullError, call, library  # noqa: E402


def _trial(spec: str, denoiser: str) -> str:
    """Whether an instance can be made; what the line `denoiser` says is not said twice."""
    try:
        load(spec, log=lambda *_: None).close()
    except LullError as error:
        return "not ready: see denoiser" if denoiser in str(error) else f"not ready: {error}"
    return "ready"


def _denoiser() -> str:
    try:
        call("host_denoiser", None)
    except LullError as error:
        return str(error)
    return os.environ.get("LULL_OIDN") or "Open Image Denoise, where the system has it"


def main() -> int:
    """Prints the lines; the exit status."""
    print(f"lull        {__version__}, Python {sys.version.split()[0]}")
    try:
        print(f"library     {library()._name}")
    except LullError as error:
        print(f"library     {error}")
        return 2
    found, denoiser = criteria(), _denoiser()
    for info in found:
        ready = _trial(f"{info.path}:{info.id}", denoiser)
        print(f"criterion   {info.id:<12}{info.version:<5}{ready}  ({info.path})")
    places = (".", "../../share/lull", "../../../share/lull", "../../../ggn/models")
    folders = {(Path(info.path).parent / at).resolve() for info in found for at in places}
    for path in sorted(path for folder in folders for path in folder.glob("*.ggn")):
        print(f"model       {path}")
    print(f"denoiser    {denoiser}")
    for module in ("mitsuba", "pyluxcore", "bpy"):
        print(f"{module:<12}{'found' if importlib.util.find_spec(module) else 'none'}")
    print(f"blender     {shutil.which('blender') or 'none'}")
    return 0 if found else 2


sys.exit(run("lull", main))
