#!/bin/sh
# `ggn study` from the outside, without a browser: making, serving, refusing, reporting, export, import, deletion.
set -u
cd "$(dirname "$0")/../.." || exit 2
exec python3 tests/cli/ggn_study.py "${BUILD:-build}/bin/ggn"
