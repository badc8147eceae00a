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
rm -r "$tmp/build"
NO_MAKE=1 && export NO_MAKE
t "what cannot be made is said" sh -c "! env PATH='$tmp/bin:$PATH' MADE='$tmp/made' BUILD='$tmp/build' scripts/lab bench --only noise,rays 2>'$tmp/out'"
t "  …in one line" grep -qx "lab bench: noise, rays cannot be made (make $tmp/build/bench/pt_noise $tmp/build/bench/pt_rays)" "$tmp/out"
echo "1..$n"
exit $bad
