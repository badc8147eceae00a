# SPDX-License-Identifier: MIT
"""Files that are written: known before the work whether they can be, and under their names only when they are complete.

The rules and the words are the path tracer's (plugin-api/base/files.h, outputs.h): a symbolic link is followed, only a
regular file is replaced, no two outputs are one file, none is an input. A temporary is locked while its process lives;
those that a killed process left in a folder are removed when the next output there is checked.
"""
from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import stat
import tempfile
from typing import BinaryIO, Callable, Iterable, Iterator, NamedTuple, Sequence

_PREFIX = ".tmp-lull"  # .tmp-lullPID-N.NAME
_LINKS_MAX, _TRIES_MAX, _NAME_KEPT = 40, 100, 180


class Output(NamedTuple):
    """A file to be written. option: what asked for it, for messages; endings: those its name may have, () = any."""
    option: str
    path: str
    endings: Sequence[str] = ()


# --- before the work -------------------------------------------------------------------------------------------------------


def _target(path: str) -> str:
    """The file that writing to `path` changes: links are followed, also to where no file is yet."""
    at = path
    for _ in range(_LINKS_MAX):
        try:
            at = os.path.join(os.path.dirname(at), os.readlink(at))
        except OSError:
            return at
    raise OSError(f"{path}: {os.strerror(errno.ELOOP)}")


def _sweep(folder: str) -> None:
    """Removes the temporaries of processes that are gone. One on another machine, or in another container, holds its
    lock."""
    for name in os.listdir(folder) if os.access(folder, os.R_OK) else ():
        pid, dash, _ = name[len(_PREFIX):].partition("-")
        if not name.startswith(_PREFIX) or not dash or not pid.isdigit():
            continue
        with contextlib.suppress(OSError, OverflowError):
            try:
                os.kill(int(pid), 0)
            except ProcessLookupError:
                path = os.path.join(folder, name)
                handle = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    os.unlink(path)
                finally:
                    os.close(handle)


def _checked(path: str) -> str:
    """The file behind `path`; OSError if it cannot be written."""
    target = _target(path)
    if not os.path.basename(target):
        raise OSError(f"{path}: not the name of a file")
    folder = os.path.dirname(target) or "."
    try:
        os.stat(os.path.join(folder, ""))
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        with contextlib.suppress(FileNotFoundError):
            kind = os.stat(target).st_mode
            if not stat.S_ISREG(kind):
                why = "it is a folder" if stat.S_ISDIR(kind) else "it is no regular file and would be replaced"
                raise OSError(errno.EEXIST, why)
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise OSError(f"{path[:64]}...: the path is too long") from None
        raise OSError(f"{path}: cannot write there: {error.strerror}") from None
    _sweep(folder)
    return target


def _same(a: str, b: str) -> bool:
    """Are two targets one file, or will they be?"""
    if os.path.exists(a) or os.path.exists(b):
        return os.path.exists(a) and os.path.exists(b) and os.path.samefile(a, b)
    return (os.path.basename(a) == os.path.basename(b) and
            os.path.samefile(os.path.dirname(a) or ".", os.path.dirname(b) or "."))


def check_outputs(outputs: Iterable[Output], inputs: Iterable[str] = ()) -> None:
    """OSError or ValueError, one line, for the first one that cannot be written, is written twice, or is an input. Those
    whose path is empty are none."""
    seen: list[tuple[Output, str]] = []
    read = [path for path in inputs if os.path.exists(path)]
    for o in (o for o in outputs if o.path):
        if o.endings and not any(o.path.lower().endswith(e) and os.path.basename(o.path).lower() != e for e in o.endings):
            raise ValueError(f"{o.option} {o.path}: expected a name that ends in {' or '.join(o.endings)}")
        target = _checked(o.path)
        for other, there in seen:
            if _same(target, there):
                raise ValueError(f"{o.option} {o.path}: the same file as {other.option} {other.path}, "
                                 "one of the two would be lost")
        for path in read:
            if os.path.exists(target) and os.path.samefile(target, path):
                raise ValueError(f"{o.path}: this is an input ({path}), it would be overwritten")
        seen.append((o, target))


# --- writing ---------------------------------------------------------------------------------------------------------------


def _create(target: str) -> tuple[int, str]:
    """A new temporary beside the target, locked; one that somebody swept away in between is made again."""
    folder, name = os.path.split(target)
    for n in range(_TRIES_MAX):
        path = os.path.join(folder, f"{_PREFIX}{os.getpid()}-{n}.{name[-_NAME_KEPT:]}")
        with contextlib.suppress(FileExistsError):
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(handle).st_nlink > 0:
                return handle, path
            os.close(handle)
    raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))


@contextlib.contextmanager
def replaced(path: str) -> Iterator[BinaryIO]:
    """A file beside `path` that becomes it at the end, on the disk; an exception leaves what was there. OSError says which
    file could not be written."""
    target = _checked(path)
    temporary = ""
    try:
        handle, temporary = _create(target)
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            try:
                os.fsync(handle)
            except OSError as error:
                if error.errno != errno.EINVAL:  # a file system without fsync
                    raise
            os.replace(temporary, target)
            temporary = ""
    except OSError as error:
        raise OSError(f"{path}: write failed: {error.strerror or error}") from error
    finally:
        if temporary:
            with contextlib.suppress(OSError):
                os.unlink(temporary)


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
