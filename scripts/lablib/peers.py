"""Compares with Blender's Cycles at equal visible quality, raw and denoised: processor seconds until the worst block is as good.

Each scene is exported with what both renderers have (scripts/hosts/pbrt_to_blend.py); it counts if their references agree. Cycles goes
down its ladder of noise thresholds until its worst block is as good as ours; between two thresholds seconds are interpolated as
logarithms. Visible errors are those of the model observer against two references of the same renderer, whose noise is taken out
(`ggn visible --second`). One process renders at a time, ours on one thread; ways take turns within a seed, seeds come last, so that an
interrupted run has all scenes. Needs bpy in build/hosts (make test-hosts) or the program blender, and oiiotool."""
import json
import math
import os
import shutil
import statistics
import subprocess
import sys

from lablib import tables, tool
from lablib.sources import DENOISED, OBSERVER, PICTURES

SOURCES = PICTURES + OBSERVER + DENOISED
SCENES = "cornell-box soft-shadow glossy corridor bathroom chess indirect-hall glossy-row".split()
LADDER = (0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.0025)
DENOISED_LADDER = (0.1, 0.03, 0.01)
UNIFORM, MOST, AGREE, VISIBLE = (64, 256), 4096, 0.05, 1.05
REFERENCES = (101, 102)
CELLS = 4  # a side of the picture, in which references of both renderers are compared
BPY = os.path.join(tool.BUILD, "hosts", "bpy", "bin", "python3")
WORKER = os.path.join(tool.ROOT, "scripts", "hosts", "peer_cycles.py")
EXPORT = os.path.join(tool.ROOT, "scripts", "hosts", "pbrt_to_blend.py")


def options(parser):
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE",
                        help="names of scenes/, or files (%s)" % " ".join(SCENES))
    parser.add_argument("--only", choices=("raw", "denoised"), help="one of the two tables; the other's figures stay (both)")
    parser.add_argument("--size", type=int, default=128, help="side of the pictures (128)")
    parser.add_argument("--block", type=int, default=64, help="side of the blocks (64)")
    parser.add_argument("--seeds", type=int, default=3, help="of each scene; 0: only tell what is kept (3)")
    parser.add_argument("--reference-spp", type=int, default=2048, metavar="N", help="of each of the two references of a renderer (2048)")
    parser.add_argument("--blender", default=BPY if os.path.exists(BPY) else "blender", metavar="PROGRAM",
                        help="a Python with bpy, or blender, which is compared raw if it has no denoiser (bpy of build/hosts, if it is there)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "peers"), metavar="DIR",
                        help="scenes, references, figures; what is there is not made again (build/peers)")
    tool.writes(parser)


