#!/bin/sh
# `lull-study serve` and a disk that does not answer: nobody waits for it, and what was acknowledged outlives a kill. A preloaded library
# (durable.c) holds every sync back while the test says so.
. "$(dirname "$0")/ggn_setup"
case $BUILD in *asan | *tsan) echo "ok 1 # SKIP a sanitizer wants to be loaded first"; exit 0 ;; esac
${CC:-cc} -shared -fPIC -O1 -o "$tmp/calls.so" tests/cli/durable.c -ldl || exit 2
{
    mkdir "$tmp/data" && "$bin/lull-render" -q scenes/demo.pbrt --size 64x32 --block 32 --sampler independent --levels linear:16:64:16 --reference-spp 64 \
        --sequence "$tmp/data/demo" --name demo &&
        "$bin/lull-study" init "$tmp/study" --task thresholds --method 2ifc --trials 10 --views "$tmp/data/demo" --asked-by "Ada Example" \
            --contact ada@lab.example
} >"$tmp/out" 2>"$tmp/err" || { cat "$tmp/err"; exit 2; }
python3 tests/cli/lull_study_disk.py "$bin/lull-study" "$tmp"
