"""Tables and figures of docs/cost.md from what `lab cost` measured; the words are templates/cost.md."""
import math

from lablib import tool
from lablib.cost_figures import (BLOCK, SIDES, find, is_default, limits_by_side, mean, median, on_frontier, over_scenes,
                                 points_in, points_of, saving)
from lablib.tables import figure, percent, table

NAMED = {0.5, 0.1, 0.02, 0.113, 0.0075, 0.0015, 64, 256, 1024, 4096}
HEADS = ["setting", "samples", "time / limit", "time / uniform", "noisy", "early", "worst", "FLIP", "relMSE", "checks' share"]
DIAL_HEADS = ["setting", "samples", "time / limit", "noisy", "early", "worst", "asked", "spared by the gate"]
BASELINES = ("svd-entropy", "attributes", "noise-mask")


def default_network(out):
    return next(iter(out["networks"]))


def networks(out):
    return [n for n in out["networks"] if not n.startswith("window")]


def measured(out):
    """When, at which commit; of steps that were measured apart each by itself; says so if the observer has changed since."""
    told = {}
    for step, m in out["measured"].items():
        law = "" if m["level"] == tool.observer_law() else ", an earlier observer whose default was `--visible %g`" % m["visible"]
        told.setdefault("%s at commit %s on %s%s" % (m["date"], m["commit"], m["processor"], law), []).append(step)
    return "; ".join(text if len(told) == 1 else "%s: %s" % (", ".join(steps), text) for text, steps in told.items())


def row_of(p):
    label = p[0] + ("" if is_default(p) or p[0] == "limit" else ", %s %g" % (p[1], p[2]))
    return [label, figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")),
            figure(over_scenes(p, "total_ratio")), percent(over_scenes(p, "noisy", mean)), percent(over_scenes(p, "early", mean)),
            figure(over_scenes(p, "worst")), figure(over_scenes(p, "flip", mean), "%.3f"),
            figure(over_scenes(p, "relmse"), "%.4f"), figure(100 * over_scenes(p, "overhead"), "%.2f %%")]


def setting_rows(points, criteria, dials=("visible", "threshold", "own", "spp")):
    return [row_of(p) for c in criteria for p in points if p[0] == c and p[3]
            and (is_default(p) or (p[1] in dials and p[2] in NAMED and not c.endswith(" bf16") and (c != "fixed" or p[2] == 1024)))]


def frontier(out, name):
    mine, others = default_network(out), networks(out)
    criteria = ("uniform", "fixed", "variance", "halfbuf", "variance, no guard", "halfbuf, no guard", "observer", mine, mine + ", no halves",
                mine + " bf16", *others[1:], *BASELINES)
    points = points_of(out, name)
    return table(HEADS, [row_of(p) for p in points if p[0] == "limit"] + setting_rows(points, criteria))


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


def scenes_table(out):
    data = out["sets"]["test"]["scenes"]
    default = find(points_of(out, "test"), "observer")
    rows = []
    for scene, s in sorted(data.items()):
        t = [b["threshold"] for b in s["blocks"]]
        f = default[3][scene]
        rows.append([scene, str(len(t)), "%.0f … %.0f" % (min(t), max(t)), str(sum(b["reference"] for b in s["blocks"])),
                     str(sum(b["simulated"] for b in s["blocks"])), figure(median([b["us_per_path"] for b in s["blocks"]])),
                     figure(f["limit"]), figure(f["total_ratio"]), figure(f["worst"]), figure(100 * f["overhead"], "%.2f %%")])
    return table(["scene", "blocks", "thresholds", "with reference", "simulated", "µs per path", "limit", "observer: time / uniform",
                  "worst", "checks' share"], rows)


def real_why(r):
    """How a real stop stands to the replayed one."""
    if not r["replayed"]:
        return "not replayed: its threshold lies beyond the recorded levels"
    off = r["stop"] / r["replayed"]
    if abs(off - 1) <= 0.1:
        return "within 10 %"
    if off > 1 and r["checks"] == 1:
        return "the renderer's first check"
    between = [n for n in r["levels"] if min(r["stop"], r["replayed"]) < n < max(r["stop"], r["replayed"])]
    return "not explained" if len(between) > 1 else "the two ask at other sample counts, one level apart"


