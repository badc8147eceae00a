"""Compares a shot table with the criterion's own stops in every frame, for a camera that moves past small scenes (docs/shots.md)."""
import math
import os
import re
import statistics
import tempfile

from lablib import tables, tool

SCENES = "soft-shadow cornell-box plaza".split()
FRAMES, EVERY, SIZE, BLOCK = 9, 4, 120, 20
STEP = 0.02  # of the distance to the point looked at, sideways in a frame; the point goes half as far


def options(parser):
    parser.add_argument("--only", type=lambda text: text.split(","), default=SCENES, metavar="SCENES", help="some of the scenes")
    tool.writes(parser)


def write_path(scene, out):
    with open(scene, encoding="utf-8") as file:
        v = [float(x) for x in re.search(r"^LookAt\s+(.*(?:\n[\s\d.eE+-]+)*)", file.read(), re.M)[1].split()[:9]]
    step = STEP * math.dist(v[:3], v[3:6])
    with open(out, "w", encoding="utf-8") as file:
        file.write("frame;eye;at;up;fov\n")
        for i in range(1, FRAMES + 1):
            d = (i - (FRAMES + 1) / 2) * step
            file.write("%d;%r %r %r;%r %r %r;%r %r %r;\n" % (i, v[0] + d, *v[1:3], v[3] + 0.5 * d, *v[4:]))


def numbers(name):
    with open(name, encoding="utf-8") as file:
        return [[int(x) for x in line.rstrip(";\n").split(";")[1:]] for line in file if re.match(r"[^;]+;\d", line)]


def compare(scene, scratch):
    path, table = os.path.join(scratch, "path.csv"), os.path.join(scratch, "table.csv")
    write_path(scene, path)
    common = [tool.RENDER, scene, "-q", "--camera-path", path, "--size", "%dx%d" % (SIZE, SIZE), "--block", BLOCK, "--spp-max", 2000]
    tool.run(*common, "--plan-shot", table, "--plan-every", EVERY)
    tool.run(*common, "-o", os.path.join(scratch, "%d.exr"), "--stop-map", os.path.join(scratch, "stops_%d.csv"))
    planned = numbers(table)
    stopped = [numbers(os.path.join(scratch, "stops_%d.csv" % f))[0] for f in range(1, FRAMES + 1)]
    ratios = [p / s for plan, stop in zip(planned, stopped) for p, s in zip(plan, stop)]
    at, between = ([f for f in range(FRAMES) if (f % EVERY == 0) == pilot] for pilot in (True, False))
    share = lambda frames: sum(sum(planned[f]) for f in frames) / sum(sum(stopped[f]) for f in frames)
    step = lambda spp: statistics.mean(abs(math.log2(b / a)) for x, y in zip(spp, spp[1:]) for a, b in zip(x, y))
    return {"at_pilots": share(at), "between": share(between), "short": sum(r < 0.8 for r in ratios) / len(ratios),
            "very_short": sum(r < 0.5 for r in ratios) / len(ratios), "step_table": step(planned), "step_criterion": step(stopped)}


def page(results):
    heads = ("scene", "samples of the table over the criterion's, frames with a pilot", "frames between", "blocks with less than 0.8 of its",
             "less than half", "octaves from frame to frame: table", "criterion")
    rows = [[scene, "%.2f" % r["at_pilots"], "%.2f" % r["between"], tables.percent(r["short"]), tables.percent(r["very_short"]),
             "%.2f" % r["step_table"], "%.2f" % r["step_criterion"]] for scene, r in results["scenes"].items()]
    return tables.table(heads, rows) + "\n%s.\n" % tables.told(results["measured"])


def main(o):
    found = {"measured": tool.measured(), "scenes": {}}
    for scene in o.only:
        with tempfile.TemporaryDirectory() as scratch:
            found["scenes"][scene] = compare(os.path.join(tool.ROOT, "scenes", scene + ".pbrt"), scratch)
        print(scene, *("%s %.2f" % pair for pair in found["scenes"][scene].items()), flush=True)
    if o.write:
        tool.store(o.write, "shots", found)
