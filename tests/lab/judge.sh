#!/bin/sh
# scripts/lablib/cvvdp.py: what ColorVideoVDP says of pictures and clips, as numbers that must stand in an order.
. "$(dirname "$0")/../cli/lull_render_setup"
cat >ask.py <<'PY'
import sys
sys.path.insert(0, sys.argv[1])
from lablib import cvvdp, tool
try:
    with cvvdp.Judge(ppd=40) as judge:
        jod, rows = judge.jod("noisy.exr", "clean.png", block=16)
        print("worse", judge.jod("noisy.exr", "clean.exr") < judge.jod("clean.exr", "clean.png") == 10)
        print("same", abs(jod - judge.jod("noisy.png", "clean.exr")) < 0.01)
        print("rows", [len(row) for row in rows], min(map(min, rows)) > 0)
        print("still", judge.jod(["noisy.png"] * 6, ["clean.png"] * 6, fps=24) < jod)
        for wrong in (["noisy.png"] * 2, "none.png", "small.png"):
            try:
                judge.jod(wrong, "clean.png")
            except tool.Refused as why:
                print("refused", why)
except tool.Refused as why:
    print(why)
PY
ask() { /usr/bin/python3 ask.py "$here/../../scripts" >said 2>&1; cat said; }
BUILD=nowhere ask
t "without it: one line says what to run" test "$(cat said)" = "no ColorVideoVDP in nowhere/judge: scripts/setup --judge"
[ -x "${P%/bin/*}/judge/bin/python" ] || { echo "ok $((n + 1)) # SKIP scripts/setup --judge has not put ColorVideoVDP into build/judge"; echo "1..$((n + 1))"; exit $bad; }
command -v oiiotool >/dev/null || { echo "ok $((n + 1)) # SKIP no oiiotool"; echo "1..$((n + 1))"; exit $bad; }
"$P" "$scene" -q --size 48x32 --spp 4 -o noisy.exr --preview noisy.png
"$P" "$scene" -q --size 48x32 --spp 256 -o clean.exr --preview clean.png
"$P" "$scene" -q --size 32x32 --spp 1 --preview small.png -o small.exr
ask
t "noise is seen, no difference is not" grep -q '^worse True$' said
t "an EXR is the picture that it shows" grep -q '^same True$' said
t "a difference for each block" grep -qF 'rows [3, 3] True' said
t "a clip of that noise is as bad as it or worse" grep -q '^still True$' said
t "refused: other lengths" grep -q '^refused ColorVideoVDP: 2 pictures against 1' said
t "refused: no such file" grep -q '^refused ColorVideoVDP: .*none.png' said
t "refused: another size" grep -q '^refused ColorVideoVDP: .*small.png has another size' said
"${P%/bin/*}/judge/bin/python" "$here/../../scripts/lablib/cvvdp.py" --sensitivities >tables
t "the tables by which the model observer weighs what is viewed are what its functions say" sh -c "tr -s ' \n' '  ' <'$here/../../ggn/sight/viewing.c' >code && \
    sed -n 1p tables | xargs -I{} grep -qF '{{}}' code && sed -n 2p tables | xargs -I{} grep -qF '{{}}' code"
echo "1..$n"
exit $bad
