# SPDX-License-Identifier: MIT
"""One instance of a criterion: the calls of lull/criterion.h with numpy arrays in and plain values out.

A Criterion belongs to one thread at a time. It may use the worker threads that it was given while `evaluate` runs.
"""
from __future__ import annotations

import contextlib
import ctypes as C
import itertools
import math
import os
import threading
import warnings
from dataclasses import dataclass
from typing import Callable, Iterator, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from . import abi, limits
from .library import Info, LullError, find

PLANES = {"color": abi.COLOR, "weight": abi.WEIGHT, "spp": abi.SPP, "moment2": abi.MOMENT2, "half": abi.HALF,
          "albedo": abi.ALBEDO, "normal": abi.NORMAL, "depth": abi.DEPTH}
CHANNELS = {"color": 3, "weight": 1, "spp": 1, "moment2": 1, "half": 3, "albedo": 3, "normal": 3, "depth": 1}
NORMALISERS = {"one": abi.NORM_ONE, "spp": abi.NORM_SPP, "half_spp": abi.NORM_HALF_SPP, "weight": abi.NORM_WEIGHT}
TRANSFERS = {"linear": abi.TRANSFER_LINEAR, "srgb": abi.TRANSFER_SRGB, "gamma": abi.TRANSFER_GAMMA}
_TYPES = {np.dtype(np.float32): abi.TYPE_F32, np.dtype(np.float16): abi.TYPE_F16, np.dtype(np.float64): abi.TYPE_F64,
          np.dtype(np.uint32): abi.TYPE_U32}
# IEC 61966-2-1 primaries and white; row 2 gives luminance
SRGB_TO_XYZ = (0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041)


class Rect(NamedTuple):
    """Pixels x0 <= x < x1, y0 <= y < y1; y grows downwards, (0, 0) is the upper left pixel of the picture."""
    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width(self) -> int:
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        return self.y1 - self.y0

    @property
    def pixels(self) -> int:
        return self.width * self.height


class BlockState(NamedTuple):
    """What evaluate is told about a block; its id is its index in the list given to begin_frame."""
    rect: Rect
    spp: int  # samples per pixel in color and moment2
    half_spp: int = 0  # samples per pixel in half
    stopped: bool = False
    final: bool = False  # gets no more samples: the answer is for the report only
    thread_s: float = math.nan  # thread seconds spent on it


class Decision(NamedTuple):
    """A criterion's answer about one block; NaN where it does not say."""
    stop: bool = False
    next_spp: int = 0  # ask again at so many samples per pixel, 0 = the host chooses
    p_noisy: float = math.nan  # probability in [0, 1] that a viewer still sees noise
    predicted_spp: float = math.nan  # samples per pixel at which it expects to stop
    error: float = math.nan  # its own measure, falls as samples come in
    too_early: bool = False
    bad_input: bool = False


@dataclass(frozen=True)
class Needs:
    """The criterion's requirements: names of planes, sizes in pixels."""
    required: frozenset[str]
    used: frozenset[str]  # contains required
    block_width: int  # 0 = any
    block_height: int
    flexible: bool  # other block sizes are fine too
    halo: int
    first_spp: int
    bytes_per_block: int


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
        if normaliser not in NORMALISERS:
            raise ValueError(f"normaliser '{normaliser}': expected one of {', '.join(NORMALISERS)}")
        if not math.isfinite(scale) or scale == 0:
            raise ValueError(f"scale {scale}: expected a finite number that is not 0")
        self.array, self.normaliser, self.scale = array, normaliser, float(scale)

    def describe(self, name: str, height: int, width: int) -> abi.Plane:
        """The ABI's struct; checks the shape against the view's."""
        a = self.array
        channels = 1 if a.ndim == 2 else a.shape[2]
        if a.shape[:2] != (height, width) or channels < CHANNELS[name]:
            raise ValueError(f"plane {name}: shape {a.shape}, expected [{height}, {width}, {CHANNELS[name]}] "
                             "(more channels are ignored)")
        return abi.Plane(data=a.ctypes.data, stride_x=a.strides[1], stride_y=a.strides[0],
                         stride_c=a.strides[2] if a.ndim == 3 else a.itemsize, scale=self.scale, type=_TYPES[a.dtype],
                         normaliser=NORMALISERS[self.normaliser], channels=channels)


