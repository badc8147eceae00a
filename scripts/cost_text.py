"""The text of docs/cost.md: tables from docs/cost.json (scripts/cost), and what to choose."""
import math

from cost_figures import BLOCK, SIDES, at_path_cost, find, is_default, limits_by_side, mean, median, on_frontier, over_scenes, points_in, points_of, saving


def table(heads, rows):
    return "\n".join(["| %s |" % " | ".join(heads), "|%s" % ("---|" * len(heads))] + ["| %s |" % " | ".join(r) for r in rows]) + "\n"


def figure(value, form="%.2f"):
    return form % value if value is not None and math.isfinite(value) else "–"


def percent(value):
    return figure(100 * value, "%.0f %%") if value is not None else "–"


def shipped(out):
    """The network that is the default."""
    return next(iter(out["networks"]))


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


def real_text(out):
    rows = out.get("real", [])
    if not rows:
        return ""
    replayed = [r for r in rows if r["replayed"]]
    near = sum(abs(r["stop"] / r["replayed"] - 1) <= 0.1 for r in replayed)
    unexplained = sum(real_why(r) == "not explained" for r in replayed)
    soon = ["%s %d at %d of %.0f" % (r["scene"], r["block"], r["stop"], r["threshold"]) for r in rows
            if (r["criterion"], r["params"]) == ("observer", "visible=0.25") and r["stop"] < 0.8 * r["threshold"]]
    early = (" Early at the default: %s: where few of a rare path's lights are met yet, the halves say less noise than there is, which simulated levels, made as "
             "Gaussian noise of the late halves, cannot show." % "; ".join(soon)) if soon else ""
    timed = [r["sampling_s"] / (1e-6 * r["recorded_us"] * r["stop"] * BLOCK) for r in rows]
    return ("Recorded blocks rendered again with the same random numbers (`scripts/cost --only real`, at revision %s: the same numbers make the same picture only while the renderer "
            "draws them for the same choices), against what the recorded levels alone say (\"replayed\"): %d of %d stops "
            "within 10 %%, %d beyond that are not explained by where the two ask. `variance` never stops before its first check, which the replay has at the first recorded "
            "level at which a window would end. Thread seconds per sample against those of the recording: median %s, %s to %s, %d of %d within 10 %% "
            "(both on a machine that other programs shared).%s\n\n"
            % (out.get("real_revision", "?"), near, len(replayed), unexplained, figure(median(timed)), figure(min(timed)), figure(max(timed)), sum(abs(t - 1) <= 0.1 for t in timed), len(timed), early))


def setting_rows(points, criteria, dials=("visible", "threshold", "own", "spp")):
    return [row_of(p) for c in criteria for p in points if p[0] == c and p[3]
            and (is_default(p) or (p[1] in dials and p[2] in NAMED and not c.endswith(" bf16") and (c != "fixed" or p[2] == 1024)))]


NAMED = {0.5, 0.1, 0.02, 0.113, 0.0075, 0.0015, 64, 256, 1024, 4096}
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
    scenes = out["sets"]["test"]["scenes"]
    blocks = [b for s in scenes.values() for b in s["blocks"]]
    spp = {int(k): n for k, n in out.get("references", {}).items()}
    told = ", ".join("%d of %s" % (n, "{:,}".format(k)) for k, n in sorted(spp.items()) if k)
    recorded = [b["cap"] for s in out["sets"].get("recorded", {"scenes": {}})["scenes"].values() for b in s["blocks"]]
    return ("%d blocks of %d test scenes of `scripts/dataset.plan`, %d of the scenes by other hands (`../shared/scenes`). References: %s samples per pixel of an independent one "
            "(8,192 were wanted); the other %d blocks are compared (FLIP) with the mean of their own full level, from which their simulated levels were made; relMSE is the variance "
            "that their two halves show. Recordings end at %s to %s samples; thresholds come from the halves too, up to 10,000.\n"
            % (len(blocks), len(scenes), out.get("foreign", 0), told or "none with any", spp.get(0, 0), "{:,.0f}".format(min(recorded, default=math.nan)),
               "{:,.0f}".format(max(recorded, default=math.nan))))


def prices_table(out):
    rows = [[name, figure(1e3 * p["check_s"], "%.2f"), figure(1e3 * p["most_s"], "%.2f") if "most_s" in p else "–",
             figure(1e6 * p["check_s"] / BLOCK, "%.3f")] for name, p in out.get("prices", {}).items() if name != "uniform"]
    return table(["criterion", "ms a check of 200×200 pixels", "most of the rounds", "as µs per pixel: a path that takes this long costs as much"], rows)


