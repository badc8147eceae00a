"""Trains the networks at their published size, sitting by sitting, and draws what they are worth after how many processor hours.

A line of scripts/published.plan is `NAME  OPTIONS of ggn train`. Each is trained on DATA until it has spent --hours, by `ggn train
--resume` at nice 19: interrupted, or with more hours, the same command goes on, and draws all validations so far. Hours are those of
processors, validations among them, without loading data and, preset lull, denoising them once. Then the models, lull-3, the observer's
law and the number of samples alone are judged on the validation blocks, which chose the best step of each
model. Levels beyond the recorded ones are simulated, by the noise that made the labels: there the law is right by construction."""
import csv
import json
import os
import shutil
import subprocess

from lablib import ablation, plots, recordings, tables, tool
from lablib.sources import TRAINING
from lablib.tool import GGN, Refused, ggn

SOURCES = TRAINING
SHIPPED = os.path.join(tool.ROOT, "ggn", "models", "lull-3.ggn")
PASSES, WINDOWS = 30, 17524  # as published; of the 648 blocks of scripts/dataset.plan
TRIVIAL = {"observer": "the observer's law", "-spp": "number of samples alone"}
COLOURS = ("#cc3311", "#0077bb", "#009988", "#ee7733")


def options(parser):
    parser.add_argument("data", type=tool.path, help="a labelled data set with training and validation scenes")
    parser.add_argument("--plan", default=os.path.join(tool.ROOT, "scripts", "published.plan"), help="scripts/published.plan")
    parser.add_argument("--out", type=tool.path, default=os.path.join(tool.BUILD, "published"), help="build/published")
    parser.add_argument("--hours", type=float, default=12, help="processor hours of each network, all sittings together (12)")
    parser.add_argument("--only", metavar="NAME", action="append", help="train only this line of the plan; may be repeated")
    parser.add_argument("--threads", type=int, default=1, help="of ggn train; the result does not depend on it (1)")
    parser.add_argument("--beside", type=tool.path, default=SHIPPED, metavar="MODEL", help="a model to judge beside them (lull-3)")
    parser.add_argument("--table", action="store_true", help="train nothing: what is there already")
    tool.writes(parser)


def train(o, name, words):
    """All of its hours; status of ggn train."""
    model = os.path.join(o.out, name + ".ggn")
    ablation.claim(words, o.data, model)
    return subprocess.run(["nice", "-n", "19", GGN, "train", "--data", o.data, "--out", model, "--resume", "--threads", str(o.threads),
                           "--hours", "%g" % o.hours] + words).returncode


