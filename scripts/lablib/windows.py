"""What a network on denoised windows is worth beside the estimate of the criterion `denoised`, on scenes left out (scripts/lab explained).

Stops are read from the looks as scripts/lab denoised reads them. Every way is asked with its answers multiplied by 2^shift, too, for a row of
shifts: what it would be worth if it were more or less careful. Shifts are chosen with hindsight, of all ways alike."""
import os
import random
import statistics
import textwrap

from lablib import denoised, tables, tool

SHIFTS = [k / 50 for k in range(-100, 101)]
AFTER = 2 * denoised.LEVELS[-1]  # samples that are counted of a block that goes on
DRAWS, HALF, CHEAPER = 100, 0.5, 0.9
HEAD = ("asked", "octaves left", "explained", "stopped", "off", "samples a block", "off at the estimate's samples",
        "samples where as many are off, over the estimate's")


def kept(o, scene):
    """Whether all windows of a scene are there."""
    return all(os.path.exists(os.path.join(o.dir, scene, "%d.windows" % n)) for n in denoised.LEVELS)


def dealt(names, folds):
    names = random.Random(1).sample(sorted(names), len(names))
    return [names[k::folds] for k in range(min(folds, len(names)))]


def asked(o, by_scene, octaves, numbers):
    """([{scene: octaves of each look}] of each seed, parameters of a network). octaves, numbers: {scene: of each look}."""
    try:
        from lablib import torch_windows as t
    except ImportError as why:
        raise tool.Refused("no network without PyTorch (%s): apt-get install python3-torch" % why) from None
    t.torch.set_num_threads(1)
    scenes = {name: t.scene(os.path.join(o.dir, name), looks, numbers[name], octaves[name]) for name, looks in by_scene.items()}
    told = []
    for seed in range(1, o.seeds + 1):
        told.append({})
        for k, group in enumerate(dealt(scenes, o.folds)):
            path, inputs = os.path.join(o.dir, "network-%d-%d.json" % (seed, k)), {"scenes": sorted(scenes), "group": group}
            if not os.path.exists(path) or tool.load(path)["of"] != inputs:
                net = t.trained(scenes, [name for name in scenes if name not in group], seed)
                tool.save({"of": inputs, "octaves": {name: t.answers(net, scenes[name]) for name in group}}, path, indent=None)
            told[-1].update(tool.load(path)["octaves"])
    return told, t.size()


def blocks_of(by_scene, said):
    """(scene, looks of a block with what is said of them)"""
    out = []
    for name, looks in by_scene.items():
        looks = [{**look, "said": look["error"] * 2 ** k} for look, k in zip(looks, said[name])]
        out += [(name, [look for look in looks if look["block"] == i]) for i in range(1 + max(look["block"] for look in looks))]
    return out


def ends(blocks, limit):
    """Of each block and each shift whether it stops, with how many samples, and whether it is visibly off there."""
    rows = []
    for _, looks in blocks:
        at = [denoised.stop(looks, limit * 2 ** -shift, "said") for shift in SHIFTS]
        rows.append([(True, e[0], denoised.between(looks, e[0], "true_blend") > denoised.VISIBLE) if e else (False, AFTER, False) for e in at])
    return rows


def curve(rows):
    """For each shift (stopped, off, samples a block)."""
    return [tuple(sum(row[s][what] for row in rows) / (len(rows) if what == 1 else 1) for what in (0, 2, 1)) for s in range(len(SHIFTS))]


def compared(way, estimate):
    """(blocks off at no more samples than the estimate's, samples over the estimate's with no more blocks off)"""
    at = curve(estimate)[SHIFTS.index(0)]
    points = curve(way)
    as_many = [p for p in points if p[2] <= at[2] * (1 + 1e-9)]
    return max(as_many, key=lambda p: (p[2], -p[1]))[1] if as_many else None, min(p[2] for p in points if p[1] <= at[1]) / at[2]


def spread(way, estimate, names):
    """The samples of compared() for scenes drawn with replacement: from the 16th to the 84th percentile."""
    draw, of = random.Random(1), {}
    for i, name in enumerate(names):
        of.setdefault(name, []).append(i)
    ratios = []
    for _ in range(DRAWS):
        some = [i for name in draw.choices(sorted(of), k=len(of)) for i in of[name]]
        ratios.append(compared([way[i] for i in some], [estimate[i] for i in some])[1])
    ratios.sort()
    return ratios[round(0.16 * len(ratios))], ratios[round(0.84 * len(ratios)) - 1]


