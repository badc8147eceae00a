#!/bin/sh
# What was once accepted without a word, or refused with the wrong one: names of scenes that tables cannot hold, options that
# exclude each other, values blamed on the scene, pixels that are no light, folders left by an import that failed.
set -u
cd "$(dirname "$0")/../.." || exit 2
root=$PWD build=$PWD/${BUILD:-build}
P=$build/bin/lull-render G=$build/bin/ggn
dir=$(mktemp -d) || exit 2
trap 'rm -rf "$dir"' EXIT
cd "$dir" || exit 2
n=0 bad=0
t() {
    n=$((n + 1)); what=$1; shift
    if "$@" >log 2>&1; then echo "ok $n - $what"; else echo "not ok $n - $what"; sed 's/^/# /' log err 2>/dev/null; bad=1; fi
}
refused() { # refused TEXT COMMAND...: exit status 2, one line that contains TEXT
    text=$1; shift
    "$@" >out 2>err </dev/null; status=$?
    t "refused: $text" test $status -eq 2 -a "$(wc -l <err)" -eq 1 -a "$(grep -cF -- "$text" err)" -eq 1
}
small="--size 40x40 --block 20 --spp-max 16 -q"

latin=$(printf 'l\344t')
for name in 'a;b#c' '#1' '.x' "$latin"; do
    cp "$root/tests/cli/room.pbrt" "$name.pbrt"
    t "a scene called $(printf %s "$name" | tr -cd '[:print:]')" "$P" "$name.pbrt" $small --stop-map s.csv --report r.json
    t "  …its stop map can be compared" "$G" compare s.csv s.csv
    t "  …with its report" "$G" compare s.csv r.json --view "$(cut -d";" -f1 s.csv)"
    t "  …which is UTF-8" python3 -c "import json; json.load(open('r.json', encoding='utf-8'))"
done
t "a recorded one" "$P" "$latin.pbrt" -q --size 20x20 --block 20 --levels linear:4:8:4 --sequence seq
t "  …has a manifest that is UTF-8" python3 -c "import json; assert json.load(open('seq/manifest.json', encoding='utf-8'))['scene'] == 'l_t'"

refused "no criterion nowhere" "$P" "$root/tests/cli/room.pbrt" -q --size 16x16 --sequence named --levels linear:1:2:1 -c nowhere
t "  …and nothing is recorded" test ! -e named
refused "--sequence records blocks: leave out" "$P" "$root/tests/cli/room.pbrt" --explain --sequence none
t "  …and makes no folder" test ! -e none
refused "'maybe' is not 0 or 1" "$P" "$root/tests/cli/room.pbrt" -c halfbuf -p area=maybe
refused "--size 32768x32768: expected WxH of at most 2^28 pixels" "$P" "$root/tests/cli/room.pbrt" --size 32768x32768

oiiotool --pattern constant:color=.5,.5,.5 8x8 3 -d float -o clean.exr
python3 - <<'END'
import struct  # a Radiance-free way to NaN, infinity and a negative: PFM, rows from the bottom
v = [.5] * 192
v[0], v[30], v[60] = float("nan"), float("inf"), -1.0
open("odd.pfm", "wb").write(b"PF\n8 8\n-1.0\n" + struct.pack("<192f", *v))
END
for command in flip visible; do
    "$G" $command clean.exr odd.pfm >out 2>err
    t "ggn $command counts pixels that are no light" grep -q '^ggn '$command': odd.pfm: 3 pixels are NaN, infinite or negative' err
    "$G" $command clean.exr clean.exr >out 2>err
    t "  …and is silent without" test ! -s err
done

mkdir sin3d
refused "sin3d" "$G" import sin3d -o imported
t "a failed import leaves no folder" test ! -e imported
echo "1..$n"
exit $bad
