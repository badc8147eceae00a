#!/bin/sh
# lull-plot, or python3 -m lull plot: a picture of every kind from small files, what the pictures show, and one line for bad input.
. "$(dirname "$0")/ggn_setup"
python=/usr/bin/python3
"$python" -c 'import matplotlib' 2>"$tmp/err" || {
    echo "ok 1 - $0 # SKIP $(tail -n 1 "$tmp/err"): run scripts/setup"
    echo "1..1"
    exit 0
}
PYTHONPATH=plugin-api/python:tests/hosts PYTHONDONTWRITEBYTECODE=1 "$python" tests/cli/lull_plot.py >"$tmp/out" 2>&1
cat "$tmp/out"
grep -q '^1\.\.' "$tmp/out" && ! grep -q '^not ok' "$tmp/out"
