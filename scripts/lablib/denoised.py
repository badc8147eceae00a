"""Holds what the criterion `denoised` believes against two references: a table for docs/results/denoised.md.

Of every scene of the plan two independent references are rendered, and one render is looked at again and again as its samples grow
(tests/bench/pt_looks.c): what is believed of each block, and the noisy, the denoised and the blended picture. Their visible errors
against the two references, whose noise is taken out (`ggn visible --second`), are the truth. Stops are where the criterion's
own steps from look to look end, with errors between these looks as logarithms. Times are processor seconds, of the denoiser's process too."""
import bisect
import json
import math
import os
import statistics
import sys
import textwrap

from lablib import cvvdp, denoised_judges, tables, tool
from lablib.sources import DENOISED, PICTURES

SOURCES = PICTURES + DENOISED
SCENES = ["scenes/%s.pbrt" % name for name in "demo rock-garden kitchen cornell-box garage defocus harbour bathroom office".split()] + [
    os.path.join("..", "shared", "scenes", name) for name in ("coffee-v3/scene.pbrt", "veach-mis-v4/veach-mis.pbrt",
                                                              "cornell-bunny-v4/cornell_bunny_conductor.pbrt")]
SIZE, BLOCK, SEED, REFERENCES, PRICE_SPP = 256, 128, 1, (101, 102), 32
LEVELS = (32, 40, 64, 80, 128, 160, 256, 320, 512, 640)
FIRST, STEP, GROWTH = 64, 1.25, 2  # samples of the first look, and their ratio from look to look, at least and at most
CLEAR, APART = 0.8, 0.4  # of the limit, below it: so low a first error needs no other
FALL = 0.4  # errors fall as samples^-FALL
KINDS = ("noisy", "denoised", "blend")
VISIBLE = 1.05  # beyond this an error counts as visible: the references' own noise scatters the truth by some per cent
HEAD = ("scene", "blocks", "samples until nothing is seen: noisy / denoised / blend", "blend / noisy", "stopped, of these visibly off",
        "worst", "samples at the stop: `observer` / `denoised`", "processor s there", "FLIP at 128: noisy / denoised / blend")


def options(parser):
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE.pbrt", help="(twelve, three of them by other hands)")
    parser.add_argument("--reference-spp", type=int, default=640, metavar="N", help="of each reference; those that are there stay (640)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "denoised"), metavar="DIR",
                        help="references, films, pictures; what is there is not made again (build/denoised)")
    parser.add_argument("--quality", choices=("fast", "balanced", "high"), default="high", help="of the denoiser in the looks (high)")
    parser.add_argument("--judges", nargs="+", default=[], metavar="SCENE.pbrt", help="ask ColorVideoVDP and FLIP about these, too")
    tool.writes(parser)


def name_of(scene):
    return "%s-%s" % (os.path.basename(os.path.dirname(scene)), os.path.basename(scene)[:-5])


def references(o, scene):
    paths = [os.path.join(o.work, "%s.%d.exr" % (name_of(scene), seed)) for seed in REFERENCES]
    for path, seed in zip(paths, REFERENCES):
        if not os.path.exists(path):
            ck = path + ".ck"
            tool.run(tool.RENDER, scene, "--size", "%dx%d" % (SIZE, SIZE), "--block", BLOCK, "--seed", seed, "--spp", o.reference_spp, "-q",
                     "--checkpoint", ck, *(["--resume"] if os.path.exists(ck) else []), "-o", path + ".tmp.exr")
            os.replace(path + ".tmp.exr", path)
    mean = os.path.join(o.work, name_of(scene) + ".exr")
    if not os.path.exists(mean):
        tool.run("oiiotool", *(word for path in paths for word in (path, "--ch", "R,G,B")), "--add", "--mulc", "0.5", "-o", mean)
    return paths, mean


