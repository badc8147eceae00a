"""Holds what criteria believe against references: how many of the blocks that they stop are truly off.

Each scene is recorded with default settings as a whole frame (lull-render --sequence DIR --planes), with several seeds, the first one with
two references. The criteria themselves are then asked about these looks, in blocks of several sizes, as a renderer asks them
(lull.replay); a block that was stopped keeps its samples. True errors are those of the model observer against both references,
whose own noise is taken out (scripts/lablib/law.py). Interrupted, the same command goes on. Needs numpy (python3-numpy)."""
import functools
import math
import os
import sys

from lablib import tool
from lablib.sources import EXAMPLES, NETWORK, OBSERVER, PICTURES

SOURCES = PICTURES + OBSERVER + NETWORK + EXAMPLES
SCENES = ("chess glossy soft-shadow cornell-box office museum judge/rare-lamps brick-yard gallery candles kitchen judge/rare-beads "
          "garage bathroom gems night-street judge/rare-foil panes corridor glass-shelf").split()
RARE = ("rare-", "candles", "gems", "night-street", "glass-shelf")  # scenes whose noise is made by few bright paths
SIZES = (200, 100, 32)
CRITERIA = ("observer", "ggn", "halfbuf", "variance")
OFF = (1.05, 1.12, 1.5)
ENOUGH = 0.93  # true error at which a block could have been stopped
PLANES = "color,half,albedo,normal,moment2"
LEVELS = "geometric:16:%d:1.19"


def options(parser):
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE",
                        help="names of scenes/, or files (%s)" % " ".join(SCENES))
    parser.add_argument("--criteria", nargs="+", default=CRITERIA, metavar="NAME[:KEY=VALUE]",
                        help="whom to ask (%s)" % " ".join(CRITERIA))
    parser.add_argument("--sizes", nargs="+", type=int, default=SIZES, metavar="PIXELS", help="sides of blocks (%s)" % " ".join(map(str, SIZES)))
    parser.add_argument("--size", type=int, default=200, help="side of the pictures (200)")
    parser.add_argument("--spp", type=int, default=512, help="samples of the last look (512)")
    parser.add_argument("--reference-spp", type=int, default=2048, metavar="N", help="of each of the two references (2048)")
    parser.add_argument("--seeds", type=int, default=2, help="renders of each scene (2)")
    parser.add_argument("--threads", type=int, default=tool.THREADS, help="of the renderer (all processors)")
    parser.add_argument("--recorded", action="store_true", help="render nothing: judge the scenes whose recordings are there")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "truth"), metavar="DIR",
                        help="recordings; what is there is not made again (build/truth)")
    tool.writes(parser)


# --- recordings -----------------------------------------------------------------------------------------------------------


def name_of(scene):
    return os.path.splitext(os.path.basename(scene))[0]


def record(o, scene, seed):
    """The recording of one seed; None: it is not whole and must not be made."""
    import lull.recording
    folder = os.path.join(o.work, "%s-%d" % (name_of(scene), o.size), "%d-%d" % (seed, o.spp))
    references = ["--reference-spp", o.reference_spp] if seed == 1 else []
    if not o.recorded:
        file = scene if scene.endswith(".pbrt") else os.path.join(tool.ROOT, "scenes", scene + ".pbrt")
        os.makedirs(folder, exist_ok=True)
        tool.run(tool.RENDER, "-q", file, "--size", "%dx%d" % (o.size, o.size), "--block", o.size, "-t", o.threads, "--seed", seed,
                 "--levels", LEVELS % o.spp, "--planes", PLANES, "--sequence", folder, *references)
    elif not os.path.exists(os.path.join(folder, "manifest.json")):
        return None
    recording = lull.recording.read(folder)
    return recording if recording.finished and len(recording.references) == (2 if seed == 1 else 0) else None


# --- judging --------------------------------------------------------------------------------------------------------------


class Reference:
    def __init__(self, pictures):
        from lablib import law
        self.law = law
        self.pictures = [law.lightness(picture) for picture in pictures]

    def error(self, lightness, rect):
        """True error of a block, in units of what is just seen."""
        cut = tuple(p[rect.y0:rect.y1, rect.x0:rect.x1] for p in (lightness, *self.pictures))
        return self.law.true(*cut, self.law.texture(*cut[1:])) / tool.observer()["level"]


def replay(lull, name, recording, block, errors):
    """[(samples at its stop or 0, true error there, samples from which it was low enough or 0)] of each block, but narrow ones at the
    edges. errors(rect): of each look, [(samples, true error)]."""
    import lull.replay
    criterion, _, parameter = name.partition(":")
    pairs = dict([parameter.split("=")]) if parameter else {}
    asked = lull.replay.Replay(recording, lull.load(criterion, threads=1, log=lambda *_: None, **pairs), block=block)
    rects = [b.rect for b in asked.frame.blocks]
    found = []
    for rect, stop in zip(rects, asked.run().stops):
        if rect.width == rect.height == block:
            of = errors(rect)
            low = [k for k in range(len(of)) if all(e <= ENOUGH for _, e in of[k:])]
            found.append((stop, dict(of).get(stop, math.nan), of[low[0]][0] if low else 0))
    return found


