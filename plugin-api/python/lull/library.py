# SPDX-License-Identifier: MIT
"""liblull-host.so, which everything here stands on, and the criteria that it finds."""
from __future__ import annotations

import contextlib
import ctypes as C
import functools
import importlib.util
import os
import shutil
import sys
import sysconfig
import warnings
from pathlib import Path
from typing import Any, Iterable, NamedTuple, Optional, Union

from . import abi, script

NAME = "liblull-host.so.1"
CARRIED = Path(__file__).resolve().parent / "lib"
_CODES = {getattr(abi, name): name for name in dir(abi) if name.startswith("E_")}
_PARAMETER_TYPES = ("int", "float", "bool", "choice", "file", "text")


class LullError(Exception):
    """A call that failed. `code` is the LULL_E_ number (E_… of lull.abi), `name` its name."""

    def __init__(self, code: int, message: str):
        super().__init__(message)
        self.code, self.name = code, _CODES.get(code, str(code))


class Parameter(NamedTuple):
    """One row of a criterion's parameter table."""
    name: str
    help: str
    type: str  # int, float, bool, choice, file or text
    default: Optional[str]  # None: the criterion chooses
    choices: tuple[str, ...]
    min: float  # int, float: inclusive range
    max: float


class Info(NamedTuple):
    """What a criterion says about itself, and where it was found."""
    id: str
    name: str
    version: str
    description: str
    path: str
    parameters: tuple[Parameter, ...]
    table: int  # its address: static, lives for ever

    def parameter(self, name: str) -> Optional[Parameter]:
        """The row of this name, None if there is none."""
        return next((p for p in self.parameters if p.name == name), None)


def search_path() -> list[str]:
    """Where the library is looked for: above the folders of LULL_PLUGIN_PATH, in the package itself (a wheel has it there),
    in the prefix whose share/lull this is, in that of a `lull-render` on PATH, in the build tree that this package lies in, in the usual
    prefixes."""
    folders = [Path(f).resolve().parent for f in os.environ.get("LULL_PLUGIN_PATH", "").split(os.pathsep) if f]
    folders += [CARRIED, (Path(__file__).resolve().parents[2] / "lib" / "lull").resolve().parent]  # a link where LIBDIR is elsewhere
    program = shutil.which("lull-render")
    libdirs = ["lib", "lib64", *(f"lib/{triplet}" for triplet in [sysconfig.get_config_var("MULTIARCH")] if triplet)]
    folders += [Path(program).resolve().parents[1] / libdir for libdir in libdirs] if program else []
    folders += [Path(__file__).resolve().parents[3] / "build" / "lib"]
    folders += [prefix / libdir for prefix in (Path(sys.prefix), Path("/usr/local"), Path("/usr")) for libdir in libdirs]
    return list(dict.fromkeys(map(str, folders)))


@functools.lru_cache(maxsize=None)
def library() -> C.CDLL:
    """The library, loaded once. Its criteria are those of LULL_PLUGIN_PATH and of the folder lull beside it."""
    _prepare_denoiser()
    found = next((path for folder in search_path() if os.path.exists(path := os.path.join(folder, NAME))), NAME)
    try:
        loaded = C.CDLL(found)
    except OSError:
        raise LullError(abi.E_IO, f"no {NAME} in {', '.join(search_path())}: install Lull, or set LULL_PLUGIN_PATH to the "
                        "folder lib/lull of its build or prefix") from None
    for name in ("table", "needs", "blocks_of", "totals_of"):
        getattr(loaded, f"lull_host_{name}").restype = C.c_void_p
    for name in ("mask_factor", "elapsed_s"):
        getattr(loaded, f"lull_host_{name}").restype = C.c_double
    loaded.lull_host_reason.restype = C.c_char_p
    for name in ("progress", "end", "close", "file_abort", "quote_end", "apply"):
        getattr(loaded, f"lull_host_{name}").restype = None
    return loaded


