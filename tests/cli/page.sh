#!/bin/sh
# lull-render --html, lull-report: one file with all in it, whatever names and texts say; what a picture alone tells; and what is
# refused. In a browser: study/page.sh.
. "$(dirname "$0")/lull_render_setup"
R="$P -q --size 48x32 --block 16 --spp-max 64 -t 2"
evil='x<!--<script>alert(1)&"'"'"'.pbrt'
cp "$scene" "$evil"
"$P" "$scene" -q --size 48x32 --block 16 --spp-max 64 --quote --json >q.json

t "--html writes a page" $R "$evil" --html p.html --report r.json --quoted q.json --preview p.png
# look EXPRESSION: of `page`, its JSON `data`, `report`, the pictures by name
look() {
    python3 - "$1" <<'EOF'
import base64, json, re, sys
page = open("p.html", encoding="utf-8").read()
block = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[1]
data = json.loads(block)
report = json.load(open("r.json"))
page_blocks = data["report"]["blocks"]
pictures = {n: base64.b64decode(b, validate=True) for n, b in re.findall(r'<img alt="" data-layer="(\w+)" src="data:image/png;base64,([^"]*)">', page)}
assert eval(f"({sys.argv[1]})"), sys.argv[1]
EOF
}
t "  …with the report, word for word" look "data['report'] == report and data['quote'] == json.load(open('q.json'))"
t "  …which knows where it was made" look "report['command'][1:3] == ['-q', '--size'] and report['software'].startswith('lull-render ') and 'processor' in report"
t "  …and what was said at each check" look "len(report['history']) == 6 and all(h[-1][:2] == [b['spp'], b['error']] and len(h) == b['checks'] for h, b in zip(report['history'], report['blocks']))"
t "  …and the picture of the preview" look "list(pictures) == ['picture'] and pictures['picture'][:8] == open('p.png', 'rb').read()[:8]"
t "  …the same pixels" sh -c "python3 - <<'EOF'
import base64, re
open('q.png', 'wb').write(base64.b64decode(re.search('data-layer=\"picture\" src=\"data:image/png;base64,([^\"]*)', open('p.html').read())[1]))
EOF
    idiff -q -fail 0 q.png p.png"
t "a scene's name ends no element" look "'<' not in block and page.count('<script') == 2 and 'alert(1)' in block and report['scene'].startswith('x<!--<script>alert(1)&')"
t "nothing comes from elsewhere" look "not re.findall(r'(?:src|href)=\"(?!data:)', page) and 'url(' not in page and '@import' not in page and set(re.findall(r'https?://[^\" ]*', page)) <= {'http://www.w3.org/2000/svg'}"
t "it brings its icon, so that no browser asks for one" look "page.count('<link rel=\"icon\" href=\"data:image/svg+xml,') == 1"
t "the page without its pictures is small" look "len(page) - sum(4 * len(p) / 3 for p in pictures.values()) < 2e6"
t "a crop has its pictures' size" sh -c "$R $scene --crop 20,3,41,30 --html c.html && grep -q '\"crop\":\[20,3,41,30\]' c.html"
t "many blocks: the page stays within 2 MB" sh -c "$P $scene -q --size 400x300 --block 4 -c halfbuf -p first-spp=2 -p threshold=1e-9 --spp-min 2 --spp-max 16 --html m.html --preview m.png &&
    [ \$((\$(wc -c <m.html) - \$(wc -c <m.png) * 4 / 3)) -lt 2000000 ]"
export LULL_OIDN="$(dirname "$P")/../tests/oidn-stub"
t "a denoised picture has its layers" sh -c "$R $scene --denoise --html d.html && [ \$(grep -c '<img alt=\"\" data-layer=' d.html) -eq 3 ]"

# said WORDS ARGUMENTS...: what a page made with them says of quality, its own function run by node
said() {
    words=$1; shift
    $R "$scene" "$@" --html s.html && node -e '
const page = require("fs").readFileSync("s.html", "utf8"), data = JSON.parse(page.match(/id="data">(.*?)<\/script>/s)[1]);
const { report } = data, list = (v) => (Array.isArray(v) ? v : []), isNumber = (v) => typeof v === "number" && Number.isFinite(v);
const say = (v) => String(+v.toPrecision(4)), text = (v) => String(v ?? "–"), rows = (pairs) => pairs.join(" "), make = (n, a, ...c) => c.flat().filter(Boolean).join("");
console.log(eval(`(${page.match(/^function quality\(\) \{.*?^\}/ms)[0]})`)());' >said.txt && cat said.txt && grep -qF -e "$words" said.txt
}
if command -v node >/dev/null; then
    t "a page says what counts: the share of viewers" said "--visible 0.2. A block stops when at most 20 % of viewers would still see noise" --visible 0.2
    t "  …with --error that, and nothing of viewers" said "--error 2. A block stops when its error is at most 2 times what is just seen" --error 2
    t "  …" sh -c "! grep -q 'viewers\|isible' said.txt"
    t "  …a threshold" said "threshold 0.5. A block stops when its error is at most this" -c halfbuf -p threshold=0.5
    t "  …a share that is the model's own" said "--visible (the model’s own)" -c ggn
else echo "ok - what a page says of quality # SKIP node is not installed"; fi

