#!/bin/sh
# The parts of `lull-study`: its words against those that are recorded, the store and the plans, the statistics. By the Python that starts
# the program.
. "$(dirname "$0")/ggn_setup"
python=/usr/bin/python3
"$python" -c 'import aiohttp, matplotlib, scipy' 2>"$tmp/err" || {
    echo "ok 1 - $0 # SKIP $(tail -n 1 "$tmp/err"): run scripts/setup"
    echo "1..1"
    exit 0
}
export PYTHONPATH=plugin-api/python:tests/hosts:tests/study PYTHONDONTWRITEBYTECODE=1
for part in words core statistics shown; do "$python" tests/study/test_$part.py >"$tmp/out" 2>&1; cat "$tmp/out"; done | awk '
    /^(not )?ok [0-9]+/ { sub(/ok [0-9]+/, "ok " ++n); bad += /^not / } /^1\.\./ { next } { print } END { print "1.." n; exit bad > 0 || n < 40 }'
