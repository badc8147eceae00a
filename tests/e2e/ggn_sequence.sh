#!/bin/sh
# What the path tracer writes, ggn reads: recorded sequences through label, evaluate and reconstruct; stop maps through compare.
set -u
cd "$(dirname "$0")/../.." || exit 2
bin=${BUILD:-build}/bin lib=${BUILD:-build}/lib/lull
n=0
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
check() { # check NAME STATUS
    n=$((n + 1))
    if [ "$2" -eq 0 ]; then echo "ok $n - $1"; else echo "not ok $n - $1"; sed 's/^/# /' "$tmp/err" "$tmp/out" 2>/dev/null | tail -n 20; fi
}

"$bin/pathtracer" -q scenes/cornell-box.pbrt --size 64x32 --block 32 --sampler independent --levels geometric:20:400:1.35 --reference-spp 512 \
    --sequence "$tmp/data" --name toy >"$tmp/out" 2>"$tmp/err"
check "record two blocks" $?
"$bin/ggn" label "$tmp/data" >"$tmp/out" 2>"$tmp/err" && grep -q '2 blocks labelled by the model observer' "$tmp/out"
check "label them" $?
"$bin/ggn" label --check "$tmp/data" >"$tmp/out" 2>"$tmp/err" && [ "$(grep -c '^data ' "$tmp/out")" -eq 2 ]
check "cheap labels beside rendered ones" $?
"$bin/ggn" evaluate -d "$tmp/data" -w 3 --json >"$tmp/out" 2>"$tmp/err" && grep -q '"halfbuf"' "$tmp/out" && grep -q '"variance"' "$tmp/out"
check "evaluate has the criteria's recorded errors" $?
"$bin/ggn" reconstruct "$tmp/data" -o "$tmp/r.png" --json >"$tmp/out" 2>"$tmp/err" && grep -q '"blocks": 2' "$tmp/out"
check "reconstruct" $?
cp -r "$tmp/data" "$tmp/again"
"$bin/pathtracer" -q scenes/cornell-box.pbrt --size 64x32 --block 32 --sampler independent --levels geometric:20:400:1.35 --reference-spp 512 \
    --sequence "$tmp/again" --name toy >"$tmp/out" 2>"$tmp/err" && cmp -s "$tmp/data/block-00001.lseq" "$tmp/again/block-00001.lseq"
check "recording again keeps what is there" $?

"$bin/pathtracer" -q scenes/cornell-box.pbrt --size 48x48 --block 16 -c "$lib/halfbuf.so" -p threshold=0.05 --spp-max 64 -o "$tmp/a.exr" \
    --report "$tmp/a.json" --stop-map "$tmp/a.csv" >"$tmp/out" 2>"$tmp/err"
check "render with a stop map" $?
for f in a.exr a.json; do
    "$bin/ggn" compare "$tmp/a.csv" "$tmp/$f" -b 16 --json >"$tmp/out" 2>"$tmp/err" && grep -q '"blocks": 9,' "$tmp/out" &&
        grep -q '"mae": 0.000000' "$tmp/out"
    check "the stops in $f are those of the CSV" $?
done
echo "1..$n"
