# SPDX-License-Identifier: MIT
"""Recorded frames (plugin-api/sequence/FORMAT.md, version 2): blocks at rising sample counts, as a criterion is shown them.

    from lull import recording
    looks = [recording.Look(spp, {"color": mean, "half": half, "moment2": moment2}) for ... in my_renders]    # rising in spp
    recording.write("data/chess", looks, scene="chess", block=200)
    frame = recording.read("data/chess")
    frame.planes(block=3, spp=64)["color"]            # [height, width, 3] float32

`lull-render --sequence DIR --planes …` writes the same, and `lull.replay` asks criteria about it.
"""
from __future__ import annotations

import json
import math
import mmap
import os
import struct
import zlib
from dataclasses import dataclass, field
from typing import Any, Iterable, Iterator, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from . import exr, limits
from .criterion import CHANNELS, Rect
from .files import LUMINANCE, replaced
from .library import encoded

MAGIC, FILE_HEADER, RECORD_HEADER, PLANE_HEADER, STAT = b"LULLSEQ1", 64, 64, 16, 32
LOOK, REFERENCE, BEYOND = 1, 2, 3  # kinds of records
NUMBERS = {name: 16 + i for i, name in enumerate((
    "color", "weight", "spp", "moment2", "half", "albedo", "normal", "depth", "dropped", "dropped_half", "rest", "denoised",
    "denoised_half", "denoised_rest"))}
NAMES = {number: name for name, number in NUMBERS.items()}
SHUFFLE, MAX_FILE, MAX_SIDE, MAX_BLOCK_SIDE = 1, 1 << 30, 1 << 15, 4096
ANSWER = ("action", "flags", "next_spp", "error", "p_noisy", "predicted_spp")  # statistics that are a criterion's answer
SHOWN = ("transfer", "gamma", "exposure", "sample_clamp")  # of `frame`: as HostFrame takes them


def _need(holds: object, what: str) -> None:
    if not holds:
        raise ValueError(what)


def channels(plane: str) -> int:
    """How many numbers a pixel of it has."""
    return 3 if plane == "rest" or plane.startswith("denoised") else CHANNELS.get(plane, 1)


def _luminance(color: np.ndarray, rgb_to_xyz: Sequence[float]) -> np.ndarray:
    """[height, width, 1], as lull_frame has it."""
    weights = rgb_to_xyz[3:6] if any(rgb_to_xyz) else LUMINANCE
    return (weights[0] * color[..., 0] + weights[1] * color[..., 1] + weights[2] * color[..., 2])[..., None]


class Answer(NamedTuple):
    """What a criterion said of a block at `spp`; NaN: it did not say. after_stop: it had stopped the block before.
    simulated: the block was made from an earlier level."""
    block: int
    spp: int
    action: int  # 1 = stop
    error: float
    p: float
    next: int
    predicted: float = math.nan
    flags: int = 0
    after_stop: bool = False
    simulated: bool = False


@dataclass
class Look:
    """Pictures of so many samples per pixel: planes by name, estimates in linear radiance, [height, width] or
    [height, width, 3], "color" among them. half_spp: samples in "half", by default the first half of them."""
    spp: int
    planes: Mapping[str, np.ndarray]
    half_spp: Optional[int] = None


@dataclass
class Record:
    """A block in a file. planes: by name, [height, width, channels]; stats: numbers that are finite."""
    kind: int
    spp: int
    half_spp: int
    block: int
    rect: Rect
    planes: Mapping[str, np.ndarray] = field(default_factory=dict)
    stats: Mapping[str, float] = field(default_factory=dict)


# --- files ------------------------------------------------------------------------------------------------------------


def _packed_plane(name: str, values: np.ndarray, rect: Rect) -> bytes:
    planar = np.ascontiguousarray(np.asarray(values, "<f4").reshape(rect.height, rect.width, -1).transpose(2, 0, 1))
    _need(planar.shape[0] == channels(name), f"plane {name} has {planar.shape[0]} channels, not {channels(name)}")
    raw = planar.view(np.uint8).reshape(-1, 4).T.tobytes()
    stored = zlib.compress(raw, 1)
    return struct.pack("<4I", NUMBERS[name], SHUFFLE, len(raw), len(stored)) + stored


