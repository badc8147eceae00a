#!/bin/sh
# ggn cost: every criterion over its dial, the limit below all, the same bytes for any threads, and how it fails.
ggn=${BUILD:-build}/bin/ggn
data=tests/data/train-demo
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 failed=0
check() { # check NAME STATUS
    n=$((n + 1))
    if [ "$2" = 1 ]; then echo "ok $n - $1"; else echo "not ok $n - $1"; head -20 "$tmp/err" | sed 's/^/# /'; failed=1; fi
}
run() { "$ggn" cost "$@" >"$tmp/out" 2>"$tmp/err"; rc=$?; }
one_line() { [ "$(wc -l <"$tmp/err")" -eq 1 ] && [ ! -s "$tmp/out" ]; }
"$ggn" baseline attributes -d $data -o "$tmp/attributes.ggn" >"$tmp/err" 2>&1
run -d $data --split train --baseline "$tmp/attributes.ggn" --threads 1 -o "$tmp/cost.json"
check "it writes a file" $([ $rc = 0 ] && [ -s "$tmp/cost.json" ] && [ ! -s "$tmp/out" ] && echo 1)
run -d $data --split train --baseline "$tmp/attributes.ggn" --threads 2
check "or prints the same, with other threads" $([ $rc = 0 ] && cmp -s "$tmp/out" "$tmp/cost.json" && echo 1)
python3 - "$tmp/cost.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
d = json.load(open(sys.argv[1]))
assert d["split"] == "train" and len(d["scenes"]) == 3
kinds = {p["criterion"] for p in d["points"]}
assert {"uniform", "limit", "attributes"} <= kinds, kinds
limit = next(p for p in d["points"] if p["criterion"] == "limit")["scenes"]
for s in limit:
    assert abs(limit[s]["worst"] - 1) < 1e-6 and limit[s]["noisy"] == 0 and limit[s]["samples_ratio"] < 1
for p in d["points"]:
    for s, f in p["scenes"].items():
        assert p["criterion"] != "uniform" or abs(f["samples_ratio"] - 1) < 1e-9 and abs(f["samples"] - p["value"]) < 1e-6
P
check "uniform costs what uniform costs, the limit is reached by exact stops" $([ $? = 0 ] && echo 1)
run -d $data
check "a split without blocks is one line and exit 2" $([ $rc = 2 ] && one_line && grep -q "split 'test'" "$tmp/err" && echo 1)
run -d $data --split train --baseline ggn/models/lull-2.ggn
check "a network is no baseline: one line and exit 2" $([ $rc = 2 ] && one_line && grep -q "not a baseline" "$tmp/err" && echo 1)
run --split train
check "no data: one line and exit 2" $([ $rc = 2 ] && one_line && echo 1)
run -d $data --split some
check "another split: one line and exit 2" $([ $rc = 2 ] && one_line && echo 1)
echo "1..$n"
exit $failed
