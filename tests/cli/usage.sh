#!/bin/sh
# Wrong command lines of ggn and lull-check: one line on stderr that names the trouble, nothing on stdout, exit status 2. --help,
# --usage and --version of every command.
. "$(dirname "$0")/ggn_setup"
refused() { # refused PATTERN COMMAND...
    pattern=$1
    shift
    "$@" >"$tmp/out" 2>"$tmp/err" </dev/null
    [ $? = 2 ] && [ "$(wc -l <"$tmp/err")" = 1 ] && [ ! -s "$tmp/out" ] && grep -q -e "$pattern" "$tmp/err"
    check "$(basename "$*")" $?
}
commands=$("$bin/ggn" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z0-9-]*\) .*/\1/p')
[ "$(echo "$commands" | wc -w)" -ge 11 ]
check "ggn --help lists the commands" $?
for c in $commands; do
    "$bin/ggn" "$c" --help >"$tmp/out" 2>"$tmp/err" && grep -q "Usage: ggn $c" "$tmp/out" && "$bin/ggn" "$c" --usage >"$tmp/out" &&
        man=docs/man/ggn-$c.1 && for o in $("$bin/ggn" "$c" --help | grep -o -e '--[a-z][a-z0-9-]*' | sort -u); do
            case $o in --help | --usage | --version) continue ;; esac
            tr -d '\\' <"$man" | grep -qF -e "$o" || { echo "$man lacks $o" >"$tmp/err"; false; break; }
        done
    check "ggn $c --help, and its manual page names every option" $?
    refused "nonsense" "$bin/ggn" "$c" --nonsense
done
for p in ggn lull-check lull-plot lull-render lull-report lull-study; do
    "$bin/$p" --version >"$tmp/out" 2>"$tmp/err" && grep -qx "$p (Lull) $("$bin/ggn" --version | sed 's/.* //')" "$tmp/out"
    check "$p --version is the project's" $?
done
refused "a command is needed" "$bin/ggn"
refused "frobnicate" "$bin/ggn" frobnicate
refused "--window 99: expected an integer from 2 to 16" "$bin/ggn" train -d x -o y --window 99
refused "--preset best: expected paper or lull" "$bin/ggn" train -d x -o y --preset best
refused "--type f64: expected f32, f16 or bf16" "$bin/ggn" convert -t f64 a b
refused "expected REFERENCE TEST" "$bin/ggn" flip a
refused "expected CRITERION" "$bin/lull-check"
refused "--threads 1: expected an integer from 2 to 32" "$bin/lull-check" -t 1 x
refused "--only nothing: no such check" "$bin/lull-check" -o nothing x
refused "--param x: expected KEY=VALUE" "$bin/lull-check" -p x y
# OpenImageIO is loaded by who reads an image.
mkdir -p "$tmp/alone/bin" && cp "$bin/ggn" "$tmp/alone/bin" && "$tmp/alone/bin/ggn" --version >"$tmp/out"
check "ggn starts without the image library" $?
picture=scenes/demo-reference.png
refused "$picture: images cannot be read: lib/lull/modules/lull-images.so" "$tmp/alone/bin/ggn" flip $picture $picture
mkdir -p "$tmp/alone/lib/lull/modules" && cp "$bin/../lib/lull/modules/lull-images.so" "$tmp/alone/lib/lull/modules" && "$tmp/alone/bin/ggn" flip $picture $picture >"$tmp/out"
check "  ...which is found beside the program" $?
# What the path tracer says of itself.
for o in --help --usage; do
    echo "> lull-render $o"
    "$bin/lull-render" $o | sed 's/^/  /'
done | "$BUILD/tests/approve" tests/cli/usage.txt $((n + 1)) || bad=1
exit $bad
