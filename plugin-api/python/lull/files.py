# SPDX-License-Identifier: MIT
"""Files that are written: known before the work whether they can be, and under their names only when they are complete, by
the rules and in the words of Lull's programs (lull/host.h)."""
from __future__ import annotations

import contextlib
import ctypes as C
import os
import tempfile
from typing import Any, BinaryIO, Callable, Iterable, Iterator, NamedTuple, Sequence

import numpy as np

from . import abi
from .library import LullError, call, encoded, library

LUMINANCE = (0.2126729, 0.7151522, 0.0721750)  # Y of linear sRGB (IEC 61966-2-1), which criteria take pixels for


class Output(NamedTuple):
    """A file to be written. option: what asked for it, for messages; endings: those its name may have, () = any."""
    option: str
    path: str
    endings: Sequence[str] = ()


def file_call(name: str, *arguments: Any) -> None:
    """As a file's own functions in Python fail: OSError, MemoryError, or ValueError for a name that makes no sense."""
    try:
        call(name, *arguments)
    except LullError as error:
        if error.code == abi.E_MEMORY:
            raise MemoryError(str(error)) from None
        raise (OSError if error.code == abi.E_IO else ValueError)(str(error)) from None


def check_outputs(outputs: Iterable[Output], inputs: Iterable[str] = ()) -> None:
    """OSError or ValueError, one line, for the first one that cannot be written, is written twice, or is an input. Those
    whose path is empty are none."""
    written, read = [o for o in outputs if o.path], [encoded(path) for path in inputs if os.path.exists(encoded(path))]
    for o in written:
        if o.endings and not any(o.path.lower().endswith(e) and os.path.basename(o.path).lower() != e for e in o.endings):
            raise ValueError(f"{o.option} {o.path}: expected a name that ends in {' or '.join(o.endings)}")
    pairs = [(o.option.lstrip("-").encode(), encoded(o.path)) for o in written]
    file_call("host_check_outputs", (abi.HostOutput * max(len(pairs), 1))(*pairs), len(pairs),
               (C.c_char_p * max(len(read), 1))(*read), len(read))


@contextlib.contextmanager
def replaced(path: str) -> Iterator[BinaryIO]:
    """A file beside `path` that becomes it at the end, on the disk; an exception leaves what was there. OSError says which
    file could not be written."""
    made, descriptor = C.c_void_p(), C.c_int32()
    file_call("host_file_begin", encoded(path), C.byref(made), C.byref(descriptor))
    try:
        with os.fdopen(os.dup(descriptor.value), "wb") as file:
            yield file
    except BaseException as error:
        library().lull_host_file_abort(made)
        if isinstance(error, OSError):
            raise OSError(f"{path}: write failed: {error.strerror or error}") from error
        raise
    file_call("host_file_commit", made)


def write_png(path: str, rgb: np.ndarray) -> None:
    """rgb: [height, width, 3] uint8, rows from the top."""
    rgb = np.ascontiguousarray(rgb, np.uint8)
    file_call("host_write_png", encoded(path), rgb.shape[1], rgb.shape[0], C.c_void_p(rgb.ctypes.data))


def read_shown(path: str, layer: str = "", needed: str = "") -> np.ndarray:
    """8-bit sRGB codes [height, width, 3] that a display shows of an image file, of any format that Lull's programs read: of its
    picture, or of the channels LAYER.R, LAYER.G and LAYER.B. needed: a channel without which the file is refused. ValueError, or
    OSError where it cannot be opened or the library has no lull/modules/lull-images.so beside it, as in wheels."""
    width, height, pixels = C.c_uint32(), C.c_uint32(), bytearray()

    def take(_writer: int, data: int, size: int) -> int:
        pixels.extend(C.string_at(data, size))
        return abi.OK
    names = (encoded(name) if name else None for name in (path, layer, needed))
    file_call("host_read_shown", *names, C.byref(width), C.byref(height),
              C.byref(abi.sized(abi.Writer, write=abi.WriteFn(take))))
    return np.frombuffer(pixels, np.uint8).reshape(height.value, width.value, 3)


def srgb(linear: np.ndarray) -> np.ndarray:
    """8-bit sRGB codes of linear light, those of Lull's programs, as uint8; NaN gives 0."""
    light = np.ascontiguousarray(linear, np.float64)
    codes = np.empty(light.shape, np.uint8)
    library().lull_host_srgb(C.c_void_p(light.ctypes.data), C.c_uint64(light.size), C.c_void_p(codes.ctypes.data))
    return codes


def srgb_encoded(linear: np.ndarray) -> np.ndarray:
    """Display values in [0, 1] by the sRGB transfer (IEC 61966-2-1)."""
    light = np.clip(linear, 0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def srgb_decoded(shown: np.ndarray) -> np.ndarray:
    """The linear light of display values in [0, 1]."""
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def write_each(writers: Iterable[tuple[str, Callable[[str], None]]]) -> tuple[list[str], list[str]]:
    """Calls write(path) for each pair that has a path, whatever becomes of the others. What cannot be written after all is
    kept where temporary files go. Returns the names of the files written, and a line for each that failed."""
    written, failed = [], []
    for path, write in writers:
        if not path:
            continue
        try:
            write(path)
            written.append(path)
        except (OSError, ValueError) as error:
            kept = os.path.join(tempfile.gettempdir(), f"lull-{os.getpid()}-{os.path.basename(path)}")
            try:
                write(kept)
                failed.append(f"{error}; kept as {kept}")
            except (OSError, ValueError):
                failed.append(str(error))
    return written, failed
