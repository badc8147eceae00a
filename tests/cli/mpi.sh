#!/bin/sh
# Rendering by several processes: the bytes of one, whatever their number; what goes wrong with one of them.
. "$(dirname "$0")/lull_render_setup"
. "$here/mpi_setup"
same() { cmp "$1" "$2"; }
# The report without times, and without what says how many sampled and what was typed.
timeless() { sed -E '/_s"|per_s"|"threads"|"processes"|"message|"command"/d; s/"thread_s":[^,}]*//g' "$1"; }
same_reports() { timeless "$1" >a.txt; timeless "$2" >b.txt; cmp a.txt b.txt; }

# --- same bytes ---
# same_images NAME ARGUMENTS...: 1 process against 2, 3 and 5, and 3 of two threads each; image, stop map and report
same_images() {
    name=$1; shift
    "$P" "$@" -q -t 2 --reproducible -o one.exr --stop-map one.csv --report one.json || { t "$name: one process" false; return; }
    for processes in 2 3 5; do
        threads=$((processes == 3 ? 2 : 1))
        t "$name: $processes processes of $threads threads" mpi $processes "$P" "$@" -q -t $threads --reproducible -o many.exr \
            --stop-map many.csv --report many.json
        t "  …the same image" same one.exr many.exr
        t "  …the same stop map" same one.csv many.csv
        t "  …the same report but for times" same_reports one.json many.json
        t "  …which says how many there were" grep -q "\"processes\":[[:space:]]*$processes" many.json
        rm -f many.*
    done
}
same_images "halfbuf" "$scene" --size 60x44 --block 16 -c halfbuf --spp-min 8 --spp-max 128
same_images "a uniform image, every plane" "$scene" --size 30x20 --spp 9 --aov albedo,normal,depth
same_images "a crop" "$scene" --size 64x48 --block 16 --crop 20,10,40,30 -c variance --spp-min 8 --spp-max 64
same_images "one block" "$scene" --size 24x24 --block 24 -c halfbuf --spp-min 8 --spp-max 64
same_images "one pixel" "$scene" --size 1x1 --spp 40
same_images "seams re-opened" "$scene" --size 48x32 --block 8 -c halfbuf --spp-min 8 --spp-max 128 --max-seam 1.5
[ ! -f "${here}/../../${BUILD:-build}/lib/lull/observer.so" ] ||
    same_images "the default criterion" "$scene" --size 48x32 --block 24 --spp-min 8 --spp-max 48
t "a quote by three processes" sh -c "mpirun --oversubscribe -n 3 $P $scene -q --size 64x48 --block 32 --quote --quote-pilot 16:5 | grep -q 'against uniform'"
t "a recording" "$P" "$scene" -q --size 64x48 --block 32 --sequence one --levels geometric:4:16:2 --reference-spp 8 --blocks 0,3
t "a recording by three processes" mpi 3 "$P" "$scene" -q --size 64x48 --block 32 --sequence many --levels geometric:4:16:2 \
    --reference-spp 8 --blocks 0,3
