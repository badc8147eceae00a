#!/bin/sh
# `ggn visible` from the outside: what it says of images with and without noise, its picture, and bad input.
. "$(dirname "$0")/ggn_setup"
fails() { # fails NAME PATTERN COMMAND…: exit 2, one line of ours on stderr (libpng may add its own), nothing on stdout
    name=$1 pattern=$2
    shift 2
    "$@" >"$tmp/out" 2>"$tmp/err"
    rc=$?
    [ "$rc" -eq 2 ] && [ "$(grep -vc '^libpng' "$tmp/err")" -eq 1 ] && grep -q "^ggn visible: .*$pattern" "$tmp/err" && [ ! -s "$tmp/out" ]
    check "$name" $?
}
# an even grey, and the same with noise in the right half
oiiotool --pattern constant:color=.5,.5,.5 80x40 3 -d uint8 -o "$tmp/clean.png" \
    --pattern constant:color=0,0,0 40x40 3 --noise:type=gaussian:mean=0:stddev=0.1:seed=2 --origin +40+0 \
    --pattern constant:color=.5,.5,.5 80x40 3 --add --cut 80x40+0+0 -d uint8 -o "$tmp/noisy.png" >/dev/null 2>&1

$ggn visible "$tmp/clean.png" "$tmp/clean.png" >"$tmp/out" 2>"$tmp/err" && grep -q 'noise  0 of 1$' "$tmp/out" && grep -q ' 0.000 of what' "$tmp/out"
check "an image against itself: nothing is seen" $?
$ggn visible "$tmp/clean.png" "$tmp/noisy.png" -b 40 -o "$tmp/map.png" >"$tmp/out" 2>"$tmp/err" &&
    grep -q 'noise  1 of 2$' "$tmp/out" && grep -q 'at 40,0 (40x40)' "$tmp/out" && grep -q '100 % of viewers' "$tmp/out"
check "noise in the right block" $?
level() { oiiotool "$tmp/map.png" --cut "$1" --printstats | awk '/Stats Avg/ {print ($3 + $4 + $5) / 3; exit}'; }
level 30x30+5+5 | awk '{exit !($1 < 0.03)}'
check "the picture is dark where nothing is seen" $?
level 30x30+45+5 | awk '{exit !($1 > 0.4)}'
check "and light where noise is" $?
oiiotool "$tmp/map.png" --cut 1x1+41+1 --printstats | grep -q 'Stats Min: 1.000000 1.000000 1.000000'
check "a block with visible noise is framed" $?
$ggn visible "$tmp/clean.png" "$tmp/noisy.png" -b 40 --json >"$tmp/out" 2>"$tmp/err" &&
    python3 -c "import json, sys; r = json.load(open(sys.argv[1])); b = r['blocks']
assert r['visible'] == 1 and len(b) == 2 and b[0]['error'] == 0 == b[0]['viewers'] and b[1]['error'] == r['worst'] > 2 and b[1]['x'] == 40" "$tmp/out"
check "JSON" $?
$ggn visible "$tmp/noisy.png" "$tmp/clean.png" --second "$tmp/clean.png" >"$tmp/out" 2>"$tmp/err" && grep -q ' 0.000 of what' "$tmp/out"
check "noise of one reference alone is none of the image's" $?
oiiotool --pattern constant:color=.5,.5,.5 80x30 3 -d uint8 -o "$tmp/small.png" >/dev/null 2>&1
fails "sizes differ" 'small.png is 80x30: the sizes must be equal' $ggn visible "$tmp/clean.png" "$tmp/small.png"
fails "a second reference of another size" 'small.png is 80x30' $ggn visible "$tmp/clean.png" "$tmp/clean.png" --second "$tmp/small.png"
fails "no image" 'none.png' $ggn visible "$tmp/clean.png" "$tmp/none.png"
head -c 60 "$tmp/clean.png" >"$tmp/cut.png"
fails "a truncated image" 'cut.png' $ggn visible "$tmp/cut.png" "$tmp/clean.png"
fails "blocks of no size" 'block' $ggn visible "$tmp/clean.png" "$tmp/noisy.png" --block 0
fails "an observer that is none" 'clean.png' $ggn visible "$tmp/clean.png" "$tmp/noisy.png" --observer "$tmp/clean.png"
fails "a folder as map" "$tmp" $ggn visible "$tmp/clean.png" "$tmp/noisy.png" -o "$tmp"
echo "1..$n"
exit $bad