def _prepare_denoiser() -> None:
    """For the criterion `denoised`, which runs a program: unpacked by Blender it is not executable yet. LULL_OIDN is set to
    the Open Image Denoise of the package pyoidn (the extra lull[denoise]) or else of the Blender that this runs in."""
    program = CARRIED / "lull" / "modules" / "lull-denoiser"
    if program.exists() and not os.access(program, os.X_OK):
        with contextlib.suppress(OSError):
            program.chmod(0o755)
    package, folders = importlib.util.find_spec("pyoidn"), []
    if package and package.origin:
        folders.append(Path(package.origin).parent / "oidn")
    if "bpy" in sys.modules:
        folders.append(Path(sys.modules["bpy"].utils.resource_path("LOCAL")).parent)
    found = [folder for folder in folders if (folder / "lib" / "libOpenImageDenoise.so.2").exists()]
    if found:
        os.environ.setdefault("LULL_OIDN", str(found[0]))


def encoded(text: Union[str, os.PathLike[str]]) -> bytes:
    """A name or another text as the library and the file system take it. A locale of ASCII, such as C, need not have its letters:
    then they are UTF-8, as they would be everywhere else."""
    try:
        name = os.fsencode(text)
    except UnicodeEncodeError:
        name = os.fspath(text).encode("utf-8", "surrogateescape")
    if b"\0" in name:  # the library would take what stands before it
        raise ValueError(f"{text!r} has a NUL")
    return name


def call(name: str, *arguments: Any) -> None:
    """lull_NAME(arguments, error); LullError for what it refuses. Pointers and numbers of 64 bits come as ctypes objects."""
    error = abi.sized(abi.Error)
    if (code := getattr(library(), f"lull_{name}")(*arguments, C.byref(error))) != abi.OK:
        raise LullError(code, error.message.decode(errors="replace"))


def bytes_of(name: str, *arguments: Any) -> bytes:
    """What lull_NAME(arguments, writer, error) writes."""
    out = bytearray()

    def write(_writer: int, data: int, size: int) -> int:
        out.extend(C.string_at(data, size))
        return abi.OK
    call(name, *arguments, C.byref(abi.sized(abi.Writer, write=abi.WriteFn(write))))
    return bytes(out)


def _warn(_context: object, level: int, text: bytes) -> None:
    if level == abi.LOG_ERROR:
        warnings.warn(text.decode(errors="replace"), stacklevel=4)


def _search(folders: Optional[Iterable[str]] = None) -> abi.Search:
    """folders: None: the library's usual ones."""
    dirs = None if folders is None else [encoded(f) for f in folders]
    listed = (C.c_char_p * max(len(dirs or ()), 1))(*(dirs or ()))
    search = abi.Search(dirs=None if dirs is None else C.addressof(listed), dir_count=len(dirs or ()), log=abi.LogFn(_warn))
    search.kept = listed
    return search


def criteria(folders: Optional[Iterable[str]] = None) -> list[Info]:
    """Every criterion that can be found. A library name seen in an earlier folder is skipped; a broken one warns."""
    found: list[Info] = []
    search = _search(folders)

    def visit(_context: object, at: Any) -> int:
        found.append(_info(at.contents))
        return abi.OK
    library().lull_list(C.byref(search), C.CFUNCTYPE(C.c_int32, C.c_void_p, C.POINTER(abi.Found))(visit), None)
    return found


@functools.lru_cache(maxsize=None)
def _answer_scripts() -> Any:
    """Criteria that are Python files run in this process."""
    answer = C.CFUNCTYPE(None, C.c_void_p, C.c_uint64)(lambda at, _size: script.answer(at))
    call("answer_scripts", answer)
    return answer


def find(spec: str) -> Info:
    """The criterion that spec names: NAME, PATH.so (its first criterion), PATH.so:ID or PATH.py."""
    found, search = abi.Found(), _search()
    if b".py" in encoded(spec):
        _answer_scripts()
    call("open", C.byref(search), encoded(spec), C.byref(found))
    return _info(found)


def _info(found: abi.Found) -> Info:
    table = abi.Criterion.from_address(found.criterion)
    rows = (abi.Param.from_address(table.params + i * table.param_stride) for i in range(table.param_count))
    return Info(table.id.decode(), table.name.decode(), table.version.decode(), table.description.decode(),
                os.fsdecode(found.path), tuple(
                    Parameter(p.name.decode(), p.help.decode(), _PARAMETER_TYPES[p.type],
                              None if p.default_value is None else p.default_value.decode(),
                              tuple(p.choices.decode().split("|")) if p.choices else (), p.min, p.max) for p in rows),
                found.criterion)
