#!/bin/sh
# What is read: every file of a scene counts when a render goes on, and what never ends is refused at once.
set -u
here=$(cd "$(dirname "$0")" && pwd)
bin=$(cd "${BUILD:-build}" && pwd)/bin
P=$bin/lull-render ggn=$bin/ggn
dir=$(mktemp -d) || exit 2
trap 'rm -rf "$dir"' EXIT
cd "$dir" || exit 2
unset LULL_PLUGIN_PATH
n=0 bad=0

t() { # t DESCRIPTION COMMAND...: passes when the command succeeds
    n=$((n + 1)); what=$1; shift
    if "$@" >log 2>&1; then echo "ok $n - $what"; else echo "not ok $n - $what"; sed 's/^/# /' log; bad=1; fi
}
refused() { # refused TEXT COMMAND...: exit status 2, one line on stderr that contains TEXT
    n=$((n + 1)); text=$1; shift
    "$@" >out 2>err </dev/null; status=$?
    if [ $status -eq 2 ] && [ "$(wc -l <err)" -eq 1 ] && grep -qF -- "$text" err; then echo "ok $n - refused: $*"
    else echo "not ok $n - refused: $* (status $status)"; sed 's/^/# /' err; bad=1; fi
}

# --- a scene of several files ---
cp "$here/../../scenes/textures/bricks.png" a.png
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n' >mesh.ply
printf 'element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 -1\n1 0 -1\n0 1 -1\n3 0 1 2\n' >>mesh.ply
echo 'Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]' >part.pbrt
cat >whole.pbrt <<'S'
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
LookAt 0 1 3.4  0 1 0  0 1 0
Camera "perspective" "float fov" 45
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Include "part.pbrt"
Shape "plymesh" "string filename" "mesh.ply"
Texture "bricks" "spectrum" "imagemap" "string filename" "a.png"
Material "diffuse" "texture reflectance" "bricks"
Shape "sphere" "float radius" 0.4
S
mkdir plugins && cp "$bin/../lib/lull/null.so" plugins/mine.so
begin="$P whole.pbrt -q -c ./plugins/mine.so --spp-min 2 --spp-max 8 --checkpoint c.ckp --checkpoint-every 0 -o whole.exr"
t "a render with a checkpoint" $begin
t "  …goes on when nothing has changed" $begin --resume
for file in whole.pbrt part.pbrt mesh.ply a.png; do
    cp "$file" kept
    case $file in
    a.png) oiiotool kept --mulc 0.5 -o a.png ;;
    mesh.ply) sed -i 's/^1 0 -1$/2 0 -1/' mesh.ply ;;
    *) echo '# edited' >>"$file" ;;
    esac
    refused "made with scene-crc" $begin --resume
    cp kept "$file"
done
printf 'x' >>plugins/mine.so # behind the end: the same criterion, another file
refused "made with plugin-and-mask-crc" $begin --resume
cp "$bin/../lib/lull/null.so" plugins/mine.so
t "  …and goes on when all is as it was" $begin --resume
model=$here/../../ggn/models/lull-3.ggn
if [ -f "$model" ]; then
    cp "$model" m.ggn
    net="$P whole.pbrt -q -c ggn -p model=m.ggn --spp-min 2 --spp-max 8 --checkpoint m.ckp --checkpoint-every 0 -o whole.exr"
    t "a render judged by a network" $net
    "$ggn" convert -t f16 "$model" half.ggn && mv half.ggn m.ggn
    refused "model" $net --resume
fi
record="$P whole.pbrt -q --block 16 --levels linear:2:4:2 --sequence seq"
t "a sequence is begun" $record --blocks 0
echo '# edited' >>part.pbrt
refused "begun with inputs_crc32=" $record --blocks 1

# --- what never ends, or is no file ---
mkfifo pipe pipe.png pipe.pbrt
ln -s /dev/zero zero.png
for bad_file in pipe /dev/zero .; do
    refused "not a regular file" "$P" $bad_file -q -o a.exr
    refused "not a regular file" "$ggn" inspect $bad_file
    refused "not a regular file" "$ggn" flip $bad_file $bad_file
    refused "not a regular file" "$ggn" compare $bad_file $bad_file
done
refused "not a regular file" "$ggn" flip pipe.png a.png
refused "not a regular file" "$ggn" flip a.png zero.png
refused "no regular file" "$P" "$here/room.pbrt" -q --checkpoint pipe --resume
refused "not a regular file" "$P" "$here/room.pbrt" -q -c ggn -p model=pipe
for name in pipe.png zero.png; do
    sed "s/a.png/$name/" whole.pbrt >textured.pbrt
    refused "not a regular file" "$P" textured.pbrt -q -o a.exr
done
sed 's/part.pbrt/pipe.pbrt/' whole.pbrt >including.pbrt
refused "not a regular file" "$P" including.pbrt -q -o a.exr
refused "not a regular file" "$P" "$here/room.pbrt" -q -c ./pipe -o a.exr
mkdir oidn && mkfifo oidn/libOpenImageDenoise.so.2
for library in ./pipe pipe /dev/zero oidn; do
    refused "not a regular file" env LULL_OIDN=$library timeout 60 "$P" "$here/room.pbrt" -q --size 8x8 --spp 1 --denoise -o a.exr
done
for bad_file in pipe /dev/zero .; do refused "not a regular file" timeout 60 "$bin/lull-plot" $bad_file -o a.png; done
printf 'view,threshold,stop,censored\na,5,6,0\nb,50,70,0\n' >stops.csv
t "lull-plot reads what a program writes" sh -c "cat stops.csv | $bin/lull-plot /dev/stdin -o a.png"
mkdir study && mkfifo study/study.json
refused "not a regular file" timeout 60 "$bin/lull-study" status study
refused "not a regular file" timeout 60 "$bin/lull-report" pipe -o a.html

# --- shared objects: what is wrong with them, and not with something else ---
cp "$bin/../lib/lull/null.so" other.so
printf '\377' | dd of=other.so bs=1 seek=18 conv=notrunc 2>/dev/null # e_machine of the ELF header
refused "./other.so: a shared object for another processor" "$P" "$here/room.pbrt" -q -c ./other.so -o a.exr
refused "other.so: a shared object for another processor" env LULL_OIDN=other.so "$P" "$here/room.pbrt" -q --size 8x8 --spp 1 --denoise -o a.exr
head -c 5000 "$bin/../lib/lull/null.so" >other.so
refused "other.so: a shared object that was cut short" env LULL_OIDN=other.so "$P" "$here/room.pbrt" -q --size 8x8 --spp 1 --denoise -o a.exr
case ${BUILD:-build} in */asan | */tsan) ;; *) # a sanitizer reserves more addresses
    cp "$here/../../scenes/textures/bricks.png" flipped.png
    (ulimit -v 70000 && exec "$ggn" flip flipped.png flipped.png) >out 2>err
    t "no room for the image library: out of memory" sh -c "[ $? = 1 ] && [ \$(wc -l <err) = 1 ] && grep -q 'out of memory' err" ;;
esac
mkdir data && mkfifo data/manifest.json
refused "not a regular file" "$ggn" reconstruct data -o a.png

echo "1..$n"
exit $bad
