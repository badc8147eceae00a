#!/bin/sh
# From a recorded scene to a trained criterion by way of a study: the lines of docs/study.md, with a simulated participant.
. "$(dirname "$0")/../cli/ggn_setup"
server=
trap 'kill $server 2>/dev/null; rm -rf "$tmp"' EXIT
mkdir "$tmp/data"
for scene in cornell-box demo; do
    "$bin/lull-render" -q scenes/$scene.pbrt --size 64x32 --block 32 --sampler independent --levels geometric:20:400:1.35 \
        --reference-spp 512 --sequence "$tmp/data/$scene" --name $scene >"$tmp/out" 2>"$tmp/err"
    check "record $scene" $?
done
"$bin/lull-study" init "$tmp/study" --task thresholds --views "$tmp/data/cornell-box" "$tmp/data/demo" --repeats 1 \
    --asked-by "Ada Example" --contact ada@lab.example \
    >"$tmp/out" 2>"$tmp/err" &&
    [ "$(find "$tmp/study/stimuli" -name 'b0-10000.png' -o -name 'b0-9*.png' | wc -l)" -ge 2 ]
check "init: levels up to 10,000 from the halves" $?
"$bin/lull-study" serve "$tmp/study" --listen 127.0.0.1:0 >"$tmp/link" 2>"$tmp/err" &
server=$!
while [ ! -s "$tmp/link" ] && kill -0 $server 2>/dev/null; do sleep 0.1; done
python3 - "$(cat "$tmp/link")" >"$tmp/out" 2>"$tmp/err" <<'END'
import json, sys, urllib.request

def ask(address, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(sys.argv[1] + address, data, {"Content-Type": "application/json"} if data else {})
    return json.load(urllib.request.urlopen(request))

study, me = ask("api/study"), ask("api/people", {"consent": True})
for i, slot in enumerate(ask(f"api/people/{me['key']}")["slots"]):
    levels = study["views"][slot["view"]]["blocks"][slot["block"]]["levels"]
    level = min(levels, key=lambda n: abs(n - (150 if slot["block"] else 90)))
    ask(f"api/people/{me['key']}/trials", {"slot": i, "revision": 0, "level": level, "answer": 0, "rating": 0, "ms": 3000})
END
check "a simulated participant sets all blocks" $?
"$bin/lull-study" status "$tmp/study" >"$tmp/out" 2>"$tmp/err" && grep -q "1 people, 1 finished" "$tmp/out"
check "status, while it is served" $?
kill $server && wait $server
check "serve ends" $?
"$bin/lull-study" report "$tmp/study" --no-pictures >"$tmp/out" 2>"$tmp/err" &&
    [ "$(wc -l <"$tmp/study/report/thresholds.csv")" -eq 2 ]
check "report" $?
"$bin/ggn" label "$tmp/data" --human "$tmp/study/report/thresholds.csv" >"$tmp/out" 2>"$tmp/err" &&
    [ "$(grep -c 'labelled with human thresholds' "$tmp/out")" -eq 2 ] && grep -q '"human"' "$tmp/data/demo/labels.json"
check "label --human" $?
echo '{"train": ["cornell-box"], "validation": ["demo"], "test": []}' >"$tmp/data/split.json"
"$bin/ggn" train --data "$tmp/data" --out "$tmp/mine.ggn" --kr 4 --km 6 --kd 16 --crop 32 --ratio 0 --steps-denoiser 4 --steps 8 \
    --epoch-steps 4 >"$tmp/out" 2>"$tmp/err" && [ -s "$tmp/mine.ggn" ]
check "train" $?
"$bin/ggn" compare "$tmp/study/report/thresholds.csv" "$tmp/study/report/thresholds-demo.json" --view demo --json \
    >"$tmp/out" 2>"$tmp/err" &&
    grep -q '"blocks": 2,' "$tmp/out"
check "compare with people" $?
echo "1..$n"
exit $bad
