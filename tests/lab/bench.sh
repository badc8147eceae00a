#!/bin/sh
# scripts/lab bench makes what its parts run, or says what cannot be made. `make` and what it makes are stand-ins here.
set -u
cd "$(dirname "$0")/../.." || exit 2
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0 bad=0
t() {
    n=$((n + 1)); what=$1; shift
    if "$@" >"$tmp/log" 2>&1; then echo "ok $n - $what"; else echo "not ok $n - $what"; sed 's/^/# /' "$tmp/log" "$tmp/out"; bad=1; fi
}
mkdir "$tmp/bin"
cat >"$tmp/bin/make" <<'S'
#!/bin/sh
for word; do last=$word; done
echo "$*" >"$MADE"
[ -z "${NO_MAKE:-}" ] || exit 2
mkdir -p "${last%/*}" && printf '#!/bin/sh\necho "{\\"two_ways\\": false}"\n' >"$last" && chmod +x "$last"
S
chmod +x "$tmp/bin/make"
bench() { env PATH="$tmp/bin:$PATH" MADE="$tmp/made" BUILD="$tmp/build" scripts/lab bench --quick --rounds 1 --only noise >"$tmp/out" 2>&1; }
t "a part is measured in a tree where nothing is built" bench
t "  …its program was made" grep -q " $tmp/build/bench/pt_noise\$" "$tmp/made"
t "  …and the table has its figure" grep -q 'median of these' "$tmp/out"
mkdir -p "$tmp/docs/results"
printf 'before\n<!-- lab: bench.page() -->\n<!-- lab: end -->\nafter\n' >"$tmp/docs/speed.md"
cat >"$tmp/docs/results/bench.json" <<'J'
{"noise": {"measured": {"command": "c", "date": "2020-01-02", "processor": "old one", "commit": "0ld", "load": 0}, "rows": [{"name": "gone", "value": 1}]},
 "start": {"measured": {"command": "c", "date": "2020-01-02", "processor": "old one", "commit": "0ld", "load": 0}, "rows": [{"name": "kept", "value": 2, "want": 3}]}}
J
t "figures are kept" env PATH="$tmp/bin:$PATH" MADE="$tmp/made" BUILD="$tmp/build" scripts/lab bench --quick --rounds 1 --only noise --write "$tmp/docs"
t "  …with command, date, processor and commit, beside those of other parts" python3 - "$tmp/docs/results/bench.json" <<'P'
import datetime, json, sys
parts = json.load(open(sys.argv[1]))
told = parts["noise"]["measured"]
assert list(parts) == ["noise", "start"] and parts["start"]["rows"][0]["value"] == 2
assert told["command"].startswith("scripts/lab bench --quick") and told["date"] == datetime.date.today().isoformat()
assert "processors" in told["processor"] and len(told["commit"]) >= 7
P
t "  …and fill the page" sh -c '[ "$(head -n 1 "$1")" = before ] && [ "$(tail -n 1 "$1")" = after ] && grep -q "median of these" "$1" && ! grep -q gone "$1"' - "$tmp/docs/speed.md"
t "  …where the first row of another run says so" grep -qF '| kept (from here: 2 January 2020, old one, commit 0ld, load before 0.00) | 2 |  |  | >= 3 | **no** |' "$tmp/docs/speed.md"
t "Embree 4 against 3: not without a second build, which is said" sh -c "env PATH='$tmp/bin:$PATH' MADE='$tmp/made' BUILD='$tmp/build' \
    scripts/lab bench --quick --rounds 1 --only embree | grep -q '| Embree 4 against 3 | not measured: no second build (tests/distributions/embree3'"
rm -r "$tmp/build"
NO_MAKE=1 && export NO_MAKE
t "what cannot be made is said" sh -c "! env PATH='$tmp/bin:$PATH' MADE='$tmp/made' BUILD='$tmp/build' scripts/lab bench --only noise,rays 2>'$tmp/out'"
t "  …in one line" grep -qx "lab bench: noise, rays cannot be made (make $tmp/build/bench/pt_noise $tmp/build/bench/pt_rays)" "$tmp/out"
echo "1..$n"
exit $bad
