#!/bin/sh
# Every criterion on pictures with nothing to estimate (criteria.py; what is expected: criteria_nothing.txt).
. "$(dirname "$0")/ggn_setup"
"$ggn" baseline svd-entropy -d $data -o "$tmp/svd-entropy.ggn" --epochs 1 --threads 1 >"$tmp/out" 2>"$tmp/err"
check "a model that does not ship is trained" $?
python3 tests/cli/criteria.py "$tmp" "$tmp/svd-entropy.ggn" nothing || bad=1
exit $bad
