# SPDX-License-Identifier: MIT
"""OpenEXR scan-line files of float channels: ZIP-compressed ones are written, those and uncompressed ones are read."""
from __future__ import annotations

import os
import struct
import zlib
from typing import Mapping, Optional, Union

import numpy as np

from .files import replaced
from .library import encoded

_MAGIC, _LONG_NAMES = 20000630, 0x400
_LINES = 16  # of a ZIP chunk
_TYPES = ("<u4", "<f2", "<f4")  # by pixel type


def check_name(name: str) -> None:
    """ValueError for a channel's name that makes a file nobody can read."""
    data = name.encode(errors="replace")
    if not 0 < len(data) < 256 or b"\0" in data or data.decode() != name:
        raise ValueError(f"channel {name!r}: expected a name of 1 to 255 bytes of UTF-8 without a NUL")


def _attribute(name: str, kind: str, data: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(data)) + data


def _zip(data: bytes) -> bytes:
    """Even bytes then odd ones, each as its difference to the one before, deflated; as they are if that is no gain."""
    raw = np.frombuffer(data, np.uint8)
    split = np.concatenate((raw[::2], raw[1::2])).astype(np.int16)
    split[1:] = split[1:] - split[:-1] + 128
    packed = zlib.compress(split.astype(np.uint8).tobytes(), 4)
    return packed if len(packed) < len(data) else data


