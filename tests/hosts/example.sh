#!/bin/sh
# scripts/hosts/ctypes_host.py: the shortest host, in plain Python.
BUILD=${BUILD:-build}
host=scripts/hosts/ctypes_host.py
. tests/hosts/find-python
. tests/cli/tap_setup
run() { "$python" "$host" "$@"; }
counts() { run "$@" | sed -n 's/^  block .: *\([0-9]*\) spp.*/\1/p'; }
# the quiet block stops first, the noisy one gets most; tail-share lets the block with fireflies go
quiet_before_noisy() { set -- $(counts "$@") && [ "$1" = 32 ] && [ "$2" -ge "$1" ] && [ "$3" -gt "$2" ]; }
loose="area=0 threshold=1 first-spp=500"
guarded() { set -- $(counts "$1" $loose) $(counts "$1" $loose tail-share=1) && [ "$4" -gt "$8" ]; }
all() { [ "$(run "$@" | grep -c "$wanted")" = 4 ]; }
refused() { ! run "$@" 2>"$tmp/err" && grep -q "$wanted" "$tmp/err" && [ "$(wc -l <"$tmp/err")" = 1 ]; }

t "halfbuf: noisier blocks get more samples" quiet_before_noisy "$BUILD/lib/lull/halfbuf.so" threshold=.008
t "variance: noisier blocks get more samples" quiet_before_noisy "$BUILD/lib/lull/variance.so"
t "halfbuf: fireflies keep a block alive" guarded "$BUILD/lib/lull/halfbuf.so"
wanted=' 128 spp, 1 checks, criterion'
t "fixed stops at the first pair of waves past 100" all "$BUILD/lib/lull/fixed.so" spp=100
wanted='1024 spp.*spp-max'
t "null runs to the limit" all "$BUILD/lib/lull/null.so"
t "a criterion with history" run "$BUILD/tests/abi/plugins/faulty.so"
wanted="spp: 'x'"
t "a refused value is told" refused "$BUILD/lib/lull/fixed.so" spp=x
wanted=none.so
t "no such library" refused ./none.so
t "usage" sh -c "! $python $host 2>$tmp/err && grep -q KEY=VALUE $tmp/err"
echo "1..$n"
