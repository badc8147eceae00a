"""Trains the variants of a plan and says what each is worth on the validation scenes.

A line of the plan is `NAME  OPTIONS of ggn train`; `common` holds those that all share, `#` begins a comment. Every run is a
`ggn train --resume` at nice 10 on one thread: interrupted, the same command goes on with it. What was trained with other options or
another seed is refused, not mixed in. Figures are of the validation scenes at the threshold that ggn train chooses there: good for
comparing variants, not for claims. Times are processor time of one thread.

--sets DIR --judge MODEL ... trains nothing: every folder of DIR is a labelled data set that no model was trained or tuned on, and the
models and the observer are judged on each; on the set `test` on its recorded levels alone."""
import json
import os
import resource
import subprocess

from lablib import tables, tool
from lablib.sources import TRAINING
from lablib.tool import GGN, Refused, ggn

SOURCES = TRAINING
HEAD = ("variant", "options", "AUC", "median \\|log2\\|", "early", "samples", "best step", "ms per decision", "ms per training window",
        "minutes trained", "KB as f16")


def options(parser):
    parser.add_argument("plan", nargs="?", default=os.path.join(tool.ROOT, "scripts", "ablate.plan"), help="scripts/ablate.plan")
    parser.add_argument("--data", type=tool.path, default=os.path.join(tool.ROOT, "data"))
    parser.add_argument("--out", type=tool.path, default=os.path.join(tool.BUILD, "ablate"), help="build/ablate")
    parser.add_argument("--sets", type=tool.path, metavar="DIR", help="data sets to judge models on instead")
    parser.add_argument("--judge", type=tool.path, metavar="MODEL", action="append", default=[], help="may be repeated")
    parser.add_argument("--table", action="store_true", help="train nothing: the table of what is there already")
    tool.writes(parser)


def read_plan(path):
    common, lines = [], []
    for _, words in tool.plan_lines(path):
        if words[0] == "common":
            common = words[1:]
        else:
            lines.append((words[0], words[1:]))
    return common, lines


def spent(path, more=0.0):
    """Processor seconds of all runs of a variant."""
    before = tool.load(path) if os.path.exists(path) else 0.0
    if more:
        tool.save(round(before + more, 1), path)
    return before + more


def claim(options, data, model):
    """Refuses a model, or what there is of it, that was begun with other options."""
    note, text = model + ".options", " ".join(options + ["--data", data]) + "\n"
    if os.path.exists(note):
        with open(note, encoding="utf-8") as f:
            if f.read() != text:
                raise Refused("%s: trained with other options; remove it or give it another name" % model)
    with open(note, "w", encoding="utf-8") as f:
        f.write(text)


def train(options, data, model):
    claim(options, data, model)
    if os.path.exists(model):
        return True
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    ok = subprocess.run(["nice", "-n", "10", GGN, "train", "--data", data, "--out", model, "--resume", "--threads", "1"] +
                        options).returncode == 0
    spent(model + ".cpu", resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    return ok


def row(name, options, model):
    card, half = tool.load(model + ".card.json"), model + ".f16"
    ms = json.loads(tool.bench("ggn_networks", "--model", model, "--threads", 1, "--rounds", 9, "--batch", 4, "--json"))
    window = json.loads(ggn("inspect", "--json", model))["window"]
    ggn("convert", model, half)
    size = os.path.getsize(half)
    os.remove(half)
    v = card["validation"]
    return {"name": name, "options": " ".join(options), **{k: v[k] for k in ("auc", "median_abs_log2", "early_stop_rate", "samples_ratio")},
            "best_step": card["training"]["best_step"], "decision_ms": ms["decision_ms"],
            "step_ms": ms["train_sample_ms"] - window * ms["denoiser_train_ms"], "minutes": spent(model + ".cpu") / 60, "kb": size // 1000}


def table(rows, auc="%.4f", early="%.1f %%", times="%.1f"):
    keys = (("auc", auc), ("median_abs_log2", "%.2f"), ("early_stop_rate", early), ("samples_ratio", "%.2f"), ("best_step", "%d"),
            ("decision_ms", times), ("step_ms", times), ("minutes", "%.1f"), ("kb", "%d"))
    shown = lambda r, key: 100 * r[key] if key == "early_stop_rate" else r.get(key)
    return tables.table(HEAD, [[r["name"], r["options"], *[tables.figure(shown(r, key), form) for key, form in keys]] for r in rows])


SETS = {"people": "people's four views, made from halves, each left out of the observer's fit", "test": "test scenes of the plan",
        "rare": "rare light, labelled by true references", "foreign": "textures that no training scene has"}
JUDGED = ("early_stop_rate", "samples_ratio", "median_abs_log2", "median_log2", "spearman")


def judge(root, models):
    """{set: {method: figures}}"""
    found = {}
    for name in SETS:
        if not os.path.isdir(os.path.join(root, name)):
            continue
        rows = found[name] = {}
        for model in models:
            result = json.loads(ggn("evaluate", "-d", os.path.join(root, name), "-O", os.path.join(tool.ROOT, "ggn/sight/observer.json"),
                                  *(["--recorded"] if name == "test" else []), "--no-quality", "--json", "-t", 1, "-m", model))
            split = next(s for s in result["splits"].values())
            for method in ("observer", os.path.basename(model)):
                rows[method] = {"blocks": split[method]["blocks"], **{k: split[method].get(k) for k in JUDGED}}
    return found


def sets(results):
    forms = ("%.0f %%", "%.3f", "%.3f", "%+.3f", "%.2f")
    rows = []
    for name, methods in results["sets"].items():
        for method, r in methods.items():
            shown = [None if r[k] is None else (100 if k == "early_stop_rate" else 1) * r[k] for k in JUDGED]
            rows.append([SETS[name], str(r["blocks"]), method, *[tables.figure(v, f) for v, f in zip(shown, forms)]])
    return "%s.\n\n%s" % (tables.provenance(results["sets_measured"]), tables.table(
        ("set", "blocks", "judged by", "early", "samples", "median \\|log2\\|", "bias", "ρ"), rows))


def main(o):
    if o.sets:
        results = {**(tool.results(o.write, "ablation") if o.write else {}), "sets_measured": tool.measured(), "sets": judge(o.sets, o.judge)}
        print(sets(results), end="")
        if o.write:
            tool.store(o.write, "ablation", results)
        return
    if not os.path.isfile(o.plan):
        raise Refused("%s: no such plan" % o.plan)
    common, lines = read_plan(o.plan)
    os.makedirs(o.out, exist_ok=True)
    rows, failed = [], []
    for name, options in lines:
        model = os.path.join(o.out, name + ".ggn")
        if not o.table and not train(common + options, o.data, model):
            failed.append(name)
        elif os.path.exists(model):
            rows.append(row(name, options, model))
    print("all with `%s`\n" % " ".join(common))
    print(table(rows), end="")
    if o.write:
        tool.store(o.write, "ablation", {**tool.results(o.write, "ablation"), "measured": tool.measured(), "common": " ".join(common), "rows": rows})
    if failed:
        raise Refused("not trained: " + ", ".join(failed))