def measure(o, scene):
    """Of every look at every block what was believed, and of every picture what is true."""
    paths, mean = references(o, scene)
    folder = os.path.join(o.work, name_of(scene))
    output = tool.run(os.path.join(tool.BUILD, "bench", "pt_looks"), scene, SIZE, BLOCK, SEED, folder, ",".join(map(str, LEVELS)),
                    "quality=" + o.quality, "first-spp=%d" % LEVELS[0])
    looks = [json.loads(line) for line in output.splitlines()]
    report = os.path.join(o.work, name_of(scene) + ".price.json")
    tool.run(tool.RENDER, scene, "--size", "%dx%d" % (SIZE, SIZE), "--block", BLOCK, "--spp", PRICE_SPP, "-q", "--report", report)
    price = [b["thread_s"] / PRICE_SPP for b in tool.load(report)["blocks"]]
    for look in looks:
        look["sample_s"] = price[look["block"]]
    for n in LEVELS:
        for kind in KINDS:
            picture = os.path.join(folder, "%d-%s.png" % (n, kind))
            seen = json.loads(tool.ggn("visible", paths[0], picture, "--second", paths[1], "--block", BLOCK, "--json"))
            flip = json.loads(tool.ggn("flip", mean, picture, "--json"))["mean"]
            for look in looks:
                if look["spp"] == n:
                    look["true_" + kind], look["flip_" + kind] = seen["blocks"][look["block"]]["error"], flip
    return looks


def low_enough():
    """The error at which the default of --visible stops."""
    observer = tool.observer()
    return 2 ** (observer["spread"] * statistics.NormalDist().inv_cdf(tool.default("denoised", "visible")) / 2)


def until(looks, what, limit=1.0):
    """Samples from which on looks[what] stays at the limit or below. Beyond the last look it is taken to fall as noise does."""
    errors = [(look["spp"], max(look[what] / limit, 1e-3)) for look in looks]
    if errors[-1][1] > 1:
        return errors[-1][0] * errors[-1][1] ** 2
    last = max([i for i, (_, e) in enumerate(errors) if e > 1], default=None)
    if last is None:
        return errors[0][0]
    (n0, e0), (n1, e1) = errors[last:last + 2]
    return n0 * (n1 / n0) ** (math.log(e0) / math.log(e0 / e1))


def between(looks, spp, what):
    """looks[what] at so many samples, between two looks as logarithms."""
    k = min(max(bisect.bisect_right([look["spp"] for look in looks], spp), 1), len(looks) - 1)
    (n0, e0), (n1, e1) = ((look["spp"], max(look[what], 1e-3)) for look in looks[k - 1:k + 1])
    return e0 * (e1 / e0) ** (math.log(spp / n0) / math.log(n1 / n0))


def stop(looks, limit, what):
    """Samples at which a block stops by looks[what], and how many looks that takes, as ggn/plugin/denoised/denoised.c goes on; None:
    not within the looks that there are."""
    spp, last, count = FIRST, None, 0
    while spp <= looks[-1]["spp"]:
        error, count = between(looks, spp, what), count + 1
        trend = (error + last["trend"] * (last["spp"] / spp) ** FALL) / 2 if last else error
        if min(last["error"], trend) <= limit and error <= limit if last else error <= min(CLEAR * limit, limit - APART):
            return spp, count
        last = {"spp": spp, "error": error, "trend": trend}
        spp = int(math.ceil(spp * (STEP if error <= limit else min(max((error / limit) ** (1 / FALL), STEP), GROWTH))))
    return None


def ranks(values):
    order, out = sorted(range(len(values)), key=values.__getitem__), [0] * len(values)
    for rank, i in enumerate(order):
        out[i] = rank
    return out


