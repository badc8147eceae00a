#!/bin/sh
# Options of ggn by what they do: each changes what it is there to change, measured in what comes out, not in what is repeated of the
# command line.
. "$(dirname "$0")/ggn_setup"
# --- train: other losses, another threshold, other scenes ------------------------------------------------------------------
tiny="--data $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 4 --steps-denoiser 2 --steps 4 --epoch-steps 2 -q --threads 1"
trained() { # trained NAME OPTIONS...: what training came to, without times and without the options that it repeats
    out=$tmp/$1.ggn
    shift
    # shellcheck disable=SC2086
    $ggn train $tiny "$@" --out "$out" 2>"$tmp/err" || return 1
    cut -d, -f1-7 "$out.csv"
    grep -E '"(scale|shift|threshold|consecutive|auc|training_windows)":' "$out.card.json"
}
trained base >"$tmp/base"
check "train" $?
trained again >"$tmp/again" && cmp -s "$tmp/base" "$tmp/again"
check "train twice is the same" $?
changes() { # changes OPTION VALUE
    trained other "$1" "$2" >"$tmp/other" && ! cmp -s "$tmp/base" "$tmp/other"
    check "train $1 $2" $?
}
while read -r option value; do changes "$option" "$value"; done <<'END'
--window 4
--kr 4
--km 4
--kd 5
--crop 40
--batch-denoiser 4
--batch 5
--steps-denoiser 1
--epoch-steps 1
--lr-denoiser 0.01
--lr 0.01
--synthetic 0
--extend 0
--ratio 1.5
--validation-windows 5
--validation scene2
--test scene2
END
row() { grep '^denoiser' "$tmp/$1"; }
# What concerns the judge alone leaves the denoiser's phase as it was, and the other way round.
trained judge --lr 0.01 >"$tmp/judge" && [ "$(row judge)" = "$(row base)" ]
check "the judge's options leave the denoiser alone" $?
trained anew --steps-denoiser 0 >"$tmp/anew"
$ggn train --data $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 4 --steps-denoiser 2 --steps 40 --epoch-steps 2 -q --threads 1 \
    --lr 1e-9 --patience 2 --out "$tmp/patient.ggn" 2>"$tmp/err" && [ "$(grep -c '^judge' "$tmp/patient.ggn.csv")" -lt 20 ]
check "train --patience ends a training that gets nowhere" $?
early() { sed -n 's/.*"early_stop_rate":[^0-9]*\([0-9.]*\).*/\1/p' "$tmp/$1.ggn.card.json"; }
trained rash --early-rate 1 >"$tmp/rash" && [ "$(early base)" = 0 ] && [ "$(early rash)" != 0 ]
check "train --early-rate: none of the validation blocks is stopped early, or some are" $?
trained from --init "$tmp/patient.ggn" --steps-denoiser 0 >"$tmp/from" && ! cmp -s "$tmp/from" "$tmp/anew"
check "train --init begins with what the model has learned" $?

# --- label -----------------------------------------------------------------------------------------------------------------
cp -r $data "$tmp/data"
labelled() { $ggn label "$tmp/data/scene0" "$@" >"$tmp/out" 2>"$tmp/err" && cat "$tmp/data/scene0/labels.json"; }
labelled --spread 0.2 >"$tmp/narrow" && grep -q '"spread":.0.2,' "$tmp/narrow" && labelled >"$tmp/wide" && ! grep -q '"spread":.0.2,' "$tmp/wide"
check "label --spread" $?
thresholds() { grep -o '"threshold":[^,}]*' "$1"; }
thresholds "$tmp/narrow" >"$tmp/a" && thresholds "$tmp/wide" | cmp -s - "$tmp/a"
check "  …leaves the thresholds alone" $?
labelled --source levels >"$tmp/levels" && ! thresholds "$tmp/levels" | cmp -s - "$tmp/a"
check "label --source levels judges something else" $?
# Raw trials of people whose curve has a spread of 0.6 octaves.
python3 - "$tmp/trials.csv" <<'END'
import math, random, sys
r = random.Random(3)
with open(sys.argv[1], "w") as f:
    for trial in range(1600):
        octaves = r.uniform(-3, 3)
        f.write("%d;%g;%d\n" % (trial % 4, 10 * (trial % 4 + 1) * 2 ** octaves, r.random() < 0.5 * math.erfc(octaves / 0.6 / math.sqrt(2))))
