#!/bin/sh
# --light-selection: what the default is, where it changes an image, who remembers it.
set -u
here=$(cd "$(dirname "$0")" && pwd)
BUILD=$(cd "${BUILD:-build}" && pwd)
P=$BUILD/bin/pathtracer
many=$here/../../scenes/many-lights.pbrt one=$here/../../scenes/cornell-box.pbrt
dir=$(mktemp -d) || exit 2
trap 'rm -rf "$dir"' EXIT
cd "$dir" || exit 2
n=0 bad=0

t() { # t DESCRIPTION COMMAND...: passes when the command succeeds
    n=$((n + 1)); what=$1; shift
    if "$@" >log 2>&1; then echo "ok $n - $what"; else echo "not ok $n - $what"; sed 's/^/# /' log; bad=1; fi
}
refused() { # refused TEXT COMMAND...: exit status 2 and one line on stderr that contains TEXT
    n=$((n + 1)); text=$1; shift
    "$@" >out 2>err; status=$?
    if [ $status -eq 2 ] && [ "$(wc -l <err)" -eq 1 ] && grep -qF -- "$text" err; then echo "ok $n - refused: $text"
    else echo "not ok $n - refused: $text (status $status)"; sed 's/^/# /' err; bad=1; fi
}
image() { # image FILE SCENE OPTIONS...
    out=$1 scene=$2; shift 2
    "$P" "$scene" -q --size 24x24 --spp 4 --reproducible -o "$out.exr" "$@"
}
image default "$many"; image hierarchy "$many" --light-selection hierarchy; image power "$many" --light-selection power
t "the default is the hierarchy" cmp default.exr hierarchy.exr
t "by power it is another image" sh -c "! oiiotool --fail 0 default.exr power.exr --diff"
image t1 "$many" --threads 1; image t3 "$many" --threads 3; image general "$many" --effects all
t "the same bytes for 1 and 3 threads" cmp t1.exr t3.exr
t "--effects all: the same pixels" oiiotool --fail 0 --warn 0 default.exr general.exr --diff
image one "$one"; image one-power "$one" --light-selection power
t "a single lamp is selected by power anyway" cmp one.exr one-power.exr
t "--explain says which: hierarchy" sh -c "'$P' '$many' --explain | grep -q '^light selection: hierarchy, 24 emitters'"
t "  …power when asked for" sh -c "'$P' '$many' --explain --light-selection power | grep -q '^light selection: power, 24 emitters'"
t "  …power where there is one lamp" sh -c "'$P' '$one' --explain | grep -q '^light selection: power, 2 emitters'"
refused "--light-selection" "$P" "$many" --light-selection cleverly

begin="$P $many -q --size 24x24 -c null --spp-min 2 --spp-max 8 --checkpoint c.ckp --checkpoint-every 0 -o image.exr"
t "a checkpoint" $begin
t "  …goes on with the same selection" $begin --resume --light-selection hierarchy
refused "made with light-selection=hierarchy, but this render has light-selection=power" $begin --resume --light-selection power

record="$P $many -q --size 24x24 --block 24 --sampler independent --levels linear:2:4:2"
t "a recording names the hierarchy in its manifest" sh -c "$record --sequence seq && grep -q 'renderer.*light hierarchy' seq/manifest.json"
t "  …but not power" sh -c "$record --sequence by-power --light-selection power && ! grep -q 'light hierarchy' by-power/manifest.json"
refused "begun with another renderer" $record --sequence seq --light-selection power
exit $bad
