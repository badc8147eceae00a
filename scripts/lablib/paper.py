"""Holds what ships against the figures of the paper that the networks come from: a page, docs/results/paper.md.

The views of people are replayed (`ggn replay`): lull-3 and the observer's law, each view judged by an observer that was fitted to the
others, the number of samples alone, and what else was trained. What the published models said of the same views are
thresholds, so of these only decisions are known. Figures of the paper are Buisine et al., Deep Learning Applications 4, Springer 2022. Two
minutes of processor time, more with other networks."""
import argparse
import itertools
import json
import math
import os
import statistics

from lablib import tables, tool
from lablib.recordings import people_views
from lablib.sources import JUDGE, NETWORK, OBSERVER, PICTURES
from lablib.tool import ggn

SOURCES = PICTURES + OBSERVER + NETWORK + JUDGE
CUTS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.98)
PUBLISHED = ("SVD-Entropy", "26-attributes")
NAMES = {"lull-3": "lull-3, as shipped", "law": "the observer's law",
         "-spp": "number of samples alone, by what other views want", "SVD-Entropy": "SVD-Entropy LSTM, as published",
         "26-attributes": "26 attributes + SVM, as published"}


def options(parser):
    parser.add_argument("--human", type=tool.path, default=os.path.join(tool.SHARED, "human"), metavar="DIR",
                        help="human-thresholds.csv, what published models predict, and views/ (../shared/human)")
    parser.add_argument("--work", type=tool.path, default=os.path.join(tool.BUILD, "paper"), metavar="DIR", help="labelled copies (build/paper)")
    for option, program in (("--network", "train"), ("--baseline", "baseline")):
        parser.add_argument(option, type=named, action="append", default=[], metavar="NAME=FILE",
                            help="a row for what ggn %s wrote, which learned from none of these views; may be repeated" % program)
    tool.writes(parser)


def named(text):
    name, equals, file = text.partition("=")
    if not equals or not os.access(file, os.R_OK):
        raise argparse.ArgumentTypeError("%s: expected NAME=FILE, of a file that is there" % text)
    return name, tool.path(file)


class Windows:
    """Scores of windows, whether they are noisy, and by how many samples the next one is away: so each counts as often as with windows a fixed
    number of samples apart, which is how the paper has them."""

    def __init__(self):
        self.rows = []

    def add(self, view, score, noisy, weight):
        self.rows.append((view, score, noisy, weight))

    def views(self):
        """Those of each view."""
        of = {}
        for row in self.rows:
            of.setdefault(row[0], Windows()).add(*row)
        return list(of.values())

    def accuracy(self, cut):
        """Of "a score of at least the cut is noisy"."""
        return sum(w for _, s, n, w in self.rows if (s >= cut) == bool(n)) / sum(w for *_, w in self.rows)

    def best(self):
        """At the best cut."""
        right = most = sum(w for _, _, n, w in self.rows if n)  # below all scores: everything is called noisy
        for _, tied in itertools.groupby(sorted(self.rows, key=lambda r: r[1]), key=lambda r: r[1]):
            right += sum(-w if n else w for _, _, n, w in tied)
            most = max(most, right)
        return most / sum(w for *_, w in self.rows)

    def auc(self):
        """Of pairs of a noisy and a clean window the share whose scores are in order; ties count half."""
        below = won = 0.0
        for _, tied in itertools.groupby(sorted(self.rows, key=lambda r: r[1]), key=lambda r: r[1]):
            tied = list(tied)
            clean, noisy = (sum(w for _, _, n, w in tied if bool(n) is is_noisy) for is_noisy in (False, True))
            won += noisy * (below + 0.5 * clean)
            below += clean
        noisy = sum(w for _, _, n, w in self.rows if n)
        return won / (noisy * below) if noisy * below else math.nan


def figures(windows, cuts=CUTS):
    """Of all windows and of the views' mean: AUC, accuracy at each cut and at the best."""
    of = lambda w: {"auc": w.auc(), "accuracy": [w.accuracy(cut) for cut in cuts], "best": w.best()}
    views = [of(w) for w in windows.views()]
    mean = lambda values: statistics.mean(v for v in values if not math.isnan(v))
    return {"pooled": of(windows), "views": {"auc": mean(v["auc"] for v in views), "best": mean(v["best"] for v in views),
                                             "accuracy": [mean(column) for column in zip(*(v["accuracy"] for v in views))]}}


