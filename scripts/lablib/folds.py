"""Chooses the threshold of a model from the answers of networks that have each left scenes out.

The training scenes of DATA are dealt out to --folds groups. For each a network is trained on the others (ggn train --resume at
nice 10, one thread; finished ones stay), which does not even read it, and asked where it would stop the group's blocks, for a row of
thresholds. The threshold chosen is the largest with at most --early of all blocks stopped below 0.8 of their label. Its uncertainty is
that of the scenes there happen to be: the same choice for scenes drawn with replacement, from the 16th to the 84th percentile. The
observer is asked alike where it can look.
--record CARD puts that into a model card (MODEL.card.json) under "folds"."""
import json
import os
import random
import shlex
import shutil

from lablib import ablation, recordings, tables, tool
from lablib.tool import Refused, ggn

SHARES = (0.2, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7)
DRAWS, EARLY = 1000, 0.8


def options(parser):
    parser.add_argument("data", type=tool.path, help="a labelled data set with a folder train")
    parser.add_argument("--train", default="", metavar="OPTIONS", help="of ggn train, as one word")
    parser.add_argument("--folds", type=int, default=4, help="groups of scenes (4)")
    parser.add_argument("--early", type=float, default=0.05, help="share of blocks that may stop early (0.05)")
    parser.add_argument("--out", type=tool.path, default=os.path.join(tool.BUILD, "folds"), help="build/folds")
    parser.add_argument("--record", type=tool.path, metavar="CARD", help="a model card that the choice is put into")
    tool.writes(parser)


def scene_of(view):
    return recordings.manifest_of(view)["scene"]


def left_out(data, scenes, target):
    """A data set of the views of these scenes alone, as links with their labels."""
    names = [v for v in os.listdir(data) if os.path.exists(os.path.join(data, v, "labels.json")) and scene_of(os.path.join(data, v)) in scenes]
    for view in recordings.link_views(data, os.path.join(target, "test"), names):
        shutil.copy(os.path.join(data, os.path.basename(view), "labels.json"), view)


def answers(data, model, share):
    """(scene, threshold, {method: samples}) of each block."""
    told = json.loads(ggn("evaluate", "-d", data, "--no-quality", "--json", "-t", 1, "--visible", share, "-m", model))
    name = os.path.basename(model)
    methods = {"observer": "observer", name: "network"}
    return [(b["scene"], b["threshold"], {methods[m]: spp for m, spp in b["spp"].items() if m in methods}) for b in told["stops"]]


def figures(blocks, method):
    early = sum(spp[method] < EARLY * threshold for _, threshold, spp in blocks) / len(blocks)
    return early, sum(spp[method] for _, _, spp in blocks) / sum(threshold for _, threshold, _ in blocks)


def choose(by_share, method, early, scenes=None):
    """The largest share that keeps the rate, the smallest asked if none does."""
    best = SHARES[0]
    for share in SHARES:
        blocks = by_share[share]
        if scenes is not None:
            of = {}
            for block in blocks:
                of.setdefault(block[0], []).append(block)
            blocks = [block for scene in scenes for block in of[scene]]
        if figures(blocks, method)[0] <= early:
            best = share
    return best


def uncertainty(by_share, method, early):
    scenes, draw = sorted({b[0] for b in by_share[SHARES[0]]}), random.Random(1)
    drawn = sorted(choose(by_share, method, early, draw.choices(scenes, k=len(scenes))) for _ in range(DRAWS))
    return drawn[DRAWS * 16 // 100], drawn[DRAWS * 84 // 100]


def summary(by_share, early):
    found = {"blocks": len(by_share[SHARES[0]]), "scenes": len({b[0] for b in by_share[SHARES[0]]}), "early": early, "methods": {}}
    for method in by_share[SHARES[0]][0][2]:
        share = choose(by_share, method, early)
        rate, samples = figures(by_share[share], method)
        found["methods"][method] = {"threshold": share, "range": uncertainty(by_share, method, early), "early_stop_rate": rate, "samples_ratio": samples,
                                    "row": [[s, *figures(by_share[s], method)] for s in SHARES]}
    return found


def page(r):
    rows = [[name, "%.2f" % m["threshold"], "%.2f to %.2f" % tuple(m["range"]), "%.0f %%" % (100 * m["early_stop_rate"]), "%.2f" % m["samples_ratio"]]
            for name, m in r["methods"].items()]
    return "%s; %d blocks of %d scenes, at most %.0f %% early.\n\n%s" % (
        tables.told(r["measured"]) if "measured" in r else "not kept", r["blocks"], r["scenes"], 100 * r["early"],
        tables.table(("", "threshold", "of scenes drawn anew", "early", "samples"), rows))


def main(o):
    train = os.path.join(o.data, "train")
    if not os.path.isdir(train):
        raise Refused("%s: no folder train" % o.data)
    scenes = sorted({scene_of(os.path.join(train, v)) for v in os.listdir(train) if os.path.exists(os.path.join(train, v, "labels.json"))})
    if not 2 <= o.folds <= len(scenes):
        raise Refused("--folds %d: expected 2 to %d, the labelled scenes of %s" % (o.folds, len(scenes), train))
    os.makedirs(o.out, exist_ok=True)
    by_share = {share: [] for share in SHARES}
    for k in range(o.folds):
        model, group = os.path.join(o.out, "fold-%d.ggn" % k), scenes[k::o.folds]
        if not ablation.train([*shlex.split(o.train), "--test", ",".join(group)], o.data, model):
            raise Refused("fold %d is not trained; the same command goes on" % k)
        asked = os.path.join(o.out, "fold-%d" % k)
        left_out(train, group, asked)
        for share in SHARES:
            by_share[share] += answers(asked, model, share)
    result = {**summary(by_share, o.early), "options": o.train, "measured": tool.measured()}
    print(page(result), end="")
    if o.record:
        tool.save({**tool.load(o.record), "folds": {k: v for k, v in result.items() if k != "measured"}}, o.record)
    if o.write:
        tool.store(o.write, "folds", result)
