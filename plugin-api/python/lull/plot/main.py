# SPDX-License-Identifier: MIT
"""The command lull-plot."""
from __future__ import annotations

import os
import sys
from typing import Any, Optional, Sequence

from ..program import Refused, run
from ..study.files import check_output
from ..study.options import Command, Option, parse, word
from .sources import Wanted, read

NAMES = ("curves", "roc", "scatter", "histogram", "maps", "scores", "frontier")
COMMAND = Command(
    "lull-plot", "FILE -o PICTURE.png", 1, 1,
    "Draws the numbers that ggn writes: learning curves, ROC curves, thresholds, what accuracy costs.",
    (Option("output", "PICTURE.png", "the picture (needed)", letter="o"),
     Option("kind", "|".join(NAMES), "which picture (the first that FILE is good for)", word(*NAMES), "k"),
     Option("split", "NAME", "of ggn evaluate: which scenes (test, or the first there is)", letter="s"),
     Option("method", "NAME", "of ggn evaluate: whose decisions (the last one's; roc: everybody's)", letter="m")),
    "FILE is FILE.ggn.csv of a training (curves), blocks.csv of ggn compare (scatter, histogram, maps),\n"
    "figures.json of ggn evaluate (roc, scatter, histogram, maps, scores), its stops\n"
    "(scatter, histogram), or what ggn cost wrote (frontier).")


def _draw(path: str, out: str, options: dict[str, Any]) -> None:
    source = read(path)
    kind = options.get("kind", source.kinds()[0])
    if kind not in source.kinds():
        raise Refused(f"--kind {kind}: {path} is good for {', '.join(source.kinds())}")
    from .charts import save  # only now: matplotlib takes its time
    from .kinds import KINDS
    try:
        figure = KINDS[kind](source, Wanted(options.get("split", ""), options.get("method", "")))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise Refused(f"{path}: its figures are not whole ({type(error).__name__}: {error})") from None
    save(figure, out)


def _run(arguments: Sequence[str]) -> None:
    words, options = parse(COMMAND, arguments)
    if "output" not in options:
        raise Refused("--output PICTURE.png is needed (--help says more)")
    out = options["output"]
    if not out.lower().endswith(".png") or os.path.basename(out).lower() == ".png":
        raise Refused(f"--output {out}: expected a name that ends in .png")
    if os.path.exists(words[0]) and os.path.realpath(words[0]) == check_output(out):
        raise Refused(f"--output {out}: this is an input")
    _draw(words[0], out, options)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """The exit status: 0 done, 1 out of memory, 2 bad usage, bad input, or the picture could not be written."""
    words = sys.argv[1:] if arguments is None else arguments
    return run("lull-plot", lambda: _run(words), "apt-get install python3-matplotlib, or pip install 'lull[plot]'")
