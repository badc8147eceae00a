#!/bin/sh
# scripts/check-floors names what does not belong, with file and line, in a small tree made here, and nothing in this tree.
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 failed=0
check() { # check NAME STATUS: 0 is good
    n=$((n + 1))
    if [ "$2" = 0 ]; then echo "ok $n - $1"; else echo "not ok $n - $1"; sed 's/^/# /' "$tmp/out"; failed=1; fi
}
run() { scripts/check-floors "$@" >"$tmp/out" 2>&1; }
plant() { # plant FILE: its text from standard input
    mkdir -p "$(dirname "$tmp/t/$1")" && cat >"$tmp/t/$1"
}
finds() { # finds NAME LINE: LINE is the only finding
    run "$tmp/t"
    [ $? = 1 ] && [ "$(wc -l <"$tmp/out")" = 1 ] && grep -qxF "$2" "$tmp/out"
    check "$1" $?
}
run
check "this tree has no findings" $?

echo 'floors: render shade' | plant pathtracer/README.md
echo 'floors: plugin nn' | plant ggn/README.md
echo 'floors: include base' | plant plugin-api/README.md
echo '#include "shade/b.h"' | plant pathtracer/render/a.c
echo 'int b;' | plant pathtracer/shade/b.h
echo '#include "base/err.h"' | plant ggn/nn/n.c
echo 'int e;' | plant plugin-api/base/err.h
echo '#include <lull/criterion.h>' | plant ggn/plugin/p.c
echo 'int l;' | plant plugin-api/include/lull/criterion.h
run "$tmp/t"
check "a clean tree has no findings" $?

printf 'int x;\n#include "render/c.h"\n' | plant pathtracer/shade/b.c
echo 'int c;' | plant pathtracer/render/c.h
finds "an upward include" "pathtracer/shade/b.c:2: upward include: shade stands below render (floors: render shade)"
echo '#include <lull/criterion.h>' | plant pathtracer/shade/b.c
finds "the ABI seen from elsewhere" \
    "pathtracer/shade/b.c:1: only the host side, ggn/plugin and plugin-api itself may see the ABI"
echo '#include "../../ggn/nn/n.h"' | plant pathtracer/shade/b.c
echo 'int n;' | plant ggn/nn/n.h
finds "one program in the other" \
    "pathtracer/shade/b.c:1: pathtracer includes ggn: both stand on plugin-api/base, job, picture and sequence only"
echo '#include "host/frame.h"' | plant pathtracer/shade/b.c
echo 'int f;' | plant plugin-api/host/frame.h
echo 'floors: host include base' | plant plugin-api/README.md
finds "the host library from inside" \
    "pathtracer/shade/b.c:1: pathtracer includes plugin-api: both stand on plugin-api/base, job, picture and sequence only"
: | plant pathtracer/shade/b.c
echo '#include <lull/host.h>' | plant ggn/plugin/h.c
echo 'int h;' | plant plugin-api/include/lull/host.h
finds "a criterion that hosts" "ggn/plugin/h.c:1: only hosts may see the host library"
rm "$tmp/t/ggn/plugin/h.c"
rm "$tmp/t/pathtracer/render/c.h"
echo '#include "shade/c.h"' | plant pathtracer/shade/b.c
echo '#include "shade/b.h"' | plant pathtracer/shade/c.h
run "$tmp/t"
check "a private header is part of its source" $?
echo '#include "shade/c.h"' | plant pathtracer/shade/c.c
run "$tmp/t"
grep -qxF "pathtracer/shade/b.c:1: circle of files: pathtracer/shade/b pathtracer/shade/c" "$tmp/out" && [ "$(wc -l <"$tmp/out")" = 2 ]
check "a circle of files" $?
rm "$tmp/t/pathtracer/shade/c.h" "$tmp/t/pathtracer/shade/c.c"
{ echo 'int f(void)'; echo '{'; yes '    g();' | head -58; echo '}'; } | plant pathtracer/shade/b.c
finds "a function of 61 lines" "pathtracer/shade/b.c:1: a function of 61 lines, at most 60"
{ echo 'int f(void)'; echo '{'; yes '    g();' | head -57; echo '}'; } | plant pathtracer/shade/b.c
run "$tmp/t"
check "but not one of 60" $?
{ printf '%0126d\n' 0; printf '%0121dääää\n' 0; } | plant pathtracer/shade/b.c
finds "a line of 126 columns, counted in characters" "pathtracer/shade/b.c:1: 126 columns, at most 125"
printf 'int f(int *x) { return x == NULL; }\n/* x == NULL */ char s[] = "== NULL";\n' | plant pathtracer/shade/b.c
finds "the other dialect" "pathtracer/shade/b.c:1: a comparison with NULL: the dialect is \`if (!x)\` and \`if (x)\`"
echo 'int b;' | plant pathtracer/shade/b.c
echo 'int a;' | plant pathtracer/shade/a.c
finds "two files of one name" "pathtracer/shade/a.c:1: pathtracer/render/a.c has the same name"
rm "$tmp/t/pathtracer/shade/a.c"
echo 'int o;' | plant pathtracer/odd/o.c
finds "a folder on no floor" "pathtracer/odd/o.c:1: the folder odd is on no floor of pathtracer/README.md"
rm -r "$tmp/t/pathtracer/odd"
echo '#!/bin/sh' | plant tests/cli/a.sh
finds "a script that cannot be run" "tests/cli/a.sh:1: a script without its run bit: chmod +x"
chmod +x "$tmp/t/tests/cli/a.sh"
run "$tmp/t"
check "but not one that can" $?
run --nonsense
[ $? = 2 ]
check "wrong usage is exit 2" $?
echo "1..$n"
exit $failed