def figures(names, by_scene, octaves, said, limit):
    """Of one way to ask: what it leaves unexplained in these scenes, and where their blocks end."""
    known = [(y, k) for name in names for y, k in zip(octaves[name], said[name]) if y is not None]
    variance = statistics.pvariance([y for y, _ in known])
    left = sum((y - k) ** 2 for y, k in known) / len(known)
    rows = ends(blocks_of({name: by_scene[name] for name in names}, said), limit)
    stopped, off, spp = curve(rows)[SHIFTS.index(0)]
    return {"rms": left ** 0.5, "explained": 1 - left / variance, "stopped": stopped, "off": off, "spp": spp}, rows


def judged(names, by_scene, octaves, ways, limit):
    """Figures of all ways in these scenes; the first is what they are compared with."""
    out, estimate = [], None
    of = [name for name in names for _ in range(1 + max(look["block"] for look in by_scene[name]))]
    for title, said in ways:
        row, ended = figures(names, by_scene, octaves, said, limit)
        estimate = estimate or ended
        row["name"], (row["as_dear"], row["as_safe"]) = title, compared(ended, estimate)
        row["spread"] = spread(ended, estimate, of)
        out.append(row)
    return {"scenes": len(names), "blocks": len(of), "ways": out}


def measure(o, by_scene, octaves, numbers, fits):
    """fits: [(name, {scene: octaves of each look})] that are there already."""
    told, size = asked(o, by_scene, octaves, numbers)
    mean = {name: [sum(ks) / len(ks) for ks in zip(*(t[name] for t in told))] for name in by_scene}
    nothing = {name: [0] * len(looks) for name, looks in by_scene.items()}
    ways = [("the estimate as it is", nothing), *fits, ("network, mean of %d seeds" % len(told), mean),
            *(("network, seed %d" % (k + 1), t) for k, t in enumerate(told))]
    limit, page = denoised.low_enough(), {denoised.name_of(scene) for scene in denoised.SCENES}
    sets = [("all", sorted(by_scene)), ("page", sorted(page & set(by_scene)))]
    return {"parameters": size, "folds": o.folds, "seeds": o.seeds, "limit": limit,
            "sets": {key: judged(names, by_scene, octaves, ways, limit) for key, names in sets if names}}


def worth(network, off, spp):
    """The rule that was set before it was trained: half as many blocks off for the same samples, or nine tenths of the samples for as many.
    Where none is off there are no half as many."""
    fewer = bool(off) and network["as_dear"] is not None and network["as_dear"] <= HALF * off
    return fewer or network["as_safe"] <= CHEAPER * spp


def verdict(ways):
    estimate, network = ways[0], next(way for way in ways if way["name"].startswith("network"))
    say = lambda *beside: "**yes**" if worth(network, *beside) else "**no**"
    told = ("Is the mean of the networks worth its keep (at most %.1f as many off at equal samples, or at most %.1f of the samples for as many)? "
            "Beside the estimate as it is: %s; beside the estimate at its own best shift: %s." % (
                HALF, CHEAPER, say(estimate["off"], 1), say(estimate["as_dear"], estimate["as_safe"])))
    return textwrap.fill(told, 140) + "\n"


def page(r):
    told = []
    for key, what in (("all", "All %d scenes, %d blocks"), ("page", "Of these the %d of docs/denoised.md, %d blocks")):
        s = r["sets"].get(key)
        if s and (key == "all" or s["scenes"] < r["sets"]["all"]["scenes"]):
            rows = [[w["name"], "%.2f" % w["rms"], "%.2f" % w["explained"], "%d" % w["stopped"], "%d" % w["off"], "%.0f" % w["spp"],
                     tables.figure(w["as_dear"], "%d"), "%.2f (%.2f–%.2f)" % (w["as_safe"], *w["spread"])] for w in s["ways"]]
            told.append("%s:\n\n%s\n%s" % (what % (s["scenes"], s["blocks"]), tables.table(HEAD, rows), verdict(s["ways"])))
    return "\n".join(told)
