"""Holds what criteria believe against references: how many of the blocks that they stop are truly off.

The recordings are those of the set `truth` of scripts/recordings.plan (scripts/lab record): whole frames at default settings, several seeds of
each scene, the first one with two references. Criteria are asked about these looks, in blocks of several sizes, as a renderer asks them
(lull.replay); a block that was stopped keeps its samples. True errors are those of the model observer against both references,
whose own noise is taken out (ggn visible --second). Needs numpy (python3-numpy)."""
import csv
import json
import math
import os
import random
import statistics
import sys
import tempfile
import textwrap

from lablib import record, recordings, tables, tool
from lablib.sources import EXAMPLES, NETWORK, OBSERVER, PICTURES

SOURCES = PICTURES + OBSERVER + NETWORK + EXAMPLES
SIZES = (200, 100, 32)
CRITERIA = ("observer", "ggn", "halfbuf", "variance")
OFF = (1.05, 1.12, 1.5)
ENOUGH = 0.93  # true error at which a block could have been stopped
KINDS = {"rare": "rare light", "hands": "other hands", "ordinary": "ours"}
PEOPLE = ("living-room-v4/living-room.pbrt", "p3d_staircase2-view0.pbrt", "volume-caustic-v3/caustic.pbrt")  # which the observer was fitted to
DRAWS = 1000  # of scenes, for the range of a share


def options(parser):
    parser.add_argument("dir", nargs="?", type=tool.path, default=os.path.join(tool.ROOT, "..", "recordings"), help="recordings (../recordings)")
    parser.add_argument("--plan", type=tool.path, default=record.PLAN, help="scripts/recordings.plan")
    parser.add_argument("--criteria", nargs="+", default=CRITERIA, metavar="NAME[:KEY=VALUE]",
                        help="whom to ask (%s)" % " ".join(CRITERIA))
    parser.add_argument("--sizes", nargs="+", type=int, default=SIZES, metavar="PIXELS", help="sides of blocks (%s)" % " ".join(map(str, SIZES)))
    tool.writes(parser)


# --- what ships knows ---


def trained_on():
    """Files of the scenes that the shipped network learned from or was chosen by."""
    with open(os.path.join(tool.ROOT, "ggn", "models", "lull-3.data.csv"), encoding="utf-8") as file:
        names = {row["scene"] for row in csv.DictReader(file, delimiter=";") if row["split"] != "test"}
    with open(os.path.join(tool.ROOT, "scripts", "dataset.plan"), encoding="utf-8") as file:
        lines = [line.split() for line in file if line.strip() and not line.startswith(("#", "film"))]
    return {os.path.realpath(os.path.join(tool.ROOT, file)) for _, name, file, *_ in lines if name.split("/")[0] in names}


# --- judging --------------------------------------------------------------------------------------------------------------


def write_picture(path, picture):
    import lull.exr
    height, width = picture.shape[:2]
    lull.exr.write(path, {c: picture[..., i] for i, c in enumerate("RGB")}, (width, height))
    return path


def true_errors(references, recording, sizes):
    """{(x, y, side): [(samples, true error) of each look]}"""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        def written(name, picture):
            path = os.path.join(folder, name + ".exr")
            return write_picture(path, picture)
        first, second = (written("reference-%d" % i, picture) for i, picture in enumerate(references))
        levels = recording.levels(0)
        looks = [written("%d" % spp, recording.planes(0, spp, ["color"])["color"]) for spp in levels]
        judged = json.loads(tool.ggn("visible", first, *looks, "--second", second, "--json", "--block", ",".join(map(str, sizes))))
    for of in judged if isinstance(judged, list) else [dict(judged, image=0, block=sizes[0])]:
        for block in of["blocks"]:
            if block["width"] == block["height"] == of["block"]:
                found.setdefault((block["x"], block["y"], of["block"]), []).append((levels[of["image"]], block["error"]))
    return found


def replay(lull, name, recording, block, errors):
    """[(samples at its stop or 0, true error there, samples from which it was low enough or 0)] of each block, but narrow ones at the
    edges."""
    import lull.replay
    criterion, _, parameter = name.partition(":")
    pairs = dict([parameter.split("=")]) if parameter else {}
    asked = lull.replay.Replay(recording, lull.load(criterion, threads=1, log=lambda *_: None, **pairs), block=block)
    rects = [b.rect for b in asked.frame.blocks]
    found = []
    for rect, stop in zip(rects, asked.run().stops):
        of = errors.get((rect.x0, rect.y0, block))
        if of and rect.width == rect.height == block:
            low = [k for k in range(len(of)) if all(e <= ENOUGH for _, e in of[k:])]
            found.append((stop, dict(of).get(stop, math.nan), of[low[0]][0] if low else 0))
    return found


