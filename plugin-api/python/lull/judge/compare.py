# SPDX-License-Identifier: MIT
"""`ggn compare`: stop maps or thresholds against (human) thresholds."""
from __future__ import annotations

import math
import os
from typing import Any, NamedTuple, Optional, Sequence

from ..study.files import Refused, make_folder, replaced
from ..study.options import Command, Option, block_size, real
from . import rules, stats
from .options import protect
from .replayed import ggn

COMMAND = Command(
    "ggn compare", "REFERENCE MODEL", 2, 2,
    "How well the stops or thresholds in MODEL agree with those in REFERENCE (people first). Both may be CSV (name;t0;...), a "
    "render's report JSON, labels.json, or an EXR with the channel lull.spp.V. Where one of them is of people's study, as a CSV is "
    "taken to be, samples at which no noise is seen (of renders and labels) become those of the study.",
    (Option("json", "", "print the statistics as one JSON object", letter="j"),
     Option("output", "DIR", "write blocks.csv and summary.json there; lull-plot draws the first", letter="o"),
     Option("view", "NAME", "compare with this view of REFERENCE only", letter="v"),
     Option("stops", "", "MODEL is a stop map, also as CSV: samples at which no noise is seen, not those of a study"),
     Option("cap", "SPP", "thresholds at the cap are censored (10000 in samples of the study, else 20000)", real(1e-9, 1e12), "c"),
     Option("block", "N|WxH", "blocks of an EXR that does not say theirs, in pixels (200)", block_size(32768), "b")))

CONVERSION = f"1/(1/n + 1/{rules.STUDY_REFERENCE:.0f})"

ROWS = (
    ("pearson_r", "%.4f", "Pearson r"), ("pearson_r_below_cap", "%.4f", "Pearson r, true below cap"),
    ("spearman", "%.4f", "Spearman rho"), ("spearman_below_cap", "%.4f", "Spearman rho, true below cap"),
    ("mae", "%.1f", "mean absolute error (spp)"), ("mae_below_cap", "%.1f", "  true below cap"), ("rmse", "%.1f", "RMSE (spp)"),
    ("share_below", "%.4f", "share below the true threshold"),
    ("early_stop_rate", "%.4f", "share below 0.8 x true (early stops)"),
    ("samples_ratio", "%.4f", "samples / samples at the true thresholds"),
    ("median_abs_log2", "%.4f", "median |log2(model/true)|"), ("median_log2", "%.4f", "median log2(model/true)"),
    ("iqr_log2", "%.4f", "inter-quartile range of log2"), ("within_half", "%.4f", "share within 1/2 octave"),
    ("within_one", "%.4f", "share within 1 octave"))


class Pair(NamedTuple):
    """A view as both sides know it."""
    truth: dict[str, Any]
    model: dict[str, Any]

    def are_of_study(self) -> tuple[bool, bool]:
        return self.truth["of_study"], self.model["of_study"]

    def blocks(self) -> list[tuple[int, float, float]]:
        """(number, true, model's) of those that both know, on one scale: that of the study if one of them is of it."""
        is_study = any(self.are_of_study())
        true, model = ([rules.to_study(v) if v is not None and is_study and not side["of_study"] else v for v in side["spp"]]
                       for side in self)
        return [(i, t, m) for i, (t, m) in enumerate(zip(true, model)) if t is not None and m is not None]

    def columns(self) -> int:
        return self.truth["columns"] or self.model["columns"] or math.ceil(math.sqrt(len(self.truth["spp"])))


def _partner(view: dict[str, Any], truth: Sequence[Any], model: Sequence[Any], wanted: Optional[str]) -> Optional[dict[str, Any]]:
    if len(model) == 1 and (wanted is not None or len(truth) == 1 and (view["unnamed"] or model[0]["unnamed"])):
        return model[0]
    return rules.of_view(model, view["name"])


def pairs(truth: Sequence[Any], model: Sequence[Any], wanted: Optional[str]) -> list[Pair]:
    if wanted is not None:
        truth = [view for view in [rules.of_view(truth, wanted)] if view]
    found = [Pair(t, m) for t in truth if (m := _partner(t, truth, model, wanted))]
    for t, m in found:
        if len(t["spp"]) != len(m["spp"]):
            raise Refused(f"view '{t['name']}': {len(t['spp'])} blocks against {len(m['spp'])}")
    if not any(p.blocks() for p in found):
        raise Refused(f"no view called '{wanted}' to compare" if wanted is not None else
                      "no view has the same name on both sides (--view NAME names the partner of a single view)")
    return found


def _json(figures: dict[str, Any]) -> str:
    members = [f'"{k}": {"null" if math.isnan(figures[k]) else "%.6f" % figures[k]}' for k, _, _ in ROWS]
    head = f'"blocks": {figures["blocks"]}, "blocks_below_cap": {figures["blocks_below_cap"]}'
    return "{" + ", ".join([head, *members, f'"scale": "{figures["scale"]}"']) + "}"


def _table(figures: dict[str, Any]) -> list[str]:
    lines = [f"{'blocks':42} {figures['blocks']:10}", f"{'  true below cap':42} {figures['blocks_below_cap']:10}"]
    for key, form, text in ROWS:
        value = figures[key]
        lines.append("%-42s %10s" % (text, "-" if math.isnan(value) else form % (value + 1e-12)))  # half of a digit rounds up
    return lines


def _write(folder: str, found: Sequence[Pair], figures: dict[str, Any]) -> None:
    make_folder(folder)
    with replaced(os.path.join(folder, "blocks.csv")) as file:
        file.write("view;block;true_spp;model_spp;log2_error;column;row\n")
        for p in found:
            for i, t, m in p.blocks():
                row, column = divmod(i, p.columns())
                file.write(f"{p.truth['name']};{i};{t:.10g};{m:.10g};{math.log2(m / t):.4f};{column};{row}\n")
    with replaced(os.path.join(folder, "summary.json")) as file:
        file.write(_json(figures) + "\n")


def run(program: str, paths: Sequence[str], o: dict[str, Any]) -> None:
    out = o.get("output")
    protect(paths, [os.path.join(out, name) for name in ("blocks.csv", "summary.json")] if out else [])
    truth, model = ggn(program, COMMAND.name, "thresholds", f"--block={o.get('block', 200)}", "--", *paths)
    if "stops" in o:
        model = [{**view, "of_study": False} for view in model]
    found = pairs(truth, model, o.get("view"))
    both = [(t, m) for p in found for _, t, m in p.blocks()]
    of_study = [is_one for p in found for is_one in p.are_of_study()]
    cap = o.get("cap", rules.STUDY_CAP if any(of_study) else rules.SIMULATED_CAP)
    figures = stats.agreement([t for t, _ in both], [m for _, m in both], cap)
    figures["scale"] = "study" if any(of_study) else "no noise"
    if out:
        _write(out, found, figures)
    if "json" in o:
        print(_json(figures))
        return
    names = found[0].truth["name"], found[0].model["name"]
    print("'%s' against '%s'" % names if len(found) == 1 and names[0] != names[1] else
          f"{len(found)} view{'' if len(found) == 1 else 's'} in common")
    print("in samples at which no noise is seen" if not any(of_study) else
          "in samples of the study, as both have them" if all(of_study) else f"in samples of the study; n at which no noise is seen are {CONVERSION} of them")
    print("\n".join(_table(figures)))
