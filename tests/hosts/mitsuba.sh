#!/bin/sh
# Mitsuba 3 as a host, variant scalar_rgb.
BUILD=${BUILD:-build}
export BUILD PYTHONPATH=plugin-api/python:tests/hosts
python=build/hosts/venv/bin/python3
if ! "$python" -c 'import mitsuba' 2>/dev/null; then
    echo "ok 1 - Mitsuba # SKIP not in build/hosts/venv: run make test-hosts"
    exit 0
fi
exec "$python" tests/hosts/test_mitsuba.py scalar_rgb