def noise_of(references, size):
    """The worst block's error of one reference against the other, over √2: each has the noise of its own samples."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, "%d.exr" % i) for i in range(2)]
        for path, picture in zip(paths, references):
            write_picture(path, picture)
        return json.loads(tool.ggn("visible", *paths, "--block", size, "--json"))["worst"] / math.sqrt(2)


def judge(o, wanted):
    """{"noise": …, "criterion size": [[stop, error, enough] of each block and seed]} of the recordings of one scene."""
    import lull
    read = [recordings.read(o.dir, w) for w in wanted]
    references = read[0].references
    found = {"kind": wanted[0].kind, "noise": noise_of(references, max(o.sizes)),
             "trained": os.path.realpath(wanted[0].file) in trained_on() or wanted[0].file.endswith(PEOPLE)}
    for recording in read:
        errors = true_errors(references, recording, o.sizes)
        for name in o.criteria:
            for size in o.sizes:
                try:
                    found.setdefault("%s %d" % (name, size), []).extend(replay(lull, name, recording, size, errors))
                except lull.LullError as why:
                    raise tool.Refused(why) from why
    print("%s: judged" % wanted[0].name, file=sys.stderr, flush=True)
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


def spread(by_scene):
    """The range of 90 % of the share that is off at the first limit, by scenes drawn anew."""
    draw, shares = random.Random(1), []
    for _ in range(DRAWS):
        stops = [b for blocks in draw.choices(by_scene, k=len(by_scene)) for b in blocks if b[0]]
        if stops:
            shares.append(sum(b[1] > OFF[0] for b in stops) / len(stops))
    return statistics.quantiles(shares, n=20)[::18] if len(shares) > 1 else [math.nan, math.nan]


def rows(results):
    """[(criterion, size, kind, row)]: of scenes that nothing which ships was trained on."""
    found = []
    scenes = {name: of for name, of in results["scenes"].items() if not of["trained"]}
    for kind in KINDS:
        of = [scene for scene in scenes.values() if scene["kind"] == kind]
        for size in results["sizes"]:
            for name in results["criteria"]:
                by_scene = [scene["%s %d" % (name, size)] for scene in of]
                blocks, usual = sum(by_scene, []), sum((scene["%s %d" % (results["criteria"][0], size)] for scene in of), [])
                if blocks:
                    found.append((name, size, KINDS[kind], {**row(blocks, usual), "range": spread(by_scene)}))
    return found


def wrong(results):
    """Which scenes hold the stops of the first criterion that are off, by size of block: a list of the page."""
    lines, name = [], results["criteria"][0]
    for size in results["sizes"]:
        by_scene = {s: row(of["%s %d" % (name, size)], None) for s, of in results["scenes"].items() if not of["trained"]}
        stopped = sum(r["stopped"] for r in by_scene.values())
        off = sorted(((round(r["off"][0] * r["stopped"]), s, r) for s, r in by_scene.items() if r["off"][0]), key=lambda x: (-x[0], x[1]))
        lines.append(textwrap.fill("- %d px: %d of %d stops off at %g%s." % (
            size, sum(count for count, _, _ in off), stopped, OFF[0],
            "".join("%s %s %d of %d (worst %.2f)" % ("," if i else ":", s, count, r["stopped"], r["worst"])
                    for i, (count, s, r) in enumerate(off))), 140, subsequent_indent="  ", break_on_hyphens=False))
    return "\n".join(lines) + "\n"


def marked(results):
    """Scenes, each with its references' noise; those that something which ships was trained on with an asterisk."""
    return ", ".join("%s%s%s" % (name, "\\*" if of["trained"] else "", "" if of["noise"] is None else " %.2f" % of["noise"])
                     for name, of in results["scenes"].items())


def page(results):
    """The table of the page."""
    number = lambda v, form: "" if math.isnan(v) else form % v
    lines = ["| criterion | block | scenes | stopped | off at 1.05 (90 % of draws of scenes) | at 1.12 | at 1.5 | worst | octaves after enough | samples |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for name, size, kind, r in rows(results):
        low, high = r["range"]
        lines.append("| %s | %d px | %s | %d of %d | %.1f %%%s | %.1f %% | %.1f %% | %s | %s | %s |" % (
            name, size, kind, r["stopped"], r["blocks"], 100 * r["off"][0], "" if math.isnan(low) else " (%.1f–%.1f)" % (100 * low, 100 * high),
            100 * r["off"][1], 100 * r["off"][2], number(r["worst"], "%.2f"), number(r["cost"], "%+.2f"), number(r["samples"], "%.2f")))
    for text in ("%s; %d scenes, %d seeds. Shares leave out what the shipped network learned from and what the observer was fitted to (\\*)." % (
                     tables.provenance(results["measured"]), len(results["scenes"]), results["seeds"]),
                 "Noise of a reference's worst block, as told by the other: %s." % marked(results)):
        lines += ["", *textwrap.wrap(text, 158, break_long_words=False, break_on_hyphens=False)]
    return "\n".join(lines) + "\n"


def main(o):
    found, by_name = {}, {}
    plan = [w for w in record.read_plan(o.plan) if w.set == "truth"]
    for w in plan:
        by_name.setdefault(w.name, []).append(w)
    for name, wanted in by_name.items():
        if not all(recordings.whole(o.dir, w) for w in wanted):
            print("lab truth: %s is not recorded (scripts/lab record --only truth)" % name, file=sys.stderr, flush=True)
            continue
        found[name] = judge(o, wanted)
    if not found:
        raise tool.Refused("no scene is recorded in %s: scripts/lab record --only truth" % o.dir)
    results = {"measured": tool.measured(), "criteria": list(o.criteria), "sizes": list(o.sizes), "seeds": max(w.seed for w in plan),
               "spp": plan[0].spp, "reference_spp": plan[0].reference_spp, "scenes": found}
    print(page(results))
    if o.write:
        tool.store(o.write, "truth", results, indent=None)