def bf16_text(out):
    """What bfloat16 products cost, and why not the same everywhere."""
    rows = [[b["name"], figure(out.get("networks", {}).get(b["name"], {}).get("macs", math.nan) / 1e9), figure(b["f32_ms"], "%.1f"), figure(b["bf16_ms"], "%.1f"),
             figure(b["bf16_ms"] / b["f32_ms"])] for b in out.get("bench", [])]
    return ("\nA decision alone, float and bfloat16 in turns on one thread (`ggn bench`). bfloat16 makes every 3×3 convolution direct; float uses Winograd's algorithm where a layer "
            "has enough channels, which few layers of the shipped networks have and most of the published ones, so that what rounding gains depends on the widths. (The bfloat16 rows above are those of float times this ratio.)\n\n"
            + table(["networks", "GMAC", "float, ms", "bfloat16, ms", "ratio"], rows)) if rows else ""


def dial_row(p, label):
    return [label, figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")), percent(over_scenes(p, "noisy", mean)),
            percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")), figure(mean([f["checks_full"] for f in p[3].values()]), "%.1f"),
            figure(mean([f["checks_cheap"] for f in p[3].values()]), "%.1f")]


DIAL_HEADS = ["setting", "samples", "time / limit", "noisy", "early", "worst", "asked", "spared by the gate"]


def dial_table(points, criterion):
    return table(DIAL_HEADS, [dial_row(p, "as shipped" if p[1] == "own" else "%s %g" % (p[1], p[2])) for p in points
                              if p[0] == criterion and p[1] in ("own", "passes", "gate", "guard", "growth")])


def passes_table(points):
    return table(DIAL_HEADS, [dial_row(p, "%s, passes %g" % (p[0], p[2])) for p in points if p[0] in BASELINES and p[1] == "passes"])


BASELINES = ("svd-entropy", "attributes", "noise-mask")


def networks_table(out, points):
    rows = []
    for name, n in out.get("networks", {}).items():
        p = find(points, name)
        if p:
            rows.append([name, n["preset"], "%d" % n["window"], "yes" if n["picture"] else "no", figure(n["macs"] / 1e9), figure(over_scenes(p, "samples"), "%.0f"),
                         figure(over_scenes(p, "to_limit")), percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")),
                         figure(100 * over_scenes(p, "overhead"), "%.2f %%")])
    return table(["network", "preset", "images in its window", "noise picture", "GMAC a decision", "samples", "time / limit", "early", "worst", "checks' share"], rows)


def cadence_table(out):
    rows = []
    sets = {ratio: points_in(out, data) for ratio, data in out.get("cadence", {}).items()}
    for criterion in ("observer", "variance", "halfbuf", shipped(out), *BASELINES):
        for ratio, points in sets.items():
            p = next((p for p in points if p[0] == criterion), None)
            if p:
                rows.append([criterion, ratio, figure(over_scenes(p, "samples"), "%.0f"), figure(over_scenes(p, "to_limit")), percent(over_scenes(p, "early", mean)),
                             figure(over_scenes(p, "worst")), figure(mean([f["checks_full"] + f["checks_cheap"] for f in p[3].values()]), "%.1f"),
                             figure(100 * over_scenes(p, "overhead"), "%.2f %%")])
    blocks = sum(len(s["blocks"]) for data in list(out.get("cadence", {}).values())[:1] for s in data["scenes"].values())
    return ("%d of the test blocks, one or two of each scene; levels made from the halves at every ratio alike, up to 10,000 samples. `observer` asks at counts of its own and at most this far "
            "apart (its parameter `growth`, 1.5 by default); the windows of the networks and of svd-entropy span more samples the further their images lie apart.\n\n" % blocks
            + table(["criterion", "ratio", "samples", "time / limit", "early", "worst", "checks", "checks' share"], rows))


def growth_table(out):
    rows = [[g["criterion"], "%d²" % g["side"], "%d" % g["threads"], "%d" % g["blocks"], "%d" % g["checks"], figure(1e3 * g["criterion_s"] / max(1, g["checks"]), "%.2f"),
             figure(g["criterion_s"], "%.3f"), figure(g["sampling_s"]), figure(1e6 * g["sampling_s"] / g["side"]**2 / g["spp"], "%.2f"),
             figure(g["render_wall_s"]), figure(g["peak_mb"], "%.0f") if g["peak_mb"] else "–"] for g in out.get("growth", [])]
    return table(["criterion", "pixels", "threads", "blocks", "checks", "ms a check", "checks, thread s", "sampling, thread s", "µs per path", "wall s", "memory at its peak, MB"], rows)


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