def judge(o, scene):
    """{"criterion size": [[stop, error, enough] of each block and seed]}; None: not recorded."""
    recordings = [record(o, scene, seed) for seed in range(1, o.seeds + 1)]
    if not all(recordings):
        return None
    import lull
    reference, found = Reference(recordings[0].references), {}
    for recording in recordings:
        light = [(spp, reference.law.lightness(recording.planes(0, spp, ["color"])["color"])) for spp in recording.levels(0)]
        errors = functools.lru_cache(maxsize=None)(lambda rect: [(spp, reference.error(of, rect)) for spp, of in light])
        for name in o.criteria:
            for size in o.sizes:
                try:
                    found.setdefault("%s %d" % (name, size), []).extend(replay(lull, name, recording, size, errors))
                except lull.LullError as why:
                    raise tool.Refused(why) from why
    print("%s: judged" % name_of(scene), file=sys.stderr, flush=True)
    return found


# --- telling --------------------------------------------------------------------------------------------------------------


def row(blocks, usual):
    """What a table shows of some blocks; usual: the stops of who is compared with, or None."""
    stops = [b for b in blocks if b[0]]
    errors = [b[1] for b in stops]
    cost = [math.log2(b[0] / b[2]) for b in stops if b[2]]
    return {"blocks": len(blocks), "stopped": len(stops), "worst": max(errors, default=math.nan),
            "off": [sum(e > limit for e in errors) / max(len(errors), 1) for limit in OFF],
            "cost": sum(cost) / len(cost) if cost else math.nan,
            "samples": 2 ** (sum(math.log2(b[0] / u[0]) for b, u in zip(blocks, usual) if b[0] and u[0]) /
                             max(1, sum(1 for b, u in zip(blocks, usual) if b[0] and u[0]))) if usual else math.nan}


def rows(results):
    """[(criterion, size, kind, row)]"""
    found = []
    scenes = results["scenes"]
    keys = [(name, size) for size in results["sizes"] for name in results["criteria"]]
    for kind, wanted in (("rare light", True), ("other scenes", False)):
        of = [s for s in scenes if s.startswith(RARE) is wanted]
        for name, size in keys:
            blocks = [b for s in of for b in scenes[s]["%s %d" % (name, size)]]
            usual = [b for s in of for b in scenes[s]["%s %d" % (results["criteria"][0], size)]]
            if blocks:
                found.append((name, size, kind, row(blocks, usual)))
    return found


def wrong(results):
    """Which scenes hold the stops of the first criterion that are off, by size of block: a list of the page."""
    lines, name = [], results["criteria"][0]
    for size in results["sizes"]:
        by_scene = {s: row(of["%s %d" % (name, size)], None) for s, of in results["scenes"].items()}
        stopped = sum(r["stopped"] for r in by_scene.values())
        off = sorted(((round(r["off"][0] * r["stopped"]), s, r) for s, r in by_scene.items() if r["off"][0]), key=lambda x: (-x[0], x[1]))
        lines.append("- %d px: %d of %d stops off at %g%s." % (
            size, sum(count for count, _, _ in off), stopped, OFF[0],
            "".join("%s %s %d of %d (worst %.2f)" % ("," if i else ":", s, count, r["stopped"], r["worst"])
                    for i, (count, s, r) in enumerate(off))))
    return "\n".join(lines) + "\n"


def page(results):
    """The table of the page."""
    number = lambda v, form: "" if math.isnan(v) else form % v
    lines = ["| criterion | block | scenes | stopped | off at 1.05 | at 1.12 | at 1.5 | worst | octaves after enough | samples |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for name, size, kind, r in rows(results):
        lines.append("| %s | %d px | %s | %d of %d | %s | %s | %s | %s |" % (
            name, size, kind, r["stopped"], r["blocks"], " | ".join("%.1f %%" % (100 * share) for share in r["off"]),
            number(r["worst"], "%.2f"), number(r["cost"], "%+.2f"), number(r["samples"], "%.2f")))
    measured = results["measured"]
    lines.append("\n%d scenes, %d seeds; `%s`, %s, %s." % (len(results["scenes"]), results["seeds"], measured["command"], measured["date"],
                                                          measured["commit"]))
    return "\n".join(lines) + "\n"


def main(o):
    found = {}
    for scene in o.scenes:
        try:
            judged = judge(o, scene)
            if judged:
                found[name_of(scene)] = judged
        except tool.Refused as why:
            print("lab truth: %s" % why, file=sys.stderr, flush=True)
    if not found:
        raise tool.Refused("no scene is recorded in %s: run it without --recorded" % o.work)
    results = {"measured": tool.measured(), "criteria": list(o.criteria), "sizes": list(o.sizes), "seeds": o.seeds, "spp": o.spp,
               "reference_spp": o.reference_spp, "scenes": found}
    print(page(results))
    if o.write:
        tool.store(o.write, "truth", results, indent=None)
