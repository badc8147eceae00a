#!/bin/sh
# How files come into place: synced, then renamed over the old one, which is never removed before; with the mode that the umask says.
# A preloaded library writes the calls down and can make one of them fail.
. "$(dirname "$0")/lull_render_setup"
case ${BUILD:-build} in *asan | *tsan) echo "ok 1 # SKIP a sanitizer wants to be loaded first"; exit 0 ;; esac
${CC:-cc} -shared -fPIC -O1 -o calls.so "$here/durable.c" -ldl || exit 2
G=${P%lull-render}ggn data=$here/../data/train-demo model=$here/../data/tiny.ggn
umask 022

written() { # written FAIL STATUS COMMAND…: the command ends so; its calls are in `calls`
    fail=$1 want=$2
    shift 2
    rm -f calls
    env LD_PRELOAD="$dir/calls.so" CALLS="$dir/calls" FAIL="$fail" "$@" >said 2>&1
    status=$?
    [ $status -eq "$want" ] || { echo "status $status"; cat said; return 1; }
}
# in_place OUTPUT [FOLDER]: its temporary was synced and renamed onto it, last of all the FOLDER synced; nobody removed it
in_place() {
    tmp=$(sed -n "s|^rename \(.*\) $1\$|\1|p" calls | tail -n 1)
    [ -n "$tmp" ] || { echo "$1: no rename"; cat calls; return 1; }
    [ "$(grep -nxF "fsync ${tmp##*/}" calls | tail -n 1 | cut -d: -f1)" -lt "$(grep -nxF "rename $tmp $1" calls | tail -n 1 | cut -d: -f1)" ] || { echo "$1: renamed before it was synced"; cat calls; return 1; }
    ! grep -qxF "unlink $1" calls || { echo "$1: removed"; return 1; }
    [ -z "${2:-}" ] || grep -xF -A1 "rename $tmp $1" calls | grep -qxF "fsync $2" || { echo "$1: its folder is not synced"; cat calls; return 1; }
    [ "$(stat -c %a "$1")" = 644 ] || { echo "$1: mode $(stat -c %a "$1")"; return 1; }
}
kept() { [ "$(cat "$1")" = "$2" ] && ! ls -A | grep -q '^\.tmp'; }

for output in "-o a.exr" "--preview a.png" "--stop-map b.png" "--stop-map b.csv" "--report a.json"; do
    name=${output#* }
    for time in new again; do
        t "$name, $time" written "" 0 "$P" "$scene" -q --spp 1 $output
        t "  …is synced, renamed, and has its mode" in_place "$name"
    done
    for fail in fsync rename; do
        echo old >"$name"
        t "$name, $fail fails" written $fail 2 env TMPDIR=/nonexistent "$P" "$scene" -q --spp 1 $output
        t "  …and the old file stays" kept "$name" old
    done
done
t "a checkpoint" written "" 0 "$P" "$scene" -q --spp-min 2 --spp-max 8 -c null -o a.exr --checkpoint c.ckp --checkpoint-every 0
t "  …and its folder too" in_place c.ckp .
cp c.ckp old.ckp
t "  …that cannot be synced" written fsync 2 env TMPDIR=/nonexistent "$P" "$scene" -q --spp-min 2 --spp-max 8 -c null -o a.exr --checkpoint c.ckp --checkpoint-every 0
t "  …and the old one stays" cmp c.ckp old.ckp
t "a recording" written "" 0 "$P" "$scene" -q --size 16x16 --block 16 --levels linear:1:2:1 --sequence seq
t "  …and its blocks" in_place seq/block-00000.lseq
t "  …and its manifest" in_place seq/manifest.json
t "a model" written "" 0 "$G" convert "$model" m.ggn
t "  …and its folder" in_place m.ggn .
cp -r "$data/scene0" labelled && chmod -R u+w labelled
t "labels" written "" 0 "$G" label labelled
t "  …too" in_place labelled/labels.json
t "a picture of ggn" written "" 0 "$G" reconstruct "$data/scene0" -o r.png
t "  …too" in_place r.png
(umask 077; "$P" "$scene" -q --spp 1 --report private.json)
t "who wants files to be private has them so" test "$(stat -c %a private.json)" = 600
echo "1..$n"
exit $bad
