# SPDX-License-Identifier: MIT
"""Recorded block sequences (plugin-api/sequence/FORMAT.md): what `ggn label`, `ggn train` and `ggn evaluate` read.

    from lull import sequence
    levels = [sequence.Level(spp, mean, first_half) for spp, mean, first_half in my_renders]      # rising in spp
    sequence.write("data/chess", levels, scene="chess")

`ggn import` makes the same of pictures in files. Whole frames, as criteria are shown them: lull.recording.
"""
from __future__ import annotations

import functools
import json
import os
import re
import stat
import struct
import zlib
from dataclasses import dataclass, field, replace
from typing import Any, Sequence

import numpy as np

from . import limits
from .files import LUMINANCE, replaced, srgb, srgb_decoded
from .library import encoded

MAGIC, FILE_HEADER, RECORD_HEADER, PLANE_HEADER = b"LULLSEQ1", 64, 32, 16
LEVEL, REFERENCE = 1, 2
DISPLAY, FINE, HALF_LOG, MEAN_F16, HALF_F16 = 1, 2, 3, 4, 5
SHUFFLE, AVERAGE, GREEN = 1, 2, 4
MAX_RECORDS, FULL_SPP = 4096, 320
MAX_SIDE, MAX_FILE, MAX_SPP = 4096, 1 << 30, 2**31 - 1
BYTES = {DISPLAY: 3, FINE: 3, HALF_LOG: 1, MEAN_F16: 6, HALF_F16: 6}  # of a pixel


@dataclass
class Level:
    """A picture of so many samples per pixel. mean: linear light, [height, width, 3]; first_half: the mean of the first
    spp // 2 samples, likewise, or None; display: its 8-bit sRGB codes, where there is no linear light."""
    spp: int
    mean: np.ndarray | None = None
    first_half: np.ndarray | None = None
    display: np.ndarray | None = None


@dataclass
class Record:
    """A level or the reference of a block, as the file has it. planes: by number, the bytes before they are filtered."""
    kind: int
    spp: int
    half_spp: int = 0
    stats: list[tuple[str, float]] = field(default_factory=list)
    planes: dict[int, bytes] = field(default_factory=dict)


@dataclass
class Block:
    width: int
    height: int
    x0: int
    y0: int
    id: int
    seed: int
    records: list[Record]  # levels, rising; the reference last

    @property
    def levels(self) -> list[Record]:
        """Those that are levels."""
        return [r for r in self.records if r.kind == LEVEL]

    @property
    def reference(self) -> Record | None:
        """None: it has none."""
        return self.records[-1] if self.records[-1].kind == REFERENCE else None


# --- planes -----------------------------------------------------------------------------------------------------------


def _filter_of(plane: int) -> int:
    return {DISPLAY: AVERAGE | GREEN, MEAN_F16: SHUFFLE, HALF_F16: SHUFFLE}.get(plane, 0)


def _filters_of(plane: int) -> int:
    """Those that may be on it."""
    return _filter_of(DISPLAY if plane == FINE else plane)


