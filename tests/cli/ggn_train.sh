#!/bin/sh
# `ggn train` from the outside: same bytes again, with another number of threads and after an interruption; bad input; the model in
# the criterion.
. "$(dirname "$0")/ggn_setup"
fails() { # fails NAME PATTERN COMMAND…: exit 2, the last line on stderr has PATTERN, no model is left
    name=$1 pattern=$2
    shift 2
    rm -f "$tmp/bad.ggn"
    "$@" --out "$tmp/bad.ggn" -q >"$tmp/out" 2>"$tmp/err"
    rc=$?
    [ "$rc" -eq 2 ] && tail -n 1 "$tmp/err" | grep "^ggn train: " | grep -q -e "$pattern" && [ ! -e "$tmp/bad.ggn" ]
    check "$name" $?
}
tiny="--data $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 8 --steps-denoiser 20 --steps 20 --epoch-steps 10"

$ggn train $tiny --out "$tmp/a.ggn" 2>"$tmp/err"
check "a tiny model" $?
grep -q "judge .*10/20 .*AUC .*windows/s .*ETA" "$tmp/err"
check "progress has loss, AUC, rate and ETA" $?
$ggn inspect "$tmp/a.ggn" >"$tmp/out" 2>"$tmp/err" && grep -q "stops below" "$tmp/out"
check "inspect reads it" $?
[ "$(wc -l <"$tmp/a.ggn.csv")" -eq 5 ] && [ ! -e "$tmp/a.ggn.png" ] && grep -q '"labels":.*"observer"' "$tmp/a.ggn.card.json"
check "curves and card" $?
$ggn train $tiny --out "$tmp/b.ggn" --threads 1 -q 2>"$tmp/err" && cmp "$tmp/a.ggn" "$tmp/b.ggn" 2>"$tmp/err"
check "the same bytes with one thread" $?
$ggn train $tiny --out "$tmp/c.ggn" --seed 2 -q 2>"$tmp/err" && ! cmp -s "$tmp/a.ggn" "$tmp/c.ggn"
check "other bytes with another seed" $?
# Twelve epochs at a rate that makes them go up and down: where depends on the last digits of float sums, hence on the processor. So the
# first seed serves for which three rules choose three epochs: the best AUC, the lowest loss of the calibrated probability, the last.
wild="$tiny --steps-denoiser 10 --epoch-steps 5 --lr 0.02 -q"
for seed in $(seq 12); do
    $ggn train $wild --steps 60 --patience 0 --seed "$seed" --out "$tmp/f.ggn" 2>"$tmp/err" || break
    awk -F, '$1 == "judge" && (low == "" || $5 < low) { low = $5; best = $2 } $1 == "judge" && $7 > high { high = $7; other = $2 }
        END { if (best == other || best == $2) exit 1; print best }' "$tmp/f.ggn.csv" >"$tmp/best" 2>"$tmp/err" && break
done
[ -s "$tmp/best" ] && grep -q "\"best_step\":[[:space:]]*$(cat "$tmp/best")," "$tmp/f.ggn.card.json"
check "the epoch with the lowest validation loss is kept, not the last, not the one with the best AUC" $?

# The changed stops that are counted are those in which the tables of stops differ from those of a model that was trained well.
$ggn evaluate -d $data -m "$tmp/a.ggn" -m tests/data/tiny.ggn --no-quality --visible 0.4 -o "$tmp/report" >"$tmp/out" 2>"$tmp/err" &&
    for m in a tiny; do cut -d';' -f1-5 "$tmp/report/train-stops-${m}ggn.csv" >"$tmp/stops-$m"; done &&
    changed=$(diff "$tmp/stops-a" "$tmp/stops-tiny" | grep -c '^>') && [ "$changed" -gt 0 ] &&
    grep -q "^tiny.ggn: [1-9][0-9]* of [0-9]* verdicts and $changed of 9 stops differ from a.ggn" "$tmp/out"