def real_table(out):
    rows = []
    for r in out.get("real", []):
        again = 1e-6 * r["recorded_us"] * r["stop"] * BLOCK
        rows.append([r["scene"], "%d" % r["block"], "%s %s" % (r["criterion"], r["params"]), "%d" % r["stop"],
                     figure(r["replayed"], "%.0f") if r["replayed"] else "–", real_why(r), figure(r["threshold"], "%.0f"), figure(r["sampling_s"]),
                     figure(again), figure(r["sampling_s"] / again), "%d" % r["checks"], figure(1e3 * r["criterion_s"], "%.1f")])
    return table(["scene", "block", "criterion", "stop", "replayed", "", "threshold", "sampling, s", "as recorded, s", "ratio", "checks", "checks, ms"], rows)


def real(out):
    """Figures of what is said of the real renders."""
    rows = out["real"]
    replayed = [r for r in rows if r["replayed"]]
    timed = [r["sampling_s"] / (1e-6 * r["recorded_us"] * r["stop"] * BLOCK) for r in rows]
    default = "%s=%g" % tuple(out["defaults"]["observer"])
    return {"near": sum(abs(r["stop"] / r["replayed"] - 1) <= 0.1 for r in replayed), "replayed": len(replayed), "revision": out.get("real_revision", "?"),
            "unexplained": sum(real_why(r) == "not explained" for r in replayed),
            "soon": "; ".join("%s %d at %d of %.0f" % (r["scene"], r["block"], r["stop"], r["threshold"]) for r in rows
                              if (r["criterion"], r["params"]) == ("observer", default) and r["stop"] < 0.8 * r["threshold"]),
            "median": figure(median(timed)), "least": figure(min(timed)), "most": figure(max(timed)),
            "timed_near": sum(abs(t - 1) <= 0.1 for t in timed), "timed": len(timed)}


def blocks(out, name):
    return [b for s in out["sets"][name]["scenes"].values() for b in s["blocks"]]


def references(out):
    """Figures of the test blocks: how many, of which scenes, with which references."""
    spp = {int(k): n for k, n in out.get("references", {}).items()}
    recorded = [b["cap"] for b in blocks(out, "recorded")] if "recorded" in out["sets"] else []
    return {"blocks": len(blocks(out, "test")), "scenes": len(out["sets"]["test"]["scenes"]), "foreign": out.get("foreign", 0),
            "with": ", ".join("%d of %s" % (n, "{:,}".format(k)) for k, n in sorted(spp.items()) if k) or "none with any", "without": spp.get(0, 0),
            "first": "{:,.0f}".format(min(recorded, default=math.nan)), "last": "{:,.0f}".format(max(recorded, default=math.nan))}


def prices_table(out):
    rows = [[name, figure(1e3 * p["check_s"], "%.2f"), figure(1e3 * p["most_s"], "%.2f") if "most_s" in p else "–",
             figure(1e6 * p["check_s"] / BLOCK, "%.3f")] for name, p in out.get("prices", {}).items() if name != "uniform"]
    return table(["criterion", "ms a check of 200×200 pixels", "most of the rounds", "as µs per pixel: a path that takes this long costs as much"], rows)


def bf16_table(out):
    return table(["networks", "GMAC", "float, ms", "bfloat16, ms", "ratio"],
                 [[b["name"], figure(out.get("networks", {}).get(b["name"], {}).get("macs", math.nan) / 1e9), figure(b["f32_ms"], "%.1f"),
                   figure(b["bf16_ms"], "%.1f"), figure(b["bf16_ms"] / b["f32_ms"])] for b in out["bench"]])


def dial_row(p, label):
    return [label, figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")), percent(over_scenes(p, "noisy", mean)),
            percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")), figure(mean([f["checks_full"] for f in p[3].values()]), "%.1f"),
            figure(mean([f["checks_cheap"] for f in p[3].values()]), "%.1f")]


