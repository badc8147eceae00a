#!/bin/sh
# `pip install plugin-api/python` in a virtual environment gives a package that works from anywhere.
BUILD=${BUILD:-build}
python=$PWD/build/hosts/venv/bin/python3
if ! "$python" -c 'import numpy, setuptools, wheel' 2>/dev/null; then
    echo "ok 1 - pip install # SKIP no build/hosts/venv: run make test-hosts"
    exit 0
fi
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
cp -rL plugin-api/python "$tmp/source" # version.h is a link to the header of the programs in C
LULL_PLUGIN_PATH=$(cd "$BUILD/lib/lull" && pwd)
export LULL_PLUGIN_PATH
if "$python" -m pip install -q --disable-pip-version-check --no-index --no-build-isolation --no-deps --target "$tmp/target" \
    "$tmp/source" >"$tmp/log" 2>&1 && cd "$tmp" && PYTHONPATH=$tmp/target "$python" -c '
import lull, lull.blender.cli, lull.luxcore, lull.mitsuba
assert lull.__file__.startswith("'"$tmp"'/target")
assert lull.load("halfbuf").info.id == "halfbuf"' >>"$tmp/log" 2>&1; then
    echo "ok 1 - pip install"
else
    echo "not ok 1 - pip install"
    tail -n 20 "$tmp/log" | sed 's/^/#   /'
fi
echo "1..1"
