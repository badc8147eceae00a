"""lull.judge: statistics, stopping rules and figures, by hand and from their definitions. Speaks TAP; run by ggn_judge.sh."""
import math
import os
import random

import tap
from lull.judge import compare, cost, evaluate, rules, stats
from lull.judge.replayed import Block, LawMethod, Method, Replay, ggn

GGN = os.path.abspath(os.path.join(os.environ.get("BUILD", "build"), "bin", "ggn"))
HUMAN = "../shared/human/"
SPP = (100.0, 400.0, 1600.0, 6400.0)


def near(a, b, within=1e-12):
    return abs(a - b) <= within * max(1, abs(b))


def block(threshold, rate, **more):
    """A block of a picture of four, recorded up to 400 samples; rate: seconds a sample."""
    view = {"name": "v", "scene": "s", "split": "test", "spread": 0.44, "tiles": 4, "width": 20, "height": 20}
    told = {"view": 0, "id": 0, "column": 0, "row": 0, "threshold": threshold, "cap": 6400, "censored": False, "simulated": False,
            "reference": True, "pixels": 100, "noisy": [int(spp < threshold) for spp in SPP], "spp": SPP,
            "seconds": [rate * 100, rate * 400, None, None], "flip": [spp**-0.5 for spp in SPP], "relmse": [2 / spp for spp in SPP],
            **{k: [None] * 4 for k in ("dammertz", "half_unsettled", "rse", "rse_unsettled", "ssim", "error", "error_means")}, **more}
    return Block([view], told)


def blocks():
    return [block(100, 1e-3), block(400, 2e-3), block(1600, 4e-3)]


def test_correlations():
    """correlations, quantiles and areas, by hand"""
    x, y = [1, 2, 3, 4], [2, 3, 4, 6.5]
    assert near(stats.pearson(x, [2, 4, 6, 9]), 11.5 / math.sqrt(5 * 26.75)) and near(stats.pearson(x, x[::-1]), -1)
    assert math.isnan(stats.pearson(x, [5] * 4)) and near(stats.spearman(x, y), 1)
    assert near(stats.spearman(x, [1, 1, 2, 3]), 4.5 / math.sqrt(5 * 4.5))  # ranks 1.5 1.5 3 4
    assert [stats.quantile([4, 1, 3, 2], q) for q in (0.25, 0.5, 1)] == [1.75, 2.5, 4] and math.isnan(stats.quantile([], 0.5))
    assert stats.auc([0.1, 0.4, 0.35, 0.8], [0, 0, 1, 1]) == 0.75 and stats.auc([1] * 4, [0, 0, 1, 1]) == 0.5
    assert math.isnan(stats.auc([1, 2], [1, 1]))
    assert stats.best_accuracy([0.1, 0.4, 0.35, 0.8], [0, 0, 1, 1]) == 0.75 and stats.best_accuracy([1] * 4, [0, 0, 1, 1]) == 0.5


def test_agreement():
    """predicted against true thresholds, by hand"""
    a = stats.agreement([100, 1000, 10000, 2000], [200, 790, 10000, 1700], 10000)
    assert (a["blocks"], a["blocks_below_cap"]) == (4, 3) and near(a["mae"], 610 / 4) and near(a["mae_below_cap"], 610 / 3)
    assert near(a["rmse"], math.sqrt(144100 / 4)) and near(a["pearson_r"], 0.9992308294157498)
    assert near(a["pearson_r_below_cap"], 0.9957550460225943) and near(a["spearman"], 1) and a["share_below"] == 0.5
    assert a["early_stop_rate"] == 0.25 and near(a["samples_ratio"], 12690 / 13100)  # 790 < 800; 1700 > 1600
    assert (a["within_half"], a["within_one"]) == (0.75, 1)
    none = stats.agreement([], [])
    assert none["blocks"] == 0 and all(math.isnan(none[k]) for k in ("mae", "spearman", "median_log2", "within_one"))


