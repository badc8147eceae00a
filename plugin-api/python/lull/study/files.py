# SPDX-License-Identifier: MIT
"""Files and JSON: what is refused, how it is written. A file is a temporary beside its name until it is whole and synced."""
from __future__ import annotations

import contextlib
import json
import math
import os
import re
import stat
from typing import Any, Iterator, TextIO

from ..program import Refused


# --- JSON ---

def _no_constant(word: str) -> None:
    raise ValueError(f"{word} is no JSON")


def loads(text: str | bytes) -> Any:
    """ValueError for all that is no JSON, text that is no Unicode included."""
    try:
        value = json.loads(text, parse_constant=_no_constant)
        json.dumps(value, ensure_ascii=False).encode()  # half a surrogate pair is no text
        return value
    except RecursionError:
        raise ValueError("nested too deeply") from None


def _number(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    if not math.isfinite(value):
        return "null"
    if value == int(value) and abs(value) < 2**53:
        return str(int(value))
    return repr(value)


def print_json(value: Any, pretty: bool, depth: int = 0) -> str:
    """As cJSON lays it out, so that files of before look the same. What is not known (NaN) is null."""
    if isinstance(value, dict):
        line, tabs, after = ("\n", "\t" * (depth + 1), ":\t") if pretty else ("", "", ":")
        members = [f"{tabs}{json.dumps(k, ensure_ascii=False)}{after}{print_json(v, pretty, depth + 1)}"
                   for k, v in value.items()]
        return "{" + line + f",{line}".join(members) + (line if members else "") + tabs[1:] + "}"
    if isinstance(value, (list, tuple)):
        return "[" + (", " if pretty else ",").join(print_json(v, pretty, depth + 1) for v in value) + "]"
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return _number(value)
    return json.dumps(value, ensure_ascii=False)


# --- reading ---

def _open(path: str, flags: int) -> int:
    """Waits for nothing, as a FIFO that nobody writes to would; a shell's <(…) or | ends with its writer."""
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return descriptor
    if stat.S_ISFIFO(mode) and os.path.realpath(path).startswith("/proc/"):
        os.set_blocking(descriptor, True)
        return descriptor
    os.close(descriptor)
    raise Refused(f"{path}: not a regular file")


def read_file(path: str, most: int) -> bytes:
    try:
        with open(path, "rb", opener=_open) as file:
            data = file.read(most + 1)
    except OSError as error:
        raise Refused(f"{path}: {error.strerror}") from None
    if len(data) > most:
        raise Refused(f"{path}: larger than {most} bytes")
    return data


def lines_of(path: str, text: str) -> list[str]:
    """As Lull's programs read tables (base/text.h): lines end in LF, CR LF or CR, each as it likes."""
    lines = re.split("\r\n|\r|\n", text.removeprefix("\ufeff"))
    bad = next((i for i, line in enumerate(lines, 1) if "\0" in line), 0)
    if bad:
        raise Refused(f"{path}:{bad}: has a byte 0 (expected a line of text, in UTF-8)")
    return lines


# --- writing ---

def check_output(path: str) -> str:
    """The file behind `path`, if it can be written: links are followed, also to where no file is yet."""
    target = os.path.realpath(path)
    if not os.path.basename(path):
        raise Refused(f"{path}: not the name of a file")
    if os.path.exists(target) and not os.path.isfile(target):
        raise Refused(f"{path}: cannot write there: "
                      f"{'it is a folder' if os.path.isdir(target) else 'it is no regular file and would be replaced'}")
    folder = os.path.dirname(target)
    if not os.access(folder, os.W_OK | os.X_OK):
        why = "No such file or directory" if not os.path.isdir(folder) else "Permission denied"
        raise Refused(f"{path}: cannot write there: {why}")
    return target


@contextlib.contextmanager
def replaced(path: str) -> Iterator[TextIO]:
    """A text that becomes `path` at the end, on the disk; whatever goes wrong leaves what was there."""
    target = check_output(path)
    folder, name = os.path.split(target)
    made = os.path.join(folder, f".tmp-lull{os.getpid()}-0.{name[-100:]}")  # which Lull's programs sweep away when we are gone
    try:
        descriptor = os.open(made, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise Refused(f"{path}: cannot write there: {error.strerror}") from None
    try:
        with open(descriptor, "w", encoding="utf-8", newline="\n") as file:
            yield file
            file.flush()
            with contextlib.suppress(OSError):  # a file that is replaced keeps its permissions
                os.fchmod(file.fileno(), os.stat(target).st_mode & 0o777)
            os.fsync(file.fileno())
        os.replace(made, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            os.unlink(made)
        if isinstance(error, OSError):
            raise Refused(f"{path}: write failed: {error.strerror or error}") from None
        raise


def write_line(path: str, text: str) -> None:
    with replaced(path) as file:
        file.write(text + "\n")


def make_folder(path: str) -> None:
    try:
        os.mkdir(path)
    except OSError as error:
        if not os.path.isdir(path):
            raise Refused(f"{path}: {error.strerror}") from None


# --- what nothing may be written onto ---

OWN = ("study.json", "texts.json", "token", "study.db", "study.db-wal", "study.db-shm")


def is_inside(path: str, folder: str) -> bool:
    """By whatever name."""
    folder = os.path.realpath(folder)
    return os.path.commonpath([os.path.realpath(path), folder]) == folder


def protect(folder: str, output: str) -> None:
    """Refuses an output that would replace a file of the study in `folder`, by whatever name, or take the name of one that
    is made later. Reports and exports may lie beside them."""
    target = os.path.realpath(output)
    if is_inside(output, os.path.join(folder, "stimuli")):
        raise Refused(f"{output}: lies among the pictures that the study shows")
    for name in OWN:
        own = os.path.realpath(os.path.join(folder, name))
        if target == own or (os.path.exists(target) and os.path.exists(own) and os.path.samefile(target, own)):
            raise Refused(f"{output}: this is the study's own {name}, it would be lost")
