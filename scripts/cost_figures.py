"""Figures and pictures of docs/cost.md from what scripts/cost measured (docs/cost.json)."""
import math
import os
import statistics
import subprocess

# Where a setting is what a user gets who says nothing else; of models that are named otherwise: their own.
DEFAULTS = {"observer": ("visible", 0.25), "variance": ("threshold", 0.03), "halfbuf": ("threshold", 0.004)}
DRAWN = ("uniform", "variance", "halfbuf", "observer", "lull-1.ggn", "svd-entropy", "attributes", "noise-mask")
COLOURS = {"uniform": "#999999", "variance": "#8c564b", "halfbuf": "#e377c2", "observer": "#d62728", "lull-1.ggn": "#1f77b4",
           "svd-entropy": "#2ca02c", "attributes": "#bcbd22", "noise-mask": "#17becf"}
DENOISER = 0.41  # of one full check of the network: 1.58 of 3.89 GMAC; the first window denoises six images, not one
BLOCK = 200 * 200


def median(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.median(values) if values else math.nan


def mean(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.fmean(values) if values else math.nan


def price_of(out, criterion):
    prices = out.get("prices", {})
    name = criterion.replace(", no guard", "")
    return prices.get(name, {"check_s": 0.0})["check_s"] if name != "limit" else 0.0


def points_of(out, name):
    """[(criterion, dial, value, {scene: figures})] with what the checks cost: check_s, total_s, overhead, total_ratio, and
    to_limit, the time against that of stopping every block exactly at its threshold."""
    data = out["sets"][name]
    limit = next(p for p in data["points"] if p["criterion"] == "limit")["scenes"]
    points = []
    for p in data["points"]:
        full = price_of(out, p["criterion"])
        cheap = price_of(out, "variance")
        network = p["criterion"].endswith(".ggn")
        scenes = {}
        for scene, f in p["scenes"].items():
            f = dict(f)
            f["check_s"] = f["checks_full"] * full + f["checks_cheap"] * cheap
            if network and f["checks_full"] > 0:
                f["check_s"] += 5 * DENOISER * full
            if f["sampling_s"]:
                f["total_s"] = f["sampling_s"] + f["check_s"]
                f["overhead"] = f["check_s"] / f["total_s"]
                f["total_ratio"] = f["time_ratio"] * f["total_s"] / f["sampling_s"]
                f["to_limit"] = f["total_s"] / limit[scene]["sampling_s"]
            else:  # recorded without times: samples stand for them, and checks are free
                f["total_s"], f["overhead"], f["total_ratio"] = f["samples"], 0.0, f["samples_ratio"]
                f["to_limit"] = f["samples"] / limit[scene]["samples"]
            f["limit"] = limit[scene]["time_ratio"] if f["sampling_s"] else limit[scene]["samples_ratio"]
            scenes[scene] = f
        points.append((p["criterion"], p["dial"], p["value"], scenes))
    return points


def is_default(point):
    criterion, dial, value, _ = point
    wanted = DEFAULTS.get(criterion)
    return (dial, value) == wanted if wanted else dial == "own"


def over_scenes(point, key, how=median):
    return how([f.get(key) for f in point[3].values()])


# --- pictures ---------------------------------------------------------------------------------------------------------------


def plot(folder, name, size, script):
    path = os.path.join(folder, name)
    head = ("set encoding utf8\nset terminal pngcairo size %d,%d noenhanced font 'sans,11' background '#ffffff'\nset output '%s'\n"
            "set border lc '#444444'\nset grid lc '#dddddd'\nset key noenhanced\nset datafile missing 'nan'\n" % (*size, path + ".tmp"))
    done = subprocess.run(["gnuplot"], input=head + script, text=True, capture_output=True)
    if done.returncode:
        raise SystemExit("cost: %s: %s" % (name, done.stderr.strip()[-500:]))
    os.replace(path + ".tmp", path)


def curves(points, x, y, dials=("visible", "threshold", "spp"), how=median):
    """gnuplot data blocks and their plot clauses: a line for each criterion over its dial, its default as a filled point."""
    blocks, clauses = [], []
    for criterion in DRAWN:
        mine = [p for p in points if p[0] == criterion and p[1] in dials and p[3]]
        if not mine:
            continue
        name = "$d%d" % len(blocks)
        rows = "\n".join("%g %g" % (over_scenes(p, x), over_scenes(p, y, how)) for p in mine)
        blocks.append("%s << E\n%s\nE\n" % (name, rows))
        clauses.append("%s using 1:2 with linespoints pt 6 ps 0.6 lw 2 lc '%s' title '%s'" % (name, COLOURS[criterion], criterion))
        for p in points:
            if p[0] == criterion and is_default(p):
                blocks.append("$s%d << E\n%g %g\nE\n" % (len(blocks), over_scenes(p, x), over_scenes(p, y, how)))
                clauses.append("$s%d using 1:2 with points pt 7 ps 1.6 lc '%s' notitle" % (len(blocks) - 1, COLOURS[criterion]))
    return "".join(blocks), clauses


def draw_frontiers(folder, points, name, x, title):
    limit = [p for p in points if p[0] == "limit"]
    script = "set multiplot layout 1,2\nset logscale x\nset xlabel '%s'\n" % title
    for y, label, how in (("noisy", "share of blocks that still show noise", mean), ("worst", "visible difference of the worst block", median)):
        blocks, clauses = curves(points, x, y, how=how)
        at = "set arrow 1 from 1,graph 0 to 1,graph 1 nohead dt 2 lc '#000000'\n" if limit else ""
        scale = "set logscale y\nset yrange [0.3:10]\n" if y == "worst" else "set yrange [0:1]\n"
        script += ("%s%s%sset ylabel '%s'\nset xrange [0.2:30]\nset label 1 'the limit' at 1,graph 0.97 offset 0.5,0\nplot %s\n"
                   % (blocks, at, scale, label, ", ".join(clauses)))
    plot(folder, name, (1200, 480), script + "unset multiplot\n")


def draw_ratio(folder, points):
    blocks, clauses = curves([p for p in points if p[0] != "uniform"], "worst", "total_ratio")
    limit = next(p for p in points if p[0] == "limit")
    script = ("%sset logscale xy\nset xlabel 'visible difference of the worst block (1: just visible)'\n"
              "set ylabel 'time against uniform samples of the same worst block'\nset xrange [0.3:10]\n"
              "set arrow 1 from graph 0,first %g to graph 1,first %g nohead dt 2 lc '#000000'\n"
              "set label 1 'limit: mean(T)/max(T)' at graph 0.02,first %g offset 0,0.6\n"
              "set arrow 2 from graph 0,first 1 to graph 1,first 1 nohead lc '#aaaaaa'\nplot %s\n"
              % (blocks, *[over_scenes(limit, "limit")] * 3, ", ".join(clauses)))
    plot(folder, "cost-ratio.png", (760, 520), script)


def saving(p):
    """Checks' thread seconds per block at this setting, and samples per pixel saved against uniform of the same worst block."""
    spent = median([f["check_s"] for f in p[3].values()])
    saved = median([f["uniform_spp"] - f["samples"] for f in p[3].values()])
    return spent, saved


def draw_paths(folder, points):
    blocks, clauses = "", []
    for p in points:
        if p[0] not in DRAWN or not is_default(p) or p[0] == "uniform":
            continue
        spent, samples = median([f["check_s"] for f in p[3].values()]), over_scenes(p, "samples")
        rows = "\n".join("%g %g" % (us, spent / (spent + samples * BLOCK * us * 1e-6)) for us in (0.05 * 1.6**i for i in range(18)))
        name = "$d%d" % len(clauses)
        blocks += "%s << E\n%s\nE\n" % (name, rows)
        clauses.append("%s using 1:2 with lines lw 2 lc '%s' title '%s'" % (name, COLOURS[p[0]], p[0]))
    script = ("%sset logscale xy\nset xlabel 'microseconds per path and thread'\nset ylabel 'share of the time that the checks take'\n"
              "set xrange [0.05:150]\nset yrange [1e-5:1]\n"
              "set arrow 1 from graph 0,first 0.01 to graph 1,first 0.01 nohead dt 2 lc '#000000'\n"
              "set label 1 'wanted: 1 %%' at graph 0.98,first 0.013 right\nplot %s\n" % (blocks, ", ".join(clauses)))
    plot(folder, "cost-path.png", (760, 520), script)


def draw_growth(folder, out):
    rows = [g for g in out.get("growth", []) if g["threads"] == 1]
    if not rows:
        return
    data = "\n".join("%d %g %g" % (g["blocks"], g["criterion_s"], g["sampling_s"]) for g in rows)
    plot(folder, "cost-growth.png", (700, 460),
         "$d << E\n%s\nE\nset logscale xy\nset xlabel 'blocks of 100x100 pixels'\nset ylabel 'thread seconds'\nset key left\n"
         "plot $d using 1:3 with linespoints pt 6 lw 2 lc '#999999' title 'sampling, 20 spp', "
         "$d using 1:2 with linespoints pt 7 lw 2 lc '#d62728' title 'checks of observer'\n" % data)


def draw(folder, out):
    if "test" in out.get("sets", {}):
        points = points_of(out, "test")
        draw_frontiers(folder, points, "cost-frontier.png", "to_limit", "time, checks included, against stopping every block exactly at its threshold")
        draw_ratio(folder, points)
        draw_paths(folder, points)
    if "people" in out.get("sets", {}):
        draw_frontiers(folder, points_of(out, "people"), "cost-people.png", "to_limit", "time, checks included, against stopping at the thresholds that people gave")
    draw_growth(folder, out)


def on_frontier(points, default):
    """Scenes on which no setting of another criterion is cheaper and as accurate in every column, of how many; and who is."""
    good, beaten = 0, {}
    for scene, f in default[3].items():
        by = [p for p in points if p[0] not in ("limit", default[0]) and scene in p[3] and p[3][scene]["total_s"] < 0.99 * f["total_s"]
              and p[3][scene]["worst"] <= f["worst"] and p[3][scene]["noisy"] <= f["noisy"]]
        good += not by
        if by:
            beaten[scene] = min(by, key=lambda p: p[3][scene]["total_s"])
    return good, len(default[3]), beaten


def find(points, criterion):
    return next((p for p in points if p[0] == criterion and is_default(p)), None)
