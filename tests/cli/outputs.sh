#!/bin/sh
# What is written: known before the work whether it can be, never onto an input or a device, and nothing stays behind.
set -u
here=$(cd "$(dirname "$0")" && pwd)
bin=$(cd "${BUILD:-build}" && pwd)/bin
P=$bin/lull-render ggn=$bin/ggn
data=$here/../data/train-demo
dir=$(mktemp -d) || exit 2
trap 'rm -rf "$dir"' EXIT
cp "$here/room.pbrt" "$dir" && cp "$here/../../scenes/textures/bricks.png" "$dir/a.png" && cd "$dir" || exit 2
unset LULL_PLUGIN_PATH
n=0 bad=0

t() { # t DESCRIPTION COMMAND...: passes when the command succeeds
    n=$((n + 1)); what=$1; shift
    if "$@" >log 2>&1; then echo "ok $n - $what"; else echo "not ok $n - $what"; sed 's/^/# /' log; bad=1; fi
}
sums() { find . -type f ! -name log ! -name out ! -name err -exec cksum {} + | sort; }
refused() { # refused TEXT COMMAND...: exit status 2, one line on stderr that contains TEXT, no file made or changed
    n=$((n + 1)); text=$1; shift
    before=$(sums)
    "$@" >out 2>err </dev/null; status=$?
    if [ $status -eq 2 ] && [ "$(wc -l <err)" -eq 1 ] && grep -qF -- "$text" err && [ "$before" = "$(sums)" ]; then
        echo "ok $n - refused: $*"
    else echo "not ok $n - refused: $* (status $status)"; sed 's/^/# /' err; bad=1; fi
}
# Work that does not end while tests are waited for: a refusal comes before it.
long="$P room.pbrt -q -c null --spp-min 100000000 --spp-max 100000000"
train="$ggn train -d $data --crop 32 --batch 64 --steps-denoiser 100000 -q --out"

# --- descriptors 0, 1 and 2 may be closed: files then get these numbers ---
for closed in "<&-" "<&- >&-" "<&- >&- 2>&-"; do
    rm -f b.exr b.csv
    t "written with $closed" sh -c "$P room.pbrt -q --size 8x8 -c null --spp-min 1 --spp-max 2 -o b.exr --stop-map b.csv $closed"
    t "  …whole, and nothing besides" sh -c 'oiiotool --info b.exr | grep -q " 8 x  *8, " && grep -q "^room;2;$" b.csv && ls -A && ! ls -A | grep tmp'
done
rm -f b.exr b.csv
for closed in "2>&-" "<&- >&- 2>&-"; do
    for command in "$ggn compare none none" "$ggn inspect none" "$P none" "$bin/lull-report none -o b.html" "$bin/lull-check --nonsense"; do
        t "refused with $closed" sh -c "$command $closed; [ \$? = 2 ]"
    done
done

# --- the soft limit of processor time: the picture so far, as after Ctrl-C ---
t "a render that has used up its processor time" sh -c "ulimit -S -t 1; $long -t 2 --size 32x32 -o b.exr --checkpoint b.ckp; [ \$? -eq 130 ]"
t "  …leaves picture and checkpoint" sh -c 'oiiotool --info b.exr | grep -q " 32 x  *32, " && test -s b.ckp'
rm -f b.exr b.ckp

