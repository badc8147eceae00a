# SPDX-License-Identifier: MIT
"""Runs criteria that are Python files (docs/python-criterion.md): in a python3 of their own, which plugin-api/script/script.c
starts with this text as its program, or in the process of a host that is Python. Needs numpy and nothing else of the package.

A file has `requires`, a list of planes, and `check(block)`; perhaps `uses`, `first_spp`, `limit_s`, `name`, `description` and
`parameters`, a dict of defaults, in which check finds what the user has set.
"""
from __future__ import annotations

import os
import sys

if __name__ == "__main__":  # of the variables of other Pythons (-E) this one; not the folder that a renderer was started in
    sys.path = [folder for folder in (*os.environ.get("PYTHONPATH", "").split(":"), *sys.path) if folder]

import contextlib  # noqa: E402
import ctypes as C  # noqa: E402
import hashlib  # noqa: E402
import linecache  # noqa: E402
import math  # noqa: E402
import re  # noqa: E402
import signal  # noqa: E402
import traceback  # noqa: E402
import types  # noqa: E402
from collections import namedtuple  # noqa: E402
from typing import Any, Iterator  # noqa: E402

try:
    import numpy as np
    NEEDED = ""
except ImportError as missing:
    NEEDED = f"a criterion in Python needs numpy, which {sys.executable} does not have ({missing}); LULL_PYTHON names another python3"

OPEN, CHECK, CLOSE = range(3)
E_INVALID, E_IO, E_INTERNAL = -1, -7, -11
PLANES = {"color": 3, "weight": 1, "spp": 1, "moment2": 1, "half": 3, "albedo": 3, "normal": 3, "depth": 1}  # channels, in the ABI's order
PARAMETERS_MAX, TEXT, LIMIT_S = 16, 1 << 16, 60
INT, FLOAT, BOOL, _CHOICE, _FILE, TEXT_PARAMETER = range(6)
MEMORY, CALLER, LIFE = 3, 4, 5  # descriptors
_F_SETSIG = 10  # Linux's; the module fcntl does not name it
_FINAL = 2


def _fields(text: str) -> list[tuple[str, Any]]:
    kinds = {"i32": C.c_int32, "u32": C.c_uint32, "u64": C.c_uint64, "f64": C.c_double, "ptr": C.c_void_p}
    groups = [group.split() for group in text.split(";")]
    return [(name, kinds[kind]) for kind, *names in groups for name in names]


class FrameFields(C.Structure):
    """struct lull_frame of lull/criterion.h."""
    _fields_ = _fields("u32 struct_size flags width height; ptr blocks; u32 block_count block_stride planes; i32 transfer; f64 gamma "
                       "exposure sample_clamp time_budget_s; u64 spp_min spp_max seed") + [("rgb_to_xyz", C.c_double * 9)]


class BlockFields(C.Structure):
    """struct lull_block of lull/criterion.h."""
    _fields_ = _fields("u32 id flags; i32 x0 y0 x1 y1; u64 spp half_spp; f64 thread_s")


class Request(C.Structure):
    """struct request of script.c."""
    _fields_ = [*_fields("i32 kind code; u32 instance planes"), ("block", BlockFields), ("elapsed_s", C.c_double), ("frame", FrameFields),
                *_fields("u64 next_spp; f64 error predicted_spp; u32 stop planes_used param_count"),
                ("param_type", C.c_int32 * PARAMETERS_MAX), *_fields("u32 unused; u64 first_spp; f64 limit_s"), ("message", C.c_char * 504)]


Rect = namedtuple("Rect", "x0 y0 x1 y1")


class Refused(Exception):
    """What a script says makes no sense; at a line of it, 0: unknown."""

    def __init__(self, text: str, line: int = 0):
        super().__init__(text)
        self.line = line


class Block(types.SimpleNamespace):
    """What check gets: id, rect, spp, half_spp, thread_s, final, elapsed_s, frame (width, height, spp_min, spp_max, exposure,
    gamma, transfer, sample_clamp, time_budget_s, seed, flags, rgb_to_xyz) and each plane by its name, None where there is none:
    numpy float64, [height, width, 3] or [height, width]."""


