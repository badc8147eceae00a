"""Whole outputs against recorded ones, word by word and number by number. Speaks TAP.

usage: whole.py NAME FOLDER FIRST [REGEX=WORD ...]

Every file below FOLDER is a section of tests/golden/whole/NAME.txt: one that differs, is missing or is new is a failure. FIRST is the
number of the first line of TAP. What a REGEX matches is recorded, and compared, as WORD: folders, times, names drawn at random.

The record is made by the product, and was read by somebody before it was committed. To make it anew: RECORD=1 with the test's command,
then read `git diff`.
"""

import errno
import os
import re
import struct
import sys
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PICTURE = re.compile(r"\d+ x \d+, \d channels\n")
NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)")
# Another processor or mathematical library rounds the last bits of a sum otherwise.
NEAR = 2e-6
# Sections whose name has .near come from networks in single precision, whose sums each instruction set makes in another order.
NEAR_FLOAT = 2e-4
# A code of a picture may lie between two.
NEAR_CODE = 1.0
# What the C library says, where outputs were recorded, and what SQLite does.
FOREIGN = [(os.strerror(code), text) for code, text in (
    (errno.ENOENT, "No such file or directory"), (errno.EACCES, "Permission denied"), (errno.ENOTDIR, "Not a directory"),
    (errno.EISDIR, "Is a directory"), (errno.EEXIST, "File exists"), (errno.ENOSPC, "No space left on device"))]
FOREIGN.append(("file is encrypted or is not a database", "file is not a database"))


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


def is_near(a, b, kind):
    if a == b:
        return True
    if kind == "png":
        return abs(float(a) - float(b)) <= NEAR_CODE
    if not re.search("[.eE]", a + b):
        return False
    x, y = float(a), float(b)
    if abs(x - y) <= (NEAR_FLOAT if kind == "near" else NEAR) * max(abs(x), abs(y)):
        return True
    decimals = min(len(v.partition(".")[2]) for v in (a, b))  # the last one of a rounded number
    return decimals >= 3 and not re.search("[eE]", a + b) and abs(x - y) <= 1.01 * 10**-decimals


def same_line(a, b, kind):
    x, y = NUMBER.split(a), NUMBER.split(b)
    return len(x) == len(y) and all(u == v if i % 2 == 0 else is_near(u, v, kind) for i, (u, v) in enumerate(zip(x, y)))


def difference(wanted, got, kind):
    """None, or the first lines that differ."""
    a, b = wanted.split("\n"), got.split("\n")
    lines = [i for i in range(max(len(a), len(b))) if i >= len(a) or i >= len(b) or not same_line(a[i], b[i], kind)]
    if not lines:
        return None
    show = lambda text, i: text[i] if i < len(text) else "(nothing)"
    return "\n".join("line %d: wanted %s\n%*sgot %s" % (i + 1, show(a, i), 10 + len(str(i + 1)), "", show(b, i)) for i in lines[:4])


def record_of(name):
    return os.path.join(ROOT, "tests", "golden", "whole", name + ".txt")


def read_record(name):
    try:
        with open(record_of(name), encoding="utf-8") as f:
            parts = re.split(r"^==> (.*) <==\n", f.read(), flags=re.M)
    except FileNotFoundError:
        return {}
    return {key: text[:-1] for key, text in zip(parts[1::2], parts[2::2])}


def as_recorded(text):
    for here, recorded in FOREIGN:
        text = text.replace(here, recorded)
    return text


def compare(name, sections, first):
    """Prints TAP from the number `first`; sections: name -> text. Returns (the next number, whether all is well)."""
    if os.environ.get("RECORD"):
        with open(record_of(name), "w", encoding="utf-8") as f:
            f.write("".join("==> %s <==\n%s\n" % item for item in sorted(sections.items())))
    wanted, good = read_record(name), True
    for key in sorted(wanted.keys() | sections.keys()):
        if key not in sections or key not in wanted:
            told = "not there" if key not in sections else "nothing is recorded under this name"
        else:
            told = difference(wanted[key], as_recorded(sections[key]), "png" if PICTURE.match(wanted[key]) else "near" if ".near" in key else "")
        good &= told is None
        print("%s %d - whole: %s" % ("ok" if told is None else "not ok", first, key))
        if told is not None:
            print("# " + told[:3000].replace("\n", "\n# "))
        first += 1
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
