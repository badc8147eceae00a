#!/bin/sh
# What the pictures of `ggn evaluate` draw: a gnuplot that keeps its script shows the numbers, which are held against the tables.
. "$(dirname "$0")/ggn_setup"
mkdir "$tmp/path" "$tmp/kept"
cat >"$tmp/path/gnuplot" <<'END_OF_GNUPLOT'
#!/bin/sh
out=$(sed -n "s/^set output '\(.*\)'$/\1/p" "$1")
cp "$1" "$KEPT/$(basename "$out" | sed 's/^.tmp-lull[0-9]*-[0-9]*\.//').gp"
for part in "$(dirname "$out")"/*.part*.png; do [ ! -f "$part" ] || cp "$part" "$KEPT"; done
: >"$out"
END_OF_GNUPLOT
chmod +x "$tmp/path/gnuplot"
$ggn train -d $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 4 --steps-denoiser 2 --steps 4 --epoch-steps 2 -q --out "$tmp/m.ggn" 2>"$tmp/err"
check "a model" $?
# the network's pictures want blocks of its own size: that of the data
KEPT="$tmp/kept" PATH="$tmp/path:$PATH" $ggn evaluate -d $data -m "$tmp/m.ggn" -o "$tmp/report" >"$tmp/out" 2>"$tmp/err"
check "evaluated" $?
cat >"$tmp/look.py" <<'P'
import glob, json, math, re, sys
what, kept, report, data = sys.argv[1:]
split = json.load(open(data + "/split.json"))
read = lambda name: open("%s/%s.png.gp" % (kept, name)).read()
blocks = lambda text: [[[float(v) for v in l.split()] for l in b.split("\n") if l] for b in re.findall(r"<< EOD\n(.*?)EOD", text, re.S)]
def stops(name, method):
    rows = [l.split(";") for l in open("%s/%s-stops-%s.csv" % (report, name, method)).read().split("\n")[1:-1]]
    return [(r[0], int(r[1]), float(r[2]), r[3] == "1", float(r[4])) for r in rows]
near = lambda a, b: abs(a - b) <= 2e-5 * max(abs(a), abs(b), 1)
splits = {name: views for name, views in split.items() if views}
for name, views in splits.items():
    for method in ("spp", "constant", "mggn"):
        table = stops(name, method)
        assert sorted({r[0] for r in table}) == sorted(views), (name, table)
        if what == "maps": # of the split's views and no others, thresholds beside stops
            text = read("%s-heatmaps-%s" % (name, method))
            assert re.findall(r"^set title '(.*)'", text, re.M) == sorted(views), text
            down, across = map(int, re.search(r"set multiplot layout (\d+),(\d+) ", text).groups())
            assert down * across >= len(views), (down, across)
            lo, hi = map(float, re.search(r"cbrange \[(.*):(.*)\]", text).groups())
            values = blocks(text)
            assert len(values) == 2 * len(views)
            for i, view in enumerate(sorted(views)):
                mine = [r for r in table if r[0] == view]
                for side, column in ((0, 2), (1, 4)):
                    shown = [row[2] for row in values[2 * i + side] if not math.isnan(row[2])] # x, y, whole samples
                    assert len(shown) == len(mine) and all(abs(a - r[column]) < 0.51 for a, r in zip(shown, mine)), (shown, mine)
                    assert all(lo <= v + 0.51 and v <= hi + 0.51 for v in shown)
        elif what == "scatter":
            got = sorted((x[0], x[1]) for x in blocks(read("%s-scatter-%s" % (name, method)))[0])
            want = sorted((r[2], r[4]) for r in table if not r[3])
            assert len(got) == len(want) and all(near(a, c) and near(b, d) for (a, b), (c, d) in zip(got, want)), (got, want)
        elif what == "errors":
            got = sorted(x[0] for x in blocks(read("%s-errors-%s" % (name, method)))[0])
            want = sorted(math.log2(r[4] / r[2]) for r in table if not r[3])
            assert len(got) == len(want) and all(near(a, b) for a, b in zip(got, want)), (got, want)
    if what == "roc": # from (0, 0) to (1, 1), rising, and the area below is the table's
        text, figures = read(name + "-roc"), json.load(open(report + "/figures.json"))["splits"][name]
        titles = re.findall(r"title '([^']*)'", text.split("\nplot ")[1])
        for curve, title in zip(blocks(text), titles):
            assert curve[0][:2] == [0, 0] and curve[-1][:2] == [1, 1], curve
            assert all(a[0] <= b[0] and a[1] <= b[1] for a, b in zip(curve, curve[1:]))
            area = sum((b[0] - a[0]) * (a[1] + b[1]) / 2 for a, b in zip(curve, curve[1:]))
            assert abs(area - figures[title]["auc"]) < 1e-3, (title, area, figures[title]["auc"])
if what == "strips":
    text = read("validation-features")
    assert "size 1100,%d " % (3 * 320 + 20) in text
    levels = json.load(open(data + "/scene3/manifest.json"))["levels"]
    titles = re.findall(r"set title '(\S+) block (\d+), threshold (\d+): (\d+) spp, p\(noisy\) ([0-9.]+) ", text)
    assert len(titles) == 3 and len({t[:3] for t in titles}) == 1 and titles[0][0] == "scene3", titles
    first, middle, last = (int(t[3]) for t in titles)
    exact = [r for r in stops("validation", "mggn") if r[1] == int(titles[0][1])][0][2]
    assert first == levels[5] and last >= levels[-1], titles # windows of six images
    assert middle == min([l for l in levels[5:] if l >= exact]), (middle, levels, exact)
    assert all(0 < float(t[4]) < 1 for t in titles)
    text = read("validation-denoiser")
    shown = re.findall(r"set title '(\S+) block (\d+) at (\d+) spp: SSIM ([0-9.]+) +denoised: SSIM ([0-9.]+) +reference'", text)
    assert "size 960,%d " % (360 * len(shown) + 20) in text and [(s[0], int(s[2])) for s in shown] == [("scene3", levels[0])], shown
P
for what in maps scatter errors roc strips; do
    python3 "$tmp/look.py" $what "$tmp/kept" "$tmp/report" $data >"$tmp/out" 2>"$tmp/err"
    check "$what: what the tables say" $?
done
# Thresholds below what a window needs: the second strip is the first.
cp -r $data "$tmp/early" && python3 - "$tmp/early/scene3/labels.json" <<'P'
import json, sys
labels = json.load(open(sys.argv[1]))
for b in labels["blocks"]:
    b["threshold"] = 20
json.dump(labels, open(sys.argv[1], "w"))
P
KEPT="$tmp/kept" PATH="$tmp/path:$PATH" $ggn evaluate -d "$tmp/early" -m "$tmp/m.ggn" -o "$tmp/report" >"$tmp/out" 2>"$tmp/err" &&
    python3 "$tmp/look.py" strips "$tmp/kept" "$tmp/report" "$tmp/early" >"$tmp/out" 2>"$tmp/err"
check "strips: of a block that is converged from the start" $?
# A recording so short that the network judges no window of it: the other pictures are drawn, by gnuplot itself.
mkdir "$tmp/short"
$bin/lull-render tests/cli/room.pbrt -q --size 80x80 --block 40 --sampler independent --levels geometric:4:16:1.35 --reference-spp 0 \
    --sequence "$tmp/short/view" --name view 2>"$tmp/err" &&
    printf '{"format": "lull-labels", "version": 1, "source": "observer", "detail": "made up", "cap": 10000, "spread": 0.15, "blocks": [%s]}' \
        "$(for id in 0 1 2 3; do printf '%s{"id": %d, "threshold": 20, "censored": false}' "$([ $id = 0 ] || echo ,)" $id; done)" \
        >"$tmp/short/view/labels.json" &&
    $ggn evaluate -d "$tmp/short" -m "$tmp/m.ggn" --recorded --no-quality -o "$tmp/few" >"$tmp/out" 2>"$tmp/err" &&
    [ -s "$tmp/few/test-score-spp.png" ] && [ ! -e "$tmp/few/test-score-mggn.png" ] && [ -s "$tmp/few/test-stops-mggn.csv" ]
check "a method that judged nothing has no picture of its scores" $?
# The denoiser's strip is noisy image, denoised image and reference; its title has the SSIM of the first two against the third.
oiiotool "$tmp/kept/validation-denoiser.png.part0.png" -d uint8 -o "$tmp/strip.ppm" >"$tmp/out" 2>&1
cat >"$tmp/ssim.py" <<'P'
# Wang et al. 2004: windows of 11 x 11, sigma 1.5, zeros beyond the edge; K1 = 0.01, K2 = 0.03; mean over the channels
import math, re, sys
data = open(sys.argv[1], "rb").read()
w, h = map(int, re.match(rb"P6\s+(\d+) (\d+)\s+255\s", data).groups())
rgb, n = data[-3 * w * h:], w // 3
assert n == h
g = [math.exp(-i * i / 4.5) for i in range(-5, 6)]
g = [v / sum(g) for v in g]
def plane(tile, c):
    return [[rgb[3 * (y * w + tile * n + x) + c] / 255 for x in range(n)] for y in range(n)]
def blur(p):
    across = [[sum(g[k + 5] * row[x + k] for k in range(-5, 6) if 0 <= x + k < n) for x in range(n)] for row in p]
    return [[sum(g[k + 5] * across[y + k][x] for k in range(-5, 6) if 0 <= y + k < n) for x in range(n)] for y in range(n)]
def product(a, b):
    return [[u * v for u, v in zip(r, s)] for r, s in zip(a, b)]
def ssim(a, b):
    total = 0
    for c in range(3):
        x, y = plane(a, c), plane(b, c)
        mx, my, xx, yy, xy = blur(x), blur(y), blur(product(x, x)), blur(product(y, y)), blur(product(x, y))
        for i in range(n):
            for j in range(n):
                u, v = mx[i][j], my[i][j]
                total += (2 * u * v + 1e-4) * (2 * (xy[i][j] - u * v) + 9e-4) / ((u * u + v * v + 1e-4) * (xx[i][j] - u * u + yy[i][j] - v * v + 9e-4))
    return total / (3 * n * n)
told = re.search(r"SSIM ([0-9.]+) +denoised: SSIM ([0-9.]+)", open(sys.argv[2]).read()).groups()
for tile in (0, 1):
    mine = ssim(tile, 2)
    assert abs(mine - float(told[tile])) < 2e-3, (tile, mine, told) # the tile has 8 bits
assert told[0] != told[1]
P
python3 "$tmp/ssim.py" "$tmp/strip.ppm" "$tmp/kept/validation-denoiser.png.gp" >"$tmp/out" 2>"$tmp/err"
check "strips: the SSIM in the title is that of the tiles" $?
exit $bad
