#!/bin/sh
# import, label, evaluate and reconstruct from the outside, on a small made-up view in the SIN3D layout.
. "$(dirname "$0")/ggn_setup"
view=$tmp/sin3d/p3d_toy-view0_part6
mkdir -p "$view"
# Noise of amplitude 4/level over grey, 8 levels.
for i in 1 2 3 4 5 6 7 8; do
    a=$((64 / i))
    oiiotool --pattern constant:color=.4,.5,.6 64x32 3 --noise:type=gaussian:mean=0:stddev="$(printf '0.%03d' $a)":seed=$i -d uint8 \
        -o "$view/p3d_toy-view0_$(printf %05d $((20 * i))).png" >/dev/null 2>&1
done
printf 'p3d_toy-view0_part6;90;160;\n' >"$tmp/human.csv"
$ggn import "$tmp/sin3d" -o "$tmp/data" --block 32 --thresholds "$tmp/human.csv" >"$tmp/out" 2>"$tmp/err" &&
    [ -s "$tmp/data/p3d_toy-view0_part6/manifest.json" ] && grep -q 'imported with thresholds' "$tmp/out"
check "import a folder of views" $?
d=$tmp/data/p3d_toy-view0_part6
grep -q '"source":.*"human"' "$d/labels.json"
check "imported thresholds are human labels" $?
fails "import: nothing there" 'no NAME_' $ggn import "$tmp/data" -o "$tmp/x"
fails "import: missing folder" '/none: ' $ggn import "$tmp/none" -o "$tmp/x"
fails "import: thresholds that do not fit" '2 blocks, but 1' sh -c "printf 'p3d_toy-view0_part6;90;\n' >$tmp/one.csv; $ggn import $tmp/sin3d -o $tmp/y --block 32 -t $tmp/one.csv"

