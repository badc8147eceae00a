# SPDX-License-Identifier: MIT
"""A picture in an image viewer while it is made.

    lull.Driver(frame, render, display_server="localhost").run()       # tev or HDRView shows it, as it grows

The library sends what changes from a thread of its own; a viewer that is slow, gone or not there yet holds nobody up.
"""
from __future__ import annotations

import ctypes as C

from .host import HostFrame
from .library import call, encoded, library


class Display:
    """address: "HOST" or "HOST:PORT", of the viewer (port 14158). name: of the image there. frame: one that keeps its
    picture. LullError where there is no such host; whether there is a viewer makes no difference."""

    def __init__(self, frame: HostFrame, address: str, name: str = "lull"):
        self.frame, self._pointer = frame, C.c_void_p()
        call("host_display_open", frame.handle.pointer, address.encode(), encoded(name), C.byref(self._pointer))

    def update(self) -> None:
        """Between samples, as often as one likes: it copies what has changed four times a second at most."""
        if self._pointer:
            call("host_display_update", self._pointer, C.byref(self.frame.view_of(None)))

    def close(self) -> bool:
        """Sends the last picture, for two seconds at most. Did the viewer take it?"""
        return self._end(C.byref(self.frame.view_of(None)))

    def watch(self, _driver: object, result: object) -> None:
        """For Driver.watchers."""
        if result:
            self.close()
        else:
            self.update()

    def _end(self, view: object) -> bool:
        pointer, self._pointer = self._pointer, C.c_void_p()
        return bool(pointer) and library().lull_host_display_close(pointer, view) == 1

    def __del__(self) -> None:
        self._end(None)
