"""Renders the reference scenes and compares with the answers of other renderers.

The references are pbrt-v4's images (references/SCENE--FILE.exr) and TungstenRender.exr of some scene folders. Images are compared by
the luminance means of 20x20-pixel tiles after one exposure scalar (the median ratio). Needs oiiotool. Exit status 1: some missed."""
import os
import statistics
import tempfile

from lablib import tables, tool
from lablib.sources import PICTURES
from lablib.tool import RENDER, run

SOURCES = PICTURES
TILE = 20
# Scenes whose Tungsten image is of the same view; the side to render, short.
TUNGSTEN = {"staircase2-v4/staircase2.pbrt": "staircase2-v4", "living-room-v4/living-room.pbrt": "living-room-v4",
            "staircase-v4/staircase.pbrt": "staircase-v4", "coffee-v3/scene.pbrt": "coffee-v3"}
HEAD = ("reference", "spp of ours", "exposure", "median difference", "tiles within 15 %", "measured")


def options(parser):
    parser.add_argument("--spp", type=int, default=128, help="samples per pixel of our render (128)")
    parser.add_argument("--pictures", type=tool.path, metavar="DIR", help="write our image beside the reference, one PNG each")
    parser.add_argument("--only", default="", metavar="TEXT", help="only references whose name contains this")
    parser.add_argument("--shared", type=tool.path, default=tool.SHARED, help="../shared; without references/ the job ends at once")
    tool.writes(parser)


def tiles(path, size, scratch):
    """Luminance means of the whole tiles of an image file, resized to `size` first if it is another."""
    columns, rows = size[0] // TILE, size[1] // TILE
    small = os.path.join(scratch, "tiles.exr")
    run("oiiotool", path, "--ch", "R,G,B", "--resize:filter=box", "%dx%d" % size, "--cut", "%dx%d+0+0" % (columns * TILE, rows * TILE),
        "--resize:filter=box", "%dx%d" % (columns, rows), "-d", "float", "-o", small)
    values = [line.split(":")[1].split() for line in run("oiiotool", "--dumpdata", small).splitlines() if line.strip().startswith("Pixel")]
    assert len(values) == columns * rows
    return [0.2126729 * float(r) + 0.7151522 * float(g) + 0.072175 * float(b) for r, g, b in values]


def compare(ours, reference):
    pairs = [(a, b) for a, b in zip(ours, reference) if b > 0]
    scale = statistics.median(b / a for a, b in pairs if a > 0)
    differences = sorted(abs(scale * a - b) / b for a, b in pairs)
    within = sum(d <= 0.15 for d in differences) / len(differences)
    return scale, statistics.median(differences), within


def size_of(path):
    width, _, height = run("oiiotool", "--info", path).split(":")[-1].split(",")[0].split()[:3]
    return int(width), int(height)


def picture(ours, reference, size, scale, out):
    run("oiiotool", ours, "--ch", "R,G,B", "--mulc", scale, reference, "--ch", "R,G,B", "--resize:filter=box", "%dx%d" % size,
        "--mosaic:pad=4", "2x1", "--powc", 1 / 2.2, "-d", "uint8", "-o", out)


def wanted(shared):
    """(name, scene file, reference image, least share of tiles within 15 %, largest median)"""
    folder = os.path.join(shared, "references")
    for name in sorted(os.listdir(folder)):
        if name.endswith(".exr"):
            scene, file = name[:-4].split("--")
            yield name[:-4], os.path.join(shared, "scenes", scene, file + ".pbrt"), os.path.join(folder, name), 0.90, 0.04
    for scene, where in TUNGSTEN.items():
        image = os.path.join(shared, "scenes", where, "TungstenRender.exr")
        if os.path.exists(image):
            yield "tungsten " + where, os.path.join(shared, "scenes", scene), image, 0.80 if "coffee" in where else 0.90, 0.05


def held(rows, of):
    """[whether it holds what is wanted] of the references of pbrt or of tungsten"""
    return [r["median"] <= 0.04 and r["within"] >= 0.9 for name, r in rows.items() if name.startswith("tungsten") == (of == "tungsten")]


def page(rows):
    return tables.table(HEAD, [[name, str(r["spp"]), "%.3f" % r["exposure"], "%.1f %%" % (100 * r["median"]), "%.0f %%" % (100 * r["within"]),
                                "%s, %s" % (r["measured"]["date"], r["measured"]["commit"])] for name, r in rows.items()])


def main(o):
    if not os.path.isdir(os.path.join(o.shared, "references")):
        print("no references at", o.shared)
        return 0
    if o.pictures:
        os.makedirs(o.pictures, exist_ok=True)
    found, missed, measured = {}, 0, tool.measured()
    print("%-52s %9s %8s %11s" % ("reference", "exposure", "median", "within 15 %"))
    with tempfile.TemporaryDirectory() as scratch:
        for name, scene, reference, share, median in wanted(o.shared):
            if o.only not in name:
                continue
            size = size_of(reference)
            if name.startswith("tungsten"):
                short = min(size)
                size = (round(size[0] * 200 / short), round(size[1] * 200 / short))
            out = os.path.join(scratch, "ours.exr")
            run(RENDER, "-q", "--spp", o.spp, "--size", "%dx%d" % size, "-o", out, scene)
            scale, middle, within = compare(tiles(out, size, scratch), tiles(reference, size, scratch))
            good = middle <= median and within >= share
            missed += not good
            found[name] = {"spp": o.spp, "exposure": scale, "median": middle, "within": within, "measured": measured}
            print("%-52s %9.3f %7.1f%% %10.0f%%%s" % (name, scale, 100 * middle, 100 * within, "" if good else "  <-- misses"), flush=True)
            if o.pictures:
                picture(out, reference, size, scale, os.path.join(o.pictures, name.replace(" ", "-") + ".png"))
    print("%d missed" % missed)
    if o.write:
        tool.store(o.write, "references", {**tool.results(o.write, "references"), **found})
    return 1 if missed else 0
