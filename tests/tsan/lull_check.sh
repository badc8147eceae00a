#!/bin/sh
# Under ThreadSanitizer: the criteria that may be called concurrently have no race, and a race would be found.
BUILD=${BUILD:-build/tsan}
check=$BUILD/bin/lull-check n=0
log=$(mktemp) || exit 2
trap 'rm -f "$log"' EXIT
for so in "$BUILD"/lib/lull/*.so "$BUILD/tests/abi/plugins/faulty.so"; do
    n=$((n + 1))
    if [ "${so##*/}" = ggn.so ] && [ -z "${LULL_MODEL:-}" ] && ! ls ggn/models/*.ggn >/dev/null 2>&1; then
        echo "ok $n - ggn.so # SKIP no model in ggn/models"
        continue
    fi
    # ggn's convolutions are slow here: one check, whose host has threads
    checks="-o workers -o concurrent -o instances -o cancel" spec=$so
    [ "${so##*/}" = ggn.so ] && checks="-L 900 -o cancel"
    [ "${so##*/}" = denoised.so ] && export LULL_OIDN="$BUILD/tests/oidn-stub"
    [ "${so##*/}" = baselines.so ] && checks="-o table" # they need models
    # shellcheck disable=SC2086
    if "$check" -q $checks "$spec" >"$log" 2>&1; then echo "ok $n - ${so##*/}"; else
        echo "not ok $n - ${so##*/}"
        sed 's/^/#   /' "$log"
    fi
done
n=$((n + 1))
found=0 # on a busy machine two threads may run one after the other, so that one run in two meets no race
for _ in 1 2 3 4 5 6 7 8 9 10 11 12; do
    "$check" -q -o concurrent -p fault=23 "$BUILD/tests/abi/plugins/faulty.so" >"$log" 2>&1 || { grep -q "data race" "$log" && found=1 && break; }
done
if [ $found = 1 ]; then echo "ok $n - a race is found"; else
    echo "not ok $n - a race is found"
    sed 's/^/#   /' "$log"
fi
echo "1..$n"
