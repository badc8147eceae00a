#!/bin/sh
# lull-render --look-at and --fov: the same picture as a file with that camera, refusals, and what a resumed run must notice.
. "$(dirname "$0")/lull_render_setup"
same() { oiiotool --fail 0 --warn 0 "$1" "$2" --diff; }
differ() { ! same "$1" "$2"; }
shot() { out=$1; shift; "$P" -q --spp 8 -o "$out" "$@"; }

# --- the same picture as LookAt and "float fov" in the file ---
camera="0.5 1.5 2.5  0.1 0.4 -0.2  0 1 0.1"
sed -e "s/^LookAt.*/LookAt $camera/" -e 's/"float fov" 45/"float fov" 63/' "$scene" >moved.pbrt
shot file.exr moved.pbrt
shot option.exr "$scene" --look-at "$camera" --fov 63
shot plain.exr "$scene"
t "--look-at and --fov are the file's LookAt and fov" same file.exr option.exr
t "  …and not the picture without them" differ plain.exr option.exr
shot own.exr "$scene" --look-at "0 1 3.4  0 1 0  0 1 0"
t "the scene's own camera by --look-at is the same picture" same plain.exr own.exr
sed 's/^LookAt/Scale -1 1 1 LookAt/' moved.pbrt >mirrored.pbrt
sed 's/^LookAt/Scale -1 1 1 LookAt/' "$scene" >mirror.pbrt
shot mirrored.exr mirrored.pbrt
shot mirror.exr mirror.pbrt --look-at "$camera" --fov 63
t "a mirrored camera stays mirrored" same mirrored.exr mirror.exr
sed 's/^LookAt/ActiveTransform EndTime Translate 0.3 0 0 ActiveTransform All LookAt/' "$scene" >moving.pbrt
shot still.exr moving.pbrt --look-at "$camera" --fov 63
t "a moving camera stands still" same option.exr still.exr

# --- bad input ---
for bad_value in "" "1 2 3" "0 0 5  0 0 0  0 1" "0 0 5  0 0 0  0 1 0  7" "0 0 5  0 0 0  0 1 up" "0,0,5 0,0,0 0,1,0"; do
    refused "expected nine numbers" "$scene" --look-at "$bad_value"
done
refused "expected nine numbers" "$scene" --look-at "0 0 nan  0 0 0  0 1 0"
refused "expected nine numbers" "$scene" --look-at "0 0 1e300  0 0 0  0 1 0"
refused "expected eye and point looked at apart" "$scene" --look-at "0 0 5  0 0 5  0 1 0"
refused "expected eye and point looked at apart" "$scene" --look-at "0 0 5  0 0 0  0 0 2"
refused "expected eye and point looked at apart" "$scene" --look-at "0 0 5  0 0 0  0 0 0"
for fov in 0 -40 180 nan inf wide ""; do refused "--fov $fov" "$scene" --fov "$fov"; done
sed 's/Camera "perspective".*/Camera "orthographic"/' "$scene" >flat.pbrt
refused "flat.pbrt:3" flat.pbrt -q --spp 1 -o flat.exr --fov 40

# --- going on: another camera is another picture ---
long="$scene -q -c null --spp-min 4 --spp-max 200 --checkpoint c.ckp -o part.exr"
"$P" $long --look-at "$camera" --time-budget 0.01
t "a checkpoint of another view" test -s c.ckp
refused "look-at=" $long --resume
refused "look-at=" $long --resume --look-at "0 1 3  0 1 0  0 1 0"
refused "fov=" $long --resume --look-at "$camera" --fov 44
t "  …goes on with its own" "$P" $long --resume --look-at "$camera"
seq="$scene -q --block 16 --levels linear:4:8:4 --blocks 1"
t "a sequence of another view" "$P" $seq --sequence seq --look-at "$camera" --fov 50
rm seq/*.lseq
refused "begun with look_at=" $seq --sequence seq --fov 50
refused "begun with look_at=" $seq --sequence seq --fov 50 --look-at "0 1 3  0 1 0  0 1 0"
refused "begun with fov=" $seq --sequence seq --look-at "$camera"
refused "begun with fov=" $seq --sequence seq --look-at "$camera" --fov 51
t "  …goes on with its own" "$P" $seq --sequence seq --look-at "$camera" --fov 50
t "a sequence of the scene's own camera" "$P" $seq --sequence own
rm own/*.lseq
refused "begun with look_at=" $seq --sequence own --look-at "$camera"

echo "1..$n"
exit $bad