END
$ggn label --fit-trials "$tmp/trials.csv" >"$tmp/out" 2>"$tmp/err" && grep -q 'spread 0\.\(5[5-9]\|6[0-5]\) octaves (1600 trials, 4 blocks, 0 lines' "$tmp/out"
check "label --fit-trials finds the spread that the trials were made with" $?

# --- import: levels with a gap ------------------------------------------------------------------------------------------
view=$tmp/sin3d/p3d_toy-view0_part6
mkdir -p "$view"
for level in 20 40 60 100 120; do
    oiiotool --pattern constant:color=.4,.5,.6 32x32 3 -d uint8 -o "$view/p3d_toy-view0_$(printf %05d $level).png" >/dev/null 2>&1
done
$ggn import "$tmp/sin3d" -o "$tmp/imported" --block 16 >"$tmp/out" 2>"$tmp/err"
[ $? -eq 2 ] && grep -q 'allow-gaps' "$tmp/err"
check "import refuses levels with a gap, and says what would take them" $?
$ggn import "$tmp/sin3d" -o "$tmp/imported" --block 16 --allow-gaps >"$tmp/out" 2>"$tmp/err" &&
    tr -d ' \n\t' <"$tmp/imported/p3d_toy-view0_part6/manifest.json" | grep -q '"levels":\[20,40,60,100,120\]'
check "import --allow-gaps" $?
[ "$(find "$tmp/imported" -name 'block-*' | wc -l)" -eq 4 ]
check "import --block: four of 16 pixels" $?
mkdir "$tmp/sin3d/deeper" "$tmp/sin3d/deeper/x"
$ggn import "$tmp/sin3d" -o "$tmp/sin3d-out" --block 16 --allow-gaps >"$tmp/out" 2>"$tmp/err" &&
    [ "$(cat "$tmp/err")" = "ggn import: $tmp/sin3d/deeper: no pictures of a view, left out" ]
check "import says what folder it leaves out" $?
touch "$tmp/sin3d/deeper/00020.png" "$tmp/sin3d/deeper/00040.png"
fails "  …refuses one of pictures that it cannot order" "sin3d/deeper: none of its pictures is called NAME_00020.png" \
    $ggn import "$tmp/sin3d" -o "$tmp/sin3d-out" --block 16 --allow-gaps
mv "$tmp/sin3d/deeper/00020.png" "$tmp/sin3d/over_1.png" && mv "$tmp/sin3d/deeper/00040.png" "$tmp/sin3d/over_2.png"
fails "  …and a folder that is a view and has one" "sin3d: pictures of a view, and a folder of them: $tmp/sin3d/p3d_toy-view0_part6" \
    $ggn import "$tmp/sin3d" -o "$tmp/sin3d-out" --block 16 --allow-gaps

# --- flip -------------------------------------------------------------------------------------------------------------------
oiiotool --pattern constant:color=.5,.5,.5 80x40 3 -d uint8 -o "$tmp/grey.png" \
    --pattern constant:color=0,0,0 40x40 3 --noise:type=gaussian:mean=0:stddev=0.1:seed=2 --origin +40+0 \
    --pattern constant:color=.5,.5,.5 80x40 3 --add --cut 80x40+0+0 -d uint8 -o "$tmp/noisy.png" >/dev/null 2>&1
mean() { $ggn flip "$tmp/grey.png" "$tmp/noisy.png" --json "$@" 2>"$tmp/err" | sed 's/.*"mean": \([0-9.]*\).*/\1/'; }
echo "$(mean) $(mean --ppd 20) $(mean --ppd 200)" | awk '{exit !($2 > $1 && $1 > $3 && $3 > 0)}'
check "flip --ppd: from farther away less is seen" $?
$ggn flip "$tmp/grey.png" "$tmp/noisy.png" -o "$tmp/map.png" >"$tmp/out" 2>"$tmp/err"
light() { oiiotool "$tmp/map.png" --cut "$1" --printstats | awk '/Stats Avg/ {print $3 + $4 + $5; exit}'; }
oiiotool --info "$tmp/map.png" | grep -q '80 x *40, 3 channel' && echo "$(light 30x30+0+5) $(light 30x30+45+5)" | awk '{exit !($1 < 0.03 && $2 > 0.2)}'
check "flip --output: black where the images are equal, light where they are not" $?

