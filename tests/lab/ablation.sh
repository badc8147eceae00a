#!/bin/sh
# scripts/lab ablation with a tiny plan: a line for each variant, nothing trained twice, a changed plan is refused.
. "$(dirname "$0")/../cli/ggn_setup"
ablate() { scripts/lab ablation --data tests/data/train-demo --out "$tmp/out" "$@" >"$tmp/table" 2>"$tmp/err"; }

cat >"$tmp/plan" <<'END'
# two variants
common --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 8 --steps-denoiser 5 --steps 10 --epoch-steps 10 -q
first
second --kr 4   # one change
END
ablate "$tmp/plan" && [ "$(grep -c '^| \(first\|second\) | ' "$tmp/table")" -eq 2 ] && grep -q '^| second | --kr 4 | [01]\.[0-9]* | ' "$tmp/table"
check "a table with a line for each variant" $?
grep '^| second' "$tmp/table" | awk -F'|' '{ for (i = 4; i <= 12; i++) if ($i !~ /[0-9]/ || $i ~ /nan/) exit 1; if ($10 <= 0 || $11 < 0) exit 1 }'
check "every figure is a number" $?
rm "$tmp/out/second.ggn" && cp "$tmp/out/first.ggn" "$tmp/kept" && touch -d '2001-01-01' "$tmp/out/first.ggn" &&
    ablate "$tmp/plan" && [ -e "$tmp/out/second.ggn" ] && [ "$(stat -c %Y "$tmp/out/first.ggn")" -lt 1000000000 ]
check "what is there is not trained again, what is missing is" $?
rm "$tmp/out/second.ggn" && ablate --table "$tmp/plan" && grep -q '^| first ' "$tmp/table" && ! grep -q '^| second ' "$tmp/table"
check "--table trains nothing" $?
sed -i 's/--kr 4/--kr 5/' "$tmp/plan"
! ablate "$tmp/plan" && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "second.ggn: trained with other options" "$tmp/err"
check "a plan that was changed is refused" $?
! ablate "$tmp/none" && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -q "no such plan" "$tmp/err"
check "no plan" $?
echo "1..$n"
exit $bad
