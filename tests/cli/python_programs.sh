#!/bin/sh
# Every program in Python with standard streams that are closed, full or read by nobody, and in a locale without letters: no traceback, no
# work lost, one line and the status of the programs in C.
. "$(dirname "$0")/ggn_setup"
python=/usr/bin/python3
"$python" -c 'import matplotlib, scipy' 2>"$tmp/err" || {
    echo "ok 1 - $0 # SKIP $(tail -n 1 "$tmp/err"): run scripts/setup"
    echo "1..1"
    exit 0
}
PYTHONPATH=plugin-api/python:tests/hosts PYTHONDONTWRITEBYTECODE=1 "$python" tests/cli/python_programs.py >"$tmp/out" 2>&1
cat "$tmp/out"
grep -q '^1\.\.' "$tmp/out" && ! grep -q '^not ok' "$tmp/out"