def _predicted(channels: np.ndarray) -> np.ndarray:
    """floor((left + up) / 2) of [channel, height, width]; what is missing is 0."""
    sums = np.zeros(channels.shape, np.uint16)
    sums[:, :, 1:] += channels[:, :, :-1]
    sums[:, 1:, :] += channels[:, :-1, :]
    return (sums // 2).astype(np.uint8)


def _filtered(raw: bytes, number: int, width: int, height: int) -> bytes:
    if number & SHUFFLE:
        return np.frombuffer(raw, np.uint8).reshape(-1, 2).T.tobytes()
    if not number:
        return raw
    codes = np.frombuffer(raw, np.uint8).reshape(3, height, width).copy()
    if number & GREEN:
        codes[0::2] -= codes[1]
    if number & AVERAGE:
        codes -= _predicted(codes)
    return codes.tobytes()


def _unfiltered(data: bytes, number: int, width: int, height: int) -> bytes:
    if number & SHUFFLE:
        return np.frombuffer(data, np.uint8).reshape(2, -1).T.tobytes()
    if not number:
        return data
    codes = np.frombuffer(data, np.uint8).reshape(3, height, width).copy()
    if number & AVERAGE:  # a pixel needs its neighbours: one diagonal after the other, which is a stride of the padded picture
        padded = np.zeros((3, height + 1, width + 1), np.uint8)
        padded[:, 1:, 1:] = codes
        flat = padded.reshape(3, -1)
        for d in range(width + height - 1):
            top, bottom = max(0, d - width + 1), min(d, height - 1)
            first, last = ((y + 1) * (width + 1) + d - y + 1 for y in (top, bottom))
            left, up = flat[:, first - 1:last:width], flat[:, first - width - 1:last - width:width]
            flat[:, first:last + 1:width] += ((left.astype(np.uint16) + up) // 2).astype(np.uint8)
        codes = padded[:, 1:, 1:].copy()
    if number & GREEN:
        codes[0::2] += codes[1]
    return codes.tobytes()


@functools.lru_cache(None)
def _limits() -> np.ndarray:
    """limit[d]: the least linear value of the display code d, by halving what the library says; limit[0] is 0."""
    low, high = np.zeros(256, np.int64), np.full(256, np.float64(2).view(np.int64), np.int64)
    wanted = np.arange(256)
    for _ in range(64):  # positive doubles are in the order of their bits
        middle = low + (high - low) // 2
        is_less = srgb(middle.view(np.float64)) < wanted
        low, high = np.where(is_less, middle + 1, low), np.where(is_less, high, middle)
    return low.view(np.float64)


def _fine(codes: np.ndarray, light: np.ndarray) -> np.ndarray:
    limit = np.append(_limits(), np.nan)
    low, high = limit[codes], limit[codes.astype(int) + 1]
    with np.errstate(all="ignore"):
        steps = np.clip(np.floor(8.0 * (light - low) / (high - low)), 0, 7)
        stops = np.where(light > low, np.clip(np.floor(16.0 * np.log2(light / low) + 0.5), 0, 255), 0)
    return np.where(codes == 255, stops, steps).astype(np.uint8)


def _luminance(rgb: np.ndarray) -> np.ndarray:
    return LUMINANCE[0] * rgb[0] + LUMINANCE[1] * rgb[1] + LUMINANCE[2] * rgb[2]


def _half_log(values: np.ndarray) -> np.ndarray:
    size = np.abs(values)
    seen = size >= 2.0 ** -19.875
    octaves = 4.0 * np.log2(np.where(seen, size, 1.0))
    codes = np.clip(np.sign(octaves) * np.floor(np.abs(octaves) + 0.5) + 80, 1, 127)
    return np.where(seen, codes + np.where(values < 0, 128, 0), 0).astype(np.uint8)


def _f16(values: np.ndarray) -> bytes:
    return np.clip(values, -65504.0, 65504.0).astype("<f2").tobytes()


# --- blocks -----------------------------------------------------------------------------------------------------------


def _pack_record(record: Record, width: int, height: int) -> bytes:
    payload = b"".join(struct.pack("<24sd", name.encode()[:23], value) for name, value in record.stats)
    for plane, raw in record.planes.items():
        number = _filter_of(plane)
        stored = zlib.compress(_filtered(raw, number, width, height), 6)
        payload += struct.pack("<4I", plane, number, len(raw), len(stored)) + stored
    head = struct.pack("<7I", record.kind, record.spp, record.half_spp, len(record.stats), len(record.planes),
                       len(payload), zlib.crc32(payload))
    return head + struct.pack("<I", zlib.crc32(head)) + payload


def pack(block: Block) -> bytes:
    """The bytes of block-NNNNN.lseq."""
    head = MAGIC + struct.pack("<4I2i2IQ3I", 1, FILE_HEADER, block.width, block.height, block.x0, block.y0, block.id,
                               len(block.records), block.seed, 0, 0, 0)
    records = (_pack_record(r, block.width, block.height) for r in block.records)
    return head + struct.pack("<I", zlib.crc32(head)) + b"".join(records)


def _need(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(what)


def unpack(data: bytes) -> Block:
    """What pack was given; ValueError says what does not fit."""
    try:
        return _unpacked(data)
    except (struct.error, zlib.error, UnicodeDecodeError) as error:
        raise ValueError(f"a damaged record: {error}") from None


def _unpacked(data: bytes) -> Block:
    _need(len(data) >= FILE_HEADER and data[:8] == MAGIC, "not a block sequence")
    version, _, width, height, x0, y0, number, count, seed, *_, crc = struct.unpack_from("<4I2i2IQ3II", data, 8)
    _need(version == 1 and crc == zlib.crc32(data[:60]), "a damaged header")
    _need(0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE and 0 < count <= MAX_RECORDS,
          f"a block of {width}x{height} pixels with {count} images")
    block, at = Block(width, height, x0, y0, number, seed, []), FILE_HEADER
    for _ in range(count):
        _need(at + RECORD_HEADER <= len(data), "truncated")
        kind, spp, half_spp, n_stats, n_planes, size, crc, own = struct.unpack_from("<8I", data, at)
        payload = data[at + RECORD_HEADER:at + RECORD_HEADER + size]
        _need(own == zlib.crc32(data[at:at + 28]) and len(payload) == size and crc == zlib.crc32(payload),
              f"a damaged record at byte {at}")
        _need(kind == LEVEL or (kind == REFERENCE and 0 < len(block.records) == count - 1), "an image of no known kind, or no level")
        _need(half_spp <= spp and spp > (block.records[-1].spp if block.records and kind == LEVEL else 0), f"{spp} spp: levels rise")
        record, used = Record(kind, spp, half_spp), 32 * n_stats
        for i in range(n_stats):
            name, value = struct.unpack_from("<24sd", payload, 32 * i)
            record.stats.append((name.rstrip(b"\0").decode(), value))
        for _ in range(n_planes):
            plane, by, raw_bytes, stored = struct.unpack_from("<4I", payload, used)
            used += PLANE_HEADER + stored
            if plane in BYTES:
                _need(raw_bytes == BYTES[plane] * width * height and not by & ~_filters_of(plane) and plane not in record.planes,
                      f"{spp} spp: plane {plane} has another size, filter or number")
                raw = zlib.decompressobj().decompress(payload[used - stored:used], raw_bytes + 1)
                _need(len(raw) == raw_bytes, f"{spp} spp: plane {plane} has another size")
                record.planes[plane] = _unfiltered(raw, by, width, height)
        _need(used == size and DISPLAY in record.planes, f"{spp} spp: bytes behind the last plane, or no codes")
        block.records.append(record)
        at += RECORD_HEADER + size
    _need(at == len(data), "bytes behind the last record")
    return block


# --- pixels of a record: [3, height, width] ---------------------------------------------------------------------------


def display(block: Block, record: Record) -> np.ndarray:
    """8-bit sRGB codes."""
    return np.frombuffer(record.planes[DISPLAY], np.uint8).reshape(3, block.height, block.width)


def _light(block: Block, record: Record, plane: int) -> np.ndarray:
    values = np.frombuffer(record.planes[plane], "<f2").astype(np.float32).reshape(3, block.height, block.width)
    _need(bool(np.isfinite(values).all()), f"block {block.id} at {record.spp} spp: a pixel is not finite")
    return values


def mean(block: Block, record: Record) -> np.ndarray:
    """Linear light, float32: from halves of floats, else codes and steps between them, else codes alone (then at most 1)."""
    if MEAN_F16 in record.planes:
        return _light(block, record, MEAN_F16)
    codes = display(block, record)
    if FINE not in record.planes:
        return srgb_decoded(np.arange(256) / 255).astype(np.float32)[codes]
    steps, limit = np.arange(256), np.append(_limits(), 0.0)
    table = limit[:-1, None] + (steps + 0.5) / 8 * (limit[1:] - limit[:-1])[:, None]
    table[255] = limit[255] * np.exp2(steps / 16)
    return table.astype(np.float32)[codes, np.frombuffer(record.planes[FINE], np.uint8).reshape(codes.shape)]


def half(block: Block, record: Record) -> np.ndarray:
    """The half-buffer difference of all channels, float32, of a record that has HALF_F16."""
    return _light(block, record, HALF_F16)


# --- folders that are read --------------------------------------------------------------------------------------------


def _whole(o: Any, name: str, low: float, high: float) -> bool:
    value = o.get(name)
    return isinstance(value, (int, float)) and not isinstance(value, bool) and low <= value <= high and value == int(value)


def _usable(entry: Any, width: int, height: int) -> bool:
    return (isinstance(entry, dict) and _whole(entry, "id", 0, 2**32 - 1) and _whole(entry, "bytes", 1, MAX_FILE) and
            all(_whole(entry, f"{a}0", 0, size - 1) and _whole(entry, f"{a}1", entry[f"{a}0"] + 1, size)
                for a, size in (("x", width), ("y", height))) and
            all(isinstance(entry.get(name), str) for name in ("crc32", "file")) and
            re.fullmatch("[0-9a-fA-F]{1,8}", entry["crc32"]) is not None and
            re.fullmatch(r"[^./\0][^/\0]{0,62}", entry["file"]) is not None)


def _bytes(path: str, most: int) -> bytes:
    try:  # it waits for nothing, as a FIFO that nobody writes to would
        with open(encoded(path), "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
            _need(stat.S_ISREG(os.fstat(file.fileno()).st_mode), f"{path}: not a regular file")
            data = file.read(most + 1)
    except OSError as error:
        raise OSError(error.errno, error.strerror, path) from None
    _need(len(data) <= most, f"{path}: larger than {most} bytes")
    return data


def read_manifest(folder: str) -> dict[str, Any]:
    """manifest.json of a recorded sequence, checked. ValueError and OSError, one line."""
    path = os.path.join(folder, "manifest.json")
    data = _bytes(path, 1 << 26)
    try:
        m = json.loads(data)
    except (ValueError, RecursionError):
        m = None
    _need(isinstance(m, dict) and m.get("format") == "lull-sequence", f"{path}: not the manifest of a sequence")
    _need(_whole(m, "version", 1, 1), f"{path}: this version of the format is not known")
    _need(isinstance(m.get("scene"), str) and m["scene"] != "", f"{path}: the scene has no name")
    _need(_whole(m, "width", 1, 1 << 20) and _whole(m, "height", 1, 1 << 20), f"{path}: width or height is missing or out of range")
    levels, blocks = m.get("levels"), m.get("blocks")
    _need(isinstance(levels, list) and 0 < len(levels) <= MAX_RECORDS, f"{path}: no list of levels")
    for i, level in enumerate(levels):
        _need(_whole({"level": level}, "level", levels[i - 1] + 1 if i else 1, MAX_SPP), f"{path}: level {i} does not rise")
    _need(isinstance(blocks, list), f"{path}: no list of blocks")
    for i, entry in enumerate(blocks):
        _need(_usable(entry, m["width"], m["height"]), f"{path}: entry {i} of blocks is not usable")
        entry.update({name: int(entry[name]) for name in ("id", "x0", "y0", "x1", "y1", "bytes")})
    ids = sorted(entry["id"] for entry in blocks)
    twice = next((a for a, b in zip(ids, ids[1:]) if a == b), None)
    _need(twice is None, f"{path}: block {twice} is listed twice")
    return {"reference_spp": 0, **m, "width": int(m["width"]), "height": int(m["height"])}


def read_block(folder: str, manifest: dict[str, Any], entry: dict[str, Any]) -> Block:
    """The block of an entry of the manifest's "blocks", held against it. ValueError and OSError, one line."""
    path = os.path.join(folder, entry["file"])
    data = _bytes(path, MAX_FILE)
    _need(len(data) == entry["bytes"] and zlib.crc32(data) == int(entry["crc32"], 16),
          f"{path}: not the file that the manifest lists (size or CRC)")
    try:
        block = unpack(data)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    _need((block.id, block.x0, block.y0, block.x0 + block.width, block.y0 + block.height) ==
          tuple(entry[name] for name in ("id", "x0", "y0", "x1", "y1")),
          f"{path}: block {block.id} is {block.width}x{block.height} at {block.x0},{block.y0}, the manifest says otherwise")
    _need(not manifest["reference_spp"] or block.reference is not None, f"{path}: the reference is missing")
    missing = set(manifest["levels"]) - {r.spp for r in block.levels}
    _need(not missing, f"{path}: the level at {min(missing, default=0):.0f} spp is missing")
    return block


# --- whole pictures ---------------------------------------------------------------------------------------------------


def _planar(picture: np.ndarray, kind: Any) -> np.ndarray:
    return np.ascontiguousarray(np.asarray(picture)[..., :3].transpose(2, 0, 1), kind)


def _record(level: Level, box: tuple[int, int, int, int], full: bool, kind: int) -> Record:
    x0, y0, x1, y1 = box
    mean = None if level.mean is None else _planar(level.mean[y0:y1, x0:x1], np.float64)
    codes = srgb(mean) if level.display is None else _planar(level.display[y0:y1, x0:x1], np.uint8)
    record = Record(kind, level.spp, planes={DISPLAY: codes.tobytes()})
    if mean is not None:
        record.planes[MEAN_F16 if full else FINE] = _f16(mean) if full else _fine(codes, mean).tobytes()
    if level.first_half is not None:
        n, h = level.spp, level.spp // 2
        half = 0.5 * n / (n - h) * (_planar(level.first_half[y0:y1, x0:x1], np.float64) - mean)
        record.half_spp = h
        record.planes[HALF_F16 if full else HALF_LOG] = _f16(half) if full else _half_log(_luminance(half)).tobytes()
    return record


def _check(levels: Sequence[Level], reference: Level | None) -> tuple[int, int]:
    _need(0 < len(levels) < MAX_RECORDS, f"{len(levels)} levels")
    shape = np.shape(levels[0].display if levels[0].mean is None else levels[0].mean)
    _need(len(shape) == 3 and min(shape[:2]) > 0 and shape[2] >= 3, f"pictures are [height, width, 3], not {list(shape)}")
    for before, level in zip([None, *levels], levels):
        _need(level.spp > (before.spp if before else 0), f"{level.spp} spp: levels rise")
    for level in [*levels, *([reference] if reference else [])]:
        given = [limits.unmasked("a picture", p) for p in (level.mean, level.first_half, level.display) if p is not None]
        _need(level.mean is not None or (level.display is not None and level.first_half is None),
              f"{level.spp} spp: a mean, or codes without halves")
        _need(all(np.shape(p) == shape for p in given), f"{level.spp} spp: pictures of another size")
        _need(all(np.isfinite(p).all() for p in given), f"{level.spp} spp: values that are not finite")
        _need(level.first_half is None or level.spp > 1, f"{level.spp} spp: the half of one sample")
    return shape[1], shape[0]


def write(folder: str, levels: Sequence[Level], *, scene: str, block: int = 200, camera: str = "", source: str = "",
          renderer: str = "lull for Python", seed: int = 0, reference: Level | None = None,
          reference_seed: int | None = None) -> None:
    """Writes a sequence of whole pictures as block files and manifest.json into `folder`, which is made. Views with the
    same `scene` are on the same side of a split. reference: of many samples; without a reference_seed of its own it
    shares its samples with the levels. TypeError, ValueError and OSError, one line, the first two before anything is
    written; each file is whole or not there."""
    for name, text in (("scene", scene), ("camera", camera), ("source", source), ("renderer", renderer)):
        _need(isinstance(text, str) and text == text.encode(errors="replace").decode(), f"{name} {text!r}: expected text")
    _need(scene != "", "the scene has no name")
    levels = [replace(level, spp=limits.checked("spp", level.spp)) for level in levels]  # numbers of numpy are none to JSON
    reference = reference and replace(reference, spp=limits.checked("spp", reference.spp))
    block, seed = limits.checked("block", block), limits.checked("seed", seed)
    reference_seed = None if reference_seed is None else limits.checked("seed", reference_seed)
    width, height = _check(levels, reference)
    os.makedirs(folder, exist_ok=True)
    full = next((i for i, level in enumerate(levels) if level.spp >= FULL_SPP), len(levels) - 1)
    halves = levels[full].first_half is not None
    columns, listed = -(-width // block), []
    for number in range(columns * -(-height // block)):
        x0, y0 = number % columns * block, number // columns * block
        box = x0, y0, min(x0 + block, width), min(y0 + block, height)
        records = [_record(level, box, halves and i == full, LEVEL) for i, level in enumerate(levels)]
        if reference:
            records.append(_record(reference, box, True, REFERENCE))
        name = f"block-{number:05d}.lseq"
        data = pack(Block(box[2] - x0, box[3] - y0, x0, y0, number, seed, records))
        with replaced(os.path.join(folder, name)) as file:
            file.write(data)
        listed.append({"id": number, "x0": x0, "y0": y0, "x1": box[2], "y1": box[3], "file": name, "bytes": len(data),
                       "crc32": f"{zlib.crc32(data):08x}"})
    manifest: dict[str, Any] = {
        "format": "lull-sequence", "version": 1, "scene": scene, "source": source, "camera": camera, "renderer": renderer,
        "width": width, "height": height, "block": block, "seed": seed,
        "reference_seed": seed if reference_seed is None else reference_seed,
        "reference_spp": reference.spp if reference else 0,
        "levels": [level.spp for level in levels], "blocks": listed}
    if reference and reference_seed is None:
        manifest["reference_independent"] = False
    with replaced(os.path.join(folder, "manifest.json")) as file:
        file.write((json.dumps(manifest, indent=1) + "\n").encode())