# --- lull-report: the page of a render that is over ---
cp p.html made.html && cp r.json made.json
"$P" "$scene" -q --size 48x32 --block 16 --spp-max 64 -o old.exr --report r.json
report=$(dirname "$P")/lull-report
t "lull-report writes the page of a report and its picture" "$report" r.json old.exr --quoted q.json -o p.html
t "  …with both" look "data['report'] == report and data['quote'] and list(pictures) == ['picture']"
t "  …but of another file, which it names" sh -c "'$report' r.json --quoted made.json -o no.html 2>&1 | grep 'made.json: no quote'"
t "  …without a picture" "$report" r.json -o p.html
t "  …the report alone" look "data['report'] == report and data['quote'] is None and not pictures"
oiiotool --pattern constant:color=.1,.2,.3,.5,.5,.5,.9,.8,.7 48x32 9 \
    --chnames R,G,B,noisy.R,noisy.G,noisy.B,denoised.R,denoised.G,denoised.B -d float -o old.exr
t "  …a denoised picture with its layers" "$report" r.json old.exr -o p.html
t "  …three" look "list(pictures) == ['picture', 'noisy', 'denoised'] and len(set(pictures.values())) == 3"
"$P" "$scene" -q --size 16x16 --spp 1 -o other.exr
"$P" "$scene" -q --size 48x32 --block 20x10 --spp-max 64 --crop 5,3,41,30 -c halfbuf -p threshold=0.5 --seed 4294967295 \
    -o alone.exr --report r.json
t "lull-report writes the page of a picture alone" "$report" alone.exr -o p.html
t "  …with the picture" look "list(pictures) == ['picture']"
t "  …whose blocks are the report's, cut to the crop" look "len(page_blocks) == len(report['blocks']) == 9 and all(
    [b[k] for k in ('id', 'spp', 'reason')] == [w[k] for k in ('id', 'spp', 'reason')] and abs(b['error'] - w['error']) <= 1e-6 * w['error'] and
    [b[k] for k in ('x0', 'y0', 'x1', 'y1')] == [max(w['x0'], 5), max(w['y0'], 3), min(w['x1'], 41), min(w['y1'], 30)]
    for b, w in zip(page_blocks, report['blocks']))"
t "  …and their samples" look "data['report']['totals']['samples'] == sum(b['spp'] * (b['x1'] - b['x0']) * (b['y1'] - b['y0']) for b in page_blocks)"
t "  …and what else is the same" look "all(data['report'][k] == report[k] for k in ('scene', 'width', 'height', 'crop', 'seed', 'effects', 'software')) and
    data['report']['criterion']['id'] == 'halfbuf' and data['report']['criterion']['params'] == {'threshold': '0.5'}"
t "  …and no times" look "not any('thread_s' in b for b in page_blocks) and abs(data['report']['totals']['elapsed_s'] - report['totals']['render_s'] - report['totals']['criterion_s']) < 1e-9"
t "a denoised picture alone" sh -c "'$P' $scene -q --size 48x32 --block 16 --spp-max 64 --denoise -o deep.exr --report r.json && '$report' deep.exr -o p.html"
t "  …has its layers, and the noisy one's error" look "list(pictures) == ['picture', 'noisy', 'denoised'] and
    all(abs(b['noisy_error'] - w['noisy_error']) <= 1e-6 * w['noisy_error'] for b, w in zip(page_blocks, report['blocks']))"
render=$P P=$report
refused "old.exr: has no channel 'lull.spp.V'" old.exr -o x.html
for block in 0x0 -1x20 20x 99999999999999999999x20 20x10x10 "" blocks; do
    oiiotool alone.exr --attrib:type=string lull:block "$block" -o bad.exr
    refused "bad.exr: lull:block is '$block' (expected the size of its blocks" bad.exr -o x.html
done
oiiotool alone.exr --attrib lull:block 36x27 -o bad.exr
refused "is not of blocks of 36x27 pixels" bad.exr -o x.html
for v in nan inf -1 1e30; do # the samples, times it
    oiiotool alone.exr --mulc 1,1,1,1,1,1,$v -o bad.exr
    refused "its layer 'lull.spp.V' is not" bad.exr -o x.html
done
for v in 100 0.5 nan; do # channels: R, G, B, error, p_noisy, reason, spp
    oiiotool alone.exr --mulc 1,1,1,1,1,$v,1 -o bad.exr
    refused "its layer 'lull.reason.V' is not" bad.exr -o x.html
done
oiiotool alone.exr --resize 1024x512 --attrib lull:block 1x1 -o bad.exr
refused "more than 262144 blocks of 1x1 pixels" bad.exr -o x.html
for bytes in 300 600; do # in its header, in its pixels
    head -c $bytes alone.exr >cut.exr
    refused "cut.exr" cut.exr -o x.html
done
refused "the picture has 16x16 pixels, the report is of 48x32" r.json other.exr -o x.html
echo '{"blocks": 1, "width": 1, "height": 1}' >no.json
refused "no.json: no report (expected what lull-render --report writes)" no.json -o x.html
for size in -1 0 2.5 1e300; do
    echo "{\"width\": $size, \"height\": 8, \"blocks\": []}" >size.json
    refused "pixels: no picture has this size" size.json -o x.html
done
refused "nowhere.json" nowhere.json -o x.html
refused "not an image" r.json no.json -o x.html
ln -s r.json r.html
refused "this is an input" r.json -o r.html
P=$render

echo '{"rows": 1}' >bad.json
S="$scene -q --size 8x8 --spp 1"
refused "--quoted bad.json: no quote" $S --html x.html --quoted bad.json
refused "nowhere.json" $S --html x.html --quoted nowhere.json
refused "--quoted belongs to --html" $S -o x.exr --quoted q.json
refused "ends in .html or .htm" $S --html x.txt
ln -s q.json q.html
refused "this is an input" $S --html q.html --quoted q.json
refused "cannot write there" $S --html nowhere/x.html
refused "--quote writes no image" $S --quote --html x.html
echo "1..$n"
exit $bad
