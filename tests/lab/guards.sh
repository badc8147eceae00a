#!/bin/sh
# scripts/guards takes lines out of the product: each is there, once, so that the table of guards can be made again.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
t "the lines of all guards are there" /usr/bin/python3 - <<'END'
from importlib import machinery
guards = machinery.SourceFileLoader("guards", "scripts/guards").load_module()
gone = [guard for _, guard, file, line, *_ in guards.GUARDS if open(file).read().count(line) != 1]
assert guards.GUARDS and not gone, gone
END
echo "1..$n"
exit $bad
