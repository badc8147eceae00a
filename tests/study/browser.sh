#!/bin/sh
# All tasks of `lull-study` in a real browser; screenshots in build/study-test/browser/shots.
. "$(dirname "$0")/node.sh"
need_browser
CHROMIUM=$(command -v chromium) exec node "$work/browser.mjs" "$work/browser"
