"""How much of the error of the denoised estimate its own pictures could explain on scenes left out.

DIR is where scripts/lab denoised has kept its looks (NAME.high.json). What a network on denoised windows would have to predict is
log2(true / believed), the truth being the error against two references. Least squares on the numbers that the looks keep of the two
pictures, |F(A) - F(B)| (`halves`) and both together with |blur(F(M) - M)| (`crossed`), of the noisy one and of the samples, are fitted to
all scenes but one and asked about that one. The table shows what of the variance is explained there; below 0 a fit is worse than none."""
import glob
import math
import os

from lablib import tables, tool

LEAST = 1e-3  # visible error, for its logarithm
TARGETS = {"true_blend": "blend", "true_denoised": "denoised"}
FITS = (("a constant", ()), ("halves", ("halves",)), ("halves, crossed", ("halves", "crossed")), ("believed", ("error",)),
        ("halves, believed", ("halves", "error")), ("all, noisy and samples", ("halves", "crossed", "error", "noisy", "spp")))


def options(parser):
    parser.add_argument("dir", type=tool.path, help="where scripts/lab denoised keeps its looks")
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


def unexplained(looks, target, keys):
    """What is left of log2(true / believed) in each look, its scene left out of the fit."""
    rows = [(scene, ([1, *(log(look[key]) for key in keys)], log(look[target]) - log(look["error"]))) for scene, look in looks]
    left = []
    for scene in sorted({s for s, _ in rows}):
        weights = fitted([row for s, row in rows if s != scene])
        left += [y - sum(w * v for w, v in zip(weights, x)) for s, (x, y) in rows if s == scene]
    return left


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def explain(looks):
    found = {}
    for target in TARGETS:
        believed = [log(look[target]) - log(look["error"]) for _, look in looks]
        mean = sum(believed) / len(believed)
        spread = rms([b - mean for b in believed])
        found[target] = {"rms": rms(believed), "fits": [{"name": name, "rms": rms(left), "explained": 1 - (rms(left) / spread) ** 2}
                                                        for name, left in ((n, unexplained(looks, target, keys)) for n, keys in FITS)]}
    return found


def page(r):
    rows = [["as it is", *sum((["%.2f" % r["found"][t]["rms"], ""] for t in TARGETS), [])]]
    for k, (name, _) in enumerate(FITS):
        fits = [r["found"][t]["fits"][k] for t in TARGETS]
        rows.append([name, *sum((["%.2f" % f["rms"], "%.2f" % f["explained"]] for f in fits), [])])
    return "%s; %d looks at %d blocks of %d scenes, each scene left out of its fit.\n\n%s" % (
        tables.told(r["measured"]), r["looks"], r["blocks"], r["scenes"],
        tables.table(("fitted", "blend: octaves left", "explained", "denoised: octaves left", "explained"), rows))


def main(o):
    looks = [(os.path.basename(path).split(".")[0], look) for path in sorted(glob.glob(os.path.join(o.dir, "*.high.json"))) for look in tool.load(path)]
    looks = [(scene, look) for scene, look in looks if all(look.get(key) for key in ("error", "halves", "crossed", "noisy", *TARGETS))]
    scenes = {scene for scene, _ in looks}
    if len(scenes) < 2:
        raise tool.Refused("%s: no looks of two scenes; scripts/lab denoised makes them" % o.dir)
    result = {"measured": tool.measured(), "looks": len(looks), "blocks": len({(s, look["block"]) for s, look in looks}), "scenes": len(scenes),
              "found": explain(looks)}
    print(page(result), end="")
    if o.write:
        tool.store(o.write, "explained", result)
