#!/bin/sh
# ggn baseline: what it writes, that it depends on nothing but the data, and how it fails.
. "$(dirname "$0")/ggn_setup"
run() { "$ggn" baseline "$@" >"$tmp/out" 2>"$tmp/err"; rc=$?; }
one_line() { [ "$(wc -l <"$tmp/err")" -eq 1 ] && [ ! -s "$tmp/out" ]; }
refused() { # refused NAME WORDS ARGS...
    name=$1 words=$2
    shift 2
    run "$@"
    [ $rc = 2 ] && one_line && grep -qF -e "$words" "$tmp/err"
    check "$name: one line and exit 2" $?
}
for k in svd-entropy attributes noise-mask; do
    run $k -d $data -o "$tmp/$k.ggn" --epochs 2 --threads 1
    [ $rc = 0 ] && grep -q 'AUC 0\.[5-9]\|AUC 1' "$tmp/out" && [ -s "$tmp/$k.ggn" ]
    check "$k is trained" $?
    run $k -d $data -o "$tmp/again.ggn" --epochs 2 --threads 2
    [ $rc = 0 ] && cmp -s "$tmp/$k.ggn" "$tmp/again.ggn"
    check "$k: the same bytes for any threads" $?
done
run attributes -d $data -o "$tmp/half.ggn" --type f16
[ $rc = 0 ] && [ "$(wc -c <"$tmp/half.ggn")" -lt "$(wc -c <"$tmp/attributes.ggn")" ]
check "--type f16 is smaller" $?
refused "no name" "NAME" -d $data -o "$tmp/x.ggn"
refused "another name" "none of svd-entropy" lstm -d $data -o "$tmp/x.ggn"
refused "no data" "--data" attributes -o "$tmp/x.ggn"
refused "data that is none" "/nonexistent" attributes -d /nonexistent -o "$tmp/x.ggn"
refused "an output that cannot be" "/nonexistent" attributes -d $data -o /nonexistent/x.ggn
[ ! -e "$tmp/x.ggn" ]
check "nothing is left behind" $?
criterion() { # criterion ID MODEL: as create answers
    "$BUILD/bin/lull-check" -q -o table "$BUILD/lib/lull/baselines.so:$1" -p model="$2" >"$tmp/out" 2>"$tmp/err"
    rc=$?
}
criterion attributes "$tmp/noise-mask.ggn"
[ $rc = 1 ] && grep -q 'noise-mask.ggn: not a baseline for attributes' "$tmp/out"
check "a criterion refuses another's model" $?
criterion attributes ggn/models/lull-3.ggn
[ $rc = 1 ] && grep -q 'not a baseline' "$tmp/out"
check "a criterion refuses a network" $?
head -c 3000 "$tmp/attributes.ggn" >"$tmp/short.ggn"
criterion attributes "$tmp/short.ggn"
[ $rc = 1 ] && grep -q 'short.ggn' "$tmp/out"
check "a criterion refuses half a file" $?
echo "1..$n"
exit $bad