def block(looks, limit):
    """Figures of one block, from its looks."""
    ended, wrongly = stop(looks, limit, "error"), stop(looks, limit, "halves")
    needed = {kind: until(looks, "true_" + kind) for kind in KINDS}
    sample_s = looks[-1]["sample_s"]
    b = {"until": needed, "ratio": needed["blend"] / needed["noisy"], "observer": until(looks, "noisy", limit),
         "halves": wrongly and between(looks, wrongly[0], "true_blend")}
    if ended:
        spp, count = ended
        looks_s = count * statistics.mean(look["look_s"] for look in looks)
        b.update(looks_s=looks_s, spp=spp, true=between(looks, spp, "true_blend"), believed=between(looks, spp, "error"),
                 denoised_s=spp * sample_s + looks_s, observer_s=b["observer"] * sample_s, path_us=1e6 * sample_s / BLOCK ** 2)
    return b


def summary(rows, looks, limit):
    blocks = [b for r in rows for b in r["blocks"]]
    stopped = [b for b in blocks if "spp" in b]
    halves = [b["halves"] for b in blocks if b["halves"]]
    off = lambda values: sum(v > VISIBLE for v in values)
    believed, true = ranks([x["error"] for x in looks]), ranks([x["true_blend"] for x in looks])
    late = [x for x in looks if x["spp"] >= 64]
    mean = statistics.mean(b["spp"] for b in stopped)
    near = min(LEVELS, key=lambda n: abs(math.log(n / mean)))
    uniform = lambda kind: off(x["true_" + kind] for x in looks if x["spp"] == near) / len(blocks)
    return {"limit": limit, "blocks": len(blocks), "scenes": len(rows), "stopped": len(stopped), "off": off(b["true"] for b in stopped),
            "worst": max(b["true"] for b in stopped), "ratio": statistics.median(b["ratio"] for b in blocks),
            "ratio_max": max(b["ratio"] for b in blocks), "dearer": sum(b["ratio"] > 1.05 for b in blocks),
            "denoised_ratio": statistics.median(b["until"]["denoised"] / b["until"]["noisy"] for b in blocks),
            "denoised_dearer": sum(b["until"]["denoised"] > 1.05 * b["until"]["noisy"] for b in blocks),
            "stop_ratio": statistics.median(b["spp"] / b["observer"] for b in stopped),
            "halves": len(halves), "halves_off": off(halves), "halves_worst": max(halves),
            "spearman": statistics.correlation(believed, true), "over": statistics.median(x["error"] / max(x["true_blend"], 1e-3) for x in late),
            "below": sum(x["error"] < x["true_blend"] / VISIBLE for x in late) / len(late),
            "mean_spp": mean, "uniform_spp": near, "uniform_denoised": uniform("denoised"), "uniform_blend": uniform("blend"),
            "uniform_noisy": uniform("noisy"), "time": sum(b["denoised_s"] for b in stopped) / sum(b["observer_s"] for b in stopped),
            "looks_share": sum(b["looks_s"] for b in stopped) / sum(b["denoised_s"] for b in stopped),
            "dear_time": statistics.median(b["denoised_s"] / b["observer_s"] for b in stopped if b["path_us"] > 1)}


def scene_row(scene, looks, limit):
    count = 1 + max(look["block"] for look in looks)
    blocks = [block([x for x in looks if x["block"] == i], limit) for i in range(count)]
    flip = {kind: next(x["flip_" + kind] for x in looks if x["spp"] == 128) for kind in KINDS}
    return {"scene": name_of(scene), "blocks": blocks, "flip": flip}


def cells(r):
    stopped = [b for b in r["blocks"] if "spp" in b]
    median = lambda values, form="%.0f": tables.figure(statistics.median(values), form) if values else "–"
    off = sum(b["true"] > VISIBLE for b in stopped)
    return [r["scene"].replace("scenes-", ""), str(len(r["blocks"])),
            " / ".join(median([b["until"][kind] for b in r["blocks"]]) for kind in KINDS), median([b["ratio"] for b in r["blocks"]], "%.2f"),
            "%d, %s" % (len(stopped), "**%d**" % off if off else "0"), tables.figure(max((b["true"] for b in stopped), default=math.nan)),
            "%s / %s" % (median([b["observer"] for b in stopped]), median([b["spp"] for b in stopped])),
            "%s / %s" % (median([b["observer_s"] for b in stopped], "%.1f"), median([b["denoised_s"] for b in stopped], "%.1f")),
            " / ".join("%.3f" % r["flip"][kind] for kind in KINDS)]


