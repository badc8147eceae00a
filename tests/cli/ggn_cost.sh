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
assert {"uniform", "fixed", "limit", "attributes"} <= kinds, kinds
limit = next(p for p in d["points"] if p["criterion"] == "limit")["scenes"]
for s in limit:
    assert abs(limit[s]["worst"] - 1) < 1e-6 and limit[s]["noisy"] == 0 and limit[s]["samples_ratio"] < 1
for p in d["points"]:
    for s, f in p["scenes"].items():
        assert p["criterion"] not in ("uniform", "fixed") or abs(f["samples_ratio"] - 1) < 1e-9 and abs(f["samples"] - p["value"]) < 1e-6
        assert p["criterion"] != "fixed" or f["checks_full"] == 1
rows = [p for p in d["points"] if p["criterion"] == "attributes" and p["dial"] == "passes"]
spent = [sum(f["samples"] for f in p["scenes"].values()) for p in rows]
assert len(rows) == 4 and spent == sorted(spent) and spent[0] < spent[3], spent
P
check "uniform costs what uniform costs, the limit is reached by exact stops" $([ $? = 0 ] && echo 1)
run -d $data --split train --cadence 1.1 --no-quality --baseline "$tmp/attributes.ggn" -o "$tmp/cadence.json"
run -d $data --split train --cadence 2 --no-quality -o "$tmp/rare.json" && python3 - "$tmp/cadence.json" "$tmp/rare.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
d, rare = json.load(open(sys.argv[1])), json.load(open(sys.argv[2]))
asked = [sum(f["checks_full"] for f in p["scenes"].values()) for x in (d, rare) for p in x["points"] if p["criterion"] == "observer"]
assert asked[0] > asked[1] > 0, asked
assert abs(d["ratio"] - 1.1) < 1e-9
assert all(b["simulated"] for s in d["scenes"].values() for b in s["blocks"])
assert {(p["dial"], p["value"]) for p in d["points"] if p["criterion"] == "observer"} == {("growth", 1.1)}
assert len([p for p in d["points"] if p["criterion"] == "attributes"]) == 1
P
check "another cadence simulates all levels, and asks the defaults alone" $([ $? = 0 ] && echo 1)
run -d $data --split train --scores --recorded --no-quality -m ggn/models/lull-2.ggn --baseline "$tmp/attributes.ggn" -o "$tmp/scores.json" && python3 - "$tmp/scores.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
d = json.load(open(sys.argv[1]))
assert [p["criterion"] for p in d["points"]] == ["lull-2.ggn"]
p = d["points"][0]
windows = sum(len(s["blocks"]) for s in d["scenes"].values()) * (14 - 5)
assert len(p["scores"]) == windows and 0 < p["cut"] < 1 and all(x is None or 0 <= x <= 1 for x in p["scores"])
assert any(x is not None for x in p["scores"])
P
check "scores of a network's windows, nothing else" $([ $? = 0 ] && echo 1)
run -d $data --split train --no-pictures --recorded --no-quality -m ggn/models/lull-2.ggn -o "$tmp/blind.json"
run -d $data --split train --recorded --no-quality -m ggn/models/lull-2.ggn -o "$tmp/seeing.json" && python3 - "$tmp/blind.json" "$tmp/seeing.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
def spent(file, name):
    points = [p for p in json.load(open(file))["points"] if p["criterion"] == name]
    return {(p["dial"], p["value"]): [s["samples"] for s in p["scenes"].values()] for p in points}
blind, seeing = spent(sys.argv[1], "lull-2.ggn, no halves"), spent(sys.argv[2], "lull-2.ggn")
assert len(blind) > 10 and blind.keys() == seeing.keys() and blind != seeing
P
check "without half buffers a network judges otherwise, and is named so" $([ $? = 0 ] && echo 1)
run -d $data --split train --scores --precision f64 -m ggn/models/lull-2.ggn
check "double precision of blocks that are not the network's size: one line and exit 2" $([ $rc = 2 ] && one_line && grep -q "network's size, 200x200" "$tmp/err" && echo 1)
mkdir -p "$tmp/whole/train" && cp -R $data/scene? "$tmp/whole/train" || exit 2
${BUILD:-build}/bin/pathtracer -q tests/cli/room.pbrt --name room --size 80x80 --block 40 --sampler independent --levels geometric:4:16:1.26 \
    --sequence "$tmp/whole/train/room" && "$ggn" label "$tmp/whole/train/room" >/dev/null
run -d "$tmp/whole" --split train --sizes --no-quality -o "$tmp/sizes.json"
run -d "$tmp/whole" --split train --sizes --recorded --no-quality -o "$tmp/known.json" && python3 - "$tmp/sizes.json" "$tmp/known.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
whole, known = (json.load(open(f))["parts"]["room"] for f in sys.argv[1:])
assert len(whole["25"]) == 4 and len(whole["80"]) == 1 and min(whole["25"]) < whole["80"][0] < max(whole["25"]), whole
assert "25" not in known and known["80"] == whole["80"], known
P
check "other block sizes, joined ones of blocks still noisy at the end too" $([ $? = 0 ] && echo 1)
echo 'other_part6;100;200;300' >"$tmp/thresholds.csv"
run -d $data --split train --thresholds "$tmp/thresholds.csv"
check "thresholds of other views: one line and exit 2" $([ $rc = 2 ] && one_line && grep -q "thresholds.csv" "$tmp/err" && echo 1)
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