cp -r "$tmp/sin3d" "$tmp/views" && cp -r "$view" "$tmp/views/a_second" && cp -r "$view" "$tmp/views/none"
: >"$view/preview-256.png" && rm "$tmp"/views/none/*
$ggn import "$tmp/sin3d" -o "$tmp/littered" --block 32 >"$tmp/out" 2>"$tmp/err" && diff -r "$d" "$tmp/littered/p3d_toy-view0_part6" -x labels.json >>"$tmp/err"
check "import: what is called otherwise is left where it is" $?
cp "$tmp/views/a_second/p3d_toy-view0_00020.png" "$tmp/views/a_second/p3d_toy-view0_20.png"
fails "import: of several views one with two pictures of a level" "a_second: two images for 20 spp, 'p3d_toy-view0_00020.png' and 'p3d_toy-view0_20.png'" \
    $ggn import "$tmp/views" -o "$tmp/z" --block 32
[ ! -e "$tmp/z" ]
check "  …nothing is imported" $?
mv "$tmp/views/a_second/p3d_toy-view0_20.png" "$tmp/views/none/p3d_toy-view0_20.png"
fails "import: of several views one of one level" "none: 1 levels" $ggn import "$tmp/views" -o "$tmp/z" --block 32
rm "$view/preview-256.png"

$ggn evaluate -d "$tmp/data" --json >"$tmp/out" 2>"$tmp/err" && grep -q '"labels":.*"human"' "$tmp/out" && grep -q '"-spp"' "$tmp/out" &&
    ! grep -q halfbuf "$tmp/out"
check "evaluate without recorded statistics" $?
tr -d '\t\n ' <"$tmp/out" | grep -q '"stops":\[{"scene":"p3d_toy","view":"p3d_toy-view0_part6","block":0,"threshold":90,"censored":false,"spp":{"-spp":[0-9]'
check "  …with the stops of every block" $?
$ggn evaluate -d "$tmp/data" -o "$tmp/report" >"$tmp/out" 2>"$tmp/err" && [ -s "$tmp/report/figures.json" ] &&
    [ -s "$tmp/report/train-stops-spp.csv" ] && [ "$(find "$tmp/report" -name '.tmp*' | wc -l)" -eq 0 ] && grep -q '^constant' "$tmp/out"
check "evaluate: table, figures and stops" $?
fails "evaluate: window longer than the levels" 'a window needs 9' $ggn evaluate -d "$tmp/data" -w 9
fails "evaluate: no model file" 'none.ggn: ' $ggn evaluate -d "$tmp/data" -m "$tmp/none.ggn"
fails "evaluate: not a model" 'human.csv' $ggn evaluate -d "$tmp/data" -m "$tmp/human.csv"

cp "$d/labels.json" "$tmp/people.json"
fails "label: people's thresholds stay" "labels.json: thresholds of people would be lost; ggn label --replace-human" $ggn label --source levels "$tmp/data"
$ggn label "$tmp/data" --human "$tmp/human.csv" >"$tmp/out" 2>"$tmp/err" && cmp -s "$d/labels.json" "$tmp/people.json"
check "label --human: the thresholds that are there are the same labels" $?
printf 'p3d_toy-view0_part6;99.999999999999986;33.333333333333336\n' >"$tmp/digits.csv"
$ggn label "$tmp/data" --human "$tmp/digits.csv" --replace-human >"$tmp/out" 2>"$tmp/err" && $ggn label "$tmp/data" --human "$tmp/digits.csv" >>"$tmp/out" 2>"$tmp/err" &&
    $ggn label "$tmp/data" --human "$tmp/human.csv" --replace-human >>"$tmp/out" 2>"$tmp/err"
check "  …with digits that a file does not keep" $?
printf 'p3d_toy-view0_part6;90;161;\n' >"$tmp/other.csv"
fails "label --human: other people's too" "thresholds of people would be lost" $ggn label "$tmp/data" --human "$tmp/other.csv"
fails "import: so does it" "thresholds of people would be lost" $ggn import "$tmp/sin3d" -o "$tmp/data" --block 32 -t "$tmp/other.csv"
cmp -s "$d/labels.json" "$tmp/people.json"
check "  …and they are what they were" $?
fails "baseline: nothing is written into the data" "labels.json: this is inside its data, " $ggn baseline attributes -d "$tmp/data" -o "$d/labels.json"
fails "cost: nor by this" "labels.json: this is inside its data, " $ggn cost -d "$tmp/data" -o "$d/labels.json"
fails "evaluate: nor a folder" "figures: this is inside its data, " $ggn evaluate -d "$tmp/data" -o "$tmp/data/figures"
fails "evaluate: nor beside the labels" "this is inside its data, " $ggn evaluate -d "$tmp/data" -o "$d/"
fails "reconstruct: nor a picture" "seen.png: this is inside its data, " $ggn reconstruct "$d" -o "$d/seen.png"
fails "label --calibrate: nor parameters" "labels.json: this is inside its data, " $ggn label "$tmp/data" --calibrate "$tmp/human.csv" -o "$d/labels.json"
fails "label --calibrate: nor onto what it reads" "this is an input" $ggn label "$tmp/data" --calibrate "$tmp/human.csv" -o "$tmp/human.csv"
fails "reconstruct: two pictures, one name" "--reference .*/none.png: the same file as --output" $ggn reconstruct "$d" -o "$tmp/./none.png" -r "$tmp/none.png"
fails "import: a view into itself" "inside its data" $ggn import "$view" -o "$view" --block 32
fails "import: a view onto itself" "this is the view itself" $ggn import "$view" -o "$tmp/sin3d" --block 32
cmp -s "$d/labels.json" "$tmp/people.json" && [ ! -e "$tmp/none.png" ] && [ ! -e "$tmp/data/figures" ]
check "  …and nothing has changed" $?

$ggn label --source levels --replace-human "$tmp/data" >"$tmp/out" 2>"$tmp/err" && grep -q 'by the model observer, 2 censored at 267 spp; the reference is the last level itself$' "$tmp/out" && grep -q '"source":.*"observer"' "$d/labels.json" &&
    ! grep -q human "$d/labels.json"
