#!/bin/sh
# The criterion denoised in the path tracer, with the denoiser of tests/stub: threads, order, resume, and what is said without it.
. "$(dirname "$0")/lull_render_setup"
LULL_OIDN=$(cd "$here/../../${BUILD:-build}/tests/oidn-stub" && pwd)
export LULL_OIDN OIDN_STUB=box
den="$scene -q --size 150x100 --block 50 -c denoised -p first-spp=8 -p visible=0.9 --spp-max 300 --reproducible"
"$P" $den -o den.exr --report den.json --stop-map den.csv
t "blocks stop, at different counts" sh -c '[ "$(tr ";" "\n" <den.csv | grep "^[0-9]" | sort -u | wc -l)" -gt 2 ] && grep -q "\"reason\":.*\"criterion\"" den.json'
t "same bytes for 1 thread and another order" sh -c "$P $den -t 1 --order-seed 4 -o den1.exr && cmp den.exr den1.exr"
interrupted den.ckp $den -o part.exr
t "same bytes after interrupt and resume" sh -c "$P $den --checkpoint den.ckp --resume -o den2.exr && cmp den.exr den2.exr"
"$P" $scene -q --size 150x100 --block 50 -c denoised -p first-spp=16 -p error=50 --spp-max 300 -o clear.exr --stop-map clear.csv
t "an error far below the limit needs no second look" test "$(tr ';,' '\n\n' <clear.csv | grep '^[0-9]' | sort -u)" = 16
"$P" $den -p fps=0 -o still.exr --stop-map still.csv
"$P" $den -p fps=24 -o moving.exr --stop-map moving.csv
t "0 frames per second: a still" cmp still.csv den.csv
t "24: other decisions" sh -c '! cmp -s moving.csv den.csv'
t "a denoiser that fails stops nothing" sh -c "OIDN_STUB=commit $P $scene -q --size 50x50 -c denoised -p library=$LULL_OIDN --spp-max 40 --report fail.json -o fail.exr; grep -q 'spp-max' fail.json && ! grep -q '\"criterion\",' fail.json"
LULL_OIDN=/no/such refused "/no/such: no Open Image Denoise 2 there" "$scene" -q -c denoised -o none.exr
OIDN_STUB=version refused "is of version 3.0.1: version 2 is needed" "$scene" -q -c denoised -o none.exr
echo "1..$n"
exit $bad
