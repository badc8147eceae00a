"""How well the criteria agree with people, and with the observer's labels on the test scenes.

Prints tables in Markdown: people and the test scenes as the criteria stop by default, each view of people judged by an observer fitted
to the others; people with other values of --visible; the test scenes with --visible 0.5, since labels are the samples at which half of
the viewers see noise, for those that know this parameter; and the observer at 0.5 on the test blocks with a reference, against labels
from the rendered levels. On the validation scenes the cuts of criteria without a meaning of their own are tuned. 20 minutes of processor
time, 2 for the people's tables."""
import json
import math
import os
import shutil

from lablib import tables, tool
from lablib.recordings import link_views, manifest_of, people_views
from lablib.sources import JUDGE, NETWORK, OBSERVER, PICTURES
from lablib.tool import ggn

SOURCES = PICTURES + OBSERVER + NETWORK + JUDGE
BASELINES = ["attributes", "noise-mask"]  # those that are shipped
SHARES = (0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
HEAD = ("AUC", "early (below 0.8)", "samples", "median \\|log2\\|", "bias", "within an octave", "ρ")
NAMES = {"-spp": "−spp (looks at no pixel)", "constant (training median)": "one constant",
         "scene's mean (oracle)": "the view's mean (an oracle)"}
TITLES = {"people": "people", "visible": "people, the observer at other values of --visible", "test": "labels of the observer, test scenes",
          "half": "the same with --visible 0.5", "rendered": "people, blocks really rendered past their thresholds",
          "made": "people, the same blocks as above, made from the halves of 384 samples",
          "levels": "labels from rendered levels and a reference, --visible 0.5"}


def options(parser):
    for name, default, text in (
            ("--data", os.path.join(tool.ROOT, "../data"), "recordings of lab data-set (../data); where there are none, only people's tables"),
            ("--human", os.path.join(tool.SHARED, "human"), "human-thresholds.csv and views/ that people judged (../shared/human)"),
            ("--rendered", os.path.join(tool.ROOT, "../data-people/people"),
             "blocks of those that were rendered past their thresholds, as scripts/people.plan says (../data-people/people); may be absent"),
            ("--observer", os.path.join(tool.ROOT, "ggn/sight/observer.json"), "its parameters, with those of each view left out"),
            ("--out", os.path.join(tool.BUILD, "agreement"), "labelled copies and agreement.json (build/agreement)")):
        parser.add_argument(name, type=tool.path, default=default, metavar="PATH", help=text)
    parser.add_argument("--threads", type=int, default=tool.THREADS)
    parser.add_argument("-m", dest="model", type=tool.path, action="append", help="may be repeated (ggn/models/lull-3.ggn)")
    tool.writes(parser)


def recordings(root, work):
    here = [s for s in ("validation", "test") if os.path.isdir(os.path.join(root, s))]
    for split in here:
        ggn("label", *link_views(os.path.join(root, split), os.path.join(work, split)))
    return here


def evaluate(folder, o, *more, models=None):
    chosen = [w for m in (o.model if models is None else models) for w in ("-m", m)]
    return json.loads(ggn("evaluate", "-d", folder, "-O", o.observer, "--no-quality", "--json", "-t", o.threads, *chosen, *more))["splits"]


def others(o):
    """The baselines that are shipped, and responses of published models to the views of people."""
    published = [os.path.join(o.human, f"{n}-thresholds.csv") for n in ("SVD-Entropy", "26-attributes")]
    return ([w for b in BASELINES for w in ("--baseline", f"ggn/models/{b}.ggn")]
            + [w for p in published if os.access(p, os.R_OK) for w in ("--thresholds", p)])


def judges(rows):
    """Those that know --visible: the observer and the networks."""
    return {k: r for k, r in rows.items() if k == "observer" or k.endswith(".ggn")}


def alone(o, split):
    """A folder with that one split of the labelled copies."""
    folder = os.path.join(o.out, "alone-" + split)
    os.makedirs(folder, exist_ok=True)
    if not os.path.lexists(os.path.join(folder, split)):
        os.symlink(os.path.join(o.out, "data", split), os.path.join(folder, split))
    return folder


def half_of_the_viewers(o, work):
    """The test scenes at --visible 0.5: those that know it; and of blocks with a reference the observer."""
    test, referenced = os.path.join(work, "test"), os.path.join(o.out, "referenced", "test")
    result = {"half": judges(evaluate(alone(o, "test"), o, "--visible", "0.5")["test"])}
    with_reference = [v for v in os.listdir(test) if manifest_of(os.path.join(test, v))["reference_spp"] > 0]
    if with_reference:
        ggn("label", "--source", "levels", *link_views(test, referenced, with_reference))
        rows = evaluate(os.path.dirname(referenced), o, "--visible", "0.5")["test"]
        result["levels"] = {"observer": rows["observer"]}
    return result


def rendered_views(o):
    """Blocks of people's views as they were rendered to their thresholds, and as the halves of the shared recordings make them."""
    blocks = {v: [b["id"] for b in manifest_of(os.path.join(o.rendered, v))["blocks"]] for v in os.listdir(o.rendered)}
    result = {}
    for name, source in (("rendered", o.rendered), ("made", os.path.join(o.human, "views"))):
        folder = os.path.join(o.out, name)
        people_views(o.human, source, os.path.join(folder, "people"), blocks)
        result[name] = judges(evaluate(folder, o)["people"])
    return result


def cells(row):
    def number(key, form, scale=1):
        return "" if row.get(key) is None else form % (scale * row[key])

    return [number("auc", "%.3f"), number("early_stop_rate", "%.0f %%", 100), number("samples_ratio", "%.2f"),
            number("median_abs_log2", "%.2f"), number("median_log2", "%+.2f"), number("within_one", "%.0f %%", 100),
            number("spearman", "%.2f")]


def table(rows, *more):
    """The nearest first. more: (head, text of a row's name and row) of further columns."""
    first = next(iter(rows.values()))
    censored = "" if first.get("censored") is None else ", %d censored" % first["censored"]
    near = lambda row: math.inf if row.get("median_abs_log2") is None else row["median_abs_log2"]
    return tables.table(["%d blocks%s" % (first["blocks"], censored), *HEAD, *[head for head, _ in more]],
                        [[NAMES.get(name, name), *cells(row), *[text(name, row) for _, text in more]]
                         for name, row in sorted(rows.items(), key=lambda r: near(r[1]))])


def page_table(results, name):
    """A table of the page: each row says when it was measured, and if with another observer than today's."""
    kept = results[name]
    m = kept["measured"]
    source = "%s, %s" % (m["date"], m["commit"])
    if m["level"] != tool.observer()["level"]:
        source += ", an earlier observer (`--visible %g`)" % m["visible"]
    return table(kept["rows"], ("measured", lambda *_: source))


def main(o):
    o.model = o.model or [os.path.join(tool.ROOT, "ggn/models/lull-3.ggn")]
    work, views = os.path.join(o.out, "data"), os.path.join(o.human, "views")
    if not os.access(os.path.join(o.human, "human-thresholds.csv"), os.R_OK):
        raise tool.Refused(f"{o.human}/human-thresholds.csv: no thresholds of people there (see --human)")
    shutil.rmtree(work, ignore_errors=True)
    people_views(o.human, views, os.path.join(work, "people"))
    splits = recordings(o.data, work)
    rows = evaluate(work, o, *others(o))
    people = alone(o, "people")
    result = {"people": rows["people"], "visible": {f"observer, `--visible {v:g}`": evaluate(people, o, "--visible", v, models=[])["people"]["observer"]
                                                    for v in SHARES}}
    if "test" in splits:
        result |= {"test": {k: r for k, r in rows["test"].items() if not k.endswith(".csv")}, **half_of_the_viewers(o, work)}
    if os.path.isdir(o.rendered) and os.listdir(o.rendered):
        result |= rendered_views(o)
    measured = tool.measured(level=tool.load(o.observer)["level"], visible=tool.default("observer", "visible"))
    result = {name: {"measured": measured, "rows": rows} for name, rows in result.items()}
    tool.save(result, o.out, "agreement.json")
    for name, kept in result.items():
        print(f"Against {TITLES[name]}:\n")
        print(table(kept["rows"]))
    if o.write:
        tool.store(o.write, "agreement", {**tool.results(o.write, "agreement"), **result})
