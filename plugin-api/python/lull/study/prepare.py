# SPDX-License-Identifier: MIT
"""Makes a study: every picture that is shown (shown.py), then texts.json and study.json, which is written last. What was made is
gone unless all went well."""
from __future__ import annotations

import contextlib
import math
import os
import secrets
import shutil
from typing import Any, Iterator

from .definition import (ADJUSTMENT, KINDS, MAX_FPS, MAX_LINE, MAX_TRIALS, MIN_MS, TWO_INTERVAL, VALIDATION, Study, fit_intervals,
                         is_plain_line, write_study)
from .files import Refused, make_folder, read_file, write_line
from .options import Option, integer, real, text_shown, word
from .people import MIN_TRIALS
from .plan import plan_count, plan_minutes

MIN_SHOW_MS = 50  # three pictures of a screen of 60 Hz; in less an interval may never be seen
def _kinds(text: str) -> str:
    kinds = text.split(",")
    if len(set(kinds)) < len(kinds) or not set(kinds) <= set(KINDS):
        raise ValueError(f"expected some of {','.join(KINDS)}, each once")
    return text


OPTIONS = (
    Option("task", "thresholds|validation", "what people are asked (required)", word("thresholds", "validation")),
    Option("method", "adjustment|2ifc", "how thresholds are measured (adjustment)", word(ADJUSTMENT, TWO_INTERVAL)),
    Option("views", "FOLDER[:BLOCKS]",
           "a recorded sequence, or a folder of pictures; more may follow. BLOCKS: only these, e.g. 0,3,8-11", many=True),
    Option("kinds", "LIST",
           "2ifc: of pictures rendered with --denoise, what is shown: some of noisy,denoised,blend, a view of each", _kinds),
    Option("asked-by", "NAME", "who asks, as the page says it (required)", text_shown),
    Option("contact", "ADDRESS", "whom to write to or to call, as the page says it (required)", text_shown),
    Option("trials", "N", "2ifc: trials per block, catch trials included, at least 10 (30)", integer(MIN_TRIALS, 1000)),
    Option("repeats", "N", "adjustment: settings per block (2); validation: judgements per picture (1)", integer(1, 100)),
    Option("catch", "SHARE", "2ifc, validation: share of catch trials (0.1)", real(0, 0.5)),
    Option("show", "MS", "2ifc: how long an interval is shown (700; clips: two loops)", integer(MIN_SHOW_MS, 60000)),
    Option("fps", "N", "2ifc: frames a second of clips (24)", integer(1, MAX_FPS)),
    Option("gap", "MS", "the blank between two pictures in the same place (400)", integer(1, 60000)),
    Option("break-every", "N", "offer a break after so many trials (60; 0: never)", integer(0, 100000)),
    Option("spacing", "OCTAVES", "leave out levels that are nearer than that (0.15)", real(0.01, 4)),
    Option("spp-min", "N", "leave out levels below (1)", integer(1, 10**9)),
    Option("spp-max", "N", "leave out levels above (1000000)", integer(1, 10**9)),
    Option("block", "PIXELS", "side of a block when the view is a folder of pictures (200)", integer(8, 4096)),
    Option("seed", "N", "of all orders and sides (1)", integer(0, 2**53 - 1)))


def _define(o: dict[str, Any]) -> Study:
    """Task, names and numbers of the study."""
    validation = o.get("task") == "validation"
    if "task" not in o or not o["views"]:
        raise Refused("--task and --views are needed")
    if validation and "method" in o:
        raise Refused("--method goes with --task thresholds")
    if "asked_by" not in o or "contact" not in o:
        raise Refused("--asked-by NAME and --contact ADDRESS are needed: the page tells people who asks them and whom "
                      "to write to")
    for name in ("asked_by", "contact"):
        if not is_plain_line(o[name]):
            raise Refused(f"--{name.replace('_', '-')}: expected one line of at most {MAX_LINE} bytes that is not blank")
    task = VALIDATION if validation else o.get("method", ADJUSTMENT)
    # what one task alone listens to is refused in another: a study that ignores it would not be the one that was meant
    for name in {ADJUSTMENT: ("trials", "show", "fps", "kinds", "gap", "catch"), TWO_INTERVAL: ("repeats",),
                 VALIDATION: ("trials", "show", "fps", "kinds")}[task]:
        if name in o:
            raise Refused(f"--{name} does nothing in this task ({task})")
    into = {"catch": "catch_share", "show": "show_ms", "gap": "gap_ms"}
    names = "seed", "trials", "repeats", "catch", "show", "fps", "gap", "break_every", "asked_by", "contact"
    given = {into.get(name, name): o[name] for name in names if name in o}
    return Study(**{"id": secrets.token_hex(16), "task": task, "seed": 1, "repeats": 2 if task == ADJUSTMENT else 1,
                    "min_ms": MIN_MS[task], "max_fast": 0.1, **given})


@contextlib.contextmanager
def _made(folder: str) -> Iterator[None]:
    """A folder; one that was not there before goes again with all that is in it when what follows fails."""
    was_there = os.path.lexists(folder)
    make_folder(folder)
    try:
        yield
    except BaseException:
        if not was_there:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def prepare(folder: str, page: str, o: dict[str, Any]) -> None:
    study = _define(o)
    with _made(folder):
        _fill(folder, page, study, o)
    views = len(study.views)
    print(f"{folder}: {views} view{'' if views == 1 else 's'}, {plan_count(study)} trials for each person, some "
          f"{math.ceil(plan_minutes(study))} min; `lull-study serve {folder}` opens it")


def _fill(folder: str, page: str, study: Study, o: dict[str, Any]) -> None:
    if os.path.exists(os.path.join(folder, "study.json")):
        raise Refused(f"{folder}: there is a study already")
    texts = os.path.join(folder, "texts.json")
    if os.path.exists(texts):
        raise Refused(f"{texts}: is there and would be replaced; move it away, and back after init")
    with _made(os.path.join(folder, "stimuli")):
        _show(study, os.path.join(folder, "stimuli"), o)
        write_line(texts, read_file(os.path.join(page, "texts.en.json"), 1 << 20).decode().removesuffix("\n"))
        write_study(folder, study)


def _show(study: Study, stimuli: str, o: dict[str, Any]) -> None:
    """Makes the pictures; whether people can be asked so much."""
    from .shown import show  # takes numpy
    names = "block", "spacing", "spp_min", "spp_max"
    show(study, o["views"], o.get("kinds", "").split(","), stimuli, {name: o[name] for name in names if name in o})
    fit_intervals(study)
    if plan_count(study) > MAX_TRIALS:
        raise Refused(f"more than {MAX_TRIALS} trials for one person: take fewer views, trials or repeats")
