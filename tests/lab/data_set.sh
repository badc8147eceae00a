#!/bin/sh
# scripts/lab data-set with tiny plans: order, resuming after an interrupt, cameras, plans that are wrong.
. "$(dirname "$0")/../cli/lull_render_setup"
BUILD=${P%/bin/*}
export BUILD
M=$here/../../scripts/lab
refused() { # refused TEXT ARGUMENTS...: exit status 2, one line on stderr that contains TEXT, no folder made
    n=$((n + 1)); text=$1; shift
    "$M" data-set "$@" >out 2>err; status=$?
    if [ $status -eq 2 ] && [ "$(wc -l <err)" -eq 1 ] && grep -qF -- "$text" err && [ ! -e data ]; then echo "ok $n - refused: $text"
    else echo "not ok $n - refused: $text (status $status)"; sed 's/^/# /' err; bad=1; fi
}
wrong() { # wrong TEXT PLAN-LINE...: a plan whose last line is wrong
    text=$1; shift
    printf '%s\n' "$@" >wrong.plan
    refused "wrong.plan:$#: $text" --plan wrong.plan data
}

t "--help" sh -c "'$M' data-set --help | grep -q -- --only"

# --- plans that are wrong ---
good="train a/view0 scenes/cornell-box.pbrt 1 linear:1:2:1 0 5"
wrong "6 fields (expected 7, or 17 with a camera)" "# comment" "train a scenes/cornell-box.pbrt 1 linear:1:2:1 0"
wrong "16 fields" "$good" "train b scenes/cornell-box.pbrt 1 linear:1:2:1 0 5  0 0 0  0 0 1  0 1 0"
wrong "split 'others' (expected one of train, validation, test, people)" "others a scenes/cornell-box.pbrt 1 linear:1:2:1 0 5"
wrong "blocks '5-3'" "train a scenes/cornell-box.pbrt 1 linear:1:2:1 0 5-3"
wrong "blocks '5,5'" "train a scenes/cornell-box.pbrt 1 linear:1:2:1 0 5,5"
wrong "minutes 'soon'" "train a scenes/cornell-box.pbrt soon linear:1:2:1 0 5"
wrong "minutes 'nan'" "train a scenes/cornell-box.pbrt nan linear:1:2:1 0 5"
wrong "reference '-1'" "train a scenes/cornell-box.pbrt 1 linear:1:2:1 -1 5"
wrong "scene 'a' is in train already (the split is by scene)" "$good" "test a/view1 scenes/cornell-box.pbrt 1 linear:1:2:1 0 6"
wrong "a/view0 is on line 1 already" "$good" "$good"
wrong "'film 64 32' (expected film WIDTHxHEIGHT BLOCK)" "film 64 32"
wrong "'film 64x64' (expected film WIDTHxHEIGHT BLOCK)" "$good" "film 64x64"
refused "cannot read" --plan nowhere.plan data
printf "# only\n\n" >empty.plan
refused "empty.plan: a plan with nothing in it" --plan empty.plan data
printf "\357\273\277train a scenes/cornell-box.pbrt 1 linear:1:2:1 0 5\n" >marked.plan
t "a plan that begins with a mark" sh -c "'$M' data-set --plan marked.plan --list data"
refused "--only calibration" --plan wrong.plan --only calibration data
refused "arguments: --nonsense" --nonsense
printf '%s\n' "train a scenes/cornell-box.pbrt 1 cubic:1:2:1 0 5" >levels.plan
t "what the renderer refuses ends with status 2" sh -c "'$M' data-set --plan levels.plan levels 2>err; test \$? -eq 2 && grep -q -- '--levels cubic' err"

# --- order: every split advances, the fast entries first ---
cat >order.plan <<'EOF'
train slow scenes/cornell-box.pbrt 8 linear:1:2:1 0 5
train fast scenes/environment.pbrt 1 linear:1:2:1 0 5   # a comment
validation v scenes/glossy.pbrt 3 linear:1:2:1 0 5
test absent ../nowhere/absent.pbrt 2 linear:1:2:1 0 5
test t scenes/mirror.pbrt 2 linear:1:2:1 0 5,6
test t/view1 scenes/mirror.pbrt 9 linear:1:2:1 8 6  1 1 -3  0 1 0  0 1 0  50
EOF
t "--list leaves out what is not here" sh -c "'$M' data-set --plan order.plan --list data | grep -q 'absent.pbrt is not here, absent is left out'"
"$M" data-set --plan order.plan --list data | awk '/blocks/ { printf "%s ", $(NF - 1) }' >order
t "--list: fast before slow, the splits in step" test "$(cat order)" = "t fast t slow v t/view1 "
printf 'train a scenes/cornell-box.pbrt 4 linear:1:2:1 0 0-15\ntrain b scenes/glossy.pbrt 2 linear:1:2:1 0 0-15\n%s\n' \
    'train c scenes/glossy.pbrt 3 linear:1:2:1 0 0-15' >rounds.plan
"$M" data-set --plan rounds.plan --list data | awk '/blocks/ { print $(NF - 1) ":" $NF }' >order
t "  …in rounds of a quarter, one block in each row and column" test "$(sed -n '1,3p;9p' order | tr '\n' ' ')" = \
    "b:0,13,10,7 c:0,13,10,7 b:4,1,14,11 a:0,13,10,7 "
t "--list made nothing" test ! -e data
t "all of it" "$M" data-set --plan order.plan data
t "  …in folders by split" test -s data/train/fast/block-00005.lseq -a -s data/test/t-view1/block-00006.lseq
t "  …with the view's name and camera" sh -c "tr -d '\t\n ' <data/test/t-view1/manifest.json | grep -q '\"scene\":\"t\",.*\"camera\":\"view1\",\"look_at\":\[1,1,-3,0,1,0,0,1,0\],\"fov\":50'"
"$M" data-set --plan order.plan data >out
t "  …and again: nothing to do" sh -c "tail -1 out | grep -q '6 of 6 (test t/view1 6); to go: 0:00 h'"
t "--only" sh -c "'$M' data-set --plan order.plan --only test data | grep -c ' of 3 ' | grep -qx 3"

# --- smaller pictures ---
printf '%s\n' "test a scenes/cornell-box.pbrt 1 linear:8:16:8 0 0" "film 64x48 16" "test b scenes/hard-firefly.pbrt 1 linear:8:32:8 0 4,5" >film.plan
t "a film and its blocks" sh -c "'$M' data-set --plan film.plan --only test film && tr -d '\t\n ' <film/test/b/manifest.json | grep -q '\"width\":64,\"height\":48,\"block\":16,' && grep -q '\"block\":.*200' film/test/a/manifest.json"

# --- what there is, as a list ---
t "--csv: one line per block" test "$("$M" data-set --csv data | tail -n +2 | cut -d';' -f1-3,5-8 | tr '\n' ' ')" = \
    "train;fast;view0;5;2;2;0 train;slow;view0;5;2;2;0 validation;v;view0;5;2;2;0 test;t;view0;5;2;2;0 test;t;view0;6;2;2;0 test;t;view1;6;2;2;8 "
echo '{"source": "observer", "blocks": [{"id": 5, "threshold": 20, "censored": false}, {"id": 6, "threshold": 10000, "censored": true}]}' \
    >data/test/t/labels.json
t "  …with labels" sh -c "'$M' data-set --csv data | grep -q ';observer;20;0$'"
t "  …and their octaves" test "$("$M" data-set --histogram data | tail -1 | tr -s ' ')" = "test 0 1 0 0 0 0 0 0 0 0 1 2 1"
t "  …bad arguments: one line, status 2" sh -c "'$M' data-set --csv nowhere 2>err; test \$? -eq 2 -a \$(wc -l <err) -eq 1 && ! '$M' data-set --csv --what 2>err && test \$(wc -l <err) -eq 1"

# --- interrupt and go on ---
cat >long.plan <<'EOF'
train long scenes/cornell-box.pbrt 1 linear:80:80:1 0 4-7
validation next scenes/cornell-box.pbrt 1 linear:1:1:1 0 5
EOF
setsid "$M" data-set --plan long.plan run >out 2>err &
pid=$!
until [ -s run/train/long/block-00007.lseq ] || ! kill -0 $pid 2>/dev/null; do sleep 0.05; done
kill -INT -$pid
wait $pid
t "SIGINT: exit status 130" test $? -eq 130
t "  …and it says how to go on" grep -q "interrupted; run it again to go on" out
t "  …with blocks left" test ! -e run/train/long/block-00006.lseq -a ! -e run/validation/next/manifest.json
t "  …and no temporaries" test -z "$(find run -name '*tmp*')"
cp run/train/long/block-00007.lseq first
t "run again: goes on" "$M" data-set --plan long.plan run
t "  …to the end" test -s run/train/long/block-00006.lseq -a -s run/validation/next/block-00005.lseq
t "  …and what was there stays" cmp first run/train/long/block-00007.lseq

echo "1..$n"
exit $bad
