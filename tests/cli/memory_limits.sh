#!/bin/sh
# Programs with too few addresses (ulimit -v), from where they cannot be loaded to where they have enough: each ends by itself, in one
# line and exit status 1 or 2, or does its work.
# `STEP_MB=2 sh tests/cli/memory_limits.sh` tries more limits.
. "$(dirname "$0")/tap_setup"
BUILD=${BUILD:-build}
case $BUILD in */asan | */tsan) echo "ok 1 # SKIP a sanitizer reserves more addresses than any of these limits"; exit 0 ;; esac
unset OPENBLAS_NUM_THREADS # as a user has it
room=tests/cli/room.pbrt data=tests/data/train-demo model=tests/data/tiny.ggn
STEP_MB=${STEP_MB:-50}

# swept NAME COMMAND...: what it does at each limit. It begins a few MB later for each program, so that all tell of more limits.
begin_mb=50
swept() {
    name=$1 mb=$begin_mb begin_mb=$((50 + (begin_mb - 50 + 7) % STEP_MB))
    shift
    : >"$tmp/bad"
    while [ $mb -le 400 ]; do
        rm -rf "$tmp/out" && mkdir "$tmp/out"
        (ulimit -c 0 && ulimit -v $((mb * 1024)) && exec timeout 120 "$@" >"$tmp/said" 2>"$tmp/err")
        status=$?
        sed -i '/: the model is asked about what it has not learned: /d' "$tmp/err" # a note, whatever comes after
        lines=$(wc -l <"$tmp/err") left=$(find "$tmp/out" -name '.tmp*' | wc -l)
        case $status in
        0) ended=1 ;;
        1 | 2) ended=$lines ;;
        127) ended=$(grep -c 'error while loading shared libraries\|cannot allocate TLS data' "$tmp/err") ;;
        *) ended=0 ;;
        esac
        if [ "$ended" != 1 ] || [ "$left" != 0 ]; then
            echo "$mb MB: exit status $status, $left temporaries, $lines lines:" >>"$tmp/bad"
            head -n 3 "$tmp/err" >>"$tmp/bad"
        fi
        mb=$((mb + STEP_MB))
    done
    t "$name" sh -c 'cat "$1" && [ ! -s "$1" ]' - "$tmp/bad"
}
# The stack: threads have their own, whatever its limit.
small() { # small STATUS COMMAND...: what it does with a stack of 100 KB
    want=$1
    shift
    (ulimit -c 0 && ulimit -s 100 && exec "$@" >"$tmp/said" 2>"$tmp/err")
    [ $? = "$want" ] && if [ "$want" = 0 ]; then [ ! -s "$tmp/err" ]; else [ "$(wc -l <"$tmp/err")" = 1 ]; fi
}
mkdir "$tmp/out"
t "lull-render with a small stack" small 0 "$BUILD/bin/lull-render" $room -q --size 32x32 -t 3 -c ggn --spp-max 32 -o "$tmp/out/a.exr" --html "$tmp/out/a.html"
t "  …lull-report" small 0 "$BUILD/bin/lull-report" "$tmp/out/a.exr" -o "$tmp/out/b.html"
t "  …ggn, which starts a Python" small 0 "$BUILD/bin/ggn" evaluate -d $data -w 4
t "  …ggn, which reads pictures" small 0 "$BUILD/bin/ggn" flip scenes/textures/bricks.png scenes/textures/bricks.png
t "  …lull-check" small 0 "$BUILD/bin/lull-check" -q -o requirements "$BUILD/lib/lull/ggn.so"
t "  …lull-plot says so" small 1 "$BUILD/bin/lull-plot" "$tmp/none.csv" -o "$tmp/out/a.png"
t "  …and may raise it" sh -c "ulimit -S -s 100 && ! '$BUILD/bin/lull-plot' '$tmp/none.csv' -o '$tmp/out/a.png' 2>'$tmp/err'; grep -q 'No such file' '$tmp/err'"
"$BUILD/bin/lull-render" $room -q --size 32x32 --spp 4 -o "$tmp/a.exr" --report "$tmp/a.json"
"$BUILD/bin/lull-render" $room -q --size 32x32 --spp 64 --seed 2 -o "$tmp/b.exr"
for c in observer halfbuf ggn denoised noise-mask; do
    p=
    [ $c != noise-mask ] || { "$BUILD/bin/ggn" baseline $c --data $data --epochs 2 --ratio 1.3 --output "$tmp/$c.ggn" >/dev/null 2>&1; p="-p model=$tmp/$c.ggn"; }
    # shellcheck disable=SC2086
    swept "lull-render -c $c" "$BUILD/bin/lull-render" $room -q --size 32x32 -c $c $p --spp-max 16 -o "$tmp/out/x.exr" --html "$tmp/out/x.html"
done
# More limits where a program takes little time: it lacks memory in another place at each.
usual_mb=$STEP_MB STEP_MB=4
swept "lull-render" "$BUILD/bin/lull-render" $room -q --size 16x16 --spp 1 -o "$tmp/out/x.exr"
STEP_MB=$usual_mb
swept "lull-check" "$BUILD/bin/lull-check" -q -o table -o requirements "$BUILD/lib/lull/ggn.so"
swept "lull-report" "$BUILD/bin/lull-report" "$tmp/a.json" "$tmp/a.exr" -o "$tmp/out/a.html"
cp -r $data "$tmp/data"
swept "ggn label" "$BUILD/bin/ggn" label "$tmp/data"
swept "ggn inspect" "$BUILD/bin/ggn" inspect $model
swept "ggn visible" "$BUILD/bin/ggn" visible "$tmp/a.exr" "$tmp/b.exr"
swept "ggn replay" "$BUILD/bin/ggn" replay --data $data -m $model --no-quality -o "$tmp/out/replay.json"
swept "ggn train" "$BUILD/bin/ggn" train --data $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 2 --steps-denoiser 2 --steps 2 \
    --epoch-steps 2 --out "$tmp/out/model.ggn" -q
swept "ggn baseline" "$BUILD/bin/ggn" baseline svd-entropy --data $data --epochs 1 --ratio 1.3 --output "$tmp/out/svd.ggn"
echo "1..$n"