def _stored(r: Record, rgb_to_xyz: Sequence[float]) -> dict[str, np.ndarray]:
    """The planes in the form of the file: of noise no digit is lost."""
    planes = {name: np.asarray(values, np.float64) for name, values in r.planes.items()}
    n, h, color = r.spp, r.half_spp, planes.get("color")
    if "moment2" in planes:
        planes["moment2"] = planes["moment2"].reshape(*color.shape[:2], 1) - _luminance(color, rgb_to_xyz) ** 2
    if "half" in planes and 0 < h < n:
        half = planes["half"]
        planes["rest"] = np.where(half == color, half, (n * color - h * half) / (n - h))
        del planes["color"]
    return planes


def pack(records: Sequence[Record], width: int, height: int, number: int, seed: int = 0,
         rgb_to_xyz: Sequence[float] = (0.0,) * 9) -> bytes:
    """The bytes of a file of one look; blocks rise."""
    head = MAGIC + struct.pack("<4I2i2IQ3I", 2, FILE_HEADER, width, height, 0, 0, number, len(records), seed, 0, 0, 0)
    parts = [head + struct.pack("<I", zlib.crc32(head))]
    for r in records:
        stats = b"".join(struct.pack("<24sd", name.encode()[:23], v) for name, v in r.stats.items() if math.isfinite(v))
        planes = _stored(r, rgb_to_xyz)
        names = sorted(planes, key=NUMBERS.__getitem__)
        payload = stats + b"".join(_packed_plane(name, planes[name], r.rect) for name in names)
        head = struct.pack("<7I", r.kind, r.spp, r.half_spp, len(stats) // STAT, len(planes), len(payload),
                           zlib.crc32(payload))
        head += struct.pack("<I4i3I", r.block, *r.rect, 0, 0, 0)
        parts += [head, struct.pack("<I", zlib.crc32(head)), payload]
    return b"".join(parts)


class _Place(NamedTuple):
    """A plane in a file."""
    path: str
    payload: int  # where that of its record begins, how long it is, its CRC
    size: int
    crc: int
    at: int  # in it
    stored: int


class _Found(NamedTuple):
    kind: int
    spp: int
    half_spp: int
    block: int
    rect: Rect
    stats: dict[str, float]
    planes: dict[str, _Place]


def _scan(path: str, width: int, height: int) -> Iterator[_Found]:
    """The records of a file, without their pixels; ValueError says what does not fit."""
    with open(encoded(path), "rb") as file:
        _need(FILE_HEADER <= os.fstat(file.fileno()).st_size <= MAX_FILE, f"{path}: not a look")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            try:
                yield from _records(path, data, width, height)
            except (struct.error, UnicodeDecodeError) as error:
                raise ValueError(f"{path}: a damaged record: {error}") from None


