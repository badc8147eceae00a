"""Where the kernel's time goes: samples of the processor's clock, sorted by what the code that they fall into is for.

perf (linux-perf) takes a sample every half millisecond of one thread of lull-render, addr2line (binutils) names the inlined function it
falls into. What loading and starting take is subtracted: a render of few samples from one of many. Scenes of ../shared are looked at
when that folder is there. `--as before` keeps the figures in the column of a tree before a change (with its programs as BUILD)."""
import collections
import os
import re
import subprocess
import tempfile

from lablib import bench, tables, tool
from lablib.sources import PICTURES

SOURCES = PICTURES

# The first name that fits a source file; arithmetic on vectors belongs to who asks for it.
PARTS = (("sampler", "sample/"), ("hit to place", "integ/surface geom/offset geom/quadric"), ("rays in and out of packets", "geom/accel"),
         ("textures", "shade/texture"), ("lights", "shade/light"), ("BSDFs", "shade/bsdf shade/warp shade/coat shade/microfacet "
          "shade/fresnel shade/material shade/inputs"), ("media", "shade/medium shade/phase"), ("path", "integ/"),
         ("camera and film", "shade/camera render/ plugin-api/"))
EMBREE, LIBM, REST = "Embree", "C library", "other"
TRANSPARENT = ("scene/vec.h", "base/colour.h")


def options(parser):
    parser.add_argument("--only", type=lambda text: text.split(","), metavar="SCENES", help="some of: Cornell box, staircase2, living-room, terrain")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel (64; a quarter of them in the scenes of ../shared)")
    parser.add_argument("--functions", type=int, default=0, metavar="N", help="print the N functions with most samples, too")
    parser.add_argument("--as", dest="column", choices=("before", "now"), default="now", help="the column of the table (now)")
    parser.add_argument("--commit", help="that BUILD was made of, if it is not this one")
    tool.writes(parser)


def frames(program, addresses):
    """{address: [(function, file) from the innermost to the outermost]}"""
    text = subprocess.run(["addr2line", "-i", "-f", "-a", "-e", program], input="".join("%#x\n" % a for a in addresses), check=True,
                          stdout=subprocess.PIPE, text=True).stdout
    found, at = {}, None
    lines = iter(text.splitlines())
    for line in lines:
        if re.fullmatch(r"0x[0-9a-f]{16}", line):
            at = found[int(line, 16)] = []
        else:
            at.append((line, next(lines).rsplit(":", 1)[0]))
    return found


def place(chain):
    """The part and the function that an address belongs to."""
    for function, file in chain:
        if not file.endswith(TRANSPARENT):
            for part, names in PARTS:
                if any("/" + name in "/" + file for name in names.split()):
                    return part, function
            return REST, function
    return REST, chain[0][0]


def record(scratch, scene, size, spp, depth):
    """{(part, function): seconds} of one thread that renders a scene."""
    data = os.path.join(scratch, "perf.data")
    tool.run("perf", "record", "-q", "-o", data, "-e", "cpu-clock", "-F", "2000", tool.RENDER, "-q", "-t", "1", "--size", size, "--spp", spp,
             *(["--max-depth", depth] if depth else []), "-o", os.path.join(scratch, "picture.exr"), scene)
    start, inside, found = None, collections.Counter(), collections.Counter()
    for line in tool.run("perf", "script", "-i", data, "-F", "ip,dso", "--show-mmap-events").splitlines():
        mapped = re.search(r"MMAP2.*\[0x([0-9a-f]+)\(.*@ (\S+) .*r-xp (\S+)", line)
        if mapped:
            if mapped[3] == os.path.realpath(tool.RENDER):
                start = int(mapped[1], 16) - int(mapped[2], 0)
            continue
        sample = re.match(r"\s*([0-9a-f]+) \((.*)\)$", line)
        if not sample:
            continue
        if sample[2] == os.path.realpath(tool.RENDER):
            inside[int(sample[1], 16) - start] += 1
        elif "libembree" in sample[2]:
            found[EMBREE, EMBREE] += 1
        elif "libm." in sample[2] or "libc." in sample[2]:
            found[LIBM, LIBM] += 1
    named = frames(tool.RENDER, inside)
    for address, count in inside.items():
        found[place(named[address])] += count
    return found


def looked_at(o, scratch):
    scenes = [("Cornell box", bench.BOX, "400x400", o.spp, 8)]
    for name, file, size in (("staircase2", "staircase2-v4/staircase2.pbrt", "400x400"), ("living-room", "living-room-v4/living-room.pbrt", "400x225")):
        if os.path.exists(os.path.join(bench.SHARED, file)):
            scenes.append((name, os.path.join(bench.SHARED, file), size, max(2, o.spp // 4), 0))
    if not o.only or "terrain" in o.only:
        scenes.append(("terrain", bench.write_terrain(scratch, 1323), "400x400", o.spp, 0))
    return [scene for scene in scenes if not o.only or scene[0] in o.only]


def page(results):
    """The table, and who measured its columns."""
    before, now = results["before"], results["now"]
    scenes = [name for name in now["scenes"] if name in before["scenes"]]
    parts = [EMBREE, *(part for part, _ in PARTS), LIBM, REST]
    share = lambda column, scene, part: tables.percent(max(0.0, column["scenes"][scene].get(part, 0.0)))
    rows = [[part] + [share(column, scene, part) for scene in scenes for column in (before, now)] for part in parts]
    heads = ["share of the time"] + ["%s, %s" % (scene, column) for scene in scenes for column in ("before", "now")]
    bound = ", ".join("%s %.2f" % (scene, 1.0 / now["scenes"][scene][EMBREE]) for scene in scenes)
    return "%s\nIf all but Embree cost nothing, now would be so many times as fast: %s.\nMeasured by `%s`, %s; before: commit %s.\n" % (
        tables.table(heads, rows), bound, now["measured"]["command"], tables.provenance(now["measured"]), before["measured"]["commit"])


def main(o):
    found = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name, scene, size, spp, depth in looked_at(o, scratch):
            many = record(scratch, scene, size, spp, depth)
            many.subtract(record(scratch, scene, size, 1, depth))
            total, parts = sum(many.values()), collections.Counter()
            for (part, _), count in many.items():
                parts[part] += count
            found[name] = {part: count / total for part, count in parts.most_common()}
            print(name, *("  %4.1f %%  %s" % (100 * count / total, part) for part, count in parts.most_common()), sep="\n", flush=True)
            for (part, function), count in many.most_common(o.functions):
                print("    %4.1f %%  %s: %s" % (100 * count / total, part, function))
    if o.write:
        results = tool.results(o.write, "profile")
        measured = tool.measured(**({"commit": o.commit} if o.commit else {}))
        tool.store(o.write, "profile", {**results, o.column: {"measured": measured, "scenes": {**results.get(o.column, {}).get("scenes", {}), **found}}})
