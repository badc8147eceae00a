# SPDX-License-Identifier: MIT
"""`ggn evaluate`: figures of models, baselines and criteria on recorded sequences."""
from __future__ import annotations

import math
import os
from typing import Any, Optional, Sequence

from ..study import stats
from ..study.files import Refused, make_folder, print_json, replaced
from ..study.options import Command, Option, integer, real
from ..study.stats import NAN
from .options import HOW, JUDGES, POLICY, SCENES, THRESHOLDS, WHERE, forwarded, inputs_of, needed, protect
from .replayed import SPLITS, Method, Replay

REPLAYED = (*WHERE, *SCENES, *JUDGES, *POLICY, *HOW)
COMMAND = Command(
    "ggn evaluate", "", 0, 0,
    "Measures models, the trivial baselines and the criteria halfbuf and variance on the same recorded sequences, separately for "
    "training, validation and test scenes and for views that people judged.",
    (*REPLAYED, THRESHOLDS,
     Option("json", "", "print the figures as JSON", letter="j"),
     Option("output", "DIR", "write figures.json and stops there; lull-plot draws the first", letter="o"),
     Option("early", "RATE", "early-stop rate that cuts are tuned for on the training scenes (0.05)", real(0, 1)),
     Option("retune", "", "tune the models' thresholds too, on the validation scenes, instead of taking the stored ones"),
     Option("window", "S", "levels that a window has when no model says so (6)", integer(1, 16), "w")))

# key, column head, format
FIGURES = (
    ("auc", "AUC", "%.4f"), ("auc_scene_mean", "AUC/scene", "%.4f"), ("accuracy", "accuracy", "%.4f"),
    ("best_accuracy", "best acc", "%.4f"), ("early_stop_rate", "early", "%.3f"), ("samples_ratio", "samples", "%.3f"),
    ("median_abs_log2", "|log2|", "%.3f"), ("median_log2", "log2", "%.3f"), ("iqr_log2", "IQR", "%.3f"),
    ("within_half", "in 1/2", "%.3f"), ("within_one", "in 1", "%.3f"), ("pearson_r", "r", "%.3f"), ("spearman", "rho", "%.3f"),
    ("mae", "MAE", "%.0f"), ("flip_mean", "FLIP", "%.4f"), ("flip_worst", "worst", "%.4f"), ("ssim_mean", "SSIM", "%.4f"),
    ("ssim_worst", "worst", "%.4f"), ("uniform_spp", "uniform", "%.0f"), ("samples_vs_uniform", "smp/uni", "%.3f"),
    ("time_vs_uniform", "time/uni", "%.3f"))


# --- figures of a method on a split ---

def _windows(m: Method, indices: Sequence[int]) -> tuple[list[float], list[int]]:
    """Scores, and whether noise is seen, of the cases where both are known."""
    assert m.scores is not None
    pairs = [(s, n) for i in indices for s, n in zip(m.scores[i], m.blocks[i].noisy) if n is not None and not math.isnan(s)]
    return [s for s, _ in pairs], [n for _, n in pairs]


def _of_scores(m: Method, indices: Sequence[int]) -> dict[str, Any]:
    score, noisy = _windows(m, indices)
    scenes = [stats.auc(*_windows(m, [i for i in indices if m.blocks[i].scene == scene]))
              for scene in dict.fromkeys(m.blocks[i].scene for i in indices)]
    known = [v for v in scenes if not math.isnan(v)]
    return {"windows": len(score), "auc": stats.auc(score, noisy), "auc_scene_mean": stats.mean(known),
            "accuracy": NAN if math.isnan(m.cut) else stats.share([(s >= m.cut) == bool(n) for s, n in zip(score, noisy)]),
            "best_accuracy": stats.best_accuracy(score, noisy)}


def _of_thresholds(m: Method, indices: Sequence[int]) -> dict[str, Any]:
    """A censored block counts for early stops, where it stops below 0.8 of the cap, and for samples."""
    stops = [m.blocks[i].compared(m.stops[i]) for i in indices]
    needs = [m.blocks[i].compared(m.blocks[i].threshold) for i in indices]
    known = [k for k, i in enumerate(indices) if not m.blocks[i].censored]
    return {**stats.agreement([needs[k] for k in known], [stops[k] for k in known]),
            "early_stop_rate": stats.share([stop < 0.8 * need for stop, need in zip(stops, needs)]),
            "samples_ratio": sum(stops) / sum(needs)}