def _records(path: str, data: mmap.mmap, width: int, height: int) -> Iterator[_Found]:
    version, size, w, h, _, _, _, count = struct.unpack_from("<4I2i2I", data, 8)
    _need(data[:8] == MAGIC, f"{path}: not a block sequence")
    _need(version != 1, f"{path}: a block alone (version 1 of the format), expected a look at a whole frame")
    _need(version == 2 and size == FILE_HEADER, f"{path}: version {version} of the format is not known")
    _need(zlib.crc32(data[:60]) == struct.unpack_from("<I", data, 60)[0], f"{path}: the header is damaged (CRC)")
    _need((w, h) == (width, height), f"{path}: a picture of {w}x{h}, the manifest says otherwise")
    at = FILE_HEADER
    for i in range(count):
        _need(at + RECORD_HEADER <= len(data), f"{path}: truncated: {i} of {count} images")
        kind, spp, half_spp, n_stats, n_planes, size, crc, block, *rect = struct.unpack_from("<8I4i", data, at)
        own = struct.unpack_from("<I", data, at + 60)[0]
        _need(own == zlib.crc32(data[at:at + 60]), f"{path}: header of image {i} is damaged (CRC)")
        _need(LOOK <= kind <= BEYOND and spp > 0 and half_spp <= spp and STAT * n_stats <= size and n_planes <= 16,
              f"{path}: header of image {i} makes no sense")
        at += RECORD_HEADER
        _need(at + size <= len(data), f"{path}: truncated: {i} of {count} images")
        stats = {}
        for k in range(n_stats):
            name, value = struct.unpack_from("<24sd", data, at + STAT * k)
            stats[name.rstrip(b"\0").decode()] = value
        planes, used = {}, STAT * n_stats
        for _ in range(n_planes):
            number, by, raw, stored = struct.unpack_from("<4I", data, at + used)
            used += PLANE_HEADER
            if number in NAMES:
                pixels = Rect(*rect).pixels
                _need(by == SHUFFLE and raw == 4 * pixels * channels(NAMES[number]) and used + stored <= size,
                      f"{path}: image {i}: plane {number} has the wrong size or filter")
                planes[NAMES[number]] = _Place(path, at, size, crc, used, stored)
            used += stored
        _need(used == size, f"{path}: image {i}: bytes after the last plane")
        at += size
        yield _Found(kind, spp, half_spp, block, Rect(*rect), stats, planes)
    _need(at == len(data), f"{path}: bytes after the last image")


def _plane(place: _Place, name: str, rect: Rect) -> np.ndarray:
    with open(encoded(place.path), "rb") as file:
        file.seek(place.payload)
        payload = file.read(place.size)
    _need(len(payload) == place.size and zlib.crc32(payload) == place.crc, f"{place.path}: an image is damaged (CRC)")
    n = rect.pixels * channels(name)
    try:
        inflate = zlib.decompressobj()
        raw = inflate.decompress(payload[place.at:place.at + place.stored], 4 * n + 1)
    except zlib.error:
        raw = b""
    _need(len(raw) == 4 * n, f"{place.path}: plane {name} does not inflate")
    planar = np.frombuffer(raw, np.uint8).reshape(4, n).T.copy().view("<f4").reshape(-1, rect.height, rect.width)
    return np.ascontiguousarray(planar.transpose(1, 2, 0), np.float32)


# --- reading ----------------------------------------------------------------------------------------------------------