def dial_table(out, criterion):
    return table(DIAL_HEADS, [dial_row(p, "as shipped" if p[1] == "own" else "%s %g" % (p[1], p[2])) for p in points_of(out, "test")
                              if p[0] == criterion and p[1] in ("own", "passes", "gate", "guard", "growth")])


def passes_table(out):
    return table(DIAL_HEADS, [dial_row(p, "%s, passes %g" % (p[0], p[2])) for p in points_of(out, "test")
                              if p[0] in BASELINES and p[1] == "passes"])


def networks_table(out):
    rows, points = [], points_of(out, "few" if "few" in out["sets"] else "test")
    for name, n in out.get("networks", {}).items():
        p = find(points, name)
        if p:
            rows.append([name, n["preset"], "%d" % n["window"], "yes" if n["picture"] else "no", figure(n["macs"] / 1e9), figure(over_scenes(p, "samples"), "%.0f"),
                         figure(over_scenes(p, "to_limit")), percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")),
                         figure(100 * over_scenes(p, "overhead"), "%.2f %%")])
    return table(["network", "preset", "images in its window", "noise picture", "GMAC a decision", "samples", "time / limit", "early", "worst", "checks' share"], rows)


def cadence_table(out):
    rows = []
    sets = {ratio: points_in(out, data) for ratio, data in out["cadence"].items()}
    for criterion in ("observer", "variance", "halfbuf", default_network(out), *BASELINES):
        for ratio, points in sets.items():
            p = next((p for p in points if p[0] == criterion), None)
            if p:
                rows.append([criterion, ratio, figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")), percent(over_scenes(p, "early", mean)),
                             figure(over_scenes(p, "worst")), figure(mean([f["checks_full"] + f["checks_cheap"] for f in p[3].values()]), "%.1f"),
                             figure(100 * over_scenes(p, "overhead"), "%.2f %%")])
    return table(["criterion", "ratio", "samples", "time / limit", "early", "worst", "checks", "checks' share"], rows)


def cadence_blocks(out):
    return sum(len(s["blocks"]) for s in next(iter(out["cadence"].values()))["scenes"].values())


def growth_table(out):
    rows = [[g["criterion"], "%d²" % g["side"], "%d" % g["threads"], "%d" % g["blocks"], "%d" % g["checks"], figure(1e3 * g["criterion_s"] / max(1, g["checks"]), "%.2f"),
             figure(g["criterion_s"], "%.3f"), figure(g["sampling_s"]), figure(1e6 * g["sampling_s"] / g["side"]**2 / g["spp"], "%.2f"),
             figure(g["render_wall_s"]), figure(g["peak_mb"], "%.0f") if g["peak_mb"] else "–"] for g in out.get("growth", [])]
    return table(["criterion", "pixels", "threads", "blocks", "checks", "ms a check", "checks, thread s", "sampling, thread s", "µs per path", "wall s", "memory at its peak, MB"], rows)


def growth(out):
    """Figures of what is said of growth; None where too little was measured."""
    rows = [g for g in out.get("growth", []) if g["criterion"] == "observer"]
    if len(rows) < 2:
        return None
    a, b = rows[0], rows[-1]
    per = lambda g: figure(1e9 * g["criterion_s"] / g["checks"] * g["blocks"] / g["side"]**2, "%.1f")
    twice = [(g, h) for g in rows for h in rows if g["side"] == h["side"] and (g["threads"], h["threads"]) == (1, 2)]
    ratio = lambda key: figure(median([h[key] / g[key] for g, h in twice]))
    return {"ns": per(a), "side": a["side"], "last_ns": per(b), "last_side": b["side"], "twice": bool(twice), "checks": ratio("criterion_s"),
            "sampling": ratio("sampling_s")}


def sides_table(out):
    rows = []
    for name in dict.fromkeys(r["criterion"] for r in out.get("sides", [])):
        by = {r["side"]: r["check_s"] for r in out["sides"] if r["criterion"] == name}
        rows.append([name] + [figure(1e9 * by[s] / s**2, "%.1f") if s in by else "–" for s in (50, 100, 200, 400)])
    return table(["ns per pixel of a check, blocks of", "50²", "100²", "200²", "400²"], rows)