def _text(value: object) -> str:
    return str(int(value)) if isinstance(value, bool) else repr(float(value)) if isinstance(value, float) else str(value)


def load(spec: str = "observer", *, threads: Optional[int] = None, log: Optional[Callable[[int, str], None]] = None,
         **parameters: object) -> Criterion:
    """Makes an instance: load("observer", visible=0.35), load("./mine.so"), load("lib.so:id", first_spp=32).

    threads: workers that it may use, default all processors. log(level, text): its messages, default a Python warning for
    errors and warnings. Parameters' underscores stand for hyphens. Raises LullError.
    """
    return Criterion(find(spec), {key.replace("_", "-"): _text(value) for key, value in parameters.items()}, threads, log)


def _warn(level: int, text: str) -> None:
    if level <= abi.LOG_WARNING:
        warnings.warn(text, stacklevel=3)


class Criterion:
    """An instance with its frame, if one is open. Use as a context manager, or call close(). It cannot be copied: another
    one is made by with_parameters(). open_frame: a number that no other frame of this instance has, 0 = none is open."""

    def __init__(self, info: Info, parameters: Optional[Mapping[str, str]] = None, threads: Optional[int] = None,
                 log: Optional[Callable[[int, str], None]] = None):
        self.info, self.parameters = info, dict(parameters or {})
        self.threads = threads if threads is not None else os.cpu_count() or 1
        if self.threads < 1:
            raise ValueError(f"threads {threads}: expected at least 1")
        self.log = log or _warn
        self.open_frame = 0
        self._frames = itertools.count(1)
        self._busy = threading.Lock()
        self._error = abi.sized(abi.Error)
        self._host = abi.sized(abi.Host, api_minor=abi.API_MINOR, name=b"lull for Python 1.0", max_workers=self.threads,
                               log=abi.LogFn(self._host_log), parallel_for=abi.ParallelForFn(self._host_parallel_for))
        self._instance: Optional[C.c_void_p] = None
        made = C.c_void_p()
        pairs = (abi.Pair * len(self.parameters))(*[abi.Pair(k.encode(), v.encode()) for k, v in self.parameters.items()])
        self._call(info.table.create, C.addressof(self._host), C.addressof(pairs), len(pairs), C.sizeof(abi.Pair),
                   C.addressof(made))
        self._instance = made
        needs = abi.sized(abi.Requirements)
        self._call(info.table.requirements, made, C.addressof(needs))
        self.needs = Needs(_plane_names(needs.planes_required), _plane_names(needs.planes_used), needs.block_width,
                           needs.block_height, bool(needs.flags & abi.REQ_FLEXIBLE), needs.halo, max(needs.first_spp, 1),
                           needs.bytes_per_block)

    def with_parameters(self, **parameters: object) -> Criterion:
        """Another instance of the same criterion, some parameters changed."""
        changed = {key.replace("_", "-"): _text(value) for key, value in parameters.items()}
        return Criterion(self.info, {**self.parameters, **changed}, self.threads, self.log)

    # --- what the criterion may call -----------------------------------------------------------------------------------

    def _host_log(self, _host, level: int, text: bytes) -> None:
        self.log(level, f"criterion {self.info.id}: {(text or b'').decode(errors='replace')}")

    def _host_parallel_for(self, _host, count: int, fn, arg) -> int:
        tasks = itertools.count()  # next() on it is atomic

        def work(worker: int) -> None:
            while (task := next(tasks)) < count:
                fn(arg, task, worker)
        # fresh threads each time: evaluate is called seldom, and a pool could not be closed safely by the garbage collector
        helpers = [threading.Thread(target=work, args=(w,)) for w in range(1, min(self.threads, count))]
        for helper in helpers:
            helper.start()
        work(0)
        for helper in helpers:
            helper.join()
        return abi.OK

    # --- calls ---------------------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        """An instance has no locks of its own: a second call while one is under way would crash."""
        if not self._busy.acquire(blocking=False):
            raise LullError(abi.E_STATE, f"criterion {self.info.id}: another call is under way: give each thread an "
                                         "instance of its own, with_parameters()")
        try:
            yield
        finally:
            self._busy.release()

    def _ask(self, function, *arguments) -> None:
        """A call of the instance, which comes first, with the error last."""
        with self._alone():
            if self._instance is None:
                raise LullError(abi.E_STATE, f"criterion {self.info.id}: it was closed")
            self._call(function, self._instance, *arguments)

    def _call(self, function, *arguments) -> None:
        status = function(*arguments, C.addressof(self._error))
        if status != abi.OK:
            raise LullError(status, f"criterion {self.info.id}: {self._error.message.decode(errors='replace')}")

    def begin_frame(self, width: int, height: int, blocks: Sequence[Rect], planes: Sequence[str], *, spp_min: int = 1,
                    spp_max: int = 0, seed: int = 0, time_budget_s: float = 0.0, exposure: float = 1.0,
                    transfer: str = "srgb", gamma: float = 2.2, sample_clamp: float = 0.0,
                    rgb_to_xyz: Sequence[float] = SRGB_TO_XYZ, deterministic: bool = True, independent: bool = False,
                    shared: bool = False) -> None:
        """Opens a frame (drops an open one). planes: names of those that every evaluate will supply.

        exposure: linear factor before the display transfer ("srgb", "linear", "gamma"). independent: a pixel's samples are
        not stratified. shared: neighbouring pixels share samples (a splatted filter). Limits of 0 mean none.
        """
        if transfer not in TRANSFERS:
            raise ValueError(f"transfer '{transfer}': expected one of {', '.join(TRANSFERS)}")
        width, height = limits.picture(width, height)
        spp_max = limits.whole("spp_max", spp_max, 0, limits.MAX_SPP)
        spp_min, seed = limits.whole("spp_min", spp_min, 0, limits.MAX_SPP), limits.whole("seed", seed, 0, limits.MAX_SEED)
        time_budget_s = limits.real("time_budget_s", time_budget_s, 0, limits.MAX_TIME_S)
        exposure, gamma = limits.positive("exposure", exposure), limits.positive("gamma", gamma)
        sample_clamp = limits.real("sample_clamp", sample_clamp, 0)
        rects = (abi.Rect * len(blocks))(*[abi.Rect(*r) for r in blocks])
        flags = (abi.FRAME_RESTART * (self.open_frame > 0) | abi.FRAME_DETERMINISTIC * deterministic |
                 abi.FRAME_INDEPENDENT * independent | abi.FRAME_SHARED * shared)
        frame = abi.sized(abi.Frame, flags=flags, width=width, height=height, blocks=C.addressof(rects),
                          block_count=len(rects), block_stride=C.sizeof(abi.Rect),
                          planes=sum(1 << PLANES[name] for name in set(planes)), transfer=TRANSFERS[transfer], gamma=gamma,
                          exposure=exposure, sample_clamp=sample_clamp, time_budget_s=time_budget_s, spp_min=spp_min,
                          spp_max=spp_max, seed=seed, rgb_to_xyz=(C.c_double * 9)(*rgb_to_xyz))
        self._ask(self.info.table.begin_frame, C.addressof(frame))
        self.open_frame = next(self._frames)

    def evaluate(self, planes: Mapping[str, Plane], blocks: Sequence[BlockState], due: Sequence[int],
                 view: Optional[Rect] = None, elapsed_s: float = math.nan) -> list[Decision]:
        """Asks about blocks[i] for i in due; one Decision each, in that order.

        planes: by name, each over the pixels of `view` (default: from (0, 0) to the plane "color"'s size). blocks: the
        state of every block of the frame, in begin_frame's order.
        """
        if "color" not in planes:
            raise ValueError("the plane color is missing")
        if view is None:
            view = Rect(0, 0, planes["color"].array.shape[1], planes["color"].array.shape[0])
        table = (abi.Plane * abi.PLANE_COUNT)()
        for name, plane in planes.items():
            table[PLANES[name]] = plane.describe(name, view.height, view.width)
        states = (abi.Block * len(blocks))(*[
            abi.Block(i, abi.BLOCK_STOPPED * b.stopped | abi.BLOCK_FINAL * b.final, *b.rect, b.spp, b.half_spp, b.thread_s)
            for i, b in enumerate(blocks)])
        asked = (abi.Block * len(due))(*[states[i] for i in due])
        answers = (abi.Decision * len(due))(*[abi.Decision(0, 0, 0, math.nan, math.nan, math.nan) for _ in due])
        abi_view = abi.sized(abi.View, x0=view.x0, y0=view.y0, x1=view.x1, y1=view.y1, planes=C.addressof(table),
                             plane_count=abi.PLANE_COUNT, plane_stride=C.sizeof(abi.Plane), all=C.addressof(states),
                             all_count=len(states), all_stride=C.sizeof(abi.Block), elapsed_s=elapsed_s)
        self._ask(self.info.table.evaluate, C.addressof(abi_view), C.addressof(asked), C.sizeof(abi.Block),
                  C.addressof(answers), C.sizeof(abi.Decision), len(due))
        return [Decision(a.action == abi.STOP, a.next_spp, a.p_noisy, a.predicted_spp, a.error,
                         bool(a.flags & abi.DECISION_TOO_EARLY), bool(a.flags & abi.DECISION_BAD_INPUT)) for a in answers]

    def _state(self) -> Optional[abi.State]:
        address = self.info.table.get_extension(abi.EXT_STATE)
        return abi.State.from_address(address) if address else None

    def save_state(self) -> bytes:
        """The history of the open frame; empty if the criterion keeps none."""
        state, out = self._state(), bytearray()
        if state is None:
            return b""

        def write(_writer, data, size: int) -> int:
            out.extend(C.string_at(data, size))
            return abi.OK
        writer = abi.sized(abi.Writer, write=abi.WriteFn(write))
        self._ask(state.save, C.addressof(writer))
        return bytes(out)

    def load_state(self, data: bytes) -> None:
        """Puts a saved history into a frame opened like the saved one. Refused data (LullError) changes nothing."""
        state, at = self._state(), 0
        if state is None:
            if data:
                raise LullError(abi.E_IO, f"criterion {self.info.id} keeps no state, but there is one to load")
            return

        def read(_reader, to, size: int) -> int:
            nonlocal at
            if size > len(data) - at:
                return abi.E_IO
            C.memmove(to, data[at:at + size], size)
            at += size
            return abi.OK
        reader = abi.sized(abi.Reader, read=abi.ReadFn(read))
        self._ask(state.load, C.addressof(reader))

    def end_frame(self) -> None:
        """Forgets the frame."""
        with self._alone():
            if self._instance is not None:
                self.info.table.end_frame(self._instance)
            self.open_frame = 0

    def close(self) -> None:
        """Frees the instance; nothing happens the second time."""
        with self._alone():
            instance, self._instance, self.open_frame = self._instance, None, 0
            if instance is not None:
                self.info.table.destroy(instance)

    def __reduce_ex__(self, _protocol):  # what copy and pickle go by
        raise TypeError(f"criterion {self.info.id}: an instance cannot be copied, as both would free it: make another one, "
                        "with_parameters()")

    def __enter__(self) -> Criterion:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_instance", None) is not None:
            self.close()


def _plane_names(mask: int) -> frozenset[str]:
    return frozenset(name for name, bit in PLANES.items() if mask >> bit & 1)