check "evaluate counts what another model decides differently" $?
tr -d '\t\n' <"$tmp/report/figures.json" | grep -Eq "\"tiny.ggn\": *\{ *\"from\": *\"a.ggn\", *\"windows\": *[0-9]+, *\"verdicts_changed\": *[1-9][0-9]*, *\"blocks\": *9, *\"stops_changed\": *$changed, *\"p_moved_at_most\": *0\.[0-9]*[1-9]"
check "  …in figures.json too" $?

# The scenes that a model has learned from are its own: data without a split are judged by them, not by every fifth scene.
cp -r $data "$tmp/unsplit" && rm "$tmp/unsplit/split.json" && sed -i 's/"scene":[^,]*,/"scene": "chess",/' "$tmp/unsplit/scene0/manifest.json" &&
    $ggn train $tiny --data "$tmp/unsplit" -V chess -T scene2 --out "$tmp/v.ggn" -q 2>"$tmp/err" &&
    $ggn evaluate -d "$tmp/unsplit" -m "$tmp/v.ggn" --no-quality --json >"$tmp/figures" 2>"$tmp/err" && [ ! -s "$tmp/err" ] &&
    python3 - "$tmp/figures" <<'END'
import json, sys
figures = json.load(open(sys.argv[1]))
assert figures["split"] == "the models' own", figures["split"]
blocks = {split: methods["v.ggn"]["blocks"] for split, methods in figures["splits"].items()}
assert blocks == {"train": 6, "validation": 3, "test": 3}, blocks
END
check "evaluate reads the split of the model" $?
$ggn evaluate -d "$tmp/unsplit" -m "$tmp/v.ggn" --no-quality -V scene1 >"$tmp/out" 2>"$tmp/err" &&
    [ "$(cat "$tmp/err")" = "ggn evaluate: $tmp/v.ggn: scene 'scene1' is in validation here, and in train of this model" ]
check "  …says what it has learned from" $?
judges() { # judges NAME PATTERN ARGS…: ggn evaluate refuses
    name=$1 pattern=$2
    shift 2
    $ggn evaluate -d "$tmp/unsplit" "$@" >"$tmp/out" 2>"$tmp/err"
    [ $? -eq 2 ] && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "^ggn evaluate: .*$pattern" "$tmp/err"
    check "$name" $?
}
mv "$tmp/unsplit/scene0" "$tmp/unsplit/chess-view0"
judges "a folder instead of a scene" "no scene 'chess-view0' in the data: this folder's scene is 'chess'" -V chess-view0
judges "a scene on both sides" "both list the scene 'chess'" -V chess,scene1 -T scene2,chess
fails "  …for training too" "both list the scene 'chess'" $ggn train $tiny --data "$tmp/unsplit" -V chess -T chess
fails "nothing to train on" "no scene is left to train on" $ggn train $tiny --data "$tmp/unsplit" -V chess,scene1,scene2,scene3
fails "a folder instead of a scene to train" "this folder's scene is 'chess'" $ggn train $tiny --data "$tmp/unsplit" -T chess-view0

# interrupted once in each phase: as soon as the curves have so many rows; anew where the signals came too late
for rows in $(for _ in $(seq 20); do echo 2 4; done); do
    [ "$rows" = 4 ] || ! grep -qs "status 130" "$tmp/interrupted" || break
    [ "$rows" = 4 ] || rm -f "$tmp"/d.ggn*
    $ggn train $tiny --out "$tmp/d.ggn" --resume -q 2>"$tmp/err" &
    pid=$!
    while kill -0 $pid 2>/dev/null && [ "$(cat "$tmp/d.ggn.csv" 2>/dev/null | wc -l)" -lt "$rows" ]; do sleep 0.01; done
    kill -INT $pid
    wait $pid
    echo "status $?" >>"$tmp/interrupted"