class Script:
    """A file that was read, with its parameters."""

    def __init__(self, path: str, values: list[str]):
        self.path = path
        with open(path, "rb") as file:
            source = file.read()
        stem = re.sub(r"[^a-z0-9.]+", "-", os.path.splitext(os.path.basename(path))[0].lower()).strip("-.")
        self.id, self.version = stem[:63] or "script", hashlib.sha256(source).hexdigest()[:8]
        linecache.checkcache(path)
        self.module = types.ModuleType(f"lull_script_{made + 1}")
        self.module.__file__ = path
        sys.modules[self.module.__name__] = self.module  # dataclasses and others look there
        with self._neighbours():
            exec(compile(source, path, "exec"), vars(self.module))
        self.required, self.used = self._planes("requires"), self._planes("uses")
        self.check = self._of("check", callable, None, "a function")
        self.first_spp = self._of("first_spp", lambda n: type(n) is int and 1 <= n <= 10**15, 1, "an integer from 1 on")
        self.limit_s = self._of("limit_s", lambda s: type(s) in (int, float) and 0 < s <= 1e6, LIMIT_S, "seconds, up to 1e6")
        self.name = self._of("name", lambda t: isinstance(t, str) and t.strip(), self.id, "a text")
        self.description = self._of("description", lambda t: isinstance(t, str) and t.strip(), self.module.__doc__ or
                                    f"The Python file {os.path.basename(path)}.", "a text").strip()
        self.parameters = self._of("parameters", lambda p: isinstance(p, dict) and len(p) <= PARAMETERS_MAX, {},
                                   f"a dict of at most {PARAMETERS_MAX} names and defaults")
        self.kinds = [self._kind(name, preset) for name, preset in self.parameters.items()]
        self.defaults = [str(int(v) if kind == BOOL else v) for kind, v in zip(self.kinds, self.parameters.values())]
        convert = {INT: lambda t: int(float(t)), FLOAT: float, BOOL: lambda t: float(t) != 0, TEXT_PARAMETER: str}
        for name, kind, text in zip(self.parameters, self.kinds, values):
            self.parameters[name] = convert[kind](text)

    @contextlib.contextmanager
    def _neighbours(self) -> Iterator[None]:
        """What lies beside it can be imported, also by check."""
        folder = os.path.dirname(self.path)
        sys.path.insert(0, folder)
        try:
            yield
        finally:
            if folder in sys.path:
                sys.path.remove(folder)

    def _of(self, name: str, is_right: Any, preset: Any, expected: str) -> Any:
        """The module's attribute."""
        value = getattr(self.module, name, preset)
        if not is_right(value):
            raise Refused(f"{name} is {_short(value)}: expected {expected}" if hasattr(self.module, name) else f"it has no {name}(block)")
        return value

    def _planes(self, name: str) -> int:
        """A mask."""
        value = self._of(name, lambda names: isinstance(names, (list, tuple)) and all(isinstance(plane, str) and plane in PLANES for plane in names),
                         [], f"a list of {', '.join(PLANES)}")
        return sum(1 << list(PLANES).index(plane) for plane in set(value))

    @staticmethod
    def _kind(name: object, preset: object) -> int:
        kinds = {bool: BOOL, int: INT, float: FLOAT, str: TEXT_PARAMETER}
        if not isinstance(name, str) or type(preset) not in kinds or (type(preset) is float and not math.isfinite(preset)):
            raise Refused(f"the parameter {name!r} is {_short(preset)}: expected a text's default: a number, True, False or a text")
        return kinds[type(preset)]

    def words(self) -> bytes:
        """What it says of itself, as script.c takes it."""
        texts = [self.id, self.version, self.name, self.description]
        for name, preset in zip(self.parameters, self.defaults):
            texts += [name.replace("_", "-"), preset]
        if any("\0" in text for text in texts):
            raise Refused("a NUL in what it says of itself")
        words = b"".join(text.encode(errors="replace") + b"\0" for text in texts)
        if len(words) > TEXT:
            raise Refused(f"what it says of itself has more than {TEXT} bytes")
        return words

    def decide(self, block: Block) -> tuple[bool, int, float, float]:
        """Stop, samples at the next check (0: any), error, predicted samples: what check returned, understood."""
        with self._neighbours():
            answer = self.check(block)
        said, *more = answer if isinstance(answer, (tuple, list)) and answer else (answer,)
        said, line, next_spp = _plain(said), getattr(getattr(self.check, "__code__", None), "co_firstlineno", 0), 0.0
        if isinstance(said, (int, float)) and not isinstance(said, bool) and block.spp < said < math.inf:
            next_spp = said
        elif not isinstance(said, bool):
            raise Refused(f"check returned {_short(answer)}: expected True (stop), False (ask again at any time) or a number of "
                          "samples above block.spp (ask again then)", line)
        error, predicted = (math.nan if v is None else _plain(v) for v in (*more, None, None)[:2])
        predicted = math.nan if predicted == math.inf else predicted
        if len(more) > 2 or not all(isinstance(v, (int, float)) and not 0 > v and v != math.inf for v in (error, predicted)):
            raise Refused(f"check returned {_short(answer)}: expected at most (answer, error, predicted samples), the latter two "
                          "numbers from 0 on, or None", line)
        return said is True, math.ceil(min(next_spp, 1e18)), float(error), float(predicted)


def _plain(value: Any) -> Any:
    """Of numpy's numbers Python's."""
    return value.item() if isinstance(value, (np.generic, np.ndarray)) and value.ndim == 0 else value


def _short(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:60] + "..."


scripts: dict[int, Script] = {}
made = 0  # so many


def _open(request: Request, at: int) -> None:
    global made
    path, *values = C.string_at(at, TEXT).split(b"\0")[:1 + request.param_count]
    script = Script(os.fsdecode(path), [value.decode(errors="replace") for value in values])
    request.planes, request.planes_used, request.first_spp, request.limit_s = script.required, script.used, script.first_spp, script.limit_s
    request.param_count, request.param_type[:len(script.kinds)] = len(script.kinds), script.kinds
    C.memmove(at, words := script.words(), len(words))
    made += 1
    scripts[made] = script
    request.instance = made


