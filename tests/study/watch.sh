#!/bin/sh
# python3 -m lull watch in a real browser while a render goes on and when it is over; screenshots in build/study-test/watch.
. "$(dirname "$0")/node.sh"
need_browser
[ -x "${BUILD:-build}/bin/lull-render" ] || skip "lull-render is not built (make all)"
rm -rf "$work/watch" && mkdir -p "$work/watch" || exit 2
PYTHONPATH=$PWD/plugin-api/python LULL_RENDER=$PWD/${BUILD:-build}/bin/lull-render CHROMIUM=$(command -v chromium) \
    exec node "$work/watch.mjs" "$work/watch" "$PWD/tests/cli/room.pbrt"
