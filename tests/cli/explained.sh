#!/bin/sh
# scripts/lab explained: a law of the looks is found on scenes left out, noise is not, and what is missing is said.
cd "$(dirname "$0")/../.." || exit 2
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 bad=0
check() {
    n=$((n + 1))
    if [ "$2" -eq 0 ]; then echo "ok $n - $1"; else echo "not ok $n - $1"; bad=1; sed 's/^/# /' "$tmp/out" "$tmp/err"; fi
}
python3 - "$tmp" <<'END'
import json, random, sys
draw = random.Random(4)
for scene in "abc":
    looks = []
    for k in range(30):
        look = {key: 2 ** draw.uniform(-2, 2) for key in ("error", "halves", "crossed", "noisy", "true_denoised")}
        looks.append({**look, "block": k % 2, "spp": 2 ** (5 + k // 6), "true_blend": 1.5 * look["error"] * look["halves"] ** 0.5})
    json.dump(looks + [{"spp": 32, "block": 0, "error": 0}], open("%s/%s.high.json" % (sys.argv[1], scene), "w"))
END
scripts/lab explained "$tmp" >"$tmp/out" 2>"$tmp/err" && grep -q '; 90 looks at 6 blocks of 3 scenes, ' "$tmp/out"
check "looks that are whole are counted" $?
grep -q '^| halves, believed | 0.00 | 1.00 | ' "$tmp/out" && grep -Eq '^\| a constant \| 0\.[5-9][0-9] \| -?0\.0' "$tmp/out"
check "what follows from the looks is explained, a constant is not" $?
grep -Eq '^\| believed \| .* \| 0\.[4-6][0-9] \|$' "$tmp/out" && grep -Eq '^\| halves \| .* \| -?0\.0[0-9] \|$' "$tmp/out"
check "another truth has its own fit" $?
rm "$tmp"/[bc].high.json
! scripts/lab explained "$tmp" >"$tmp/out" 2>"$tmp/err" && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "no looks of two scenes" "$tmp/err"
check "one scene: one line" $?
echo "1..$n"
exit $bad