def points(model):
    """[[processor hours, step, AUC, calibrated loss]] of the validations; the denoiser's own phase has hours, too."""
    found, before = [], 0.0
    with open(model + ".csv", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["phase"] == "denoiser":
                before = float(row["processor_s"])
            elif row["validation_auc"]:
                found.append([(before + float(row["processor_s"])) / 3600, int(row["step"]), float(row["validation_auc"]), float(row["validation_loss"])])
    return found


def run_of(name, words, model):
    card, found = tool.load(model + ".card.json"), points(model)
    hours, step = found[-1][:2]
    seen = step * card["training"]["batch"]
    return {"name": name, "options": " ".join(words), "points": found, "hours": hours, "windows": seen, "passes": seen / card["data"]["training_windows"],
            "window_s": 3600 * hours / seen, "best_step": card["training"]["best_step"]}


def views_of(data, scenes, target):
    """A data set of the views of these scenes alone, as links with their labels."""
    names = [v for v in os.listdir(data) if os.path.exists(os.path.join(data, v, "labels.json")) and recordings.manifest_of(os.path.join(data, v))["scene"] in scenes]
    for view in recordings.link_views(data, os.path.join(target, "test"), names):
        shutil.copy(os.path.join(data, os.path.basename(view), "labels.json"), view)


def judge(o, scenes, models):
    """What ggn evaluate says of them and of what is trivial, on the blocks of these scenes."""
    folder, alone = os.path.join(o.data, "validation"), os.path.join(o.out, "judged")
    views_of(folder if os.path.isdir(folder) else o.data, scenes, alone)
    result = json.loads(ggn("evaluate", "-d", alone, "--no-quality", "--json", "-t", 1, *[w for m in models for w in ("-m", m)]))
    keys = ("blocks", "windows", "auc", "early_stop_rate", "samples_ratio", "median_abs_log2")
    return {name: {k: r.get(k) for k in keys} for name, r in result["splits"]["test"].items()
            if name in TRIVIAL or name in map(os.path.basename, models)}


def step_ms():
    """Milliseconds of a processor, of the networks at the published widths."""
    return {k: v for k, v in json.loads(tool.bench("ggn_networks", "--threads", 1, "--rounds", 9, "--batch", 8, "--json")).items() if k.endswith("_ms")}


def row(name, options, r, run=None):
    cell = lambda key, form: tables.figure(run[key], form) if run else "–"
    return [name, options, cell("hours", "%.2f"), cell("windows", "%d"), cell("passes", "%.2f"), cell("window_s", "%.2f"), tables.figure(r["auc"], "%.3f"),
            tables.percent(r["early_stop_rate"]), tables.figure(r["samples_ratio"]), tables.figure(r["median_abs_log2"])]


def beside(r):
    """(name, title) of whom is not a run."""
    return [(name, TRIVIAL.get(name, name[:-4])) for name in r["judged"] if name not in [run["name"] + ".ggn" for run in r["runs"]]]


def page(r):
    rows = [row(run["name"], "`%s`" % run["options"], r["judged"][run["name"] + ".ggn"], run) for run in r["runs"]]
    rows += [row(shown, "", r["judged"][name]) for name, shown in beside(r)]
    data, first = r["data"], r["runs"][0]
    text = "%s. %d blocks of %d scenes (%d windows) to train on, %d blocks of %d other scenes to validate; all with\n`%s`.\n\n" % (
        tables.provenance(r["measured"]), data["training_blocks"], len(data["train"]), data["training_windows"], data["validation_blocks"], len(data["validation"]), r["common"])
    text += "![validation AUC against processor hours](published-curve.png)\n\n" + tables.table(
        ("network", "options", "processor hours", "windows", "passes", "s per window", "AUC", "early", "samples", "median \\|log2\\|"), rows)
    text += "\nAt %.2f s per window %d passes over the %d windows of `scripts/dataset.plan` would take %.0f processor hours, a tenth of them %.0f; " \
            "here it went to **%.2f**.\n" % (first["window_s"], PASSES, WINDOWS, *[share * first["window_s"] * PASSES * WINDOWS / 3600 for share in (1, 0.1)], first["hours"])
    return text


def parts(r):
    """What a step's milliseconds go into, from build/bench/ggn_networks."""
    f = r["step_ms"]
    six, generator = 6 * f["denoiser_train_ms"], 2 * f["generator_train_ms"]
    return ("One window is %.0f ms of the denoiser (six images, forward and back) and %.0f ms of the generator (two windows);\na denoiser that only "
            "answers takes %.0f ms.\n" % (six, generator, 6 * f["denoiser_forward_ms"]))


def draw(folder, r):
    charts = plots.charts()
    last = max(10.0, *[p[0] for run in r["runs"] for p in run["points"]])
    series = [charts.Series([p[0] for p in run["points"]], [p[2] for p in run["points"]], run["name"], COLOURS[i % len(COLOURS)], marker="o")
              for i, run in enumerate(r["runs"])]
    rules = [charts.Rule("y", r["judged"][name]["auc"], title=shown, line=("--", ":", "-.")[i % 3], colour="#666666")
             for i, (name, shown) in enumerate(beside(r))]
    plots.draw(folder, "published-curve.png", (760, 460), [charts.Chart(
        series, "", "processor hours", "AUC on validation windows", 10, x_range=(0.005, 2 * last), y_range=(0.4, 1.03), rules=rules, key="center right")])


def main(o):
    common, lines = ablation.read_plan(o.plan)
    unknown = set(o.only or ()) - {name for name, _ in lines}
    if unknown:
        raise Refused("--only %s: expected some of %s" % (", ".join(sorted(unknown)), ", ".join(name for name, _ in lines)))
    os.makedirs(o.out, exist_ok=True)
    for name, words in lines:
        if not o.table and name in (o.only or [name]):
            status = train(o, name, common + words)
            if status:
                return 130 if status == 130 else 2
    there = [(name, words, os.path.join(o.out, name + ".ggn")) for name, words in lines if os.path.exists(os.path.join(o.out, name + ".ggn"))]
    if not there:
        raise Refused("%s: nothing is trained yet" % o.out)
    data = tool.load(there[0][2] + ".card.json")["data"]
    results = {"measured": tool.measured(), "data": data, "common": " ".join(common), "runs": [run_of(*line) for line in there],
               "judged": judge(o, data["validation"], [model for _, _, model in there] + [o.beside])}
    print(page(results), end="")
    if o.write:
        results["step_ms"] = step_ms()
        draw(os.path.join(o.write, "results"), results)
        tool.store(o.write, "published", results)
