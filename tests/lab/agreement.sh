#!/bin/sh
# scripts/lab agreement: people's views and a test scene through to the tables, with the numbers of ggn evaluate.
. "$(dirname "$0")/../cli/ggn_setup"
agreement() { scripts/lab agreement --human "$tmp/human" --rendered "$tmp/rendered" --observer "$tmp/o.json" --out "$tmp/out" "$@" >"$tmp/table" 2>"$tmp/err"; }
record() { # record FOLDER NAME SEED REFERENCE-SPP SCENE [OPTION ...]
    folder=$1 name=$2 seed=$3 reference=$4 scene=$5
    shift 5
    "$BUILD/bin/lull-render" -q "$scene" --size 400x200 --sampler independent --levels geometric:4:24:1.3 --seed "$seed" \
        --reference-spp "$reference" --sequence "$folder" --name "$name" "$@" >"$tmp/table" 2>"$tmp/err"
}
mkdir -p "$tmp/human/views" "$tmp/data/test" "$tmp/rendered"
record "$tmp/human/views/one" one 1 0 tests/cli/room.pbrt && record "$tmp/human/views/two" two 2 0 tests/cli/room.pbrt && record "$tmp/data/test/room" room 3 0 tests/cli/room.pbrt &&
    record "$tmp/data/test/sky" sky 3 64 scenes/bright-sky.pbrt
check "recorded" $?
printf 'one_part6;300;900;\ntwo_part6;30;10000;\n' >"$tmp/human/human-thresholds.csv"
cp "$tmp/human/human-thresholds.csv" "$tmp/human/SVD-Entropy-thresholds.csv"
view() { printf '{"name": "%s", "level": 0.25}' "$1"; }
printf '{"level": 0.25, "spread": 0.4, "each_view_left_out": [%s, %s]}\n' "$(view one)" "$(view two)" >"$tmp/o.json"
agreement --data "$tmp/none" && [ "$(grep -c 'Against' "$tmp/table")" -eq 2 ] && [ "$(grep -c '^| 4 blocks, 1 censored ' "$tmp/table")" -eq 2 ]
check "no recordings: people alone, with several values of --visible" $?
find "$tmp/data" -type f -exec sha256sum {} + | sort >"$tmp/before"
agreement --data "$tmp/data" && [ "$(grep -c 'Against' "$tmp/table")" -eq 5 ]
check "five tables" $?
find "$tmp/data" -type f -exec sha256sum {} + | sort | cmp -s - "$tmp/before"
check "the recordings are left as they were" $?
grep -q '^| SVD-Entropy-thresholds.csv |  | 0 % | 1.00 | 0.00 | +0.00 | 100 % | 1.00 |' "$tmp/table"
check "thresholds equal to the people's agree with them" $?
for name in '4 observer' '3 lull-3.ggn' '2 halfbuf' '2 variance' '2 26 attributes + SVM' '2 noise mask + SVM' '2 −spp (looks at no pixel)'; do
    [ "$(grep -c "^| ${name#* } |" "$tmp/table")" -eq "${name%% *}" ] || { echo "$name" >>"$tmp/err"; false; } || break
done
check "every criterion in the tables that it belongs to" $?
python3 - "$tmp/table" "$tmp/out/agreement.json" <<'EOF' 2>"$tmp/err"
import json, sys
lines = [l for l in open(sys.argv[1], encoding="utf-8") if l.startswith("| observer |")]
r = json.load(open(sys.argv[2]))
assert r["people"]["rows"]["observer"] == r["visible"]["rows"]["observer, `--visible 0.35`"]
assert r["people"]["measured"]["visible"] == 0.35 and r["people"]["measured"]["level"] == 0.25, "said of whom the figures are"
rows = [t["rows"] for name, t in r.items() if name != "visible"]
assert len(lines) == len(rows) == 4, lines
for line, row in zip(lines, (r["observer"] for r in rows)):
    cell = [c.strip() for c in line.split("|")[2:-1]]
    assert cell[1] == "%.0f %%" % (100 * row["early_stop_rate"]) and float(cell[2]) == round(row["samples_ratio"], 2), (cell, row)
assert rows[2]["observer"]["samples_ratio"] < rows[1]["observer"]["samples_ratio"], "half of the viewers cost no less than three quarters"
EOF
check "the figures are those of ggn evaluate, and the quality parameter counts" $?
record "$tmp/rendered/two" two 5 0 tests/cli/room.pbrt --levels geometric:4:60:1.3 --blocks 1 && agreement --data "$tmp/none" &&
    [ "$(grep -c 'Against' "$tmp/table")" -eq 4 ] && [ "$(grep -c '^| 1 blocks, 1 censored ' "$tmp/table")" -eq 2 ] &&
    [ "$(grep -c '^| observer |' "$tmp/table")" -eq 3 ] && [ "$(grep -c '^| halfbuf |' "$tmp/table")" -eq 1 ]
check "rendered blocks of people's views beside the same blocks made from halves" $?
python3 - "$tmp/out" <<'EOF' 2>"$tmp/err"
import json, sys
rendered, made = (json.load(open(f"{sys.argv[1]}/{k}/people/two/manifest.json")) for k in ("rendered", "made"))
assert [b["id"] for b in rendered["blocks"]] == [b["id"] for b in made["blocks"]] == [1] and rendered["levels"][-1] > made["levels"][-1]
EOF
check "each from its own recordings" $?
rm "$tmp/human/human-thresholds.csv"
! agreement && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q 'no thresholds of people there' "$tmp/err"
check "no people" $?
echo "1..$n"
exit $bad
