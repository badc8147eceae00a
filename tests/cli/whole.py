"""Whole outputs against recorded ones. Speaks TAP.

usage: whole.py NAME FOLDER FIRST [REGEX=WORD ...]

Every file below FOLDER is a section of a record tests/cli/whole/NAME*.txt, compared as support/approve.h says: one that differs, is
missing or is new is a failure. FIRST is the number of the first line of TAP. What a REGEX matches is recorded, and compared, as WORD:
folders, times, names drawn at random. Long JSON is recorded as tables, a PNG as mean codes.

Which record a section is in follows from what it is: NAME-pictures has the mean codes, NAME-near what comes from networks in single
precision, whose sums each instruction set makes in another order (.near in its name).
"""

import collections
import json
import os
import re
import struct
import subprocess
import sys
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PICTURE = re.compile(r"\d+ x \d+, \d channels\n")
APPROVE = os.path.join(ROOT, os.environ.get("BUILD", "build"), "tests", "approve")
LONG = 40  # lines of JSON that are read as they are


def pixels(data):
    """A PNG of 8 bits as text: its size, and the mean codes of cells of at most 24 x 16."""
    at, idat = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[at + 8 : at + 18])
        idat += data[at + 8 : at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    n = {0: 1, 2: 3, 6: 4}[colour]
    assert depth == 8
    raw, rows, last = zlib.decompress(idat), [], [0] * (n * width)
    for y in range(height):
        kind, row = raw[y * (n * width + 1)], list(raw[y * (n * width + 1) + 1 : (y + 1) * (n * width + 1)])
        for i in range(len(row)):
            left, up, corner = row[i - n] if i >= n else 0, last[i], last[i - n] if i >= n else 0
            p = left + up - corner
            paeth = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))[2]
            row[i] = (row[i] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        rows.append(row)
        last = row
    text = "%d x %d, %d channels\n" % (width, height, n)
    across, down = min(width, 24), min(height, 16)
    for j in range(down):
        cells = []
        for i in range(across):
            xs = range(i * width // across, (i + 1) * width // across)
            ys = range(j * height // down, (j + 1) * height // down)
            cells.append(" ".join("%g" % round(sum(rows[y][n * x + c] for y in ys for x in xs) / len(xs) / len(ys), 2) for c in range(n)))
        text += "  ".join(cells) + "\n"
    return text


def is_simple(value):
    return not isinstance(value, dict) and not (isinstance(value, list) and any(isinstance(v, (dict, list)) for v in value))


def shown(value):
    if isinstance(value, list):
        return "[" + " ".join(map(shown, value)) + "]"
    return "%.8g" % value if isinstance(value, float) else value if isinstance(value, str) else json.dumps(value)


def table(name, value, known):
    """Lines of a JSON value: a row for what an object has of simple values, below the names of its columns when they are new."""
    if is_simple(value):
        return ["%s %s" % (name, shown(value))]
    items = value.items() if isinstance(value, dict) else [(str(i), v) for i, v in enumerate(value)]
    simple = [(k, v) for k, v in items if is_simple(v)] if isinstance(value, dict) else []
    lines, columns = [], tuple(k for k, _ in simple)
    if simple and columns not in known:
        known.add(columns)
        lines.append("%-14s %s" % ("--", " ".join("%-11s" % k for k in columns)))
    if simple:
        lines.append("%-14s %s" % (name, " ".join("%-*s" % (max(len(k), 11), shown(v)) for k, v in simple)))
    for k, v in items:
        if not simple or not is_simple(v):
            lines += table(k if simple or name == "" else name + " " + k, v, known)
    return [line.rstrip() for line in lines]


def laid_out(text):
    """A long JSON as tables; what else there is as it is."""
    if not text.startswith("{") or text.count("\n") < LONG:
        return text
    try:
        value, end = json.JSONDecoder().raw_decode(text)
    except ValueError:  # a mask is in it
        return text
    return "\n".join(table("", value, set())) + text[end:]


def record_of(name, section, text):
    if PICTURE.match(text):
        return name + "-pictures"
    return name + ("-near" if ".near" in section else "")


def compare(name, sections, first):
    """Prints TAP from the number `first`; sections: name -> text. Returns (the next number, whether all is well)."""
    records, good = collections.defaultdict(str), True
    for key, text in sorted(sections.items()):
        lines = laid_out(text).split("\n")
        records[record_of(name, key, text)] += "> %s\n%s" % (key, "".join("  %s\n" % line for line in lines[: -1 if lines[-1] == "" else None]))
    for record, text in sorted(records.items()):
        path = os.path.join("tests", "cli", "whole", record + ".txt")
        ran = subprocess.run([APPROVE, path, str(first)], input=text, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        print(ran.stdout, end="")
        good &= ran.returncode == 0
        first += len(re.findall("^(?:not )?ok ", ran.stdout, re.M))
    return first, good


def masked(text, masks):
    for regex, word in masks:
        text = re.sub(regex, word, text)
    return text


def text_of(path, masks):
    with open(path, "rb") as f:
        data = f.read()
    if data[:4] == b"\x89PNG":
        return pixels(data)
    try:
        return masked(data.decode(), masks)
    except UnicodeDecodeError:
        return "%d bytes, crc32 %08x\n" % (len(data), zlib.crc32(data))


def main(name, folder, first, *masks):
    masks = [m.rsplit("=", 1) for m in masks]
    files = [os.path.join(path, f) for path, _, names in os.walk(folder) for f in names]
    sections = {masked(os.path.relpath(f, folder), masks): text_of(f, masks) for f in files}
    _, good = compare(name, sections, int(first))
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main(*sys.argv[1:])
