#!/bin/sh
# All that the commands of ggn print and write for small recorded inputs, compared with tests/cli/whole/ggn*.txt (whole.py says how).
# What is called *.near depends on networks.
. "$(dirname "$0")/ggn_setup"
recorded=tests/data/recorded model=tests/data/tiny.ggn
got=$tmp/got
mkdir "$got"
ggn=$(pwd)/$ggn
run() { # run NAME ARGUMENT...: what ggn says, and its exit status
    name=$1
    shift
    "$ggn" "$@" >"$tmp/said" 2>"$tmp/err"
    echo "exit $?" >>"$tmp/said"
    { cat "$tmp/said"; sed 's/^/stderr: /' "$tmp/err"; } >"$got/$name"
}
says() { # says NAME ARGUMENT...: the same, one of many in a section
    name=$1
    shift
    echo "\$ ggn $*" >>"$got/$name"
    "$ggn" "$@" >"$tmp/said" 2>"$tmp/err"
    echo "exit $?" >>"$tmp/said"
    { cat "$tmp/said"; sed 's/^/stderr: /' "$tmp/err"; } >>"$got/$name"
}
cp -r $recorded "$tmp/d"
d=$tmp/d one=$tmp/d/train/one-view0

# --- options: help, and both bounds of every number ----------------------------------------------------------------------------
for command in inspect convert flip visible thresholds compare import label train baseline replay evaluate cost reconstruct; do
    says help "$command" --help
done
while read -r command options; do
    for option in $options; do says bounds "$command" "--$option=x"; done
done <<'END'
convert type
flip ppd
visible block
thresholds block
compare cap block
import block
label source spread threads
train preset seed window kr km kd crop batch-denoiser batch steps-denoiser steps epochs epoch-steps patience lr-denoiser lr picture synthetic extend ratio validation-windows early-rate threads
baseline epochs early ratio window type threads
replay visible ratio window precision cadence threads
evaluate visible early ratio window threads
cost split precision ratio cadence threads
END
for value in passes=1 =1 passes passes=x none=1 visible=1.5 sixteen-letters-.=1; do says bounds evaluate -d none -p "$value"; done
says bounds evaluate -d none $(printf -- '-p passes=1 %.0s' 1 2 3 4 5 6 7 8 9)
for option in model baseline thresholds; do # shellcheck disable=SC2046
    for command in cost evaluate; do
        says bounds $command -d none $(printf -- "--$option m %.0s" 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17)
    done
done
for word in "" frobnicate import-sin3d import_ -x; do says bounds $word; done