def test_published():
    """published models against people: the figures of their paper's data"""
    if not os.path.exists(HUMAN + "human-thresholds.csv"):
        return
    for name, want in (("SVD-Entropy", (0.7083, 0.7666, 0.7766, 1580.8, 1512.9, 2159.2, 0.4438, 0.9373)),
                       ("26-attributes", (0.6187, 0.6862, 0.6995, 1875.3, 1907.4, 2522.4, 0.3750, 1.0667))):
        truth, model = ggn(GGN, "test", "thresholds", HUMAN + "human-thresholds.csv", f"{HUMAN}{name}-thresholds.csv")
        found = compare.pairs(truth, model, None)
        both = [(t, m) for p in found for _, t, m in p.blocks()]
        assert (len(found), len(both)) == (40, 640)
        a = stats.agreement([t for t, _ in both], [m for _, m in both], 10000)
        keys = ("pearson_r_below_cap", "pearson_r", "spearman", "mae", "mae_below_cap", "rmse", "share_below", "samples_ratio")
        for key, value in zip(keys, want):
            assert abs(a[key] - value) <= (0.0501 if value > 10 else 0.0000501), (name, key, a[key])


def test_limit():
    """stopped exactly at their thresholds: nothing visible, and the time against uniform samples is the limit"""
    f = cost.figures(blocks(), [100, 400, 1600], [0] * 3, 100)
    assert f["blocks"] == 3 and f["worst"] == 1 and f["noisy"] == 0 and f["uniform_spp"] == 1600
    assert near(f["samples_ratio"], 700 / 1600) and near(f["sampling_s"], 7.3 / 3) and near(f["time_ratio"], 7.3 / (1600 * 7e-3))


def test_early_stops():
    """stopped early: checks, samples, FLIP and relMSE between the cases"""
    f = cost.figures(blocks(), [90, 300, 400], [2, 3, 7], 100)  # above 0.8 of the first; the last shows twice what is visible
    assert f["noisy"] == 1 and near(f["early"], 2 / 3) and near(f["worst"], 2) and near(f["checks_full"], 4)
    assert near(f["flip"], sum(n**-0.5 for n in (90, 300, 400)) / 3) and near(f["relmse"], sum(2 / n for n in (90, 300, 400)) / 3)
    assert near(f["flip_worst"], 90**-0.5) and near(f["uniform_spp"], 400)
    alone = cost.figures([block(100, 0)], [100], [1], 100)
    assert math.isnan(alone["time_ratio"]) and alone["samples_ratio"] == 1  # no time was recorded


def test_rows():
    """a block stops at the end of a row of passes, cases that were not judged and guards left out"""
    b, nan = block(50, 1), math.nan
    score = [0.2, 0.9, 0.1, nan, 0.1]
    spp, stop = (40, 80, 160, 320, 640), lambda *how: rules.Ladder(spp, score, 1280, *how).stop(0.5)
    assert stop() == 40 and stop(2) == 640  # 160, (320 not judged), 640
    assert stop(2, [0, 0, 0.01, 0, 0]) == 640  # a guard leaves the passes counted so far
    assert stop(2, [0, 0, 0.01, 0, 0.01]) == 1280 and stop(2, [0, 0, 0.01, 0, 0.01], 0.01) == 640
    assert rules.Ladder(spp, [1.0] * 5, 1280).stop(0.5) == 1280  # never: the last level
    assert b.case(400) == 1 and b.case(401) == 2 and b.case(9999) == 3


def test_tuning():
    """no other cut between two scores does better, whatever share of early stops is allowed"""
    rng, limits = random.Random(3), (0.0, 1e-4, 1e-3, 1e-2, math.inf)
    for n in range(12):
        here = [block(50 * 3**(i % 4), 1) for i in range(6)]
        scores = [[100 / spp * math.exp(1.5 * rng.gauss(0, 1)) for spp in b.spp] for b in here]
        guards = [[3e-2 / spp * math.exp(3 * rng.gauss(0, 1)) for spp in b.spp] for b in here] if n % 3 else None
        m, rate, best = Method("made up", here, scores, 1, guards), n % 6 / 5, (True, math.inf, math.inf)

        def price(cut, limit):
            stops = [next((spp for k, spp in enumerate(b.spp) if scores[i][k] < cut and not (guards and guards[i][k] > limit)), b.cap)
                     for i, b in enumerate(here)]
            early = sum(stop < 0.8 * b.threshold for stop, b in zip(stops, here)) / len(here)
            return (early > rate, early if early > rate else 0, sum(stops))

        m.tune("test", rate)
        best = min(price(cut, limit) for cut in [s for row in scores for s in row] + [math.inf] for limit in limits)
        assert price(m.cut, m.limit) == best and sum(m.stops) == best[2], (n, best)