def guards_of_criteria(points, network):
    """Guards that are parameters: the same replay with and without."""
    rows = []
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


def early_pair(a, b):
    tell = lambda p: "early %s, worst %s, samples %s" % (percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "worst")),
                                                        figure(over_scenes(p, "samples"), "%.0f"))
    return [tell(a), tell(b)]


def decisions_table(out):
    rows = [[r["name"], "%d of %d" % (r["windows"] - r["same_bytes"], r["windows"]), "%.1e" % r["p_most"], "%.1e" % r["p_median"], "%d of %d" % (r["verdicts"], r["windows"]),
             "%d of %d" % (r["stops"], r["blocks"])] for r in out.get("decisions", {}).get("rows", [])]
    return table(["against float, AVX-512, -O3", "windows whose p moves", "at most by", "median", "verdicts changed", "stops changed"], rows)


def precision(out, points):
    text = ("\n## Precision and stability\n\nWhat number formats, instruction sets, threads and compilers change. In p and in decisions of %s, the shipped network, on recorded levels of "
            "the test blocks (a verdict: p of a window on one side of the threshold or the other):\n\n" % out.get("decisions", {}).get("model", "the network"))
    text += decisions_table(out)
    text += ("\nWhat has no row (instruction sets, flush-to-zero, -O levels) was not measured in this run. The baseline has direct convolution, AVX-512 and AVX2 Winograd's, AVX2 in layers of fewer channels and tiles, too; its row above was measured when it had direct convolution. Flush-to-zero is switched on for the whole process, as a host with `-ffast-math` "
             "does at loading; `lull-check` holds every criterion to the same answer then (check `fp`). Number of threads and batch change nothing by construction; "
             "stops of render and replay agree one by one (`tests/e2e/ggn_replay.sh`).\n\nThe published networks at their own widths, four golden windows against double (`ggn golden`):\n\n")
    text += table(["in p", "moved at most", "windows"], [[g["name"], "%.1e" % g["p_moved"], str(g["windows"])] for g in out.get("golden", [])])
    text += "\nIn images (pixels of the EXR files of small renders with a criterion):\n\n"
    text += table(["against -O3, one thread", "pictures changed"], [[i["name"], "%d of %d" % (i["changed"], i["pictures"])] for i in out.get("images", [])])
    text += ("\nWhich hard cases would fail without the measure that guards them. The first rows are parameters, replayed on the test blocks above; the others are taken out of a copy of the "
             "tree (`scripts/guards`), where the named test fails without them.\n\n")
    rows = guards_of_criteria(points, shipped(out)) + [["%s (`%s`)" % (g["case"], g["test"]), g["guard"], g["with"], g["without"]] for g in out.get("guards", [])]
    return text + table(["case", "guard", "with it", "without"], rows)


MISSING = """
## Not measured

- The published GGN preset at its own widths: no published weights run here, and training it takes longer than a page may. `paper.ggn` is a narrow stub, the published form and procedure at the shipped
  network's widths after a few minutes of training; its row says what such a network is worth, not what theirs is.
- References of 8,192 samples. Film planes in half floats: the film has none; the recordings' half buffers are half floats, so that a replay's stop against the real one (Real renders) includes them.
- `variance` and `halfbuf` are asked at the recorded levels here, in a renderer at sample counts of their own.
- `attributes` and the other baselines were trained by `ggn baseline` on our training scenes, on fewer blocks than the network.
- Scenes with one block say nothing about the limit (it is 1 there) and are left out where that matters.
"""


