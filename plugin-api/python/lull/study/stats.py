# SPDX-License-Identifier: MIT
"""How two lists of numbers agree. NaN where a value is undefined."""
from __future__ import annotations

import math
from typing import Any, Sequence

NAN = math.nan
TIE = 1e-12  # of a value: above what rounding does to sums of thousands


def mean(x: Sequence[float]) -> float:
    return sum(x) / len(x) if x else NAN


def quantile(x: Sequence[float], q: float) -> float:
    """Linear between order statistics."""
    if not x:
        return NAN
    x = sorted(x)
    at = q * (len(x) - 1)
    i = int(at)
    return x[i] + (at - i) * (x[i + 1] - x[i]) if i + 1 < len(x) else x[-1]


def tied(a: float, b: float) -> bool:
    """Whether two values are one, however they were rounded on the way."""
    return math.isclose(a, b, rel_tol=TIE)


def pearson(x: Sequence[float], y: Sequence[float]) -> float:
    mx, my = mean(x), mean(y)
    xy = sum((a - mx) * (b - my) for a, b in zip(x, y))
    xx, yy = sum((a - mx) * (a - mx) for a in x), sum((b - my) * (b - my) for b in y)
    return NAN if not xx * yy > 0 or tied(min(x), max(x)) or tied(min(y), max(y)) else xy / math.sqrt(xx * yy)


def ranks(x: Sequence[float]) -> list[float]:
    """1 to n; equal values share the mean of their ranks."""
    order, rank, i = sorted(range(len(x)), key=x.__getitem__), [0.0] * len(x), 0
    while i < len(x):
        j = i + 1
        while j < len(x) and tied(x[order[j]], x[order[i]]):
            j += 1
        for k in order[i:j]:
            rank[k] = 0.5 * (i + j + 1)
        i = j
    return rank


def spearman(x: Sequence[float], y: Sequence[float]) -> float:
    return pearson(ranks(x), ranks(y))


def auc(score: Sequence[float], label: Sequence[int]) -> float:
    """Area under the ROC curve of telling label 1 from 0 (Mann-Whitney; ties count half)."""
    p = sum(label)
    q = len(label) - p
    won = sum(r for r, one in zip(ranks(score), label) if one) - 0.5 * p * (p + 1)
    return won / (p * q) if p and q else NAN


def best_accuracy(score: Sequence[float], label: Sequence[int]) -> float:
    """Of "score >= cut means 1", at the best cut."""
    pairs = sorted(zip(score, label))
    right = best = sum(label)  # below all scores: everything is called 1
    for i, (value, one) in enumerate(pairs):
        right += -1 if one else 1
        if i + 1 == len(pairs) or not tied(pairs[i + 1][0], value):
            best = max(best, right)
    return best / len(pairs) if pairs else NAN


def share(values: Sequence[bool]) -> float:
    return sum(values) / len(values) if values else NAN


def agreement(truth: Sequence[float], model: Sequence[float], cap: float = math.inf) -> dict[str, Any]:
    """Predicted against true thresholds, all above 0. Those at the cap are censored: they are not in what is "below_cap"."""
    below = [(t, m) for t, m in zip(truth, model) if t < cap]
    t, m = [p[0] for p in below], [p[1] for p in below]
    errors = [b - a for a, b in zip(truth, model)]
    logs = [math.log2(b / a) for a, b in zip(truth, model)]
    return {
        "blocks": len(truth), "blocks_below_cap": len(below),
        "pearson_r": pearson(truth, model), "pearson_r_below_cap": pearson(t, m),
        "spearman": spearman(truth, model), "spearman_below_cap": spearman(t, m),
        "mae": mean([abs(e) for e in errors]), "mae_below_cap": mean([abs(b - a) for a, b in below]),
        "rmse": math.sqrt(mean([e * e for e in errors])),
        "share_below": share([e < 0 for e in errors]),
        "early_stop_rate": share([b < 0.8 * a for a, b in zip(truth, model)]),
        "samples_ratio": sum(model) / sum(truth) if truth else NAN,
        "median_abs_log2": quantile([abs(v) for v in logs], 0.5), "median_log2": quantile(logs, 0.5),
        "iqr_log2": quantile(logs, 0.75) - quantile(logs, 0.25),
        "within_half": share([abs(v) <= 0.5 for v in logs]), "within_one": share([abs(v) <= 1 for v in logs])}
