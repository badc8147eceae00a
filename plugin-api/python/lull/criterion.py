# SPDX-License-Identifier: MIT
"""One instance of a criterion, and what it is shown: numpy arrays as they lie in memory."""
from __future__ import annotations

import contextlib
import ctypes as C
import math
import os
import threading
import warnings
import weakref
from typing import Callable, Iterator, Mapping, NamedTuple, NoReturn, Optional

import numpy as np

from . import abi, limits
from .library import Info, LullError, call, encoded, find, library
from .version import SOFTWARE

PLANES = {"color": abi.COLOR, "weight": abi.WEIGHT, "spp": abi.SPP, "moment2": abi.MOMENT2, "half": abi.HALF,
          "albedo": abi.ALBEDO, "normal": abi.NORMAL, "depth": abi.DEPTH}
CHANNELS = {"color": 3, "weight": 1, "spp": 1, "moment2": 1, "half": 3, "albedo": 3, "normal": 3, "depth": 1}
_NORMALISERS = {"one": abi.NORM_ONE, "spp": abi.NORM_SPP, "half_spp": abi.NORM_HALF_SPP, "weight": abi.NORM_WEIGHT}
_TYPES = {np.dtype(np.float32): abi.TYPE_F32, np.dtype(np.float16): abi.TYPE_F16, np.dtype(np.float64): abi.TYPE_F64,
          np.dtype(np.uint32): abi.TYPE_U32}


class Rect(NamedTuple):
    """Pixels x0 <= x < x1, y0 <= y < y1; y grows downwards, (0, 0) is the upper left pixel of the picture."""
    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width(self) -> int:
        """Pixels of a row."""
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        """Rows."""
        return self.y1 - self.y0

    @property
    def pixels(self) -> int:
        """width · height."""
        return self.width * self.height


class Plane:
    """A numpy array [height, width] or [height, width, channels] of the view, as it lies in memory: no copy is made.

    Types: float32, float16, float64, uint32, in native byte order. Strides may be negative (rows from the bottom up) or
    wide (RGBA, interleaved). The estimate is stored · scale / N; N by `normaliser`: "one" (estimates are stored), "spp" or
    "half_spp" (sums over the block's samples), "weight" (the plane "weight" at that pixel).
    """

    def __init__(self, array: np.ndarray, normaliser: str = "one", scale: float = 1.0):
        if not isinstance(array, np.ndarray):
            raise TypeError(f"a plane is a numpy array, not {type(array).__name__}")
        limits.unmasked("a plane", array)
        if array.dtype not in _TYPES or not array.dtype.isnative:
            raise TypeError(f"a plane holds float32, float16, float64 or uint32 in native byte order, not {array.dtype}")
        if array.ndim not in (2, 3):
            raise ValueError(f"a plane is [height, width] or [height, width, channels], not of shape {array.shape}")
        if not array.flags.aligned:
            raise ValueError("a plane's elements must be aligned to their type: give a copy")
        if normaliser not in _NORMALISERS:
            raise ValueError(f"normaliser '{normaliser}': expected one of {', '.join(_NORMALISERS)}")
        if not math.isfinite(scale) or scale == 0:
            raise ValueError(f"scale {scale}: expected a finite number that is not 0")
        self.array, self.normaliser, self.scale = array, normaliser, float(scale)

    def describe(self, name: str, height: int, width: int) -> abi.Plane:
        """The ABI's struct; checks the shape against the view's."""
        a, wanted = self.array, CHANNELS.get(name, 1)
        channels = 1 if a.ndim == 2 else a.shape[2]
        if a.shape[:2] != (height, width) or channels < wanted:
            raise ValueError(f"plane {name}: shape {a.shape}, expected [{height}, {width}, {wanted}] (more channels are "
                             "ignored)")
        return abi.Plane(data=a.ctypes.data, stride_x=a.strides[1], stride_y=a.strides[0],
                         stride_c=a.strides[2] if a.ndim == 3 else a.itemsize, scale=self.scale, type=_TYPES[a.dtype],
                         normaliser=_NORMALISERS[self.normaliser], channels=channels)


