"""Tables and figures of docs/results/cost.md from what `lab cost` measured; the words are templates/results/cost.md."""
import math

from lablib import tool
from lablib.cost_figures import (BLOCK, find, is_default, limits_by_side, mean, median, on_frontier, over_scenes,
                                 points_in, points_of, saving)
from lablib.sources import EXAMPLES, JUDGE, NETWORK, OBSERVER, PICTURES
from lablib.tables import figure, percent, table

SOURCES = PICTURES + OBSERVER + NETWORK + EXAMPLES + JUDGE
NAMED = {0.5, 0.1, 0.02, 0.113, 0.0075, 0.0015, 64, 256, 1024, 4096}
BASELINES = ("svd-entropy", "attributes", "noise-mask")
# Columns of a setting over scenes: which figure, how it is summed up, and its form.
COLUMNS = {"samples": ("samples", median, "%.0f"), "time / limit": ("to_limit", median, "%.2f"), "time / uniform": ("total_ratio", median, "%.2f"),
           "noisy": ("noisy", mean, "%"), "early": ("early", mean, "%"), "worst": ("worst", median, "%.2f"), "FLIP": ("flip", mean, "%.3f"),
           "relMSE": ("relmse", median, "%.4f"), "checks' share": ("overhead", lambda v: 100 * median(v), "%.2f %%"),
           "asked": ("checks_full", mean, "%.1f"), "checks": ("checks_full", mean, "%.1f")}


def cell(p, column):
    key, how, form = COLUMNS[column]
    value = over_scenes(p, key, how)
    return percent(value) if form == "%" else figure(value, form)


def settings(heads, labelled, columns):
    """A table of settings: [(cells of its own, setting)], and the columns after them."""
    return table([*heads, *columns], [[*own, *[cell(p, c) for c in columns]] for own, p in labelled])


def records(rows, columns):
    """A table of figures that are kept row by row: {head: form of a row's figures}."""
    return table(list(columns), [[form % r for form in columns.values()] for r in rows])


def default_network(out):
    return next(iter(out["networks"]))


def networks(out):
    return [n for n in out["networks"] if not n.startswith("window")]


def has_windows(out):
    return any(n.startswith("window") for n in out["networks"])


def measured(out):
    """When, at which commit; of steps that were measured apart each by itself; says so if the observer has changed since."""
    sources = {}
    for step, m in out["measured"].items():
        law = "" if math.isclose(m["level"], tool.observer()["level"], rel_tol=1e-3) else ", an earlier observer whose default was `--visible %g`" % m["visible"]
        sources.setdefault("%s at commit %s on %s%s" % (m["date"], m["commit"], m["processor"], law), []).append(step)
    return ";\n".join(text if len(sources) == 1 else "%s: %s" % (", ".join(steps), text) for text, steps in sources.items())


def frontier(out, name):
    """The limit, and of every criterion its default and some other settings."""
    mine, others = default_network(out), networks(out)
    criteria = ("uniform", "fixed", "variance", "halfbuf", "variance, no guard", "halfbuf, no guard", "observer", "observer, no halves",
                mine, mine + ", no halves", *others[1:], *BASELINES)
    points = points_of(out, name)
    named = lambda p: p[1] in ("visible", "threshold", "own", "spp") and p[2] in NAMED and (p[0] != "fixed" or p[2] == 1024)
    chosen = [p for p in points if p[0] == "limit"] + [p for c in criteria for p in points if p[0] == c and p[3] and (is_default(p) or named(p))]
    label = lambda p: p[0] + ("" if is_default(p) or p[0] == "limit" else ", %s %g" % (p[1], p[2]))
    return settings(["setting"], [([label(p)], p) for p in chosen], ["samples", "time / limit", "time / uniform", "noisy", "early", "worst", "FLIP",
                                                                     "relMSE", "checks' share"])


def wanted_of(points):
    """Three figures of the default on a set, and who beats it where."""
    default = find(points, "observer")
    several = [f for f in default[3].values() if f["blocks"] > 1]
    slow = [f for f in default[3].values() if f["sampling_s"] and f["sampling_s"] / f["samples"] / BLOCK > 1e-6]
    good, n, beaten = on_frontier(points, default)
    figures = ["%s × (%d scenes with more than one block)" % (figure(median([f["total_ratio"] / f["limit"] for f in several])), len(several)),
               cell(default, "early"),
               "%d of %d" % (sum(f["overhead"] <= 0.01 for f in slow), len(slow)) if slow else "not timed", "%d of %d" % (good, n)]
    text = ["on %s `%s` (%s %g), in %s of the time" % (scene, p[0], p[1], p[2], figure(p[3][scene]["total_s"] / default[3][scene]["total_s"]))
            for scene, p in sorted(beaten.items())]
    return figures, text


