# SPDX-License-Identifier: MIT
"""ggn-judge: what ggn starts for the commands that are written in Python. Arguments: ggn itself, "ggn NAME", that command's own."""
from __future__ import annotations

import importlib
import sys

from ..program import run
from ..study.options import parse

NAMES = ("evaluate", "cost", "compare", "label")


def main() -> int:
    """The exit status: 0 done, 1 out of memory, 2 bad usage, bad input, or an output could not be written, 130 interrupted."""
    program, name, *words = sys.argv[1:] if len(sys.argv) > 2 else ("", "")
    part = name.partition(" ")[2]
    if part not in NAMES:
        print("ggn-judge: ggn starts it", file=sys.stderr)
        return 2

    def work() -> None:
        command = importlib.import_module(f".{part}", __package__)
        arguments, options = parse(command.COMMAND, words)
        command.run(program, arguments, options)

    return run(name, work)
