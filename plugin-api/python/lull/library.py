# SPDX-License-Identifier: MIT
"""Finding criteria: shared objects that export the one symbol of lull/criterion.h. A library is never unloaded."""
from __future__ import annotations

import ctypes as C
import os
import re
import shutil
import sys
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Iterable, Iterator, Optional

from . import abi

_CODES = {getattr(abi, name): name for name in dir(abi) if name.startswith("E_")}
ENTRY_MAX = 1000
_TYPES = ("int", "float", "bool", "choice", "file", "text")


class LullError(Exception):
    """A call that failed. `code` is the LULL_E_ number (E_… of lull.abi)."""

    def __init__(self, code: int, message: str):
        super().__init__(message)
        self.code = code
        self.name = _CODES.get(code, str(code))


@dataclass(frozen=True)
class Parameter:
    """One row of a criterion's parameter table."""
    name: str
    help: str
    type: str  # int, float, bool, choice, file or text
    default: Optional[str]  # None: the criterion chooses
    choices: tuple[str, ...]
    min: float  # int, float: inclusive range
    max: float


@dataclass(frozen=True)
class Info:
    """What a criterion says about itself, and where it was found."""
    id: str
    name: str
    version: str
    description: str
    path: str
    parameters: tuple[Parameter, ...]
    deterministic: bool
    reopens: bool  # wants to be asked about stopped blocks too
    table: abi.Criterion = field(repr=False, compare=False)

    def parameter(self, name: str) -> Optional[Parameter]:
        return next((p for p in self.parameters if p.name == name), None)


def search_path() -> list[str]:
    """Where names are looked up: LULL_PLUGIN_PATH, ../lib/lull beside a `lull-render` on PATH, the usual prefixes."""
    folders = [f for f in os.environ.get("LULL_PLUGIN_PATH", "").split(os.pathsep) if f]
    program = shutil.which("lull-render")
    prefixes = [Path(program).resolve().parents[1]] if program else []
    prefixes += [Path(sys.prefix), Path("/usr/local"), Path("/usr")]
    folders += [str(prefix / "lib" / "lull") for prefix in prefixes]
    return list(dict.fromkeys(folders))


def criteria(folders: Optional[Iterable[str]] = None) -> list[Info]:
    """Every criterion that can be found. A library name seen in an earlier folder is skipped; a broken one warns."""
    found: list[Info] = []
    seen: set[str] = set()
    for folder in search_path() if folders is None else folders:
        for path in sorted(Path(folder).glob("*.so")):
            if path.name in seen:
                continue
            seen.add(path.name)
            try:
                found.extend(tables(str(path)))
            except LullError as error:
                warnings.warn(f"skipped: {error}", stacklevel=2)
    return found


def find(spec: str) -> Info:
    """The criterion that spec names: NAME, PATH.so (its first criterion) or PATH.so:ID."""
    if "/" in spec or spec.endswith(".so"):
        path, _, wanted = spec.partition(".so:")
        path = path + ".so" if wanted else path
        for info in list(tables(path)):
            if wanted in ("", info.id):
                return info
        raise LullError(abi.E_KEY, f"{path}: holds no criterion '{wanted}'")
    folders = search_path()
    for folder in folders:
        if os.path.exists(path := os.path.join(folder, spec + ".so")):
            infos = list(tables(path))
            return next((i for i in infos if i.id == spec), infos[0])
    for info in criteria(folders):
        if info.id == spec:
            return info
    raise LullError(abi.E_IO, f"no criterion '{spec}' in {', '.join(folders)}: install Lull's criteria, set "
                              "LULL_PLUGIN_PATH or give the path of a .so")


def _flushes_subnormals() -> bool:
    smallest = sys.float_info.min
    return smallest / 2 == 0.0


def tables(path: str) -> Iterator[Info]:
    """Loads a library and yields its criteria in order."""
    if not os.path.exists(path):
        raise LullError(abi.E_IO, f"{path}: no such file")
    flushed = _flushes_subnormals()
    try:
        library = C.CDLL(os.path.abspath(path), mode=os.RTLD_NOW | os.RTLD_LOCAL)
    except OSError as error:
        raise LullError(abi.E_IO, f"{path}: cannot be loaded: {error}") from None
    if _flushes_subnormals() and not flushed:
        warnings.warn(f"{path}: loading it switched this thread to flush-to-zero: it was built with -ffast-math",
                      stacklevel=2)
    try:
        entry = getattr(library, abi.ENTRY_NAME)
    except AttributeError:
        raise LullError(abi.E_VERSION, f"{path}: not a criterion of ABI 1: it does not export {abi.ENTRY_NAME}") from None
    entry.restype, entry.argtypes = C.POINTER(abi.Criterion), [C.c_uint32]
    seen: set[str] = set()
    while table := entry(len(seen)):
        info = _info(table.contents, path)
        if info.id in seen or len(seen) == ENTRY_MAX:
            raise LullError(abi.E_INVALID, f"{path}: two criteria have the id {info.id}" if info.id in seen else
                            f"{path}: its entry does not end after {ENTRY_MAX} criteria")
        seen.add(info.id)
        yield info
    if not seen:
        raise LullError(abi.E_INVALID, f"{path}: holds no criterion")


def _info(table: abi.Criterion, path: str) -> Info:
    def refuse(what: str, code: int = abi.E_INVALID) -> LullError:
        return LullError(code, f"{path}: {what}")
    if table.struct_size < C.sizeof(abi.Criterion):
        raise refuse(f"its table is smaller than in version 1.0 ({table.struct_size} bytes)", abi.E_VERSION)
    if not re.fullmatch(rb"[a-z0-9.-]{1,63}", table.id or b""):
        raise refuse("its id is not of the form [a-z0-9.-]+")
    if None in (table.name, table.version, table.description):
        raise refuse("name, version or description is missing")
    if not all((table.create, table.requirements, table.begin_frame, table.evaluate, table.end_frame, table.destroy,
                table.get_extension)):
        raise refuse("a function is missing")
    if table.param_count and (not table.params or table.param_stride < C.sizeof(abi.Param) or table.param_count > 10000):
        raise refuse("the parameter table is missing or has a bad stride")
    return Info(table.id.decode(), table.name.decode(), table.version.decode(), table.description.decode(), path,
                tuple(_parameter(table, i, refuse) for i in range(table.param_count)),
                bool(table.capabilities & abi.CAP_DETERMINISTIC), bool(table.capabilities & abi.CAP_REOPENS), table)


def _parameter(table: abi.Criterion, index: int, refuse) -> Parameter:
    p = abi.Param.from_address(table.params + index * table.param_stride)
    if not p.name or p.help is None or not 0 <= p.type < len(_TYPES):
        raise refuse(f"parameter {index} is incomplete")
    return Parameter(p.name.decode(), p.help.decode(), _TYPES[p.type],
                     None if p.default_value is None else p.default_value.decode(),
                     tuple(p.choices.decode().split("|")) if p.choices else (), p.min, p.max)
