#!/bin/sh
# lull-render --live, and python3 -m lull watch, which shows it: what is written while a render goes on, what the server answers and to
# whom, and that nothing outside its folder is read. In a browser: study/watch.sh.
. "$(dirname "$0")/lull_render_setup"
R="$P -q --size 48x32 --block 16 -t 2"
python=$(command -v /usr/bin/python3 || command -v python3)
package=$here/../../plugin-api/python

# --- lull-render --live ---
t "--live renders" $R "$scene" --spp-max 64 --reproducible --live -o live.exr --report live.json --preview live.png --stop-map live.csv
t "  …the same picture" sh -c "$R '$scene' --spp-max 64 --reproducible -o still.exr --report still.json && cmp live.exr still.exr"
t "  …and a report that says it is over" sh -c "! grep -q progress live.json"
t "while it goes on" "$python" - $R "$scene" -c null --spp-max 100000000 --live --report on.json --preview on.png --stop-map on.csv --stop-map map.png <<'EOF'
"""Reads report and stop map again and again: each is whole, samples grow, and Ctrl-C leaves the last."""
import json, os, signal, subprocess, sys, time

render = subprocess.Popen(sys.argv[1:])
seen, end = [], time.monotonic() + 300
while len(seen) < 3 and time.monotonic() < end and render.poll() is None:
    time.sleep(0.05)
    if os.path.exists("on.json"):
        report = json.load(open("on.json"))
        samples = report["totals"]["samples"]
        if not seen or samples != seen[-1]:
            seen.append(samples)
            now = report["progress"]
            assert 0 <= now["share"] <= 1 and (now["left_s"] is None or now["left_s"] >= 0) and now["known"] in (True, False), now
            assert len(open("on.csv").read().split(";")) == 8 and open("map.png", "rb").read(8) == b"\x89PNG\r\n\x1a\n"
            assert all(b["reason"] == "none" for b in report["blocks"]), report["blocks"]
render.send_signal(signal.SIGINT)
assert render.wait() == 130 and seen == sorted(seen) and len(seen) == 3, (render.returncode, seen)
report = json.load(open("on.json"))
assert "progress" not in report and report["interrupted"] is True, report
assert not [name for name in os.listdir(".") if "tmp" in name], os.listdir(".")
EOF
refused "--live belongs to --report, --stop-map and --preview" "$scene" -q --size 8x8 --spp 1 --live -o x.exr
refused "--live belongs to" "$scene" -q --size 8x8 --quote --live

# --- python3 -m lull watch ---
t "the page's page is the host library's" cmp "$package/lull/page.html" "$here/../../plugin-api/host/page.html"
"$P" "$scene" -q --size 48x32 --block 16 --spp-max 64 --preview p.png --report r.json --html p.html
t "what the server answers" env PYTHONPATH="$package" "$python" "$here/watch.py"
bad_words() { # bad_words WORDS ARGUMENT...: one line with them, exit status 2
    words=$1; shift
    PYTHONPATH=$package "$python" -m lull watch "$@" >out 2>err; [ $? -eq 2 ] && [ ! -s out ] && [ "$(wc -l <err)" -eq 1 ] && grep -q -e "$words" err
}
t "a folder that is not there" bad_words "nowhere/x: no such folder, and no name of a report" nowhere/x
t "a file that is no report" bad_words "p.png: no such folder, and no name of a report" p.png
t "no folder" bad_words "required: FOLDER|REPORT.json"
t "a port that is none" bad_words "port 65536: expected 0 to 65535" . --port 65536
t "a port that is taken" "$python" - <<EOF
import os, socket, subprocess
with socket.create_server(("127.0.0.1", 0)) as taken:
    done = subprocess.run(["$python", "-m", "lull", "watch", ".", "--port", str(taken.getsockname()[1])], capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": "$package"})
assert done.returncode == 2 and done.stderr.count("\n") == 1 and "in use" in done.stderr, done
EOF
echo "1..$n"
exit $bad