def _of_quality(m: Method, indices: Sequence[int]) -> dict[str, Any]:
    """At the stop; and uniform sampling whose worst block is as good by FLIP."""
    blocks = [m.blocks[i] for i in indices]
    at = [b.case(m.stops[i]) for b, i in zip(blocks, indices)]
    flip, ssim = [b.flip[k] for b, k in zip(blocks, at)], [b.ssim[k] for b, k in zip(blocks, at)]
    found = {"flip_mean": stats.mean(flip), "ssim_mean": stats.mean(ssim), "flip_worst": NAN, "ssim_worst": NAN,
             "uniform_spp": NAN, "samples_vs_uniform": NAN, "time_vs_uniform": NAN}
    if math.isnan(found["flip_mean"]):
        return found
    worst, need = max(flip), 0.0
    for b in blocks:  # the first count from which on none is worse
        k = len(b.spp) - 1
        while k > 0 and b.flip[k - 1] <= worst:
            k -= 1
        need = max(need, b.spp[k])
    uniform = [b.case(need) for b in blocks]
    seconds, uniform_s = sum(b.seconds[k] for b, k in zip(blocks, at)), sum(b.seconds[k] for b, k in zip(blocks, uniform))
    return {**found, "flip_worst": worst, "ssim_worst": min(ssim), "uniform_spp": need,
            "samples_vs_uniform": sum(m.stops[i] for i in indices) / sum(b.spp[k] for b, k in zip(blocks, uniform)),
            "time_vs_uniform": seconds / uniform_s if uniform_s else NAN}


def measured(m: Method, split: str) -> dict[str, Any]:
    """The figures of a method on the blocks of a split, NaN where one is undefined."""
    indices = [i for i, b in enumerate(m.blocks) if b.split == split]
    found = {**_of_thresholds(m, indices), **_of_quality(m, indices)}
    scores = _of_scores(m, indices) if m.scores is not None else {"windows": 0}
    head = {"blocks": len(indices), "censored": sum(m.blocks[i].censored for i in indices), "windows": scores["windows"],
            "oracle": m.oracle, **({} if math.isnan(m.cut) else {"cut": m.cut})}
    found |= scores
    return head | {key: found.get(key, NAN) for key, _, _ in FIGURES}


# --- tables ---

def _rows(found: dict[str, dict[str, Any]], columns: Sequence[tuple[str, str, str]]) -> list[str]:
    lines = [" " * 30 + "".join(f" {head:>9}" for _, head, _ in columns)]
    for name, f in found.items():
        lines.append(f"{name[:30]:30}" + "".join(" %9s" % ("-" if math.isnan(f[k]) else form % f[k]) for k, _, form in columns))
    return lines


def _without_halves(r: Replay, split: str) -> list[str]:
    """How far the thresholds of the observer move where it has no half buffers, in octaves of samples."""
    shift = []
    for i in r.of(split):
        b = r.blocks[i]
        k = b.case(b.threshold)
        if b.error[k] > 0 and b.error_means[k] > 0:
            shift.append(2 * math.log2(b.error_means[k] / b.error[k]))
    size = [abs(v) for v in shift]
    return [] if not shift else [
        f"observer without halves, at the thresholds of {len(shift)} blocks: shifted by {stats.quantile(shift, 0.5):+.3f} "
        f"octaves in the median, |shift| median {stats.quantile(size, 0.5):.3f}, 90th percentile {stats.quantile(size, 0.9):.3f}"]


def _table(r: Replay, split: str, found: dict[str, dict[str, Any]]) -> list[str]:
    first, scenes = next(iter(found.values())), len({r.blocks[i].scene for i in r.of(split)})
    return ["", f"{split}: {first['blocks']} blocks of {scenes} scenes ({first['censored']} censored), {first['windows']} windows",
            *_rows(found, FIGURES[:14]), *_rows(found, FIGURES[14:]), *_without_halves(r, split)]


def _people(r: Replay, methods: Sequence[Method]) -> list[str]:
    """For each of their views the median of |log2| and the early stops."""
    views = [v["name"] for v in r.views if v["split"] == "people"]
    lines = ["", f"{'people: |log2|, early':30}" + "".join(f"  {name[:18]:18}" for name in views)]
    for m in methods:
        line = f"{m.name[:30]:30}"
        for view in views:
            here = [(b.compared(stop), b.compared(b.threshold), b.censored) for b, stop in zip(r.blocks, m.stops) if b.view == view]
            log2 = stats.quantile([abs(math.log2(stop / need)) for stop, need, censored in here if not censored], 0.5)
            line += "  %6.3f %6.3f     " % (log2, stats.share([stop < 0.8 * need for stop, need, _ in here]))
        lines.append(line)
    return lines


# --- what models change ---

def _changes(first: Method, other: Method, split: str) -> dict[str, Any]:
    """Verdicts on windows that both judged, and where blocks stop."""
    assert first.scores is not None and other.scores is not None
    here = [i for i, b in enumerate(first.blocks) if b.split == split]
    both = [(i, k) for i in here for k, (a, b) in enumerate(zip(first.scores[i], other.scores[i]))
            if not math.isnan(a) and not math.isnan(b)]
    return {"from": first.name, "windows": len(both),
            "verdicts_changed": sum(first.passed(i, k) != other.passed(i, k) for i, k in both),
            "blocks": len(here), "stops_changed": sum(first.stops[i] != other.stops[i] for i in here),
            "p_moved_at_most": max((abs(other.scores[i][k] - first.scores[i][k]) for i, k in both), default=0.0)}


def _changes_line(name: str, c: dict[str, Any]) -> str:
    return (f"{name}: {c['verdicts_changed']} of {c['windows']} verdicts and {c['stops_changed']} of {c['blocks']} stops differ "
            f"from {c['from']}; p moves by at most {c['p_moved_at_most']:.2g}\n")


