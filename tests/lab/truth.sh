#!/bin/sh
# scripts/lab record and truth: a small plan from recording to table; ggn visible judges many pictures and sizes at once.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
if ! /usr/bin/python3 -c 'import numpy' 2>/dev/null; then echo "ok 1 # SKIP no numpy (python3-numpy)"; echo "1..1"; exit 0; fi
ggn=$PWD/$BUILD/bin/ggn
cat >"$tmp/plan" <<'END'
truth ordinary texture 40x40 40 1 48 128   # a comment
truth ordinary cornell-box 40x40 40 1 48 128
truth hands ../shared/scenes/none/none.pbrt 40x40 40 1 48 128
other rare cornell-box 16x16 16 2 24 0 --max-depth 2
END
record="scripts/lab record $tmp/rec --plan $tmp/plan --threads 2"
truth="scripts/lab truth $tmp/rec --plan $tmp/plan --sizes 40 16"
t "what is recorded, and what is not yet" sh -c "$record --list 2>$tmp/err | grep -c '^missing ' | grep -qx 4 && grep -q 'none/none.pbrt is not here: left out' $tmp/err"
t "nothing recorded: one line says how" sh -c "! $truth 2>$tmp/err && tail -n 1 $tmp/err | grep -q '^lab truth: no scene is recorded in .*: scripts/lab record --only truth'"
t "a plan is recorded, seed by seed" sh -c "$record >$tmp/out 2>/dev/null && grep -q '^4 of 4: other/cornell-box/2; to go: 0:00 h' $tmp/out"
t "  …with two references of the first seed, where they are asked for" sh -c "[ \$(find $tmp/rec/truth/texture/1 -name 'reference*' | wc -l) -ge 2 ] &&
    [ \$(find $tmp/rec/other -name 'reference*' | wc -l) -eq 0 ]"
t "  …and not again" sh -c "$record 2>/dev/null | grep -c . | grep -qx 0 && $record --list 2>/dev/null | grep -c '^whole ' | grep -qx 4"
t "a line that lacks a field is named" sh -c "echo 'truth ordinary chess 40x40' >$tmp/bad; ! scripts/lab record --plan $tmp/bad --list 2>$tmp/err && grep -q 'bad:1: expected SET KIND' $tmp/err"
t "from recordings to a table" sh -c "$truth --criteria fixed:spp=20 observer null >$tmp/table 2>$tmp/err"
t "  …which asks the criteria about whole blocks, as a renderer does" sh -c "grep -q '^| fixed:spp=20 | 16 px | ours | 4 of 4 | ' $tmp/table &&
    grep -q '^| null | 40 px | ours | 0 of 1 | ' $tmp/table && grep -q '^| observer | 40 px ' $tmp/table"
t "  …at the samples that they have named" sh -c "mkdir $tmp/docs && $truth --criteria fixed:spp=33 --write $tmp/docs >/dev/null 2>&1 &&
    python3 -c 'import json; f = json.load(open(\"$tmp/docs/results/truth.json\")); assert {b[0] for s in f[\"scenes\"].values() for k, v in s.items() if k.startswith(\"fixed\") for b in v} == {38}, f'"
t "  …with the noise of the references, and a mark at what was trained on" grep -q 'told by the other: texture [0-9.]*, cornell-box\\\* [0-9.]*\.$' "$tmp/table"

# --- ggn visible: one call for many ---
for i in 1 2 3; do oiiotool --pattern constant:color=.5,.5,.5 96x64 3 --noise:type=gaussian:mean=0:stddev=0.0${i}:seed=$i -d uint8 -o "$tmp/$i.png" >/dev/null 2>&1; done
"$ggn" visible "$tmp/1.png" "$tmp/2.png" "$tmp/3.png" --block 64,32 --json >"$tmp/many.json"
t "ggn visible tells of many pictures and sizes what it tells of each" python3 - "$ggn" "$tmp" <<'END'
import json, subprocess, sys
ggn, tmp = sys.argv[1:]
many = json.load(open(tmp + "/many.json"))
assert [(r["image"], r["block"]) for r in many] == [(0, 64), (0, 32), (1, 64), (1, 32)], many
for r in many:
    one = json.loads(subprocess.run([ggn, "visible", tmp + "/1.png", "%s/%d.png" % (tmp, r["image"] + 2), "--block", str(r["block"]), "--json"],
                                    capture_output=True, check=True).stdout)
    assert one == {k: v for k, v in r.items() if k in one} and one["worst"] > 0, (one, r)
END
refuses() { "$ggn" visible "$@" >"$tmp/out" 2>"$tmp/err"; [ $? -eq 2 ] && [ ! -s "$tmp/out" ] && [ "$(wc -l <"$tmp/err")" -eq 1 ]; }
t "  …a map is of one" refuses "$tmp/1.png" "$tmp/2.png" "$tmp/3.png" -o "$tmp/map.png"
t "  …sizes are numbers" refuses "$tmp/1.png" "$tmp/2.png" --block 64,x
t "  …a picture that cannot be read: nothing is said of the others" refuses "$tmp/1.png" "$tmp/2.png" "$tmp/none.png"
echo "1..$n"
