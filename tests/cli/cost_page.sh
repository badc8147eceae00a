#!/bin/sh
# docs/cost.md is what scripts/cost makes of docs/cost.json, figure by figure; its options and errors.
cd "$(dirname "$0")/../.." || exit 2
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 failed=0
t() { # t NAME COMMAND...: passes if the command does
    n=$((n + 1)) name=$1
    shift
    if "$@" >"$tmp/log" 2>&1; then echo "ok $n - $name"; else
        echo "not ok $n - $name"
        tail -n 12 "$tmp/log" | sed 's/^/#   /'
        failed=1
    fi
}
skip() { n=$((n + 1)); echo "ok $n - $1 # SKIP $2"; }
refuses() { words=$1; shift; ! scripts/cost "$@" 2>"$tmp/err" && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -qF -e "$words" "$tmp/err"; }
t "--help" sh -c 'scripts/cost --help | grep -q -e --render'
t "an unknown step is one line" refuses "expected some of replay" --only drew
if command -v gnuplot >/dev/null; then
    cp docs/cost.json "$tmp/cost.json"
    t "drawn from the figures" scripts/cost --only draw --out "$tmp"
    t "the page is what the figures say" diff "$tmp/cost.md" docs/cost.md
    t "every picture of the page is there" sh -c 'for p in $(grep -o "](cost-[a-z-]*\.png)" "$1/cost.md" | tr -d "]()"); do [ -s "docs/$p" ] || { echo "$p"; exit 1; }; done' - "$tmp"
else
    skip "drawn from the figures" "no gnuplot"
fi
echo "1..$n"
exit $failed