# --- what cannot be written is known before the work ---
name=$(printf 'n%.0s' $(seq 1 260))
mkdir folder folder.exr folder.png folder.json folder.csv folder.ggn
for kind in "-o exr" "--preview png" "--report json" "--stop-map csv" "--stop-map png" "--checkpoint ggn"; do
    option=${kind% *} ending=${kind#* }
    for path in folder nowhere/a room.pbrt/a; do
        refused "cannot write there" $long $option "$path.$ending"
    done
    refused "the path is too long" $long $option "$name.$ending"
done
refused "not the name of a file" $long --checkpoint folder/
refused "cannot write there" $train folder.ggn
refused "cannot write there" $train nowhere/a.ggn
refused "the path is too long" $train "$name.ggn"
refused "the path is too long" $train "$(printf 'n%.0s' $(seq 1 250))" # what lies beside it has longer names
refused "cannot write there" "$ggn" flip a.png a.png -o folder.png
refused "cannot write there" "$ggn" reconstruct "$data/scene0" -o nowhere/a.png
refused "cannot write there" "$ggn" reconstruct "$data/scene0" -o b.png -r nowhere/a.png

# --- never onto an input ---
ln -s room.pbrt room.ckp
ln room.pbrt other.ckp
refused "this is an input" $long --checkpoint room.pbrt
refused "this is an input" $long --checkpoint room.ckp
refused "this is an input" $long --checkpoint other.ckp
sed 's/^WorldBegin/&\nTexture "t" "spectrum" "imagemap" "string filename" "a.png"\nMaterial "diffuse" "texture reflectance" "t"/' \
    room.pbrt >textured.pbrt
refused "this is an input" "$P" textured.pbrt -q --spp 1 --preview a.png
refused "this is an input" "$ggn" flip a.png a.png -o a.png
cp "$here/../../ggn/models/lull-3.ggn" m.ggn
refused "this is an input" "$ggn" convert m.ggn m.ggn
refused "this is an input" "$ggn" convert m.ggn ./folder/../m.ggn
cp -r "$data" data
refused "inside its data" "$ggn" train -d data --crop 32 --out data/a.ggn
refused "inside its data" "$ggn" train -d data --crop 32 --out data/scene0/../a.ggn

# --- no two outputs are one file: by the same name, another way to the folder, a link, a hard link, there already or not ---
mkdir real && ln -s real way && echo old >real/old.png && ln real/old.png real/twin.png && ln -s ../far.png real/later.png
for pair in "x.png x.png" "x.png ./x.png" "x.png $dir/x.png" "real/new.png way/new.png" "way/../x.png x.png" "real/old.png way/twin.png" \
    "real/later.png far.png"; do
    refused "one of the two would be lost" $long --preview ${pair% *} --stop-map ${pair#* }
    refused "one of the two would be lost" $long --stop-map ${pair% *} --stop-map ${pair#* }
    refused "one of the two would be lost" "$ggn" reconstruct "$data/scene0" -o ${pair% *} -r ${pair#* }
done
refused "--checkpoint both.exr: the same file as --output both.exr" $long --checkpoint both.exr -o both.exr
refused "--output room.exr: the same file as --checkpoint room.exr" $long --checkpoint room.exr # the name that nobody gave
t "names that differ are written" "$P" room.pbrt -q --spp 1 --preview real/new.png --stop-map way/other.png
rm -r real way

# --- what is kept for oneself replaces nothing but its like ---
echo text >thesis.txt && cp "$here/../../scenes/textures/bricks.png" kept.png && : >empty.ckp
for name in thesis.txt kept.png m.ggn; do
    refused "$name: not a checkpoint, it would be replaced" $long --checkpoint $name
done
for name in thesis.txt kept.png; do
    refused "$name: not a model file, it would be replaced" $train $name
    refused "$name: not a model file, it would be replaced" "$ggn" convert m.ggn $name
    refused "$name: not a model file, it would be replaced" "$ggn" baseline attributes -d "$data" -o $name
done
echo mine >new.ggn.ckpt
refused "new.ggn.ckpt: not a model file, it would be replaced" $train new.ggn
refused "m.ggn: this is an input" "$ggn" train -d "$data" --init m.ggn --out m.ggn
refused "m.ggn: this is an input" "$ggn" replay -d "$data" -m m.ggn -o m.ggn
cp m.ggn begin.ggn.csv
refused "begin.ggn.csv: this is an input" "$ggn" train -d "$data" --init begin.ggn.csv --out begin.ggn
t "a checkpoint replaces a checkpoint, and an empty file" sh -c "for i in 1 2; do $P room.pbrt -q --spp 1 -o k.exr --checkpoint empty.ckp --checkpoint-every 0 || exit 1; done"
refused "m.ggn: not a checkpoint" "$P" room.pbrt -q -c ggn -p model=m.ggn --checkpoint m.ggn
cp m.ggn m.png
refused "m.png: this is an input (m.png)" "$P" room.pbrt -q -c ggn -p model=m.png --preview ./m.png
oiiotool --pattern constant:color=1,1,1 4x4 3 -d half -o room.exr
refused "room.exr: another program's image would be replaced; -o FILE.exr names the output" "$P" room.pbrt -q --spp 1
t "  …where it was not named" "$P" room.pbrt -q --spp 1 -o room.exr
t "  …and ours is" "$P" room.pbrt -q --spp 1
refused "leave out -o, --preview, --report, --html and --stop-map" "$P" room.pbrt -q --sequence s --preview p.png
echo 'a;20;40;' >blocks.csv
refused "./blocks.csv: this is an input" "$ggn" compare blocks.csv blocks.csv -o .
echo '{}' >figures.json
refused "./figures.json: this is an input" "$ggn" evaluate -d "$data" -O figures.json -o .

# --- devices stay, links are followed ---
mkfifo pipe.ggn
ln -s /dev/null null.exr
refused "no regular file" "$ggn" convert m.ggn /dev/null
refused "no regular file" "$ggn" convert m.ggn pipe.ggn
refused "no regular file" $long -o null.exr
refused "no regular file" $long --checkpoint /dev/full
t "/dev/null is what it was" test -c /dev/null -a -c /dev/full -a -p pipe.ggn -a -L null.exr
mkdir far && echo old >far/there.csv && ln -s far/there.csv link.csv && ln -s far/none.png dangling.png && ln -s far/e.exr e.exr
t "outputs through links" "$P" room.pbrt -q --spp 1 --stop-map link.csv --preview dangling.png -o e.exr
t "  …are followed" sh -c "test -L link.csv -a -L dangling.png -a -L e.exr && grep -q '^room;1;' far/there.csv && oiiotool --info far/none.png far/e.exr"

# --- a folder that goes away while the image is made ---
wait_for() { until [ -s "$1" ] || ! kill -0 "$2"; do sleep 0.1; done; } # its progress: from here on it listens
mkdir away
TMPDIR=$dir "$P" room.pbrt -c null --spp-min 100000000 --spp-max 100000000 --checkpoint away/c.ckp --checkpoint-every 0.1 \
    -o away/a.exr --report r.json 2>away.err &
pid=$!
wait_for away.err $pid
until rm -r away 2>err; do :; done # a checkpoint may be written just then
until grep -q 'the render goes on' away.err || ! kill -0 $pid; do sleep 0.1; done
t "a checkpoint that fails on the way is a warning" kill -TERM $pid
wait $pid
status=$?
t "  …SIGTERM ends the render, the lost output is an error" test $status -eq 2
t "  …that says where the image is" sh -c "grep -q 'away/.*; kept as $dir/lull-$pid-a.exr' away.err && oiiotool --info lull-$pid-a.exr"
t "  …and the report is there" grep -q '"interrupted":[[:space:]]*true' r.json
"$P" room.pbrt -c null --spp-min 100000000 --spp-max 100000000 -o term.exr 2>term.err &
pid=$!
wait_for term.err $pid
kill -TERM $pid
wait $pid
t "SIGTERM is SIGINT: exit status 130" test $? -eq 130 -a -s term.exr
"$P" room.pbrt -c null --spp-min 100000000 --spp-max 100000000 -o hup.exr --checkpoint hup.ckp 2>hup.err &
pid=$!
wait_for hup.err $pid
kill -HUP $pid
wait $pid
t "and so is SIGHUP" test $? -eq 130 -a -s hup.exr -a -s hup.ckp
(trap '' HUP; exec "$P" room.pbrt -c null --spp-min 100000000 --spp-max 100000000 -o nohup.exr 2>nohup.err) &
pid=$!
wait_for nohup.err $pid
kill -HUP $pid
lines=$(wc -l <nohup.err)
until [ "$(wc -l <nohup.err)" -gt "$lines" ] || ! kill -0 $pid; do sleep 0.1; done
t "  …but not under nohup" kill -0 $pid
kill -TERM $pid; wait $pid
mkfifo lines
"$P" room.pbrt -c null --spp-min 100000000 --spp-max 100000000 -o pipe.exr --checkpoint pipe.ckp --checkpoint-every 0.1 2>lines &
pid=$!
head -n 1 lines >log # and nobody reads on
until [ -s pipe.ckp ] || ! kill -0 $pid; do sleep 0.1; done
rm -f pipe.ckp
until [ -s pipe.ckp ] || ! kill -0 $pid; do sleep 0.1; done
t "nobody reads its lines any more: it goes on" kill -TERM $pid
wait $pid
t "  …and ends as ever" test $? -eq 130 -a -s pipe.exr

# --- one folder, one process ---
record="$P room.pbrt --block 16 --levels linear:1000:1000000:1000 --sequence seq"
$record -q --blocks 0-5 &
pid=$!
until [ -e seq/manifest.json ] || ! kill -0 $pid; do sleep 0.1; done
refused "seq: process $pid is writing there" $record -q --blocks 6-11
kill -KILL $pid
wait $pid 2>/dev/null
t "after a kill the folder is free" "$P" room.pbrt -q --block 16 --levels linear:20:40:20 --sequence free --blocks 0
: >free/.lock
t "  …a lock left behind is none" "$P" room.pbrt -q --block 16 --levels linear:20:40:20 --sequence free --blocks 0-1
t "  …and goes" test "$(ls -A free | tr '\n' ' ')" = "block-00000.lseq block-00001.lseq manifest.json "

# --- without a reference there is nothing to compare with ---
echo 'room;20;40;' >stops.csv
"$ggn" reconstruct free -s stops.csv -o built.png >built.txt 2>&1
t "reconstruct without a reference prints no FLIP" sh -c "grep -q 'no reference' built.txt && ! grep -q FLIP built.txt"
refused "without a reference" "$ggn" reconstruct free -s stops.csv -o built2.png -r reference.png

# --- what a killed run leaves, the next one removes ---
mkdir kill && cd kill || exit 2
(exec sleep infinity) & stranger=$!
: >.tmp-lull$stranger-0.room.exr      # its process lives
: >.tmp-lull4194303-0.room.exr        # nobody's: above every process id
: >.tmp-lull4194303-1.room.png.gp
: >.tmp-lull4194303-2.locked
: >.tmp4194303.foreign
flock .tmp-lull4194303-2.locked sleep infinity & locker=$!
until ! flock -n .tmp-lull4194303-2.locked true; do sleep 0.1; done
t "a run beside leftovers" "$P" ../room.pbrt -q --spp 1 -o a.exr
t "  …removes them" test "$(ls -A | wc -l)" -eq 5 # with the log
t "  …but not what is in use, or not its own" test -e .tmp-lull4194303-2.locked -a -e .tmp-lull$stranger-0.room.exr -a -e .tmp4194303.foreign
kill $stranger $locker
cd ..

# --- a full standard output ---
if [ -c /dev/full ]; then
    full() { n=$((n + 1)); "$@" >/dev/full 2>err; status=$?
        if [ $status -eq 2 ] && [ "$(wc -l <err)" -eq 1 ]; then echo "ok $n - full: $*"
        else echo "not ok $n - full: $* (status $status)"; sed 's/^/# /' err; bad=1; fi; }
    full "$ggn" flip a.png a.png
    full "$ggn" inspect m.ggn
    full "$ggn" --help
    full "$ggn" flip --help

    full "$P" --help
    full "$P" --version
    full "$P" --list-criteria
    full "$P" room.pbrt -q --debug-path 3,3,0
    full "$bin/lull-check" --list
    full "$bin/lull-check" --version
fi

# --- whoever reads standard output may stop reading, as head does: no word, the status of SIGPIPE, caught, ignored or not ---
mkfifo unread && exec 4<>unread && exec 5>unread && exec 4<&-
unread() { n=$((n + 1)); "$@" >&5 2>err; status=$?; (trap '' PIPE; exec "$@" >&5 2>err2); ignored=$?
    if [ $status -eq 141 ] && [ $ignored -eq 141 ] && [ ! -s err ] && [ ! -s err2 ]; then echo "ok $n - unread: $*"
    else echo "not ok $n - unread: $* (status $status, ignored $ignored)"; sed 's/^/# /' err err2; bad=1; fi; }
unread "$ggn" --help
unread "$ggn" flip a.png a.png
unread "$ggn" inspect m.ggn
unread "$ggn" label data
unread "$ggn" compare stops.csv stops.csv
unread "$P" --version
unread "$P" --list-criteria
unread "$P" room.pbrt -q --debug-path 3,3,0
unread "$P" room.pbrt -q --size 32x32 -c halfbuf --spp-max 32 --quote
unread "$bin/lull-check" --list
unread "$bin/lull-check" -q -o table halfbuf
for program in lull-plot lull-report lull-study; do unread "$bin/$program" --help; done
exec 5>&-

# --- a preview while rendering ---
"$P" room.pbrt -q -c null --spp-max 100000000 --preview early.png & early=$!
until [ -s early.png ] || ! kill -0 $early; do sleep 0.2; done
t "a preview is there while the render goes on" sh -c "kill -0 $early && oiiotool --info early.png"
kill -INT $early; wait $early
t "  …and one of the end" oiiotool --info early.png

# --- pictures: the image library is loaded by who reads one ---
mkdir -p alone/bin && cp "$P" alone/bin
t "a scene without pictures is rendered without the image library" alone/bin/lull-render room.pbrt -q --spp 1 --preview plain.png
t "  …and its preview is a PNG of its size" sh -c "head -c 8 plain.png | od -An -tx1 | tr -d ' ' | grep -q '^89504e470d0a1a0a' && oiiotool --info plain.png | grep -q '64 x *48, 3 channel'"
refused "a.png: images cannot be read: lib/lull/modules/lull-images.so" alone/bin/lull-render textured.pbrt -q --spp 1 --preview b.png
cp "$ggn" alone/bin
refused "a.png: images cannot be read: lib/lull/modules/lull-images.so" alone/bin/ggn flip a.png a.png
refused "b.exr: images cannot be read: lib/lull/modules/lull-images.so" alone/bin/ggn thresholds stops.csv b.exr
t "ggn without the image library reads tables" alone/bin/ggn thresholds stops.csv stops.csv
mkdir -p alone/lib/lull/modules && cp "$bin/../lib/lull/modules/lull-images.so" alone/lib/lull/modules
sed 's/^Material "diffuse" "rgb reflectance" \[0.7.*/Texture "t" "spectrum" "imagemap" "string filename" "a.png"\nMaterial "diffuse" "texture reflectance" "t"/' \
    room.pbrt >seen.pbrt
t "  …which is found beside the program" alone/bin/lull-render seen.pbrt -q --spp 1 -o with.exr
t "  …for ggn too" alone/bin/ggn flip a.png a.png
t "  …and what it reads is seen" sh -c "$P seen.pbrt -q --spp 1 -o here.exr && $P room.pbrt -q --spp 1 -o without.exr &&
    oiiotool --fail 0 --warn 0 with.exr here.exr --diff && ! oiiotool --fail 0 with.exr without.exr --diff"

echo "1..$n"
exit $bad
