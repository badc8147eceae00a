#!/bin/sh
# lull-render --cells: pixels of a block differ in samples, the bytes do not; what it does not go with.
. "$(dirname "$0")/lull_render_setup"
common="$scene -q --size 64x48 --block 32 -c halfbuf -p threshold=0.02 --spp-max 4000 --reproducible"
"$P" $common -t 1 -o even.exr && "$P" $common -t 1 --cells 0 -o none.exr
t "--cells 0 is the default" cmp even.exr none.exr
"$P" $common -t 1 --cells 8 -o one.exr --report one.json && "$P" $common -t 3 --cells 8 -o three.exr
t "the same bytes for any number of threads" cmp one.exr three.exr
# shown as one channel: the least and the most samples of a pixel
range() { oiiotool "$1" --ch lull.spp.V -o spp.exr && oiiotool --stats spp.exr | sed -n 's/ *Stats M[ai][xn]: \([0-9]*\).*/\1/p' | tr '\n' ' '; }
differ() { set -- $(range one.exr); [ "$1" -lt "$2" ]; }
t "pixels have samples of their own" differ
sum() { oiiotool --stats spp.exr | sed -n 's/ *Stats Avg: \([0-9.]*\).*/\1/p'; }
total() { sed -n 's/.*"samples":[[:space:]]*\([0-9]*\).*/\1/p' one.json | head -1; }
t "  …whose sum is that of the report" awk "BEGIN { exit !($(sum) * 64 * 48 - $(total) < 0.5 && $(total) - $(sum) * 64 * 48 < 0.5) }"

"$P" $common --cells 8 --time-budget 0.05 --checkpoint c.ckpt -o part.exr
"$P" $common --cells 8 --checkpoint c.ckpt --resume -o resumed.exr
t "a resumed render has the same bytes" cmp one.exr resumed.exr
"$P" $common --cells 8 --time-budget 0.05 --checkpoint d.ckpt -o part.exr
refused "cells" $common --cells 16 --checkpoint d.ckpt --resume
refused "cells" $common --checkpoint d.ckpt --resume
"$P" "$scene" -q --size 64x48 --block 32 --cells 8 --quote --quote-pilot 20:5 --checkpoint q.ckpt -c halfbuf -p threshold=0.02 \
    --spp-max 4000 >quote.txt
"$P" $common --cells 8 --checkpoint q.ckpt --resume -o quoted.exr
t "a pilot of a quote can be resumed" cmp one.exr quoted.exr
for c in variance observer ggn; do
    t "criterion $c" "$P" "$scene" -q --size 64x48 --block 32 --cells 8 -c $c --spp-max 64 -o $c.exr
done

for wrong in 7 4097 -8 8x8 x ""; do refused "0 or a side from 8 to 4096" $common --cells "$wrong" -o x.exr; done
refused "--cells goes with none of" "$scene" -q --size 64x48 --spp 16 --cells 8 -o x.exr
refused "--cells goes with none of" "$scene" -q --size 64x48 --sequence seq --levels linear:4:8:4 --cells 8
refused "--cells goes with none of" "$scene" -q --frames 1-2 --plan-shot plan.csv --cells 8
refused "a multiple of 8" "$scene" -q --size 64x48 --spp-max 100 --cells 8 -o x.exr
refused "a multiple of 8" "$scene" -q --size 64x48 --spp-max 268435464 --cells 8 -o x.exr
echo "1..$n"
exit $bad
