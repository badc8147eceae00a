"""The text of docs/cost.md: tables from docs/cost.json (scripts/cost), and what to choose."""
import math

from cost_figures import BLOCK, find, is_default, mean, median, on_frontier, over_scenes, points_of, saving


def table(heads, rows):
    return "\n".join(["| %s |" % " | ".join(heads), "|%s" % ("---|" * len(heads))] + ["| %s |" % " | ".join(r) for r in rows]) + "\n"


def figure(value, form="%.2f"):
    return form % value if value is not None and math.isfinite(value) else "–"


def percent(value):
    return figure(100 * value, "%.0f %%") if value is not None else "–"


def row_of(p):
    label = p[0] + ("" if is_default(p) or p[0] == "limit" else ", %s %g" % (p[1], p[2]))
    return [label, figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")),
            figure(over_scenes(p, "total_ratio")), percent(over_scenes(p, "noisy", mean)), percent(over_scenes(p, "early", mean)),
            figure(over_scenes(p, "worst")), figure(over_scenes(p, "flip", mean), "%.3f"),
            figure(over_scenes(p, "relmse"), "%.4f"), figure(100 * over_scenes(p, "overhead"), "%.2f %%")]


HEADS = ["setting", "samples", "time / limit", "time / uniform", "noisy", "early", "worst", "FLIP", "relMSE", "checks' share"]


def wanted_of(points):
    """Three figures of the default on a set, and who beats it where."""
    default = find(points, "observer")
    several = [f for f in default[3].values() if f["blocks"] > 1]
    slow = [f for f in default[3].values() if f["sampling_s"] and f["sampling_s"] / f["samples"] / BLOCK > 1e-6]
    good, n, beaten = on_frontier(points, default)
    figures = ["%s × (%d scenes with more than one block)" % (figure(median([f["total_ratio"] / f["limit"] for f in several])), len(several)),
               percent(over_scenes(default, "early", mean)),
               "%d of %d" % (sum(f["overhead"] <= 0.01 for f in slow), len(slow)) if slow else "not timed", "%d of %d" % (good, n)]
    text = ["On %s `%s` (%s %g) is as accurate in %s of the time." % (scene, p[0], p[1], p[2], figure(p[3][scene]["total_s"] / default[3][scene]["total_s"]))
            for scene, p in sorted(beaten.items())]
    return figures, text


def wanted_table(out):
    names = [("recorded", "test, recorded levels"), ("people", "people's views"), ("test", "test, simulated levels too")]
    names = [(n, t) for n, t in names if n in out["sets"] and find(points_of(out, n), "observer")]
    found = [wanted_of(points_of(out, n)) for n, _ in names]
    rows = ["time, checks included, against the limit at the same worst block, median of scenes (wanted ≤ 1.15)", "early stops",
            "scenes above 1 µs per path and thread on which the checks take ≤ 1 % (wanted: all)", "scenes on which no other setting is cheaper and as accurate (wanted 6 of 8)"]
    text = table(["the default, `observer`"] + [t for _, t in names], [[row] + [f[0][i] for f in found] for i, row in enumerate(rows)])
    for (_, title), (_, lines) in zip(names, found):
        if lines:
            text += "\n%s: %s\n" % (title, " ".join(lines))
    return text


def scenes_table(out, points):
    data = out["sets"]["test"]["scenes"]
    default = find(points, "observer")
    rows = []
    for scene, s in sorted(data.items()):
        t = [b["threshold"] for b in s["blocks"]]
        f = default[3][scene]
        rows.append([scene, str(len(t)), "%.0f … %.0f" % (min(t), max(t)), str(sum(b["reference"] for b in s["blocks"])),
                     str(sum(b["simulated"] for b in s["blocks"])), figure(median([b["us_per_path"] for b in s["blocks"]])),
                     figure(f["limit"]), figure(f["total_ratio"]), figure(f["worst"]), figure(100 * f["overhead"], "%.2f %%")])
    return table(["scene", "blocks", "thresholds", "with reference", "simulated", "µs per path", "limit", "observer: time / uniform",
                  "worst", "checks' share"], rows)


