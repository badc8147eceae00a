#!/bin/sh
# The command line of lull-render: every option, every error, interrupting and going on.
. "$(dirname "$0")/lull_render_setup"
layers() { oiiotool --info -v "$1" | grep -F 'channel list' | grep -qF "$2"; }
same() { cmp "$1" "$2"; }
differ() { ! cmp -s "$1" "$2"; }
number() { sed -n "s/.*\"$2\":[[:space:]]*\([-0-9.e+]*\).*/\1/p" "$1"; } # number REPORT KEY: every value of that key, one a line
total() { number "$1" "$2" | awk '{n += $1} END {print n + 0}'; }
holds() { awk "BEGIN { exit !($1) }" </dev/null; } # holds 'ARITHMETIC'
spp_of() { tr ';' '\n' <"$1" | sed -n '2,$p' | grep . | sort -n | uniq | tr '\n' ' '; }

# --- help and lists ---
t "--help" sh -c "$P --help | grep -q -- --time-budget"
t "--usage" sh -c "$P --usage | grep -q -- --criterion"
t "--version" sh -c "$P --version | grep -q 1.0"
t "--list-criteria succeeds" "$P" --list-criteria
"$P" --list-criteria 2>said >listed
t "  …and says nothing besides" test ! -s said
mkdir broken && echo text >broken/bad.so
LULL_PLUGIN_PATH=$PWD/broken "$P" --list-criteria 2>said >listed
t "  …but of a library that it skips" sh -c "[ \$(wc -l <said) -eq 1 ] && grep -q 'skipped: .*bad.so' said"
t "--list-criteria names criteria and parameters" sh -c "$P --list-criteria | grep -q '^halfbuf ' && $P --list-criteria | grep -q -- '-p threshold='"

t "--visible is a share that observer, denoised, ggn and the three baselines know" sh -c "[ \"\$($P --list-criteria | grep -c -e '-p visible=')\" = 6 ]"
t "--visible sets the parameter" sh -c "$P $scene -q -c observer --visible 0.5 --spp 32 --report visible.json && grep -q '\"visible\":.*\"0.5\"' visible.json"