# --- files ---

def _stops(r: Replay, methods: Sequence[Method]) -> list[dict[str, Any]]:
    """Of every block where each method stops, and the scores of its windows."""
    found = []
    for i, b in enumerate(r.blocks):
        windows = {"spp": [b.compared(v) for v in b.spp], "noisy": b.noisy, "scores": {m.name: m.scores[i] for m in methods if m.scores is not None}}
        found.append({"scene": b.scene, "view": b.view, "block": b.id, "threshold": b.compared(b.threshold),
                      "censored": b.censored, "spp": {m.name: b.compared(m.stops[i]) for m in methods}, "split": b.split, "column": b.place[0], "row": b.place[1],
                      "windows": windows})
    return found


def _score_at_stop(m: Method, index: int) -> str:
    """The last score of the method until the stop: a verdict stands until the next check."""
    scores = [s for s in (m.scores[index] if m.scores else [])[:m.blocks[index].case(m.stops[index]) + 1] if not math.isnan(s)]
    return "%.17g" % scores[-1] if scores and math.isfinite(scores[-1]) else ""


def _write_stops(folder: str, r: Replay, split: str, methods: Sequence[Method]) -> None:
    for m in methods:
        word = "".join(c for c in m.name.split("(")[0] if c.isascii() and c.isalnum())
        with replaced(os.path.join(folder, f"{split}-stops-{word}.csv")) as file:
            file.write("view;block;threshold;censored;stop;score\n")
            for i in r.of(split):
                b = r.blocks[i]
                file.write(f"{b.view};{b.id};{b.threshold:.6g};{int(b.censored)};{m.stops[i]:.6g};{_score_at_stop(m, i)}\n")


# --- the command ---

def _check_people(r: Replay, observer: Optional[str]) -> None:
    for v in r.views:
        if v["split"] == "people" and v["labels"] != "human":
            raise Refused(f"{v['folder']}: no human thresholds (ggn label --human CSV {v['folder']})")
        if v["split"] == "people" and not observer:
            raise Refused(f"{v['folder']}: may have been fitted: --observer FILE says what the observer is without it")


def _methods(r: Replay, o: dict[str, Any], tuned_on: str) -> tuple[list[Method], list[Method]]:
    """All, and of these the models."""
    early, spp = o.get("early", 0.05), Method("-spp", r.blocks, [[-v for v in b.spp] for b in r.blocks])
    errors = [m for m in map(r.errors, ("halfbuf", "variance")) if m]
    for m in (spp, *errors):
        m.tune(tuned_on, early)
    _check_people(r, o.get("observer"))
    observers = [r.observer(halves, o.get("visible", r.visible)) for halves in (True, False)]
    models = r.answered("model", lambda m: m["name"][:40])
    if o.get("retune"):
        for m in models:
            Method.tune(m, "validation" if r.of("validation") else tuned_on, early)
    return [spp, r.constant(), r.scene_mean(), *errors, *[m for m in observers if m], *r.from_files(o.get("thresholds", []), "people"),
            *r.answered("baseline", lambda m: m["title"]), *models], models


def run(program: str, _: Sequence[str], o: dict[str, Any]) -> None:
    needed(o, "data", "DATA")
    out = o.get("output")
    protect(inputs_of(o), [out, out and os.path.join(out, "figures.json")])
    if out:
        make_folder(out)
    words = forwarded(o, REPLAYED)
    if "window" in o and "model" not in o:
        words.append(f"--window={o['window']}")
    r = Replay(program, COMMAND.name, words, halves="no_pictures" not in o)
    tuned_on = "train" if r.of("train") else r.blocks[0].split
    methods, models = _methods(r, o, tuned_on)
    splits, changes, told_json = {}, {}, "json" in o
    lines = [f"labels: {r.response['labels']}; split: {r.response['split']}; cuts tuned on {tuned_on} for {100 * o.get('early', 0.05):.1f} % "
             f"early stops{'; views without labels are left out' if r.response['views_without_labels'] else ''}"]
    for split in filter(r.of, SPLITS):
        found = [measured(m, split) for m in methods]
        splits[split] = {m.name: f for m, f in zip(methods, found)}
        lines += _table(r, split, splits[split])
        if split == "people":
            lines += _people(r, methods)
        changes[split] = {m.name: _changes(models[0], m, split) for m in models[1:]}
        lines += [_changes_line(name, c) for name, c in changes[split].items()]
        if out:
            _write_stops(out, r, split, methods)
    root = {"data": o["data"], "labels": r.response["labels"], "split": r.response["split"], "window": r.response["window"],
            "early_rate_tuned_for": o.get("early", 0.05), "tuned_on": tuned_on, "splits": splits, "changes": changes,
            "stops": _stops(r, methods)}
    print(print_json(root, True) if told_json else "\n".join(lines))
    if out:
        with replaced(os.path.join(out, "figures.json")) as file:
            file.write(print_json(root, True) + "\n")
