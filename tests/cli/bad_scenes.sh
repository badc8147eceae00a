#!/bin/sh
# The command on every malformed scene of tests/bad-input: exit status 2, exactly one line on stderr with the file and line
# that the scene's first line announces, nothing on stdout, no file written.
# Called again with "NUMBER SCENE" for each, two at a time: most of the time is the start of the program.
set -u
cd "$(dirname "$0")/../bad-input" || exit 2
if [ $# -eq 0 ]; then
    set -- *.pbrt
    echo "1..$#"
    n=0
    for scene; do n=$((n + 1)); printf '%s\n%s\n' "$n" "$scene"; done | xargs -P 2 -n 2 sh ../cli/bad_scenes.sh
    exit 0
fi
n=$1 scene=$2
case ${BUILD:-build} in /*) bin=$BUILD/bin ;; *) bin=../../${BUILD:-build}/bin ;; esac
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
mkdir "$tmp/out"
expected=$(sed -n '1s/^# expect: //p' "$scene" | tr -d '\000')
case $expected in
[0-9]*:*) place="$scene:${expected%%:*}:" words=${expected#*: } ;;
*) place='' words=$expected ;;
esac
"$bin/lull-render" --spp 1 -o "$tmp/out/x.exr" --preview "$tmp/out/x.png" --report "$tmp/out/x.json" "$scene" \
    >"$tmp/stdout" 2>"$tmp/stderr" </dev/null
rc=$?
lines=$(wc -l <"$tmp/stderr") why=
[ "$rc" -eq 2 ] || why="$why exit status $rc;"
[ "$lines" -eq 1 ] || why="$why $lines lines on stderr;"
[ ! -s "$tmp/stdout" ] || why="$why text on stdout;"
grep -qF -- "$place" "$tmp/stderr" || why="$why no \"$place\";"
grep -qF -- "$words" "$tmp/stderr" || why="$why no \"$words\";"
[ -z "$(ls -A "$tmp/out")" ] || why="$why a file was written;"
if [ -z "$why" ]; then
    echo "ok $n - $scene"
else
    { echo "not ok $n - $scene:$why"; sed 's/^/# /' "$tmp/stderr"; }
fi