# --- errors: one line, exit 2, nothing left behind ---
refused "a scene file is needed"
refused "nowhere.pbrt: " nowhere.pbrt -q
refused "unknown option" "$scene" --nonsense
refused "a value is needed" "$scene" --seed
refused "one argument too many" "$scene" "$scene"
printf 'Camera "perspective"\nWorldBegin\nShape "sphere" "float radius" [oops]\n' >broken.pbrt
refused "broken.pbrt:3" broken.pbrt -q -o a.exr
refused "--block 0" "$scene" --block 0
refused "--block 3y4" "$scene" --block 3y4
refused "--spp 0" "$scene" --spp 0
refused "--spp 1e3" "$scene" --spp 1e3
refused "--spp-min" "$scene" --spp-min -4
refused "--spp-max" "$scene" --spp-max 99999999999
refused "is above --spp-max" "$scene" --spp-min 100 --spp-max 50
refused "leave out --spp-min" "$scene" --spp 10 --spp-max 50
refused "--time-budget" "$scene" --time-budget soon
refused "--time-budget" "$scene" --time-budget -1
refused "--time-budget" "$scene" --time-budget nan
refused "--max-check-overhead" "$scene" --max-check-overhead 2
refused "--max-seam" "$scene" --max-seam 0.5
refused "--size" "$scene" --size 100
refused "--size" "$scene" --size 0x100
refused "--size" "$scene" --size 100x100000000
refused "--crop" "$scene" --crop 1,2,3
refused "X0 < X1" "$scene" --crop 5,5,5,9
refused "64x48" "$scene" --crop 0,0,100,10 -q
refused "--sampler" "$scene" --sampler halton
refused "--integrator" "$scene" --integrator magic
refused "--max-depth" "$scene" --max-depth deep
refused "--filter" "$scene" --filter sinc
refused "--filter" "$scene" --filter box:0
refused "--seed" "$scene" --seed -1
refused "--effects" "$scene" --effects none
refused "--threads" "$scene" --threads 0
refused "ends in .exr" "$scene" -o a.png
refused "ends in .png" "$scene" --preview a.exr
refused "ends in .json" "$scene" --report a.txt
refused ".png or .csv" "$scene" --stop-map a.exr
refused "--aov" "$scene" --aov albedo,beauty
refused "cannot write there" "$scene" -q -o nowhere/a.exr
refused "cannot write there" "$scene" -q --report nowhere/a.json
refused "cannot write there" "$scene" -q --stop-map nowhere/a.csv
refused "cannot write there" "$scene" -q --checkpoint nowhere/a.ckp
refused "nosuch" "$scene" -q -c nosuch
refused "nosuch.so" "$scene" -q -c ./nosuch.so
refused "'nope'" "$scene" -q -c halfbuf -p nope=1
refused "threshold" "$scene" -q -c halfbuf -p threshold=-1
refused "KEY=VALUE" "$scene" -p threshold
refused "between 0 and 1" "$scene" -q -c observer --visible 1.5
refused "halfbuf: no parameter 'visible'" "$scene" -q -c halfbuf --visible 0.3
refused "no criterion is used" "$scene" --spp 4 -p threshold=1
refused "--resume needs" "$scene" --resume
refused "--checkpoint-every" "$scene" --checkpoint-every x
refused "--debug-path" "$scene" --debug-path 1,2
refused "--debug-path 64,0,0: the image has 64x48 pixels" "$scene" -q --debug-path 64,0,0
refused "--debug-path 0,48,0: the image has 64x48 pixels" "$scene" -q --debug-path 0,48,0
t "--debug-path: the last pixel" "$P" "$scene" -q --debug-path 63,47,0
refused "belong to --sequence" "$scene" --levels linear:1:2:1
refused "goes with neither" "$scene" --sequence s --spp 4
refused "--levels" "$scene" -q --sequence s --levels cubic:1:2:3
refused "--blocks" "$scene" -q --sequence s --blocks 99
refused "square blocks" "$scene" -q --sequence s --block 16x8

sed 's/^WorldBegin/Integrator "path" "bool regularize" true\n&/' "$scene" >strange.pbrt
t "what is not rendered as written is told" sh -c "$P strange.pbrt --spp 1 -o strange.exr 2>&1 | grep -q 'strange.pbrt:.*regularize is ignored' && rm strange.exr"
refused "regularize is ignored" strange.pbrt --strict -q -o strange.exr

# --- what is written ---
common="$scene -q --block 16 -c fixed -p spp=40 --spp-min 8 --reproducible"
t "all outputs at once" "$P" $common -o a.exr --preview a.png --stop-map a.csv --stop-map s.png --report r.json --aov albedo,normal,depth
t "EXR layers by name" layers a.exr "R, G, B, albedo.R, albedo.G, albedo.B, depth.Z"
t "EXR layers of Lull" sh -c "oiiotool --info -v a.exr | grep -q 'lull.error.V, lull.p_noisy.V, lull.reason.V, lull.spp.V'"
t "EXR header by exrheader" sh -c "exrheader a.exr | grep -q 'lull:criterion.*fixed.*spp=40'"
t "EXR has no NaN in RGB" sh -c "oiiotool a.exr --ch R,G,B --printstats | grep -q 'NanCount: 0 0 0'"
t "preview is 64x48 RGB" sh -c "oiiotool --info a.png | grep -q '64 x *48, 3 channel'"
t "stop map is a picture" sh -c "oiiotool --info s.png | grep -q '3 channel, uint8 png'"
t "table: every block at 40" test "$(cat a.csv)" = "room;40;40;40;40;40;40;40;40;40;40;40;40;"
t "report is JSON with totals" sh -c "grep -q '\"samples\":[[:space:]]*122880,' r.json && grep -q '\"reason\":[[:space:]]*\"criterion\"' r.json"
t "-q is silent" test -z "$("$P" $common -o q.exr 2>&1)"
t "a summary without -q" sh -c "$P $scene --spp 2 -o q.exr 2>&1 | grep -q 'spp on average'"
t "default output is named after the scene" sh -c "$P $scene -q --spp 1 && test -s room.exr"
t "no temporaries left" test -z "$(ls -A | grep tmp)"

