#!/bin/sh
# scripts/lab paper: the arithmetic of its table, in closed form, and what it says where people's thresholds are not at hand.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
t "AUC, accuracy and thresholds of known windows" /usr/bin/python3 - "$tmp" <<'END'
import math, sys
sys.path.insert(0, "scripts")
from lablib import paper
# one view is told perfectly, the other half: 3 of 4 and 2 of 4 pairs in order; together scores .9 .8 .6 .2 | .7 .3 .8 .1
windows = [("a", 0.9, 1), ("a", 0.8, 1), ("a", 0.6, 0), ("a", 0.2, 0), ("b", 0.7, 1), ("b", 0.3, 1), ("b", 0.8, 0), ("b", 0.1, 0)]
of = paper.of_windows(windows, (0.5, 0.75))
assert of["auc_views"] == (1 + 0.5) / 2, of
assert of["auc"] == (4 + 3.5 + 3 + 2) / 16, of
assert of["accuracy"] == [5 / 8, 5 / 8] and of["best"] == 6 / 8, of
with open(sys.argv[1] + "/t.csv", "w") as file:
    file.write("p3d_a-view0_part6;100;200;\nother;1;2;\n")
assert paper.thresholds(sys.argv[1] + "/t.csv") == {"p3d_a-view0_part6": [100, 200]}
block = {"view": 0, "id": 1, "spp": [50, 150, 250], "noisy": [1, 1, None], "error": [4, 1, 0.5]}
replay = {"views": [{"name": "p3d_a-view0"}], "blocks": [dict(block, noisy=[1, 0, None])], "methods": [{"scores": [[0.9, 0.1, 0.1]]}]}
found, count = paper.judged(replay, {"SVD-Entropy": {"p3d_a-view0_part6": [100, 120]}})
assert count == 2 and found["lull-3"]["auc"] == 1 and found["law"]["accuracy"][paper.CUTS.index(0.6)] == 1, found
assert found["SVD-Entropy"] == {"auc": None, "auc_views": None, "accuracy": None, "best": 1.0}, found
END
t "no thresholds of people" sh -c "scripts/lab paper --human $tmp/none 2>$tmp/said; [ \$? = 2 ] && grep -q 'none/human-thresholds.csv: no thresholds of people there' $tmp/said"
echo "1..$n"
exit $bad