def real_table(out):
    rows = []
    for r in out.get("real", []):
        rows.append([r["scene"], "%d" % r["block"], "%s %s" % (r["criterion"], r["params"]), "%d" % r["stop"], figure(r["replayed"], "%.0f") if r["replayed"] else "–", figure(r["threshold"], "%.0f"),
                     figure(r["sampling_s"]), figure(1e-6 * r["recorded_us"] * r["stop"] * BLOCK), "%d" % r["checks"],
                     figure(1e3 * r["criterion_s"], "%.0f")])
    return table(["scene", "block", "criterion", "stop", "replayed", "threshold", "sampling, s", "as recorded, s", "checks", "checks, ms"], rows)


def setting_rows(points, criteria, dials=("visible", "threshold", "own")):
    return [row_of(p) for c in criteria for p in points if p[0] == c and p[3] and (is_default(p) or (p[1] in dials and p[2] in NAMED))]


NAMED = {0.5, 0.1, 0.02, 0.113, 0.0075, 0.0015}
INTRO = """# What accuracy costs

`make cost` wrote this page on %(date)s from recordings (`docs/cost.json` holds every figure); `scripts/cost --render DIR` makes the recordings anew. A criterion's **time**
is that of sampling plus that of its checks, in processor seconds of all threads: sampling as it was recorded, a check at the price measured in real renders in the same run. **Accuracy** is
told by the model observer (`ggn/observer/README.md`; it is nobody's eye, and it is what the criterion `observer` itself asks): a block with the threshold T that was stopped at n
samples shows √(T/n) times what is just visible. People have their own section. FLIP and relMSE are beside it.

**The limit.** With every block stopped exactly at its threshold, the same worst block costs mean(T)/max(T) of the uniform samples: no criterion can be below it. It is the dashed line
in every picture.
"""


CIRCLE = """
One caution: where a block's levels are simulated, the noise that `observer` sees follows the very curve that gave the block its threshold, so that it stops there by construction; only its own cadence and
dial show. What it does with real halves is in the next table, and against people below. All other criteria look at the simulated pictures as they would at real ones.

"""


def references(out):
    blocks = [b for s in out["sets"]["test"]["scenes"].values() for b in s["blocks"]]
    return ("%d blocks of %d test scenes so far, of those in `scripts/dataset.plan`. No reference has 8,192 samples: %d of the blocks have an independent one of 4,096, the others are "
            "compared (FLIP) with the mean of their own full level, 384 to 2,700 samples, from which their simulated levels were made (%d blocks); relMSE is the variance that "
            "their two halves show. Thresholds come from the halves too, up to 10,000 samples.\n"
            % (len(blocks), len(out["sets"]["test"]["scenes"]), sum(b["reference"] for b in blocks), sum(b["simulated"] for b in blocks)))


def prices_table(out):
    rows = [[name, figure(1e3 * p["check_s"], "%.2f"), figure(1e6 * p["check_s"] / BLOCK, "%.3f")]
            for name, p in out.get("prices", {}).items() if name != "uniform"]
    return table(["criterion", "ms a check of 200×200 pixels", "as µs per pixel: a path that takes this long costs as much"], rows)


def dial_table(points, criterion):
    rows = [[("%s %g" % (p[1], p[2])) if p[1] != "own" else "as shipped", figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")),
             percent(over_scenes(p, "noisy", mean)), percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")),
             figure(mean([f["checks_full"] for f in p[3].values()]), "%.1f"), figure(mean([f["checks_cheap"] for f in p[3].values()]), "%.1f")]
            for p in points if p[0] == criterion and p[1] in ("own", "passes", "gate", "guard")]
    return table(["setting", "samples", "time / limit", "noisy", "early", "worst", "network asked", "spared"], rows)


