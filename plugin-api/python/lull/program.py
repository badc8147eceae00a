# SPDX-License-Identifier: MIT
"""How every program in Python begins and ends, as those in C do. Its standard streams may be closed, full, a pipe that nobody reads, or
of a locale that lacks a letter: the work goes on, and what did not get out is said at the end, in one line. Imports nothing of lull."""
from __future__ import annotations

import codecs
import contextlib
import errno
import io
import os
import signal
import sys
from typing import Callable, Iterator, Optional, TextIO

INTERRUPTED, UNREAD = 128 + signal.SIGINT, 128 + signal.SIGPIPE


class Refused(Exception):
    """One line for people: bad usage, bad input, or an output that cannot be written. Exit status 2."""


class _Stream(io.TextIOWrapper):
    """Standard output or error, which remembers what went wrong: work that is under way is worth more than what it says."""
    failed: Optional[OSError] = None

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError as error:
            self.failed = self.failed or error
            return len(text)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            self.failed = self.failed or error


def _spelt(error: UnicodeError) -> tuple[bytes, int]:
    """Letters that a stream's character set lacks: bytes of names that are no text as they are, others as \\u…."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start:error.end]
    return b"".join(bytes([ord(c) - 0xdc00]) if "\udc80" <= c <= "\udcff" else c.encode("ascii", "backslashreplace")
                    for c in letters), error.end


codecs.register_error("lull", _spelt)


def _stream(descriptor: int, before: Optional[TextIO]) -> _Stream:
    encoding = before.encoding if before else sys.getfilesystemencoding()
    return _Stream(io.BufferedWriter(io.FileIO(descriptor, "w", closefd=False)), encoding, "lull", line_buffering=descriptor == 2)


def _know_all_letters() -> None:
    """In a locale of ASCII names are UTF-8, as for the programs in C: Python must be told so before it begins."""
    words = getattr(sys, "orig_argv", [])  # from Python 3.10 on
    if words and sys.executable and codecs.lookup(sys.getfilesystemencoding()).name == "ascii":
        os.execv(sys.executable, [words[0], "-X", "utf8", *words[1:]])


def open_closed() -> None:
    """Standard streams that are closed are then open for nothing: else files would get their numbers, and what is said would go into
    them. Whoever uses one fails as before."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_WRONLY if descriptor == 0 else os.O_RDONLY), True)


@contextlib.contextmanager
def _streams() -> Iterator[None]:
    open_closed()
    before = sys.stdout, sys.stderr
    if sys.stdout is sys.__stdout__:  # else a caller has put something in its place
        sys.stdout = _stream(1, sys.stdout)
    if sys.stderr is sys.__stderr__:
        sys.stderr = _stream(2, sys.stderr)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _end(command: str, status: int, why: str) -> int:
    sys.stdout.flush()
    failed = getattr(sys.stdout, "failed", None)
    unread = failed is not None and failed.errno == errno.EPIPE  # whoever reads a pipe may stop, as head does
    if failed and not unread and not why:
        status, why = status or 2, "cannot write standard output"
    if why:
        print(f"{command}: {why}", file=sys.stderr)
    sys.stderr.flush()
    return status or (UNREAD if unread else 0)


def _lacks_stack() -> str:
    """Why the libraries that draw would end by a signal: they take half a megabyte of the stack. Its limit is raised if it
    may be."""
    import resource  # not on Windows, whose Blender loads this file, too
    usual, least = 8 << 20, 1 << 20
    soft, hard = resource.getrlimit(resource.RLIMIT_STACK)
    if soft == resource.RLIM_INFINITY or soft >= least:
        return ""
    if hard != resource.RLIM_INFINITY and hard < least:
        return f"the stack may grow to {hard >> 10} KB only (ulimit -s): expected at least {least >> 10}"
    resource.setrlimit(resource.RLIMIT_STACK, (usual if hard == resource.RLIM_INFINITY else min(usual, hard), hard))
    return ""


def say(text: str, out: Optional[TextIO] = None, end: str = "\n") -> None:
    """Prints a line, if that can be: a render is worth more than what it says. out: default standard error."""
    out = out or sys.stderr
    if out is not None:  # it may be closed
        with contextlib.suppress(OSError, ValueError):
            print(text, file=out, end=end, flush=True)


def run(command: str, work: Callable[[], Optional[int]], packages: str = "") -> int:
    """Does the work and says what stopped it, in one line that begins with `command`. packages: how to get what it imports.
    The exit status: what the work returns, None being 0; 1 out of memory or of stack; 2 refused, or an output could not be written; 130
    interrupted; 141, as by SIGPIPE, where nobody reads its output to the end."""
    status, why = 0, ""
    with _streams():
        _know_all_letters()
        try:
            lacking = _lacks_stack() if packages else ""
            status, why = (1, lacking) if lacking else (work() or 0, "")
        except Refused as error:
            status, why = 2, str(error)
        except ImportError as error:
            if not packages:
                raise
            status, why = 2, f"{error.name} is needed: {packages}"
        except MemoryError:
            status, why = 1, "out of memory"
        except SystemExit as end:  # of --help, of a refused command line
            status = end.code if isinstance(end.code, int) else 0
        except KeyboardInterrupt:
            status = INTERRUPTED
        except OSError as error:
            where = error.filename or ("the current folder" if error.errno == errno.ENOENT else "")  # os.getcwd names nothing
            status, why = 2, f"{where}: {error.strerror}" if where else f"{error.strerror or error}"
        return _end(command, status, why)