class Recording:
    """A folder that `read` has opened. Pixels stay in the files until they are asked for.

    blocks: rectangles, the index is the id. names: planes of every look. frame: what a criterion is told. criterion: who was
    asked while recording, a mapping with spec, id, version, parameters, or None. answers: what it said, in order. looks: in
    order, of each the (block, spp) that were looked at. in_step: all blocks have the same levels. finished: the render is
    whole. layers: of added planes.
    """

    def __init__(self, folder: str):
        self.folder, self.manifest = folder, _manifest(folder)
        m = self.manifest
        self.width, self.height, self.seed = m["width"], m["height"], m["seed"]
        self.blocks = [Rect(*r) for r in m["blocks"]]
        self.names, self.frame, self.criterion = tuple(m["planes"]), m["frame"], m.get("criterion")
        self.in_step, self.finished = bool(m["levels"]), "looks" in m["finished"]
        self.answers: list[Answer] = []
        self.looks: list[list[tuple[int, int]]] = []
        self.layers = sorted({f["layer"] for f in m["files"] if f["part"] == "added"})
        self._planes: dict[tuple[int, int, str, str], _Place] = {}  # by block, spp, layer, plane
        self._levels: list[dict[int, _Found]] = [{} for _ in self.blocks]
        self._references: dict[str, list[_Found]] = {}
        stopped: set[int] = set()
        for f in m["files"]:
            path = os.path.join(folder, f["file"])
            _need(os.path.getsize(encoded(path)) == f["bytes"], f"{path}: not the file that the manifest lists (size)")
            if f["part"] in ("looks", "beyond"):
                self.looks.append([])
            for r in _scan(path, self.width, self.height):
                self._take(r, f.get("layer", ""), path, stopped)

    def _take(self, r: _Found, layer: str, path: str, stopped: set[int]) -> None:
        _need(r.block < len(self.blocks) and r.rect == self.blocks[r.block],
              f"{path}: block {r.block} is {tuple(r.rect)}, the manifest says otherwise")
        if r.kind == REFERENCE:
            self._references.setdefault(path, []).append(r)
            return
        for name, place in r.planes.items():
            self._planes[r.block, r.spp, layer, name] = place
        if not layer:
            self._levels[r.block].setdefault(r.spp, r)
            self.looks[-1].append((r.block, r.spp))
        if "action" in r.stats and not layer:
            s = r.stats
            self.answers.append(Answer(
                r.block, r.spp, int(s["action"]), s.get("error", math.nan), s.get("p_noisy", math.nan),
                int(s.get("next_spp", 0)), s.get("predicted_spp", math.nan), int(s.get("flags", 0)), r.block in stopped))
            if s["action"] == 1:
                stopped.add(r.block)

    def levels(self, block: int) -> list[int]:
        """Sample counts of a block, rising."""
        return sorted(self._levels[block])

    def half_spp(self, block: int, spp: int) -> int:
        """Samples of these that are in "half"."""
        return self._levels[block][spp].half_spp

    def stats(self, block: int, spp: int) -> dict[str, float]:
        """Numbers of a block: "seconds", "dropped" and others."""
        return self._levels[block][spp].stats

    def planes(self, block: int, spp: int, names: Optional[Iterable[str]] = None, layer: str = "") -> dict[str, np.ndarray]:
        """Pixels of a block, [height, width, channels] float32, of color and moment2 perhaps float64; default all that
        were recorded. layer: of added planes."""
        if names is None:
            names = self.names if not layer else [n for b, s, of, n in self._planes if (b, s, of) == (block, spp, layer)]
        found: dict[str, np.ndarray] = {}
        for name in names:
            self._load(block, spp, name, layer, found)
        return {name: found[name] for name in names}

    def _load(self, block: int, spp: int, name: str, layer: str, found: dict[str, np.ndarray]) -> np.ndarray:
        """Puts a plane into `found`, and what it follows from."""
        if name not in found:
            place = self._planes.get((block, spp, layer, name))
            if place:
                found[name] = _plane(place, name, self.blocks[block])
            else:
                _need(name == "color" and self.has(block, spp, "rest"),
                      f"{self.folder}: block {block} at {spp} spp has no plane {name}{f' of {layer}' if layer else ''}")
                half, rest = (self._load(block, spp, part, layer, found).astype(np.float64) for part in ("half", "rest"))
                h = self.half_spp(block, spp)
                found[name] = np.where(half == rest, half, (h * half + (spp - h) * rest) / spp)
            if name == "moment2":
                color = self._load(block, spp, "color", layer, found).astype(np.float64)
                found[name] = found[name] + _luminance(color, self.frame["rgb_to_xyz"]) ** 2
        return found[name]

    def has_added(self, layer: str, number: int) -> bool:
        """Is file `number` of these planes there?"""
        return any(f["file"] == _added(layer, number) for f in self.manifest["files"])

    def has(self, block: int, spp: int, name: str, layer: str = "") -> bool:
        """Is the plane there?"""
        return (block, spp, layer, name) in self._planes

    @property
    def references(self) -> list[np.ndarray]:
        """Pictures of many other samples, [height, width, 3] float32: none, or two that are independent."""
        found = []
        for _, records in sorted(self._references.items()):
            picture = np.full((self.height, self.width, 3), np.nan, np.float32)
            for r in records:
                picture[r.rect.y0:r.rect.y1, r.rect.x0:r.rect.x1] = _plane(r.planes["color"], "color", r.rect)
            found.append(picture)
        return found

    @property
    def reference_spp(self) -> int:
        """Samples of each reference."""
        return int(self.manifest.get("reference_spp", 0))

    def settings(self) -> dict[str, Any]:
        """What HostFrame is told of the frame."""
        flags = self.frame["flags"]
        return {"layout": self.blocks, "seed": self.seed, "spp_min": self.frame["spp_min"], "spp_max": self.frame["spp_max"],
                "max_seam": self.frame["max_seam"], "independent": bool(flags & 4), "shared": bool(flags & 8),
                "deterministic": bool(flags & 2), "open_ended": bool(flags & 0x400),
                "rgb_to_xyz": tuple(self.frame["rgb_to_xyz"]),
                **{name: self.frame[name] for name in SHOWN if name != "gamma" or self.frame["transfer"] == "gamma"}}

    def add(self, layer: str, number: int, records: Sequence[Record]) -> None:
        """Adds planes to looks that are there: records of the same block and samples, with the new planes. layer: what they
        are (the denoiser with its version); number: of the file, 1 and on. An added file is never changed."""
        _need(layer and len(layer) < 64 and layer.isprintable(), f"layer {layer!r}: expected a text of 1 to 63 characters")
        for r in records:
            _need(r.spp in self._levels[r.block], f"block {r.block} has no look at {r.spp} spp")
        name = _added(layer, number)
        manifest = _manifest(self.folder)  # as it is now
        _need(all(f["file"] != name for f in manifest["files"]), f"{self.folder}: {name} is there")
        data = pack(records, self.width, self.height, number, self.seed)
        manifest["files"].append({**_put(self.folder, name, data, "added"), "layer": layer})
        _write_manifest(self.folder, manifest)
        self.manifest = manifest
        for found in _scan(os.path.join(self.folder, name), self.width, self.height):
            self._take(found, layer, name, set())
        self.layers = sorted({*self.layers, layer})