done
grep -q "status 130" "$tmp/interrupted" && $ggn train $tiny --out "$tmp/d.ggn" --resume -q 2>"$tmp/err" &&
    cmp "$tmp/a.ggn" "$tmp/d.ggn" 2>"$tmp/err"
check "interrupted and resumed: the same bytes" $?
# The learning rate of each epoch's last step: 20 steps of warming up, then half a cosine down to a fiftieth.
awk -F, 'NR > 1 {
    all = 20; step = $2 - 1; warm = (step + 1) / 20 < 1 ? (step + 1) / 20 : 1
    want = 1e-3 * warm * (0.02 + 0.98 * (1 + cos(3.14159265358979 * step / all)) / 2)
    if ($8 > want * 1.00001 || $8 < want * 0.99999) { print $0 " instead of " want; bad = 1 }
} END { exit bad || NR != 5 }' "$tmp/a.ggn.csv" >"$tmp/err"
check "learning rates warm up and decay" $?

# interrupted LINES OUT ARGS…: a training that is interrupted as soon as its curves have so many lines; again if the signal came too late
interrupted() {
    lines=$1 out=$2
    shift 2
    for _ in $(seq 20); do
        rm -f "$out" "$out".*
        $ggn train "$@" --out "$out" 2>"$tmp/err" &
        pid=$!
        while kill -0 $pid 2>/dev/null && [ "$(cat "$out.csv" 2>/dev/null | wc -l)" -lt "$lines" ]; do sleep 0.01; done
        kill -INT $pid 2>/dev/null
        wait $pid
        [ $? -eq 130 ] && [ ! -e "$out" ] && return
    done
    return 1
}
# Without patience left: the epochs since the best one are counted through an interruption. The first seed with which patience ends it.
for seed in $(seq 12); do
    $ggn train $wild --steps 100 --patience 4 --seed "$seed" --out "$tmp/g.ggn" 2>"$tmp/err" || break
    [ "$(tail -n 1 "$tmp/g.ggn.csv" | cut -d, -f2)" -lt 100 ] && break
done
awk -F, '$1 == "judge" && (low == "" || $5 < low) { low = $5; best = $2; line = NR } END { print line; exit !($2 < 100 && $2 == best + 4 * 5) }' "$tmp/g.ggn.csv" >"$tmp/best" 2>"$tmp/err"
check "patience ends a run four epochs after its best" $?
long="$wild --steps 100 --patience 4 --seed $seed"
interrupted $(($(cat "$tmp/best") + 2)) "$tmp/h.ggn" $long && [ "$(wc -l <"$tmp/h.ggn.csv")" -lt "$(wc -l <"$tmp/g.ggn.csv")" ] &&
    $ggn train $long --out "$tmp/h.ggn" --resume 2>"$tmp/err" && cmp "$tmp/g.ggn" "$tmp/h.ggn" 2>"$tmp/err" &&
    [ "$(wc -l <"$tmp/g.ggn.csv")" -eq "$(wc -l <"$tmp/h.ggn.csv")" ]
check "  …and a resumed run where it ends the other" $?

cp "$tmp/a.ggn.ckpt" "$tmp/bad.ggn.ckpt"
fails "a checkpoint of another run is refused" "made with seed=1, but this run has seed=3" $ggn train $tiny --seed 3 --resume
for option in "preset paper" "window 4" "kr 4" "km 4" "kd 5" "crop 16" "batch-denoiser 4" "batch 4" "steps-denoiser 30" "steps 30" \
    "epoch-steps 5" "patience 3" "lr-denoiser 0.01" "lr 0.01" "synthetic 0" "extend 0" \
    "validation-windows 100" "init $tmp/a.ggn"; do # what makes another model
    fails "  …by its name: --${option% *}" "made with ${option%% *}=" $ggn train $tiny --$option --resume
