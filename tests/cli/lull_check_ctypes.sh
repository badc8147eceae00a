#!/bin/sh
# scripts/hosts/ctypes_host.py: the same libraries hosted from plain Python.
BUILD=${BUILD:-build}
host=scripts/hosts/ctypes_host.py
if ! python3 -c 'import ctypes, array' 2>/dev/null; then
    echo "ok 1 - ctypes host # SKIP no python3 with ctypes"
    exit 0
fi
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0
t() { # t NAME COMMAND...
    n=$((n + 1)) name=$1
    shift
    if "$@" >"$tmp/log" 2>&1; then echo "ok $n - $name"; else
        echo "not ok $n - $name"
        tail -n 20 "$tmp/log" | sed 's/^/#   /'
    fi
}
run() { python3 "$host" "$@"; }
# the quiet block stops first, the noisy one gets more; tail-share lets the block with fireflies go
map() { run "$@" | tail -n 2 | awk '{ for (i = 1; i < NF; i++) if ($(i + 1) == "spp") printf "%s ", $i }'; }
quiet_before_noisy() { set -- $(map "$@") && [ "$1" = 16 ] && [ "$2" -gt "$1" ] && [ "$3" -gt "$2" ]; }
guarded() { set -- $(map "$1" area=0 threshold=1 first-spp=500) $(map "$1" area=0 threshold=1 first-spp=500 tail-share=1) && [ "$4" -gt "$8" ]; }

t "halfbuf: noisier blocks get more samples" quiet_before_noisy "$BUILD/lib/lull/halfbuf.so"
t "variance: noisier blocks get more samples" quiet_before_noisy "$BUILD/lib/lull/variance.so"
t "halfbuf: fireflies keep a block alive" guarded "$BUILD/lib/lull/halfbuf.so"
t "fixed stops at 100" sh -c "[ \"\$(python3 $host $BUILD/lib/lull/fixed.so spp=100 | grep -c ' 100 spp: stop')\" = 4 ]"
t "null runs to the limit" sh -c "[ \"\$(python3 $host $BUILD/lib/lull/null.so | tail -n 2 | grep -o limit | wc -l)\" = 4 ]"
t "history and lull.state/1" run "$BUILD/tests/abi/plugins/faulty.so"
t "a refused value is told" sh -c "! python3 $host $BUILD/lib/lull/fixed.so spp=x 2>$tmp/err && grep -q \"spp: 'x'\" $tmp/err"
t "no such library" sh -c "! python3 $host ./none.so 2>$tmp/err && grep -q none.so $tmp/err"
t "usage" sh -c "! python3 $host 2>$tmp/err && grep -q KEY=VALUE $tmp/err"
echo "1..$n"