def sizes_table(out):
    """The limit as a function of the block's side: thresholds of every part, by the observer."""
    rows = []
    for name, title in (("test", "test scenes, blocks here and there"), ("people", "people's views, whole"), ("validation", "validation views, whole")):
        parts = out["sets"].get(name, {}).get("parts", {})
        for side, ratios in limits_by_side(out, name).items():
            if ratios:
                samples = [mean(p[side]) / mean(p["200"]) for p in parts.values() if len(p["200"]) > 1 and len(p.get(side, ())) > 1]
                rows.append([title, side, "%d" % len(ratios), figure(median(ratios)), figure(min(ratios)), figure(max(ratios)), figure(median(samples))])
    return table(["", "side", "scenes", "mean(T)/max(T), median of scenes", "least", "most", "mean samples against 200²"], rows)


def published(out):
    """What is said of published thresholds."""
    return "; ".join("%s: %s early, %s of the limit's samples" % (p[0][:-len("-thresholds.csv")], percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "to_limit")))
                     for p in points_of(out, "people") if p[0].endswith("-thresholds.csv")) or "not here"


def breakeven_table(out):
    """Where the checks of a default cost as much as they save against uniform samples of the same worst block."""
    rows = []
    for p in points_of(out, "test"):
        if is_default(p) and p[0] in ("variance", "halfbuf", "observer", *networks(out), *BASELINES):
            spent, saved = saving(p)
            us = 1e6 * spent / (saved * BLOCK) if saved > 0 else math.nan
            samples = over_scenes(p, "samples")
            rows.append([p[0], figure(1e3 * spent, "%.1f"), figure(saved, "%.0f"), figure(us, "%.4f") if saved > 0 else "never",
                         figure(1e6 * spent * 99 / (samples * BLOCK), "%.3f")])
    return table(["default of", "checks of a block, ms", "samples per pixel saved against uniform (median)", "pays from, µs per path", "takes 1 % at, µs per path"], rows)


def pays_table(out):
    """The cheapest setting of each kind that is good enough for a final frame, if every path took so long."""
    points, networks = points_of(out, "recorded"), set(out.get("networks", {}))
    kinds = (("`observer`", lambda p: p[0] == "observer"), ("`variance`, `halfbuf`", lambda p: p[0].startswith(("variance", "halfbuf"))),
             ("a network", lambda p: p[0].replace(" bf16", "") in networks), ("a baseline", lambda p: p[0] in BASELINES), ("uniform", lambda p: p[0] in ("uniform", "fixed")))
    rows = []
    for us in (0.02, 0.1, 0.5, 1, 5, 20, 100):
        found = [best(points, final, allowed, us) for _, allowed in kinds]
        rows.append(["%g" % us] + [figure(f[0]) if f else "none is" for f in found])
    return table(["µs per path"] + [k for k, _ in kinds], rows)


def final(p):
    return over_scenes(p, "early", mean) <= 0.05 and over_scenes(p, "noisy", mean) <= 0.1 and over_scenes(p, "worst") <= 1


def without_halves(out):
    """Settings for hosts without half buffers: a network judges without noise picture and guard there."""
    networks = set(out.get("networks", {}))
    return lambda p: not p[0].startswith(("halfbuf", "observer")) and p[0].replace(" bf16", "") not in networks


