#!/bin/sh
# Each command line of README.md's section Install is run by a test.
. "$(dirname "$0")/setup"
sed -n '/^## Install/,/^## /p' README.md | sed -n '/^```sh/,/^```/p' | grep -v '^```' | sed 's/  *# .*//' >"$tmp/lines"
run_by() { # run_by LINE: a test takes it, or tests/e2e/demo.sh runs what it ends in
    case $1 in
    "make demo") make -n -o all demo 2>/dev/null | grep -qx scripts/demo && grep -q 'scripts/demo$' tests/e2e/demo.sh ;;
    "make test") grep -q '^make .* test ' .ci/run ;;
    *) sed -n 's/.*readme_line "\(.*\)").*/\1/p' tests/packages/*.sh | while read -r start; do case $1 in "$start"*) echo "$start" ;; esac; done | grep . ;;
    esac
}
t "there are lines" test -s "$tmp/lines"
while read -r line; do t "$line" run_by "$line"; done <"$tmp/lines"
t "README.md has at most 60 lines" test "$(wc -l <README.md)" -le 60
echo "1..$n"
