#!/bin/sh
# ggn cost: every criterion over its quality parameter, the limit below all, the same bytes for any threads, and how it fails.
. "$(dirname "$0")/ggn_setup"
run() { "$ggn" cost "$@" >"$tmp/out" 2>"$tmp/err"; rc=$?; }
one_line() { [ "$(wc -l <"$tmp/err")" -eq 1 ] && [ ! -s "$tmp/out" ]; }
"$ggn" baseline attributes -d $data -o "$tmp/attributes.ggn" >"$tmp/err" 2>&1
run -d $data --split train --baseline "$tmp/attributes.ggn" --threads 1 -o "$tmp/cost.json"
[ $rc = 0 ] && [ -s "$tmp/cost.json" ] && [ ! -s "$tmp/out" ]
check "it writes a file" $?
run -d $data --split train --baseline "$tmp/attributes.ggn" --threads 2
[ $rc = 0 ] && cmp -s "$tmp/out" "$tmp/cost.json"
check "or prints the same, with other threads" $?
python3 - "$tmp/cost.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
d = json.load(open(sys.argv[1]))
assert d["split"] == "train" and len(d["scenes"]) == 3
kinds = {p["criterion"] for p in d["points"]}
assert {"uniform", "fixed", "limit", "attributes"} <= kinds, kinds
limit = next(p for p in d["points"] if p["criterion"] == "limit")["scenes"]
views = sorted(limit)
assert len(views) == 3 and all(sorted(p["scenes"]) == views and len(p["stops"]) == 9 for p in d["points"])
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
check "uniform costs what uniform costs, the limit is reached by exact stops" $?
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
check "another cadence simulates all levels, and asks the defaults alone" $?
"$ggn" train -d $data -o "$tmp/old.ggn" --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 8 --steps-denoiser 5 --steps 5 --epoch-steps 5 -q 2>"$tmp/err"
run -d $data --split train --scores --recorded --no-quality -m "$tmp/old.ggn" --baseline "$tmp/attributes.ggn" -o "$tmp/scores.json" && python3 - "$tmp/scores.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
d = json.load(open(sys.argv[1]))
assert [p["criterion"] for p in d["points"]] == ["old.ggn"]
p = d["points"][0]
windows = sum(len(s["blocks"]) for s in d["scenes"].values()) * (14 - 5)
assert len(p["scores"]) == windows and 0 < p["cut"] < 1 and all(x is None or 0 <= x <= 1 for x in p["scores"])
assert any(x is not None for x in p["scores"])
P
check "scores of a network's windows, nothing else" $?
run -d $data --split train --scores --precision f64 -m ggn/models/lull-3.ggn
[ $rc = 2 ] && one_line && grep -q "network's size, 200x200" "$tmp/err"
check "double precision of blocks that are not the network's size: one line and exit 2" $?
mkdir -p "$tmp/whole/train" && cp -R $data/scene? "$tmp/whole/train" || exit 2
$BUILD/bin/lull-render -q tests/cli/room.pbrt --name room --size 80x80 --block 40 --sampler independent --levels geometric:4:16:1.26 \
    --sequence "$tmp/whole/train/room" && "$ggn" label "$tmp/whole/train/room" >/dev/null
mkdir -p "$tmp/alone/train" && cp -R "$tmp/whole/train/room" "$tmp/alone/train"
run -d "$tmp/alone" --split train --no-quality -m ggn/models/lull-3.ggn -o "$tmp/alone.json" && python3 - "$tmp/alone.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
points = json.load(open(sys.argv[1]))["points"]
spent = lambda name: [p["scenes"]["room"]["samples"] for p in points if p["criterion"] == name and p["dial"] == "visible"]
seeing, blind = spent("observer"), spent("observer, no halves")
assert len(seeing) == len(blind) == 11 and blind == sorted(blind) and blind[0] < blind[-1], (seeing, blind)
assert seeing != blind and all(.5 < a / b < 2 for a, b in zip(seeing, blind)), (seeing, blind)
P
check "the observer without half buffers: named so, other stops, in the octave of those with them" $?
python3 - "$tmp/alone.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
points = [p for p in json.load(open(sys.argv[1]))["points"] if p["criterion"] == "lull-3.ggn"]
own = next(p for p in points if p["dial"] == "own")
dial = {p["value"]: p["scenes"]["room"]["samples"] for p in points if p["dial"] == "visible"}
assert dial[own["value"]] == own["scenes"]["room"]["samples"], (own, dial)
spent = [dial[v] for v in sorted(dial)]
assert len(spent) == 11 and spent == sorted(spent, reverse=True) and spent[0] > spent[-1], spent
P
check "a residual model stops between levels at every value of its dial, the shipped one's included" $?
run -d "$tmp/alone" --split train --no-quality --no-pictures -m ggn/models/lull-3.ggn -o "$tmp/blind.json" && python3 - "$tmp/blind.json" "$tmp/alone.json" >"$tmp/err" 2>&1 <<'P'
import json, sys
def spent(file, name):
    points = [p for p in json.load(open(file))["points"] if p["criterion"] == name]
    return {(p["dial"], p["value"]): [s["samples"] for s in p["scenes"].values()] for p in points}
blind, seeing = spent(sys.argv[1], "lull-3.ggn, no halves"), spent(sys.argv[2], "lull-3.ggn")
assert len(blind) > 10 and blind.keys() == seeing.keys() and blind != seeing
P
check "without half buffers a network judges otherwise, and is named so" $?
echo 'other_part6;100;200;300' >"$tmp/thresholds.csv"
run -d $data --split train --thresholds "$tmp/thresholds.csv"
[ $rc = 2 ] && one_line && grep -q "thresholds.csv" "$tmp/err"
check "thresholds of other views: one line and exit 2" $?
run -d $data
[ $rc = 2 ] && one_line && grep -q "split 'test'" "$tmp/err"
check "a split without blocks is one line and exit 2" $?
run -d $data --split train --baseline ggn/models/lull-3.ggn
[ $rc = 2 ] && one_line && grep -q "not a baseline" "$tmp/err"
check "a network is no baseline: one line and exit 2" $?
run --split train
[ $rc = 2 ] && one_line
check "no data: one line and exit 2" $?
run -d $data --split some
[ $rc = 2 ] && one_line
check "another split: one line and exit 2" $?
echo "1..$n"
exit $bad
