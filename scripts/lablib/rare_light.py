"""Tells by how few paths the noise of recorded blocks is made: which blocks are lit by rare light.

The recordings have a level every eight samples (--levels linear:8:32:8), of which four are in half A: n D(n) grows by as much as the
eight new paths differ, four against four. The fewest of these differences that hold half of the sum of their squares are
counted, one path for each: where bright paths are rare hardly any eight have two of them. The table shows them as a share of all
paths; with Gaussian noise it would be 2 %. Luminances are recorded in steps of a fourth of an octave; growth below that is left out."""
import os
import struct
import zlib

from lablib import tables, tool

HALF_LOG, HEADER, RECORD, EIGHT = 3, 64, 32, 8
STEP = 0.1  # relative: half of a fourth of an octave


def options(parser):
    parser.add_argument("dir", type=tool.path, help="recorded sequences, as scripts/lab data-set makes them")
    parser.add_argument("--most", type=float, default=1.0, metavar="PERCENT", help="list blocks below this only (1)")
    tool.writes(parser)


def luminance(code):
    size = 2.0 ** (((code & 127) - 80) / 4) if code & 127 else 0.0
    return -size if code & 128 else size


TABLE = [luminance(code) for code in range(256)]


def halves(path):
    """(spp, luminance of D by pixel) of each level that has it."""
    with open(path, "rb") as file:
        data = file.read()
    at = HEADER
    while at < len(data):
        kind, spp, _, statistics, planes, size = struct.unpack_from("<6I", data, at)
        at += RECORD
        plane = at + 32 * statistics
        for _ in range(planes if kind == 1 else 0):
            which, _, _, stored = struct.unpack_from("<4I", data, plane)
            if which == HALF_LOG:
                yield spp, [TABLE[code] for code in zlib.decompress(data[plane + 16:plane + 16 + stored])]
            plane += 16 + stored
        at += size


def eights(path):
    """Squared differences within eight paths of a pixel, and how many paths were looked at."""
    before, found, paths = None, [], 0
    for spp, d in halves(path):
        if spp != EIGHT * (paths // (EIGHT * len(d)) + 1):
            continue
        now = [spp * value for value in d]
        before = before or [0.0] * len(now)
        paths += EIGHT * len(now)
        for a, b in zip(now, before):
            if abs(a - b) > 2 * STEP * max(abs(a), abs(b)):
                found.append((a - b) ** 2)
        before = now
    return found, paths


def share(path):
    """Of the paths, those that make half of the variance."""
    found, paths = eights(path)
    found.sort(reverse=True)
    rest, count = sum(found) / 2, 0
    while rest > 0:
        rest -= found[count]
        count += 1
    return count / paths if paths else float("nan")


def main(o):
    blocks = []
    for root, _, names in sorted(os.walk(o.dir)):
        if "manifest.json" not in names:
            continue
        for block in sorted(tool.load(root, "manifest.json")["blocks"], key=lambda b: b["id"]):
            blocks.append({"view": os.path.basename(root), "block": block["id"], "share": share(os.path.join(root, block["file"]))})
    if not blocks:
        raise tool.Refused("%s: no recorded blocks" % o.dir)
    shown = [b for b in blocks if 100 * b["share"] < o.most]
    print(tables.table(("view", "block", "paths that make half of the noise"), [[b["view"], str(b["block"]), "%.3f %%" % (100 * b["share"])] for b in shown]),
          end="")
    print("\n%d of %d blocks are below %g %%" % (len(shown), len(blocks), o.most))
    if o.write:
        tool.store(o.write, "rare-light", {"measured": tool.measured(), "blocks": shown})
