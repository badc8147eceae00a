#!/bin/sh
# scripts/lab scale: a recording in, times for numbers of cores out; what cannot be read is named.
. "$(dirname "$0")/../cli/lull_render_setup"
M=$here/../../scripts/lab
refuses() { # refuses TEXT ARGUMENTS...: exit status 2, one line that contains TEXT
    n=$((n + 1)); text=$1; shift
    "$M" scale "$@" >out 2>err; status=$?
    if [ $status -eq 2 ] && [ "$(wc -l <err)" -eq 1 ] && grep -qF -- "$text" err; then echo "ok $n - refused: $text"
    else echo "not ok $n - refused: $text (status $status)"; sed 's/^/# /' err; bad=1; fi
}
t "--help" sh -c "'$M' scale --help | grep -q -- --measured"
t "a recording" "$P" "$scene" -q --size 48x24 --block 24 --sampler independent --sequence rec --levels geometric:16:64:2 --reference-spp 64
refuses "rec: " rec
refuses "nowhere: " nowhere
t "labelled" "${P%/*}/ggn" label rec
t "the table has a line for each number of cores" sh -c "'$M' scale --frames 800x600 --cores 1,4,100,1000 rec | grep -c '^| 800x600' | grep -qx 4"
# [seconds, efficiency] of each number of cores
"$M" scale --work 1000 --frames 800x600 --cores 1,4,100,1000 --json rec >on.json
t "one core loses nothing, more are never slower and never more than perfect" python3 -c '
import json
rows = json.load(open("on.json"))
assert abs(rows[0]["efficiency"] - 1) < 1e-6, rows[0]
assert all(a["seconds"] >= b["seconds"] for a, b in zip(rows, rows[1:])), rows
assert all(r["efficiency"] <= 1 + 1e-6 for r in rows), rows
assert rows[0]["bytes"] == 0 and rows[3]["bytes"] > 0, rows'
sed 's/"check_s": [^,]*/"check_s": 0.5/' "$here/../../scripts/scale.json" >dear.json
"$M" scale --measured dear.json --work 1000 --threads 8 --frames 1600x1200 --cores 80 --json rec >dear.1
"$M" scale --work 1000 --threads 8 --frames 1600x1200 --cores 80 --json rec >dear.2
t "a dear criterion takes a larger part of the time" python3 -c '
import json
assert json.load(open("dear.1"))[0]["criterion"] > json.load(open("dear.2"))[0]["criterion"] > 0'
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_plm=isolated # as in mpi_setup
t "this machine: measured beside predicted, for 1 to 8 processes" sh -c "'$M' scale --here $scene --size 40x40 --spp 2 --program $P | grep -c '^| [1248] |' \
    | grep -qx $(command -v mpirun >/dev/null 2>&1 && [ -f "${P%/bin/*}/lib/lull/modules/lull-mpi.so" ] && echo 4 || echo 0)"
refuses "a recording or --here SCENE is needed"
refuses "nowhere.pbrt" --here nowhere.pbrt --program "$P"
exit $bad