# --- what decides the image ---
for threads in 1 2 3 8; do "$P" $common --threads $threads -o t$threads.exr --report t$threads.json; done
t "--threads are as many" test "$(number t1.json threads) $(number t3.json threads) $(number t8.json threads)" = "1 3 8"
t "same bytes for 1 and 2 threads" same t1.exr t2.exr
t "same bytes for 1 and 3 threads" same t1.exr t3.exr
t "same bytes for 1 and 8 threads" same t1.exr t8.exr
"$P" $common --order-seed 5 -o order.exr
t "same bytes for another order of blocks" same t1.exr order.exr
"$P" "$scene" -q --spp 8 -o plain.exr --reproducible --report plain.json
"$P" "$scene" -q --spp 8 -o general.exr --reproducible --effects all --report general.json
t "--effects all: another kernel" sh -c "grep -q '\"kernel\":[[:space:]]*\"all\"' general.json && ! grep -q '\"kernel\":[[:space:]]*\"all\"' plain.json"
t "--effects all: the same pixels" sh -c "oiiotool --fail 0 --warn 0 plain.exr general.exr --diff"
"$P" "$scene" -q --spp 8 --seed 2 -o other.exr
t "another seed is another image" sh -c "! oiiotool --fail 0 plain.exr other.exr --diff"
"$P" "$scene" -q --spp 8 --sampler sobol -o sobol.exr
t "--sampler sobol is another image" sh -c "! oiiotool --fail 0 plain.exr sobol.exr --diff"
"$P" "$scene" -q --spp 8 --max-depth 1 -o shallow.exr
t "--max-depth 1 is another image" sh -c "! oiiotool --fail 0 plain.exr shallow.exr --diff"
"$P" "$scene" -q --spp 8 --filter triangle:2 -o soft.exr
t "--filter is another image" sh -c "! oiiotool --fail 0 plain.exr soft.exr --diff"
"$P" "$scene" -q --spp 400 -o mis.exr --size 16x12
"$P" "$scene" -q --spp 4000 -o brute.exr --size 16x12 --integrator bsdf-only
t "--integrator bsdf-only has the same mean" sh -c "a=\$(oiiotool mis.exr --ch R --printstats | awk '/Avg/{print \$3}'); b=\$(oiiotool brute.exr --ch R --printstats | awk '/Avg/{print \$3}'); echo \$a \$b | awk '{exit !(\$1 > 0.01 && \$1/\$2 > 0.93 && \$1/\$2 < 1.07)}'"
t "--size" sh -c "oiiotool --info brute.exr | grep -q '16 x *12'"
"$P" $common --crop 20,10,40,30 -o crop.exr --stop-map crop.csv
t "--crop keeps the pixels" sh -c "oiiotool t1.exr --ch R,G,B,lull.spp.V --cut 20x20+20+10 --origin +0+0 -o c1.exr && oiiotool crop.exr --ch R,G,B,lull.spp.V --cut 20x20+20+10 --origin +0+0 -o c2.exr && oiiotool --fail 0 --warn 0 c1.exr c2.exr --diff"
t "--crop keeps the thresholds" test "$(spp_of crop.csv)" = "40 "
half="$scene -q --block 16 -c halfbuf -p threshold=0.02 --spp-max 600"
"$P" $half --stop-map whole.csv
"$P" $half --stop-map seamless.csv --max-seam 1.5
"$P" $half --stop-map part.csv --crop 16,16,32,32
t "halfbuf: blocks differ" test "$(spp_of whole.csv | wc -w)" -gt 1
t "--crop decides as the whole image does" test "$(cut -d';' -f2 part.csv)" = "$(cut -d';' -f7 whole.csv)"
# steep FILE: how many of the 4x3 blocks have a neighbour with more than 1.5 times their samples
steep() { awk -F';' '{ for (i = 0; i < 12; i++) for (k = 0; k < 12; k++) { d = (i % 4 - k % 4) ^ 2 + (int(i / 4) - int(k / 4)) ^ 2
    if (d == 1 && $(i + 2) > 1.5 * $(k + 2)) n++ } print n + 0 }' "$1"; }
