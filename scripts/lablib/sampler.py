"""Compares the error of Sobol' points in pictures with that of independent numbers, and counts instructions.

tests/bench/pt_sampler.c says how the error is measured; instructions are counted by valgrind (--tool=callgrind), which has to be there.
`--as before` keeps the figures in the column of a tree before a change (run it there, or with its programs as BUILD)."""
import json
import os
import re
import statistics
import subprocess

from lablib import tables, tool

PROGRAM = os.path.join(tool.BUILD, "bench", "pt_sampler")
SCENES = ("cornell-box soft-shadow environment window texture office kitchen glossy indirect defocus motion many-lights bedroom plaza").split()
COUNTED = ("cornell-box", "kitchen")
SPPS = ("64", "256", "1024")


def options(parser):
    parser.add_argument("--size", default="32x32", metavar="WxH", help="of the pictures (32x32)")
    parser.add_argument("--seeds", type=int, default=8, help="of which the error is the mean (8)")
    parser.add_argument("--reference", type=int, default=4096, metavar="SPP", help="samples of the independent reference (4096)")
    parser.add_argument("--only", type=lambda text: text.split(","), default=SCENES, metavar="SCENES", help="some of the scenes")
    parser.add_argument("--as", dest="column", choices=("before", "now"), default="now", help="the column of the table (now)")
    tool.writes(parser)


def path(scene):
    return os.path.join(tool.ROOT, "scenes", scene + ".pbrt")


def instructions(scene, sampler):
    """Of one path, without those of loading: the difference of two runs."""
    def count(spp):
        done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", PROGRAM, path(scene), "32x32", "0", str(spp), sampler],
                              capture_output=True, text=True)
        found = re.search(r"Collected : (\d+)", done.stderr)
        if done.returncode or not found:
            raise tool.Refused("valgrind cannot count the instructions of %s" % PROGRAM)
        return int(found[1])
    return round((count(10) - count(2)) / (32 * 32 * 8))


def page(results):
    """The table, and who measured its columns."""
    before, now = results["before"], results["now"]
    cell = lambda column, scene, spp: "%.2f ± %.2f" % tuple(column["error"][scene][spp])
    rows = [[scene] + [cell(column, scene, spp) for spp in SPPS for column in (before, now)] for scene in now["error"] if scene in before["error"]]
    heads = ["scene"] + ["%s spp, %s" % (spp, column) for spp in SPPS for column in ("before", "now")]
    ratios = [statistics.median(now["error"][r[0]][spp][0] / before["error"][r[0]][spp][0] for r in rows) for spp in SPPS]
    text = tables.table(heads, rows) + "\nNow over before, median of the scenes: %.2f, %.2f and %.2f.\n" % tuple(ratios)
    for scene in now["instructions"]:
        text += "Instructions of a path, %s: %d before, %d now, %d with independent numbers.\n" % (
            scene, before["instructions"][scene]["sobol"], now["instructions"][scene]["sobol"], now["instructions"][scene]["independent"])
    return text + "Measured by `%s`, %s; before: commit %s.\n" % (now["measured"]["command"], tables.told(now["measured"]), before["measured"]["commit"])


def main(o):
    tool.run("make", "-C", tool.ROOT, os.path.relpath(PROGRAM, tool.ROOT))
    found = {"measured": tool.measured(), "error": {}, "instructions": {}}
    for scene in o.only:
        told = json.loads(tool.run(PROGRAM, path(scene), o.size, o.seeds, o.reference))
        found["error"][scene] = {spp: told[spp] for spp in SPPS}
        print(scene, *("%s: %.2f ± %.2f" % (spp, *told[spp]) for spp in SPPS), flush=True)
        if scene in COUNTED:
            found["instructions"][scene] = {sampler: instructions(scene, sampler) for sampler in ("sobol", "independent")}
    if o.write:
        tool.store(o.write, "sampler", {**tool.results(o.write, "sampler"), o.column: found})
