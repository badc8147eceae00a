#!/bin/sh
# Thresholds of the noisy picture, the denoised one and the blend, from the same renders: the lines of docs/denoised.md, with
# simulated participants, and a denoiser whose answers are known (tests/stub/oidn.c).
. "$(dirname "$0")/../cli/ggn_setup"
server=
trap 'kill $server 2>/dev/null; rm -rf "$tmp"' EXIT
LULL_OIDN=$PWD/$BUILD/tests/oidn-stub/libOpenImageDenoise.so.2
export LULL_OIDN OIDN_STUB=box
render="$bin/lull-render tests/cli/room.pbrt -q --size 64x32 --block 32"
asked="--task thresholds --method 2ifc --block 32 --asked-by Ada --contact here"
mkdir -p "$tmp/views/room" "$tmp/plain/room"
for spp in 32 64 128 256 512; do
    $render --spp $spp --denoise -o "$tmp/views/room/$spp.exr" >"$tmp/out" 2>"$tmp/err" &&
        $render --spp $spp -o "$tmp/plain/room/$spp.exr" >"$tmp/out" 2>"$tmp/err"
    check "render with $spp samples" $?
done
$render --spp 1024 --seed 2 -o "$tmp/views/room/reference.exr" >"$tmp/out" 2>"$tmp/err" &&
    cp "$tmp/views/room/reference.exr" "$tmp/plain/room"
check "render the reference" $?

"$bin/lull-study" init "$tmp/study" $asked --views "$tmp/views/room" --kinds noisy,denoised,blend --trials 40 >"$tmp/out" 2>"$tmp/err" &&
    grep -q "3 views, 240 trials for each person, some 13 min" "$tmp/out"
check "init: a view of each kind, with its time" $?
"$bin/lull-study" init "$tmp/as-is" $asked --views "$tmp/views/room" >"$tmp/out" 2>"$tmp/err" &&
    "$bin/lull-study" init "$tmp/undenoised" $asked --views "$tmp/plain/room" >"$tmp/out" 2>"$tmp/err"
check "init: the pictures as they are" $?
shown() { diff -rq "$tmp/study/stimuli/$1" "$tmp/$2/stimuli/v0" >"$tmp/out"; }
shown v0 undenoised; check "noisy: what a render without denoiser shows" $?
shown v2 as-is; check "blend: the picture itself" $?
! shown v1 as-is && ! shown v1 undenoised && cmp "$tmp/study/stimuli/v1/b0-reference.png" "$tmp/as-is/stimuli/v0/b0-reference.png"
check "denoised: neither, against the same reference" $?
oiiotool "$tmp/views/room/64.exr" --ch denoised.R,denoised.G,denoised.B --chnames R,G,B --cut 32x32+32+0 --origin +0+0 \
    --powc 1 -o "$tmp/d.exr" && oiiotool "$tmp/d.exr" --colorconvert linear sRGB -d uint8 -o "$tmp/d.png" >"$tmp/out" 2>&1 &&
    oiiotool --fail 0.009 --warn 0.009 "$tmp/d.png" "$tmp/study/stimuli/v1/b1-64.png" --diff >"$tmp/out" 2>&1
check "denoised: the layer of that name" $?

"$bin/lull-study" serve "$tmp/study" --listen 127.0.0.1:0 >"$tmp/link" 2>"$tmp/err" &
server=$!
while [ ! -s "$tmp/link" ] && kill -0 $server 2>/dev/null; do sleep 0.1; done
python3 - "$(cat "$tmp/link")" >"$tmp/out" 2>"$tmp/err" <<'END'
import json, math, random, sys, urllib.request

