#!/bin/sh
# scripts/lab full-size with the denoiser of tests/stub: a row of a scene, a page of it, and nothing rendered twice.
. "$(dirname "$0")/../cli/lull_render_setup"
LULL_OIDN=$(cd "$here/../../${BUILD:-build}/tests/oidn-stub" && pwd)
export LULL_OIDN OIDN_STUB=box
mkdir -p docs/results && printf '<!-- lab: full_size.page() -->\n<!-- lab: end -->\n' >docs/page.md
job() { "$here/../../scripts/lab" full-size --scenes "$scene" --size 48x48 --block 24 --spp-max 128 --reference-spp 16 --work "$PWD/work" "$@"; }
job --write "$PWD/docs" >first
t "a scene is measured, and fills its page" grep -q '^. samples, denoised / raw' docs/page.md
t "  …with a row" grep -q '^| .* of 4, .* | .* of 4, ' docs/page.md
t "  …of samples as the reports have them" python3 -c '
import glob, json
for way in ("raw", "denoised"):
    kept, report = (json.load(open(glob.glob("work/*." + way + end)[0])) for end in (".json", ".report.json"))
    pixels = [(b["x1"] - b["x0"]) * (b["y1"] - b["y0"]) for b in report["blocks"]]
    assert abs(kept["spp"] - sum(p * b["spp"] for p, b in zip(pixels, report["blocks"])) / sum(pixels)) < 1e-9
    assert [b["stopped"] for b in kept["blocks"]] == [b["reason"] == "criterion" for b in report["blocks"]]
    assert kept["processor_s"] > 0 and all(b["true"] >= 0 for b in kept["blocks"])'
touch mark && job >second
t "again: the same, and no picture is made" sh -c "cmp first second && [ -z \"\$(find work -newer mark -name '*.exr')\" ]"
echo "1..$n"
exit $bad
