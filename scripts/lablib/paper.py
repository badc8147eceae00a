"""Holds what ships against the figures of the paper that the networks come from: a page, docs/results/paper.md.

The views of people are replayed (`ggn replay`): lull-3 and the observer's law, each view judged by an observer that was fitted to the
others, and the number of samples alone. What the published models said of the same views are thresholds, so of these only
decisions are known. Figures of the paper are Buisine et al., Deep Learning Applications 4, Springer 2022. Two minutes of processor time."""
import json
import math
import os
import statistics
import sys

from lablib import tables, tool
from lablib.recordings import people_views
from lablib.tool import ggn

sys.path.insert(0, os.path.join(tool.ROOT, "plugin-api", "python"))
from lull.judge import stats  # noqa: E402

CUTS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.98)
PUBLISHED = ("SVD-Entropy", "26-attributes")
NAMES = {"lull-3": "lull-3, as shipped", "law": "the observer's law", "-spp": "number of samples alone", "SVD-Entropy": "SVD-Entropy LSTM, as published",
         "26-attributes": "26 attributes + SVM, as published"}


def options(parser):
    parser.add_argument("--human", type=tool.path, default=os.path.join(tool.SHARED, "human"), metavar="DIR",
                        help="human-thresholds.csv, what published models predict, and views/ (../shared/human)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "paper"), metavar="DIR", help="labelled copies (build/paper)")
    tool.writes(parser)


def accuracy(score, noisy, cut):
    """Of "a score of at least the cut is noisy"."""
    return sum((s >= cut) == bool(n) for s, n in zip(score, noisy)) / len(noisy)


def of_windows(windows, cuts=CUTS):
    """windows: [(view, score, noisy)]. AUC of all, its mean over views, accuracy at each cut and at the best."""
    columns = lambda chosen: ([w[1] for w in chosen], [w[2] for w in chosen])
    score, noisy = columns(windows)
    views = sorted({w[0] for w in windows})
    return {"auc": stats.auc(score, noisy), "auc_views": statistics.mean(stats.auc(*columns([w for w in windows if w[0] == v])) for v in views),
            "accuracy": [accuracy(score, noisy, cut) for cut in cuts], "best": stats.best_accuracy(score, noisy)}


def thresholds(path):
    """{view: [samples of each block]}"""
    with open(path, encoding="utf-8") as file:
        rows = [line.strip().strip(";").split(";") for line in file if ";" in line]
    return {row[0]: [float(v) for v in row[1:]] for row in rows if row[0].startswith("p3d")}


def judged(replay, published):
    """{name: figures of its windows} and their number."""
    views, model = replay["views"], replay["methods"][0]
    spread = tool.load(tool.ROOT, "ggn", "observer", "observer.json")["spread"]
    windows = {name: [] for name in NAMES}
    for i, block in enumerate(replay["blocks"]):
        view = views[block["view"]]["name"]
        for k, (spp, noisy, error) in enumerate(zip(block["spp"], block["noisy"], block["error"])):
            if noisy is None:
                continue  # beyond where the study ended
            share = statistics.NormalDist().cdf(math.log2(max(error, 1e-6)) / spread)
            for name, score in (("lull-3", model["scores"][i][k]), ("law", share), ("-spp", -spp)):
                windows[name].append((view, score, noisy))
            for name, of in published.items():
                said = next((t for v, t in of.items() if v.startswith(view)), None)
                if said:
                    windows[name].append((view, float(spp < said[block["id"]]), noisy))
    found = {name: of_windows(w) for name, w in windows.items() if w}
    for name in found:
        if name == "-spp":
            found[name]["accuracy"] = None  # no probability
        elif name in published:
            found[name] = {"auc": None, "auc_views": None, "accuracy": None, "best": found[name]["accuracy"][CUTS.index(0.5)]}
    return found, len(windows["law"])


def page(results):
    number = lambda v, form="%.3f": tables.figure(v, form)
    first = tables.table(["%d windows of %d views" % (results["windows"], results["views"]), "AUC", "AUC, mean of views",
                          *("at %g" % c for c in CUTS), "best"],
                         [[NAMES[name], number(r["auc"]), number(r["auc_views"]), *([number(a) for a in r["accuracy"]] if r["accuracy"] else ["–"] * len(CUTS)),
                           number(r["best"])] for name, r in results["windows_of"].items()])
    second = tables.table(["", "blocks", "r, thresholds below 10,000", "early", "samples"],
                          [[name, str(r["blocks"]), number(r["pearson"], "%.2f"), tables.percent(r["early"]), number(r["samples"], "%.2f")]
                           for name, r in results["blocks_of"].items()])
    return "%s.\n\n%s\n%s" % (tables.told(results["measured"]), first, second)


def compared(o, name):
    said = json.loads(ggn("compare", os.path.join(o.human, "human-thresholds.csv"), os.path.join(o.human, name + "-thresholds.csv"), "--json"))
    return {"blocks": said["blocks"], "pearson": said["pearson_r_below_cap"], "early": said["early_stop_rate"], "samples": said["samples_ratio"]}


def evaluated(rows, name):
    r = rows[name]
    return {"blocks": r["blocks"], "pearson": r["pearson_r"], "early": r["early_stop_rate"], "samples": r["samples_ratio"]}


def main(o):
    human = os.path.join(o.human, "human-thresholds.csv")
    if not os.access(human, os.R_OK):
        raise tool.Refused("%s: no thresholds of people there (see --human)" % human)
    views = people_views(o.human, os.path.join(o.human, "views"), os.path.join(o.work, "people"))
    asked = ["-d", o.work, "-O", os.path.join(tool.ROOT, "ggn/observer/observer.json"), "-m", os.path.join(tool.ROOT, "ggn/models/lull-3.ggn"),
             "-t", tool.THREADS]
    found, windows = judged(json.loads(ggn("replay", *asked, "--no-quality")),
                            {name: thresholds(os.path.join(o.human, name + "-thresholds.csv")) for name in PUBLISHED})
    files = [word for name in PUBLISHED for word in ("--thresholds", os.path.join(o.human, name + "-thresholds.csv"))]
    rows = json.loads(ggn("evaluate", *asked, "--no-quality", "--json", *files))["splits"]["people"]
    results = {"measured": tool.measured(), "views": len(views), "windows": windows, "windows_of": found, "blocks_of": {
        **{NAMES[name] + ", all 40 views": compared(o, name) for name in PUBLISHED},
        **{NAMES[name] + ", these views": evaluated(rows, name + "-thresholds.csv") for name in PUBLISHED},
        NAMES["lull-3"]: evaluated(rows, "lull-3.ggn"), NAMES["law"]: evaluated(rows, "observer"),
        NAMES["-spp"]: evaluated(rows, "-spp")}}
    print(page(results))
    if o.write:
        tool.store(o.write, "paper", results)