def _check(request: Request, at: int) -> None:
    b, frame = request.block, request.frame
    shape, planes = (b.y1 - b.y0, b.x1 - b.x0), dict.fromkeys(PLANES)
    for bit, (name, channels) in enumerate(PLANES.items()):
        if request.planes >> bit & 1:
            values = np.ctypeslib.as_array((C.c_double * (channels * shape[0] * shape[1])).from_address(at))
            planes[name] = values.reshape(*shape, channels)[..., slice(None) if channels > 1 else 0].copy()
            at += values.nbytes
    kept = {name: getattr(frame, name) for name, _ in FrameFields._fields_ if name not in ("struct_size", "blocks", "block_stride")}
    kept["rgb_to_xyz"] = np.array(frame.rgb_to_xyz).reshape(3, 3)
    block = Block(**{**planes, "samples": planes["spp"], "id": b.id, "rect": Rect(b.x0, b.y0, b.x1, b.y1), "spp": b.spp,
                     "half_spp": b.half_spp, "thread_s": b.thread_s, "final": bool(b.flags & _FINAL), "elapsed_s": request.elapsed_s,
                     "frame": types.SimpleNamespace(**kept)})
    with np.errstate(all="ignore"):  # pixels may hold anything
        request.stop, request.next_spp, request.error, request.predicted_spp = scripts[request.instance].decide(block)


def _explain(error: BaseException, path: str) -> str:
    """One line: the last line of the script that was run, and what went wrong there."""
    name, line = os.path.basename(path), getattr(error, "line", 0)
    if isinstance(error, SyntaxError) and error.filename == path:
        line = error.lineno or 0
    for frame, number in traceback.walk_tb(error.__traceback__):
        if frame.f_code.co_filename == path:
            line = number
    if isinstance(error, Refused):
        text = str(error)
    else:
        said, source = str(getattr(error, "msg", error)), linecache.getline(path, line).strip() if line else ""
        text = type(error).__name__ + (said and f": {said}") + (source and f" in '{source}'")
    return re.sub(r"[\s\0-\x1f]+", " ", f"{name}:{line}: {text}" if line else f"{name}: {text}")


def answer(address: int) -> None:
    """Answers the request there, in place; whatever happens is an error of it."""
    request, at = Request.from_address(address), address + C.sizeof(Request)
    path = "" if request.kind != OPEN else os.fsdecode(C.string_at(at))
    try:
        if NEEDED:
            raise Refused(NEEDED)
        if request.kind == CLOSE:
            sys.modules.pop(scripts.pop(request.instance).module.__name__, None)
        else:
            path = path or scripts[request.instance].path
            (_open if request.kind == OPEN else _check)(request, at)
        code, message = 0, ""
    except BaseException as error:  # also SystemExit
        outside = NEEDED or (isinstance(error, OSError) and error.filename == path)
        code = E_INTERNAL if request.kind != OPEN else E_IO if outside else E_INVALID
        try:
            message = _explain(error, path)
        except BaseException as worse:  # an error that cannot be told
            message = f"{os.path.basename(path)}: {type(error).__name__}, and {type(worse).__name__} while it is told"
    request.message = message.encode(errors="replace")[:430].decode(errors="ignore").encode()
    request.code = code


def _alarm(_number: int, _frame: object) -> None:
    raise TimeoutError("it takes too long: limit_s says how many seconds a check may take")


def main() -> None:
    """A process that answers for another one (base/process.h), and ends with it."""
    import fcntl
    import mmap
    import select
    import warnings
    # By the system, whatever this process does then: also all that it has started.
    fcntl.fcntl(LIFE, fcntl.F_SETOWN, -os.getpgrp())
    fcntl.fcntl(LIFE, _F_SETSIG, int(signal.SIGKILL))
    fcntl.fcntl(LIFE, fcntl.F_SETFL, fcntl.fcntl(LIFE, fcntl.F_GETFL) | os.O_ASYNC)
    if select.select([LIFE], [], [], 0)[0]:  # it has ended already
        return
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    try:
        os.write(2, b"")
        os.dup2(2, 1)  # what it prints is no output of the renderer
    except OSError:  # which has no standard error
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
    sys.stdout, own = sys.stderr, os.getpid()
    warnings.simplefilter("ignore", RuntimeWarning)
    signal.signal(signal.SIGALRM, _alarm)
    memory = mmap.mmap(-1, 1)
    while asked := os.read(CALLER, 1):
        if len(memory) != os.fstat(MEMORY).st_size:
            memory = mmap.mmap(MEMORY, 0)
        address = C.addressof(C.c_char.from_buffer(memory))
        request = Request.from_address(address)
        script = scripts.get(request.instance)
        try:
            signal.setitimer(signal.ITIMER_REAL, script.limit_s if script and request.kind == CHECK else LIMIT_S)
            answer(address)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
        if os.getpid() != own:  # it has forked
            os._exit(0)
        os.write(CALLER, asked)


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError):  # the script has closed what we speak through: the caller tells it
        os._exit(1)
