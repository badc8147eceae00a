#!/bin/sh
# `ggn stimuli` by itself; what it makes of pictures, kinds and clips is tested through `lull-study init` (lull_study_views.sh).
. "$(dirname "$0")/ggn_setup"
view=tests/data/recorded/train/one-view0
mkdir "$tmp/pictures"
for name in reference a b; do oiiotool --create 8x8 3 --addc 0.5 -d uint8 -o "$tmp/pictures/$name.png"; done
"$ggn" stimuli $view:0-1 -o "$tmp/made" --spacing 1 >"$tmp/out" 2>"$tmp/err" && cp "$tmp/out" "$tmp/json" && python3 - "$tmp" >"$tmp/out" 2>&1 <<'END2'
import json, os, sys
(view,) = json.load(open(sys.argv[1] + "/json"))["views"]
assert view["name"] == "one-view0" and [b["id"] for b in view["blocks"]] == [0, 1], view
levels = view["blocks"][0]["levels"]
assert all(b >= 1.99 * a for a, b in zip(levels, levels[1:])) and len(levels) > 3, levels
wanted = {f"b{b['id']}-{what}.png" for b in view["blocks"] for what in ("reference", "heavy", *b["levels"])}
assert set(os.listdir(sys.argv[1] + "/made/v0")) == wanted
END2
check "blocks of a recording: the pictures that the JSON names, and no other" $?
"$ggn" stimuli "$tmp/pictures" -o "$tmp/whole" --task validation >"$tmp/out" 2>"$tmp/err" && tr -d '\t\n' <"$tmp/out" |
    grep -qx '{"conditions":\["a", "b"\],"views":\[{"name":"pictures","width":8,"height":8}\]}' && [ -e "$tmp/whole/v0/heavy.png" ]
check "a validation: whole pictures and their conditions" $?
fails "no folder is named" "--output DIR is needed" "$ggn" stimuli $view
fails "kinds of a validation" "--kinds does nothing in this task (validation)" "$ggn" stimuli "$tmp/pictures" -o "$tmp/x" --task validation --kinds noisy
fails "no such task" "--task taste: expected adjustment, 2ifc or validation" "$ggn" stimuli $view -o "$tmp/x" --task taste
fails "a validation of a recording" "a validation takes folders of pictures" "$ggn" stimuli $view -o "$tmp/x" --task validation
fails "blocks of a validation" "shows whole pictures, not blocks" "$ggn" stimuli "$tmp/pictures:0" -o "$tmp/x" --task validation
fails "a view among what is made" "lies among the pictures" "$ggn" stimuli "$tmp/made/v0" -o "$tmp/made"
echo "1..$n"
exit $bad
