#!/bin/sh
# --light-selection: what the default is, where it changes an image, who remembers it.
. "$(dirname "$0")/lull_render_setup"
many=$here/../../scenes/many-lights.pbrt one=$here/../../scenes/cornell-box.pbrt
image() { # image FILE SCENE OPTIONS...
    out=$1 from=$2; shift 2
    "$P" "$from" -q --size 24x24 --spp 4 --reproducible -o "$out.exr" "$@"
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
refused "--light-selection" "$many" --light-selection cleverly

begin="$many -q --size 24x24 -c null --spp-min 2 --spp-max 8 --checkpoint c.ckp --checkpoint-every 0 -o image.exr"
t "a checkpoint" "$P" $begin
t "  …goes on with the same selection" "$P" $begin --resume --light-selection hierarchy
refused "made with light-selection=hierarchy, but this render has light-selection=power" $begin --resume --light-selection power

record="$many -q --size 24x24 --block 24 --sampler independent --levels linear:2:4:2"
t "a recording names the hierarchy in its manifest" sh -c "$P $record --sequence seq && grep -q 'renderer.*light hierarchy' seq/manifest.json"
t "  …but not power" sh -c "$P $record --sequence by-power --light-selection power && ! grep -q 'light hierarchy' by-power/manifest.json"
refused "begun with renderer=" $record --sequence seq --light-selection power
exit $bad
