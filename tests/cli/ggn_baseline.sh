#!/bin/sh
# ggn baseline: what it writes, that it depends on nothing but the data, and how it fails.
build=${BUILD:-build}
ggn=$build/bin/ggn
data=tests/data/train-demo
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 failed=0
check() { # check NAME STATUS
    n=$((n + 1))
    if [ "$2" = 1 ]; then echo "ok $n - $1"; else echo "not ok $n - $1"; sed 's/^/# /' "$tmp/out" "$tmp/err"; failed=1; fi
}
run() { "$ggn" baseline "$@" >"$tmp/out" 2>"$tmp/err"; rc=$?; }
one_line() { [ "$(wc -l <"$tmp/err")" -eq 1 ] && [ ! -s "$tmp/out" ]; }
refused() { # refused NAME WORDS ARGS...
    name=$1 words=$2
    shift 2
    run "$@"
    check "$name: one line and exit 2" $([ $rc = 2 ] && one_line && grep -qF -e "$words" "$tmp/err" && echo 1)
}
for k in svd-entropy attributes noise-mask; do
    run $k -d $data -o "$tmp/$k.ggn" --epochs 2 --threads 1
    check "$k is trained" $([ $rc = 0 ] && grep -q 'AUC 0\.[5-9]\|AUC 1' "$tmp/out" && [ -s "$tmp/$k.ggn" ] && echo 1)
    run $k -d $data -o "$tmp/again.ggn" --epochs 2 --threads 2
    check "$k: the same bytes for any threads" $([ $rc = 0 ] && cmp -s "$tmp/$k.ggn" "$tmp/again.ggn" && echo 1)
done
run attributes -d $data -o "$tmp/half.ggn" --type f16
check "--type f16 is smaller" $([ $rc = 0 ] && [ "$(wc -c <"$tmp/half.ggn")" -lt "$(wc -c <"$tmp/attributes.ggn")" ] && echo 1)
refused "no name" "NAME" -d $data -o "$tmp/x.ggn"
refused "another name" "none of svd-entropy" lstm -d $data -o "$tmp/x.ggn"
refused "no data" "--data" attributes -o "$tmp/x.ggn"
refused "data that is none" "/nonexistent" attributes -d /nonexistent -o "$tmp/x.ggn"
refused "an output that cannot be" "/nonexistent" attributes -d $data -o /nonexistent/x.ggn
[ ! -e "$tmp/x.ggn" ]
check "nothing is left behind" $([ $? = 0 ] && echo 1)
criterion() { # criterion ID MODEL: as create answers
    "$build/bin/lull-check" -q -o table "$build/lib/lull/ggn.so:$1" -p model="$2" >"$tmp/out" 2>"$tmp/err"
    rc=$?
}
criterion attributes "$tmp/noise-mask.ggn"
check "a criterion refuses another's model" $([ $rc = 1 ] && grep -q 'noise-mask.ggn: not a baseline for attributes' "$tmp/out" && echo 1)
criterion attributes ggn/models/lull-2.ggn
check "a criterion refuses a network" $([ $rc = 1 ] && grep -q 'not a baseline' "$tmp/out" && echo 1)
head -c 3000 "$tmp/attributes.ggn" >"$tmp/short.ggn"
criterion attributes "$tmp/short.ggn"
check "a criterion refuses half a file" $([ $rc = 1 ] && grep -q 'short.ggn' "$tmp/out" && echo 1)
echo "1..$n"
exit $failed
