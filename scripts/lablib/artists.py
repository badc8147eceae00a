"""Compares pictures that artists make with Cycles and its denoiser with those of lull.blender --denoise: seconds and visible errors.

Each scene is exported to Blender (scripts/hosts/pbrt_to_blend.py). Cycles renders a number of samples, by adaptive sampling to a noise
threshold, or for as long as some number of samples took; lull.blender stops at multiples of what is just seen, or after that time. What is
exported is rendered by `lull-render --denoise` as well. Visible errors are those of the model observer against two references of the same
renderer, whose noise is taken out (`ggn visible --second`). One process renders at a time. Needs bpy in build/hosts (make test-hosts).
Interrupted, the same command goes on."""
import json
import os
import statistics

from lablib import peers, tables, tool
from lablib.sources import DENOISED, OBSERVER

SOURCES = OBSERVER + DENOISED + ("plugin-api/python/lull/blender/*.py",)
SCENES = "cornell-box soft-shadow chess plaza fruit-bowl glossy".split()
SAMPLES, ERRORS, MOST, THRESHOLD = (64, 128, 256), (1, 2, 3), 4096, 0.01
TIMED = "%d samples" % SAMPLES[1]  # whose seconds the ways with a limit of time get
PHASES = ("samples", "synchronisation", "copies", "looks", "denoising")


def options(parser):
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE", help="names of scenes/, or files (%s)" % " ".join(SCENES))
    parser.add_argument("--size", default="640x360", metavar="WxH", help="of the pictures (640x360)")
    parser.add_argument("--block", type=int, default=160, help="side of the blocks (160, as the add-on takes for 640x360)")
    parser.add_argument("--reference-spp", type=int, default=512, metavar="N", help="of each of the two references (512)")
    parser.add_argument("--only-references", action="store_true", help="make these and nothing else")
    parser.add_argument("--ways", nargs="+", metavar="WAY", help="measure only these, as \"128 samples\", adaptive, \"error 1\", and make no tables")
    parser.add_argument("--blender", default=peers.BPY, metavar="PROGRAM", help="a Python with bpy (that of build/hosts)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "artists"), metavar="DIR",
                        help="scenes, references, figures; what is there is not made again (build/artists)")
    tool.writes(parser)


class Scene:
    """One scene's files and figures in the work folder."""

    def __init__(self, o, name, cycles):
        file = name if name.endswith(".pbrt") else os.path.join(tool.ROOT, "scenes", name + ".pbrt")
        self.o, self.name, self.cycles = o, os.path.basename(file)[:-5], cycles
        self.stem = os.path.join(o.work, "%s-%s-%d" % (self.name, o.size, o.block))
        self.blend, self.kept = self.stem + ".blend", self.stem + ".json"
        self.ways = tool.load(self.kept) if os.path.exists(self.kept) else {}
        if not os.path.exists(self.blend):
            cycles.export(file, o.size, self.blend, self.stem + ".pbrt")

    def ours(self, out, seed, *words):
        return peers.ours(self.stem + ".pbrt", self.o.size, self.o.block, seed, out, *words)

    def references(self, ours=False):
        paths = ["%s%s.%d.%d.exr" % (self.stem, ".ours" if ours else "", self.o.reference_spp, seed) for seed in peers.REFERENCES]
        for path, seed in zip(paths, peers.REFERENCES):
            if not os.path.exists(path):
                if ours:
                    self.ours(path + ".part.exr", seed, "--spp", self.o.reference_spp)
                else:
                    self.cycles.render(file=self.blend, out=path + ".part.exr", seed=seed, spp=self.o.reference_spp)
                os.replace(path + ".part.exr", path)
        return paths

    def measure(self, name, **request):
        """Keeps the seconds and visible errors of one way of rendering; without a request by lull-render."""
        if name in self.ways or (self.o.ways and name not in self.o.ways):
            return
        out, report = self.stem + ".exr", self.stem + ".report.json"
        if request:
            spent = self.cycles.render(file=self.blend, out=out, seed=1, **request)
        else:
            spent = self.ours(out, 1, "--denoise", "--spp-max", MOST, "--report", report)
        first, second = self.references(ours=not request)
        seen = json.loads(tool.ggn("visible", first, out, "--second", second, "--block", self.o.block, "--json"))
        self.ways[name] = {**spent, "errors": [b["error"] for b in seen["blocks"]]}
        if "host" in request or not request:
            told = tool.load(report)
            self.ways[name].update(phases=told.get("phases"), blocks=[[b["spp"], b["reason"]] for b in told["blocks"]])
        tool.save(self.ways, self.kept, indent=None)
        off = sum(e > peers.VISIBLE for e in self.ways[name]["errors"])
        print("%s, %s: %.1f processor s, %.1f s, worst block %.2f, %d of %d visibly off" % (
            self.name, name, spent["s"], spent["wall_s"], max(self.ways[name]["errors"]), off, len(self.ways[name]["errors"])), flush=True)

    def host(self, name, *words):
        self.measure(name, spp=MOST, host=["--denoise", "--block", str(self.o.block), "--report", self.stem + ".report.json", *words])

    def measure_all(self):
        for n in SAMPLES:
            self.measure("%d samples" % n, spp=n, denoise=True)
        self.measure("adaptive", spp=MOST, threshold=THRESHOLD, denoise=True)
        for e in ERRORS:
            self.host("error %d" % e, "--error", str(e))
        self.measure("ours")
        if self.o.ways:
            return
        wall = self.ways[TIMED]["wall_s"]
        self.measure("adaptive, timed", spp=MOST, threshold=THRESHOLD, denoise=True, time_limit=wall)
        self.host("timed", "--time-budget", "%.2f" % wall)


