#!/bin/sh
# 500 runs of simulated participants through page code and server: STUDY_RUNS changes their number.
. "$(dirname "$0")/node.sh"
exec node "$work/simulate.mjs" "$work/simulate" "${STUDY_RUNS:-500}"
