# SPDX-License-Identifier: MIT
"""All that is taken from matplotlib, with the settings that it comes with: a picture of the same figures is the same whatever the
environment or a file matplotlibrc says. Nothing else imports matplotlib."""
from __future__ import annotations

import contextlib
import os
from typing import Iterator


@contextlib.contextmanager
def _as_it_comes() -> Iterator[None]:
    """matplotlib reads settings when it is imported: in the working folder first, then the file that MATPLOTLIBRC names, which is
    an empty one here. Of MPLBACKEND it refuses a name that it does not know."""
    before, here = dict(os.environ), os.open(".", os.O_RDONLY)
    os.environ.pop("MPLBACKEND", None)
    os.environ["MATPLOTLIBRC"] = os.devnull
    os.chdir(os.path.dirname(os.devnull))
    try:
        yield
    finally:
        os.fchdir(here)
        os.close(here)
        for name in ("MPLBACKEND", "MATPLOTLIBRC"):
            os.environ.pop(name, None)
            os.environ.update({name: before[name]} if name in before else {})


with _as_it_comes():
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

__all__ = ["Axes", "Figure", "FigureCanvasAgg", "FixedLocator", "FuncFormatter", "LogNorm", "MaxNLocator", "NullLocator", "ScalarMappable"]
