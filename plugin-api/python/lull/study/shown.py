# SPDX-License-Identifier: MIT
"""The pictures that people are shown: chooses blocks and levels, and writes every picture as a lossless PNG, vVIEW/NAME.png, of a block
bID-WHAT.png.

A view is a folder. With a manifest.json it is a recorded sequence: its levels, and where a block has independent halves also simulated
ones up to CAP. Without one it holds pictures of one size: `reference.png` (or any extension that is read), and for thresholds one picture
per level whose name ends in its samples per pixel (`view-00256.png`), for a validation one picture per condition, named like it. Renders
with --denoise give a view of each kind that is asked for. Folders of frames in the place of pictures, reference/0001.exr …,
256/0001.exr …, are a clip: the frames of a block lie below each other in one picture, which is fetched and decoded whole."""
from __future__ import annotations

import math
import os
import re
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Callable, NamedTuple, Optional, Sequence

import numpy as np

from .. import sequence
from ..files import read_shown, srgb, write_png
from ..library import LullError
from .definition import (MAX_BLOCKS, MAX_CONDITIONS, MAX_FRAMES, MAX_LEVELS, MAX_NAME, MAX_VIEWS, TWO_INTERVAL, VALIDATION, Block, Study,
                         View, is_plain_name)
from .files import Refused, is_inside, make_folder

CAP = 10000  # spp; the most that people are shown, where their thresholds are censored
MAX_ROWS = 16384  # of the picture of a clip: browsers take so many
LIST = r"[0-9]+(-[0-9]+)?(,[0-9]+(-[0-9]+)?)*"


class Source(NamedTuple):
    """Where a view comes from, and what of it is shown."""
    folder: str
    blocks: Optional[list[tuple[int, int]]]  # ranges; None: all
    out: str  # the folder of its pictures
    options: dict[str, Any]

    def chosen(self, blocks: Sequence[Block]) -> list[Block]:
        """Those of the source, by their ids."""
        if self.blocks is None:
            return sorted(blocks)
        found = [b for b in sorted(blocks) if any(lo <= b.id <= hi for lo, hi in self.blocks)]
        ids = {b.id for b in found}
        for end in (end for ends in self.blocks for end in ends):
            if end not in ids:
                raise Refused(f"{self.folder}: has no block {end}")
        return found

    def takes(self, levels: Sequence[int], spp: float) -> bool:
        """Whether a level of so many samples is taken after those that a block has."""
        o = self.options
        return (o["spp_min"] <= spp <= o["spp_max"] and len(levels) < MAX_LEVELS and
                (not levels or (spp > levels[-1] and math.log2(spp / levels[-1]) >= 0.999 * o["spacing"])))

    def need_levels(self, block: Block) -> None:
        if len(block.levels) < 3:
            raise Refused(f"{self.folder}: block {block.id} has {len(block.levels)} levels to show; record more, or halves, or widen "
                          "--spp-min and --spp-max")

    def write(self, block: Optional[Block], what: Any, rgb: np.ndarray) -> None:
        """A picture, of the whole view where there is no block; beside the reference, with which others are compared, comes what
        catch trials show."""
        name = f"b{block.id}-" if block else ""
        write_png(os.path.join(self.out, f"{name}{what}.png"), rgb)
        if what == "reference":
            write_png(os.path.join(self.out, f"{name}heavy.png"), _heavy(rgb))


def _heavy(rgb: np.ndarray) -> np.ndarray:
    """Noise that nobody misses: uniform, up to 48 codes either way. A linear congruence does for noise that is only looked at
    (Numerical Recipes): each pass takes all of the states so far as many steps further."""
    step, add, state = 1664525, 1013904223, np.empty(rgb.size, np.uint32)
    state[0], n = (step + add) % 2**32, 1
    while n < rgb.size:
        more = min(n, rgb.size - n)
        state[n:n + more] = state[:more] * np.uint32(step) + np.uint32(add)
        step, add, n = step * step % 2**32, (step + 1) * add % 2**32, n + more
    noise = ((state >> np.uint32(16)) % np.uint32(97)).astype(np.int16) - 48
    return np.clip(rgb + noise.reshape(rgb.shape), 0, 255).astype(np.uint8)


