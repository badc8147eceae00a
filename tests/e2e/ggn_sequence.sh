#!/bin/sh
# What the path tracer writes, ggn reads: recorded sequences through label, evaluate and reconstruct; stop maps through compare.
. "$(dirname "$0")/../cli/ggn_setup"
lib=$BUILD/lib/lull
"$bin/lull-render" -q scenes/cornell-box.pbrt --size 64x32 --block 32 --sampler independent --levels geometric:20:400:1.35 --reference-spp 512 \
    --sequence "$tmp/data" --name toy >"$tmp/out" 2>"$tmp/err"
check "record two blocks" $?
"$bin/ggn" label "$tmp/data" >"$tmp/out" 2>"$tmp/err" && grep -q '2 blocks labelled by the model observer' "$tmp/out"
check "label them" $?
"$bin/ggn" label --check "$tmp/data" >"$tmp/out" 2>"$tmp/err" && [ "$(grep -c '^data ' "$tmp/out")" -eq 2 ]
check "cheap labels beside rendered ones" $?
"$bin/ggn" evaluate -d "$tmp/data" -w 3 --json >"$tmp/out" 2>"$tmp/err" && grep -q '"halfbuf"' "$tmp/out" && grep -q '"variance"' "$tmp/out"
check "evaluate has the criteria's recorded errors" $?
# Views that people judged: levels from their halves to 10,000 spp, the observer without the view, thresholds of others beside it.
mkdir -p "$tmp/judged/people"
for v in one two; do
    "$bin/lull-render" -q scenes/cornell-box.pbrt --size 64x32 --block 32 --sampler independent --levels linear:64:384:320 \
        --sequence "$tmp/judged/people/$v" --name "toy-$v" >"$tmp/out" 2>"$tmp/err"
done
printf 'one_part6;300;900;\ntwo;500;10000;\n' >"$tmp/people.csv"
printf '{"level": 0.25, "spread": 0.4, "each_view_left_out": [{"name": "one", "level": 0.1}]}\n' >"$tmp/o.json"
"$bin/ggn" label --human "$tmp/people.csv" "$tmp/judged/people/one" >"$tmp/out" 2>"$tmp/err"
fails "people without thresholds" 'two: no human thresholds' "$bin/ggn" evaluate -d "$tmp/judged" -w 3 -O "$tmp/o.json"
"$bin/ggn" label --human "$tmp/people.csv" "$tmp/judged/people" >"$tmp/out" 2>"$tmp/err" && [ "$(grep -c human "$tmp/out")" -eq 2 ]
check "people's thresholds beyond the recording" $?
fails "people and no observer without them" '--observer FILE' "$bin/ggn" evaluate -d "$tmp/judged" -w 3
"$bin/ggn" evaluate -d "$tmp/judged" -w 3 --no-quality -O "$tmp/o.json" --thresholds "$tmp/people.csv" --json >"$tmp/out" 2>"$tmp/err" &&
    python3 - "$tmp/out" <<'EOF'
import json, sys
people = json.load(open(sys.argv[1]))["splits"]["people"]
own, observer = people["people.csv"], people["observer"]
assert own["median_abs_log2"] == 0 and own["early_stop_rate"] == 0 and own["samples_ratio"] == 1 and own["censored"] == 1, own
assert observer["auc"] > 0.5 and observer["blocks"] == 4, observer
EOF
check "evaluate: people's own thresholds agree with themselves" $?
"$bin/ggn" evaluate -d "$tmp/judged" -w 3 --no-quality -O "$tmp/o.json" >"$tmp/out" 2>"$tmp/err" && grep -q '^people: |log2|, early *one *two' "$tmp/out"
check "evaluate: people's views one by one" $?
sed 's/"level": 0.1/"level": 0.25/' "$tmp/o.json" >"$tmp/p.json"
"$bin/ggn" evaluate -d "$tmp/judged" -w 3 --no-quality -O "$tmp/p.json" >"$tmp/other" 2>"$tmp/err" && ! cmp -s "$tmp/out" "$tmp/other" &&
    [ "$(grep -c '^observer  ' "$tmp/other")" -eq 3 ]
check "evaluate: a view is judged by the observer without it" $?
printf 'one;300;900;5;\ntwo;500;800;\n' >"$tmp/size.csv"
fails "thresholds for another size" 'has 3 thresholds' "$bin/ggn" label --human "$tmp/size.csv" "$tmp/judged/people"
fails "published thresholds for another size" 'has 3 thresholds' "$bin/ggn" evaluate -d "$tmp/judged" -w 3 --no-quality -O "$tmp/o.json" \
    --thresholds "$tmp/size.csv"
printf 'two;500;800;\n' >"$tmp/few.csv"
fails "published thresholds without a view" "not all views of the split .people. are in it" "$bin/ggn" evaluate -d "$tmp/judged" -w 3 --no-quality \
    -O "$tmp/o.json" --thresholds "$tmp/few.csv"
fails "calibration without thresholds" "no thresholds for 'one'" "$bin/ggn" label --calibrate "$tmp/few.csv" "$tmp/judged/people"

"$bin/ggn" reconstruct "$tmp/data" -o "$tmp/r.png" --json >"$tmp/out" 2>"$tmp/err" && grep -q '"blocks": 2' "$tmp/out"
check "reconstruct" $?
cp -r "$tmp/data" "$tmp/again"
"$bin/lull-render" -q scenes/cornell-box.pbrt --size 64x32 --block 32 --sampler independent --levels geometric:20:400:1.35 --reference-spp 512 \
    --sequence "$tmp/again" --name toy >"$tmp/out" 2>"$tmp/err" && cmp -s "$tmp/data/block-00001.lseq" "$tmp/again/block-00001.lseq"
check "recording again keeps what is there" $?

"$bin/lull-render" -q scenes/cornell-box.pbrt --size 48x48 --block 16 -c "$lib/halfbuf.so" -p threshold=0.05 --spp-max 64 -o "$tmp/a.exr" \
    --report "$tmp/a.json" --stop-map "$tmp/a.csv" >"$tmp/out" 2>"$tmp/err"
check "render with a stop map" $?
for f in a.exr a.json; do
    "$bin/ggn" compare "$tmp/$f" "$tmp/a.csv" --stops --json >"$tmp/out" 2>"$tmp/err" && grep -q '"blocks": 9,' "$tmp/out" &&
        grep -q '"mae": 0.000000' "$tmp/out"
    check "the stops in $f are those of the CSV" $?
done
echo "1..$n"
exit $bad