# Recordings hold the seconds that each level took: a few bytes of each.
same_but_seconds() { [ "$(wc -c <"$1")" = "$(wc -c <"$2")" ] && [ "$(cmp -l "$1" "$2" | wc -l)" -le 80 ]; }
for f in one/*.lseq; do t "  …the same ${f#one/} but for times" same_but_seconds "$f" "many/${f#one/}"; done

printf 'train room %s 1 linear:1:2:1 0 0\n' "$scene" >tiny.plan
t "a data set, each view by all processes" env BUILD="${P%/bin/*}" "$here/../../scripts/lab" data-set --plan tiny.plan \
    --launcher "mpirun --oversubscribe -n 2" set
t "  …the view is there" test -s set/train/room/block-00000.lseq

# --- what is said once is said by rank 0 ---
mpi_refused "--seed" 3 "$P" "$scene" --seed x
mpi_refused "nowhere.pbrt" 3 "$P" nowhere.pbrt -q
mpi_refused "cannot write there" 2 "$P" "$scene" -q -o nowhere/a.exr
t "--explain is printed once" sh -c "mpirun --oversubscribe -n 3 $P --explain $scene | grep -c '^kernel:' | grep -qx 1"

# --- hosts that do not read the same files: folders of their own stand for them ---
for h in 0 1; do mkdir host$h; cp "$scene" host$h/room.pbrt; cp "${P%/bin/*}/lib/lull/halfbuf.so" host$h/mine.so; done
# each COMMAND LINE: rank N runs it in hostN
each() { mpi_refused "$1" 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec $P $2"; }
t "equal hosts" mpi 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec $P room.pbrt -q -c ./mine.so --spp-max 20 -o a.exr"
echo "# other" >>host1/room.pbrt
each "rank 1 on host $(hostname)" "room.pbrt -q --spp 4 -o a.exr"
each "has scene-crc=" "room.pbrt -q --spp 4 -o a.exr"
rm host1/room.pbrt
each "room.pbrt: No such file" "room.pbrt -q --spp 4 -o a.exr"
cp "$scene" host1/room.pbrt
printf x >>host1/mine.so
each "has plugin-and-mask-crc=" "room.pbrt -q -c ./mine.so --spp-max 20 -o a.exr"
each "has spp-max=" "room.pbrt -q -c null --spp-max 2\$OMPI_COMM_WORLD_RANK -o a.exr"
for h in 0 1; do mkdir -p host$h/bin && cp "$P" host$h/bin/ && ln -s "${P%/bin/*}/lib" host$h/lib; done
own() { mpi_refused "$1" 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec bin/lull-render room.pbrt -q --spp 4 -o a.exr"; }
t "copies of one program" mpi 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec bin/lull-render room.pbrt -q --spp 4 -o a.exr"
printf x >>host1/bin/lull-render # behind the end: the same version, another build
own "has program-crc="
m=$here/../../ggn/models/lull-3.ggn # and the same in half the bytes, which is another
if [ -f "$m" ] && [ -f "${P%/bin/*}/lib/lull/ggn.so" ]; then
    "${P%/*}/ggn" convert "$m" host0/m.ggn; cp "$m" host1/m.ggn
    each "has criterion-model-crc=" "room.pbrt -q -c ggn -p model=m.ggn --spp-max 20 -o a.exr"
fi

# --- faults, on the way through a render of some seconds ---
long="$scene -q --size 48x32 --block 16 -c fixed -p spp=2500 --spp-min 4 --spp-max 4000 --reproducible -t 1"
# begin N ARGUMENTS...: in the background, until there is a checkpoint
begin() {
    processes=$1; shift
    rm -f c.ckp part.exr
    start c.ckp "$processes" "$P" $long --checkpoint c.ckp --checkpoint-every 0.1 -o part.exr "$@"
}
t "the render, by one process" "$P" $long -o long.exr

kill_one
t "  …the checkpoint goes on, with two processes" mpi 2 "$P" $long --checkpoint c.ckp --resume -o part.exr
t "  …to the same image" same long.exr part.exr

if command -v mpicc >/dev/null; then
    mpicc -shared -fPIC -o half.so "$here/mpi_half_message.c" || bad=1
    mpi_refused "has not answered for 1 s (--rank-timeout)" 2 env "LD_PRELOAD=$PWD/half.so" "$P" "$scene" -q --size 64x48 --spp 64 \
        --rank-timeout 1 -o half.exr
fi
hang_one 3
t "  …the checkpoint goes on, with one process" "$P" $long --checkpoint c.ckp --resume -o part.exr
t "  …to the same image" same long.exr part.exr

begin 2
kill -INT "$(pid_of 0)"
n=$((n + 1)); wait $job; status=$?
if [ $status -eq 130 ]; then echo "ok $n - interrupted at rank 0"; else echo "not ok $n - interrupted at rank 0 ($status)"; bad=1; fi
t "  …the image so far is there" test -s part.exr
t "  …the checkpoint of two processes goes on with five" mpi 5 "$P" $long --checkpoint c.ckp --resume -o part.exr
t "  …to the same image" same long.exr part.exr

"$P" $long --time-budget 0.3 --checkpoint c.ckp -o part.exr
t "a checkpoint of one process goes on with three" mpi 3 "$P" $long --checkpoint c.ckp --resume -o part.exr
t "  …to the same image" same long.exr part.exr
"$P" $long --spp-max 70 --checkpoint c.ckp -o part.exr
t "a finished render goes on with three to more samples" mpi 3 "$P" $long --checkpoint c.ckp --resume -o part.exr
t "  …to the same image" same long.exr part.exr
t "a time budget ends all of them" mpi 3 "$P" $long --time-budget 0.2 -o part.exr --report part.json
t "  …and the report says so" grep -q '"reason":[[:space:]]*"time"' part.json

# --- without ---
t "without mpirun there is one process" "$P" "$scene" -q --spp 2 --report alone.json -o a.exr
t "  …and it needs no MPI library" sh -c "! ldd $P | grep -qi libmpi"
t "--version says which MPI there is" sh -c "$P --version | grep -q '^MPI: .*[0-9]'"
mkdir -p bare/bin bare/lib && cp "$P" bare/bin/ && cp -r "${P%/bin/*}/lib/lull" bare/lib/ && rm bare/lib/lull/modules/lull-mpi.so
t "--version of a program built without" sh -c "bare/bin/lull-render --version | grep -q '^MPI: none'"
t "which runs alone" bare/bin/lull-render "$scene" -q --spp 2 -o a.exr
mpi_refused "build it with MPI" 1 env OMPI_COMM_WORLD_SIZE=2 bare/bin/lull-render "$scene" -q --spp 2 -o a.exr
exit $bad