def test_observer():
    """half the viewers see what is just seen; the law's stop is where the error falls to the one asked for"""
    assert rules.p_noisy(1, 0.44) == 0.5 and rules.p_noisy(0, 0.44) == 0 and near(rules.error_at(0.5, 0.44), 1, 1e-9)
    assert all(near(rules.p_noisy(rules.error_at(share, 0.44), 0.44), share, 1e-9) for share in (0.01, 0.35, 0.9))
    error = [20 / math.sqrt(spp) for spp in SPP]  # 1 at 400
    for growth in (1.05, 1.5, 2):
        stop, asked = rules.law_stop(SPP, error, 6400, 1, 16, growth)
        assert 400 <= stop <= 417 and asked >= math.log(4) / math.log(growth), (growth, stop, asked)
    assert rules.law_stop(SPP, error, 6400, 1e-3, 16, 1.5)[0] == 6400
    late, _ = rules.law_stop(SPP, error, 6400, 1, 16, 2, [1.0] * 4)  # an octave of noise more: two of samples
    assert 1600 <= late <= 1664 and near(rules.to_study(rules.from_study(300)), 300) and rules.from_study(10000) == 20000


def test_figures():
    """every figure of a method once more from its definition"""
    here = [block(t, r, ssim=[1 - spp**-0.5 for spp in SPP]) for t, r in ((90, 1e-3), (300, 2e-3), (5000, 4e-3))]
    here[2].censored = True
    m = Method("made up", here, [[4, 0.4, 0.3, 0.1], [3, 2, 0.2, 0.1], [5, 4, 3, 2]])
    m.run(0.5)
    assert m.stops == [400, 1600, 6400] and [m.checks(i) for i in range(3)] == [2, 3, 4]
    f = evaluate.measured(m, "test")
    pairs = [(a, b) for n, row in zip((x.noisy for x in here), m.scores) for a, one in zip(row, n) if one
             for k, other in zip((x.noisy for x in here), m.scores) for b, two in zip(other, k) if not two]
    assert near(f["auc"], sum((a > b) + 0.5 * (a == b) for a, b in pairs) / len(pairs)) and f["auc"] == f["auc_scene_mean"]
    assert f["accuracy"] == sum((s >= 0.5) == n for b, row in zip(here, m.scores) for s, n in zip(row, b.noisy)) / 12
    assert (f["blocks"], f["censored"], f["windows"], f["cut"], f["early_stop_rate"]) == (3, 1, 12, 0.5, 0)
    assert near(f["samples_ratio"], 8400 / 5390) and near(f["mae"], (310 + 1300) / 2)
    assert near(f["flip_worst"], 1 / 20) and near(f["ssim_worst"], 1 - 1 / 20) and f["uniform_spp"] == 400
    assert near(f["samples_vs_uniform"], 8400 / 1200) and math.isnan(f["time_vs_uniform"])  # beyond 400 no time was recorded
    m.scores = None
    assert math.isnan(evaluate.measured(m, "test")["auc"]) and evaluate.measured(m, "test")["windows"] == 0


def test_replayed():
    """of recordings: the trivial methods, the criteria's own errors, and what the observer stops at is what it was asked for"""
    r = Replay(GGN, "test", ["-d", "tests/data/recorded", "-w", "4", "--no-quality", "-O", "ggn/sight/observer.json"])
    train = sorted(r.blocks[i].threshold for i in r.of("train"))
    assert set(r.constant().stops) <= {stats.quantile(train, 0.5), *[b.cap for b in r.blocks]}
    oracle = r.scene_mean()
    for scene in {b.scene for b in r.blocks}:
        here = [i for i, b in enumerate(r.blocks) if b.scene == scene]
        assert oracle.oracle and all(near(oracle.stops[i], stats.mean([r.blocks[k].threshold for k in here])) for i in here)
    halfbuf, variance = r.errors("halfbuf"), r.errors("variance")
    for i, b in enumerate(r.blocks):
        assert 0 < b.area < 1 and halfbuf.scores[i] == [v * b.area for v in b.dammertz] and variance.scores[i] == b.rse
        assert halfbuf.guards[i] == b.half_unsettled and variance.guards[i] == b.rse_unsettled
    seen = [r.observer(True, share) for share in (0.9, 0.35, 0.05)]
    assert all(isinstance(m, LawMethod) and a <= b for m in seen for a, b in zip(seen[0].stops, seen[2].stops))
    assert sum(seen[0].stops) < sum(seen[1].stops) < sum(seen[2].stops)


if __name__ == "__main__":
    tap.main(globals())
