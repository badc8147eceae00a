#!/bin/sh
# Commands of ggn that lack memory once, at each of their calls for it: none crashes or hangs; they say so in one line, exit status 2
# or 1, or do as well without.
. "$(dirname "$0")/ggn_setup"
case $BUILD in */asan | */tsan) echo "ok 1 # SKIP a sanitizer brings its own malloc"; exit 0 ;; esac
${CC:-cc} -shared -fPIC -O1 -o "$tmp/oom.so" tests/cli/out_of_memory.c -ldl || exit 2

# lacking NAME COMMAND…: at least ten times, and the command itself ends well.
lacking() {
    name=$1
    shift
    rm -rf "$tmp/k" && mkdir "$tmp/k"
    env "LD_PRELOAD=$tmp/oom.so" "OOM_FOLDER=$tmp/k" OPENBLAS_NUM_THREADS=1 "$@" >"$tmp/whole" 2>"$tmp/err"
    rc=$?
    : >"$tmp/out"
    while read -r k status; do
        lines=$(wc -l <"$tmp/k/$k.err")
        case $status in
        0) tail -c "$(wc -c <"$tmp/k/$k.out")" "$tmp/whole" | cmp -s - "$tmp/k/$k.out" || echo "allocation $k failed: exit 0, but another output" >>"$tmp/out" ;;
        1 | 2) [ "$lines" -eq 1 ] || { echo "allocation $k failed: $lines lines"; head -n 3 "$tmp/k/$k.err"; } >>"$tmp/out" ;;
        *) { echo "allocation $k failed: status $status"; tail -n 1 "$tmp/k/$k.err"; } >>"$tmp/out" ;;
        esac
    done <"$tmp/k/log"
    [ $rc -eq 0 ] && [ "$(wc -l <"$tmp/k/log")" -ge 10 ] && [ ! -s "$tmp/out" ]
    check "$name, $(wc -l <"$tmp/k/log") times without memory" $?
}
printf 'a;100;200;400;800;1600;\nb;50;60;70;80;\n' >"$tmp/t.csv"
printf 'a;100;400;380;100;1500;\nb;51;20;300;81;\n' >"$tmp/m.csv"
lacking "thresholds" "$ggn" thresholds "$tmp/t.csv" "$tmp/m.csv"
lacking "inspect" "$ggn" inspect tests/data/tiny.ggn
lacking "convert" "$ggn" convert tests/data/tiny.ggn "$tmp/b.ggn" --type bf16

# A program whose memory ends, and does not come back: while libraries are loaded, whose constructors throw, while Embree builds, while a
# picture is read. One line and exit status 1 or 2, or its work.
ending() { # ending NAME COMMAND…: at some forty places
    name=$1
    shift
    env "LD_PRELOAD=$tmp/oom.so" OOM_FROM=1000000000 "OOM_COUNT=$tmp/count" "$@" >"$tmp/whole" 2>"$tmp/err" || return
    all=$(cat "$tmp/count")
    : >"$tmp/out"
    for i in $(seq 1 40); do
        from=$((all * i / 40 + 1 - 7 * (i % 3)))
        (ulimit -c 0 && exec timeout 120 env "LD_PRELOAD=$tmp/oom.so" OOM_FROM=$from "$@" >"$tmp/said" 2>"$tmp/err")
        status=$?
        case $status in
        0) ;;
        1 | 2) [ "$(wc -l <"$tmp/err")" -eq 1 ] || { echo "from $from: $(wc -l <"$tmp/err") lines"; head -n 3 "$tmp/err"; } >>"$tmp/out" ;;
        *) { echo "from $from: status $status"; head -n 2 "$tmp/err"; } >>"$tmp/out" ;;
        esac
    done
    [ "$all" -ge 100 ] && [ ! -s "$tmp/out" ]
    check "$name: memory ends" $?
}
printf 'Film "rgb" "integer xresolution" 8 "integer yresolution" 8\nCamera "perspective"\nWorldBegin\nLightSource "infinite"
Texture "t" "spectrum" "imagemap" "string filename" "%s"\nMaterial "diffuse" "texture reflectance" "t"\nShape "sphere"\n' \
    "$PWD/scenes/textures/bricks.png" >"$tmp/textured.pbrt"
ending "lull-render" "$bin/lull-render" tests/cli/room.pbrt -q --size 8x8 --spp 1 -t 2 -o "$tmp/a.exr"
ending "lull-render, a picture" "$bin/lull-render" "$tmp/textured.pbrt" -q --spp 1 -t 2 -o "$tmp/a.exr"
ending "ggn flip" "$ggn" flip scenes/textures/bricks.png scenes/textures/bricks.png
echo "1..$n"
exit $bad
