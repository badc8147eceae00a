# SPDX-License-Identifier: MIT
"""A file in memory that Blender writes and we read."""
import contextlib
import os
from typing import Iterator


@contextlib.contextmanager
def unnamed_file() -> Iterator[str]:
    """Its path, for this process. It has no name in any folder, so that it is gone with the process however that ends."""
    handle = os.memfd_create("lull")
    try:
        yield f"/proc/self/fd/{handle}"
    finally:
        os.close(handle)
