#!/bin/sh
# One stopping rule: what `ggn evaluate` makes of a recording is what the criteria do in a render. Every sample count is recorded,
# hence each at which a criterion was asked; the replay has to find these by itself. The criterion ggn: the same stop and the same p
# for every block. The default, observer, sees halves that a recording rounds: nearly the same.
. "$(dirname "$0")/../cli/ggn_setup"
# A tiny model for blocks of 40 pixels: its windows are judged in a millisecond, each level has 1.35 times the samples
# of the last.
"$BUILD/bin/ggn" train --data tests/data/train-demo --kr 3 --km 3 --kd 8 --crop 32 --ratio 0 --batch 8 --steps-denoiser 20 \
    --steps 60 --epoch-steps 20 --out "$tmp/tiny.ggn" -q 2>"$tmp/err"
check "a tiny model" $?

render="$BUILD/bin/lull-render -q scenes/cornell-box.pbrt --size 120x80 --block 40 --sampler independent"
mkdir "$tmp/data"
$render --levels linear:1:250:1 --reference-spp 0 --sequence "$tmp/data/view" --name view </dev/null 2>"$tmp/err"
check "every sample count from 1 to 250 recorded" $?
{
    printf '{"format": "lull-labels", "version": 1, "source": "observer", "detail": "made up", "cap": 10000, "spread": 0.15, "blocks": ['
    for id in 0 1 2 3 4 5; do
        printf '%s{"id": %d, "threshold": 100, "censored": false}' "$([ $id = 0 ] || echo ,)" $id
    done
    echo ']}'
} >"$tmp/data/view/labels.json"

numbers='printf "%d %d %.17g\n", $1, $2, $3'
# same FILE FILE: of six blocks the same stop, and the same p but for the last of the 15 digits that a report holds
same() {
    paste "$1" "$2" | tee "$tmp/err" | awk '$1 != $4 || $2 != $5 || $3 - $6 > 1e-14 || $6 - $3 > 1e-14 || NF != 6 { bad = 1 } END { exit bad || NR != 6 }'
}
# judged CRITERION OPTION FILE METHOD NAME PARAMETERS: blocks that a render stops, and the same from the recording, as lines of
# block, stop and p (0: none)
judged() {
    criterion=$1 option=$2 file=$3 method=$4 name=$5
    shift 5
    params=$(printf ' -p %s' "$@")
    # shellcheck disable=SC2086
    $render --spp-min 1 --spp-max 250 -c "$criterion" -p model="$file" $params --report "$tmp/report.json" </dev/null 2>"$tmp/err" &&
        "$BUILD/bin/ggn" evaluate --data "$tmp/data" "$option" "$file" $params --recorded --no-quality -o "$tmp/out" \
            >"$tmp/log" 2>"$tmp/err"
    check "$name: rendered and replayed" $?
    awk '/"id":/ { id = $2 + 0 } /"spp":/ { spp = $2 + 0 } /"p_noisy":/ { $3 = $2 + 0 == 0 ? 0 : $2; $1 = id; $2 = spp; '"$numbers"' }' "$tmp/report.json" >"$tmp/rendered"
    awk -F';' "NR > 1 { \$1 = \$2; \$2 = \$5; \$3 = \$6 } NR > 1 { $numbers }" "$tmp"/out/*-stops-"$method".csv >"$tmp/replayed"
    same "$tmp/rendered" "$tmp/replayed"
    check "$name: the same stop and the same p for every block" $?
}
replay() { judged ggn --model "$tmp/tiny.ggn" tinyggn "$@"; }

replay "a network" visible=0.6 first-spp=4
# or the equalities above would say little
[ "$(awk '$2 < 250' "$tmp/rendered" | wc -l)" -ge 3 ] && [ "$(awk '$3 > 0' "$tmp/rendered" | wc -l)" -eq 6 ]
check "blocks stop, and the network was asked about each" $?

# The baselines likewise: their criteria and their evaluation are one. A window of evaluation has six images, so that an SVM,
# which looks at one, is asked from the sixth level on.
baseline() { # baseline NAME METHOD PARAMETERS
    "$BUILD/bin/ggn" baseline "$1" --data tests/data/train-demo --epochs 20 --ratio 1.3 --output "$tmp/$1.ggn" >"$tmp/log" 2>"$tmp/err"
    check "a small model for $1" $?
    name=$1 method=$2
    shift 2
    judged "$name" --baseline "$tmp/$name.ggn" "$method" "$name" "$@"
}
baseline attributes 26attributesSVM first-spp=6 visible=0.6
cp "$tmp/rendered" "$tmp/attributes"
baseline noise-mask noisemaskSVM first-spp=6 visible=0.5 passes=2
baseline svd-entropy SVDentropyLSTM first-spp=1 visible=0.5
[ "$(awk '$2 < 250' "$tmp/attributes" | wc -l)" -ge 1 ] && [ "$(awk '$3 > 0' "$tmp/attributes" | wc -l)" -eq 6 ]
check "the attributes stop blocks" $?

# watch SHARE: the default criterion in a render against the recording's replay. Blocks that get all samples are judged at the same
# count, from halves that the recording rounds: measured, shares differ by up to 0.0001. Others are judged at counts of the render's
# own, between recorded levels: a bright sample that a replay sees one level later moves the stop by one step, at most 1.5.
watch() {
    rm -rf "$tmp/out" # without a model the scene is one to train on
    $render --spp-max 250 --visible "$1" --report "$tmp/report.json" </dev/null 2>"$tmp/err" &&
        "$BUILD/bin/ggn" evaluate --data "$tmp/data" --visible "$1" --recorded --no-quality -o "$tmp/out" >"$tmp/log" 2>"$tmp/err"
    check "observer, visible $1: rendered and replayed" $?
    awk '/"id":[[:space:]]*"/ { which = $2 } /"id":/ { id = $2 + 0 } /"spp":/ { spp = $2 + 0 } /"p_noisy":/ { print id, spp, $2 + 0, which }' "$tmp/report.json" >"$tmp/rendered"
    awk -F';' 'NR > 1 { print $2, $5, $6 + 0 }' "$tmp"/out/*-stops-observer.csv >"$tmp/replayed"
    paste "$tmp/rendered" "$tmp/replayed" | tee "$tmp/err" | awk '{
        if ($1 != $5 || $4 != "\"observer\"," || $6 / $2 > 1.5 || $2 / $6 > 1.5 || $7 - $3 > 0.1 || $3 - $7 > 0.1) bad = 1
        if ($2 == 250 && $6 == 250 && ($7 - $3 > 0.001 || $3 - $7 > 0.001)) bad = 1
        if ($2 < 250 && $3 > '"$1"') bad = 1 # it stopped with more viewers than asked for
    } END { exit bad || NR != 6 }'
    check "observer, visible $1: nearly the same stop and p for every block" $?
    cp "$tmp/rendered" "$tmp/watched-$1"
}
watch 0.995
watch 0.9995
[ "$(awk '$2 < 250' "$tmp/watched-0.995" | wc -l)" -ge 4 ] && [ "$(awk '$2 == 250' "$tmp/watched-0.995" | wc -l)" -ge 1 ] &&
    paste "$tmp/watched-0.995" "$tmp/watched-0.9995" | awk '$6 > $2 || $6 < 16 { bad = 1 } $6 < $2 { n++ } END { exit bad || n < 4 }'
check "blocks stop or do not, and sooner when more viewers may see noise" $?
echo "1..$n"
exit $bad
