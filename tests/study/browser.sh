#!/bin/sh
# All tasks of `lull-study` in a real browser; screenshots in build/study-test/browser/shots.
. "$(dirname "$0")/node.sh"
need chromium chromium
if [ ! -d "$work/node_modules/playwright-core" ]; then
    need npm npm
    npm install --prefix "$work" --no-fund --no-audit --silent playwright-core@1.65.1 >/dev/null 2>&1 ||
        skip "playwright-core cannot be installed with npm"
fi
CHROMIUM=$(command -v chromium) exec node "$work/browser.mjs" "$work/browser"