def page(out):
    text = INTRO % out
    test = points_of(out, "test")
    mine, networks = shipped(out), [n for n in out["networks"] if not n.startswith("window")]
    criteria = ("uniform", "fixed", "variance", "halfbuf", "variance, no guard", "halfbuf, no guard", "observer", mine, mine + ", no halves", mine + " bf16",
                *networks[1:], *BASELINES)
    shown = lambda points: table(HEADS, [row_of(p) for p in points if p[0] == "limit"] + setting_rows(points, criteria))
    commits = ", ".join("%s of %s" % (n, c) for n, c in out.get("commits", {}).items() if c)
    text += "\n" + references(out) + ("\nNetworks as committed: %s; one that was trained anew since then is not in these figures until `make cost` runs again.\n" % commits if commits else "") + "\n## The frontier\n\n![](cost-frontier.png)\n\nMedians over scenes (noisy, early, FLIP: means); filled points are defaults.\n\n"
    text += shown(test) + CIRCLE + scenes_table(out, test)
    if "recorded" in out["sets"]:
        recorded = points_of(out, "recorded")
        blocks = sum(len(s["blocks"]) for s in out["sets"]["recorded"]["scenes"].values())
        text += ("\n### Recorded levels only\n\nNothing simulated: the %d blocks whose noise stops being visible before their recording ends, each level with the halves it really had. "
                 "Other criteria than uniform can spend no more than was recorded here.\n\n![](cost-recorded.png)\n\n" % blocks + shown(recorded))
    text += "\n### What was wanted\n\n" + wanted_table(out)
    text += "\n![](cost-ratio.png)\n" + choice(out)
    text += "\n## What a decision costs, and what it saves\n\n" + prices_table(out) + bf16_text(out) + "\n![](cost-path.png)\n\n" + breakeven_table(test, networks) + pays_table(out, points_of(out, "recorded"))
    text += "\n## Dials\n\n### Passes, gate, guard, growth\n\n%s:\n\n" % mine + dial_table(test, mine) + "\nThe baselines:\n\n" + passes_table(test)
    text += "\n`observer`, by the largest ratio of samples between two checks:\n\n" + dial_table(test, "observer")
    text += "\n### Windows and widths\n\nwindow-3 and window-6 are one recipe with windows of three and of six images (`scripts/ablate`); of these only lull-* are shipped. %s\n\n" % ("Recorded levels, some blocks of every scene." if "few" in out["sets"] else "The blocks of the first table.")
    text += networks_table(out, points_of(out, "few" if "few" in out["sets"] else "test"))
    text += "\n### Cadence\n\n" + cadence_table(out) if "cadence" in out else "\n### Cadence\n\nNot measured in this run but by the growth of `observer` above (`scripts/cost --only cadence`).\n"
    text += ("\n### Block size\n\nBy the observer's thresholds of the blocks' parts; 400 pixels from four neighbours that were recorded alike, which whole views have and the test blocks, "
             "which lie here and there, have not.\n\n" + sizes_table(out) + "\nWhat a check of such blocks costs (a network's tile is 200×200: smaller blocks are continued to it):\n\n" + sides_table(out))
    if "people" in out["sets"]:
        text += people_text(out) + shown(points_of(out, "people"))
    text += "\n## With resolution and threads\n\n" + growth_table(out) + growth_text(out) + "\n![](cost-growth.png)\n"
    text += "\n## Real renders\n\n" + real_text(out) + real_table(out) + MISSING + precision(out, test)
    return text


def people_text(out):
    scenes = out["sets"]["people"]["scenes"]
    blocks = sum(len(s["blocks"]) for s in scenes.values())
    published = [p for p in points_of(out, "people") if p[0].endswith("-thresholds.csv")]
    told = "; ".join("%s: %s early, %s of the limit's samples" % (p[0][:-len("-thresholds.csv")], percent(over_scenes(p, "early", mean)), figure(over_scenes(p, "to_limit")))
                     for p in published)
    return ("\n## Against people\n\n%d blocks of %d views; every view by an observer fitted to the others; levels simulated from the halves. Here the labels are not the observer's own, and the default is "
            "further from the limit (What was wanted): people's thresholds scatter by more than any rule knows, and the worst of a view's blocks decides. Early: below 0.8 of the threshold "
            "that people gave. Published thresholds of two earlier models, trained on some of these blocks, sampling alone: %s.\n\n![](cost-people.png)\n\n" % (blocks, len(scenes), told or "not here"))


def growth_text(out):
    rows = [g for g in out.get("growth", []) if g["criterion"] == "observer"]
    if len(rows) < 2:
        return ""
    a, b = rows[0], rows[-1]
    per = lambda g: 1e9 * g["criterion_s"] / g["checks"] * g["blocks"] / g["side"]**2
    twice = [(g, h) for g in rows for h in rows if g["side"] == h["side"] and (g["threads"], h["threads"]) == (1, 2)]
    text = "\nA check costs %s ns per pixel at %d² and %s at %d²: blocks are judged one by one, so that cost grows with the pixels alone." % (figure(per(a), "%.1f"), a["side"], figure(per(b), "%.1f"), b["side"])
    if twice:
        text += " Two threads take %s of the thread seconds of one for checks, %s for sampling (medians; what is above 1 is the machine's, which others shared)." % (
            figure(median([h["criterion_s"] / g["criterion_s"] for g, h in twice])), figure(median([h["sampling_s"] / g["sampling_s"] for g, h in twice])))
    return text + "\n"


