#!/bin/sh
# ggn golden, inspect, convert, bench: what they print and how they fail.
ggn=${BUILD:-build}/bin/ggn
corpus=tests/fuzz/corpus/ggn_model
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 failed=0
check() { # check NAME STATUS: the last command's status was STATUS, its output is in $tmp/out and $tmp/err
    n=$((n + 1))
    if [ "$2" = 1 ]; then echo "ok $n - $1"; else echo "not ok $n - $1"; sed 's/^/# /' "$tmp/out" "$tmp/err"; failed=1; fi
}
run() { "$ggn" "$@" >"$tmp/out" 2>"$tmp/err"; rc=$?; }
one_line() { [ "$(wc -l <"$tmp/err")" -eq 1 ] && [ ! -s "$tmp/out" ]; }

run inspect "$corpus/f16.ggn"
check "inspect prints the networks" $([ $rc = 0 ] && grep -q 'preset *lull' "$tmp/out" && echo 1)
run inspect --json "$corpus/paper-bf16.ggn"
check "inspect --json prints the description" $([ $rc = 0 ] && grep -q '"preset":.*"paper"' "$tmp/out" && echo 1)
run inspect --tensors "$corpus/paper-bf16.ggn"
check "inspect --tensors lists them" $([ $rc = 0 ] && grep -q 'denoiser/enc0.0.weight .*bf16' "$tmp/out" && echo 1)
run inspect /nonexistent.ggn
check "a missing file is one line and exit 2" $([ $rc = 2 ] && one_line && grep -q nonexistent "$tmp/err" && echo 1)
head -c 20000 "$corpus/f16.ggn" >"$tmp/short.ggn"
run inspect "$tmp/short.ggn"
check "a truncated file is one line and exit 2" $([ $rc = 2 ] && one_line && grep -q truncated "$tmp/err" && echo 1)
{ head -c 30000 "$corpus/f16.ggn"; printf 'x'; tail -c +30002 "$corpus/f16.ggn"; } >"$tmp/flipped.ggn"
run inspect "$tmp/flipped.ggn"
check "a damaged file is one line and exit 2" $([ $rc = 2 ] && one_line && grep -q damaged "$tmp/err" && echo 1)
{ head -c 8 "$corpus/f16.ggn"; printf '\003'; tail -c +10 "$corpus/f16.ggn"; } >"$tmp/future.ggn"
run inspect "$tmp/future.ggn"
check "a future version is named, exit 2" $([ $rc = 2 ] && one_line && grep -q 'version 3' "$tmp/err" && echo 1)
run convert --type f32 "$corpus/paper-bf16.ggn" "$tmp/wide.ggn" && run convert --type bf16 "$tmp/wide.ggn" "$tmp/back.ggn"
check "convert to more bits and back is the same file" $([ $rc = 0 ] && cmp -s "$corpus/paper-bf16.ggn" "$tmp/back.ggn" &&
    [ "$(wc -c <"$tmp/wide.ggn")" -gt "$(wc -c <"$tmp/back.ggn")" ] && echo 1)
run convert "$tmp/wide.ggn" "$tmp/half.ggn" && run inspect --tensors "$tmp/half.ggn"
check "convert stores f16 when nothing is said" $([ $rc = 0 ] && grep -q 'denoiser/enc0.0.weight .*f16 ' "$tmp/out" && echo 1)
run convert "$tmp/short.ggn" "$tmp/none.ggn"
check "convert of a truncated file is one line and exit 2" $([ $rc = 2 ] && one_line && [ ! -e "$tmp/none.ggn" ] && echo 1)
run convert "$tmp/wide.ggn" /nonexistent/out.ggn
check "convert into no folder is one line and exit 2" $([ $rc = 2 ] && one_line && echo 1)
run convert --type f64 "$tmp/wide.ggn" "$tmp/none.ggn"
check "convert to no type is exit 2" $([ $rc = 2 ] && grep -q f64 "$tmp/err" && [ ! -e "$tmp/none.ggn" ] && echo 1)
run golden --base-r=-1
check "a bad seed is exit 2" $([ $rc = 2 ] && echo 1)
run golden --float --base-r=1 --base-m=2 --base-d=3
check "golden for other seeds" $([ $rc = 0 ] && grep -q '"denoised0":	0.36056' "$tmp/out" && echo 1)
cp "$tmp/out" "$tmp/first"
run golden --float --base-r=1 --base-m=2 --base-d=3 --threads=1
check "golden does not depend on the number of threads" $([ $rc = 0 ] && cmp -s "$tmp/first" "$tmp/out" && echo 1)
run bench --json --rounds=1 --batch=1 --threads=2
check "bench --json has every figure" $([ $rc = 0 ] && for k in denoiser_forward_ms generator_forward_ms \
    discriminator_forward_ms decision_ms denoiser_train_ms generator_train_ms train_sample_ms sgemm_gflops; do
    grep -q "\"$k\": [0-9.]" "$tmp/out" || exit; done && echo 1)
run frobnicate
check "an unknown command is exit 2" $([ $rc = 2 ] && echo 1)
echo "1..$n"
exit $failed
