#!/bin/sh
# ggn inspect and convert, and what measures the networks (tests/bench/ggn_golden.c, ggn_networks.c): what they print and how they fail.
. "$(dirname "$0")/ggn_setup"
corpus=tests/fuzz/corpus/ggn_model
ask() { "$@" >"$tmp/out" 2>"$tmp/err"; rc=$?; }
run() { ask "$ggn" "$@"; }
golden() { ask "$BUILD/bench/ggn_golden" "$@"; }
bench() { ask "$BUILD/bench/ggn_networks" "$@"; }
one_line() { [ "$(wc -l <"$tmp/err")" -eq 1 ] && [ ! -s "$tmp/out" ]; }

run inspect "$corpus/f16.ggn"
[ $rc = 0 ] && grep -q 'preset *lull' "$tmp/out"
check "inspect prints the networks" $?
run inspect --json "$corpus/paper-bf16.ggn"
[ $rc = 0 ] && grep -q '"preset":.*"paper"' "$tmp/out"
check "inspect --json prints the description" $?
run inspect --tensors "$corpus/paper-bf16.ggn"
[ $rc = 0 ] && grep -q 'denoiser/enc0.0.weight .*bf16' "$tmp/out"
check "inspect --tensors lists them" $?
run inspect /nonexistent.ggn
[ $rc = 2 ] && one_line && grep -q nonexistent "$tmp/err"
check "a missing file is one line and exit 2" $?
head -c 20000 "$corpus/f16.ggn" >"$tmp/short.ggn"
run inspect "$tmp/short.ggn"
[ $rc = 2 ] && one_line && grep -q truncated "$tmp/err"
check "a truncated file is one line and exit 2" $?
{ head -c 30000 "$corpus/f16.ggn"; printf 'x'; tail -c +30002 "$corpus/f16.ggn"; } >"$tmp/flipped.ggn"
run inspect "$tmp/flipped.ggn"
[ $rc = 2 ] && one_line && grep -q damaged "$tmp/err"
check "a damaged file is one line and exit 2" $?
{ head -c 8 "$corpus/f16.ggn"; printf '\003'; tail -c +10 "$corpus/f16.ggn"; } >"$tmp/future.ggn"
run inspect "$tmp/future.ggn"
[ $rc = 2 ] && one_line && grep -q 'version 3' "$tmp/err"
check "a future version is named, exit 2" $?
run convert --type f32 "$corpus/paper-bf16.ggn" "$tmp/wide.ggn" && run convert --type bf16 "$tmp/wide.ggn" "$tmp/back.ggn"
[ $rc = 0 ] && cmp -s "$corpus/paper-bf16.ggn" "$tmp/back.ggn" && [ "$(wc -c <"$tmp/wide.ggn")" -gt "$(wc -c <"$tmp/back.ggn")" ]
check "convert to more bits and back is the same file" $?
run convert "$tmp/wide.ggn" "$tmp/half.ggn" && run inspect --tensors "$tmp/half.ggn"
[ $rc = 0 ] && grep -q 'denoiser/enc0.0.weight .*f16 ' "$tmp/out"
check "convert stores f16 when nothing is said" $?
run convert "$tmp/short.ggn" "$tmp/none.ggn"
[ $rc = 2 ] && one_line && [ ! -e "$tmp/none.ggn" ]
check "convert of a truncated file is one line and exit 2" $?
run convert "$tmp/wide.ggn" /nonexistent/out.ggn
[ $rc = 2 ] && one_line
check "convert into no folder is one line and exit 2" $?
run convert --type f64 "$tmp/wide.ggn" "$tmp/none.ggn"
[ $rc = 2 ] && grep -q f64 "$tmp/err" && [ ! -e "$tmp/none.ggn" ]
check "convert to no type is exit 2" $?
golden --base-r=-1
[ $rc = 2 ]
check "a bad seed is exit 2" $?
golden --float --base-r=1 --base-m=2 --base-d=3
[ $rc = 0 ] && grep -q '"denoised0":	0.36056' "$tmp/out"
check "golden for other seeds" $?
mkdir "$tmp/got" && cp "$tmp/out" "$tmp/got/golden.near"
cp "$tmp/out" "$tmp/first"
golden --float --base-r=1 --base-m=2 --base-d=3 --threads=1
[ $rc = 0 ] && cmp -s "$tmp/first" "$tmp/out"
check "golden does not depend on the number of threads" $?
# The first loss is that of the denoiser as it begins, from PyTorch in double; then it is trained on the next five images.
number() { sed -n "s/.*\"$1\":[[:space:]]*\[\{0,1\}\([-0-9.e+]*\).*/\1/p" "$2"; }
golden --float --train-step
[ $rc = 0 ] && ! grep -q bce_ "$tmp/first" &&
    echo "$(number denoiser_loss "$tmp/out") $(number bce_before "$tmp/out") $(number bce_after "$tmp/out")" |
    awk '{exit !(NF == 3 && $1 > 0.80947 && $1 < 0.80964 && $2 > $3 && $3 > 0)}'
