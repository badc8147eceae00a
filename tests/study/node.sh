# Sourced by the tests beside it: puts node, and for the browser's test Chromium and playwright-core, where they are found,
# or skips. What is missing is installed when that is possible: Debian's packages as root, playwright-core under build/.
cd "$(dirname "$0")/../.." || exit 2
work=build/study-test
skip() { echo "ok 1 - $(basename "$0") # SKIP $1"; exit 0; }
need() { # need COMMAND PACKAGE
    command -v "$1" >/dev/null 2>&1 && return
    if [ "$(id -u)" = 0 ]; then
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$2" >/dev/null 2>&1
    fi
    command -v "$1" >/dev/null 2>&1 || skip "$1 is not installed (apt-get install $2)"
}
need_browser() {
    need chromium chromium
    [ -d "$work/node_modules/playwright-core" ] && return
    need npm npm
    npm install --prefix "$work" --no-fund --no-audit --silent playwright-core@1.65.1 >/dev/null 2>&1 ||
        skip "playwright-core cannot be installed with npm"
}
need node nodejs
mkdir -p "$work" && copy=$(mktemp -d "$work/copy.XXXXXX") || exit 2
cp tests/study/*.mjs "$copy" && mv -f "$copy"/*.mjs "$work" && rmdir "$copy" || exit 2 # the others run at the same time
LULL_STUDY=$PWD/${BUILD:-build}/bin/lull-study PAGE=$PWD/plugin-api/python/lull/study/page
export LULL_STUDY PAGE