def wanted_table(out):
    names = [("recorded", "test, recorded levels"), ("people", "people's views"), ("test", "test, simulated levels too")]
    names = [(n, t) for n, t in names if n in out["sets"] and find(points_of(out, n), "observer")]
    found = [wanted_of(points_of(out, n)) for n, _ in names]
    rows = ["time, checks included, against the limit at the same worst block, median of scenes (wanted ≤ 1.15)", "early stops",
            "scenes above 1 µs per path and thread on which the checks take ≤ 1 % (wanted: all)",
            "scenes on which no other setting is cheaper and as accurate (wanted 6 of 8)"]
    text = table(["the default, `observer`"] + [t for _, t in names], [[row] + [f[0][i] for f in found] for i, row in enumerate(rows)])
    for (_, title), (_, lines) in zip(names, found):
        if lines:
            text += "\nAs accurate for less, %s:\n\n%s" % (title, "".join("- %s\n" % line for line in lines))
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


def real_rows(out):
    again = lambda r: 1e-6 * r["recorded_us"] * r["stop"] * BLOCK
    return [dict(r, why=real_why(r), again=again(r), ratio=r["sampling_s"] / again(r), ms=1e3 * r["criterion_s"],
                 replay="%.0f" % r["replayed"] if r["replayed"] else "–") for r in out.get("real", [])]


def real_table(out):
    return records(real_rows(out), {
        "scene": "%(scene)s", "block": "%(block)d", "criterion": "%(criterion)s %(params)s", "stop": "%(stop)d", "replayed": "%(replay)s", "": "%(why)s",
        "threshold": "%(threshold).0f", "sampling, s": "%(sampling_s).2f", "as recorded, s": "%(again).2f", "ratio": "%(ratio).2f", "checks": "%(checks)d",
        "checks, ms": "%(ms).1f"})


def real(out):
    """Figures of what is said of the real renders."""
    rows = real_rows(out)
    ratios, replayed = [r["ratio"] for r in rows], [r for r in rows if r["replayed"]]
    default = "%s=%g" % tuple(out["defaults"]["observer"])
    return {"near": sum(abs(r["stop"] / r["replayed"] - 1) <= 0.1 for r in replayed), "replayed": len(replayed), "revision": out.get("real_revision", "?"),
            "unexplained": sum(r["why"] == "not explained" for r in replayed),
            "soon": "; ".join("%(scene)s %(block)d at %(stop)d of %(threshold).0f" % r for r in rows
                              if (r["criterion"], r["params"]) == ("observer", default) and r["stop"] < 0.8 * r["threshold"]),
            "median": figure(median(ratios)), "least": figure(min(ratios)), "most": figure(max(ratios)),
            "timed_near": sum(abs(t - 1) <= 0.1 for t in ratios), "timed": len(ratios)}


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
    rows = [{"name": name, "ms": 1e3 * p["check_s"], "most": figure(1e3 * p.get("most_s", math.nan)), "us": 1e6 * p["check_s"] / BLOCK}
            for name, p in out.get("prices", {}).items() if name != "uniform"]
    return records(rows, {"criterion": "%(name)s", "ms a check of 200×200 pixels": "%(ms).2f", "most of the rounds": "%(most)s",
                          "as µs per pixel: a path that takes this long costs as much": "%(us).3f"})


PARAMETERS = ["samples", "time / limit", "noisy", "early", "worst", "asked"]


def parameter_table(out, criterion):
    return settings(["setting"], [(["as shipped" if p[1] == "own" else "%s %g" % (p[1], p[2])], p) for p in points_of(out, "test")
                                  if p[0] == criterion and p[1] in ("own", "growth")], PARAMETERS)


def passes_table(out):
    return settings(["setting"], [(["%s, passes %g" % (p[0], p[2])], p) for p in points_of(out, "test") if p[0] in BASELINES and p[1] == "passes"],
                    PARAMETERS)


def networks_table(out):
    points = points_of(out, "few" if "few" in out["sets"] else "test")
    found = [(name, n, find(points, name)) for name, n in out["networks"].items() if find(points, name)]
    return settings(["network", "preset", "images in its window", "noise picture", "GMAC a decision"],
                    [([name, n["preset"], "%d" % n["window"], "yes" if n["picture"] else "no", figure(n["macs"] / 1e9)], p) for name, n, p in found],
                    ["samples", "time / limit", "early", "worst", "checks' share"])


def cadence_table(out):
    sets = {ratio: points_in(out, data) for ratio, data in out["cadence"].items()}
    first = lambda points, criterion: next((p for p in points if p[0] == criterion), None)
    return settings(["criterion", "ratio"], [([criterion, ratio], first(points, criterion))
                                             for criterion in ("observer", "variance", "halfbuf", default_network(out), *BASELINES)
                                             for ratio, points in sets.items() if first(points, criterion)],
                    ["samples", "time / limit", "early", "worst", "checks", "checks' share"])


def cadence_blocks(out):
    return sum(len(s["blocks"]) for s in next(iter(out["cadence"].values()))["scenes"].values())