def breakeven_table(points, networks):
    """Where the checks of a default cost as much as they save against uniform samples of the same worst block."""
    rows = []
    for p in points:
        if is_default(p) and p[0] in ("variance", "halfbuf", "observer", *networks, *BASELINES):
            spent, saved = saving(p)
            us = 1e6 * spent / (saved * BLOCK) if saved > 0 else math.nan
            samples = over_scenes(p, "samples")
            rows.append([p[0], figure(1e3 * spent, "%.1f"), figure(saved, "%.0f"), figure(us, "%.4f") if saved > 0 else "never",
                         figure(1e6 * spent * 99 / (samples * BLOCK), "%.3f")])
    return table(["default of", "checks of a block, ms", "samples per pixel saved against uniform (median)", "pays from, µs per path", "takes 1 % at, µs per path"], rows)


def pays_table(out, points):
    """The cheapest setting of each kind that is good enough for a final frame, if every path took so long."""
    networks = set(out.get("networks", {}))
    kinds = (("`observer`", lambda p: p[0] == "observer"), ("`variance`, `halfbuf`", lambda p: p[0].startswith(("variance", "halfbuf"))),
             ("a network", lambda p: p[0].replace(" bf16", "") in networks), ("a baseline", lambda p: p[0] in BASELINES), ("uniform", lambda p: p[0] in ("uniform", "fixed")))
    rows = []
    for us in (0.02, 0.1, 0.5, 1, 5, 20, 100):
        found = [best(points, final, allowed, us) for _, allowed in kinds]
        rows.append(["%g" % us] + [figure(f[0]) if f else "none is" for f in found])
    return ("\nTime against the limit of the cheapest setting of each kind that is good enough for a final frame (below), by what a path costs: where a network pays, and where cheap criteria "
            "are enough (recorded levels).\n\n" + table(["µs per path"] + [k for k, _ in kinds], rows))


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
    text = ("\n## What to choose\n\nThe cheapest of all settings that were measured (time: median over scenes, checks included), on the recorded levels alone, where every criterion sees what a "
            "renderer would show it; each is held to the same blocks that it is chosen on, so that the figures flatter the chosen one a little. The labels are the observer's own answer from "
            "all samples; against people it has no such advantage.\n\n")
    text += table(["for", "setting", "time / limit", "noisy", "early", "worst"], rows)
    return text + worst_table(points_of(out, "test")) + early_text(out)


def early_text(out):
    rows = [[e["criterion"], e["scene"], "%d" % e["block"], "%d" % e["stop"], figure(math.sqrt(e["threshold"] / e["stop"])) + " ×", "%d" % e["observer"], figure(e["threshold"], "%.0f"),
             "%d" % e["last"]] for e in out.get("early", [])]
    return ("\n![](cost-early.png)\n\nRecorded blocks as they were stopped, row by row as in the table: of each the 50×50 pixels that differ most, four times as large, as displayed; left at the criterion's stop, in the middle at that of `observer`, "
            "right the last level. First a caustic, stopped without the guard: its specks are light that a rare path carries, and a mean over a block's pixels does not see them. Then the block that each default leaves noisiest, "
            "of those stopped early, another one each time.\n\n" + table(["stopped by", "scene", "block", "stop", "of what is visible", "`observer`'s stop", "threshold", "last level"], rows)) if rows else ""


def worst_table(points):
    """Where each default fails: the scene on which it leaves most noise, and the one on which it wastes most."""
    rows = []
    for p in points:
        if not is_default(p) or p[0] in ("uniform", "limit") or p[0].startswith("window") or p[0].endswith((" bf16", ", no halves")):
            continue
        early = max(p[3].items(), key=lambda s: s[1]["worst"])
        late = max(p[3].items(), key=lambda s: s[1]["to_limit"])
        rows.append([p[0], "%s: %s × what is visible, %s early" % (early[0], figure(early[1]["worst"]), percent(early[1]["early"])),
                     "%s: %s × the time of the limit" % (late[0], figure(late[1]["to_limit"]))])
    return "\nWhere each default fails:\n\n" + table(["default of", "leaves most noise on", "wastes most on"], rows)