# --- recorded sequences -----------------------------------------------------------------------------------------------

def simulated_levels() -> list[int]:
    """20, 23, … each 1.15 times the one before, and the cap."""
    found, at = [], 20.0
    while at <= CAP:
        found.append(int(at + 0.5))
        at *= 1.15
    return [*found, CAP]


def stimuli(block: sequence.Block, is_independent: bool) -> tuple[np.ndarray, list[int], Callable[[int], np.ndarray]]:
    """The converged picture [3, height, width], the sample counts that can be shown, and what makes the picture of one of them:

    - the recorded levels;
    - beyond the last level (up to a tenth of an octave is not worth simulating), or without a reference all of 20, 23, … CAP:
      levels made from the two halves, the converged picture + √(n0 / n) times the half-buffer difference at n0 samples.

    A reference of n_r independent samples has noise of its own: I_n - R has the variance s² (1/n + 1/n_r), not s²/n. Scaled by
    √(n_r / (n_r + n)) that linear difference has the variance that I_n has against a perfect reference. Without linear data, or
    when the reference is not independent, pictures are taken as they are."""
    reference, full = block.reference, next((r for r in block.levels if sequence.HALF_F16 in r.planes), None)
    best = reference or full
    if best is None:
        raise Refused(f"block {block.id} has neither a reference nor a full level with a half-buffer difference")
    recorded = {r.spp: r for r in block.levels} if reference else {}
    is_scaled = reference is not None and is_independent and sequence.MEAN_F16 in reference.planes
    beyond = 1.07 * max(recorded, default=0)
    more = [n for n in simulated_levels() if n > beyond] if full and (is_scaled or not reference) else []
    base = sequence.mean(block, best)
    difference, spp0 = (sequence.half(block, full), full.spp) if more and full else (base, 0)

    def make(spp: int) -> np.ndarray:
        if spp not in recorded:
            return srgb(base + np.float32(math.sqrt(spp0 / spp)) * difference)
        record = recorded[spp]
        if not is_scaled or not {sequence.MEAN_F16, sequence.FINE} & set(record.planes):
            return sequence.display(block, record)
        return srgb(base + np.float32(math.sqrt(best.spp / (best.spp + spp))) * (sequence.mean(block, record) - base))

    return sequence.display(block, best) if reference else srgb(base), [*recorded, *more], make


def _show_sequence(source: Source, view: View) -> None:
    manifest = sequence.read_manifest(source.folder)
    entries = {entry["id"]: entry for entry in manifest["blocks"]}
    if not 1 <= len(entries) <= MAX_BLOCKS:
        raise Refused(f"{source.folder}: {len(entries)} finished blocks, wanted 1 … {MAX_BLOCKS}")
    view.width, view.height = manifest["width"], manifest["height"]
    view.blocks = source.chosen([Block(id, *(e[name] for name in ("x0", "y0", "x1", "y1")), []) for id, e in entries.items()])

    def show(block: Block) -> None:
        recorded = sequence.read_block(source.folder, manifest, entries[block.id])
        converged, counts, make = stimuli(recorded, manifest.get("reference_independent") is not False)
        source.write(block, "reference", converged.transpose(1, 2, 0))
        for spp in counts:
            if source.takes(block.levels, spp):
                source.write(block, spp, make(spp).transpose(1, 2, 0))
                block.levels.append(spp)
        source.need_levels(block)

    with ThreadPoolExecutor() as pool:
        for _ in pool.map(show, view.blocks):  # the first that fails is told
            pass


# --- folders of pictures ----------------------------------------------------------------------------------------------

class Picture(NamedTuple):
    number: float  # the digits at the end of the stem: samples per pixel, or which frame; -1 without any
    name: bytes  # the file's, or of a clip the folder's
    stem: str  # without its extension
    is_clip: bool


def _list(folder: str) -> list[Picture]:
    """By their numbers, then their names."""
    found = []
    with os.scandir(folder) as entries:
        for entry in entries:
            is_clip = entry.is_dir()
            stem = entry.name if is_clip else entry.name.rpartition(".")[0]
            if stem and not entry.name.startswith(".") and len(os.fsencode(stem)) <= MAX_NAME:
                digits = stem[len(stem.rstrip("0123456789")):]
                found.append(Picture(float(digits or -1), os.fsencode(entry.name), stem, is_clip))
    return sorted(found)


