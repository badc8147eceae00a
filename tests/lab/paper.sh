#!/bin/sh
# scripts/lab paper: the arithmetic of its table, in closed form, and what it says where people's thresholds are not at hand.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
t "AUC, accuracy and thresholds of known windows" /usr/bin/python3 - "$tmp" <<'END'
import math, sys
sys.path.insert(0, "scripts")
from lablib import paper
# view a is told perfectly; of view b 1 of 2 and 1 of 2 pairs are in order
rows = [("a", 0.9, 1), ("a", 0.8, 1), ("a", 0.6, 0), ("a", 0.2, 0), ("b", 0.7, 1), ("b", 0.3, 1), ("b", 0.8, 0), ("b", 0.1, 0)]
def windows(*weights):
    of = paper.Windows()
    for row, weight in zip(rows, weights or [1] * len(rows)):
        of.add(*row, weight)
    return of
of = paper.figures(windows(), (0.5, 0.75))
assert of["views"]["auc"] == (1 + 0.5) / 2 and of["views"]["best"] == (1 + 0.75) / 2 and of["views"]["accuracy"] == [5 / 8, 5 / 8], of
assert of["pooled"]["auc"] == (4 + 3.5 + 3 + 2) / 16 and of["pooled"]["accuracy"] == [5 / 8, 5 / 8] and of["pooled"]["best"] == 6 / 8, of
heavy = paper.figures(windows(3, 1, 1, 1, 1, 1, 1, 1), (0.5,))["pooled"]  # a window of weight 3 is three windows
assert heavy["auc"] == (3 * 4 + 3.5 + 3 + 2) / 24 and heavy["accuracy"] == [7 / 10] and heavy["best"] == 8 / 10, heavy
with open(sys.argv[1] + "/t.csv", "w") as file:
    file.write("p3d_a-view0_part6;100;200;\nother;1;2;\n")
assert paper.thresholds(sys.argv[1] + "/t.csv") == {"p3d_a-view0_part6": [100, 200]}
block = {"view": 0, "id": 1, "threshold": 90, "spp": [50, 150, 250], "noisy": [1, 0, None], "error": [4, 0.5, 0.5]}
other = {"view": 1, "id": 0, "threshold": 100, "spp": [], "noisy": [], "error": []}
replay = {"views": [{"name": "p3d_a-view0"}, {"name": "p3d_b-view0"}], "blocks": [block, other, dict(other, threshold=200)],
          "methods": [{"scores": [[0.9, 0.1, 0.1], [], []]}]}
found, count = paper.judged(replay, {"SVD-Entropy": {"p3d_a-view0_part6": [100, 120]}})
both = dict(replay, methods=[{"scores": [[None, 0.9, 0.9], [], []]}, *replay["methods"]])  # ggn replay has baselines before networks
beside, _ = paper.judged(both, {}, ["LSTM", "lull-3"])
assert beside["lull-3"] == found["lull-3"] and list(beside)[:2] == ["lull-3", "LSTM"], beside
assert beside["LSTM"]["pooled"]["auc"] == 1 and beside["LSTM"]["pooled"]["accuracy"][0] == 0.5, beside["LSTM"]  # no answer yet: noisy
assert count == 2 and found["lull-3"]["pooled"]["auc"] == 1 and found["law"]["pooled"]["accuracy"][paper.CUTS.index(0.6)] == 1, found
assert paper.wanted_above(replay, 0, 50) == 1 and paper.wanted_above(replay, 0, 150) == 0.5
assert found["SVD-Entropy"]["pooled"] == {"auc": None, "accuracy": None, "best": 1.0}, found
END
t "no thresholds of people" sh -c "scripts/lab paper --human $tmp/none 2>$tmp/said; [ \$? = 2 ] && grep -q 'none/human-thresholds.csv: no thresholds of people there' $tmp/said"
echo "1..$n"
exit $bad