def thresholds(path):
    """{view: [samples of each block]}"""
    with open(path, encoding="utf-8") as file:
        rows = [line.strip().strip(";").split(";") for line in file if ";" in line]
    return {row[0]: [float(v) for v in row[1:]] for row in rows if row[0].startswith("p3d")}


def wanted_above(replay, view, spp):
    """The share of the other views' blocks that want more samples."""
    return statistics.mean(b["threshold"] > spp for b in replay["blocks"] if b["view"] != view)


def judged(replay, published, names=("lull-3",)):
    """{name: figures of its windows} and their number; names: of the replay's methods, in their order."""
    views = replay["views"]
    models = list(zip(names, replay["methods"], strict=True))
    spread = tool.observer()["spread"]
    windows = {name: Windows() for name in dict.fromkeys(["lull-3", *names, *NAMES])}
    for i, block in enumerate(replay["blocks"]):
        view = views[block["view"]]["name"]
        levels = block["spp"]
        for k, (spp, noisy, error) in enumerate(zip(levels, block["noisy"], block["error"])):
            if noisy is None or k + 1 == len(levels):
                continue  # beyond where the study ended
            add = lambda name, score: windows[name].add(view, score, noisy, levels[k + 1] - spp)
            for name, model in models:
                score = model["scores"][i][k]
                add(name, 1.0 if score is None else score)  # who does not answer yet does not stop
            add("law", statistics.NormalDist().cdf(math.log2(max(error, 1e-6)) / spread))
            add("-spp", wanted_above(replay, block["view"], spp))
            for name, of in published.items():
                said = next((t for v, t in of.items() if v.startswith(view)), None)
                if said:
                    add(name, float(spp < said[block["id"]]))
    found = {name: figures(w) for name, w in windows.items() if w.rows}
    for name in published:  # a decision, no probability
        for way in found.get(name, {}).values():
            way.update(auc=None, best=way["accuracy"][0], accuracy=None)
    return found, len(windows["law"].rows)


def page(results):
    number = lambda v, form="%.3f": tables.figure(v, form)
    way = lambda key, title: tables.table([title, "AUC", *("at %g" % c for c in CUTS), "best"], [
        [NAMES.get(name, name), number(r[key]["auc"]), *([number(a) for a in r[key]["accuracy"]] if r[key]["accuracy"] else ["–"] * len(CUTS)),
         number(r[key]["best"])] for name, r in results["windows_of"].items()])
    first = "%s\n%s" % (way("pooled", "%d windows, all" % results["windows"]), way("views", "mean of %d views" % results["views"]))
    second = tables.table(["", "blocks", "r, thresholds below 10,000", "early", "samples"],
                          [[name, str(r["blocks"]), number(r["pearson"], "%.2f"), tables.percent(r["early"]), number(r["samples"], "%.2f")]
                           for name, r in results["blocks_of"].items()])
    return "%s.\n\n%s\n%s" % (tables.provenance(results["measured"]), first, second)


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
    names = [name for name, _ in o.baseline] + ["lull-3"] + [name for name, _ in o.network]  # in the order of ggn replay
    asked = ["-d", o.work, "-O", os.path.join(tool.ROOT, "ggn/sight/observer.json"), "-m", os.path.join(tool.ROOT, "ggn/models/lull-3.ggn"),
             *[word for _, file in o.network for word in ("-m", file)], *[word for _, file in o.baseline for word in ("--baseline", file)],
             "-t", tool.THREADS]
    replay = json.loads(ggn("replay", *asked, "--no-quality"))
    found, windows = judged(replay, {name: thresholds(os.path.join(o.human, name + "-thresholds.csv")) for name in PUBLISHED},
                            names)
    titles = {name: m["title"] for name, m in zip(names, replay["methods"])}
    files = [word for name in PUBLISHED for word in ("--thresholds", os.path.join(o.human, name + "-thresholds.csv"))]
    rows = json.loads(ggn("evaluate", *asked, "--no-quality", "--json", *files))["splits"]["people"]
    results = {"measured": tool.measured(), "views": len(views), "windows": windows, "windows_of": found, "blocks_of": {
        **{NAMES[name] + ", all 40 views": compared(o, name) for name in PUBLISHED},
        **{NAMES[name] + ", these views": evaluated(rows, name + "-thresholds.csv") for name in PUBLISHED},
        **{NAMES.get(name, name): evaluated(rows, titles[name]) for name in dict.fromkeys(["lull-3", *names])},
        NAMES["law"]: evaluated(rows, "observer"),
        NAMES["-spp"]: evaluated(rows, "-spp")}}
    print(page(results))
    if o.write:
        tool.store(o.write, "paper", results)
