"""How much of the error of the denoised estimate its own pictures could explain on scenes left out.

DIR is where scripts/lab denoised has kept its looks (NAME.high.json). What a network on denoised windows would have to predict is
log2(true / believed), the truth being the error against two references. Least squares on the numbers that the looks keep of the two
pictures, |F(A) - F(B)| (`halves`) and both together with |blur(F(M) - M)| (`crossed`), of the noisy one and of the samples, are fitted to
all scenes but one and asked about that one. The table shows what of the variance is explained there; below 0 a fit is worse than none.

Where DIR has the windows, too (scripts/lab denoised --windows), a small convolutional network is trained on them (torch_windows.py): scenes
are dealt out to --folds groups, and networks trained on the others are asked about each. A second table says what of the truth they explain,
and what they would be worth as a criterion: stops are read from the looks as scripts/lab denoised reads them. Networks that are done stay."""
import glob
import math
import os
import statistics

from lablib import tables, tool, windows

LEAST = 1e-3  # visible error, for its logarithm
LEAST_SCENES = 4  # with windows: a network is trained, told when to end and judged on different ones
TARGETS = ("true_blend", "true_denoised")
NUMBERS = ("halves", "crossed", "error", "noisy", "spp")
FITS = (("a constant", ()), ("halves", ("halves",)), ("halves, crossed", ("halves", "crossed")), ("believed", ("error",)),
        ("halves, believed", ("halves", "error")), ("all, noisy and samples", NUMBERS))


def options(parser):
    parser.add_argument("dir", type=tool.path, help="where scripts/lab denoised keeps its looks")
    parser.add_argument("--folds", type=int, default=6, help="groups of scenes of the network (6)")
    parser.add_argument("--seeds", type=int, default=3, help="networks of each group (3)")
    tool.writes(parser)


def log(value):
    return math.log2(max(value, LEAST))


def solved(a, b):
    """x of a x = b, by elimination with pivots."""
    m = [[*row, value] for row, value in zip(a, b)]
    for i in range(len(m)):
        p = max(range(i, len(m)), key=lambda k: abs(m[k][i]))
        m[i], m[p] = m[p], m[i]
        for k in range(len(m)):
            if k != i:
                factor = m[k][i] / m[i][i]
                m[k] = [x - factor * y for x, y in zip(m[k], m[i])]
    return [row[-1] / row[i] for i, row in enumerate(m)]


def fitted(rows):
    """Least squares over (x, y), with a ridge that only keeps equal columns apart."""
    n = range(len(rows[0][0]))
    return solved([[sum(x[i] * x[j] for x, _ in rows) + (1e-6 if i == j else 0) for j in n] for i in n], [sum(x[i] * y for x, y in rows) for i in n])


def octaves(look, target):
    """What the estimate misses of the truth; None where the references' noise hides it."""
    whole = all(look.get(key) for key in ("error", "halves", "crossed", "noisy", *TARGETS))
    return log(look[target]) - log(look["error"]) if whole else None


def corrections(looks, target, keys):
    """What a fit to all other scenes says of each look."""
    rows = [(scene, [1, *(log(look[key]) for key in keys)], octaves(look, target)) for scene, look in looks]
    weights = {scene: fitted([(x, y) for s, x, y in rows if s != scene and y is not None]) for scene in {s for s, _, _ in rows}}
    return [sum(w * v for w, v in zip(weights[scene], x)) for scene, x, _ in rows]


def left(looks, target, said):
    """Octaves that are left of log2(true / believed) when what was said is taken off."""
    return [y - k for y, k in ((octaves(look, target), k) for (_, look), k in zip(looks, said)) if y is not None]


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def explain(looks):
    found = {}
    for target in TARGETS:
        believed = left(looks, target, [0] * len(looks))
        spread = statistics.pstdev(believed)
        fits = [(name, rms(left(looks, target, corrections(looks, target, keys)))) for name, keys in FITS]
        found[target] = {"rms": rms(believed), "fits": [{"name": name, "rms": r, "explained": 1 - (r / spread) ** 2} for name, r in fits]}
    return found


def page(r):
    rows = [["as it is", *sum((["%.2f" % r["found"][t]["rms"], ""] for t in TARGETS), [])]]
    for k, (name, _) in enumerate(FITS):
        fits = [r["found"][t]["fits"][k] for t in TARGETS]
        rows.append([name, *sum((["%.2f" % f["rms"], "%.2f" % f["explained"]] for f in fits), [])])
    return "%s; %d looks at %d blocks of %d scenes, each scene left out of its fit.\n\n%s" % (
        tables.told(r["measured"]), r["looks"], r["blocks"], r["scenes"],
        tables.table(("fitted", "blend: octaves left", "explained", "denoised: octaves left", "explained"), rows))


def network(r):
    """What came of the network, and whether it is worth its keep."""
    n = r.get("network")
    if not n:
        return "Not measured: no windows.\n"
    return "%s; %d networks of %d parameters, of %d groups of scenes.\n\n%s" % (
        tables.told(r["measured"]), n["folds"] * n["seeds"], n["parameters"], n["folds"], windows.page(n))


def by_scene(looks, values):
    out = {}
    for (scene, _), value in zip(looks, values):
        out.setdefault(scene, []).append(value)
    return out


def with_windows(o, looks):
    """What the network is worth in the scenes whose windows are there; None if there are too few."""
    looks = [(scene, look) for scene, look in looks if windows.kept(o, scene)]
    if len({scene for scene, _ in looks}) < LEAST_SCENES:
        return None
    fits = [(name, by_scene(looks, corrections(looks, "true_blend", keys))) for name, keys in (FITS[0], FITS[-1])]
    return windows.measure(o, by_scene(looks, [look for _, look in looks]), by_scene(looks, [octaves(look, "true_blend") for _, look in looks]),
                           by_scene(looks, [[log(look[key]) for key in NUMBERS] for _, look in looks]), fits)


def main(o):
    looks = [(os.path.basename(path).split(".")[0], look) for path in sorted(glob.glob(os.path.join(o.dir, "*.high.json"))) for look in tool.load(path)]
    whole = [(scene, look) for scene, look in looks if octaves(look, "true_blend") is not None]
    if len({scene for scene, _ in whole}) < 2:
        raise tool.Refused("%s: no looks of two scenes; scripts/lab denoised makes them" % o.dir)
    result = {"measured": tool.measured(), "looks": len(whole), "blocks": len({(s, look["block"]) for s, look in whole}),
              "scenes": len({scene for scene, _ in whole}), "found": explain(whole)}
    print(page(result), end="")
    seen = with_windows(o, looks)
    if seen:
        result["network"] = seen
        print("\n" + network(result), end="")
    if o.write:
        tool.store(o.write, "explained", result)
