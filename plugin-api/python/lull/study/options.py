# SPDX-License-Identifier: MIT
"""Command lines by the rules and in the words of Lull's other programs: options before, between and behind arguments, long
ones by an unambiguous beginning."""
from __future__ import annotations

import getopt
import os
import re
import sys
import textwrap
from typing import Any, Callable, NamedTuple, Sequence

from ..version import PRODUCT
from .files import Refused


class Option(NamedTuple):
    name: str
    value: str  # what --help calls it; "": a flag
    help: str
    take: Callable[[str], Any] = str  # the value of a text; ValueError says what was expected
    letter: str = ""
    many: bool = False  # a list of all


class Command(NamedTuple):
    name: str
    arguments: str  # as --help has them; so many:
    least: int
    most: int
    doc: str
    options: Sequence[Option] = ()
    after: str = ""  # below the options


def integer(least: int, most: int) -> Callable[[str], int]:
    def take(text: str) -> int:
        if not re.fullmatch(r"[+-]?[0-9]{1,19}", text, re.ASCII) or not least <= int(text) <= most:
            raise ValueError(f"expected an integer from {least} to {most}")
        return int(text)
    return take


def real(least: float, most: float) -> Callable[[str], float]:
    def take(text: str) -> float:
        form = r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?"
        if not re.fullmatch(form, text, re.ASCII | re.I) or not least <= float(text) <= most:
            raise ValueError(f"expected a number from {least:g} to {most:g}")
        return float(text)
    return take


def block_size(most: int) -> Callable[[str], str]:
    def take(text: str) -> str:
        if not all(re.fullmatch("[0-9]{1,9}", side, re.ASCII) and 1 <= int(side) <= most for side in text.split("x", 1)):
            raise ValueError(f"expected N or WxH, each from 1 to {most}")
        return text
    return take


def word(*words: str) -> Callable[[str], str]:
    def take(text: str) -> str:
        if text not in words:
            raise ValueError(f"expected {', '.join(words[:-1])} or {words[-1]}")
        return text
    return take


def text_shown(text: str) -> str:
    """What stands on the command line as text: bytes that are none are mended."""
    return text.encode(sys.getfilesystemencoding(), "surrogateescape").decode("utf-8", "replace")


OWN = (Option("help", "", "Print this and exit", letter="?"), Option("usage", "", "Print a short usage and exit"),
       Option("version", "", "Print the version and exit", letter="V"))


def _answer(command: Command, rows: Sequence[Option], what: str) -> str:
    if what == "version":
        return f"{command.name.split()[0]} (Lull) {PRODUCT}"
    said_margin = re.search(r"rmargin=(\d+)", os.environ.get("ARGP_HELP_FMT", ""))  # docs/man/write wants no line broken
    margin = int(said_margin[1]) if said_margin else 79
    forms = [f"--{o.name}" + (f"={o.value}" if o.value else "") for o in rows]
    if what == "usage":
        words = f"Usage: {command.name} {' '.join(f'[{form}]' for form in forms)} {command.arguments}"
        return textwrap.fill(words, margin, subsequent_indent=" " * 12, break_on_hyphens=False)
    lines = [f"Usage: {command.name} [OPTION...] {command.arguments}".rstrip()]
    lines += [*textwrap.wrap(command.doc, margin, break_on_hyphens=False), ""]
    for option, form in zip(rows, forms):
        head = (f"  -{option.letter}, " if option.letter else " " * 6) + form
        texts = textwrap.wrap(option.help, margin - 29, break_on_hyphens=False)
        if len(head) > 27:
            lines.append(head)
            head = ""
        lines += [f"{'' if i else head:29}{text}" for i, text in enumerate(texts)]
    return "\n".join(lines + (["", command.after] if command.after else []))


def _refuse(error: getopt.GetoptError) -> Refused:
    is_long = error.msg.startswith("option --")
    why = ("a value is needed (--help says more)" if "requires argument" in error.msg else
           "this option takes no value" if "must not have" in error.msg else
           f"unknown option{', or the beginning of several' if is_long else ''} (--help lists the options)")
    return Refused(f"{'--' if is_long else '-'}{error.opt}: {why}")


def parse(command: Command, arguments: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """(arguments, options that were given by name, '-' as '_'). Answers --help and the like itself, and exits."""
    taken = {o.letter for o in command.options}
    rows = [*sorted(command.options), *(o._replace(letter="") if o.letter in taken else o for o in OWN)]
    found: dict[str, Any] = {}
    try:
        letters = "".join(o.letter + (":" if o.value else "") for o in rows if o.letter)
        given, words = getopt.gnu_getopt(list(arguments), letters, [o.name + ("=" if o.value else "") for o in rows])
    except getopt.GetoptError as error:
        raise _refuse(error) from None
    for name, text in given:
        option = next(o for o in rows if name in ("--" + o.name, "-" + o.letter))
        if option.name in [o.name for o in OWN]:
            print(_answer(command, rows, option.name))
            raise SystemExit(0)
        try:
            value = option.take(text) if option.value else True
        except ValueError as error:
            raise Refused(f"--{option.name} {text}: {error}") from None
        key = option.name.replace("-", "_")
        found[key] = [*found.get(key, []), value] if option.many else value
    if len(words) > command.most:
        raise Refused(f"{words[command.most]}: one argument too many; expected {command.arguments}")
    if len(words) < command.least:
        raise Refused(f"expected {command.arguments} (--help says more)")
    return words, found