# --- figures -------------------------------------------------------------------------------------------------------------

NAMES = {**{"%d samples" % n: "Cycles, %d samples" % n for n in SAMPLES}, "adaptive": "Cycles, adaptive to %g" % THRESHOLD,
         **{"error %d" % e: "`--error %d`" % e for e in ERRORS}, "adaptive, timed": "Cycles, adaptive, in the time of " + TIMED,
         "timed": "`--time-budget`, the same time", "ours": "`lull-render --denoise`"}
JUDGED = ["error %d" % e for e in ERRORS] + ["ours"]  # by blocks


def as_good(ways, name):
    """Processor seconds of Cycles (numbers of samples, denoised) for an equally good worst block, and where that lies."""
    points = [(ways["%d samples" % n]["s"], max(ways["%d samples" % n]["errors"])) for n in SAMPLES]
    return peers.at_equal(points, max(ways[name]["errors"]))


def ways_table(scenes):
    rows = []
    for name in NAMES:
        of = [ways[name] for ways in scenes.values()]
        base = [w["s"] / ways[TIMED]["s"] for w, ways in zip(of, scenes.values())]
        errors = [e for w in of for e in w["errors"]]
        rows.append([NAMES[name], "%.0f" % sum(w["s"] for w in of), "%.0f" % sum(w["wall_s"] for w in of), peers.spread(base),
                     peers.spread([max(w["errors"]) for w in of]), "%.2f" % statistics.mean(errors),
                     tables.percent(sum(e > peers.VISIBLE for e in errors) / len(errors))])
    heads = ("way", "processor s, all", "wall clock s, all", "processor s against %s, median (range)" % TIMED,
             "worst block, median (range)", "mean block", "visibly off")
    return tables.table(heads, rows)


def scenes_table(scenes):
    rows = []
    for scene, ways in scenes.items():
        row = [scene]
        for name in JUDGED:
            w, (seconds, where) = ways[name], as_good(ways, name)
            sign = {"<": "≥ ", ">": "≈ "}.get(where, "")
            row += ["%.0f" % (sum(n for n, _ in w["blocks"]) / len(w["blocks"])), "%.1f" % w["s"], "%.2f" % max(w["errors"]),
                    "%s%.2f" % (sign, w["s"] / seconds)]
        rows.append(row)
    return tables.table(["scene"] + [head % name.replace("error ", "") for name in JUDGED for head in
                                     ("%s: samples", "%s: s", "%s: worst block", "%s: of Cycles' seconds for it")], rows)


def phases_table(scenes):
    rows = []
    for scene, ways in scenes.items():
        of = ways["error 1"]
        rows.append([scene, "%.1f" % of["wall_s"], *("%.0f %%" % (100 * of["phases"].get(p + "_s", 0) / of["wall_s"]) for p in PHASES)])
    return tables.table(("scene", "wall clock s", *PHASES), rows)


def page(results):
    o = results["options"]
    return "%s, Blender %s; %s pixels, blocks of %d, references of 2 × %d samples.\n\n%s\n%s\n%s" % (
        tables.provenance(results["measured"]), results["blender"], o["size"].replace("x", "×"), o["block"], o["reference_spp"],
        ways_table(results["scenes"]), scenes_table(results["scenes"]), phases_table(results["scenes"]))


def main(o):
    if not os.path.exists(o.blender):
        raise tool.Refused("no program %s: make test-hosts" % o.blender)
    os.makedirs(o.work, exist_ok=True)
    cycles = peers.Cycles(o.blender)
    try:
        scenes = [Scene(o, name, cycles) for name in o.scenes]
        for scene in scenes:
            scene.references()
        if o.only_references:
            return
        for scene in scenes:
            scene.measure_all()
    finally:
        cycles.close()
    if o.ways:
        return
    results = {"measured": tool.measured(), "blender": cycles.version(), "options": {k: getattr(o, k) for k in ("size", "block", "reference_spp")},
               "scenes": {scene.name: scene.ways for scene in scenes}}
    print(page(results))
    if o.write:
        tool.store(o.write, "artists", results, indent=None)
