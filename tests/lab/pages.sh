#!/bin/sh
# scripts/lab: its jobs, options and errors; every generated page is what the templates make of docs/results/, and README tells none of
# those figures by hand.
cd "$(dirname "$0")/../.." || exit 2
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 failed=0
t() { # t NAME COMMAND...: passes if the command does
    n=$((n + 1)) name=$1
    shift
    if "$@" >"$tmp/log" 2>&1; then echo "ok $n - $name"; else
        echo "not ok $n - $name"
        tail -n 12 "$tmp/log" | sed 's/^/#   /'
        failed=1
    fi
}
refuses() { # refuses WORDS ARGUMENTS...: status 2 and one line with the words
    words=$1
    shift
    scripts/lab "$@" 2>"$tmp/err"
    [ $? -eq 2 ] && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -qF -e "$words" "$tmp/err"
}
says() { # says LINE: the last check of the copy ended with status 1 and said that alone
    scripts/lab pages --check --docs "$tmp/tree/docs" 2>"$tmp/err"
    [ $? -eq 1 ] && [ "$(wc -l <"$tmp/err")" -eq 1 ] && grep -qE -e "$1" "$tmp/err"
}
helps() { for job in $(scripts/lab --help | sed -n 's/^  \([a-z-]*\)  .*/\1/p'); do scripts/lab "$job" --help | grep -q "^usage: scripts/lab $job" || exit 1; done; }
t "--help names twenty-two jobs" test "$(scripts/lab --help | grep -c '^  [a-z-]*  ')" -eq 22
t "  …each with its own" helps
t "no such job: one line" refuses "expected record, data-set, cost, " nonsense
t "no such option: one line" refuses "lab pages: unrecognized arguments: --what" pages --what
t "no such step: one line" refuses "expected some of replay" cost --only drew
mkdir "$tmp/without" && echo 'raise ImportError("none here")' >"$tmp/without/jinja2.py"
export PYTHONPATH="$tmp/without"
t "without jinja2: one line says what to install" refuses "apt-get install python3-jinja2" pages --check
unset PYTHONPATH
t "every page is what the templates make of the figures" scripts/lab pages --check

mkdir -p "$tmp/tree/docs" "$tmp/tree/ggn/sight"
cp -r docs/*.md docs/results docs/notebook "$tmp/tree/docs" && cp README.md "$tmp/tree" && cp ggn/README.md "$tmp/tree/ggn" && cp ggn/sight/README.md "$tmp/tree/ggn/sight"
figure=$(grep -o '[0-9]\.[0-9][0-9][0-9]' "$tmp/tree/docs/results/decisions.md" | head -n 1)
echo "AUC $figure against people" >>"$tmp/tree/README.md"
t "a figure of the tables in README is told" says "README.md tells $figure, a figure of docs/results.md or docs/results/decisions.md"
cp README.md "$tmp/tree"
for page in docs/results.md docs/results/decisions.md docs/results/speed.md ggn/sight/README.md; do
    sed -i "/^# \(Results\|How well the criteria\)/,\$s/ 0\.[0-9]/ 7.1/; /<!-- lab: [a-z]*\./,/<!-- lab: end/s/ 0\.[0-9]/ 7.1/" "$tmp/tree/$page"
    t "a figure that was changed in $page is told" says "$page is not what its template makes of the figures"
    t "  …and mended" sh -c "scripts/lab pages --docs '$tmp/tree/docs' && cmp '$tmp/tree/$page' $page"
done
sed -i 's/"samples_ratio": 1\./"samples_ratio": 3./' "$tmp/tree/docs/results/agreement.json"
scripts/lab pages --check --docs "$tmp/tree/docs" 2>"$tmp/err"
t "other figures make other pages" test "$(cut -d' ' -f3 "$tmp/err" | xargs -n 1 basename | sort | tr '\n' ' ')" = "README.md decisions.md "
sed -i 's/"people"/"somebody"/' "$tmp/tree/docs/results/agreement.json"
t "figures that lack are one line" refuses "results/decisions.md: its figures are not whole" pages --docs "$tmp/tree/docs"

mkdir -p "$tmp/out/results" && cp docs/results/cost.json docs/results/sources.json "$tmp/out/results"
t "lab cost draws from the figures" scripts/lab cost --only draw --out "$tmp/out"
t "  …the same page" diff "$tmp/out/results/cost.md" docs/results/cost.md
t "  …and every picture of it" sh -c 'for p in $(grep -o "](cost-[a-z-]*\.png)" "$1/results/cost.md" | tr -d "]()"); do [ -s "docs/results/$p" ] || { echo "$p"; exit 1; }; done' - "$tmp/out"
mkdir -p "$tmp/some/results" && python3 - "$tmp/some/results/cost.json" <<'P'
import json, sys
figures = json.load(open("docs/results/cost.json"))
json.dump({k: v for k, v in figures.items() if k not in ("cadence", "bench", "early", "real", "commits")}, open(sys.argv[1], "w"))
P
t "steps of lab cost that were not measured are told" sh -c 'scripts/lab pages --docs "$1" && grep -q "^Not measured in this run" "$1/results/cost.md"' - "$tmp/some"
echo "1..$n"
exit $failed