def _unzipped(data: bytes, at: int, y0: int, y1: int, lines: int, line: np.dtype) -> bytes:
    """What lies in the chunks of a file that is ZIP-compressed, `lines` in each."""
    parts = []
    for i, y in enumerate(range(y0, y1 + 1, lines)):
        begin, = struct.unpack_from("<Q", data, at + 8 * i)
        top, size = struct.unpack_from("<iI", data, begin)
        packed, wanted = data[begin + 8:begin + 8 + size], line.itemsize * min(lines, y1 + 1 - y)
        if top != y or len(packed) != size:
            raise ValueError("its lines are not in order")
        if size < wanted:
            split = np.frombuffer(zlib.decompressobj().decompress(packed, wanted + 1), np.uint8).astype(np.int64)
            split[1:] -= 128
            raw, half = np.empty(len(split), np.uint8), -(-len(split) // 2)
            whole = np.cumsum(split).astype(np.uint8)
            raw[::2], raw[1::2] = whole[:half], whole[half:]
            packed = raw.tobytes()
        if len(packed) != wanted:
            raise ValueError("a chunk has another size")
        parts.append(packed)
    return b"".join(parts)


def write(path: str, channels: Mapping[str, np.ndarray], size: tuple[int, int], origin: tuple[int, int] = (0, 0),
          attributes: Optional[Mapping[str, Union[str, float]]] = None) -> None:
    """channels: by name ("R", "lull.spp"), each [h, w], stored as float32. size: (width, height) of the whole picture;
    origin: where the upper left stored pixel lies in it. Attributes are text or numbers."""
    names = sorted(channels)
    for name in names:
        check_name(name)
    height, width = channels[names[0]].shape
    x0, y0 = origin
    listed = b"".join(n.encode() + b"\0" + struct.pack("<iiii", _TYPES.index("<f4"), 0, 1, 1) for n in names) + b"\0"
    head = _attribute("channels", "chlist", listed) + _attribute("compression", "compression", b"\x03")
    head += _attribute("dataWindow", "box2i", struct.pack("<4i", x0, y0, x0 + width - 1, y0 + height - 1))
    head += _attribute("displayWindow", "box2i", struct.pack("<4i", 0, 0, size[0] - 1, size[1] - 1))
    head += _attribute("lineOrder", "lineOrder", b"\0") + _attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += _attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    head += _attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    for name, value in (attributes or {}).items():
        # a file's name need not be UTF-8
        head += (_attribute(name, "string", value.encode(errors="surrogateescape")) if isinstance(value, str) else
                 _attribute(name, "double", struct.pack("<d", value)))
    version = 2 | (_LONG_NAMES if any(len(n) > 31 for n in [*names, *(attributes or {})]) else 0)
    head = struct.pack("<II", _MAGIC, version) + head + b"\0"
    rows = np.stack([channels[n] for n in names], 1).astype("<f4")  # [h, channels, w]
    chunks = []
    for y in range(0, height, _LINES):
        data = _zip(rows[y:y + _LINES].tobytes())
        chunks.append(struct.pack("<iI", y0 + y, len(data)) + data)
    at = len(head) + 8 * len(chunks)
    offsets = np.cumsum([at] + [len(c) for c in chunks[:-1]], dtype=np.uint64)
    with replaced(path) as file:
        file.write(head + offsets.astype("<u8").tobytes() + b"".join(chunks))


def _bytes(path: str, most: int = -1) -> bytes:
    if os.path.exists(encoded(path)) and not os.path.isfile(encoded(path)):  # a FIFO that nobody writes to would be waited for
        raise ValueError(f"{path}: not a regular file")
    with open(encoded(path), "rb") as file:
        return file.read(most)


def read(path: str) -> tuple[dict[str, np.ndarray], tuple[int, int]]:
    """All channels by name, [h, w] float32, of an uncompressed or ZIP-compressed file; its data window's origin (x, y)."""
    data = _bytes(path)
    try:
        return _decode(data)
    except (ValueError, struct.error, zlib.error, KeyError, IndexError) as error:
        raise ValueError(f"{path}: not a scan-line EXR, uncompressed or by ZIP: {error}") from None


def texts(path: str) -> dict[str, str]:
    """The attributes that are text."""
    return {name: value.decode(errors="replace") for name, kind, value in _head(_bytes(path, 1 << 16))[0] if kind == "string"}


def _head(data: bytes) -> tuple[list[tuple[str, str, bytes]], int]:
    """The attributes, each with its name, kind and bytes; where what follows them begins."""
    head, at = [], 8
    while data[at]:
        name_end = data.index(b"\0", at)
        kind_end = data.index(b"\0", name_end + 1)
        end = kind_end + 5 + struct.unpack_from("<I", data, kind_end + 1)[0]
        head.append((data[at:name_end].decode(), data[name_end + 1:kind_end].decode(), data[kind_end + 5:end]))
        at = end
    return head, at + 1


def _decode(data: bytes) -> tuple[dict[str, np.ndarray], tuple[int, int]]:
    if struct.unpack_from("<IB", data) != (_MAGIC, 2) or data[5] & 0x1a:  # tiled, deep or of several parts
        raise ValueError("another kind of file")
    listed, at = _head(data)
    head = {name: value for name, _, value in listed}
    kind = head["compression"][0]
    if kind not in (0, 2, 3):
        raise ValueError("another compression")
    x0, y0, x1, y1 = struct.unpack("<4i", head["dataWindow"])
    channels, fields = head["channels"], []
    while channels[:1] != b"\0":
        name, _, rest = channels.partition(b"\0")
        fields.append((name.decode(), _TYPES[struct.unpack_from("<i", rest)[0]], (x1 - x0 + 1,)))
        channels = rest[16:]
    if kind:
        lines = np.frombuffer(_unzipped(data, at, y0, y1, _LINES if kind == 3 else 1, np.dtype(fields)), np.dtype(fields))
        return {name: lines[name].astype(np.float32) for name, *_ in fields}, (x0, y0)
    line = np.dtype([("#y", "<i4"), ("#bytes", "<u4"), *fields])  # its channels one after the other
    lines = np.frombuffer(data, line, y1 - y0 + 1, at + 8 * (y1 - y0 + 1))
    if (lines["#y"] != np.arange(y0, y1 + 1)).any() or (lines["#bytes"] != line.itemsize - 8).any():
        raise ValueError("its lines are not in order")
    return {name: lines[name].astype(np.float32) for name, *_ in fields}, (x0, y0)
