# SPDX-License-Identifier: MIT
"""The definition of one study: what is shown, how often, and what counts. DIR/study.json; its form is FORMAT.md.

A study is written once by `lull-study init` and read by everything else; nothing changes it after reading."""
from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from .files import Refused, loads, print_json, read_file, write_line

TASKS = ADJUSTMENT, TWO_INTERVAL, VALIDATION = "adjustment", "2ifc", "validation"
KINDS = "noisy", "denoised", "blend"  # what of a render with --denoise a view shows
MIN_MS = {ADJUSTMENT: 300.0, TWO_INTERVAL: 150.0, VALIDATION: 500.0}  # for new studies: the reasons are in docs/study-report.md
MAX_NAME, MAX_LINE = 95, 199  # bytes
MAX_VIEWS, MAX_BLOCKS, MAX_LEVELS, MAX_CONDITIONS = 1024, 4096, 1024, 64
MAX_TRIALS = 200000  # of one person
MAX_FRAMES = 60  # of a clip
MAX_SHOWN = 60  # frames in an interval, repeated loops counted
MAX_FPS = 120
MAX_SPP = 10**9


class Block(NamedTuple):
    id: int
    x0: int
    y0: int
    x1: int  # x1, y1 exclusive
    y1: int
    levels: list[int]  # samples per pixel, strictly rising


@dataclass
class View:
    name: str  # with a kind SCENE.KIND: no reader of thresholds takes one kind for another
    width: int
    height: int
    kind: str = ""  # two intervals only; "": the pictures as they are
    frames: int = 1  # more: clips, two intervals only
    blocks: list[Block] = field(default_factory=list)  # none in a validation

    def scene(self) -> str:
        """The name without the kind; "": it does not end in it."""
        end = "." + self.kind if self.kind else ""
        return self.name[:len(self.name) - len(end)] if self.name.endswith(end) else ""


@dataclass
class Study:
    id: str  # 32 hex digits, made at init: trials are imported into their own study only
    task: str
    seed: int  # below 2^53: the order of every person follows from it and from their number
    trials: int = 30  # two intervals: per block, catch trials included
    repeats: int = 1  # adjustment: settings per block; validation: judgements per picture
    catch_share: float = 0.1
    show_ms: int = 0
    gap_ms: int = 400
    fps: int = 0  # of clips; 0: there are none
    break_every: int = 60  # trials between offered breaks; 0: none
    min_catch_passed: float = 0.75
    max_untouched: float = 0.5
    min_ms: float = 0.0  # an answer in less time is left out
    max_fast: float = 1.0  # a person of whose answers a larger share is does not count
    asked_by: str = ""  # empty in old studies, as is contact
    contact: str = ""
    views: list[View] = field(default_factory=list)
    conditions: list[str] = field(default_factory=list)  # validation; each view has a picture of each

    def shown_frames(self) -> int:
        """How many frames of a clip an interval shows, those of repeated loops counted; 0 without clips."""
        return math.ceil(self.show_ms * self.fps / 1000.0 - 1e-9)


def is_plain_name(name: Any) -> bool:
    """What may stand in a file name or an address."""
    return isinstance(name, str) and re.fullmatch(rf"[A-Za-z0-9_-][A-Za-z0-9._-]{{0,{MAX_NAME - 1}}}", name) is not None


def is_plain_line(text: Any) -> bool:
    return (isinstance(text, str) and len(text.encode()) <= MAX_LINE and text.strip(" ") != "" and
            re.search("[\0-\x1f\x7f]", text) is None)


