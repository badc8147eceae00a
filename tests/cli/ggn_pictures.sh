#!/bin/sh
# What `ggn evaluate -o` leaves to be drawn: figures.json against the tables and stops beside it.
. "$(dirname "$0")/ggn_setup"
$ggn train -d $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 4 --steps-denoiser 2 --steps 4 --epoch-steps 2 -q --out "$tmp/m.ggn" 2>"$tmp/err"
check "a model" $?
$ggn evaluate -d $data -m "$tmp/m.ggn" -o "$tmp/report" >"$tmp/out" 2>"$tmp/err"
check "evaluated" $?
cat >"$tmp/look.py" <<'P'
import json, sys
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
P
look() { PYTHONPATH=plugin-api/python /usr/bin/python3 -B "$tmp/look.py" "$@" >"$tmp/out" 2>"$tmp/err"; }
for what in blocks windows; do
    look $what "$tmp/report" $data
    check "$what: what the tables say" $?
done
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
exit $bad
