# SPDX-License-Identifier: MIT
"""PNG files, as far as stop maps, previews and masks need them: 8 or 16 bits, not interlaced."""
from __future__ import annotations

import struct
import zlib

import numpy as np

from .files import replaced

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}  # by colour type: grey, RGB, grey + alpha, RGBA


def write(path: str, rgb: np.ndarray) -> None:
    """rgb: [height, width, 3] uint8, rows from the top."""
    height, width, _ = rgb.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = rgb.reshape(height, -1)
    with replaced(path) as file:
        file.write(_SIGNATURE)
        for kind, data in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                           (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b"")):
            file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))


def read_grey(path: str) -> np.ndarray:
    """[height, width] in [0, 1]: the mean of R, G and B, as stored (no transfer); alpha is ignored."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        return _decode(data)
    except (ValueError, struct.error, zlib.error, IndexError) as error:
        raise ValueError(f"{path}: cannot be read as a mask: {error or 'broken file'}") from None


def _chunks(data: bytes):
    if data[:8] != _SIGNATURE:
        raise ValueError("it is not a PNG file")
    at = 8
    while at + 12 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + size]
        if len(body) != size or struct.unpack_from(">I", data, at + 8 + size)[0] != zlib.crc32(kind + body):
            raise ValueError("it is damaged")
        yield kind, body
        at += 12 + size


def _decode(data: bytes) -> np.ndarray:
    header, packed = None, b""
    for kind, body in _chunks(data):
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
    if not header or header[3] not in _CHANNELS or header[2] not in (8, 16) or header[6]:
        raise ValueError("expected 8 or 16 bits, grey or RGB, not interlaced, no palette")
    width, height, bits, kind = header[:4]
    pixel = _CHANNELS[kind] * bits // 8
    if not 0 < width * height * pixel < 1 << 31:
        raise ValueError("it is too large")
    rows = zlib.decompressobj().decompress(packed, height * (1 + width * pixel))
    raw = np.frombuffer(rows, np.uint8).reshape(height, 1 + width * pixel)
    out = np.zeros((height, width, pixel), np.uint8)
    for y in range(height):
        _unfilter(int(raw[y, 0]), raw[y, 1:].reshape(width, pixel), out[y - 1] if y else np.zeros_like(out[0]), out[y])
    samples = out.reshape(height, width, -1).view(">u2" if bits == 16 else np.uint8).astype(np.float64)
    return samples[..., :min(3, _CHANNELS[kind]) if kind in (2, 6) else 1].mean(-1) / (2 ** bits - 1)


def _unfilter(kind: int, row: np.ndarray, up: np.ndarray, out: np.ndarray) -> None:
    """One row, [width, bytes per pixel] uint8, by the filters of the PNG specification, clause 9."""
    if kind == 0:
        out[:] = row
    elif kind == 1:
        out[:] = np.cumsum(row, 0, dtype=np.uint8)
    elif kind == 2:
        out[:] = row + up
    elif kind in (3, 4):
        left, corner = np.zeros(row.shape[1], np.int64), np.zeros(row.shape[1], np.int64)
        above = up.astype(np.int64)
        for x in range(len(row)):
            b = above[x]
            if kind == 3:
                guess = (left + b) // 2
            else:
                p = left + b - corner
                a_far, b_far, c_far = abs(p - left), abs(p - b), abs(p - corner)
                guess = np.where((a_far <= b_far) & (a_far <= c_far), left, np.where(b_far <= c_far, b, corner))
            left, corner = (row[x] + guess) & 255, b
            out[x] = left
    else:
        raise ValueError(f"unknown filter {kind}")