# --- labels --------------------------------------------------------------------------------------------------------------------
printf '{"level": 0.25, "spread": 0.4, "each_view_left_out": [{"name": "four", "level": 0.2}, {"name": "five", "level": 0.3}]}\n' >"$tmp/o.json"
labels() { # labels NAME ARGUMENTS...: of a fresh copy
    rm -rf "$tmp/l" && cp -r $recorded "$tmp/l"
    run "$@"
    for view in one-view0 one-view1; do cat "$tmp/l/train/$view/labels.json"; done >>"$got/$1"
}
labels label-halves label "$tmp/l/train"
labels label-levels label --source levels --spread 0.3 "$tmp/l/train/one-view0" "$tmp/l/train/one-view1"
labels label-observer label -O "$tmp/o.json" "$tmp/l/train"
printf 'one-view0_part6;20;30;40;10000;9999.5;60\nother;1;2;\nhuman;7;10001\n' >"$tmp/h.csv"
labels label-human label --human "$tmp/h.csv" "$tmp/l/train/one-view0"
labels label-human-view label --human "$tmp/h.csv" --view human --spread 0.1 "$tmp/l/train/one-view1"
mkdir "$tmp/l/empty" && sed '/"blocks":/,$d' "$one/manifest.json" >"$tmp/l/empty/manifest.json" && echo '"blocks": []}' >>"$tmp/l/empty/manifest.json"
run label-empty label "$tmp/l/empty"
run label-check label --check "$d/train" "$d/test"
printf 'one-view0;69;600;152;108;111;70;\none-view1;300;150;\nthree;400;10000;\n' >"$tmp/all.csv"
run label-calibrate label --calibrate "$tmp/all.csv" "$d/train" "$d/test" -o "$got/calibration.json"
run label-calibrate-spread label --calibrate "$tmp/all.csv" --source levels --spread 0.7 "$d/train" "$d/test"
awk 'BEGIN { for (i = 0; i < 160; i++) { l = 2 ^ (i % 8); t = 4 * (i % 3 + 1); print i % 3 ";" l ";" ((i * 7919 % 97) / 97 < 1 / (1 + (l / t) ^ 2)) }; print "nonsense" }' >"$tmp/t1.csv"
awk 'BEGIN { for (i = 0; i < 120; i++) { l = 2 ^ (i % 8); t = 8 * (i % 2 + 1); print i % 2 ";" l ";" ((i * 7919 % 101) / 101 < 1 / (1 + (l / t) ^ 5)) } }' >"$tmp/t2.csv"
run label-trials label --fit-trials "$tmp/t1.csv" "$tmp/t2.csv"
says label-errors label --human "$tmp/h.csv" --view other "$d/train/one-view0"
says label-errors label --human "$tmp/h.csv" --view nobody "$d/train/one-view0"
says label-errors label --human "$tmp/h.csv" "$d/train/one-view1"
says label-errors label --calibrate "$tmp/h.csv" "$d/train"
says label-errors label "$d/none"

