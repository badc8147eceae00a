# SPDX-License-Identifier: MIT
"""A frame of the host library (lull/host.h): its blocks and totals, when to ask about which, limits, state, report. For
renderers that keep their own film; lull.Frame is one with sums in numpy."""
from __future__ import annotations

import contextlib
import ctypes as C
import functools
import weakref
from typing import Iterator, Mapping, Optional, Sequence, Union

import numpy as np

from . import abi, limits
from .criterion import PLANES, Criterion, Handle, Plane, Rect
from .library import Info, LullError, bytes_of, call, encoded, library

TRANSFERS = {"linear": abi.TRANSFER_LINEAR, "srgb": abi.TRANSFER_SRGB, "gamma": abi.TRANSFER_GAMMA}
MAX_PIXELS, MAX_BLOCKS = 1 << 28, 1 << 20  # a block is an object here: more would fill the memory


@functools.lru_cache(maxsize=None)
def reasons() -> tuple[str, ...]:
    """Why a block gets no more samples: "none" (it does), "criterion", "spp-max" …; the index is what the EXR holds."""
    return tuple(library().lull_host_reason(i).decode() for i in range(abi.REASON_COUNT))


class Block(abi.HostBlock):
    """One block, in the library's memory: the fields of struct lull_host_block. A host writes spp, half_spp, thread_s and
    dropped; predicted_spp, p_noisy and error are the last answer's, NaN = not known."""
    frame: Handle  # keeps the memory

    @property
    def rect(self) -> Rect:
        """Its pixels in the picture."""
        return Rect(self.x0, self.y0, self.x1, self.y1)

    @property
    def active(self) -> bool:
        """It gets samples."""
        return abi.HostBlock.reason.__get__(self) == abi.REASON_NONE

    @property
    def reason(self) -> str:
        """One of reasons(): why it gets no more samples."""
        return reasons()[abi.HostBlock.reason.__get__(self)]


class Totals(abi.HostTotals):
    """Sums over the run (struct lull_host_totals); seconds are wall seconds, but criterion_thread_s: processor seconds."""

    @property
    def elapsed_s(self) -> float:
        """Wall seconds of rendering and of checks."""
        return self.render_s + self.criterion_s


