# SPDX-License-Identifier: MIT
"""What the commands' options have in common: those that `ggn replay` takes, and what no output may replace."""
from __future__ import annotations

import os
from typing import Any, Optional, Sequence

from ..study.files import Refused
from ..study.options import Option, integer, real

WHERE = (Option("data", "DATA", "labelled data set: a folder of sequences (needed)", letter="d"),
         Option("observer", "FILE", "the observer's parameters, each view without itself (ggn label --calibrate); needed where "
                "there are people's views", letter="O"))
SCENES = (Option("validation", "SCENE,...", "validation scenes, over the split of the data set or the models", letter="V"),
          Option("test", "SCENE,...", "test scenes, likewise", letter="T"))
JUDGES = (Option("model", "FILE", "trained model (.ggn); may be repeated", letter="m", many=True),
          Option("baseline", "FILE", "a published baseline as ggn baseline trained it; may be repeated", many=True))
POLICY = (Option("visible", "SHARE", "share of viewers that may still see noise, for observer (0.35) and models (their own)",
                 real(1e-4, 0.9999)),
          Option("param", "KEY=NUMBER", "judge as the criterion does with this parameter: visible, passes, first-spp", letter="p",
                 many=True))
HOW = (Option("no-quality", "", "skip FLIP and SSIM at the stop"),
       Option("no-pictures", "", "judge as in a host without half buffers"),
       Option("recorded", "", "stop at the last recorded level instead of going on with the samples of the reference"),
       Option("ratio", "R", "thin the levels to this ratio of samples (SIN3D: 1.15); else keep all", real(1, 16)),
       Option("threads", "N", "worker threads (all processors)", integer(1, 1024), "t"))
THRESHOLDS = Option("thresholds", "CSV", "a published model's thresholds of people's views; may be repeated", many=True)


def forwarded(given: dict[str, Any], options: Sequence[Option]) -> list[Any]:
    """These options, as they were given, for another command line."""
    words: list[Any] = []
    for option in options:
        value = given.get(option.name.replace("-", "_"))
        for one in value if isinstance(value, list) else [] if value is None else [value]:
            words += [f"--{option.name}"] if one is True else [f"--{option.name}={one}"]
    return words


def needed(given: dict[str, Any], name: str, value: str) -> None:
    if name not in given:
        raise Refused(f"--{name} {value} is needed (--help says more)")


def protect(inputs: Sequence[str], outputs: Sequence[Optional[str]]) -> None:
    """Refuses outputs inside an input that is a folder, or onto one that is a file."""
    for out in filter(None, outputs):
        target = os.path.realpath(out)
        for path in inputs:
            if os.path.isdir(path) and os.path.commonpath([target, os.path.realpath(path)]) == os.path.realpath(path):
                raise Refused(f"{out}: this is inside its data, {path}")
            if os.path.exists(path) and os.path.exists(target) and os.path.samefile(path, target):
                raise Refused(f"{out}: this is an input ({path}), it would be overwritten")


def inputs_of(given: dict[str, Any]) -> list[str]:
    files = [f for name in ("model", "baseline", "thresholds") for f in given.get(name, [])]
    return [given["data"], *files, *([given["observer"]] if "observer" in given else [])]
