#!/bin/sh
# scripts/lab folds on a tiny set: each scene is left out once, the threshold is chosen from all answers, finished networks stay.
. "$(dirname "$0")/ggn_setup"
folds() {
    scripts/lab folds "$tmp/data" --out "$tmp/out" --train "--kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 8 --steps-denoiser 5 --steps 10 --epoch-steps 10 -q" \
        "$@" >"$tmp/table" 2>"$tmp/err"
}
mkdir "$tmp/data" && cp -r $data "$tmp/data/train" && rm -f "$tmp/data/train/split.json"
printf '{ "k_r": 3 }\n' >"$tmp/card.json"
folds --folds 2 --early 1 --record "$tmp/card.json" && grep -q '^| network | 0.70 | 0.70 to 0.70 | ' "$tmp/table"
check "the largest threshold where all may stop early" $?
tr -d '\n ' <"$tmp/card.json" | grep -q '^{"k_r":3,"folds":{"blocks":[0-9]*,"scenes":[2-9],"early":1.0,"methods":{"network":{"threshold":0.7,"range":\[0.7,0.7\],'
check "  …in the card" $?
blocks=$(grep -o '[0-9]* blocks' "$tmp/table")
labelled=$(cat "$tmp"/data/train/*/labels.json | grep -c '"threshold"')
[ "$blocks" = "$labelled blocks" ]
check "every block is asked about once" $?
tr -d '\n\t ' <"$tmp/out/fold-0.ggn.card.json" >"$tmp/table" && grep -q '"test":\["scene0","scene2"\]' "$tmp/table" && ! grep -q '"train":\[[^]]*"scene[02]"' "$tmp/table"
check "  …by a network that has not seen it" $?
touch -d '2001-01-01' "$tmp/out/fold-1.ggn" && folds --folds 2 --early 0 && [ "$(stat -c %Y "$tmp/out/fold-1.ggn")" -lt 1000000000 ] &&
    grep -q '^| network | 0\.[2-7][0-9]* | 0\.[2-7][0-9]* to 0' "$tmp/table"
check "networks that are there are not trained again" $?
PYTHONPATH=scripts python3 -B - <<'END'
from lablib import folds
stops = {s: [("a", 100, {"network": 100 * (1 - s)}), ("b", 100, {"network": 100})] for s in folds.SHARES}
assert folds.choose(stops, "network", 0) == 0.2 and folds.choose(stops, "network", 0.5) == 0.7
assert folds.uncertainty(stops, "network", 0) == (0.2, 0.7)
END
check "the largest threshold within the rate; scenes drawn anew" $?
for k in 1 99; do
    ! folds --folds $k && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "expected 2 to " "$tmp/err"
    check "--folds $k" $?
done
echo "1..$n"
exit $bad