# --- evaluation ----------------------------------------------------------------------------------------------------------------
people="-O $tmp/o.json --thresholds $recorded/people.csv"
# shellcheck disable=SC2086
run evaluate evaluate -d "$d" -w 4 $people -o "$got/evaluated"
mv "$d/test/three/labels.json" "$tmp/kept-labels"
# shellcheck disable=SC2086
run evaluate-recorded evaluate -d "$d" -w 3 $people --recorded --no-quality --ratio 2 --early 0.5 --visible 0.6
mv "$tmp/kept-labels" "$d/test/three/labels.json"
"$ggn" convert -t bf16 $model "$tmp/bf16.ggn" && run baseline.near baseline attributes -d "$d" --early 0.1 --ratio 1.2 -o "$tmp/a.ggn"
# shellcheck disable=SC2086
run evaluate.near evaluate -d "$d" -m $model -m "$tmp/bf16.ggn" --baseline "$tmp/a.ggn" $people -w 6 -o "$got/evaluated.near"
for method in spp constant scenesmean halfbuf variance observer peoplecsv; do rm -f "$got"/evaluated.near/*-$method.*; done # as above
# shellcheck disable=SC2086
run evaluate-retuned.near evaluate -d "$d" -m $model $people --no-quality --retune --visible 0.4 -p passes=1 -p first-spp=12 --no-pictures
says evaluate-errors evaluate -d "$d" -w 4
says evaluate-errors evaluate -d "$d" $people -w 10 --recorded
says evaluate-errors evaluate -d "$d" -O "$tmp/o.json" -w 4 --thresholds "$tmp/h.csv"
says evaluate-errors evaluate -d "$d" $people -o "$tmp/none/x"
says evaluate-errors baseline svd-entropy -d "$d" -o "$tmp/l.ggn"
run baseline-mask.near baseline noise-mask -d "$d" --type f16 -o "$tmp/n.ggn"

# --- cost ------------------------------------------------------------------------------------------------------------------------
run cost cost -d "$d" --split people $people -o "$got/cost.json"
run cost-recorded cost -d "$d" --split train --recorded --no-quality --ratio 1.2
run cost-cadence.near cost -d "$d" --split validation --cadence 1.7 -m $model --baseline "$tmp/a.ggn" --baseline "$tmp/n.ggn"
run cost.near cost -d "$d" --split test -m $model --baseline "$tmp/a.ggn" --no-pictures
run cost-scores.near cost -d "$d" --split train -m $model -m "$tmp/bf16.ggn" --scores --precision f64 --recorded
says cost-errors cost -d "$d" --split train --thresholds $recorded/people.csv
says cost-errors cost -d "$d" --split none
says cost-errors cost -d "$d" --baseline $model

# --- pictures of views ---------------------------------------------------------------------------------------------------------
mkdir "$got/pictures"
run reconstruct reconstruct "$one" -o "$got/pictures/labels.png" -r "$got/pictures/reference.png"
run reconstruct-json reconstruct "$one" -o "$tmp/x.png" --json
printf 'one;8;9;12;13;160;161\nother;1;1;1;1;1;1\n' >"$tmp/s.csv"
run reconstruct-view reconstruct "$one" -s "$tmp/s.csv" -v one -o "$got/pictures/stops.png"
printf '{"scene": "x", "blocks": [{"id": 3, "x0": 0, "y0": 16, "spp": 8}, {"id": 0, "x0": 0, "y0": 0, "threshold": 27, "spp": 8}, {"id": 1, "y0": 0, "spp": 61}, {"id": 2, "y0": 0, "spp": 40.5}, {"id": 4, "y0": 16, "spp": 300}, {"id": 5, "y0": 16, "spp": 500}]}' >"$tmp/s.json"
run reconstruct-report reconstruct "$one" -s "$tmp/s.json" -o "$got/pictures/report.png" --json
run reconstruct-alone reconstruct "$d/validation/two" -o "$got/pictures/alone.png"
printf 'two;8;8;8;8' >"$tmp/two.csv"
run reconstruct-alone-json reconstruct "$d/validation/two" -s "$tmp/two.csv" -o "$tmp/x.png" --json
says reconstruct-errors reconstruct "$d/validation/two" -o "$tmp/x.png" -r "$tmp/r.png"
says reconstruct-errors reconstruct "$one" -s "$tmp/s.csv" -o "$tmp/x.png"
says reconstruct-errors reconstruct "$one" -s "$tmp/s.csv" -v nobody -o "$tmp/x.png"
says reconstruct-errors reconstruct "$one" -s "$tmp/two.csv" -o "$tmp/x.png"
says reconstruct-errors reconstruct "$one" -o "$tmp/x.jpg"
a=$got/pictures/reference.png b=$got/pictures/stops.png
run flip flip "$a" "$b" -o "$got/pictures/flip.png"
run flip-json flip "$a" "$b" --json --ppd 30
run visible visible "$a" "$b" -b 16 -o "$got/pictures/visible.png"
run visible-json visible "$a" "$b" -b 20 --json -O "$tmp/o.json"
run visible-default visible "$a" "$b"
oiiotool --create 48x32 3 --fill:color=-1,0.2,0.3 20x10+4+3 -d float -o "$tmp/negative.exr" >/dev/null 2>&1
run flip-clipped flip "$tmp/negative.exr" "$b"
run visible-clipped visible "$a" "$tmp/negative.exr" -b 16
says flip-errors flip "$a" "$got/pictures/alone.png"
says flip-errors visible "$a" "$got/pictures/alone.png"
says flip-errors flip "$a" "$b" -o "$tmp/map.jpg"

# --- comparison ------------------------------------------------------------------------------------------------------------------
printf 'a;100;200;400;800;1600;\nb;50;60;70;80;\nd;10000;9000;20000\n' >"$tmp/t.csv"
printf "a;100;400;380;100;1500;\nc;1;\nb;51;20;300;81;\nd;5000;10000;30000\n" >"$tmp/m.csv"
run compare compare "$tmp/t.csv" "$tmp/m.csv" -o "$got/compared"
run compare-view compare "$tmp/t.csv" "$tmp/m.csv" -v b -o "$got/compared-view" --json
run compare-cap compare "$tmp/t.csv" "$tmp/m.csv" --cap 75 --json
printf 'it'"'"'s;8;9;12;13;160;161\n' >"$tmp/q.csv"
run compare-report compare "$tmp/s.json" "$tmp/q.csv" -v x -o "$got/compared-report"
run compare-one compare "$tmp/s.csv" "$tmp/q.csv" -v one
run compare-pair compare "$tmp/q.csv" "$tmp/s.json" -v "it's" --json
run compare-constant compare "$tmp/two.csv" "$tmp/two.csv"
for i in 1 2 3 4 5 6 7; do printf 'v%d;%d;%d;\n' $i $((100 * i)) $((50 * i)) >>"$tmp/many.csv"; done
sed 's/;1/;2/g' "$tmp/many.csv" >"$tmp/others.csv"
run compare-many compare "$tmp/many.csv" "$tmp/others.csv" -o "$got/compared-many"
says compare-errors compare "$tmp/t.csv" "$tmp/q.csv"
says compare-errors compare "$tmp/t.csv" "$tmp/m.csv" -v zz
says compare-errors compare "$tmp/t.csv" "$tmp/m.csv" -v d -o "$tmp/none/x"
printf 'b;1;2;\n' >"$tmp/short.csv"
says compare-errors compare "$tmp/t.csv" "$tmp/short.csv" -v b

# --- imports -----------------------------------------------------------------------------------------------------------------------
for view in p3d_toy-view0_part6 p3d_toy-view1; do
    mkdir -p "$tmp/sin3d/$view"
    cp "$got/pictures/stops.png" "$tmp/sin3d/$view/${view%_part6}_00020.png"
    cp "$got/pictures/labels.png" "$tmp/sin3d/$view/${view%_part6}_00040.png"
    cp "$a" "$tmp/sin3d/$view/${view%_part6}_00060.png"
done
echo >"$tmp/sin3d/p3d_toy-view0_part6/notes.txt" && mkdir "$tmp/sin3d/.hidden" "$tmp/sin3d/nothing"
printf 'p3d_toy-view0_part6;20;40;60;61;59.5;1\n' >"$tmp/p.csv"
run import import "$tmp/sin3d" -o "$tmp/imported" --block 16 -t "$tmp/p.csv"
run import-again import "$tmp/sin3d/p3d_toy-view1///" -o "$tmp/imported" --block 16
run import-another import "$tmp/sin3d/p3d_toy-view1" -o "$tmp/imported" --block 8
cp "$tmp/imported/p3d_toy-view0_part6/manifest.json" "$got/imported-manifest" && cp "$tmp/imported/p3d_toy-view0_part6/labels.json" "$got/imported-labels"
run import-picture reconstruct "$tmp/imported/p3d_toy-view0_part6" -o "$got/pictures/imported.png"
run evaluate-imported evaluate -d "$tmp/imported" -w 2
says import-errors import "$tmp/sin3d/nothing" -o "$tmp/failed"
says import-errors import "$tmp/sin3d" -o "$tmp/failed" --block 15
says import-errors import "$tmp/none" -o "$tmp/failed"
says import-errors import "$tmp/sin3d" -o "$tmp/none/failed" --block 16
[ ! -e "$tmp/failed" ]
check "an import that fails leaves nothing" $?

# --- models ------------------------------------------------------------------------------------------------------------------------
run inspect inspect $model
run inspect-tensors inspect --tensors tests/fuzz/corpus/ggn_model/f16.ggn
run inspect-json inspect --json tests/data/no-picture.ggn
for type in f32 bf16 f16; do "$ggn" convert -t $type $model "$got/convert-$type" 2>"$tmp/err"; done

python3 tests/cli/whole.py ggn "$got" $((n + 1)) "$tmp=TMP" '\.tmp-lull\d+-\d+\.=.tmp.' 'workspace [0-9.]+ MB=workspace N MB' '"bytes":\t\d+=BYTES' '"crc32":\t"[0-9a-f]+"=CRC' "$PWD=TREE" || bad=1
exit $bad
