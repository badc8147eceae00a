#!/bin/sh
# scripts/lab published with a tiny plan: hours end a run, more hours continue it, all validations are drawn; another plan is refused.
. "$(dirname "$0")/../cli/ggn_setup"
published() { scripts/lab published tests/data/train-demo --plan "$tmp/plan" --out "$tmp/out" --beside tests/data/tiny.ggn "$@" >"$tmp/table" 2>"$tmp/err"; }
validations() { wc -l <"$tmp/out/$1.ggn.csv"; }

cat >"$tmp/plan" <<'END'
common --kr 3 --km 3 --kd 4 --batch 8 -q
order --preset paper --epoch-steps 2 --steps 8
rests --preset paper --epoch-steps 2 --steps 8 --lr 2e-3   # one change
END
published --hours 1e-9 && [ "$(validations order)" -eq 2 ] && [ "$(grep -c '^| \(order\|rests\) | `--preset' "$tmp/table")" -eq 2 ]
check "a row for each network" $?
grep -q '^| number of samples alone |  | – ' "$tmp/table" && grep -q '^| tiny |  | – ' "$tmp/table"
check "  …and for what is trivial, and for the model beside them" $?
grep '^| order' "$tmp/table" | awk -F'|' '{ for (i = 4; i <= 11; i++) if ($i !~ /[0-9]/ || $i ~ /nan/) exit 1; if ($5 != 16 || $7 <= 0) exit 1 }'
check "every figure is a number, windows are counted" $?
published --only order && [ "$(validations order)" -eq 5 ] && [ "$(validations rests)" -eq 2 ] && grep -q '^| order .*| 64 |' "$tmp/table"
check "with more hours the one named goes on to its end" $?
published --table && [ "$(validations rests)" -eq 2 ] && grep -q '^| rests ' "$tmp/table"
check "--table trains nothing" $?
PYTHONPATH=scripts /usr/bin/python3 -B - "$tmp" <<'END'
import sys
from lablib import published
judged = {"auc": 0.9, "early_stop_rate": 0.1, "samples_ratio": 1.1, "median_abs_log2": 0.3}
run = published.run_of("order", ["-q"], sys.argv[1] + "/out/order.ggn")
assert len(run["points"]) == 4 and run["points"][-1][1] == 8 and [p[0] for p in run["points"]] == sorted(p[0] for p in run["points"])
published.draw(sys.argv[1], {"runs": [run], "judged": {"order.ggn": judged, "observer": judged}})
END
check "points of all validations in the order of their hours" $?
[ -s "$tmp/published-curve.png" ]
check "  …are drawn" $?
! published --only none && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "only none: expected some of order, rests" "$tmp/err"
check "no such line" $?
sed -i 's/--steps 8/--steps 10/' "$tmp/plan"
! published && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "order.ggn: trained with other options" "$tmp/err"
check "a plan that was changed is refused" $?
echo "1..$n"
exit $bad