def _added(layer: str, number: int) -> str:
    return f"added-{zlib.crc32(layer.encode()):08x}-{number:05d}.lseq"


def read(folder: str) -> Recording:
    """Opens a recorded frame; ValueError and OSError, one line, say what is wrong with it."""
    return Recording(folder)


def _manifest(folder: str) -> dict[str, Any]:
    path = os.path.join(folder, "manifest.json")
    try:
        with open(encoded(path), encoding="utf-8") as file:
            m = json.load(file)
    except (ValueError, RecursionError):
        raise ValueError(f"{path}: not the manifest of a sequence") from None
    _need(isinstance(m, dict) and m.get("format") == "lull-sequence", f"{path}: not the manifest of a sequence")
    _need(m.get("version") != 1,
          f"{path}: blocks alone (version 1 of the format), expected looks at a whole frame (version 2)")
    _need(m.get("version") == 2, f"{path}: this version of the format is not known")
    try:
        for holds, what in _claims(m):
            _need(holds, f"{path}: {what}")
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: not the manifest of a whole frame: {error}") from None
    return m


def _whole(value: object, low: int, high: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def _claims(m: dict[str, Any]) -> Iterator[tuple[object, str]]:
    """What must hold of a manifest, and what is said if it does not."""
    yield _whole(m["width"], 1, MAX_SIDE) and _whole(m["height"], 1, MAX_SIDE), "width or height is missing or out of range"
    yield isinstance(m["levels"], list) and isinstance(m["finished"], list), "levels or finished is no list"
    yield _whole(m["seed"], 0, (1 << 64) - 1), "the seed is out of range"
    yield "color" in m["planes"] and all(p in NUMBERS for p in m["planes"]), "no list of planes, color among them"
    for k, r in enumerate(m["blocks"]):
        yield (len(r) == 4 and all(_whole(v, 0, MAX_SIDE) for v in r) and r[0] < r[2] <= m["width"] and
               r[1] < r[3] <= m["height"]), f"block {k} is no rectangle of the picture"
    f = m["frame"]
    numbers = *f["rgb_to_xyz"], f["gamma"], f["exposure"], f["sample_clamp"], f["max_seam"]
    yield (_whole(f["flags"], 0, 1 << 32) and _whole(f["spp_min"], 1, 1 << 31) and
           _whole(f["spp_max"], f["spp_min"], 1 << 31) and len(numbers) == 13 and all(map(math.isfinite, numbers)) and
           f["transfer"] in ("srgb", "linear", "gamma")), "frame is missing or has a number out of range"
    for k, e in enumerate(m["files"]):
        yield (isinstance(e["file"], str) and e["file"] and os.path.basename(e["file"]) == e["file"] and
               e["part"] in ("looks", "beyond", "reference", "added") and _whole(e["bytes"], 1, MAX_FILE) and
               (e["part"] != "added" or isinstance(e["layer"], str))), f"entry {k} of files is not usable"


# --- writing ----------------------------------------------------------------------------------------------------------


def _put(folder: str, name: str, data: bytes, part: str) -> dict[str, Any]:
    _need(len(data) <= MAX_FILE, f"{name}: a look of more than 1 GiB")
    with replaced(os.path.join(folder, name)) as file:
        file.write(data)
    return {"file": name, "part": part, "bytes": len(data), "crc32": f"{zlib.crc32(data):08x}"}


def _write_manifest(folder: str, manifest: dict[str, Any]) -> None:
    with replaced(os.path.join(folder, "manifest.json")) as file:
        file.write((json.dumps(manifest, indent=1) + "\n").encode())


def _checked(look: Look, shape: tuple[int, ...], names: set[str]) -> dict[str, np.ndarray]:
    found = {}
    _need(set(look.planes) == names, f"{look.spp} spp: planes {sorted(look.planes)}, the first look has {sorted(names)}")
    for name, values in look.planes.items():
        _need(name in NUMBERS, f"plane {name!r}: expected one of {', '.join(NUMBERS)}")
        array = np.asarray(limits.unmasked(f"plane {name}", values))
        n = channels(name)
        _need(array.shape[:2] == shape[:2] and array.ndim in (2, 3) and (1 if array.ndim == 2 else array.shape[2]) >= n,
              f"{look.spp} spp: plane {name} of shape {array.shape}, expected [{shape[0]}, {shape[1]}, {n}]")
        found[name] = array.reshape(*shape[:2], -1)[..., :n].astype(np.float64)
    return found


def write(folder: str, looks: Sequence[Look], *, scene: str, block: int = 200, camera: str = "", source: str = "",
          renderer: str = "lull for Python", seed: int = 0, references: Sequence[np.ndarray] = (), reference_spp: int = 0,
          exposure: float = 1.0, transfer: str = "srgb", gamma: float = 2.2, sample_clamp: float = 0.0,
          independent: bool = False, shared: bool = False) -> None:
    """Writes whole pictures at rising sample counts as a recorded frame, all blocks in step, into `folder`, which is made
    and must hold no recording. references: none, or two pictures of reference_spp samples that are independent of the looks
    and of each other. The rest as HostFrame takes it. TypeError, ValueError and OSError, one line, the first two before
    anything is written."""
    for name, text in (("scene", scene), ("camera", camera), ("source", source), ("renderer", renderer)):
        _need(isinstance(text, str) and text == text.encode(errors="replace").decode(), f"{name} {text!r}: expected text")
    _need(scene != "", "the scene has no name")
    _need(len(looks) > 0 and "color" in looks[0].planes, "no looks with a plane color")
    _need(len(references) in (0, 2), f"{len(references)} references: expected none or two")
    _need(transfer in ("srgb", "linear", "gamma"), f"transfer {transfer!r}: expected srgb, linear or gamma")
    block, seed = limits.checked("block", block), limits.checked("seed", seed)
    spps = [limits.checked("spp", look.spp) for look in looks]
    _need(all(a < b for a, b in zip(spps, spps[1:])), f"samples {spps}: expected rising ones")
    shape = np.shape(looks[0].planes["color"])
    _need(len(shape) == 3 and 0 < min(shape[:2]) and max(shape[:2]) <= MAX_SIDE, f"a picture of shape {shape}")
    names = sorted(looks[0].planes, key=lambda name: NUMBERS.get(name, 0))
    pictures = [_checked(look, shape, set(names)) for look in looks]
    more = [_checked(Look(limits.checked("spp", reference_spp), {"color": r}), shape, {"color"}) for r in references]
    halves = [0 if "half" not in names else look.spp // 2 if look.half_spp is None else look.half_spp for look in looks]
    _need(all(0 <= h <= n for h, n in zip(halves, spps)), f"samples in half {halves}: expected at most {spps}")
    shown = {"flags": 2 | 4 * limits.flag("independent", independent) | 8 * limits.flag("shared", shared), "transfer": transfer,
             "gamma": limits.checked("gamma", gamma), "exposure": limits.checked("exposure", exposure),
             "sample_clamp": limits.checked("sample_clamp", sample_clamp), "rgb_to_xyz": [0.0] * 9, "max_seam": 0,
             "spp_min": spps[0], "spp_max": spps[-1]}
    os.makedirs(encoded(folder), exist_ok=True)
    _need(not os.path.exists(encoded(os.path.join(folder, "manifest.json"))), f"{folder}: it holds a recording")
    height, width = shape[:2]
    rects = [Rect(x, y, min(x + block, width), min(y + block, height))
             for y in range(0, height, block) for x in range(0, width, block)]

    def put(name: str, number: int, kind: int, spp: int, half_spp: int, planes: Mapping[str, np.ndarray]) -> dict[str, Any]:
        records = [Record(kind, spp, half_spp, k, r, {n: p[r.y0:r.y1, r.x0:r.x1] for n, p in planes.items()})
                   for k, r in enumerate(rects)]
        return _put(folder, name, pack(records, width, height, number, seed), "looks" if kind == LOOK else "reference")
    files = [put(f"look-{i:05d}.lseq", i, LOOK, spp, half, planes)
             for i, (spp, half, planes) in enumerate(zip(spps, halves, pictures), 1)]
    files += [put(f"reference-{i}.lseq", i, REFERENCE, reference_spp, 0, planes) for i, planes in enumerate(more, 1)]
    _write_manifest(folder, {
        "format": "lull-sequence", "version": 2, "scene": scene, "source": source, "camera": camera, "renderer": renderer,
        "width": width, "height": height, "seed": seed, "reference_seed": seed,
        "reference_spp": reference_spp if references else 0, "levels": spps, "planes": names, "frame": shown,
        "blocks": rects, "finished": ["looks", *(["reference"] if references else [])], "files": files})


_LETTERS = {3: ("RGB", "XYZ", "rgb", "xyz"), 1: ("V", "Y", "Z", "R", "X")}


def _layer(found: Mapping[str, np.ndarray], layer: str, count: int) -> Optional[np.ndarray]:
    """[height, width, count] of a layer of an EXR file, whatever letters its channels have."""
    for letters in _LETTERS[count]:
        names = [f"{layer}.{c}" if layer else c for c in letters]
        if all(name in found for name in names):
            return np.stack([found[name] for name in names], -1)
    return found[layer][..., None] if count == 1 and layer in found else None


def from_exr(path: str, spp: int, layers: Optional[Mapping[str, str]] = None, half_spp: Optional[int] = None) -> Look:
    """A renderer's EXR file of so many samples as a look. layers: plane to layer, "" being the picture itself; by default that
    is "color", and layers called half, moment2, albedo, normal and depth are what their names say, where they are there."""
    found, _ = exr.read(path)
    given = {"color": "", **{name: name for name in CHANNELS if name != "color"}} if layers is None else layers
    planes = {}
    for name, layer in given.items():
        _need(name in NUMBERS, f"plane {name!r}: expected one of {', '.join(NUMBERS)}")
        array = _layer(found, layer, channels(name))
        if array is not None:
            planes[name] = array
        else:
            _need(layers is None and name != "color", f"{path}: no layer {layer or 'of the picture itself'} for {name}")
    return Look(spp, planes, half_spp)