class Cycles:
    """A Blender that waits for what to render; a new one if it died."""

    def __init__(self, program):
        self.blender = os.path.basename(program).startswith("blender")
        self.command = [program, "-b", "--factory-startup", "-noaudio", "--python"] if self.blender else [program]
        self.process = None

    def export(self, scene, size, blend, pbrt):
        tool.run(*self.command, EXPORT, "--", scene, blend, size, pbrt)
        if not os.path.exists(pbrt):
            raise tool.Refused("%s cannot be exported: %s" % (scene, EXPORT))

    def render(self, **request):
        """One render: {"s": processor seconds, "wall_s": those of the clock}."""
        if not self.process:
            env = {**os.environ, "LULL_PLUGIN_PATH": os.path.join(tool.BUILD, "lib", "lull")}
            self.process = subprocess.Popen([*self.command, WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                            stderr=subprocess.DEVNULL, text=True, errors="replace", env=env)
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        for line in self.process.stdout:
            if line.startswith("PEER "):
                reply = json.loads(line[5:])
                if "error" in reply:
                    raise tool.Refused("%s: %s" % (request["file"], reply["error"].strip()))
                return reply
        self.process = None
        raise tool.Refused("%s: Blender died" % request["file"])

    def version(self):
        asked = ["--version"] if self.blender else ["-c", "import bpy; print('Blender', bpy.app.version_string)"]
        return tool.run(self.command[0], *asked).split()[1]

    def close(self):
        if self.process:
            self.process.stdin.close()
            self.process.wait()


def ours(pbrt, size, block, seed, out, *words):
    """Renders with lull-render: its processor seconds, its denoiser's included, and those of the clock, as Cycles.render gives them."""
    before = os.times()
    tool.run(tool.RENDER, "-q", pbrt, "--size", size, "--block", block, "--filter", "box", "--seed", seed, "-o", out, *words)
    after = os.times()
    return {"s": after.children_user + after.children_system - before.children_user - before.children_system, "wall_s": after.elapsed - before.elapsed}


class Scene:
    """One scene's files and figures in the work folder."""

    def __init__(self, o, name, cycles):
        file = name if name.endswith(".pbrt") else os.path.join(tool.ROOT, "scenes", name + ".pbrt")
        self.o, self.name, self.cycles = o, os.path.basename(file)[:-5], cycles
        self.stem = os.path.join(o.work, "%s-%d-%d-%d" % (self.name, o.size, o.block, o.reference_spp))
        self.blend, self.pbrt, self.kept = self.stem + ".blend", self.stem + ".pbrt", self.stem + ".json"
        self.found = tool.load(self.kept) if os.path.exists(self.kept) else {"ways": {}}
        if not os.path.exists(self.pbrt):
            cycles.export(file, "%dx%d" % (o.size, o.size), self.blend, self.pbrt)

    def keep(self):
        tool.save(self.found, self.kept)

    def references(self, renderer):
        paths = ["%s.%s.%d.exr" % (self.stem, renderer, seed) for seed in REFERENCES]
        for path, seed in zip(paths, REFERENCES):
            if not os.path.exists(path):
                made = path[:-4] + ".part.exr"
                if renderer == "ours":
                    self.render(seed, made, "--spp", self.o.reference_spp)
                else:
                    self.cycles.render(file=self.blend, out=made, seed=seed, spp=self.o.reference_spp)
                os.replace(made, path)
        return paths

    def render(self, seed, out, *words):
        return ours(self.pbrt, "%dx%d" % (self.o.size, self.o.size), self.o.block, seed, out, "-t", 1, *words)["s"]

    def agree(self):
        """Whether the renderers' references do in every cell; how much they differ is kept."""
        if "differ" not in self.found:
            a, b = ([sum(x) / 2 for x in zip(*(cells(path, self.o.size) for path in self.references(r)))] for r in ("ours", "cycles"))
            self.found["differ"] = max(abs(y / x - 1) for x, y in zip(a, b))
            self.keep()
            print("%s: references differ by at most %.1f %%" % (self.name, 100 * self.found["differ"]), flush=True)
        return self.found["differ"] <= AGREE

    def way(self, seed, name, renderer, render):
        """Seconds and visible errors of one way of rendering, measured if they are not kept; None: it cannot be had."""
        key = "%d %s" % (seed, name)
        if key not in self.found["ways"]:
            out = self.stem + ".exr"
            try:
                seconds = render(out)
            except tool.Refused as why:
                print("lab peers: %s: %s" % (key, why), file=sys.stderr, flush=True)
                return None
            first, second = self.references(renderer)
            seen = json.loads(tool.ggn("visible", first, out, "--second", second, "--block", self.o.block, "--json"))
            self.found["ways"][key] = {"s": seconds, "errors": [b["error"] for b in seen["blocks"]]}
            self.keep()
            print("%s %s: %.2f s, worst %.2f" % (self.name, key, seconds, self.worst(seed, name)), flush=True)
        return self.found["ways"][key]

    def worst(self, seed, name):
        return max(self.found["ways"]["%d %s" % (seed, name)]["errors"])

    def ours(self, seed, name, *words):
        return self.way(seed, name, "ours", lambda out: self.render(seed, out, *words))

    def cycles_way(self, seed, name, **request):
        return self.way(seed, name, "cycles", lambda out: self.cycles.render(file=self.blend, out=out, seed=seed, **request)["s"])

    def measure_raw(self, seed):
        ours = self.ours(seed, "ours")
        hosted = self.cycles_way(seed, "host", spp=MOST, host=["--block", str(self.o.block)])
        goal = min(max(w["errors"]) for w in (ours, hosted) if w)
        for t in LADDER:
            own = self.cycles_way(seed, "cycles %g" % t, spp=MOST, threshold=t)
            if own and max(own["errors"]) <= goal:
                break
        for n in UNIFORM:
            self.cycles_way(seed, "cycles n=%d" % n, spp=n)

    def measure_denoised(self, seed):
        self.ours(seed, "ours denoised", "--denoise")
        for n in UNIFORM:
            self.ours(seed, "ours n=%d denoised" % n, "--spp", n, "--denoise=full")
        for t in DENOISED_LADDER:
            if not self.cycles_way(seed, "cycles %g denoised" % t, spp=MOST, threshold=t, denoise=True):
                return  # this Blender has no denoiser
        self.cycles_way(seed, "host denoised", spp=MOST, host=["--block", str(self.o.block), "--denoise"])
        for n in UNIFORM:
            self.cycles_way(seed, "cycles n=%d denoised" % n, spp=n, denoise=True)


def cells(path, size):
    """Mean of R + G + B in each cell of the picture, row by row."""
    from lull import exr
    plain = path + ".plain.exr"
    tool.run("oiiotool", path, "--ch", "R,G,B", "-d", "float", "--compression", "none", "-o", plain)
    try:
        channels, _ = exr.read(plain)
    finally:
        os.unlink(plain)
    whole, side = sum(channels[c].astype(float) for c in "RGB"), size // CELLS
    return [float(whole[y * side:(y + 1) * side, x * side:(x + 1) * side].mean()) for y in range(CELLS) for x in range(CELLS)]


# --- figures -------------------------------------------------------------------------------------------------------------


def at_equal(points, goal):
    """Processor seconds of [(seconds, worst error)], in the order of the ladder, where its worst block is as good as the goal; and
    where that lies: "" between two settings, "<" if the first is good enough already, ">" beyond the last, as noise falls."""
    for k, (s, e) in enumerate(points):
        if e <= goal:
            if k == 0:
                return s, "<"
            s0, e0 = points[k - 1]
            return s0 * (s / s0) ** (math.log(e0 / goal) / math.log(e0 / e)), ""
    s, e = points[-1]
    return s * (e / goal) ** 2, ">"


def seeds_of(found):
    return sorted({int(key.split()[0]) for key in found["ways"]})


def ladder(found, seed, names):
    ways = [found["ways"].get("%d %s" % (seed, name)) for name in names]
    return [(w["s"], max(w["errors"])) for w in ways if w]


def ratio(found, seed, way, names):
    """A way's seconds, its worst block, Cycles' seconds for the same, their ratio, and where on the ladder that lies."""
    mine, points = found["ways"].get("%d %s" % (seed, way)), ladder(found, seed, names)
    if not mine or not points:
        return None
    worst = max(mine["errors"])
    seconds, where = at_equal(points, worst)
    return {"s": mine["s"], "worst": worst, "cycles_s": seconds, "ratio": mine["s"] / seconds, "where": where}


RAW = ["cycles %g" % t for t in LADDER]
DENOISED = ["cycles %g denoised" % t for t in DENOISED_LADDER]
UNIFORMS = {what: ["cycles n=%d%s" % (n, what) for n in UNIFORM] for what in ("", " denoised")}


def counting(scenes):
    """(name, figures) of those whose references agree."""
    return [(name, f) for name, f in scenes.items() if f["differ"] <= AGREE]


def rows(scenes, way, names):
    """[(scene, ratios of its seeds)] of the scenes that count."""
    found = [(name, [r for r in (ratio(f, seed, way, names) for seed in seeds_of(f)) if r]) for name, f in counting(scenes)]
    return [(name, ratios) for name, ratios in found if ratios]


def spread(values, form="%.2f"):
    middle = form % statistics.median(values)
    return middle if len(values) == 1 else "%s (%s–%s)" % (middle, form % min(values), form % max(values))


def cell_of(ratios):
    """Seconds, worst block, ratio; the sign says where it lies (at_equal)."""
    signs = {r["where"] for r in ratios} - {""}
    sign = {"<": "≥ ", ">": "≈ "}.get(signs.pop(), "") if signs else ""
    return ["%s" % spread([r["s"] for r in ratios], "%.1f"), spread([r["worst"] for r in ratios]), spread([r["cycles_s"] for r in ratios], "%.1f"),
            sign + spread([r["ratio"] for r in ratios])]


def compared(scenes, names, suffix):
    """The table of ratios, and the lines of their medians."""
    ours, hosted = (dict(rows(scenes, who + suffix, names)) for who in ("ours", "host"))
    uniform = dict(rows(scenes, "ours" + suffix, UNIFORMS[suffix]))
    body = []
    for name in ours:
        body.append([name, str(len(ours[name])), *cell_of(ours[name]), *(cell_of(hosted[name]) if name in hosted else ["–"] * 4),
                     spread([r["cycles_s"] for r in uniform[name]], "%.1f") if name in uniform else "–"])
    heads = ("scene", "seeds", "ours: s", "worst block", "Cycles as good: s", "ours / Cycles", "host: s", "worst block", "Cycles as good: s",
             "host / Cycles", "Cycles uniform, as good as ours: s")
    text = tables.table(heads, body)
    for who, found, wanted in (("ours", ours, 0.7), ("Cycles as host", hosted, 1.0)):
        if found:
            middle = [statistics.median(r["ratio"] for r in ratios) for ratios in found.values()]
            text += "\n%s: median over scenes **%.2f**, from %.2f to %.2f%s." % (
                who.capitalize() if who == "ours" else who, statistics.median(middle), min(middle), max(middle),
                "" if suffix else " (wanted ≤ %.1f)" % wanted)
    return text + "\n"


def share_table(scenes, ways):
    """Of ways, over scenes and seeds that have all of them: blocks, share visibly off, worst, processor seconds."""
    have = lambda f, seed: all("%d %s" % (seed, way) in f["ways"] for way in ways)
    both = [(f, seed) for _, f in counting(scenes) for seed in seeds_of(f) if have(f, seed)]
    body = []
    for way in ways:
        found = [f["ways"]["%d %s" % (seed, way)] for f, seed in both]
        errors = [e for w in found for e in w["errors"]]
        if errors:
            body.append([way.replace(" denoised", ""), str(len(errors)), tables.percent(sum(e > VISIBLE for e in errors) / len(errors)),
                         "%.2f" % max(errors), "%.2f" % statistics.median(max(w["errors"]) for w in found), "%.1f" % math.fsum(w["s"] for w in found)])
    return tables.table(("way", "blocks", "visibly off", "worst", "worst block of a picture, median", "processor s, all"), body)


def head(results):
    o = results["options"]
    left = ["%s (%.0f %%)" % (name, 100 * f["differ"]) for name, f in results["scenes"].items() if f["differ"] > AGREE]
    text = "%s, Blender %s; films of %d×%d in blocks of %d, references of 2 × %d samples.\n" % (
        tables.provenance(results["measured"]), results["blender"], o["size"], o["size"], o["block"], o["reference_spp"])
    return text + ("Left out, as the references differ by more than %.0f %% somewhere: %s.\n" % (100 * AGREE, ", ".join(left)) if left else "")


def raw(results):
    r = results["raw"]
    measured = [f["ways"] for _, f in counting(r["scenes"])]
    ways = ["ours", "host", *(way for way in RAW if all("1 " + way in w for w in measured)), *UNIFORMS[""]]
    return "%s\n%s\n%s" % (head(r), compared(r["scenes"], RAW, ""), share_table(r["scenes"], ways))


def denoised(results):
    r = results["denoised"]
    ways = ["ours denoised", "host denoised", *DENOISED, *UNIFORMS[" denoised"],
            *("ours n=%d denoised" % n for n in UNIFORM)]
    return "%s\n%s\n%s" % (head(r), share_table(r["scenes"], ways), compared(r["scenes"], DENOISED, " denoised"))


PAGES, MEASURES = {"raw": raw, "denoised": denoised}, {"raw": Scene.measure_raw, "denoised": Scene.measure_denoised}


def main(o):
    if not (os.path.exists(o.blender) or shutil.which(o.blender)):
        raise tool.Refused("no program %s: make test-hosts, or apt-get install blender" % o.blender)
    os.makedirs(o.work, exist_ok=True)
    asked = [o.only] if o.only else list(PAGES)
    cycles = Cycles(o.blender)
    try:
        scenes = {scene.name: scene for scene in (Scene(o, name, cycles) for name in o.scenes)}
        for seed in range(1, o.seeds + 1):
            for what in asked:
                for scene in scenes.values():
                    if scene.agree():
                        MEASURES[what](scene, seed)
    finally:
        cycles.close()
    results = {"measured": tool.measured(), "blender": cycles.version(),
               "options": {k: getattr(o, k) for k in ("size", "block", "reference_spp")},
               "scenes": {name: scene.found for name, scene in scenes.items() if "differ" in scene.found}}
    for what in asked:
        print(PAGES[what]({what: results}))
    if o.write:
        kept = tool.results(o.write, "peers")
        tool.store(o.write, "peers", {what: results if what in asked else kept[what] for what in PAGES}, indent=None)