done
cp -r $data "$tmp/labelled" && sed -i '0,/"threshold":[[:space:]]*[0-9.]*/s//"threshold": 77/' "$tmp/labelled/scene0/labels.json" && ! cmp -s $data/scene0/labels.json "$tmp/labelled/scene0/labels.json"
check "a copy of the data with another label" $?
fails "a checkpoint of other labels is refused" "made with data-crc=" $ggn train $tiny --data "$tmp/labelled" --resume
head -c 4000 "$tmp/a.ggn.ckpt" >"$tmp/bad.ggn.ckpt"
fails "a truncated checkpoint" "bad.ggn.ckpt" $ggn train $tiny --resume
rm -f "$tmp/bad.ggn.ckpt"

$ggn train $tiny --out "$tmp/e.ggn" --init "$tmp/a.ggn" -q 2>"$tmp/err" && ! cmp -s "$tmp/a.ggn" "$tmp/e.ggn"
check "starting from a model" $?
fails "a model of another size to start from" "another size" $ggn train $tiny --init "$tmp/a.ggn" --km 4
$ggn train --data $data --preset paper --kr 3 --km 3 --kd 4 --batch 8 --steps 6 --epoch-steps 3 --out "$tmp/p.ggn" -q 2>"$tmp/err" &&
    $ggn inspect "$tmp/p.ggn" >"$tmp/out" 2>"$tmp/err" && grep -q paper "$tmp/out"
check "preset paper" $?

# a residual model needs half buffers at every level
fails "levels without half buffers" "residual needs half buffers at every recorded level" $ggn train $tiny --residual 0.5
mkdir -p "$tmp/law/train" "$tmp/law/validation"
for scene in soft-shadow cornell-box glossy; do
    "$BUILD/bin/lull-render" -q "scenes/$scene.pbrt" --size 64x64 --block 32 --sampler independent --levels geometric:4:200:1.26 \
        --sequence "$tmp/law/train/$scene" 2>>"$tmp/err" || break
done
mv "$tmp/law/train/glossy" "$tmp/law/validation" && $ggn label "$tmp/law/train" "$tmp/law/validation" >"$tmp/out" 2>"$tmp/err"
check "recordings with them" $?
law="--data $tmp/law --kr 3 --km 3 --kd 4 --crop 16 --batch 8 --steps-denoiser 5 --steps 8 --epoch-steps 2 --residual 0.5 --picture 1"
$ggn train $law --out "$tmp/law.ggn" -q 2>"$tmp/err" && $ggn inspect "$tmp/law.ggn" 2>"$tmp/err" | grep -q "residual .* 0.5 octaves .* 7 scalars"
check "a residual model" $?
interrupted 4 "$tmp/resumed.ggn" $law -q &&
    $ggn train $law --out "$tmp/resumed.ggn" --resume --threads 1 -q 2>"$tmp/err" && cmp "$tmp/law.ggn" "$tmp/resumed.ggn" 2>"$tmp/err"
check "   ...the same bytes when interrupted and resumed with one thread" $?
$ggn train $law --scalars 0 --out "$tmp/plain.ggn" -q 2>"$tmp/err" && ! cmp -s "$tmp/law.ggn" "$tmp/plain.ggn"
check "   ...another without scalars" $?
fails "networks with other inputs to start from" "another size, preset or input" $ggn train $law --scalars 0 --init "$tmp/law.ggn"
$ggn evaluate -d "$tmp/law" -m "$tmp/law.ggn" -m "$tmp/plain.ggn" --no-quality >"$tmp/figures" 2>"$tmp/err" && grep -q "^law.ggn" "$tmp/figures"
check "   ...evaluate judges it" $?
LULL_MODEL=$tmp/law.ggn $BUILD/bin/lull-check -q -L "${LIMIT_S:-3600}" "$BUILD/lib/lull/ggn.so:ggn" >"$tmp/err" 2>&1
check "   ...lull-check passes the criterion with it" $?

