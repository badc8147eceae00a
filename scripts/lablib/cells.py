"""Measures what lull-render --cells is worth: samples and processor seconds to the same visible error.

Two blocks of 100x100 pixels of each scene, from a picture of 200x200, are rendered until the observer stops them, with cells and without,
in turn. Noise falls as the root of the samples, so that what a block took times the square of its last error is what it takes to any level.
Each render's report is kept in --work: interrupted, the same command goes on."""
import math
import os
import statistics

from lablib import tables, tool

SCENES = ("attic bathroom bedroom candles caustics cellar cornell-box corridor crockery demo environment garage glass glossy kitchen "
          "many-lights museum office soft-shadow window").split()
WANTED = (0.85, 1.02)  # median and worst of the seconds' ratios


def options(parser):
    parser.add_argument("--cell", type=int, default=20, metavar="N", help="side of the cells (20)")
    parser.add_argument("--crop", default="0,100,200,200", help="the blocks (0,100,200,200: the lower ones)")
    parser.add_argument("--spp-max", type=int, default=256, metavar="N", help="samples per pixel at which a block is given up (256)")
    parser.add_argument("--seeds", type=int, default=1, help="renders of each (1)")
    parser.add_argument("--only", type=lambda text: text.split(","), default=SCENES, metavar="SCENES", help="some of the scenes")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "cells"), metavar="DIR", help="where the reports are kept")
    tool.writes(parser)


def rendered(o, scene, seed, cell):
    """What its blocks took: samples per pixel and thread seconds, both times the square of the last error; and the samples."""
    report = os.path.join(o.work, "%s-%d-%d.json" % (scene, seed, cell))
    if not os.path.exists(report):
        tool.run(tool.RENDER, os.path.join(tool.ROOT, "scenes", scene + ".pbrt"), "-q", "-t", 1, "--size", "200x200", "--block", 100, "--crop", o.crop,
                 "--spp-max", o.spp_max, "--seed", seed, "--cells", cell, "--report", report)
    blocks = tool.load(report)["blocks"]
    return [sum(b[key] * b["error"] ** 2 for b in blocks) for key in ("spp", "thread_s")] + [[b["spp"] for b in blocks]]


def ratios(o, scene):
    """With cells over without, the geometric mean of the seeds: samples, seconds; and samples without."""
    both = [[rendered(o, scene, seed, cell) for cell in (o.cell, 0)] for seed in range(o.seeds)]
    mean = lambda k: math.exp(statistics.mean(math.log(a[k] / b[k]) if b[k] > 0 else 0.0 for a, b in both))
    return {"samples": mean(0), "seconds": mean(1), "spp": both[0][1][2], "spp_cells": both[0][0][2]}


def page(results):
    rows = [[scene, "%d" % statistics.mean(r["spp"]), "%.2f" % r["samples"], "%.2f" % r["seconds"]] for scene, r in results["scenes"].items()]
    text = tables.table(("scene", "samples without cells", "samples, with over without", "processor seconds, with over without"), rows)
    for key in ("samples", "seconds"):
        found = sorted(r[key] for r in results["scenes"].values())
        text += "\n%s: median %.2f, from %.2f to %.2f." % (key.capitalize(), statistics.median(found), found[0], found[-1])
    return text + " Wanted of the seconds: median %.2f, nowhere more than %.2f.\nMeasured by `%s`, %s.\n" % (
        *WANTED, results["measured"]["command"], tables.told(results["measured"]))


def main(o):
    os.makedirs(o.work, exist_ok=True)
    found = {"measured": tool.measured(), "cell": o.cell, "scenes": {}}
    for scene in o.only:
        r = found["scenes"][scene] = ratios(o, scene)
        print("%-14s %s samples; with cells %.2f of the samples, %.2f of the seconds" % (scene, r["spp"], r["samples"], r["seconds"]), flush=True)
    print(page(found))
    if o.write:
        tool.store(o.write, "cells", found)
