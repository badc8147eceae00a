#!/bin/sh
# The man pages of programs say what --help and docs/man/PAGE.h2m say now (`make man` writes them), and groff has no warning about them.
. "$(dirname "$0")/ggn_setup"
command -v help2man >"$tmp/out" || { echo "ok 1 # SKIP help2man is not installed: pages may be stale"; echo "1..1"; exit 0; }
mkdir "$tmp/man"
docs/man/write "$tmp/man" >"$tmp/out" 2>"$tmp/err"
check "help2man writes the pages" $?
for page in "$tmp"/man/*.1; do
    name=$(basename "$page")
    diff "$page" "docs/man/$name" >"$tmp/out" 2>"$tmp/err"
    check "$name is not stale" $?
    groff -z -wall -K utf8 -T utf8 -man "docs/man/$name" >"$tmp/out" 2>"$tmp/err" && [ ! -s "$tmp/err" ]
    check "  ...and has no mistake" $?
done
echo "1..$n"
exit $bad
