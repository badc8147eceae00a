#!/bin/sh
# What `make demo` leaves behind, at a smaller size: files, layers, and every pixel within bounds that the scene sets.
set -u
dir=$(mktemp -d) || exit 2
trap 'rm -rf "$dir"' EXIT
cd "$(dirname "$0")/../.." || exit 2
n=0 bad=0
t() {
    n=$((n + 1)); what=$1; shift
    if "$@" >"$dir/log" 2>&1; then echo "ok $n - $what"; else echo "not ok $n - $what"; sed 's/^/# /' "$dir/log"; bad=1; fi
}
# stats CHANNELS RECTANGLE: "min max avg" of the first channel named, over WxH+X+Y
stats() { oiiotool "$dir/demo.exr" --ch "$1" --cut "$2" --printstats 2>/dev/null |
    awk '/Stats Min/{a=$3} /Stats Max/{b=$3} /Stats Avg/{c=$3} END{print a, b, c}'; }
# within CHANNEL RECTANGLE LOW HIGH: every pixel is
within() { stats "$1" "$2" | tee "$dir/log2" | awk -v l="$3" -v h="$4" 'NF == 3 {ok = $1 >= l && $2 <= h} END {exit !ok}'; }
# mean CHANNEL RECTANGLE LOW HIGH: the average is
mean() { stats "$1" "$2" | tee "$dir/log2" | awk -v l="$3" -v h="$4" 'NF == 3 {ok = $3 >= l && $3 <= h} END {exit !ok}'; }

args="--criterion halfbuf -p threshold=0.05 --size 240x240 --block 40 --spp-min 16 --spp-max 150 --seed 3 -q"
t "the demo runs" env DEMO_DENOISE=0 DEMO_DIR="$dir" DEMO_SCENE=scenes/environment.pbrt DEMO_ARGS="$args" scripts/demo
denoised() {
    DEMO_DENOISE=1 LULL_OIDN="${BUILD:-build}/tests/oidn-stub" DEMO_DIR="$dir/denoised" DEMO_SCENE=scenes/environment.pbrt \
        DEMO_ARGS="--size 64x48 --block 32 --spp-max 64 -q" scripts/demo >"$dir/said"
}
t "and with a denoiser" denoised
t "  …it leaves both pictures side by side" sh -c "oiiotool --info $dir/denoised/two.png | tr -d ' ' | grep -q '136x48'"
t "  …with a time for each" grep -q "noisy after [0-9.]* s, denoised after [0-9.]* s" "$dir/said"
for f in demo.exr demo.png stop-map.png stop-map.csv report.json demo.html; do t "it leaves $f" test -s "$dir/$f"; done
t "nothing temporary is left" test -z "$(ls "$dir" | grep tmp)"
t "the image has 240x240 pixels and all layers" sh -c "oiiotool --info -v $dir/demo.exr | tr -d ' ' | grep -q '240x240,14channel'"
t "no pixel is negative, NaN or infinite" sh -c "oiiotool $dir/demo.exr --ch R,G,B --printstats | awk '/Min/{if (\$3 < 0 || \$4 < 0 || \$5 < 0) bad=1} /NanCount/{if (\$3+\$4+\$5) bad=1} /InfCount/{if (\$3+\$4+\$5) bad=1} END{exit bad}'"
t "samples lie between the limits" within lull.spp.V 240x240+0+0 16 150
t "reasons are criterion or spp-max" within lull.reason.V 240x240+0+0 1 2
t "the sky is the light's colour: red" within R 240x40+0+0 0.4499 0.4501
t "the sky is the light's colour: green" within G 240x40+0+0 0.5999 0.6001
t "the sky is the light's colour: blue" within B 240x40+0+0 0.8999 0.9001
t "the sky has no depth" within depth.Z 240x40+0+0 0 0
# a flag of reflectance r far from the balls reflects r (L_sky + E_sun cos / pi), the sun's cosine being 5 / sqrt(38)
t "the terrace is as bright as sky and sun make it: red" mean R 30x30+205+120 0.418 0.4295
t "the terrace is as bright as sky and sun make it: blue" mean B 30x30+205+120 0.452 0.466
t "the terrace is flat" within normal.Y 30x30+205+120 0.9999 1.0001
t "depth is that of the terrace" within depth.Z 30x30+205+120 8 12
t "the large ball is reddish: red" mean R 30x30+50+90 0.3 1
t "the large ball is reddish: blue" mean B 30x30+50+90 0.1 0.29
t "the large ball's albedo" within albedo.R 30x30+50+90 0.6999 0.7001
t "albedo lies in [0, 1]" within albedo.G 240x240+0+0 0 1.0001
t "normals are at most unit" within normal.Y 240x240+0+0 -1.0001 1.0001
t "36 numbers in the table" test "$(tr -cd ';' <"$dir/stop-map.csv" | wc -c)" -eq 37
t "blocks stop at different samples" test "$(tr ';' '\n' <"$dir/stop-map.csv" | sed 1d | grep . | sort -u | wc -l)" -gt 2
t "the report tells 36 blocks" test "$(grep -c '"reason"' "$dir/report.json")" -eq 36
t "preview is the image" sh -c "oiiotool $dir/demo.exr --ch R,G,B --clamp:min=0:max=1 --colorconvert linear sRGB -d uint8 -o $dir/x.png && oiiotool --fail 0.005 --failpercent 0 --hardfail 0.01 $dir/x.png $dir/demo.png --diff"
# the demo's own scene with the default criterion: sky and lit paving are done long before the shade behind the door
oiiotool scenes/demo-reference.png --resize 240x240 -o "$dir/reference.png"
own() { DEMO_DENOISE=0 DEMO_DIR="$dir/own" DEMO_REFERENCE="$dir/reference.png" DEMO_BLOCK=60 DEMO_ARGS="--size 240x240 --block 60 --spp-max 400 --seed 3 -q" scripts/demo >"$dir/said"; }
t "the demo's own scene runs" own
saved=$(tr ';' '\n' <"$dir/own/stop-map.csv" | sed 1d | grep . | sort -n | awk '{s += $1; b = $1} END {printf "%d samples per pixel; as many everywhere as its worst block took are %d, %.1f times that", s / NR, b, b * NR / s}')
t "  …and says what it saves" grep -qxF "demo: $saved" "$dir/said"
t "the default criterion stopped blocks" grep -q '"reason":[[:space:]]*"criterion"' "$dir/own/report.json"
used=$(tr -d ' \t\n' <"$dir/own/report.json" | sed -n 's/.*"criterion":{"id":"\([a-z-]*\)".*/\1/p')
named=$("${BUILD:-build}/bin/lull-render" --help | tr -s ' \n' ' ' | sed -n 's/.*Python file; default \([a-z-]*\) .*/\1/p')
t "  …which is $used, as --help names it" test -n "$used" -a "$used" = "$named"
t "its blocks differ by four times in samples at least" \
    sh -c "tr ';' '\n' <$dir/own/stop-map.csv | sed 1d | grep . | sort -n | awk 'NR == 1 {a = \$1} {b = \$1} END {exit !(b >= 4 * a)}'"