# the noise picture, dropped at random: the same bytes after an interruption, and other bytes than without
more=$(echo "$law" | sed "s/--picture 1/--picture 0.7/")
$ggn train $more --out "$tmp/picture.ggn" -q 2>"$tmp/err" && $ggn inspect "$tmp/picture.ggn" 2>"$tmp/err" | grep -q "noise picture.*taken"
check "a model with the noise picture" $?
interrupted 4 "$tmp/resumed.ggn" $more -q &&
    $ggn train $more --out "$tmp/resumed.ggn" --resume --threads 1 -q 2>"$tmp/err" && cmp "$tmp/picture.ggn" "$tmp/resumed.ggn" 2>"$tmp/err"
check "the same bytes when interrupted and resumed, with noise pictures" $?
for no in "" --no-pictures; do
    $ggn evaluate -d "$tmp/law" -m "$tmp/picture.ggn" --no-quality --json $no >"$tmp/figures$no" 2>"$tmp/err" || break
done && ! cmp -s "$tmp/figures" "$tmp/figures--no-pictures"
check "evaluate with and without noise pictures" $?
LULL_MODEL=$tmp/picture.ggn $BUILD/bin/lull-check -q -L "${LIMIT_S:-3600}" "$BUILD/lib/lull/ggn.so:ggn" >"$tmp/err" 2>&1
check "lull-check passes the criterion with this model" $?
fails "a model of another input to start from" "another size, preset or input" $ggn train $tiny --init "$tmp/picture.ggn"
fails "a noise picture without the law" "a noise picture is of the visible noise: --picture goes with --residual" $ggn train $tiny --picture 1
fails "no noise picture in the published preset" "preset paper has neither noise pictures" $ggn train --data $data --preset paper --picture 1

mkdir "$tmp/empty"
fails "no sequence" "no recorded sequence" $ggn train --data "$tmp/empty"
fails "no such scene" "no scene 'nowhere'" $ggn train --data $data --validation nowhere
fails "a crop larger than a block" "crop 64 is not in 16..40, the side of the blocks" $ggn train --data $data --crop 64
$ggn train --data $data --kr 3 --km 3 --kd 4 --ratio 0 --batch 8 --steps-denoiser 2 --steps 2 --out "$tmp/small.ggn" -q 2>"$tmp/err" &&
    grep -q '"crop":[[:space:]]*40,' "$tmp/small.ggn.card.json"
check "without --crop the crops of small blocks are whole" $?
cp -r $data "$tmp/cut" && head -c 3000 $data/scene1/block-00001.lseq >"$tmp/cut/scene1/block-00001.lseq"
fails "a truncated block" "block-00001" $ggn train --data "$tmp/cut" --crop 32
cp -r $data "$tmp/bare" && rm "$tmp"/bare/scene*/labels.json
fails "no labels" "label" $ggn train --data "$tmp/bare" --crop 32
cp -r $data "$tmp/quiet" && sed -i 's/"threshold":.*,/"threshold": 1,/' "$tmp"/quiet/scene*/labels.json
fails "no noisy window" "free of noise" $ggn train --data "$tmp/quiet" --crop 32
$ggn train $tiny --out "$tmp/no/such/folder/m.ggn" -q 2>"$tmp/err"
[ $? -ne 0 ] && [ "$(wc -l <"$tmp/err")" -eq 1 ]
check "an output folder that is not there" $?

# the criterion with this model holds to the whole contract
LULL_MODEL=$tmp/a.ggn $BUILD/bin/lull-check -L "${LIMIT_S:-3600}" "$BUILD/lib/lull/ggn.so:ggn" >"$tmp/out" 2>&1
rc=$?
grep '^not ok' "$tmp/out" >"$tmp/err"
check "lull-check passes the criterion ggn" $rc
LULL_MODEL=$tmp/a.ggn $BUILD/bin/lull-check -q -L "${LIMIT_S:-3600}" -o state -o repeat -o batch -p visible=0.9 -p passes=1 \
    "$BUILD/lib/lull/ggn.so:ggn" >"$tmp/err" 2>&1
check "and with other parameters" $?
echo "1..$n"
exit $bad
