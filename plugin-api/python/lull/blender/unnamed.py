# SPDX-License-Identifier: MIT
"""A file in memory that Blender writes and we read. It has no name in any folder, so that it is gone with the process
however that ends; elsewhere than on Linux it lies in a temporary folder."""
from __future__ import annotations

import os
import shutil
import tempfile


class UnnamedFile:
    """path: for one writer and one reader of this process. Use as a context manager, or close it."""

    def __init__(self) -> None:
        self._folder, self._handle = "", -1
        if hasattr(os, "memfd_create"):
            self._handle = os.memfd_create("lull")
            self.path = f"/proc/self/fd/{self._handle}"
        else:
            self._folder = tempfile.mkdtemp(prefix="lull-")
            self.path = os.path.join(self._folder, "file")

    def close(self) -> None:
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)
        elif self._handle >= 0:
            os.close(self._handle)
        self._folder, self._handle = "", -1

    def __enter__(self) -> UnnamedFile:
        return self

    def __exit__(self, *_) -> None:
        self.close()