t "--max-seam evens out what was uneven" test "$(steep whole.csv)" -gt 0 -a "$(steep seamless.csv)" -eq 0
"$P" "$scene" -q --block 16 -c fixed -p spp=3 --spp-min 8 --stop-map least.csv
t "--spp-min: no block has less" test "$(spp_of least.csv)" = "8 "
"$P" "$scene" -q --block 32x16 --spp 1 --stop-map blocks.csv
t "--block: 2x3 blocks of 32x16" test "$(cat blocks.csv)" = "room;1;1;1;1;1;1;"
"$P" "$scene" -q --block 16 -c null --spp-max 9 --spp-min 3 --stop-map null.csv --report null.json
t "--spp-max ends null" test "$(spp_of null.csv)" = "9 "
t "the reason is spp-max" grep -q '"spp-max"' null.json
"$P" "$scene" -q --spp 5 --stop-map five.csv --report five.json
t "--spp is uniform" test "$(spp_of five.csv)" = "5 "
t "--spp without criterion: null in the report" grep -q '"criterion":[[:space:]]*null' five.json
"$P" "$scene" -q --spp 5 -c halfbuf --report asked.json
t "--spp asks a criterion once" sh -c "grep -q '\"checks\":[[:space:]]*1,' asked.json"
mkdir plugins && cp "$(dirname "$P")/../lib/lull/fixed.so" plugins/mine.so
t "a criterion by path" "$P" "$scene" -q -c ./plugins/mine.so -p spp=3 --spp-min 1 --stop-map path.csv
t "  …and it decided" test "$(spp_of path.csv)" = "3 "
t "a criterion by path and id" "$P" "$scene" -q -c plugins/mine.so:fixed -p spp=3 --spp-min 1 --stop-map path.csv
t "LULL_PLUGIN_PATH" env LULL_PLUGIN_PATH="$dir/plugins" "$P" "$scene" -q -c mine:fixed -p spp=3 --spp-min 1 --stop-map path.csv
# Checks that may take next to nothing: the first, before which none took anything, and the one at the end.
ask="$scene -q --block 16 -c observer --visible 0.001 --spp-min 4 --spp-max 100"
"$P" $ask --report many.json && "$P" $ask --max-check-overhead 1e-9 --report few.json && "$P" $ask --max-check-overhead 1 --report all.json
t "--max-check-overhead leaves checks out" test "$(total few.json checks)" -le 24 -a "$(total many.json checks)" -ge 48
t "  …and none that the bound allows" test "$(total all.json checks)" -eq "$(total many.json checks)"

# --- looking inside ---
t "--explain tells effects and kernel" sh -c "$P $scene --explain | grep -q '^kernel: '"
t "--explain names the line" sh -c "$P $scene --explain | grep -q 'quadric *on .*room.pbrt:$(grep -n '"sphere"' "$scene" | cut -d: -f1) '"
t "--explain times paths: some take more than 0.02 us" sh -c "$P $scene --explain | awk '/^time: / { n++; good = \$2 > 0.02 && \$(NF - 7) > 0 } END { exit !(n == 1 && good) }'"
t "--explain lists what is off" sh -c "$P $scene --explain | grep -q 'grid-medium *off'"
t "--explain tells what decides" sh -c "$P $scene --explain | grep -q '^criterion: observer '"
t "  …or would of the denoised picture" sh -c "$P $scene --explain --denoise | grep -q '^criterion: denoised '"
t "--explain measures a path" sh -c "$P $scene --explain | grep -q '^time: [0-9.]* us per path'"
t "--debug-path tells the path" sh -c "test \$($P $scene --debug-path 30,20,1 | wc -l) -ge 2"

