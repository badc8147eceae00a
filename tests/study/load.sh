#!/bin/sh
# 50 simulated participants at once.
. "$(dirname "$0")/node.sh"
exec node "$work/load.mjs" "$work/load"
