"""Figures and pictures of docs/cost.md from what `lab cost` measured (docs/results/cost.json)."""
import math
import re
import statistics

from lablib.plots import data, plot

COLOURS = {"uniform": "#999999", "variance": "#8c564b", "halfbuf": "#e377c2", "observer": "#d62728", "lull": "#1f77b4", "paper.ggn": "#9467bd",
           "svd-entropy": "#2ca02c", "attributes": "#bcbd22", "noise-mask": "#ff7f0e"}
BLOCK = 200 * 200


def median(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.median(values) if values else math.nan


def mean(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.fmean(values) if values else math.nan


def bare(criterion):
    """Without what it went without."""
    return criterion.replace(", no guard", "").replace(", no halves", "")


def colour(criterion):
    """Of those that are drawn; the shipped network's has no version. None: not drawn."""
    return COLOURS.get(re.sub(r"^(lull)-\d+\.ggn$", r"\1", criterion))


def drawn(points):
    """The criteria of a picture, in the order of their colours."""
    order = list(COLOURS.values())
    return sorted({p[0] for p in points if colour(p[0])}, key=lambda c: order.index(colour(c)))


def price_of(out, criterion):
    prices = out.get("prices", {})
    name = bare(criterion)
    return prices.get(name, {"check_s": 0.0})["check_s"] if name != "limit" else 0.0


def points_of(out, name):
    return points_in(out, out["sets"][name])


def points_in(out, data):
    """[(criterion, parameter, value, {scene: figures}, whether it is what a user gets who says nothing else)] with what the checks
    cost: check_s, total_s, overhead, total_ratio, and to_limit, the time against that of stopping every block exactly at its threshold."""
    named = lambda scenes: {scene: dict(zip(data["keys"], f)) for scene, f in scenes.items()}
    limit = named(next(p for p in data["points"] if p["criterion"] == "limit")["scenes"])
    points = []
    for p in data["points"]:
        full = price_of(out, p["criterion"])
        network = out.get("networks", {}).get(bare(p["criterion"]))
        scenes = {}
        for scene, f in named(p["scenes"]).items():
            f["check_s"] = f["checks_full"] * full
            if network and f["checks_full"] > 0:  # a first window has all of its images denoised, later ones one
                f["check_s"] += (network["window"] - 1) * network["denoiser"] * full
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
        points.append((p["criterion"], p["dial"], p["value"], scenes, is_own(out, p["criterion"], p["dial"], p["value"])))
    return points


def is_own(out, criterion, dial, value):
    """Of criteria whose defaults the renderer told: those, with halves or without; of models: their own."""
    wanted = out["defaults"].get(criterion.replace(", no halves", ""))
    return [dial, value] == wanted if wanted else dial == "own"


def is_default(point):
    return point[4]


def over_scenes(point, key, how=median):
    return how([f.get(key) for f in point[3].values()])


# --- pictures ---------------------------------------------------------------------------------------------------------------


def curves(points, x, y, dials=("visible", "threshold", "spp"), how=median):
    """gnuplot data blocks and their plot clauses: a line for each criterion over its dial, its default as a filled point."""
    blocks, clauses = [], []
    for criterion in drawn(points):
        mine = [p for p in points if p[0] == criterion and p[1] in dials and p[3]]
        if not mine:
            continue
        name = "d%d" % len(blocks)
        blocks.append(data(name, [(over_scenes(p, x), over_scenes(p, y, how)) for p in mine]))
        clauses.append("$%s using 1:2 with linespoints pt 6 ps 0.6 lw 2 lc '%s' title '%s'" % (name, colour(criterion), criterion))
        for p in points:
            if p[0] == criterion and is_default(p):
                blocks.append(data("s%d" % len(blocks), [(over_scenes(p, x), over_scenes(p, y, how))]))
                clauses.append("$s%d using 1:2 with points pt 7 ps 1.6 lc '%s' notitle" % (len(blocks) - 1, colour(criterion)))
    return "".join(blocks), clauses


PANELS = {"noisy": ("share of blocks that still show noise", mean, "unset logscale y\nset yrange [0:1]\n"),
          "early": ("share of blocks stopped early, below 0.8 of the threshold", mean, "unset logscale y\nset yrange [0:1]\n"),
          "worst": ("visible difference of the worst block", median, "set logscale y\nset yrange [0.1:10]\n"),
          "flip": ("mean FLIP", mean, "unset logscale y\nset yrange [0:*]\n"),
          "relmse": ("relMSE", median, "set logscale y\nset yrange [1e-6:*]\n")}


def draw_frontiers(folder, points, name, x, title, panels):
    rows = (len(panels) + 1) // 2
    script = "set multiplot layout %d,2\nset logscale x\nset xlabel '%s'\nset xrange [0.1:40]\n" % (rows, title)
    for number, y in enumerate(panels):
        label, how, scale = PANELS[y]
        blocks, clauses = curves(points, x, y, how=how)
        script += ("%s%sset ylabel '%s'\n%sset arrow 1 from 1,graph 0 to 1,graph 1 nohead dt 2 lc '#000000'\n"
                   "set label 1 'the limit' at 1,graph 0.96 offset 0.5,0\nplot %s\n"
                   % (blocks, scale, label, "unset key\n" if number else "set key top right samplen 2\n", ", ".join(clauses)))
    plot(folder, name, (1280, 480 * rows), script + "unset multiplot\n")


def draw_ratio(folder, points):
    points = [(*p[:3], {scene: f for scene, f in p[3].items() if f["blocks"] > 1}, p[4]) for p in points]  # alone, a block is its own uniform
    blocks, clauses = curves([p for p in points if p[0] != "uniform"], "worst", "total_ratio")
    limit = next(p for p in points if p[0] == "limit")
    script = ("%sset logscale xy\nset xlabel 'visible difference of the worst block (1: just visible)'\n"
              "set ylabel 'time against uniform samples of the same worst block'\nset xrange [0.2:10]\nset yrange [0.2:10]\n"
              "set arrow 1 from graph 0,first %g to graph 1,first %g nohead dt 2 lc '#000000'\n"
              "set label 1 'limit: mean(T)/max(T)' at graph 0.02,first %g offset 0,-0.8\n"
              "set arrow 2 from graph 0,first 1 to graph 1,first 1 nohead lc '#aaaaaa'\nplot %s\n"
              % (blocks, *[over_scenes(limit, "limit")] * 3, ", ".join(clauses)))
    plot(folder, "cost-ratio.png", (760, 520), script)


def saving(p):
    """Checks' thread seconds per block at this setting, and samples per pixel saved against uniform of the same worst block."""
    spent = median([f["check_s"] for f in p[3].values()])
    saved = median([f["uniform_spp"] - f["samples"] for f in p[3].values()])
    return spent, saved


def at_path_cost(p, us):
    """Time against uniform samples of the same worst block if every path took `us` microseconds: median of the scenes with several
    blocks, one block's time being the same at any number of samples."""
    return median([(f["samples"] + f["check_s"] / (BLOCK * us * 1e-6)) / f["uniform_spp"] for f in p[3].values() if f["blocks"] > 1])


def draw_paths(folder, points):
    steps = [0.02 * 1.6**i for i in range(20)]
    share, total, defaults = "", "", [p for p in points if colour(p[0]) and is_default(p) and p[0] != "uniform"]
    for n, p in enumerate(defaults):
        spent, samples = median([f["check_s"] for f in p[3].values()]), over_scenes(p, "samples")
        share += data("a%d" % n, [(us, spent / (spent + samples * BLOCK * us * 1e-6)) for us in steps])
        total += data("b%d" % n, [(us, at_path_cost(p, us)) for us in steps])
    lines = lambda letter: ", ".join("$%s%d using 1:2 with lines lw 2 lc '%s' title '%s'" % (letter, n, colour(p[0]), p[0])
                                     for n, p in enumerate(defaults))
    limit = next(p for p in points if p[0] == "limit")
    bound = median([f["samples"] / f["uniform_spp"] for f in limit[3].values() if f["blocks"] > 1])
    script = ("%s%sset multiplot layout 1,2\nset logscale xy\nset xlabel 'microseconds per path and thread'\nset xrange [0.02:150]\n"
              "set ylabel 'share of the time that the checks take'\nset yrange [1e-5:1]\n"
              "set arrow 1 from graph 0,first 0.01 to graph 1,first 0.01 nohead dt 2 lc '#000000'\n"
              "set label 1 'wanted: 1 %%' at graph 0.98,first 0.013 right\nset key bottom left\nplot %s\n"
              "set ylabel 'time against uniform samples of the same worst block'\nset yrange [0.1:20]\nunset key\n"
              "set arrow 1 from graph 0,first %g to graph 1,first %g nohead dt 2 lc '#000000'\n"
              "set label 1 'the limit: mean(T)/max(T)' at graph 0.02,first %g left offset 0,-0.7\n"
              "set arrow 2 from graph 0,first 1 to graph 1,first 1 nohead lc '#aaaaaa'\nset label 2 'uniform' at graph 0.98,first 1.1 right\n"
              "plot %s\nunset multiplot\n" % (share, total, lines("a"), bound, bound, bound, lines("b")))
    plot(folder, "cost-path.png", (1280, 520), script)


SIDES = ("25", "50", "100", "200", "400")


def limits_by_side(out, name):
    """{side: [mean(T)/max(T) of each scene]}: scenes with several blocks of 200 pixels."""
    parts = {scene: p for scene, p in out["sets"].get(name, {}).get("parts", {}).items() if len(p["200"]) > 1}
    return {side: [mean(p[side]) / max(p[side]) for p in parts.values() if len(p.get(side, ())) > 1] for side in SIDES}


def draw_growth(folder, out, points):
    observer = [g for g in out.get("growth", []) if g["threads"] == 1 and g["criterion"] == "observer" or g["side"] == 4000]
    network = [g for g in out.get("growth", []) if g["threads"] == 1 and g["criterion"] == "ggn"]
    if not observer:
        return
    bound = over_scenes(next(p for p in points if p[0] == "limit"), "limit")
    block = lambda name, rows: data(name, [(g["side"]**2, g["criterion_s"], g["sampling_s"]) for g in rows])
    script = ("%s%sset multiplot layout 1,2\nset logscale xy\nset xlabel 'pixels, in blocks of 200x200'\n"
              "set ylabel 'thread seconds'\nset key left\nset format x '10^{%%T}'\nset termoption enhanced\n"
              "plot $o using 1:3 with linespoints pt 6 lw 2 lc '#999999' title 'sampling, %d spp', "
              "$o using 1:($3*%g) with lines dt 2 lc '#000000' title 'what the limit leaves of it', "
              "$o using 1:2 with linespoints pt 7 lw 2 lc '#d62728' title 'checks of observer', "
              "$n using 1:2 with linespoints pt 7 lw 2 lc '#1f77b4' title 'checks of ggn (%d spp)'\nset format x '%%g'\n"
              % (block("o", observer), block("n", network), observer[0]["spp"], bound, network[0]["spp"] if network else 0))
    clauses, blocks = [], ""
    for n, (name, title) in enumerate((("test", "test scenes"), ("people", "views that people judged"), ("validation", "validation views"))):
        found = [(side, median(r), min(r), max(r)) for side, r in limits_by_side(out, name).items() if r]
        if found:
            blocks += data("l%d" % n, [(float(s) * (0.97 + 0.03 * n), m, a, b) for s, m, a, b in found])
            clauses.append("$l%d using 1:2:3:4 with yerrorlines pt 7 lw 2 lc '%s' title '%s'"
                           % (n, ("#000000", "#d62728", "#1f77b4")[n], title))
    if clauses:
        script += ("%sset xlabel 'side of a block, pixels'\nset ylabel 'the limit: mean(T)/max(T), median and range of the scenes'\n"
                   "unset logscale y\nset yrange [0:1]\nset xrange [20:500]\nset xtics (25, 50, 100, 200, 400)\nplot %s\n" % (blocks, ", ".join(clauses)))
    plot(folder, "cost-growth.png", (1280, 480), script + "unset multiplot\n")


def draw(folder, out):
    if "test" in out.get("sets", {}):
        points = points_of(out, "test")
        draw_frontiers(folder, points, "cost-frontier.png", "to_limit", "time, checks included, against stopping every block at its threshold",
                       ("noisy", "worst", "flip", "relmse"))
        draw_frontiers(folder, points_of(out, "recorded"), "cost-recorded.png", "to_limit",
                       "time, checks included, against stopping every block at its threshold", ("noisy", "worst"))
        draw_ratio(folder, points)
        draw_paths(folder, points)
        draw_growth(folder, out, points)
    if "people" in out.get("sets", {}):
        draw_frontiers(folder, points_of(out, "people"), "cost-people.png", "to_limit",
                       "time, checks included, against stopping at the thresholds of people", ("early", "worst"))


def on_frontier(points, default):
    """Scenes on which no setting of another criterion is cheaper and as accurate in every column, of how many; and who is."""
    good, beaten = 0, {}
    for scene, f in default[3].items():
        by = [p for p in points if bare(p[0]) not in ("limit", default[0]) and scene in p[3] and p[3][scene]["total_s"] < 0.99 * f["total_s"]
              and p[3][scene]["worst"] <= f["worst"] and p[3][scene]["noisy"] <= f["noisy"]]
        good += not by
        if by:
            beaten[scene] = min(by, key=lambda p: p[3][scene]["total_s"])
    return good, len(default[3]), beaten


def find(points, criterion):
    return next((p for p in points if p[0] == criterion and is_default(p)), None)