# --- time, interrupt, checkpoint ---
long="$scene -q --size 96x64 --block 32 -c null --spp-min 4 --spp-max 300 --reproducible --threads 2"
t "--time-budget" "$P" "$scene" -q -c null --spp-max 100000000 --time-budget 1 --report time.json -o time.exr
t "  …uses its second" holds "$(number time.json render_s) + $(number time.json criterion_s) > 0.8"
t "  …and says so" grep -q '"reason":[[:space:]]*"time"' time.json
"$P" $long -o full.exr
"$P" $(echo "$long" | sed 's/ -q//') --spp-max 100000000 -o int.exr --report int.json --preview int.png \
    --stop-map int.csv 2>int.err &
pid=$!
until [ -s int.err ] || ! kill -0 $pid; do sleep 0.1; done # its progress: from here on it listens
kill -INT $pid
wait $pid
t "SIGINT: exit status 130" test $? -eq 130
t "  …everything is written" test -s int.exr -a -s int.json -a -s int.png -a -s int.csv
t "  …and the report says so" sh -c "grep -q '\"interrupt\"' int.json && grep -q '\"interrupted\":[[:space:]]*true' int.json"
t "stopped by time, with a checkpoint" "$P" $long --time-budget 0.1 --checkpoint c.ckp -o part.exr --report part.json
t "  …before it was done" holds "$(total part.json spp) < 6 * 300"
t "resumed, stopped again" "$P" $long --time-budget 0.2 --checkpoint c.ckp --resume -o part.exr --threads 3
t "resumed and finished" "$P" $long --checkpoint c.ckp --resume -o part.exr
t "the resumed image is the uninterrupted one, byte for byte" same full.exr part.exr
endless="$long --spp-max 100000 --checkpoint endless.ckp -o endless.exr"
"$P" $endless --checkpoint-every 0 --report before.json & pid=$!
until [ -s endless.ckp ] || ! kill -0 $pid; do sleep 0.1; done
kill -INT $pid
wait $pid
t "resumed and stopped at once" "$P" $endless --time-budget 0.0001 --resume --report after.json
t "  …where it was, and not at the beginning" holds "$(total before.json spp) > 0 && $(total after.json spp) >= $(total before.json spp)"
t "--checkpoint-every" "$P" $long --checkpoint d.ckp --checkpoint-every 0.1 -o part.exr
t "  …wrote one" test -s d.ckp
cat >options <<'O'
size=96x64, but this render has size=96x65|--size 96x65
crop=0,0,96,64, but this render has crop=0,0,90,60|--crop 0,0,90,60
block=32x32, but this render has block=16x16|--block 16
aov=0, but this render has aov=|--aov depth
seed=0, but this render has seed=9|--seed 9
sampler=0, but this render has sampler=1|--sampler sobol
integrator=0, but this render has integrator=1|--integrator bsdf-only
filter=2:1.5x1.5:0.5, but this render has filter=0:0.5x0.5:0.5|--filter box
light-selection=hierarchy, but this render has light-selection=power|--light-selection power
max-depth=5, but this render has max-depth=4|--max-depth 4
fov=0, but this render has fov=30|--fov 30
look-at=, but this render has look-at=0 1 3 0 1 0 0 1 0|--look-at "0 1 3 0 1 0 0 1 0"
criterion=null 1.0, but this render has criterion=fixed 1.0|-c fixed
O
while IFS='|' read -r words option; do # every option that makes another image is refused by its name
    eval "refused \"made with \$words\" $long --checkpoint c.ckp --resume -o part2.exr $option"
done <options
rm -f part2.exr
# A finished render goes on, to the bytes of one that was asked for more at once.
more="$scene -q --size 64x48 --block 16 --reproducible --spp-min 4"
for criterion in observer halfbuf; do
    "$P" $more -c $criterion --spp-max 150 -o at_once.exr
    t "$criterion: a finished render leaves its checkpoint" sh -c "rm -f e.ckp; '$P' $more -c $criterion --spp-max 21 --checkpoint e.ckp -o first.exr && test -s e.ckp"
    t "  …and goes on as if asked for more at once" sh -c "'$P' $more -c $criterion --spp-max 150 --checkpoint e.ckp --resume -t 1 -o more.exr --report more.json && cmp at_once.exr more.exr"
    t "  …at its end nothing is rendered" sh -c "'$P' $more -c $criterion --spp-max 150 --checkpoint e.ckp --resume -o again.exr && cmp more.exr again.exr"
    t "  …nor with a lower end" "$P" $more -c $criterion --spp-max 30 --checkpoint e.ckp --resume -o less.exr --report less.json
    t "  …what is there stays" holds "$(total less.json spp) == $(total more.json spp)"
