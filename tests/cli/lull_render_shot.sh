#!/bin/sh
# lull-render --frames, --camera-path, --plan-shot, --shot-table: frames by name, seeds, going on, tables, refusals.
. "$(dirname "$0")/lull_render_setup"
small="-q --size 48x32 --block 16 --reproducible"
fails() { ! "$@"; }
made() { [ "$(ls "$@" 2>/dev/null | wc -l)" -eq $# ]; }

# --- frames ---
cp "$scene" s_0001.pbrt
sed 's/"float fov" 45/"float fov" 50/' "$scene" >s_0002.pbrt
sed 's/"float fov" 45/"float fov" 55/' "$scene" >s_0003.pbrt
t "frames of numbered scenes" "$P" s_%04d.pbrt --frames 1-3 $small --spp 4 -o f_%03d.exr --stop-map m_%d.csv --preview p%02d.png --html h%d.html --report r%d.json
t "  …each with its files" made f_001.exr f_002.exr f_003.exr m_1.csv m_2.csv m_3.csv p01.png p02.png p03.png h1.html h2.html h3.html r1.json r2.json r3.json
"$P" s_0002.pbrt $small --spp 4 -o alone.exr --frames 2
t "  …and the bytes of that frame alone" cmp alone.exr f_002.exr
touch -d 2001-01-01 f_001.exr f_003.exr
rm f_002.exr
"$P" s_%04d.pbrt --frames 1-3 $small --spp 8 -o f_%03d.exr
t "what is there is left" test f_001.exr -ot s_0001.pbrt -a f_003.exr -ot s_0001.pbrt -a f_002.exr -nt s_0001.pbrt

head -c 3000 f_003.exr >part.exr && mv part.exr f_003.exr # as a copy that was broken off
: >f_001.exr
"$P" s_%04d.pbrt --frames 1-3 $small --spp 4 -o f_%03d.exr
"$P" s_0003.pbrt --frames 3 $small --spp 4 -o third.exr
t "  …but not what is empty or cut short" sh -c "exrheader f_001.exr && cmp third.exr f_003.exr"
rm f_002.exr
: >k_2
t "an empty checkpoint is none" "$P" s_%04d.pbrt --frames 2 $small --spp 4 -o f_%03d.exr --checkpoint k_%d
t "  …and goes when its frame is done" test -s f_002.exr -a ! -e k_2

# --- seeds ---
"$P" "$scene" --frames 1-2 $small --spp 4 -o fresh_%d.exr
"$P" "$scene" --frames 1-2 $small --spp 4 -o fixed_%d.exr --frame-seed fixed
"$P" "$scene" $small --spp 4 -o one.exr
t "each frame has noise of its own" fails oiiotool --fail 0 --warn 0 fresh_1.exr fresh_2.exr --diff
t "--frame-seed fixed: the seed of the command line" cmp fixed_1.exr fixed_2.exr
t "  …as without frames" cmp fixed_1.exr one.exr

"$P" "$scene" --frames 1-16 $small --spp 16 -o n_%d.exr
"$P" "$scene" $small --spp 6400 --seed 9 -o truth.exr
off() { # off IMAGE...: mean square of what each is off the truth
    for f in "$@"; do oiiotool --fail 0 --warn 0 truth.exr --ch R,G,B "$f" --ch R,G,B --diff; done | awk '/RMS error/ { sum += $4 * $4; n++ } END { print sum / n }'
}
for k in 1 5 9 13; do oiiotool $(seq -f n_%g.exr $k $((k + 3))) --add --add --add --mulc 0.25 -o mean_$k.exr; done
t "  …so that the mean of four frames of a still scene has a quarter of the variance" awk "BEGIN { r = $(off mean_*.exr) / $(off n_*.exr); exit !(r > 0.19 && r < 0.32) }"
"$P" "$scene" --frames 2 $small --spp 16 -o again_%d.exr
t "  …and a frame has the same noise each time" cmp again_2.exr n_2.exr

# --- the camera's path ---
cat >path.csv <<'CSV'
frame;eye;at;up;fov
1;0 1 3.4;0 1 0;0 1 0;
2;0.5 1 3.4;0 1 0;0 1 0;60
5;1 1 3.4;0 1 0;0 1 0;60
CSV
"$P" "$scene" --camera-path path.csv $small --spp 4 -o c_%d.exr --frame-seed fixed
"$P" "$scene" --look-at "0.5 1 3.4  0 1 0  0 1 0" --fov 60 $small --spp 4 -o look.exr
t "a path of the camera" made c_1.exr c_2.exr c_5.exr
t "  …is --look-at and --fov for each frame" cmp c_2.exr look.exr
t "  …or the scene's fov" cmp c_1.exr one.exr

# --- tables ---
"$P" "$scene" --camera-path path.csv $small --plan-shot T.csv --plan-every 2 --quote-pilot 32 --spp-max 400 >price
t "--plan-shot says what all frames will cost" grep -q '^3 frames of 6 blocks, by 2 pilots: ' price
"$P" "$scene" --camera-path path.csv $small --plan-shot E.csv --plan-every 2 --quote-pilot 8 --spp-max 400 >early
t "  …and which pilots are not to be believed" grep -q '^2 of 2 pilots have met too little: what their frames need is not known' early
t "  …and writes a line for each" test "$(grep -c '^[125];' T.csv)" -eq 3
"$P" "$scene" --camera-path path.csv $small --plan-shot D.csv --plan-every 1 --quote-pilot 16 --spp-max 400 >/dev/null
t "  …that fade from frame to frame, by a quarter of an octave" awk -F';' 'NR > 2 { for (i = 2; i <= NF; i++) { s[NR, i] = $i; if (NR > 3) { least = 2 ^ -0.25 * s[NR - 1, i]; if ($i < least || 2 ^ 0.25 * s[NR - 1, i] < $i - 2) exit 1; if ($i != s[NR - 1, i]) other = 1 } } } END { exit !other }' D.csv
awk 'BEGIN { FS = OFS = ";" } NR > 2 { for (i = 2; i <= NF; i++) $i = 5 * i + NR } { print }' T.csv >own.csv
"$P" "$scene" --camera-path path.csv $small --shot-table own.csv -o a_%d.exr --stop-map a_%d.csv -t 1
t "--shot-table gives every block its samples" test "$(cut -d';' -f2- a_2.csv)" = "$(sed -n 's/^2;//p' own.csv);"
"$P" "$scene" --camera-path path.csv $small --shot-table own.csv -o b_%d.exr -t 3 --frames 2,5
t "  …the same bytes frame by frame and with other threads" cmp a_5.exr b_5.exr

# --- decisions for a moving picture: -p fps ---
mean() { awk -F';' '{ for (i = 2; i < NF; i++) { sum += $i; n++ } } END { print sum / n }' "$1"; }
share() { awk -v a="$1" -v b="$2" -v low="$3" -v high="$4" 'BEGIN { exit !(a / b > low && a / b < high) }'; }
quoted() { "$P" "$scene" $big --quote --json "$@" | python3 -c 'import json, sys; print([r["spp_mean"]["expected"] for r in json.load(sys.stdin)["rows"] if r["as_asked"]][0])'; }
big="-q --size 96x96 --block 48 --reproducible"
"$P" "$scene" $big -o still.exr --stop-map still.csv
"$P" "$scene" $big -o zero.exr --stop-map zero.csv -p fps=0 -p ppd=67
"$P" "$scene" $big -o moving.exr --stop-map moving.csv -p fps=24
t "0 frames per second: a still" sh -c 'cut -d";" -f2- still.csv >a; cut -d";" -f2- zero.csv | cmp a - && oiiotool --fail 0 --warn 0 still.exr zero.exr --diff'
t "24 frames per second: fewer samples" share "$(mean moving.csv)" "$(mean still.csv)" 0.25 0.75
"$P" "$scene" $big -o far.exr --stop-map far.csv -p ppd=134
t "twice as many pixels per degree: fewer samples" share "$(mean far.csv)" "$(mean still.csv)" 0.02 0.75
t "  …the quote expects that, too" share "$(quoted -p fps=24)" "$(quoted)" 0.35 0.55
"$P" "$scene" --frames 1-2 $big --plan-shot M.csv -p fps=24 >/dev/null
"$P" "$scene" --frames 1-2 $big --plan-shot S.csv >/dev/null
t "  …and so does the plan of a shot" share "$(sed 's/$/;/' M.csv | grep '^[12];' >M; mean M)" "$(sed 's/$/;/' S.csv | grep '^[12];' >S; mean S)" 0.35 0.65
refused "fps: -1 is not in [0, 240]" "$scene" $big -p fps=-1 -o x.exr
refused "ppd: 'far' is not a number" "$scene" $big -p fps=24 -p ppd=far -o x.exr

# --- interrupted ---
long="$scene --frames 1-2 $small --spp 1500 -t 1"
"$P" $long -o whole_%d.exr
for _ in $(seq 20); do # again where the second frame was done before the interrupt came
    rm -f i_*.exr k_*
    "$P" $long -o i_%d.exr --checkpoint k_%d --checkpoint-every 0 & pid=$!
    until [ -e k_2 ] || ! kill -0 $pid 2>/dev/null; do sleep 0.02; done
    kill -INT $pid
    wait $pid
    status=$?
    [ $status -eq 130 ] && [ ! -e i_2.exr ] && break
done
t "an interrupt ends the shot" test $status -eq 130
t "  …with a checkpoint, without half a frame" test -e k_2 -a ! -e i_2.exr -a ! -e k_1
refused "k_2" "$scene" --frames 1-2 $small --spp 1500 --seed 7 -t 1 -o i_%d.exr --checkpoint k_%d # it is read
t "the same command goes on" "$P" $long -o i_%d.exr --checkpoint k_%d
t "  …to the same bytes" cmp i_2.exr whole_2.exr
t "  …and clears up" test ! -e k_2

# --- refusals ---
refused "--frames needs -o" "$scene" --frames 1-2
refused "--frames 3-1: expected a rising list" "$scene" --frames 3-1 -o x_%d.exr
refused "--output x.exr: several frames need a number" "$scene" --frames 1-2 -o x.exr
refused "--checkpoint k: several frames need a number" "$scene" --frames 1-2 -o x_%d.exr --checkpoint k
refused "x_%s.exr: expected one %d or %04d" "$scene" --frames 1-2 -o x_%s.exr
mkdir 50% && cp s_0001.pbrt 50%/
t "a folder's name with a %" "$P" 50%/s_%04d.pbrt --frames 1 $small --spp 1 -o 50%/f_%d.exr
t "  …is that folder" test -s 50%/f_1.exr
refused "50%/x_%.exr: expected one %d or %04d in the place of the frame's number" "$scene" --frames 1 -o 50%/x_%.exr
refused "--output 50%/x.exr: several frames need a number" "$scene" --frames 1-2 -o 50%/x.exr
refused "s_0004.pbrt: No such file" s_%04d.pbrt --frames 1-4 $small -o x_%d.exr
refused "belong to --frames" "$scene" --shot-table own.csv -o x.exr
refused "goes with none of --quote" "$scene" --frames 1 --quote -o x.exr
refused "two cameras" "$scene" --camera-path path.csv --look-at "0 0 5  0 0 0  0 1 0" -o x_%d.exr
refused "path.csv: frame 3 is not on this path" "$scene" --camera-path path.csv --frames 1-3 -o x_%d.exr
refused "own.csv: frame 3 is not in it" "$scene" --frames 3 $small --shot-table own.csv -o x_%d.exr
refused "own.csv: made for size=48x32" "$scene" --frames 2 -q --size 32x32 --block 16 --shot-table own.csv -o x_%d.exr
refused "path.csv:1: expected lull-shot-table 1" "$scene" --frames 1 $small --shot-table path.csv -o x_%d.exr
refused "leave out everything else" "$scene" --frames 1 $small --shot-table own.csv --spp 3 -o x_%d.exr
refused "--plan-shot writes no image" "$scene" --frames 1-2 --plan-shot U.csv -o x_%d.exr
refused "neither --spp" "$scene" --frames 1-2 --plan-shot U.csv --spp 4
echo "1..$n"
exit $bad
