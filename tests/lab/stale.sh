#!/bin/sh
# scripts/lab pages --stale: figures are stale when the code of a file that they depend on has changed, and by nothing else.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
tree=$tmp/tree
mkdir "$tree" && cp -r scripts ggn pathtracer plugin-api docs README.md "$tree"
now() { # every job measured now
    python3 - "$tree" <<'END'
import sys
sys.path.insert(0, sys.argv[1] + "/scripts")
from lablib import pages, sources, tool
tool.save({name: {commit: sources.hashes(module.SOURCES) for commit in sources.commits(tool.results(tool.DOCS, name))}
           for name, module in pages.FIGURES.items()}, tool.DOCS, "results", sources.NAME)
END
}
stale() { "$tree/scripts/lab" pages --stale >"$tmp/said"; }
fresh() { stale && [ ! -s "$tmp/said" ]; }
told() { ! stale && grep -q "^$1: Measured before $2 changed" "$tmp/said" && ! grep -q "^$3:" "$tmp/said"; } # told JOB FILE, and JOB not

law=ggn/sight/visibility.c
t "every job that keeps figures says what they depend on" python3 -c "
import sys; sys.path.insert(0, 'scripts')
from lablib import pages
empty = [name for name, module in pages.FIGURES.items() if not module.SOURCES]
assert not empty, empty"
now
t "figures of today are not stale" fresh
printf '/* said anew */\n' | cat - "$tree/$law" >"$tmp/c" && sed 's/;$/; \/\/ end/' "$tmp/c" >"$tree/$law"
t "comments do not count" fresh
sed 's/#include "scene/#include "geom/' "$tree/pathtracer/shade/warp.h" >"$tree/pathtracer/geom/warp.h" && rm "$tree/pathtracer/shade/warp.h"
t "nor does where a file lies" fresh
mv "$tree/pathtracer/geom/warp.h" "$tree/pathtracer/shade"
sed -i 's/^#include <math.h>/&\nint other;/' "$tree/ggn/sight/viewing.c"
t "a line of code does" told truth ggn/sight/viewing.c references
cp ggn/sight/viewing.c "$tree/ggn/sight" && rm "$tree/plugin-api/examples/halfbuf.c"
t "and so does a file that is gone" told cost plugin-api/halfbuf.c paper
cp plugin-api/examples/halfbuf.c "$tree/plugin-api/examples" && sed -i 's/^GROWTH = 1.5/GROWTH = 1.6/' "$tree/plugin-api/python/lull/judge/rules.py"
t "Python's code likewise" told paper plugin-api/python/lull/judge/rules.py truth
sed -i 's/^"""[A-Z]/"""It/; s/  # largest ratio.*//; s/= 1.6$/= 1.5/' "$tree/plugin-api/python/lull/judge/rules.py"
t "without its comments" fresh
echo 'int other;' >>"$tree/ggn/sight/viewing.c" && "$tree/scripts/lab" pages
t "a stale table says so, once on a page" sh -c "[ \$(grep -c '^\*Measured before ggn/sight/viewing.c changed' '$tree/docs/results/paper.md') -eq 1 ]"
t "  …which is no difference to its template" "$tree/scripts/lab" pages --check
echo "1..$n"
