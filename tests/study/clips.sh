#!/bin/sh
# Clips of `lull-study` in a real browser; screenshots in build/study-test/clips/shots.
. "$(dirname "$0")/node.sh"
need_browser
CHROMIUM=$(command -v chromium) exec node "$work/clips.mjs" "$work/clips"
