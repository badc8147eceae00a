#!/bin/sh
# What `ggn evaluate -o` leaves to be drawn: figures.json against the tables and stops beside it, and the strips of blocks.
. "$(dirname "$0")/ggn_setup"
$ggn train -d $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 4 --steps-denoiser 2 --steps 4 --epoch-steps 2 -q --out "$tmp/m.ggn" 2>"$tmp/err"
check "a model" $?
# the network's strips want blocks of its own size: that of the data
$ggn evaluate -d $data -m "$tmp/m.ggn" -o "$tmp/report" >"$tmp/out" 2>"$tmp/err"
check "evaluated" $?
cat >"$tmp/look.py" <<'P'
import json, re, sys
from lull.plot.kinds import roc_curve
from lull.plot.sources import read
what, report, data = sys.argv[1:]
split = json.load(open(data + "/split.json"))
e = read(report + "/figures.json")
def stops(name, method):
    rows = [l.split(";") for l in open("%s/%s-stops-%s.csv" % (report, name, method)).read().split("\n")[1:-1]]
    return [(r[0], int(r[1]), float(r[2]), r[3] == "1", float(r[4])) for r in rows]
near = lambda a, b: abs(a - b) <= 2e-5 * max(abs(a), abs(b), 1)
for name, views in ((name, views) for name, views in split.items() if views):
    if what == "blocks": # of the split's views and no others, in their places
        for method, file in (("-spp", "spp"), ("constant (median of train)", "constant"), ("m.ggn", "mggn")):
            table, found = stops(name, file), e.of(name)
            assert sorted({r[0] for r in table}) == sorted(views), (name, table)
            assert len(table) == len(found)
            for r, b in zip(table, found):
                manifest = json.load(open("%s/%s/manifest.json" % (data, b["view"])))
                at = next(m for m in manifest["blocks"] if m["id"] == b["block"])
                assert [b["column"], b["row"]] == [at["x0"] // manifest["block"], at["y0"] // manifest["block"]], (b, at)
                method = next(m for m in b["spp"] if m.split(" (")[0] == method.split(" (")[0])
                assert (b["view"], b["block"], b["censored"]) == (r[0], r[1], r[3]) and near(b["threshold"], r[2]) and near(b["spp"][method], r[4])
    if what == "windows": # the area below the curve of all windows is the table's; a window is noisy below the threshold
        for method in e.methods(name):
            windows = e.windows(name, method)
            pairs = [(s, n) for w in windows for s, n in zip(w.score, w.noisy) if n is not None and s == s]
            assert len(pairs) > 10 and {n for _, n in pairs} == {0, 1}
            x, y = roc_curve(*zip(*pairs))
            assert (x[0], y[0], x[-1], y[-1]) == (0, 0, 1, 1) and (x[1:] >= x[:-1]).all() and (y[1:] >= y[:-1]).all()
            area = ((x[1:] - x[:-1]) * (y[1:] + y[:-1])).sum() / 2
            assert abs(area - e.figures["splits"][name][method]["auc"]) < 1e-9, (method, area)
            for w in windows:
                assert all(n is None or n == (spp < w.threshold) for spp, n in zip(w.spp, w.noisy)), w
if what == "strips":
    levels = json.load(open(data + "/scene3/manifest.json"))["levels"]
    said = e.figures["strips"]["validation-features.png"]
    titles = [re.match(r"(\S+) block (\d+), threshold (\d+): (\d+) spp, p\(noisy\) ([0-9.]+) ", title).groups() for title in said]
    assert len(titles) == 3 and len({t[:3] for t in titles}) == 1 and titles[0][0] == "scene3", titles
    first, middle, last = (int(t[3]) for t in titles)
    exact = [r for r in stops("validation", "mggn") if r[1] == int(titles[0][1])][0][2]
    assert first == levels[5] and last >= levels[-1], titles # windows of six images
    assert middle == min([l for l in levels[5:] if l >= exact]), (middle, levels, exact)
    assert all(0 < float(t[4]) < 1 for t in titles)
    said = e.figures["strips"]["validation-denoiser.png"]
    shown = [re.match(r"(\S+) block (\d+) at (\d+) spp: SSIM ([0-9.]+) +denoised: SSIM ([0-9.]+) +reference$", title).groups() for title in said]
    assert [(s[0], int(s[2])) for s in shown] == [("scene3", levels[0])], shown
    assert "train-denoiser.png" not in e.figures["strips"]
P
look() { PYTHONPATH=plugin-api/python /usr/bin/python3 -B "$tmp/look.py" "$@" >"$tmp/out" 2>"$tmp/err"; }
for what in blocks windows strips; do
    look $what "$tmp/report" $data
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
$ggn evaluate -d "$tmp/early" -m "$tmp/m.ggn" -o "$tmp/second" >"$tmp/out" 2>"$tmp/err" && look strips "$tmp/second" "$tmp/early"
check "strips: of a block that is converged from the start" $?
# A recording so short that the network judges no window of it.
mkdir "$tmp/short"
$bin/lull-render tests/cli/room.pbrt -q --size 80x80 --block 40 --sampler independent --levels geometric:4:16:1.35 --reference-spp 0 \
    --sequence "$tmp/short/view" --name view 2>"$tmp/err" &&
    printf '{"format": "lull-labels", "version": 1, "source": "observer", "detail": "made up", "cap": 10000, "spread": 0.15, "blocks": [%s]}' \
        "$(for id in 0 1 2 3; do printf '%s{"id": %d, "threshold": 20, "censored": false}' "$([ $id = 0 ] || echo ,)" $id; done)" \
        >"$tmp/short/view/labels.json" &&
    $ggn evaluate -d "$tmp/short" -m "$tmp/m.ggn" --recorded --no-quality -o "$tmp/few" >"$tmp/out" 2>"$tmp/err" &&
    [ -s "$tmp/few/test-stops-mggn.csv" ] && $bin/lull-plot "$tmp/few/figures.json" -k scores -m -spp -o "$tmp/few/spp.png" 2>"$tmp/err"
check "a recording without windows of the network" $?
fails "a method that judged nothing has no picture of its scores" "m.ggn judged no window of the split test" \
    sh -c "$bin/lull-plot $tmp/few/figures.json -k scores -o $tmp/few/m.png 2>&1 | sed 's/^lull-plot/ggn lull-plot/' >&2; exit 2"
# The denoiser's strip is noisy image, denoised image and reference; its title has the SSIM of the first two against the third.
oiiotool "$tmp/report/validation-denoiser.png" -d uint8 -o "$tmp/strip.ppm" >"$tmp/out" 2>&1
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
python3 "$tmp/ssim.py" "$tmp/strip.ppm" "$tmp/report/figures.json" >"$tmp/out" 2>"$tmp/err"
check "strips: the SSIM in the title is that of the tiles" $?
exit $bad
