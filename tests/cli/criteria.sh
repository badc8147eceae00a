#!/bin/sh
# Every criterion with every action of lull-render (criteria.py; what is expected: criteria.txt).
. "$(dirname "$0")/ggn_setup"
"$ggn" baseline svd-entropy -d $data -o "$tmp/svd-entropy.ggn" --epochs 1 --threads 1 >"$tmp/out" 2>"$tmp/err"
check "a model that does not ship is trained" $?
python3 tests/cli/criteria.py "$tmp" "$tmp/svd-entropy.ggn" actions || bad=1
exit $bad
