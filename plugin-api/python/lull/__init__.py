# SPDX-License-Identifier: MIT
"""Stops sampling each block of a path-traced image when its noise can no longer be seen: the host's side in Python.

    import lull
    criterion = lull.load("observer")                       # an installed criterion, or a path; lull.criteria() lists them
    frame = lull.Frame(criterion, 1920, 1080)          # blocks and buffers
    driver = lull.Driver(frame, render)                # render(rects, first, count, half) -> a mean per rectangle
    driver.run()
    frame.mean(), frame.spp()                          # the picture and its samples per pixel

For renderers that keep their own film: HostFrame, which is shown numpy arrays as they lie in memory (Plane). Ready hosts:
lull.blender for Blender's Cycles, lull.mitsuba for Mitsuba 3, lull.luxcore for LuxCore. Needs numpy and liblull-host.so; nothing is compiled.
"""
import importlib
import importlib.util
import os
import sys
import sysconfig

from .version import PRODUCT

NEEDED = ""  # what this Python lacks, in one line
try:
    import numpy  # noqa: F401
except ImportError:
    # Debian and others keep pip out of their own Python, which is Blender's there
    managed = sys.prefix == sys.base_prefix and os.path.exists(os.path.join(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED"))
    NEEDED = ("lull needs numpy, which this Python does not have: " +
              ("sudo apt install python3-numpy" if managed else "python3 -m pip install numpy"))
    if sys.argv[:2] == ["-m", "watch"]:  # python3 -m lull watch, the one that does without
        pass
    elif sys.argv[:1] == ["-m"]:  # a program of the package, as which Python starts it: one line for people
        print(NEEDED, file=sys.stderr)
        sys.exit(2)
    elif "bpy" not in sys.modules:  # in Blender, register() says it
        raise ImportError(NEEDED) from None

if not NEEDED:
    from .criterion import Criterion, Plane, Rect, load
    from .denoising import Denoised, denoise
    from .driver import Driver, Result
    from .frame import Frame
    from .host import Block, HostFrame
    from .library import Info, LullError, Parameter, criteria, find

__all__ = ["Block", "Criterion", "Denoised", "Driver", "Frame", "HostFrame", "Info", "LullError", "Parameter", "Plane",
           "Rect", "Result", "criteria", "denoise", "find", "load"]
__version__ = PRODUCT

# The package is a Blender add-on too: make blender packs it.
bl_info = {"name": "Lull", "author": "Lull", "version": (1, 0, 0), "blender": (3, 4, 0), "category": "Render",
           "location": "Render Properties > Lull", "support": "COMMUNITY",
           "description": "Cycles stops each block when its noise can no longer be seen"}


def __getattr__(name: str) -> object:
    """The package's modules, lull.outputs and others, when they are first asked for: hosts come without their renderers."""
    if NEEDED and name in __all__:
        raise ImportError(NEEDED)
    if name.startswith("_") or importlib.util.find_spec(f"{__name__}.{name}") is None:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return importlib.import_module(f"{__name__}.{name}")


def register() -> None:
    """Blender switches the add-on on."""
    if NEEDED:
        from .blender import needed
        needed.register(NEEDED)
    else:
        from .blender import ui
        ui.register()


def unregister() -> None:
    """Blender switches the add-on off."""
    if NEEDED:
        from .blender import needed
        needed.unregister()
    else:
        from .blender import ui
        ui.unregister()