class Handle:
    """A pointer of the library's, released when nobody holds it any more. kept: what must live as long."""

    def __init__(self, release: str, *kept: object):
        self.pointer, self._release, self.kept = C.c_void_p(), getattr(library(), release), kept

    def __del__(self) -> None:
        if self.pointer:
            self._release(self.pointer)


def load(spec: str = "observer", *, threads: Optional[int] = None, log: Optional[Callable[[int, str], None]] = None,
         **parameters: object) -> Criterion:
    """Makes an instance: load("observer", visible=0.35), load("./mine.so"), load("lib.so:id", first_spp=32).

    threads: workers that it may use, default as many as the process has processors. log(level, text): its messages,
    default a Python warning for errors and warnings. Parameters' underscores stand for hyphens. Raises LullError.
    """
    return Criterion(find(spec), _texts(parameters), threads, log)


def _texts(parameters: Mapping[str, object]) -> dict[str, str]:
    return {key.replace("_", "-"): str(int(value)) if isinstance(value, (bool, np.bool_)) else
            repr(float(value)) if isinstance(value, float) else str(value) for key, value in parameters.items()}


def _warn(level: int, text: str) -> None:
    if level <= abi.LOG_WARNING:
        warnings.warn(text, stacklevel=3)


class Criterion:
    """An instance with its frame, if one is open. It belongs to one thread at a time. Use as a context manager, or call
    close(). It cannot be copied: another one is made by with_parameters(). needs: struct lull_requirements."""

    def __init__(self, info: Info, parameters: Optional[Mapping[str, str]] = None, threads: Optional[int] = None,
                 log: Optional[Callable[[int, str], None]] = None):
        self.info, self.parameters, self.log = info, dict(parameters or {}), log or _warn
        self.threads = limits.checked("threads", len(os.sched_getaffinity(0)) if threads is None else threads)
        log = self.log  # and not self, which would never be let go of
        log_fn = abi.LogFn(lambda _, level, text: log(level, text.decode(errors="replace")))
        services = abi.sized(abi.HostServices, threads=self.threads, name=SOFTWARE.encode(), log=log_fn)
        texts = [tuple(map(encoded, pair)) for pair in self.parameters.items()]
        pairs = (abi.Pair * max(len(texts), 1))(*texts)
        handle = Handle("lull_host_close", log_fn)
        call("host_create", C.byref(services), C.c_void_p(info.table), pairs, len(self.parameters), C.byref(handle.pointer))
        self.handle: Optional[Handle] = handle
        self.needs = abi.Requirements.from_address(library().lull_host_needs(handle.pointer))
        self.frame: Optional[weakref.ref[Handle]] = None  # of the frame that is open on it
        self._busy = threading.Lock()

    def with_parameters(self, **parameters: object) -> Criterion:
        """Another instance of the same criterion, some parameters changed."""
        return Criterion(self.info, {**self.parameters, **_texts(parameters)}, self.threads, self.log)

    @contextlib.contextmanager
    def alone(self) -> Iterator[C.c_void_p]:
        """The library's pointer. An instance has no locks of its own: a second call while one is under way would crash."""
        if not self._busy.acquire(blocking=False):
            raise LullError(abi.E_STATE, f"criterion {self.info.id}: another call is under way: give each thread an "
                                         "instance of its own, with_parameters()")
        try:
            if self.handle is None:
                raise LullError(abi.E_STATE, f"criterion {self.info.id}: it was closed")
            yield self.handle.pointer
        finally:
            self._busy.release()

    def close(self) -> None:
        """Frees the instance as soon as no frame tells of it any more; nothing happens the second time."""
        if self.handle is not None:
            with self.alone():
                self.handle = self.frame = None

    def __reduce_ex__(self, _protocol: object) -> NoReturn:  # what copy and pickle go by
        raise TypeError(f"criterion {self.info.id}: an instance cannot be copied, as both would free it: make another one, "
                        "with_parameters()")

    def __enter__(self) -> Criterion:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def plane_names(mask: int) -> frozenset[str]:
    """mask: bits 1 << abi.COLOR …."""
    return frozenset(name for name, bit in PLANES.items() if mask >> bit & 1)