check "golden --train-step: an iteration more" $?
sed 's/[-+]\{0,1\}[0-9][0-9.]*\(e[-+][0-9]*\)\{0,1\}\([],]\|$\)/N\2/g' "$tmp/out" >"$tmp/got/golden-train" # sums of a step depend on the processor
# On one thread the figures are processor time. What depends on the machine is left out of what is compared whole.
bench --rounds=1 --batch=2 --threads=1
cp "$tmp/out" "$tmp/published"
awk '
    /GFLOP$/ { name = $1; sub(/:/, "", name); told = $2; next }
    $1 == "stage" { next }
    $1 == "all" { if (sum_ms - $3 > 0.1 || $3 - sum_ms > 0.1 || told - $2 > 0.001 || $2 - told > 0.001 || sum - told > 0.002 || told - sum > 0.002) bad = name
                  sum = sum_ms = 0; rate($2, $3, $4); next }
    NF >= 6 { sum += $(NF - 2); sum_ms += $(NF - 1); if ($(NF - 2) > 0.02 && $(NF - 1) > 0.2) rate($(NF - 2), $(NF - 1), $NF); next }
    NF == 2 && name { figure[$1] = $2 }
    function rate(gflop, took, said, x) { x = 1000 * gflop / took; if (said - x > 0.02 * x + 0.06 || x - said > 0.02 * x + 0.06) bad = name " " $0 }
    END {
        for (f in figure) if (!(figure[f] > 0)) bad = f " " figure[f]
        if (bad) print bad
        exit bad != ""
    }' "$tmp/published" >"$tmp/err"
check "bench: rates and sums go together" $?
awk '/^instruction/ { $3 = "X"; print; next }
    NF == 2 && /_/ { print $1; next } # a figure
    $NF ~ /^[0-9.]+$/ { sub(/ *[0-9.]+ *[0-9.]+$/, ""); if ($NF > 0) print; next } # a layer that computes
    { print }' "$tmp/published" >"$tmp/got/bench"
bench --json --rounds=2 --batch=1 --threads=2 --model "$corpus/f16.ggn"
sed 's/: [0-9.]*\([,}]\)/: X\1/g; s/"isa": "[a-z0-9]*"/"isa": X/' "$tmp/out" >"$tmp/got/bench-json"
# every layer is timed: the rows of each network give its sum
bench --rounds=2 --batch=1 --threads=2 --model "$corpus/f16.ggn"
[ $rc = 0 ] && awk '$1 == "all" { n++; inside = 0; bad += !(rows > 9 && $3 > 0 && ms > $3 - 0.001 * rows && ms < $3 + 0.001 * rows) }
    inside { ms += $(NF - 1); rows++ }
    $1 == "stage" { inside = 1; ms = rows = 0 }
    END { exit !(n == 3 && bad == 0) }' "$tmp/out"
check "bench: the times of the layers are that of the network" $?
awk '$1 == "all" { if (FILENAME == ARGV[1]) small += $2; else large += $2 } END { exit !(small > 0 && small < large / 5) }' "$tmp/out" "$tmp/published"
check "bench --model: a small one has less than a fifth of the work" $?
bench --json --rounds=1 --batch=1 --model=ggn/models/lull-3.ggn
[ $rc = 0 ] && grep -q '"train_sample_ms": [0-9]' "$tmp/out"
check "bench --model: a residual one trains, too" $?
run frobnicate
[ $rc = 2 ]
check "an unknown command is exit 2" $?
python3 tests/cli/whole.py models "$tmp/got" $((n + 1)) || bad=1
exit $bad
