#!/bin/sh
# What ggn evaluate, cost and compare reckon: small cases worked by hand, and the table of published models against people.
. "$(dirname "$0")/ggn_setup"
PYTHONPATH=plugin-api/python:tests/hosts PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 tests/cli/ggn_judge.py >"$tmp/out" 2>&1
cat "$tmp/out"
grep -q '^1\.\.' "$tmp/out" && ! grep -q '^not ok' "$tmp/out"