class Strip(NamedTuple):
    """A still, or the frames of a clip."""
    numbers: list[float]
    frames: list[np.ndarray]


def _read(path: str, view: View, kind: str) -> np.ndarray:
    """A picture, or what a render with --denoise shows as this kind. The first that is read gives the view its size."""
    try:
        rgb = read_shown(path, kind if kind in ("noisy", "denoised") else "", "lull.weight.V" if kind == "blend" else "")
    except (ValueError, OSError) as error:
        raise Refused(f"{error} (--kinds shows renders with --denoise)" if kind else str(error)) from None
    height, width, _ = rgb.shape
    if view.width and (width, height) != (view.width, view.height):
        raise Refused(f"{path}: {width}x{height} pixels, the reference has {view.width}x{view.height}")
    view.width, view.height = width, height
    return rgb


def _check_frames(folder: str, frames: Sequence[Picture], reference: Optional[Strip]) -> None:
    """Frames must follow each other evenly, and be those of the reference (None: this is it)."""
    if not 2 <= len(frames) <= MAX_FRAMES:
        raise Refused(f"{folder}: {len(frames)} frames, wanted 2 … {MAX_FRAMES}")
    for frame in frames:
        if frame.is_clip or frame.number < 0:
            raise Refused(f"{folder}/{os.fsdecode(frame.name)}: not a picture whose name ends in the number of its frame")
    numbers = [frame.number for frame in frames]
    if reference is None:
        for a, b in zip(numbers, numbers[1:]):
            if b - a != numbers[1] - numbers[0] or b <= a:
                raise Refused(f"{folder}: frames are missing between {a:.0f} and {b:.0f}, or one is there twice")
        return
    for i, wanted in enumerate(reference.numbers):
        if i >= len(numbers) or numbers[i] != wanted:
            raise Refused(f"{folder}: no frame {wanted:.0f}, which the reference has")
    if len(numbers) > len(reference.numbers):
        raise Refused(f"{folder}: frame {numbers[len(reference.numbers)]:.0f}, which the reference does not have")


def _read_strip(folder: str, picture: Picture, view: View, kind: str, reference: Optional[Strip]) -> Strip:
    frames = [picture]
    if picture.is_clip:
        folder = os.path.join(folder, os.fsdecode(picture.name))
        frames = _list(folder)
        _check_frames(folder, frames, reference)
    return Strip([f.number for f in frames], [_read(os.path.join(folder, os.fsdecode(f.name)), view, kind) for f in frames])


