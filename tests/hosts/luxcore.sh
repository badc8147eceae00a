#!/bin/sh
# LuxCore as a host.
BUILD=${BUILD:-build}
export BUILD PYTHONPATH=plugin-api/python:tests/hosts
python=build/hosts/luxcore/bin/python3
if ! "$python" -c 'import numpy, pyluxcore' >/dev/null 2>&1; then
    echo "ok 1 - LuxCore # SKIP not in build/hosts/luxcore: run make test-hosts"
    exit 0
fi
exec "$python" tests/hosts/test_luxcore.py
