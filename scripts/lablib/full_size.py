"""Renders pictures of the size that people render until nothing is seen, raw and denoised: samples, seconds, stops that are off.

Each scene is rendered by `lull-render` and by `lull-render --denoise` with their defaults, and twice more with other seeds as references.
The visible error of each stopped block is that of `ggn visible --second`, which takes the references' own noise out. Seconds are of the
processor, children included. Interrupted, the same command goes on."""
import json
import os
import resource
import statistics

from lablib import tables, tool
from lablib.denoised import REFERENCES, VISIBLE, name_of
from lablib.sources import DENOISED, PICTURES

SOURCES = PICTURES + DENOISED
SCENES = ["scenes/%s.pbrt" % name for name in "cornell-box demo chess rock-garden glossy soft-shadow".split()] + [
    os.path.join("..", "shared", "scenes", name) for name in ("coffee-v3/scene.pbrt", "veach-mis-v4/veach-mis.pbrt")]
WAYS = {"raw": ["-c", "observer"], "denoised": ["--denoise"]}
HEAD = ("scene", "samples: raw / denoised", "denoised / raw", "processor s: raw / denoised", "denoised / raw",
        "of it looks", "raw: stopped, visibly off, worst", "denoised: stopped, visibly off, worst")


def options(parser):
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE.pbrt", help="(eight, two of them by other hands)")
    parser.add_argument("--size", default="800x800", metavar="WxH", help="of the pictures (800x800)")
    parser.add_argument("--block", type=int, default=200, help="side of the blocks (200)")
    parser.add_argument("--spp-max", type=int, default=4096, metavar="N", help="more are not taken; such a block is not stopped (4096)")
    parser.add_argument("--reference-spp", type=int, default=512, metavar="N", help="of each of the two references (512)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "full-size"), metavar="DIR",
                        help="references, pictures, figures; what is there is not made again (build/full-size)")
    tool.writes(parser)


def render(o, scene, out, *how):
    """Processor seconds of a render, children included."""
    spent = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    before = spent()
    tool.run(tool.RENDER, "-q", scene, "--size", o.size, "--block", o.block, *how, "-o", out + ".part.exr")
    os.replace(out + ".part.exr", out)
    return spent() - before


def references(o, scene):
    paths = [os.path.join(o.work, "%s.%s.%d.exr" % (name_of(scene), o.size, seed)) for seed in REFERENCES]
    for path, seed in zip(paths, REFERENCES):
        if not os.path.exists(path):
            render(o, scene, path, "--seed", seed, "--spp", o.reference_spp)
    return paths


def measure(o, scene, way):
    """Figures of one render, which are kept beside its picture."""
    base = os.path.join(o.work, "%s.%s.%s" % (name_of(scene), o.size, way))
    if not os.path.exists(base + ".json"):
        spent = render(o, scene, base + ".exr", *WAYS[way], "--spp-max", o.spp_max, "--report", base + ".report.json")
        report, paths = tool.load(base + ".report.json"), references(o, scene)
        seen = json.loads(tool.ggn("visible", paths[0], base + ".exr", "--second", paths[1], "--block", o.block, "--json"))
        pixels = sum((b["x1"] - b["x0"]) * (b["y1"] - b["y0"]) for b in report["blocks"])
        tool.save({"processor_s": spent, "spp": report["totals"]["samples"] / pixels, "looks_s": report["totals"]["criterion_thread_s"],
                   "blocks": [{"spp": b["spp"], "stopped": b["reason"] == "criterion", "believed": b["error"], "true": s["error"]}
                              for b, s in zip(report["blocks"], seen["blocks"])]}, base + ".json", indent=None)
    return tool.load(base + ".json")


def ratio(of, what):
    return of["denoised"][what] / of["raw"][what]


def stops(blocks):
    stopped = [b["true"] for b in blocks if b["stopped"]]
    return "%d of %d, %d, %s" % (len(stopped), len(blocks), sum(v > VISIBLE for v in stopped), "%.2f" % max(stopped) if stopped else "–")


def cells(scene, of):
    both = lambda what, form: " / ".join(form % of[way][what] for way in WAYS)
    return [scene.replace("scenes-", ""), both("spp", "%.0f"), "%.2f" % ratio(of, "spp"), both("processor_s", "%.0f"),
            "%.2f" % ratio(of, "processor_s"), "%.0f %%" % (100 * of["denoised"]["looks_s"] / of["denoised"]["processor_s"]),
            *(stops(of[way]["blocks"]) for way in WAYS)]


def summary(scenes):
    lines = []
    for what, name in (("spp", "samples"), ("processor_s", "processor seconds")):
        ratios = sorted(ratio(of, what) for of in scenes.values())
        lines.append("%s, denoised / raw: median over scenes **%.2f**, from %.2f to %.2f" % (name, statistics.median(ratios), ratios[0], ratios[-1]))
    for way in WAYS:
        stopped = [b["true"] for of in scenes.values() for b in of[way]["blocks"] if b["stopped"]]
        off = sum(v > VISIBLE for v in stopped)
        lines.append("%s: of %d stopped blocks **%d** (%.0f %%) are visibly off (above %.2f of just seen), the worst %.2f" % (
            way, len(stopped), off, 100 * off / max(1, len(stopped)), VISIBLE, max(stopped, default=0)))
    return "".join("- %s\n" % line for line in lines)


def page(results):
    return "%s: %s pixels, blocks of %d, at most %d samples.\n\n%s\n%s" % (
        tables.provenance(results["measured"]), results["size"].replace("x", "×"), results["block"], results["spp_max"],
        tables.table(HEAD, [cells(scene, of) for scene, of in results["scenes"].items()]), summary(results["scenes"]))


def main(o):
    os.makedirs(o.work, exist_ok=True)
    results = {"measured": tool.measured(), "size": o.size, "block": o.block, "spp_max": o.spp_max, "scenes": {}}
    for scene in o.scenes:
        results["scenes"][name_of(scene)] = {way: measure(o, scene, way) for way in WAYS}
        print("| %s |" % " | ".join(cells(name_of(scene), results["scenes"][name_of(scene)])), flush=True)
    print(page(results))
    if o.write:
        tool.store(o.write, "full_size", results, indent=None)