def with_halves(p):
    return not p[0].endswith(", no halves")


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
    test = points_of(out, "recorded")
    draft = lambda p: over_scenes(p, "worst", max) <= 2
    rows = []
    people = points_of(out, "people") if "people" in out["sets"] else []
    against = lambda p: over_scenes(p, "early", mean) <= 0.05
    for points, purpose, holds, allowed, us in (
            (people, "against people: at most 5 % of the blocks early", against, with_halves, None),
            (people, "the same, no half buffers", against, without_halves(out), None),
            (test, "a draft: no block shows more than twice what is just visible", draft, with_halves, None),
            (test, "a final frame: at most 5 % of the blocks early, 10 % noisy, the median scene's worst at what is just visible", final, with_halves, None),
            (test, "the same, a cheap scene (0.05 µs per path)", final, with_halves, 0.05),
            (test, "the same, a slow renderer (20 µs per path)", final, with_halves, 20),
            (test, "the same, no half buffers", final, without_halves(out), None),
            (test, "the same, nothing but the colour", final, lambda p: without_halves(out)(p) and not p[0].startswith("variance"), None)):
        found = best(points, holds, allowed, us)
        if not found:
            rows.append([purpose, "none of those measured", "–", "–", "–", "–"])
            continue
        cost, p = found
        rows.append([purpose, "`%s`, %s %g" % (p[0], p[1], p[2]), figure(cost), percent(over_scenes(p, "noisy", mean)),
                     percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst"))])
    return table(["for", "setting", "time / limit", "noisy", "early", "worst"], rows)


def early_table(out):
    return table(["stopped by", "scene", "block", "stop", "of what is visible", "`observer`'s stop", "threshold", "last level"],
                 [[e["criterion"], e["scene"], "%d" % e["block"], "%d" % e["stop"], figure(math.sqrt(e["threshold"] / e["stop"])) + " ×",
                   "%d" % e["observer"], figure(e["threshold"], "%.0f"), "%d" % e["last"]] for e in out["early"]])


def worst_table(out):
    """Where each default fails: the scene on which it leaves most noise, and the one on which it wastes most."""
    rows = []
    for p in points_of(out, "test"):
        if not is_default(p) or p[0] in ("uniform", "limit") or p[0].startswith("window") or p[0].endswith((" bf16", ", no halves")):
            continue
        early = max(p[3].items(), key=lambda s: s[1]["worst"])
        late = max(p[3].items(), key=lambda s: s[1]["to_limit"])
        rows.append([p[0], "%s: %s × what is visible, %s early" % (early[0], figure(early[1]["worst"]), percent(early[1]["early"])),
                     "%s: %s × the time of the limit" % (late[0], figure(late[1]["to_limit"]))])
    return table(["default of", "leaves most noise on", "wastes most on"], rows)


def early_pair(a, b):
    tell = lambda p: "early %s, worst %s, samples %s" % (percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")),
                                                        figure(over_scenes(p, "samples"), "%.0f"))
    return [tell(a), tell(b)]


def guards_of_criteria(out):
    """Guards that are parameters: the same replay with and without."""
    rows, points, network = [], points_of(out, "test"), default_network(out)
    for criterion, without in (("variance", "variance, no guard"), ("halfbuf", "halfbuf, no guard")):
        a = find(points, criterion)
        b = next((p for p in points if a and p[0] == without and p[2] == a[2]), None)
        if b:
            rows.append(["rare bright paths, `%s` (parameter)" % criterion, "no pixel may hang on few samples"] + early_pair(a, b))
    own = find(points, network)
    for dial, value, case, guard in (("guard", 0, "rare bright paths, network", "tail and Gini of the half-buffer difference"),
                                     ("passes", 1, "one lucky check, network", "two checks in a row")):
        b = next((p for p in points if p[0] == network and p[1] == dial and p[2] == value), None)
        if own and b:
            rows.append([case, guard] + early_pair(own, b))
    return rows


def guards_table(out):
    return table(["case", "guard", "with it", "without"],
                 guards_of_criteria(out) + [["%s (`%s`)" % (g["case"], g["test"]), g["guard"], g["with"], g["without"]] for g in out.get("guards", [])])


def decisions_table(out):
    rows = [[r["name"], "%d of %d" % (r["windows"] - r["same_bytes"], r["windows"]), "%.1e" % r["p_most"], "%.1e" % r["p_median"], "%d of %d" % (r["verdicts"], r["windows"]),
             "%d of %d" % (r["stops"], r["blocks"])] for r in out.get("decisions", {}).get("rows", [])]
    return table(["against float, AVX-512, -O3", "windows whose p moves", "at most by", "median", "verdicts changed", "stops changed"], rows)


def golden_table(out):
    return table(["in p", "moved at most", "windows"], [[g["name"], "%.1e" % g["p_moved"], str(g["windows"])] for g in out.get("golden", [])])


def images_table(out):
    return table(["against -O3, one thread", "pictures changed"], [[i["name"], "%d of %d" % (i["changed"], i["pictures"])] for i in out.get("images", [])])