# 0.5 against 0.6 in linear light: relMSE .01 / .26; an error of the codes of a constant pair leaves SSIM its means: (2ab + C1) / (a^2 + b^2 + C1).
oiiotool --pattern constant:color=.5,.5,.5 64x64 3 -d float -o "$tmp/r.exr" --pattern constant:color=.6,.6,.6 64x64 3 -d float -o "$tmp/x.exr"
$ggn flip "$tmp/r.exr" "$tmp/x.exr" --json >"$tmp/out" 2>"$tmp/err"
sed 's/.*"ssim": \([0-9.]*\), "relmse": \([0-9.]*\).*/\1 \2/' "$tmp/out" |
    awk '{a = 188 / 255; b = 203 / 255; s = (2 * a * b + 1e-4) / (a * a + b * b + 1e-4); exit !($1 - s < 2e-3 && s - $1 < 2e-3 && $2 - .01 / .26 < 1e-5 && .01 / .26 - $2 < 1e-5)}'
check "flip: SSIM and relMSE of two even pictures" $?

# --- compare ------------------------------------------------------------------------------------------------------------------
printf 'a;100;200;400;800;\n' >"$tmp/t.csv"
printf 'a;100;400;400;900;\n' >"$tmp/m.csv"
$ggn compare "$tmp/t.csv" "$tmp/m.csv" --json >"$tmp/out" 2>"$tmp/err" && grep -q '"mae_below_cap": 75' "$tmp/out"
check "compare: the cap is far away" $?
$ggn compare "$tmp/t.csv" "$tmp/m.csv" --cap 800 --json >"$tmp/out" 2>"$tmp/err" && grep -q '"mae_below_cap": 66.6' "$tmp/out"
check "compare --cap leaves out what is at the cap" $?

# --- evaluate -----------------------------------------------------------------------------------------------------------------
figures() { $ggn evaluate -d $data --no-quality --json "$@" 2>"$tmp/err" | sed '/"early_rate_tuned_for"/d; /"window":/d'; }
figures -m "$tmp/base.ggn" >"$tmp/figures" && [ -s "$tmp/figures" ]
check "evaluate" $?
for option in "--early 0.9" "--ratio 2" "--recorded" "--visible 0.9" "--retune" "-p first-spp=100"; do
    # shellcheck disable=SC2086
    figures -m "$tmp/base.ggn" $option >"$tmp/other" && ! cmp -s "$tmp/figures" "$tmp/other"
    check "evaluate $option" $?
done
figures -m "$tmp/base.ggn" --visible 0.9 >"$tmp/once" && figures -m "$tmp/base.ggn" --visible 0.9 -p passes=9 >"$tmp/other" && ! cmp -s "$tmp/once" "$tmp/other"
check "evaluate -p passes=9" $?
figures >"$tmp/figures" && figures -w 3 >"$tmp/other" && ! cmp -s "$tmp/figures" "$tmp/other"
check "evaluate --window, where no model says" $?

# --- baseline ------------------------------------------------------------------------------------------------------------------
based() { $ggn baseline "$1" -d $data --epochs 1 --ratio 1.3 --threads 1 -o "$tmp/$2" $3 >"$tmp/out" 2>"$tmp/err"; }
based svd-entropy b.ggn "" && based svd-entropy c.ggn "--window 7" && ! cmp -s "$tmp/b.ggn" "$tmp/c.ggn"
check "baseline --window" $?
fails "evaluate: a baseline of longer windows" 'c.ggn: it judges 7 images, windows here have 6 (ggn evaluate --window)$' $ggn evaluate -d $data --baseline "$tmp/c.ggn"
fails "cost: a baseline of longer windows" 'c.ggn: it judges 7 images, windows here have 6 (ggn evaluate --window)$' $ggn cost -d $data --split train --baseline "$tmp/c.ggn"
based attributes b.ggn "" && based attributes c.ggn "--early 0.9" && ! cmp -s "$tmp/b.ggn" "$tmp/c.ggn"
check "baseline --early" $?
based attributes b.ggn "" && based attributes c.ggn "--ratio 1.5" && ! cmp -s "$tmp/b.ggn" "$tmp/c.ggn"
check "baseline --ratio" $?
echo "1..$n"
exit $bad