done
same="$scene -q --size 64x48 --block 16 --reproducible --spp"
"$P" $same 40 -o at_once.exr
t "--spp goes on, too" sh -c "'$P' $same 7 --checkpoint u.ckp -o first.exr && '$P' $same 40 --checkpoint u.ckp --resume -o more.exr && cmp at_once.exr more.exr"
dial="$scene -q --size 64x48 --block 32 --reproducible --spp-min 4"
"$P" $dial --spp-max 400 --visible 0.5 --checkpoint v.ckp -o first.exr --report coarse.json
t "another --visible goes on" "$P" $dial --spp-max 400 --visible 0.05 --checkpoint v.ckp --resume -o more.exr --report fine.json
t "  …to more samples" holds "$(total fine.json spp) > $(total coarse.json spp)"
t "  …and so does a coarser one, without one more" "$P" $dial --spp-max 400 --visible 0.9 --checkpoint v.ckp --resume -o more.exr --report after.json
t "  …since it sees nothing any more" holds "$(total fine.json spp) == $(total after.json spp)"
head -c 5000 c.ckp >short.ckp
refused "damaged or cut off" $long --checkpoint short.ckp --resume
cp c.ckp flip.ckp && printf 'X' | dd of=flip.ckp bs=1 seek=3000 conv=notrunc 2>/dev/null
refused "damaged or cut off" $long --checkpoint flip.ckp --resume
cp "$scene" none-such.ckp
refused "not a checkpoint" $long --checkpoint none-such.ckp --resume
refused "none.ckp: " $long --checkpoint none.ckp --resume

# --- the shipped network, when it is there: its history goes through the checkpoint ---
model=$here/../../ggn/models/lull-3.ggn
if [ -f "$model" ]; then
    net="$scene -q --size 200x200 -c ggn -p model=$model --spp-min 4 --spp-max 60 --reproducible"
    "$P" $net -o net.exr
    t "ggn: same bytes for 1 thread and another order" sh -c "$P $net -t 1 --order-seed 4 -o net1.exr && cmp net.exr net1.exr"
    interrupted net.ckp $net -o part.exr
    t "ggn: same bytes after interrupt and resume" sh -c "$P $net --checkpoint net.ckp --resume -o net2.exr && cmp net.exr net2.exr"
else
    n=$((n + 2))
    echo "ok $((n - 1)) - ggn: same bytes for 1 thread and another order # SKIP no ggn/models/lull-3.ggn"
    echo "ok $n - ggn: same bytes after interrupt and resume # SKIP no ggn/models/lull-3.ggn"
fi

# --- progress ---
"$P" "$scene" --size 128x96 -c null --spp-max 100000000 --time-budget 3 -o p.exr 2>progress
t "plain progress lines when not a terminal" grep -q 'blocks active.*Mpaths/s.*ETA' progress
t "  …without control characters" sh -c "! grep -q '[[:cntrl:]]' progress"

# --- sequences ---
seq="$scene -q --block 16 --levels linear:8:32:8 --blocks 0,5-6 --reference-spp 64 -c halfbuf"
t "--sequence" "$P" $seq --sequence seq --name rooms/view4
t "  …manifest" sh -c "grep -q '\"camera\":[[:space:]]*\"view4\"' seq/manifest.json && test \$(ls seq/*.lseq | wc -l) -eq 3"
cp seq/block-00005.lseq five.lseq && rm seq/block-00005.lseq
t "  …goes on where files are missing" "$P" $seq --sequence seq --name rooms/view4
t "  …refuses nothing that is the same" test -s seq/block-00005.lseq
refused "begun with seed=0, but this render has seed=3; use another folder" $seq --sequence seq --name rooms/view4 --seed 3
t "  …no temporaries" test -z "$(ls -A seq | grep tmp)"

echo "1..$n"
exit $bad