def text(rows, s):
    lines = [
        "%d of %d blocks stop within %d samples; of these **%d** (%.0f %%) are visibly off (above %.2f of just seen), the worst %.2f" % (
            s["stopped"], s["blocks"], LEVELS[-1], s["off"], 100 * s["off"] / s["stopped"], VISIBLE, s["worst"]),
        "the halves alone would have stopped %d blocks, %d (%.0f %%) of them visibly off, the worst %.2f" % (
            s["halves"], s["halves_off"], 100 * s["halves_off"] / max(1, s["halves"]), s["halves_worst"]),
        "samples until nothing is seen, against those of the noisy picture, median over all blocks: blend **%.2f** (%d blocks dearer than "
        "1.05, the worst %.2f), denoised alone %.2f (%d dearer)" % (
            s["ratio"], s["dearer"], s["ratio_max"], s["denoised_ratio"], s["denoised_dearer"]),
        "where `denoised` stops, against where `observer` stops the noisy picture: median %.2f of the samples; all together %.2f of the "
        "processor time, looks included, which are %.0f %% of it; median of the blocks whose paths take more than 1 µs: %.2f of the "
        "time" % (s["stop_ratio"], s["time"], 100 * s["looks_share"], s["dear_time"]),
        "believed against true over all looks: Spearman **%.2f**; from 64 samples on, believed / true has the median %.2f and is below "
        "1/%.2f in %.0f %% of the looks" % (s["spearman"], s["over"], VISIBLE, 100 * s["below"]),
        "the same number of samples everywhere (%d, where stopped blocks have %.0f in the mean): visibly off are %.0f %% of all blocks of the "
        "blend, %.0f %% of the denoised picture, %.0f %% of the noisy one" % (
            s["uniform_spp"], s["mean_spp"], 100 * s["uniform_blend"], 100 * s["uniform_denoised"], 100 * s["uniform_noisy"])]
    if "judges" in s:
        lines.append(denoised_judges.text(s["judges"]))
    return "%s\n%s" % (tables.table(HEAD, [cells(r) for r in rows]), "".join(textwrap.fill("- " + line, 140, subsequent_indent="  ") + "\n" for line in lines))


def page(results):
    return "%s.\n\n%s" % (tables.provenance(results["measured"]), text(results["rows"], results["summary"]))


def judged(o, scene):
    kept = os.path.join(o.work, name_of(scene) + ".judges.json")
    if not os.path.exists(kept):
        tool.save(denoised_judges.opinions(os.path.join(o.work, name_of(scene)), references(o, scene)[1], BLOCK), kept, indent=None)
    return tool.load(kept)


def main(o):
    if o.judges and cvvdp.missing():
        raise tool.Refused(cvvdp.missing())
    os.makedirs(o.work, exist_ok=True)
    limit, rows, all_looks = low_enough(), [], []
    for scene in o.scenes:
        kept = os.path.join(o.work, "%s.%s.json" % (name_of(scene), o.quality))
        if not os.path.exists(kept):
            if not os.path.exists(os.path.join(tool.ROOT, scene)):
                print("lab denoised: %s is not here, left out" % scene, file=sys.stderr)
                continue
            tool.save(measure(o, scene), kept, indent=None)
        looks = tool.load(kept)
        all_looks += looks
        rows.append(scene_row(scene, looks, limit))
        print("| %s |" % " | ".join(cells(rows[-1])), flush=True)
    s = summary(rows, all_looks, limit)
    if o.judges:
        s["judges"] = denoised_judges.summary([judged(o, scene) for scene in o.judges])
    print(text(rows, s))
    if o.write:
        tool.store(o.write, "denoised", {"measured": tool.measured(), "rows": rows, "summary": s})