check "observer labels are not called human" $?
$ggn label "$tmp/data" --human "$tmp/human.csv" >"$tmp/out" 2>"$tmp/err" && grep -q '"threshold":.*90' "$d/labels.json"
check "label --human" $?
cp "$d/labels.json" "$tmp/a.json"
$ggn label "$tmp/data" --human "$tmp/human.csv" -t 1 >"$tmp/out" 2>"$tmp/err" && cmp -s "$d/labels.json" "$tmp/a.json"
check "labels are the same bytes again" $?
fails "label --human: unknown view" 'no thresholds for' $ggn label "$tmp/data" --human "$tmp/human.csv" --view other
fails "label --check without half buffers" 'no full level' $ggn label "$tmp/data" --check
fails "label without half buffers" 'use --source levels' $ggn label "$tmp/data" --replace-human
fails "label --calibrate with one view" 'at least 2 views' $ggn label "$tmp/data" --calibrate "$tmp/human.csv"
fails "label: bad observer" 'level or spread' sh -c "echo '{}' >$tmp/o.json; $ggn label $tmp/data -O $tmp/o.json"

$ggn reconstruct "$d" -o "$tmp/r.png" -r "$tmp/ref.png" --json >"$tmp/out" 2>"$tmp/err" && grep -q '"mean_spp": 130.00' "$tmp/out" && [ -s "$tmp/r.png" ]
check "reconstruct at the labels (100 and 160)" $?
$ggn flip "$tmp/ref.png" "$tmp/r.png" --json >"$tmp/flip" 2>"$tmp/err" && [ "$(sed 's/.*"mean": \([0-9.]*\).*/\1/' "$tmp/flip")" = "$(sed 's/.*"flip_mean": \([0-9.]*\).*/\1/' "$tmp/out")" ]
check "its FLIP is that of ggn flip" $?
# a level itself, and the next above: 100 and 40 of 20, 40, …, 160
printf 'p3d_toy-view0_part6;100;30;\n' >"$tmp/stops.csv"
$ggn reconstruct "$d" -o "$tmp/r2.png" -s "$tmp/stops.csv" --json >"$tmp/out" 2>"$tmp/err" && grep -q '"mean_spp": 70.00' "$tmp/out" &&
    oiiotool "$view/p3d_toy-view0_00100.png" --cut 32x32+0+0 "$view/p3d_toy-view0_00040.png" --cut 32x32+32+0 --origin +0+0 \
        --mosaic 2x1 "$tmp/r2.png" --fail 0 --warn 0 --diff >"$tmp/err" 2>&1
check "reconstruct takes the first level that has as many samples, pixel for pixel" $?
fails "reconstruct: stops of smaller blocks" "many.csv: stops of 20 blocks, $d has " sh -c "printf 'a;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1;1\n' >$tmp/many.csv; $ggn reconstruct $d -o $tmp/r.png -s $tmp/many.csv"
fails "reconstruct: several views" 'view NAME' sh -c "printf 'a;1;2;\nb;1;2;\n' >$tmp/two.csv; $ggn reconstruct $d -o $tmp/r.png -s $tmp/two.csv"

# Damage: each is one clear line and exit 2.
cp -r "$tmp/data" "$tmp/bad"
b=$tmp/bad/p3d_toy-view0_part6
head -c 2000 "$d/block-00001.lseq" >"$b/block-00001.lseq"
fails "truncated block" 'truncated' $ggn evaluate -d "$tmp/bad"
cp "$d/block-00000.lseq" "$b/block-00001.lseq"
fails "wrong block under a name" 'not the file that the manifest lists' $ggn evaluate -d "$tmp/bad"
sed 's/"levels":.*\[20/"levels": [10, 20/' "$d/manifest.json" >"$b/manifest.json"
cp "$d/block-00001.lseq" "$b/"
fails "a level that the files lack" '10 spp is missing' $ggn evaluate -d "$tmp/bad"
echo '{"train": 3}' >"$tmp/bad/split.json"
cp "$d/manifest.json" "$b/"
fails "a split that is no list" 'split.json: train: expected a list of scenes' $ggn evaluate -d "$tmp/bad"
echo '{"train": ["p3d_toy-view0_part6"]}' >"$tmp/bad/split.json"
fails "a split of folders" "split.json: train: 'p3d_toy-view0_part6' is a folder, whose scene is 'p3d_toy'" $ggn evaluate -d "$tmp/bad"
echo '{"train": ["p3d_toy"]}' >"$tmp/bad/split.json"
rm "$b/labels.json"
fails "no labels" 'run ggn label first' $ggn evaluate -d "$tmp/bad"
if [ -w /dev/full ]; then
    fails "disk full" 'write' sh -c "exec $ggn evaluate -d $tmp/data >/dev/full"
fi
echo "1..$n"
exit $bad
