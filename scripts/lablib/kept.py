"""Holds the picture that --denoise keeps at a fixed number of samples against the noisy and the denoised one.

Each scene is rendered with `lull-render --denoise --spp N` for several N, and twice more with other seeds as references. The error of a block is
the root mean square of L* against both references, whose own noise is taken out. Interrupted, the same command goes on. Needs
numpy (python3-numpy), Pillow (python3-pil) and oiiotool."""
import math
import os
import statistics
import textwrap

from lablib import tables, tool
from lablib.sources import DENOISED, PICTURES

SOURCES = PICTURES + DENOISED
SCENES = "chess glossy soft-shadow cornell-box office museum crockery defocus garage kitchen fasteners gems".split()
SPP, REFERENCES = (8, 16, 32, 64, 128, 256), (101, 102)
BETTER = 1.02  # times the better of noisy and denoised: more counts as worse than both
LAYERS = {"kept": "R,G,B", "noisy": "noisy.R,noisy.G,noisy.B", "denoised": "denoised.R,denoised.G,denoised.B"}
HEAD = ("samples", "blocks", "kept / better of noisy and denoised: median", "nine of ten below", "worst", "above %.2f" % BETTER,
        "kept / noisy, median", "kept / denoised, median")


def options(parser):
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE", help="names of scenes/ (%s)" % " ".join(SCENES))
    parser.add_argument("--size", type=int, default=200, help="side of the pictures, a multiple of 100 (200)")
    parser.add_argument("--reference-spp", type=int, default=640, metavar="N", help="of each of the two references (640)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "kept"), metavar="DIR",
                        help="references and pictures; what is there is not made again (build/kept)")
    tool.writes(parser)


def channels(path):
    """[height, width, 3] of a file that holds three channels one below the other."""
    import numpy as np
    from PIL import Image
    with Image.open(path) as image:
        values = np.asarray(image, np.float32)
    return values.reshape(3, values.shape[0] // 3, values.shape[1]).transpose(1, 2, 0)


def render(o, scene, name, *how, layers=None):
    """{layer: picture}, each kept as NAME.LAYER.tif."""
    layers = layers or {"kept": "R,G,B"}
    paths = {layer: os.path.join(o.work, "%s.%s.tif" % (name, layer)) for layer in layers}
    if not all(map(os.path.exists, paths.values())):
        exr = os.path.join(o.work, name + ".exr")
        tool.run(tool.RENDER, "-q", os.path.join(tool.ROOT, "scenes", scene + ".pbrt"), "--size", "%dx%d" % (o.size, o.size), "--block", o.size,
                 *how, "-o", exr)
        for layer, named in layers.items():
            part = paths[layer] + ".part.tif"
            one_by_one = [word for channel in named.split(",") for word in (exr, "--ch", channel, "--chnames", "Y")]
            tool.run("oiiotool", *one_by_one, "--mosaic", "1x3", "-d", "float", "-o", part)
            os.replace(part, paths[layer])
        os.remove(exr)
    return {layer: channels(path) for layer, path in paths.items()}


def lightness(rgb):
    """CIE L* of what a display sends for linear RGB [h, w, 3]."""
    import numpy as np
    y = np.clip(rgb, 0, 1) @ np.array([0.2126729, 0.7151522, 0.0721750], np.float32)
    return np.where(y > 216 / 24389, 116 * np.cbrt(y) - 16, y * (24389 / 27)).astype(np.float64)


def errors(picture, references):
    """Root mean square of L* of each block of 100x100."""
    shown = lightness(picture)
    square = (shown - references[0]) * (shown - references[1])
    side = square.shape[0]
    return [math.sqrt(max(float(square[y:y + 100, x:x + 100].mean()), 1e-6)) for y in range(0, side, 100) for x in range(0, side, 100)]


def measure(o, scene):
    """{samples: [{layer: error} of each block]}"""
    references = [lightness(render(o, scene, "%s-%d-%d" % (scene, o.size, seed), "--seed", seed, "--spp", o.reference_spp)["kept"])
                  for seed in REFERENCES]
    found = {}
    for spp in SPP:
        made = render(o, scene, "%s-%d-at-%d" % (scene, o.size, spp), "--denoise", "--spp", spp, layers=LAYERS)
        of = {layer: errors(picture, references) for layer, picture in made.items()}
        found[spp] = [dict(zip(of, block)) for block in zip(*of.values())]
    return found


def row(spp, blocks):
    over = sorted(b["kept"] / min(b["noisy"], b["denoised"]) for b in blocks)
    median = lambda layer: statistics.median(b["kept"] / b[layer] for b in blocks)
    return [str(spp), str(len(blocks)), *("%.2f" % v for v in (statistics.median(over), over[int(0.9 * (len(over) - 1))], over[-1])),
            "%.0f %%" % (100 * sum(v > BETTER for v in over) / len(over)), "%.2f" % median("noisy"), "%.2f" % median("denoised")]


def page(results):
    table = tables.table(HEAD, [row(spp, [b for scene in results["scenes"].values() for b in scene[str(spp)]]) for spp in SPP])
    head = textwrap.fill("%s: %s." % (tables.provenance(results["measured"]), ", ".join(results["scenes"])), 140)
    return "%s\n\n%s" % (head, table)


def main(o):
    os.makedirs(o.work, exist_ok=True)
    results = {"measured": tool.measured(), "scenes": {scene: {str(n): b for n, b in measure(o, scene).items()} for scene in o.scenes}}
    print(page(results))
    if o.write:
        tool.store(o.write, "kept", results, indent=None)
