"""Pictures of docs/results/cost.md from what `lab cost` measured (docs/results/cost.json)."""
import re

from lull.plot.charts import Chart, Rule, Series
from lull.plot.kinds import frontier_charts

from lablib.cost_figures import BLOCK, SIDES, at_path_cost, is_default, limits_by_side, median, over_scenes, points_of
from lablib.plots import draw as draw_charts

COLOURS = {"uniform": "#999999", "variance": "#8c564b", "halfbuf": "#e377c2", "observer": "#d62728", "lull": "#1f77b4", "paper.ggn": "#9467bd",
           "svd-entropy": "#2ca02c", "attributes": "#bcbd22", "noise-mask": "#ff7f0e"}


def colour(criterion):
    """Of those that are drawn; the shipped network's has no version. None: not drawn."""
    return COLOURS.get(re.sub(r"^(lull)-\d+\.ggn$", r"\1", criterion))


def drawn(points):
    """The criteria of a picture, in the order of their colours."""
    order = list(COLOURS.values())
    return sorted({p[0] for p in points if colour(p[0])}, key=lambda c: order.index(colour(c)))


def find_limit(points):
    return next(p for p in points if p[0] == "limit")


def curves(points, x, y, how=median):
    """A line for each criterion over its dial, its default as a filled point."""
    series = []
    for criterion in drawn(points):
        mine = [p for p in points if p[0] == criterion and p[1] in ("visible", "threshold", "spp") and p[3]]
        if not mine:
            continue
        line = lambda some: ([over_scenes(p, x) for p in some], [over_scenes(p, y, how) for p in some])
        series.append(Series(*line(mine), criterion, colour(criterion), marker="o", size=4, filled=False))
        series.append(Series(*line([p for p in points if p[0] == criterion and is_default(p)]), "", colour(criterion), "", "o", 9))
    return series


def draw_frontiers(folder, points, name, title, panels):
    charts = frontier_charts(panels, title, lambda panel, how: curves(points, "to_limit", panel, how))
    draw_charts(folder, name, (1280, 480 * ((len(panels) + 1) // 2)), charts)


def draw_ratio(folder, points):
    points = [(*p[:3], {scene: f for scene, f in p[3].items() if f["blocks"] > 1}, p[4]) for p in points]  # alone, a block is its own uniform
    draw_charts(folder, "cost-ratio.png", (760, 520), [Chart(
        curves([p for p in points if p[0] != "uniform"], "worst", "total_ratio"), "", "visible difference of the worst block (1: just visible)",
        "time against uniform samples of the same worst block", 10, 10, (0.2, 10), (0.2, 10),
        [Rule("y", over_scenes(find_limit(points), "limit"), "limit: mean(T)/max(T)"), Rule("y", 1, line="-", colour="#aaaaaa")])])


def draw_paths(folder, points):
    steps = [0.02 * 1.6**i for i in range(20)]
    defaults = [p for p in points if colour(p[0]) and is_default(p) and p[0] != "uniform"]

    def share(p, us):
        spent, samples = median([f["check_s"] for f in p[3].values()]), over_scenes(p, "samples")
        return spent / (spent + samples * BLOCK * us * 1e-6)

    lines = lambda of: [Series(steps, [of(p, us) for us in steps], p[0], colour(p[0])) for p in defaults]
    bound = median([f["samples"] / f["uniform_spp"] for f in find_limit(points)[3].values() if f["blocks"] > 1])
    axis = "microseconds per path and thread"
    draw_charts(folder, "cost-path.png", (1280, 520), [
        Chart(lines(share), "", axis, "share of the time that the checks take", 10, 10, (0.02, 150), (1e-5, 1), [Rule("y", 0.01, "wanted: 1 %")],
              key="lower left"),
        Chart(lines(at_path_cost), "", axis, "time against uniform samples of the same worst block", 10, 10, (0.02, 150), (0.1, 20),
              [Rule("y", bound, "the limit: mean(T)/max(T)"), Rule("y", 1, "uniform", line="-", colour="#aaaaaa")], key="")])


def limit_series(out):
    """The limit by the side of a block: median and range of the scenes."""
    for n, (name, title) in enumerate((("test", "test scenes"), ("people", "views that people judged"), ("validation", "validation views"))):
        found = [(float(side) * (0.97 + 0.03 * n), r) for side, r in limits_by_side(out, name).items() if r]
        if found:
            yield Series([x for x, _ in found], [median(r) for _, r in found], title, ("#000000", "#d62728", "#1f77b4")[n], marker="o",
                         spans=[(min(r), max(r)) for _, r in found])


def draw_growth(folder, out, points):
    observer = [g for g in out.get("growth", []) if g["threads"] == 1 and g["criterion"] == "observer" or g["side"] == 4000]
    network = [g for g in out.get("growth", []) if g["threads"] == 1 and g["criterion"] == "ggn"]
    if not observer:
        return
    bound = over_scenes(find_limit(points), "limit")
    pixels = [g["side"]**2 for g in observer]
    sampling = [g["sampling_s"] for g in observer]
    series = [Series(pixels, sampling, "sampling, %d spp" % observer[0]["spp"], "#999999", marker="o", filled=False),
              Series(pixels, [s * bound for s in sampling], "what the limit leaves of it", "#000000", "--"),
              Series(pixels, [g["criterion_s"] for g in observer], "checks of observer", "#d62728", marker="o")]
    if network:
        series.append(Series([g["side"]**2 for g in network], [g["criterion_s"] for g in network], "checks of ggn (%d spp)" % network[0]["spp"],
                             "#1f77b4", marker="o"))
    draw_charts(folder, "cost-growth.png", (1280, 480), [
        Chart(series, "", "pixels, in blocks of 200x200", "thread seconds", 10, 10, key="upper left"),
        Chart(list(limit_series(out)), "", "side of a block, pixels", "the limit: mean(T)/max(T), median and range of the scenes", 10,
              x_range=(20, 500), y_range=(0, 1), ticks=[float(side) for side in SIDES])])


TO_LIMIT = "time, checks included, against stopping every block at its threshold"


def draw(folder, out):
    if "test" in out.get("sets", {}):
        points = points_of(out, "test")
        draw_frontiers(folder, points, "cost-frontier.png", TO_LIMIT, ("noisy", "worst", "flip", "relmse"))
        draw_frontiers(folder, points_of(out, "recorded"), "cost-recorded.png", TO_LIMIT, ("noisy", "worst"))
        draw_ratio(folder, points)
        draw_paths(folder, points)
        draw_growth(folder, out, points)
    if "people" in out.get("sets", {}):
        draw_frontiers(folder, points_of(out, "people"), "cost-people.png", "time, checks included, against stopping at the thresholds of people",
                       ("early", "worst"))