def fit_intervals(study: Study) -> None:
    """Fills in show_ms and fps where they are 0: 700 ms of stills, two loops of clips at 24 frames a second."""
    longest = max((view.frames for view in study.views), default=1)
    if longest == 1:
        if study.fps:
            raise Refused("--fps does nothing: no view is a clip")
        study.show_ms = study.show_ms or 700
        return
    study.fps = study.fps or 24
    study.show_ms = study.show_ms or -(-2 * longest * 1000 // study.fps)
    shown = study.shown_frames()
    if not longest <= shown <= MAX_SHOWN:
        raise Refused(f"{study.show_ms} ms are {shown} frames at {study.fps} a second, wanted {longest} (one loop) to "
                      f"{MAX_SHOWN}: change --show")


# --- reading ---

def is_number(value: Any, lo: float, hi: float, whole: bool = True) -> bool:
    return (isinstance(value, (int, float)) and not isinstance(value, bool) and lo <= value <= hi and
            (not whole or value == math.floor(value)))


class _Reader:
    """Members of JSON objects; what is wrong is said with the file's name."""

    def __init__(self, path: str) -> None:
        self.path = path

    def fail(self, text: str) -> Refused:
        return Refused(f"{self.path}: {text}")

    def number(self, o: Any, name: str, lo: float, hi: float, whole: bool = True) -> Any:
        value: Any = o.get(name) if isinstance(o, dict) else None
        if not is_number(value, lo, hi, whole):
            raise self.fail(f"'{name}' must be a {'whole ' if whole else ''}number in {lo:g} … {hi:g}")
        return int(value) if whole else float(value)

    def name(self, value: Any) -> str:
        if not is_plain_name(value):
            raise self.fail(f"a name must be 1 … {MAX_NAME} letters, digits, '.', '_' or '-'")
        return value

    def list(self, o: Any, name: str, most: int) -> list[Any]:
        value = o.get(name) if isinstance(o, dict) else None
        if not isinstance(value, list) or not 1 <= len(value) <= most:
            raise self.fail(f"'{name}' must be a list of 1 … {most}")
        return value

    def block(self, o: Any, view: View) -> Block:
        levels = self.list(o, "levels", MAX_LEVELS)
        at = [self.number(o, name, name in ("x1", "y1"), 32768) for name in ("id", "x0", "y0", "x1", "y1")]
        block = Block._make([*at, [int(n) if is_number(n, 1, MAX_SPP) else 0 for n in levels]])
        if block.x1 <= block.x0 or block.y1 <= block.y0 or block.x1 > view.width or block.y1 > view.height:
            raise self.fail(f"block {block.id} does not lie inside {view.name}")
        if any(b <= a for a, b in zip([0, *block.levels], block.levels)):
            raise self.fail(f"levels of block {block.id} must be rising whole numbers from 1")
        return block

    def view(self, o: Any, task: str) -> View:
        o = o if isinstance(o, dict) else {}
        view = View(self.name(o.get("name")), self.number(o, "width", 1, 32768), self.number(o, "height", 1, 32768))
        if "kind" in o:
            view.kind = o["kind"] if o["kind"] in KINDS else ""
            if not view.kind or task != TWO_INTERVAL or not view.scene():
                raise self.fail(f"'kind' must be noisy, denoised or blend, {view.name} end in it, and the task be 2ifc")
        if "frames" in o:
            if task != TWO_INTERVAL:
                raise self.fail(f"only two intervals show clips, as {view.name} is one")
            view.frames = self.number(o, "frames", 2, MAX_FRAMES)
        for block in [] if task == VALIDATION else self.list(o, "blocks", MAX_BLOCKS):
            view.blocks.append(self.block(block, view))
            if len(view.blocks) > 1 and view.blocks[-1].id <= view.blocks[-2].id:
                raise self.fail("ids of blocks must rise")
        return view

    def head(self, root: dict[str, Any]) -> Study:
        if root.get("format") != "lull-study":
            raise self.fail("not a study file")
        if not isinstance(root.get("id"), str) or not re.fullmatch("[0-9a-f]{32}", root["id"]):
            raise self.fail("'id' must be 32 hex digits")
        if root.get("task") not in TASKS:
            raise self.fail("'task' must be adjustment, 2ifc or validation")
        self.number(root, "version", 1, 1)
        return Study(root["id"], root["task"], self.number(root, "seed", 0, 2**53 - 1))

    def numbers(self, root: dict[str, Any], study: Study) -> None:
        for name, lo, hi, whole in (
                ("trials", 1, 1000, True), ("repeats", 1, 100, True), ("catch_share", 0, 0.5, False),
                ("show_ms", 1, 60000, True), ("gap_ms", 1, 60000, True), ("break_every", 0, 100000, True),
                ("min_catch_passed", 0, 1, False), ("max_untouched", 0, 1, False)):
            setattr(study, name, self.number(root, name, lo, hi, whole))

    def later_members(self, root: dict[str, Any], study: Study) -> None:
        """What studies made before these members existed do without."""
        for name, lo, hi, whole in (("fps", 1, MAX_FPS, True), ("min_ms", 0, 60000, False), ("max_fast", 0, 1, False)):
            if name in root:
                setattr(study, name, self.number(root, name, lo, hi, whole))
        for name in ("asked_by", "contact"):
            if name in root and not is_plain_line(root[name]):
                raise self.fail(f"'{name}' must be one line of at most {MAX_LINE} bytes")
            setattr(study, name, root.get(name, ""))


def parse(path: str, text: str | bytes) -> Study:
    read = _Reader(path)
    try:
        root = loads(text)
    except ValueError:
        root = None
    if not isinstance(root, dict):
        raise read.fail("not a JSON object")
    study = read.head(root)
    read.numbers(root, study)
    read.later_members(root, study)
    for o in read.list(root, "views", MAX_VIEWS):
        view = read.view(o, study.task)
        if any(view.name == other.name for other in study.views):
            raise read.fail(f"two views are called {view.name}")
        study.views.append(view)
    try:
        fit_intervals(study)
    except Refused as error:
        raise read.fail(str(error)) from None
    if study.task == VALIDATION:
        study.conditions = [read.name(name) for name in read.list(root, "conditions", MAX_CONDITIONS)]
    return study


def read_study(folder: str) -> Study:
    path = os.path.join(folder, "study.json")
    return parse(path, read_file(path, 1 << 26))


# --- writing ---

def _view_members(view: View, task: str) -> dict[str, Any]:
    members: dict[str, Any] = {"name": view.name, "width": view.width, "height": view.height}
    if view.kind:
        members["kind"] = view.kind
    if view.frames > 1:
        members["frames"] = view.frames
    if task != VALIDATION:
        members["blocks"] = [block._asdict() for block in view.blocks]
    return members


def members(study: Study) -> dict[str, Any]:
    """What stands in study.json."""
    names = ["id", "task", "seed", "trials", "repeats", "catch_share", "show_ms", "gap_ms", "fps", "break_every",
             "min_catch_passed", "max_untouched", "min_ms", "max_fast", "asked_by", "contact", "conditions"]
    absent = {"fps": study.fps == 0, "asked_by": not study.asked_by, "contact": not study.contact,
              "conditions": study.task != VALIDATION}
    return {"format": "lull-study", "version": 1, **{name: getattr(study, name) for name in names if not absent.get(name)},
            "views": [_view_members(view, study.task) for view in study.views]}


def write_study(folder: str, study: Study) -> None:
    write_line(os.path.join(folder, "study.json"), print_json(members(study), pretty=True))