def growth_table(out):
    rows = [dict(g, ms=1e3 * g["criterion_s"] / max(1, g["checks"]), us=1e6 * g["sampling_s"] / g["side"]**2 / g["spp"],
                 peak=figure(g["peak_mb"] or math.nan, "%.0f")) for g in out.get("growth", [])]
    return records(rows, {"criterion": "%(criterion)s", "pixels": "%(side)d²", "threads": "%(threads)d", "blocks": "%(blocks)d", "checks": "%(checks)d",
                          "ms a check": "%(ms).2f", "checks, thread s": "%(criterion_s).3f", "sampling, thread s": "%(sampling_s).2f",
                          "µs per path": "%(us).2f", "wall s": "%(render_wall_s).2f", "memory at its peak, MB": "%(peak)s"})


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
    return "; ".join("%s: %s early, %s of the limit's samples" % (p[0][:-len("-thresholds.csv")], cell(p, "early"), cell(p, "time / limit"))
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
             ("a network", lambda p: p[0] in networks), ("a baseline", lambda p: p[0] in BASELINES),
             ("uniform", lambda p: p[0] in ("uniform", "fixed")))
    rows = []
    for us in (0.02, 0.1, 0.5, 1, 5, 20, 100):
        found = [best(points, final, allowed, us) for _, allowed in kinds]
        rows.append(["%g" % us] + [figure(f[0]) if f else "none is" for f in found])
    return table(["µs per path"] + [k for k, _ in kinds], rows)


def final(p):
    return over_scenes(p, "early", mean) <= 0.05 and over_scenes(p, "noisy", mean) <= 0.1 and over_scenes(p, "worst") <= 1


def without_halves(out):
    """Settings for hosts without half buffers: `observer` looks twice there, a network by how the mean changes."""
    takes_halves = {"observer", *out.get("networks", {})}
    return lambda p: not p[0].startswith("halfbuf") and p[0] not in takes_halves


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
        rows.append([purpose, "`%s`, %s %g" % (p[0], p[1], p[2]), figure(cost), cell(p, "noisy"), cell(p, "early"), cell(p, "worst")])
    return table(["for", "setting", "time / limit", "noisy", "early", "worst"], rows)


def early_table(out):
    return records([dict(e, visible=math.sqrt(e["threshold"] / e["stop"])) for e in out["early"]],
                   {"stopped by": "%(criterion)s", "scene": "%(scene)s", "block": "%(block)d", "stop": "%(stop)d", "of what is visible": "%(visible).2f ×",
                    "`observer`'s stop": "%(observer)d", "threshold": "%(threshold).0f", "last level": "%(last)d"})


def worst_table(out):
    """Where each default fails: the scene on which it leaves most noise, and the one on which it wastes most."""
    rows = []
    for p in points_of(out, "test"):
        if not is_default(p) or p[0] in ("uniform", "limit") or p[0].startswith("window") or p[0].endswith(", no halves"):
            continue
        early = max(p[3].items(), key=lambda s: s[1]["worst"])
        late = max(p[3].items(), key=lambda s: s[1]["to_limit"])
        rows.append([p[0], "%s: %s × what is visible, %s early" % (early[0], figure(early[1]["worst"]), percent(early[1]["early"])),
                     "%s: %s × the time of the limit" % (late[0], figure(late[1]["to_limit"]))])
    return table(["default of", "leaves most noise on", "wastes most on"], rows)


def guards_table(out):
    """Guards that are parameters, the same replay with and without; those that were taken out of the tree."""
    points = points_of(out, "test")
    setting = lambda criterion, parameter, value: next((p for p in points if p[:3] == (criterion, parameter, value)), None)
    tell = lambda p: "early %s, worst %s, samples %s" % (cell(p, "early"), cell(p, "worst"), cell(p, "samples"))
    pairs = [("rare bright paths, `%s` (parameter)" % c, "no pixel may hang on few samples", find(points, c), setting(c + ", no guard", *out["defaults"][c]))
             for c in ("variance", "halfbuf")]
    return table(["case", "guard", "with it", "without"], [[case, guard, tell(a), tell(b)] for case, guard, a, b in pairs if a and b] + [
        ["%s (`%s`)" % (g["case"], g["test"]), g["guard"], g["with"], g["without"]] for g in out.get("guards", [])])


def decisions_table(out):
    rows = [dict(r, moved=r["windows"] - r["same_bytes"]) for r in out.get("decisions", {}).get("rows", [])]
    return records(rows, {"against float, AVX-512, -O3": "%(name)s", "windows whose p moves": "%(moved)d of %(windows)d", "at most by": "%(p_most).1e",
                          "median": "%(p_median).1e", "verdicts changed": "%(verdicts)d of %(windows)d", "stops changed": "%(stops)d of %(blocks)d"})


def golden_table(out):
    return records(out.get("golden", []), {"in p": "%(name)s", "moved at most": "%(p_moved).1e", "windows": "%(windows)d"})


def images_table(out):
    return records(out.get("images", []), {"against -O3, one thread": "%(name)s", "pictures changed": "%(changed)d of %(pictures)d"})
