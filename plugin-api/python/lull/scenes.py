# SPDX-License-Identifier: MIT
"""The one call that renders a scene of another renderer, and its price: what lull.mitsuba and lull.luxcore share."""
from __future__ import annotations

import abc
import contextlib
import os
import struct
import zlib
from typing import Any, Callable, Iterable, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np

from . import checkpoint as checkpoints
from . import denoising, limits
from . import quote as quotes
from .criterion import Criterion, Rect, load
from .denoising import Denoised
from .driver import Driver, Result
from .files import Output, check_outputs
from .frame import Frame
from .library import LullError, encoded
from .program import open_closed, say


class Picture(NamedTuple):
    """What render gives back: image [height, width, 3] linear, spp [height, width] uint32, layers: alpha ("A") and others by
    the film's names, [height, width] float64. unsaved: why the checkpoint could not be written, if so. denoised: over the
    view, if it was asked for, and then image is its picture; undenoised: why that failed, if so."""
    image: np.ndarray
    spp: np.ndarray
    result: Result
    driver: Driver  # for lull.outputs and lull.checkpoint
    layers: dict[str, np.ndarray]
    unsaved: Optional[OSError] = None
    denoised: Optional[Denoised] = None
    undenoised: Optional[LullError] = None


class Film(abc.ABC):
    """What a renderer brings: a context manager that puts back what it changed. crop: the part that is rendered; splats:
    neighbouring pixels share samples; layers, supplies: as Frame takes them. render gives "weight" with every sample."""
    width: int
    height: int
    crop: Rect
    splats: bool
    layers: Sequence[str]
    supplies: Sequence[str]

    def __enter__(self) -> Film:
        return self

    def __exit__(self, *_: object) -> None:
        """Where nothing was changed."""

    def check_waves(self, wave: int, spp_max: int) -> None:
        """ValueError if waves of this size, or the one that is left at the end, cannot be rendered."""
        limits.checked("wave", wave), limits.checked("spp_max", spp_max)

    @abc.abstractmethod
    def identity(self) -> dict[str, str]:
        """What the samples depend on, for the checkpoint."""

    @abc.abstractmethod
    def render(self, rects: Sequence[Rect], first: int, count: int, half: bool) -> Iterable[Mapping[str, np.ndarray]]:
        """The driver's render function."""


def seed_of(seed: int, first: int, r: Rect) -> int:
    """The seed of one wave of one block, below 2^32: no sample depends on what else is rendered with it."""
    return zlib.crc32(struct.pack("<QQii", seed, first, r.x0, r.y0))


def print_line(line: str) -> None:
    """To stderr."""
    say(f"lull: {line}")


def quote(render_scene: Callable[..., Picture], criterion: Union[str, Criterion], settings: Mapping[str, Any]) -> str:
    """A table of what the quality parameter will cost, and coarser and finer ones, from a pilot of 128 samples or 30
    seconds. render_scene: called with the criterion and settings, as a host's render takes them; with checkpoint=, its
    render(…, resume=True) goes on from the pilot, nothing is lost."""
    def look(driver: Driver) -> None:
        if quotes.pilot_done(driver):
            driver.interrupt()
    picture = render_scene(criterion, **{**settings, "after_call": look, "tell": None})
    if picture.result.exception:
        raise picture.result.exception
    if picture.unsaved:
        raise picture.unsaved
    return quotes.table(picture.driver)


def render(open_film: Callable[[], Film], criterion: Union[str, Criterion], *, seed: int, wave: int, denoise: str,
           read_mask: Callable[[str], np.ndarray], spp_min: int = 16, spp_max: int = 1024, time_budget_s: float = 0.0,
           block: Optional[int] = None, mask: Union[np.ndarray, str, os.PathLike[str], None] = None, checkpoint: str = "",
           resume: bool = False, checkpoint_every_s: float = 60.0, after_call: Optional[Callable[[Driver], None]] = None,
           tell: Optional[Callable[[str], None]] = print_line, display_server: str = "", **parameters: Any) -> Picture:
    """Renders what open_film gives; each block until the criterion stops it.

    criterion: a name, a path or a lull.Criterion, default observer, or denoised with denoise="blend" or "full", which keeps
    the denoised picture (docs/denoised.md); parameters are its own (threshold=…). mask: an array, or the path of a PNG,
    which read_mask reads. checkpoint: a file that keeps the state at the end, however it ends, and every checkpoint_every_s
    seconds; resume: goes on from it, if it is there; with a higher spp_max a finished picture gets more samples. tell: is
    given one line at the first check, what the quality parameter costs and what coarser ones would (default: it is printed
    to stderr; None: no line). display_server: "HOST:PORT" of an image viewer (lull.display). An exception while rendering
    is not raised: see Picture.result. Raises LullError, ValueError, TypeError and OSError for bad input, before anything
    is rendered.
    """
    open_closed()
    mask = os.fspath(mask) if isinstance(mask, os.PathLike) else mask
    if resume and not checkpoint:
        raise ValueError("resume: there is no checkpoint to go on from: name one with checkpoint=")
    if checkpoint:
        check_outputs([Output("checkpoint", checkpoint)], [mask] if isinstance(mask, str) else [])
        checkpoints.check(checkpoint)
    usual, library = denoising.criterion_of(denoise), str(parameters.get("library", ""))
    if denoise:
        denoising.check(library)
        parameters = denoising.parameters_of(denoise, criterion or usual, parameters)
    shades = read_mask(mask) if isinstance(mask, str) else mask
    with contextlib.ExitStack() as stack:
        judge = (criterion if isinstance(criterion, Criterion) else
                 stack.enter_context(load(criterion or usual, **parameters)))
        film = stack.enter_context(open_film())
        film.check_waves(wave, spp_max)
        frame = Frame(judge, film.width, film.height, block=block, crop=film.crop, spp_min=spp_min, spp_max=spp_max,
                      time_budget_s=time_budget_s, deterministic=time_budget_s <= 0, seed=seed, independent=True,
                      shared=film.splats, weighted=True, wave=wave, supplies=film.supplies, layers=film.layers,
                      mask=shades, denoised=bool(denoise))
        stack.callback(frame.close)
        driver = Driver(frame, film.render, identity=film.identity() if checkpoint else None, after_call=after_call,
                        display_server=display_server)
        if tell:
            driver.watchers.append(quotes.once_quoted(tell))
        kept = checkpoints.Keeper(checkpoint, driver, checkpoint_every_s) if checkpoint else None
        if resume and os.path.exists(encoded(checkpoint)):
            checkpoints.load(checkpoint, driver)
        result = driver.run()
    picture = Picture(frame.cropped(frame.mean()), frame.cropped(frame.spp()), result, driver,
                      {name: frame.cropped(frame.mean(name)) for name in film.layers}, kept.unsaved if kept else None)
    try:
        made = denoising.denoise(frame, full=denoise == "full", library=library) if denoise else None
    except LullError as error:
        return picture._replace(undenoised=error)
    return picture._replace(image=frame.cropped(made.picture), denoised=made) if made else picture