def _cut(source: Source, view: View) -> list[Block]:
    size, width, height = source.options["block"], view.width, view.height
    columns, rows = -(-width // size), -(-height // size)
    if columns * rows > MAX_BLOCKS:
        raise Refused(f"{view.name}: {columns * rows} blocks of {size} pixels; --block makes them larger")
    if view.frames > 1 and view.frames * min(size, height) > MAX_ROWS:
        raise Refused(f"{view.name}: {view.frames} frames of blocks of {size} pixels, wanted at most {MAX_ROWS} rows in all; --block "
                      "makes them smaller")
    return source.chosen([Block(y * columns + x, size * x, size * y, min(size * (x + 1), width), min(size * (y + 1), height), [])
                          for y in range(rows) for x in range(columns)])


def _write_crops(source: Source, view: View, what: Any, strip: Strip) -> None:
    """The picture cut into blocks, if the view has any, frames below each other."""
    if not view.blocks:
        source.write(None, what, strip.frames[0])
    for b in view.blocks:
        source.write(b, what, np.concatenate([frame[b.y0:b.y1, b.x0:b.x1] for frame in strip.frames]))


def _know_condition(study: Study, source: Source, name: str) -> None:
    """The first view says which conditions there are, the others must have the same."""
    if not is_plain_name(name):
        raise Refused(f"{source.folder}/{name}: name pictures with letters, digits, '.', '_' and '-'")
    if name in study.conditions:
        return
    if len(study.views) > 1 or len(study.conditions) == MAX_CONDITIONS:
        raise Refused(f"{source.folder}: '{name}' is not a picture that every view has, or there are too many")
    study.conditions.append(name)


def _show_pictures(source: Source, view: View, study: Study) -> None:
    """Of a validation whole pictures, of each condition; else blocks, of each level."""
    pictures, is_whole = _list(source.folder), study.task == VALIDATION
    at = next((p for p in pictures if p.stem == "reference"), None)
    if at is None:
        raise Refused(f"{source.folder}: neither manifest.json nor a picture called reference in it")
    reference = _read_strip(source.folder, at, view, "", None)
    view.frames = len(reference.frames)
    if view.frames > 1 and study.task != TWO_INTERVAL:
        raise Refused(f"{source.folder}: clips are shown in two intervals: --task thresholds --method 2ifc")
    view.blocks = [] if is_whole else _cut(source, view)
    _write_crops(source, view, "reference", reference)
    found = 0
    for p in pictures:
        if is_whole and (p.stem in ("reference", "heavy") or p.is_clip):
            continue
        if not is_whole and (p.number < 1 or p.is_clip != (view.frames > 1) or not source.takes(view.blocks[0].levels, p.number)):
            continue
        if is_whole:
            _know_condition(study, source, p.stem)
        strip = _read_strip(source.folder, p, view, view.kind, reference)
        _write_crops(source, view, p.stem if is_whole else int(p.number), strip)
        for block in view.blocks:
            block.levels.append(int(p.number))
        found += 1
    if not is_whole:
        source.need_levels(view.blocks[0])
    elif not found or found != len(study.conditions):
        raise Refused(f"{source.folder}: {found} pictures beside the reference, wanted the same in every view")


# --- views ------------------------------------------------------------------------------------------------------------

def _show_view(text: str, kind: str, folder: str, study: Study, options: dict[str, Any]) -> None:
    at, colon, blocks = text.rpartition(":")
    has_blocks = colon != "" and re.fullmatch(LIST, blocks, re.ASCII) is not None
    of = at if has_blocks else text
    of = of.rstrip("/") or of[:1]
    ranges = [(int(part.partition("-")[0]), int(part.rpartition("-")[2])) for part in blocks.split(",")] if has_blocks else None
    view = View(os.path.basename(of) + (f".{kind}" if kind else ""), 0, 0, kind)
    if not is_plain_name(view.name) or view.name in [other.name for other in study.views]:
        raise Refused(f"{of}: a view's folder needs a name of its own of letters, digits, '.', '_' and '-'")
    reference = os.path.join(of, "reference.png")
    if is_inside(reference, folder):
        raise Refused(f"{reference}: lies among the pictures that the study shows")
    source = Source(of, ranges, os.path.join(folder, f"v{len(study.views)}"), options)
    study.views.append(view)
    make_folder(source.out)
    if study.task == VALIDATION and ranges:
        raise Refused(f"{text}: a validation shows whole pictures, not blocks")
    if not os.path.exists(os.path.join(of, "manifest.json")):
        return _show_pictures(source, view, study)
    if study.task == VALIDATION:
        raise Refused(f"{of}: a validation takes folders of pictures; `ggn reconstruct` makes them from a sequence")
    if kind:
        raise Refused(f"{of}: a sequence has no denoised pictures; --kinds takes folders of renders with --denoise")
    return _show_sequence(source, view)


def show(study: Study, views: Sequence[str], kinds: Sequence[str], folder: str, options: dict[str, Any]) -> None:
    """Adds views and conditions to the study, and writes their pictures into folders v0, v1, … of `folder`. views: FOLDER, or
    FOLDER:BLOCKS with blocks like 0,3,8-11: what follows the last colon, if it looks like a list. options: block, spacing, spp_min
    and spp_max, where they are given."""
    options = {"block": 200, "spacing": 0.15, "spp_min": 1, "spp_max": 1000000, **options}
    if len(views) * len(kinds) > MAX_VIEWS:
        raise Refused(f"at most {MAX_VIEWS} views, each kind counted")
    make_folder(folder)
    try:
        for text in views:
            for kind in kinds:
                _show_view(text, kind, folder, study, options)
    except (ValueError, LullError) as error:  # of files that are read; there is no host library
        raise Refused(str(error)) from None
