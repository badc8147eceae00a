#!/bin/sh
# The schedule that a model has learned is the one that a renderer asks by: a model of evenly spaced levels (16, 32 … 256, as imported
# pictures have them), thinned as `ggn train` does, stops the blocks of a training scene in a render where `ggn evaluate` says.
. "$(dirname "$0")/../cli/ggn_setup"
record() { # record SCENE LEVELS FOLDER
    "$BUILD/bin/lull-render" -q "scenes/$1.pbrt" --size 96x64 --block 32 --sampler independent --levels "$2" --sequence "$3/$1" \
        </dev/null 2>>"$tmp/err"
}
mkdir "$tmp/data" "$tmp/other"
for scene in cornell-box soft-shadow; do
    record $scene linear:16:256:16 "$tmp/data" || break
done
# Thresholds that nobody would give: they only have to lie between the levels.
for scene in cornell-box soft-shadow; do
    printf '{"format": "lull-labels", "version": 1, "source": "observer", "detail": "made up", "cap": 10000, "spread": 0.15, "blocks": [' &&
        i=0 && for t in 120 150 190 140 170 200; do
        printf '%s{"id": %d, "threshold": %d, "censored": false}' "$([ $i = 0 ] || echo ,)" $i $t
        i=$((i + 1))
    done && echo ']}'
done >"$tmp/labels"
for scene in cornell-box soft-shadow; do head -n 1 "$tmp/labels" >"$tmp/data/$scene/labels.json"; done
"$ggn" train --data "$tmp/data" -V soft-shadow --kr 3 --km 3 --kd 4 --crop 32 --batch 8 --steps-denoiser 20 --steps 60 --epoch-steps 20 \
    --patience 0 --synthetic 0 --extend 0 --out "$tmp/even.ggn" -q 2>"$tmp/err" && $ggn inspect --json "$tmp/even.ggn" >"$tmp/out" 2>"$tmp/err" &&
    tr -d '\t\n ' <"$tmp/out" | grep -q '"levels":\[16,32,48,64,80,96,112,128,144,160,176'
check "a model of evenly spaced levels keeps them" $?

render="$BUILD/bin/lull-render -q scenes/cornell-box.pbrt --size 96x64 --block 32 --sampler independent --spp-max 256 -c ggn"
# same SHARE: where blocks stop in a render, and where they do by the recording. Beyond the last level that was learned (176, below the
# thresholds) the renderer asks by the ratio of levels, where nothing was recorded: such a stop only lies beyond in both.
learned() { awk '{ print ($1 > 176 ? "beyond" : $1) }' "$1"; }
same() {
    $render -p model="$tmp/even.ggn" -p visible="$1" --stop-map "$tmp/stops.csv" </dev/null 2>"$tmp/err" &&
        $ggn evaluate --data "$tmp/data" --model "$tmp/even.ggn" -p visible="$1" --recorded --no-quality -o "$tmp/report" \
            >"$tmp/out" 2>"$tmp/err" && [ ! -s "$tmp/err" ] &&
        awk -F';' '$1 == "cornell-box" { print $5 }' "$tmp/report/train-stops-evenggn.csv" >"$tmp/replayed" &&
        head -n 1 "$tmp/stops.csv" | tr ';' '\n' | sed -n 2,7p >"$tmp/rendered" && [ "$(wc -l <"$tmp/replayed")" -eq 6 ] &&
        paste "$tmp/rendered" "$tmp/replayed" >"$tmp/err" && [ "$(learned "$tmp/rendered")" = "$(learned "$tmp/replayed")" ]
    check "visible $1: a render stops where evaluate says" $?
    cat "$tmp/rendered" >>"$tmp/all"
}
for share in 0.55 0.6 0.7; do same $share; done
[ "$(sort -un "$tmp/all" | wc -l)" -ge 3 ] && [ "$(awk '$1 < 256' "$tmp/all" | wc -l)" -ge 3 ]
check "blocks stop at several levels" $?

# What is not alike is said, in one line: by evaluate of a recording with other levels, in a render of blocks of another size.
record cornell-box geometric:16:256:1.5 "$tmp/other" && cp "$tmp/data/cornell-box/labels.json" "$tmp/other/cornell-box/" &&
    $ggn evaluate --data "$tmp/other" --model "$tmp/even.ggn" --recorded --no-quality >"$tmp/out" 2>"$tmp/err" &&
    [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "^ggn evaluate: .*even.ggn: a host asks at .* samples" "$tmp/err"
check "evaluate names levels that no host would ask at" $?
"$BUILD/bin/lull-render" scenes/cornell-box.pbrt --size 96x64 --block 48 --spp-max 16 -c ggn -p model="$tmp/even.ggn" --no-progress \
    -o "$tmp/x.exr" </dev/null >"$tmp/out" 2>"$tmp/err" && [ "$(grep -c "not learned: blocks of 48x48 pixels instead of 32x32" "$tmp/err")" -eq 1 ]
check "a render names blocks of another size" $?
echo "1..$n"
exit $bad