t "three pictures side by side" sh -c "oiiotool --info $dir/own/three.png | grep -q ' 736 x *240'"
t "the sky has no visible noise, a frame is round a block that has" sh -c "oiiotool $dir/own/visible.png --cut 50x50+5+5 --printstats |
    awk '/Stats Avg/ {exit !(\$3 < 0.05)}' && oiiotool $dir/own/visible.png --cut 240x1+0+121 --printstats | grep -q 'Stats Max: 1.0* 1.0* 1.0*'"
# its price comes first, no clock ends it, Ctrl-C does and keeps what is there
t "it has no limit" sh -c "! grep -n 'time-budget' scripts/demo"
cat >"$dir/press.py" <<'P'
# press.py FOLDER: the demo of an image that would take for ever, Ctrl-C once the preview is there
import os, signal, subprocess, sys, time
env = dict(os.environ, DEMO_DIR=sys.argv[1], DEMO_REFERENCE="",
           DEMO_ARGS="--size 80x80 --block 20 -c null --spp-min 100000000 --spp-max 100000000")
demo = subprocess.Popen(["scripts/demo"], env=env, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
while not os.path.exists(sys.argv[1] + "/demo.png") and demo.poll() is None:
    time.sleep(0.1)
os.killpg(demo.pid, signal.SIGINT)
said = demo.communicate()[0]
files = sorted(os.listdir(sys.argv[1]))
print(demo.returncode, files, said)
price, picture = said.index("times just seen, viewers"), said.index("demo: rendering it")
assert demo.returncode == 130 and price < picture < said.index("demo: interrupted")
assert files == ["demo.exr", "demo.html", "demo.png", "report.json", "stop-map.csv", "stop-map.png"], files
P
t "Ctrl-C keeps what is there" python3 "$dir/press.py" "$dir/pressed"
t "  …a whole image" oiiotool --info "$dir/pressed/demo.exr"
echo "1..$n"
exit $bad
