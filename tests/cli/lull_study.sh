#!/bin/sh
# `lull-study` from the outside, without a browser: making, serving, refusing, reporting, export, import, deletion.
set -u
cd "$(dirname "$0")/../.." || exit 2
exec python3 tests/cli/lull_study.py "${BUILD:-build}/bin/lull-study"
