#!/bin/sh
# The page of lull-render --html in a real browser; screenshots in build/study-test/page.
. "$(dirname "$0")/node.sh"
need_browser
[ -x "${BUILD:-build}/bin/lull-render" ] || skip "lull-render is not built (make all)"
rm -rf "$work/page" && mkdir -p "$work/page" || exit 2
name="a '<b onclick=x>\"&amp; scene.pbrt"
cp tests/cli/room.pbrt "$work/page/$name"
for layers in "" --denoise; do
    LULL_OIDN=$PWD/${BUILD:-build}/tests/oidn-stub "${BUILD:-build}/bin/lull-render" "$work/page/$name" -q --size 120x80 --block 20 --spp-max 96 \
        $layers --html "$work/page/page$layers.html" --report "$work/page/page$layers.json" || exit 2
done
CHROMIUM=$(command -v chromium) exec node "$work/page.mjs" "$work/page" "$name"
