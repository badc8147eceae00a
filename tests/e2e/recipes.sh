#!/bin/sh
# CONTRIBUTING's recipes for a BSDF and for a subcommand of ggn, followed to the letter in a copy of the tree: what they say is enough.
. "$(dirname "$0")/../cli/tap_setup"
repo=$PWD BUILD=${BUILD:-build}
copy=$tmp/copy
mkdir -p "$copy/build/tests"
# The sources and what is built of them, with their times, so that only what the recipes touch is compiled.
git ls-files -z --cached --others --exclude-standard 2>"$tmp/err" | xargs -0 cp -a --parents -t "$copy" 2>"$tmp/err"
cp -a "$BUILD/obj" "$BUILD/bin" "$BUILD/lib" "$copy/build" && cp -a "$BUILD/tests/approve" "$copy/build/tests"
cd "$copy" || exit 2
unset BUILD RECORD MAKEFLAGS MODE OUT
# What the recipe says, and nothing else, is done: each line of it begins with its words, NAME being the model's or the command's.
section() { awk -v title="$1" 'index($0, "**" title "**") { on = 1 } /^\*\*/ && !index($0, title) { on = 0 } on' "$repo/CONTRIBUTING.md" | tr '\n' ' ' | tr -s ' '; }
says() { # says WORDS...: each of them stands in the recipe
    for words; do
        case $recipe in *"$words"*) ;; *) n=$((n + 1)); echo "not ok $n - the recipe no longer says: $words" ;; esac
    done
}
runs() { # runs WORDS: the recipe says to run this
    says "\`$1\`"
    t "$(echo "$1" | sed "s/NAME/$of/g")" sh -c "$(echo "$1" | sed "s/NAME/$of/g; s|^make all tests$|make $targets|; s/^make /make -j2 /")"
}

recipe=$(section "A BSDF.") of=chalk
targets="all build/tests/stat/pt_bsdf build/tests/golden/pt_images build/tests/unit/pt_approved build/tests/unit/pt_bsdf_material"
says "\`shade/bsdf_NAME.h\`" "copy \`bsdf_diffuse.h\`" "line at the end of \`PT_BSDFS\` (\`scene/materials.h\`)" "\`#include\` in \`shade/bsdf_dispatch.h\`" \
    "rows in \`all_cases\` (\`tests/support/pt_bsdf_cases.h\`)" "\`tests/golden/images/NAME.pbrt\`"
sed 's/diffuse/chalk/g; s/DIFFUSE/CHALK/g' pathtracer/shade/bsdf_diffuse.h >pathtracer/shade/bsdf_chalk.h
sed -i '/^#define PT_BSDFS/,/[^\\]$/s|[^\\]$|& \\\n    X(CHALK, chalk, "chalk", "chalk", PT_FX_GLOSSY)|' pathtracer/scene/materials.h
sed -i '0,/#include "shade\/bsdf_/s//#include "shade\/bsdf_chalk.h"\n&/' pathtracer/shade/bsdf_dispatch.h
sed -i 's|^#undef CASE|    CASE((struct pt_bsdf){.kind = PT_BSDF_CHALK, .reflectance = v3(0.8f, 0.5f, 0.2f)});\n&|' tests/support/pt_bsdf_cases.h
cat >tests/golden/images/chalk.pbrt <<'END'
LookAt 0 1 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
LightSource "point" "point3 from" [ 2 3 -2 ] "rgb I" [ 9 9 9 ]
Material "chalk" "rgb reflectance" [ 0.7 0.4 0.2 ]
Shape "sphere"
END
runs "make all tests"
runs "build/bin/lull-render tests/golden/images/NAME.pbrt --explain"
t "  …which names the model" sh -c 'build/bin/lull-render tests/golden/images/chalk.pbrt --explain | grep -q chalk'
runs "build/tests/stat/pt_bsdf"
runs "RECORD=1 build/tests/golden/pt_images"
t "  …adds the scene" sh -c 'build/tests/golden/pt_images && grep -q "^golden/chalk made" tests/golden/pt_images.txt'
t "nothing else of what is recorded has changed" sh -c 'build/tests/unit/pt_approved && build/tests/unit/pt_bsdf_material'

recipe=$(section "A subcommand.") of=hello
says "\`cli/NAME.c\` with \`ggn_cmd_NAME\`" "line in \`GGN_COMMANDS\` (\`cli/commands.h\`)" "copy \`cli/inspect.c\`" "\`docs/man/ggn-NAME.h2m\`" "\`tests/cli/ggn_NAME.sh\`"
sed 's/ggn_cmd_inspect/ggn_cmd_hello/; s/ggn inspect/ggn hello/' ggn/cli/inspect.c >ggn/cli/hello.c
sed -i '/^#define GGN_COMMANDS/,/[^\\]$/s|[^\\]$|& \\\n    X(hello, "say what a model is")|' ggn/cli/commands.h
sed 's/inspect/hello/g' docs/man/ggn-inspect.h2m >docs/man/ggn-hello.h2m
cat >tests/cli/ggn_hello.sh <<'END'
#!/bin/sh
. "$(dirname "$0")/ggn_setup"
$ggn hello tests/data/tiny.ggn >"$tmp/out" 2>"$tmp/err" && grep -q '^preset' "$tmp/out"
check "a model is described" $?
exit $bad
END
chmod +x tests/cli/ggn_hello.sh
if command -v help2man >"$tmp/out"; then
    runs "make all man"
    t "  …writes its page, and its line in ggn(1)" grep -l hello docs/man/ggn-hello.1 docs/man/ggn.1
    runs "sh tests/cli/usage.sh"
else n=$((n + 1)) && echo "ok $n - make all man # SKIP help2man is not installed" && t "make all" make -j2 all; fi
t "tests/cli/ggn_hello.sh" tests/cli/ggn_hello.sh
t "nothing that is recorded has changed" sh tests/cli/ggn_whole.sh
t "no file is out of its place" scripts/check-floors
echo "1..$n"