def cadence_table(out):
    rows = []
    for name in out["sets"]:
        if not name.startswith("test"):
            continue
        points = points_of(out, name)
        for criterion in ("lull-1.ggn", "svd-entropy", "attributes"):
            p = find(points, criterion)
            if p:
                rows.append([criterion, figure(out["sets"][name]["ratio"]), figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")),
                             percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")), figure(100 * over_scenes(p, "overhead"), "%.2f %%")])
    return table(["criterion", "ratio of levels", "samples", "time / limit", "early", "worst", "checks' share"], rows)


def growth_table(out):
    rows = [["%d²" % g["side"], "%d" % g["threads"], "%d" % g["blocks"], "%d" % g["checks"], figure(1e3 * g["criterion_s"] / g["checks"], "%.2f"),
             figure(g["criterion_s"]), figure(g["sampling_s"])] for g in out.get("growth", [])]
    return table(["pixels", "threads", "blocks", "checks", "ms a check", "checks, thread s", "sampling, thread s"], rows)


def sizes_table(out):
    """The limit as a function of the block's side: thresholds of every part, by the observer."""
    rows = []
    for name, title in (("test", "test scenes"), ("people", "people's views (whole pictures of 800×800)")):
        parts = out["sets"].get(name, {}).get("parts", {})
        whole = {scene: p for scene, p in parts.items() if len(p["200"]) > 1}
        if not whole:
            continue
        for side in ("25", "50", "100", "200"):
            ratios = [mean(p[side]) / max(p[side]) for p in whole.values()]
            samples = [mean(p[side]) / mean(p["200"]) for p in whole.values()]
            rows.append([title, side, figure(median(ratios)), figure(min(ratios)), figure(max(ratios)), figure(median(samples))])
    return table(["", "side", "mean(T)/max(T), median of scenes", "least", "most", "mean samples against 200²"], rows)


def guards_of_criteria(points):
    """Guards that are parameters: the same replay with and without."""
    rows = []
    for criterion, without in (("variance", "variance, no guard"), ("halfbuf", "halfbuf, no guard")):
        a = find(points, criterion)
        b = next((p for p in points if a and p[0] == without and p[2] == a[2]), None)
        if b:
            rows.append(["rare bright paths, `%s`" % criterion, "no pixel may hang on few samples"] + early_pair(a, b))
    own = find(points, "lull-1.ggn")
    for dial, value, case, guard in (("guard", 0, "rare bright paths, network", "tail and Gini of the half-buffer difference"),
                                     ("passes", 1, "one lucky check, network", "two checks in a row")):
        b = next((p for p in points if p[0] == "lull-1.ggn" and p[1] == dial and p[2] == value), None)
        if own and b:
            rows.append([case, guard] + early_pair(own, b))
    return rows


def early_pair(a, b):
    tell = lambda p: "early %s, worst %s, samples %s" % (percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")),
                                                        figure(over_scenes(p, "samples"), "%.0f"))
    return [tell(a), tell(b)]


def precision(out, points):
    text = ("\n## Precision and stability\n\nWhat number formats, instruction sets, threads and compilers change. p: four golden windows of the published networks, against double "
            "(`ggn golden`).\n\n")
    text += table(["in p", "moved at most", "windows"], [[g["name"], "%.1e" % g["p_moved"], str(g["windows"])] for g in out.get("golden", [])])
    text += ("\nIn decisions: bfloat16 products change 2 of 368 verdicts and 2 of 13 stops of lull-1 (`ggn evaluate --bf16`, [ggn/README.md](../ggn/README.md)); a check in which the "
             "host has flush-to-zero and denormals-are-zero on gives the same answer (`lull-check`, check `fp`, every criterion; `tests/hard/ggn_nn_hard.c`: p moves by less than 10⁻⁶ "
             "with activations in the denormal range). Stops of render and replay agree one by one, p to 14 digits (`tests/e2e/ggn_replay.sh`).\n\nIn images (pixels of the EXR files of small "
             "renders with a criterion):\n\n")
    text += table(["against -O3, one thread", "pictures changed"], [[i["name"], "%d of %d" % (i["changed"], i["pictures"])] for i in out.get("images", [])])
    text += ("\nWhich hard cases would fail without the measure that guards them. The first rows are parameters, replayed on the test blocks above; the others are taken out of a copy of the "
             "tree (`scripts/guards`, %s).\n\n" % out["date"])
    rows = guards_of_criteria(points) + [["%s (`%s`)" % (g["case"], g["test"]), g["guard"], g["with"], g["without"]] for g in out.get("guards", [])]
    return text + table(["case", "guard", "with it", "without"], rows)


REAL = """Recorded blocks rendered again with the same random numbers, and what the recorded levels alone say ("replayed"). `observer` stops where the replay does up to the distance of two
checks. `variance` never stops before 16 samples, the renderer's own first check, where the replay has its first window at 11 to 13. On the caustic `observer` stops at two thirds of the
threshold: with few of its bright paths met, the halves say less noise than there is, which simulated levels (they make Gaussian noise of the late halves) cannot show.

"""
MISSING = """
## Not measured

- The published GGN preset: no published weights run here, and training it takes longer than a page may. bfloat16 only by its price (above) and by the decisions it changes (below).
- Cadences below 1.26: the recordings have no closer levels. Blocks of 400 pixels: the test recordings hold scattered blocks of 200. Half-float planes: the recordings' half buffers are half floats already,
  so that everything above is with them; what full floats would change is not.
- `variance` and `halfbuf` are asked at the recorded levels here, in a renderer at sample counts of their own.
- Few blocks: the scenes with one block say nothing about the limit (it is 1 there).
"""


def page(out):
    text = INTRO % out
    test = points_of(out, "test")
    criteria = ("uniform", "variance", "halfbuf", "variance, no guard", "halfbuf, no guard", "observer", "lull-1.ggn", "svd-entropy", "attributes", "noise-mask")
    text += "\n" + references(out) + "\n## The frontier\n\n![](cost-frontier.png)\n\nMedians over scenes (noisy, early, FLIP: means); filled points are defaults.\n\n"
    text += table(HEADS, [row_of(p) for p in test if p[0] == "limit"] + setting_rows(test, criteria))
    text += CIRCLE + scenes_table(out, test)
    if "recorded" in out["sets"]:
        recorded = points_of(out, "recorded")
        blocks = sum(len(s["blocks"]) for s in out["sets"]["recorded"]["scenes"].values())
        text += ("\n### Recorded levels only\n\nNothing simulated: the %d blocks whose noise stops being visible before their recording ends, each level with the halves it really had.\n\n" % blocks
                 + table(HEADS, [row_of(p) for p in recorded if p[0] == "limit"] + setting_rows(recorded, criteria)))
    text += "\n### What was wanted\n\n" + wanted_table(out)
    text += "\n![](cost-ratio.png)\n" + choice(out)
    text += "\n## What a decision costs, and what it saves\n\n" + prices_table(out) + "\n![](cost-path.png)\n\n" + breakeven_table(test)
    text += "\n## Dials\n\nThe network:\n\n" + dial_table(test, "lull-1.ggn") + "\nHow often it is asked (levels this far apart). Six levels twice as far apart span 32 times the samples: the first window ends late, and its second pass twice as late.\n\n" + cadence_table(out)
    text += "\nBlock size, by the observer's thresholds of the blocks' parts:\n\n" + sizes_table(out)
    if "people" in out["sets"]:
        people = points_of(out, "people")
        text += ("\n## Against people\n\n64 blocks of four views; every view by an observer fitted to the other three; levels simulated from the halves at 384 samples. Here the labels are not the observer's own, and the default is further from the limit (What was wanted): people's thresholds scatter by more than any rule knows, and the worst of sixteen blocks decides. "
                 "Early: below 0.8 of the threshold that people gave.\n\n![](cost-people.png)\n\n" + table(HEADS, [row_of(p) for p in people if p[0] == "limit"]
                                                                                          + setting_rows(people, criteria)))
    text += "\n## With resolution and threads\n\n" + growth_table(out) + "\n![](cost-growth.png)\n"
    text += "\n## Real renders\n\n" + REAL + real_table(out) + MISSING + precision(out, test)
    return text


def breakeven_table(points):
    """Where the checks of a default cost as much as they save against uniform samples of the same worst block."""
    rows = []
    for p in points:
        if is_default(p) and p[0] in ("variance", "halfbuf", "observer", "lull-1.ggn", "svd-entropy", "attributes", "noise-mask"):
            spent, saved = saving(p)
            us = 1e6 * spent / (saved * BLOCK) if saved > 0 else math.nan
            samples = over_scenes(p, "samples")
            rows.append([p[0], figure(1e3 * spent, "%.1f"), figure(saved, "%.0f"), figure(us, "%.4f") if saved > 0 else "never",
                         figure(1e6 * spent * 99 / (samples * BLOCK), "%.3f")])
    return table(["default of", "checks of a block, ms", "samples per pixel saved against uniform (median)", "pays from, µs per path", "takes 1 % at, µs per path"], rows)


HALVES = ("halfbuf", "halfbuf, no guard", "observer")  # need the half buffer; the network asks for it for its guard alone


def best(points, holds, allowed, us=None):
    """The cheapest setting with `holds`, by the median of its time against the limit; us: as if every path took so long."""
    found = None
    for p in points:
        if p[0] == "limit" or not p[3] or not allowed(p) or not holds(p):
            continue
        if us is None:
            cost = over_scenes(p, "to_limit")
        else:
            limit = next(q for q in points if q[0] == "limit")[3]
            cost = median([(f["samples"] + f["check_s"] / (BLOCK * us * 1e-6)) / limit[s]["samples"] for s, f in p[3].items()])
        if found is None or cost < found[0]:
            found = (cost, p)
    return found


def choice(out):
    test = points_of(out, "test")
    final = lambda p: over_scenes(p, "early", mean) <= 0.05 and over_scenes(p, "noisy", mean) <= 0.1 and over_scenes(p, "worst") <= 1
    draft = lambda p: over_scenes(p, "worst") <= 2
    rows = []
    people = points_of(out, "people") if "people" in out["sets"] else []
    against = lambda p: over_scenes(p, "early", mean) <= 0.05
    for points, purpose, holds, allowed, us in (
            (people, "against people: at most 5 % of the blocks early", against, lambda p: True, None),
            (people, "the same, no half buffers", against, lambda p: p[0] not in HALVES and p[1] != "own", None),
            (test, "a draft: no block shows more than twice what is just visible", draft, lambda p: True, None),
            (test, "a final frame: at most 5 % of the blocks early, 10 % noisy", final, lambda p: True, None),
            (test, "the same, a cheap scene (0.05 µs per path)", final, lambda p: True, 0.05),
            (test, "the same, a slow renderer (20 µs per path)", final, lambda p: True, 20),
            (test, "the same, no half buffers", final, lambda p: p[0] not in HALVES and p[1] != "own", None),
            (test, "the same, nothing but the colour", final, lambda p: p[0] not in HALVES and not p[0].startswith("variance") and p[1] != "own", None)):
        found = best(points, holds, allowed, us)
        if not found:
            rows.append([purpose, "none of those measured", "–", "–", "–", "–"])
            continue
        cost, p = found
        rows.append([purpose, "`%s`, %s %g" % (p[0], p[1], p[2]), figure(cost), percent(over_scenes(p, "noisy", mean)),
                     percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst"))])
    text = ("\n## What to choose\n\nThe cheapest of all settings that were measured (time: median over scenes, checks included), each held to the same test blocks that it is "
            "chosen on, so that the figures flatter the chosen one a little. The observer is judge and party here (see above); against people it is not.\n\n")
    text += table(["for", "setting", "time / limit", "noisy", "early", "worst"], rows)
    return text + worst_table(test) + early_text(out)


def early_text(out):
    lines = ["%s, block %d: stopped by `%s` at %d samples, by `observer` at %d, and at %d; its noise stops being visible at %.0f"
             % (e["scene"], e["block"], e["criterion"], e["stops"][e["criterion"]], e["stops"]["observer"], e["last"], e["threshold"]) for e in out.get("early", [])]
    return "\n![](cost-early.png)\n\n*" + "; ".join(lines) + ". Twice as bright as displayed. Specks are light that a rare path carries; a mean over 40,000 pixels does not see them.*\n" if lines else ""


def worst_table(points):
    """Where each default fails: the scene on which it leaves most noise, and the one on which it wastes most."""
    rows = []
    for p in points:
        if not is_default(p) or p[0] in ("uniform", "limit"):
            continue
        early = max(p[3].items(), key=lambda s: s[1]["worst"])
        late = max(p[3].items(), key=lambda s: s[1]["to_limit"])
        rows.append([p[0], "%s: %s × what is visible, %s early" % (early[0], figure(early[1]["worst"]), percent(early[1]["early"])),
                     "%s: %s × the time of the limit" % (late[0], figure(late[1]["to_limit"]))])
    return "\nWhere each default fails:\n\n" + table(["default of", "leaves most noise on", "wastes most on"], rows)