class HostFrame:
    """Blocks of a picture, and the criterion that is asked about them. Opens the criterion's frame; if one is open on it,
    this frame makes an instance of its own.

    planes: names of those that every check will be given, "color" among them. block: pixels, one number or (width, height);
    default the criterion's own size, else 200, or less where that would be fewer than 12 blocks. crop: blocks that it
    touches are rendered whole. layout: disjoint rectangles instead of a grid. Limits, the first one wins: spp_max samples,
    time_budget_s seconds (0 = any); spp_min: nobody stops before. uniform: every block gets spp_max samples and the
    criterion is asked once at the end. max_check_overhead: share of the time that checks may take, 0 = any. max_seam: most
    ratio of samples of neighbouring blocks, 0 = any. check_step: checks stand at multiples of so many samples. mask:
    [height, width] in [0, 1], black leaves the criterion's quality parameter as it is, white
    takes a quarter of it, grey g 4^(-g), in steps of an eighth; the lightest pixel of a block counts. exposure: linear
    factor before the display transfer ("srgb", "linear", "gamma"). independent: a pixel's samples are not stratified.
    shared: neighbouring pixels share samples (a splatted filter). open_ended: checks stand where they would without
    spp_max. rgb_to_xyz: nine numbers, row by row; all 0: linear sRGB.
    view: the rectangle of pixels that planes hold, all blocks among them. first_spp: samples at the first check, at least.
    """

    def __init__(self, criterion: Criterion, width: int, height: int, planes: Sequence[str], *,
                 block: Union[int, tuple[int, int], None] = None, crop: Optional[Rect] = None, layout: Sequence[Rect] = (),
                 spp_min: int = 16, spp_max: int = 10000, time_budget_s: float = 0.0, uniform: bool = False,
                 max_check_overhead: float = 0.0, max_seam: float = 0.0, check_step: int = 1,
                 mask: Optional[np.ndarray] = None, seed: int = 0, exposure: float = 1.0, transfer: str = "srgb",
                 gamma: float = 2.2, sample_clamp: float = 0.0, independent: bool = False, shared: bool = False,
                 deterministic: bool = True, open_ended: bool = False, rgb_to_xyz: Sequence[float] = (0.0,) * 9):
        self.criterion, self.planes = criterion, tuple(planes)
        self.width, self.height = limits.checked("width", width), limits.checked("height", height)
        if self.width * self.height > MAX_PIXELS:
            raise ValueError(f"a picture of {width}x{height}: expected at most 2^28 pixels in all")
        self.crop = Rect(*limits.rectangle("crop", (0, 0, width, height) if crop is None else crop))
        if self.crop.pixels == 0:
            raise ValueError(f"crop {','.join(map(str, self.crop))}: it is empty")
        size = self._block_size(block)
        if not isinstance(transfer, str) or transfer not in TRANSFERS:
            raise ValueError(f"transfer '{transfer}': expected one of {', '.join(TRANSFERS)}")
        given = {name: limits.checked(name, value) for name, value in (
            ("spp_min", spp_min), ("spp_max", spp_max), ("seed", seed), ("time_budget_s", time_budget_s),
            ("max_check_overhead", max_check_overhead), ("max_seam", max_seam), ("exposure", exposure), ("gamma", gamma),
            ("sample_clamp", sample_clamp))}
        self.spp_min, self.spp_max, self.seed, self.time_budget_s = list(given.values())[:4]
        uniform, deterministic, independent, shared, open_ended = (limits.flag(name, value) for name, value in (
            ("uniform", uniform), ("deterministic", deterministic), ("independent", independent), ("shared", shared),
            ("open_ended", open_ended)))
        self.max_seam, self.check_step, self.uniform = given["max_seam"], limits.checked("check_step", check_step), uniform
        self.shown = {"exposure": given["exposure"], "transfer": transfer, "gamma": given["gamma"],
                      "sample_clamp": given["sample_clamp"], "independent": independent, "shared": shared}
        flags = (abi.HOST_UNIFORM * uniform | abi.FRAME_DETERMINISTIC * deterministic | abi.FRAME_INDEPENDENT * independent |
                 abi.FRAME_SHARED * shared | abi.HOST_OPEN_ENDED * open_ended)
        try:
            placed = [abi.Rect(*limits.rectangle(f"layout[{i}]", r)) for i, r in enumerate(layout)]
        except TypeError as error:
            raise error if "layout[" in str(error) else TypeError(f"layout {layout!r}: expected a list of rectangles") from None
        rects = (abi.Rect * len(placed))(*placed)
        painted = self._mask_plane(mask)
        self._begin(abi.sized(
            abi.HostConfig, flags=flags, width=self.width, height=self.height, block_width=size[0], block_height=size[1],
            crop=tuple(self.crop), layout=C.addressof(rects) if placed else None, layout_count=len(placed),
            layout_stride=C.sizeof(abi.Rect), planes=sum(1 << PLANES[name] for name in set(planes)),
            transfer=TRANSFERS[transfer], check_step=check_step,
            rgb_to_xyz=tuple(rgb_to_xyz), mask=C.addressof(painted) if painted else None, **given))

    def _block_size(self, block: Union[int, tuple[int, int], None]) -> tuple[int, int]:
        """(width, height), 0 = the library's choice."""
        if block is None:
            return 0, 0
        pair = block if isinstance(block, (tuple, list)) else (block, block)
        if len(pair) != 2:
            raise ValueError(f"block {block}: expected one number or (width, height)")
        w, h = (limits.checked("block", side) for side in pair)
        if -(-self.crop.width // w) * -(-self.crop.height // h) > MAX_BLOCKS:
            raise ValueError(f"a picture of {self.width}x{self.height} in blocks of {w}x{h}: expected at most 2^20 blocks: "
                             "take larger ones")
        return w, h

    def _mask_plane(self, mask: Optional[np.ndarray]) -> Optional[abi.Plane]:
        if mask is None:
            return None
        limits.unmasked("mask", mask)
        try:
            grey = np.ascontiguousarray(mask, np.float64)
        except (TypeError, ValueError):
            raise TypeError("mask: expected an array of numbers") from None
        if grey.shape != (self.height, self.width):
            raise ValueError(f"mask of shape {grey.shape}: expected the picture's, [{self.height}, {self.width}]")
        if not ((grey >= 0) & (grey <= 1)).all():
            raise ValueError("mask: expected values in [0, 1]")
        plane = Plane(grey).describe("mask", self.height, self.width)
        plane.kept = grey
        return plane

    def _begin(self, config: abi.HostConfig) -> None:
        used = self.criterion.frame
        self.judge = self.criterion.with_parameters() if used is not None and used() else self.criterion
        with self.judge.alone() as judge:
            self.handle = Handle("lull_host_end", self.judge.handle)  # a report tells of the criterion
            call("host_begin", C.byref(config), judge, C.byref(self.handle.pointer))
            self.judge.frame = weakref.ref(self.handle)
        self.layout = abi.HostBlocks.from_address(library().lull_host_blocks_of(self.handle.pointer))
        self.blocks: list[Block] = list((Block * self.layout.count).from_address(self.layout.list))
        for b in self.blocks:
            b.frame = self.handle
        self.totals = Totals.from_address(library().lull_host_totals_of(self.handle.pointer))
        self.totals.frame = self.handle
        self.view = Rect(self.layout.x0, self.layout.y0, self.layout.x1, self.layout.y1)
        self.first_spp = max(self.spp_min, self.criterion.needs.first_spp)

    @property
    def active(self) -> list[int]:
        """Indices of the blocks that still get samples."""
        return [i for i, b in enumerate(self.blocks) if b.active]

    @property
    def mask_factors(self) -> list[float]:
        """For each block, the factor that the mask gives the criterion's quality parameter."""
        return [library().lull_host_mask_factor(b.step) for b in self.blocks]

    # --- asking --------------------------------------------------------------------------------------------------------

    def planes_now(self, as_shown: bool = True) -> Mapping[str, Plane]:
        """What a criterion is shown where no planes are given; as_shown False: linear radiance in any case. "dropped" and
        "dropped_half" (uint32) are samples left out of the sums of each pixel."""
        raise ValueError("this frame keeps no picture: give the planes")

    def view_of(self, planes: Optional[Mapping[str, Plane]]) -> abi.HostView:
        """The view: planes by name, as they lie in memory; default the frame's own."""
        planes = dict(self.planes_now() if planes is None else planes)
        if "color" not in planes:
            raise ValueError("the plane color is missing")
        table, (height, width) = (abi.Plane * abi.PLANE_COUNT)(), (self.view.height, self.view.width)
        left_out = {name: planes.pop(name).describe(name, height, width) for name in ("dropped", "dropped_half")
                    if name in planes}
        for name, plane in planes.items():
            table[PLANES[name]] = plane.describe(name, height, width)
        view = abi.sized(abi.HostView, plane_count=abi.PLANE_COUNT, x0=self.view.x0, y0=self.view.y0, x1=self.view.x1,
                         y1=self.view.y1, planes=C.addressof(table),
                         **{name: C.addressof(plane) for name, plane in left_out.items()})
        view.kept = table, left_out, planes
        return view

    @contextlib.contextmanager
    def _asking(self) -> Iterator[C.c_void_p]:
        """The frame's own instance, alone; the error of a frame that was closed."""
        if not self._is_open():
            raise LullError(abi.E_STATE, f"criterion {self.judge.info.id}: this frame was closed: make a new Frame")
        with self.judge.alone() as pointer:
            yield pointer

    def _is_open(self) -> bool:
        return self.judge.frame is not None and self.judge.frame() is self.handle

    def check(self, planes: Optional[Mapping[str, Plane]] = None) -> None:
        """To be called when every active block is at its next_spp: asks about them, stops or schedules each. LullError when
        the criterion fails: all blocks go on. planes: by name, over the pixels of `view`, as they lie in memory."""
        view = self.view_of(planes)
        with self._asking():
            call("host_check", self.handle.pointer, C.byref(view))

    def due(self) -> tuple[list[int], list[bool]]:
        """The blocks to be asked about, rising, and which of them get no more samples; none: there is no question."""
        room = len(self.blocks)
        due, final = (C.c_uint32 * room)(), (C.c_uint8 * room)()
        count = library().lull_host_due(self.handle.pointer, due, final)
        return due[:count], [bool(value) for value in final[:count]]

    def ask(self, due: Sequence[int], final: Sequence[bool],
            planes: Optional[Mapping[str, Plane]] = None) -> list[abi.Decision]:
        """The criterion's answers about the blocks that are due; nothing is noted."""
        view, count = self.view_of(planes), len(due)
        answers = (abi.Decision * max(count, 1))()
        with self._asking():
            call("host_ask", self.handle.pointer, C.byref(view), (C.c_uint32 * max(count, 1))(*due),
                 (C.c_uint8 * max(count, 1))(*final), count, answers)
        return list(answers[:count])

    def apply(self, due: Sequence[int], answers: Sequence[abi.Decision]) -> None:
        """Notes the answers, stops or schedules each block, and re-opens some if max_seam says so."""
        count = len(due)
        library().lull_host_apply(self.handle.pointer, (C.c_uint32 * max(count, 1))(*due), count,
                                  (abi.Decision * max(count, 1))(*answers))
        library().lull_host_reopen(C.byref(self.layout), C.c_double(self.max_seam))

    def stop(self, reason: int, planes: Optional[Mapping[str, Plane]] = None) -> None:
        """Closes the active blocks (reason: abi.REASON_TIME or REASON_INTERRUPT); the criterion is asked once more about
        them, for the report."""
        reason, view = limits.checked("reason", reason), self.view_of(planes)
        with self._asking():
            call("host_stop", self.handle.pointer, reason, C.byref(view))

    def evaluate(self, due: Sequence[int], planes: Optional[Mapping[str, Plane]] = None,
                 criterion: Optional[Criterion] = None) -> list[abi.Decision]:
        """Asks about blocks[i] for i in due, rising; nothing is noted. criterion: a new one instead of the frame's own."""
        view, count = self.view_of(planes), len(due)
        answers = (abi.Decision * max(count, 1))()
        with criterion.alone() if criterion else self._asking() as judge:
            if criterion:
                call("host_join", self.handle.pointer, judge)
            call("host_evaluate", judge, self.handle.pointer, C.byref(view), (C.c_uint32 * max(count, 1))(*due), None, count,
                 answers)
        return list(answers[:count])

    def quote(self, threads: int, noisy: Optional[Info] = None) -> list[abi.HostQuoteRow]:
        """What the frame costs by its own and other settings of the quality parameter: struct lull_host_quote_row for each,
        without its blocks (lull_host_quote_usual); also after close(). threads: of the renderer. noisy: the criterion of
        the noisy picture, where the frame's own is `denoised`."""
        threads = limits.checked("threads", threads)
        view, rows, count = self.view_of(None), C.POINTER(abi.HostQuoteRow)(), C.c_uint32()
        with self._asking() if self._is_open() else contextlib.nullcontext():
            quote = Handle("lull_host_quote_end", self.handle)
            call("host_quote_begin", self.handle.pointer, threads, C.byref(quote.pointer))
            call("host_quote_usual", quote.pointer, C.c_void_p(noisy.table if noisy else None))
            call("host_quote_finish", quote.pointer, C.byref(view), C.byref(rows), C.byref(count))
            return [abi.HostQuoteRow.from_buffer_copy(row) for row in rows[:count.value]]

    def forecast(self, threads: int) -> abi.HostForecast:
        """What is left: struct lull_host_forecast. threads: of the renderer."""
        threads, forecast = limits.checked("threads", threads), abi.HostForecast()
        call("host_forecast_of", C.byref(self.layout), C.byref(self.totals), threads, C.byref(forecast))
        return forecast

    # --- state ---------------------------------------------------------------------------------------------------------

    def save_state(self) -> bytes:
        """Blocks, totals and the criterion's history."""
        with self.judge.alone():
            return bytes_of("host_save", self.handle.pointer)

    def load_state(self, data: bytes, name: str = "state") -> None:
        """Into a frame like the saved one, limits aside: blocks that a limit or an interrupt had closed are active again as
        far as the limits of this frame allow. name: of the file, for messages. Refused bytes (LullError) change nothing."""
        with self.judge.alone():
            call("host_load", self.handle.pointer, data, C.c_uint64(len(data)), encoded(name))
            library().lull_host_extend(C.byref(self.layout))

    def close(self) -> None:
        """Ends the criterion's frame; blocks, totals and report stay readable."""
        if self._is_open():
            self.judge.frame = None
        if self.judge is not self.criterion:
            self.judge.close()
