#!/bin/sh
# lull-render --quote: what it prints, draws and refuses, and that its pilot loses nothing.
. "$(dirname "$0")/lull_render_setup"
json() { python3 -c "import json; q = json.load(open('$1')); rows = q['rows']; assert $2, [r['spp_mean'] for r in rows]"; }

quote="$scene -q --size 64x48 --block 16 --spp-max 2000 -t 2"

# --- text ---
"$P" $quote --quote >text 2>notes
t "the table has its five rows, 35 % by default" sh -c "grep -q '^  8 x  rough .* x$' text && grep -q '^ 35 %  default' text && grep -q '^  5 %  strict' text"
t "  …samples rise as less may be seen" \
    awk '/^ *[0-9]+ [x%]  / { gsub(",", ""); mean = $6 + 0; if (mean < last) exit 1; last = mean; rows++ } END { exit rows != 5 }' text
t "  …has a heading for the blocks" grep -qx "blocks that take most of the time, as asked:" text
t "  …names the blocks that take most, and what their paths meet" \
    grep -qE '^  block [0-9]+ \([0-9,]+ to [0-9,]+\): [0-9]+ %, .* us per path of [0-9.]+ vertices, [0-9]+ % of them [a-z]' text
t "  …tells pilot and memory" sh -c "grep -q '^pilot: ' text && grep -q '^memory: film .* MB, scene .* MB' text"
t "  …and nothing on stderr" test ! -s notes
t "no image is left behind" test ! -e room.exr
t "another share has a row" sh -c "$P $quote --quote --visible 0.1 | grep -q '^ 10 %  as asked'"
t "another error has a row, among multiples of what is just seen" sh -c "$P $quote --quote --error 3 >by_error &&
    [ \"\$(grep -oE '^ *[0-9.]+ x  [a-z ]+[a-z]' by_error | tr -s ' \n' ' ,')\" = ' 8 x rough, 4 x draft, 3 x as asked, 2 x good, 1 x just seen,0.5 x strict,' ]"
t "a criterion with a threshold has rows of four times and twice it" sh -c "$P $quote --quote -c halfbuf >three &&
    [ \"\$(grep -oE '^0[0-9.]+  [a-z ]+[a-z]' three | tr -s ' \n' ' ,')\" = '0.016 rough,0.008 draft,0.004 as asked,' ]"
t "a criterion without a quality parameter has one row" sh -c "$P $quote --quote -c fixed >one && [ \$(grep -c ' x$' one) -eq 1 ] && grep -q '^as asked' one"
t "a criterion without predictions is told so" sh -c "$P $quote --quote -c null | grep -q 'criterion null does not say when it expects to stop 12 of 12 blocks'"
t "a uniform render has a quote" sh -c "$P $quote --quote --spp-max 2000 --spp-min 2000 -c null >/dev/null && $P $scene -q --size 64x48 --spp 900 --quote | grep -qE '^as asked +900 / +900 / +900 '"

# --- a pilot that met too little ---
"$P" $quote --quote --quote-pilot 8 >early 2>notes
t "a pilot that ends before a criterion can say anything gives no number" sh -c "[ \$(grep -c 'not known: the pilot has met too little' early) -eq 5 ] && ! grep -q ' x$' early"
"$P" $quote --quote --quote-pilot 8 --json >early.json
t "  …nor does its JSON" json early.json "all(not r['told'] and r['spp_mean'] == r['wall_s'] == {'expected': None, 'low': None, 'high': None} for r in rows)"

# --- JSON: the same, block by block ---
t "--json" "$P" $quote --quote --json
"$P" $quote --quote --json >q.json
t "  …all of which are told" json q.json "all(r['told'] for r in rows)"
t "  …has rows of shares" json q.json "[r.get('error') or r['visible'] for r in rows] == [8, 4, 2, 0.35, 0.05] and [r['as_asked'] for r in rows].index(True) == 3"
t "  …every row has every block, inside its interval" \
    json q.json "all(len(r['blocks']) == 12 and all(b['spp']['low'] <= b['spp']['expected'] <= b['spp']['high'] for b in r['blocks']) for r in rows)"
t "  …the row's time is that of its blocks" \
    json q.json "all(abs(sum(b['thread_s']['expected'] for b in r['blocks']) / r['thread_s']['expected'] - 1) < 1e-6 for r in rows)"
t "  …what has not met its light is counted" json q.json "all(sum(not b['met_light'] for b in r['blocks']) == r['unmet_blocks'] for r in rows)"
t "  …the pilot keeps its limit" json q.json "all(b['pilot_spp'] <= 128 for b in q['blocks'])"
"$P" $quote --quote --json --quote-pilot 40 >q40.json
t "--quote-pilot SPP" json q40.json "max(b['pilot_spp'] for b in q['blocks']) == 40"
"$P" $scene -q --size 640x480 --quote --json --quote-pilot 100000:0.3 >qs.json
t "--quote-pilot SPP:SECONDS" json qs.json "q['pilot']['elapsed_s'] >= 0.3 and max(b['pilot_spp'] for b in q['blocks']) < 100000"

oiiotool --pattern constant:color=1,1,1 64x48 3 -d uint8 -o white.png
"$P" $quote --quote --json --mask white.png >mask.json
t "--mask counts: white asks for more" python3 -c "
import json
plain, mask = ([r['spp_mean']['expected'] for r in json.load(open(f))['rows']] for f in ('q.json', 'mask.json'))
assert all(m >= p for p, m in zip(plain, mask)) and all(m > 1.05 * p for p, m in zip(plain[2:], mask[2:])), (plain, mask)"

# --- map ---
t "--quote-map" "$P" $quote --quote --quote-map map.png
t "  …is a picture of the blocks and a legend" sh -c "oiiotool --info map.png | grep -q ' 192 x  188'"

# --- the render is what it would have been ---
same="$quote --reproducible"
"$P" $same -o whole.exr
t "a pilot with a checkpoint" "$P" $same --quote --checkpoint pilot.ckp
t "  …is gone on with" "$P" $same --checkpoint pilot.ckp --resume -o parts.exr --report parts.json
t "  …to the same bytes as without" cmp whole.exr parts.exr
"$P" $same --report real.json -o whole.exr
t "predicted mean samples are within a factor of 1.6 of the real ones" python3 -c "
import json
q, real = json.load(open('q.json')), json.load(open('real.json'))
spp = real['totals']['samples'] / (64 * 48)
ratio = next(r for r in q['rows'] if r['as_asked'])['spp_mean']['expected'] / spp
assert 1 / 1.6 < ratio < 1.6, ratio"

# --- interrupt ---
"$P" "$scene" --size 640x480 --quote --quote-pilot 1000000:1000000 --checkpoint int.ckp >int.txt 2>int.err &
pid=$!
until [ -s int.err ] || ! kill -0 $pid 2>/dev/null; do sleep 0.1; done # its progress: from here on it listens
kill -INT $pid
wait $pid
t "SIGINT: exit status 130" test $? -eq 130
t "  …what is known is told, and a checkpoint kept" sh -c "grep -q '; interrupted' int.txt && test -s int.ckp"

# --- errors ---
for both in "--error 2 --visible 0.2" "-p error=2 --visible 0.2" "-p visible=0.2 -p error=2"; do
    for what in --quote "-o a.exr" "--denoise -o a.exr" "-c denoised --sequence seq" "--frames 1-2 -o a_%d.exr" "--frames 1-2 --plan-shot a.csv"; do
        LULL_OIDN="$(dirname "$P")/../tests/oidn-stub" refused "error and visible each say when a block stops: leave out one" $quote $both $what
    done
done
refused "no criterion is used" $scene -q --sequence seq --visible 0.2 --error 2
refused "--quote writes no image" $quote --quote -o a.exr
refused "--quote writes no image" $quote --quote --stop-map a.png
refused "--quote goes with none of" $quote --quote --sequence seq
refused "--quote goes with none of" $quote --quote --explain
refused "--quote goes with neither" $quote --quote --time-budget 5
refused "--quote goes with neither" $quote --quote --checkpoint pilot.ckp --resume
refused "--max-seam" $quote --quote --max-seam 4
refused "belong to --quote" $quote --json
refused "belong to --quote" $quote --quote-map a.png
refused "belong to --quote" $quote --quote-pilot 64
refused "SPP or SPP:SECONDS" $quote --quote --quote-pilot 0
refused "SPP or SPP:SECONDS" $quote --quote --quote-pilot 64:never
refused "ends in .png" $quote --quote --quote-map a.jpg
refused "cannot write there" $quote --quote --quote-map nowhere/a.png
exit $bad
