"""Renders every scene of scenes/ small and puts the pictures into docs/scenes.jpg, row by row in the order of their names.

Needs oiiotool."""
import glob
import os
import shutil
import tempfile

from lablib import tool
from lablib.tool import run


def options(parser):
    parser.add_argument("spp", nargs="?", type=int, default=64, help="samples per pixel (64)")
    parser.add_argument("--out", type=tool.path, default=os.path.join(tool.DOCS, "scenes.jpg"))


def main(o):
    if not shutil.which("oiiotool"):
        raise tool.Refused("oiiotool is missing: apt-get install openimageio-tools")
    cells = []
    with tempfile.TemporaryDirectory() as scratch:
        for scene in sorted(glob.glob(os.path.join(tool.ROOT, "scenes", "*.pbrt"))):
            name = os.path.basename(scene)[:-len(".pbrt")]
            picture, cell = (os.path.join(scratch, name + end) for end in (".png", ".cell.png"))
            size = "160x120" if name == "gallery" else "160x160"
            run(tool.RENDER, "-q", "--spp", o.spp, "--size", size, "--preview", picture, scene)
            run("oiiotool", picture, "--fit:pad=1", "160x160", "-o", cell)
            cells.append(cell)
        run("oiiotool", *cells, "--mosaic:pad=4", "8x%d" % ((len(cells) + 7) // 8), "--attrib", "CompressionQuality", 85, "-o", o.out)
    print("%s: %d scenes" % (os.path.relpath(o.out, tool.ROOT), len(cells)))
