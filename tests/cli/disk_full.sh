#!/bin/sh
# A disk that fills up while a file is written: one line, exit status 2, nothing half-written, what was there unchanged. A limit on
# the size of files stands in for the full disk: the same failed write, without the privilege to mount one. The signal that comes with
# it is the program's business.
set -u
cd "$(dirname "$0")/../.." || exit 2
build=${BUILD:-build}
ggn=$build/bin/ggn render=$build/bin/lull-render
n=0 failed=0
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
data=$tmp/data
cp -r tests/data/train-demo "$data"
mkdir "$tmp/out" "$tmp/sequence"

sums() { find "$data" -type f -exec cksum {} + | sort; }
full() { # full NAME BLOCKS TARGET COMMAND…: fails when no file may exceed so many blocks of 512 bytes, and leaves no TARGET
    name=$1 blocks=$2 target=$3
    shift 3
    before=$(sums)
    # through a pipe: the limit would hold for a log file too
    message=$( (ulimit -f "$blocks" && { "$@" 2>&1 >/dev/null; echo "exit $?"; }) | cat)
    n=$((n + 1))
    if [ "$(echo "$message" | tail -n 1)" = "exit 2" ] && [ "$(echo "$message" | wc -l)" -eq 2 ] && echo "$message" | grep -q 'File too large\|png: write failed' &&
        [ ! -e "$target" ] && [ -z "$(find "$tmp" -name '*.tmp*')" ] && [ "$before" = "$(sums)" ]; then
        echo "ok $n - $name"
    else
        echo "not ok $n - $name"
        echo "$message" | sed 's/^/# /'
        find "$tmp" -name '*.tmp*' | sed 's/^/# left: /'
        failed=1
    fi
}

full "label" 0 "$data/none" "$ggn" label "$data"
full "train" 1 "$tmp/out/model.ggn" "$ggn" train --data "$data" --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 8 --steps-denoiser 4 \
    --steps 4 --epoch-steps 2 --out "$tmp/out/model.ggn" -q
full "flip" 0 "$tmp/out/map.png" "$ggn" flip scenes/textures/bricks.png scenes/textures/bricks.png -o "$tmp/out/map.png"
full "evaluate" 1 "$tmp/out/figures.json" "$ggn" evaluate --data "$data" --no-quality -o "$tmp/out"
full "lull-render: an image" 8 "$tmp/out/room.exr" "$render" -q tests/cli/room.pbrt --size 64x64 --spp 4 --criterion null \
    -o "$tmp/out/room.exr"
full "lull-render: a preview" 0 "$tmp/out/room.png" "$render" -q tests/cli/room.pbrt --size 64x64 --spp 4 --criterion null \
    --preview "$tmp/out/room.png"
full "lull-render: a sequence" 8 "$tmp/sequence/block-00000.lseq" "$render" -q tests/cli/room.pbrt --size 64x64 --block 64 \
    --levels linear:4:8:4 --reference-spp 8 --sequence "$tmp/sequence"
"$render" -q tests/cli/room.pbrt --size 64x64 --spp 4 --criterion null --report "$tmp/report.json" -o "$tmp/whole.exr" || failed=1
for what in report:json stop-map:csv stop-map:png html:html; do
    full "lull-render: ${what%:*} as ${what#*:}" 0 "$tmp/out/w.${what#*:}" "$render" -q tests/cli/room.pbrt --size 64x64 --spp 4 --criterion null \
        --"${what%:*}" "$tmp/out/w.${what#*:}"
done
full "lull-render: a checkpoint of a render that is stopped" 100 "$tmp/out/c" "$render" -q tests/cli/room.pbrt --size 64x64 --spp-max 100000000 \
    --criterion null --time-budget 0.1 --checkpoint "$tmp/out/c" --preview "$tmp/p.png"
full "lull-report: a page" 0 "$tmp/out/page.html" "$build/bin/lull-report" "$tmp/report.json" -o "$tmp/out/page.html"
full "lull-report: a sheet" 0 "$tmp/out/sheet.png" "$build/bin/lull-report" "$tmp/whole.exr" "$tmp/whole.exr" -o "$tmp/out/sheet.png"
echo "1..$n"
exit $failed