def ask(address, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(sys.argv[1] + address, data, {"Content-Type": "application/json"} if data else {})
    return json.load(urllib.request.urlopen(request))

study, draw = ask("api/study"), random.Random(1)
for person in range(4):
    me = ask("api/people", {"consent": True})
    own = draw.gauss(0, 0.4)  # of everything that this participant sees
    for i, slot in enumerate(ask(f"api/people/{me['key']}")["slots"]):
        view = study["views"][slot["view"]]
        t = math.log2(130) + own + {"noisy": 0, "denoised": 0.7, "blend": -0.7}[view["kind"]]
        level = 0 if slot["catch"] else draw.choice(view["blocks"][slot["block"]]["levels"])
        seen = 1 if slot["catch"] else 0.5 + 0.25 * math.erfc((math.log2(level) - t) / 0.4 / math.sqrt(2))
        answer = slot["side"] + 1 if draw.random() < seen else 2 - slot["side"]
        ask(f"api/people/{me['key']}/trials", {"slot": i, "revision": 0, "level": level, "answer": answer, "rating": 0, "ms": 900})
END
check "simulated participants, who see blotches more than noise" $?
kill $server && wait $server
"$bin/lull-study" report "$tmp/study" --no-pictures >"$tmp/out" 2>"$tmp/err"
check "report" $?
cp "$tmp/out" "$tmp/said"
# more KIND OCTAVES: the pooled difference to the noisy picture holds the truth and nothing far from it
more() {
    awk -F';' -v kind="$1" -v truth="$2" '$1 == "(all)" && $2 == kind { ok = $7 - truth < 0.3 && truth - $7 < 0.3 && $8 < truth && truth < $9 &&
        $9 - $8 < 1.2 && $10 == 4 } END { exit !ok }' "$tmp/study/report/kinds.csv"
}
more denoised 0.7; check "report: denoised takes 0.7 octaves more, though people differ" $?
more blend -0.7; check "report: the blend as much less" $?
grep -q '^denoised: [12].[0-9]* × the samples of the noisy picture' "$tmp/said" && grep -q '^blend: 0.[0-9]* ×' "$tmp/said"
check "report: says so" $?
cut -d';' -f1 "$tmp/study/report/thresholds.csv" >"$tmp/names"
printf 'room.noisy\nroom.denoised\nroom.blend\n' | cmp - "$tmp/names"
check "thresholds.csv: a line for each kind" $?
mkdir "$tmp/data"
$render --levels geometric:20:400:1.5 --reference-spp 512 --sequence "$tmp/data/room" --name room >"$tmp/out" 2>"$tmp/err"
"$bin/lull-study" init "$tmp/none" $asked --views "$tmp/data/room" --kinds blend >"$tmp/out" 2>"$tmp/err"
[ $? -eq 2 ] && grep -q "room: a sequence has no denoised pictures" "$tmp/err"; check "init: no kinds of a sequence" $?
fails "label: takes no kind for the sequence of the scene" "room" "$ggn" label "$tmp/data/room" --human "$tmp/study/report/thresholds.csv"
[ ! -e "$tmp/data/room/labels.json" ]; check "  …and writes nothing" $?
"$ggn" label "$tmp/data/room" --human "$tmp/study/report/thresholds.csv" --view room.noisy >"$tmp/out" 2>"$tmp/err"
check "label: the noisy one when it is named" $?

# The lines of docs/shots.md: the same room in motion.
printf 'frame;eye;at;up;fov\n1;0 1 3.4;0 1 0;0 1 0;45\n2;0.1 1 3.4;0 1 0;0 1 0;\n' >"$tmp/path.csv"
for spp in 16 32 64; do
    mkdir -p "$tmp/clips/room/$spp"
    $render --camera-path "$tmp/path.csv" --spp $spp --denoise -o "$tmp/clips/room/$spp/%04d.exr" >"$tmp/out" 2>"$tmp/err"
    check "render a shot with $spp samples" $?
done
mkdir "$tmp/clips/room/reference"
$render --camera-path "$tmp/path.csv" --spp 128 --seed 2 -o "$tmp/clips/room/reference/%04d.exr" >"$tmp/out" 2>"$tmp/err"
"$bin/lull-study" init "$tmp/moving" $asked --views "$tmp/clips/room" "$tmp/views/room:0" --kinds noisy,blend >"$tmp/out" 2>"$tmp/err"
[ $? -eq 2 ] && grep -q "a name of its own" "$tmp/err"; check "init: two views of one name" $?
mv "$tmp/clips/room" "$tmp/clips/walk" && rm -r "$tmp/moving"
"$bin/lull-study" init "$tmp/moving" $asked --views "$tmp/clips/walk" "$tmp/views/room:0" --kinds noisy,blend --fps 2 >"$tmp/out" 2>"$tmp/err" &&
    [ "$(grep -c '"frames":.2' "$tmp/moving/study.json")" -eq 2 ] && grep -q "4 views, 180 trials for each person, some 18 min" "$tmp/out"
check "init: kinds of a shot, and stills" $?
! cmp -s "$tmp/moving/stimuli/v0/b0-64.png" "$tmp/moving/stimuli/v1/b0-64.png" &&
    [ "$(iinfo "$tmp/moving/stimuli/v0/b0-64.png" | grep -c '32 x *64')" -eq 1 ]
check "  …of two frames each" $?
echo "1..$n"
exit $bad
