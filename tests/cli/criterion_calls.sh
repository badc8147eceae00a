#!/bin/sh
# What the path tracer does with a criterion, written down by one that decides by a known rule (abi/plugins/diary.c): its life, when it
# is asked about which block, what it sees, what becomes of its answers.
. "$(dirname "$0")/lull_render_setup"
D=${P%/bin/*}/tests/abi/plugins/diary.so
export LULL_DIARY="$dir/diary"

cat >check.py <<'P'
# check.py REPORT STOP-MAP SPP-MIN SPP-MAX REOPENS SAID: the diary of a finished render of 6 blocks, held against the rule
import json, re, subprocess, sys
report, stops = json.load(open(sys.argv[1])), open(sys.argv[2]).read()
first, last, reopens, said = int(sys.argv[3]), int(sys.argv[4]), int(sys.argv[5]), open(sys.argv[6]).read()
diary = open("diary").read().split("\n")[:-1]
assert [diary[0], diary[-2], diary[-1]] == ["create", "end", "destroy"], diary
assert diary[1] == "begin 48x32 blocks 6 min %d max %d seed 5 budget 0 clamp 0 exposure 1 flags 6" % (first, last), diary[1]
asked = [re.fullmatch(r"ask (\d+) spp (\d+) flags (\d) at (\S+) red (\S+)", l).groups() for l in diary[2:-2]]
for b in range(6):
    x, y = b % 3 * 16, b // 3 * 16
    end, spp, opened, want = 16 * (1 + b % 3), min(max(first, 4), last), False, [] # 4: its first_spp, asking before is useless
    mine = [(int(a[1]), int(a[2])) for a in asked if int(a[0]) == b]
    assert all(a[3] == "%d,%d,%d,%d" % (x, y, x + 16, y + 16) for a in asked if int(a[0]) == b)
    while True:
        want.append((spp, 2 if spp == last else 0))
        if spp < end and spp < last:
            spp = min(spp + 8, last) # as it wished
        elif reopens and spp < last and not opened:
            want.append((spp, 1)) # stopped, asked once more, opened
            opened, end, spp = True, spp + 1, min(spp + 8, last)
        else:
            break
    again = [a for a in mine[len(want):]] # stopped for good: only who reopens is asked again
    assert mine[:len(want)] == want and all(reopens and a == (spp, 1) for a in again), (b, mine, want)
    told = report["blocks"][b]
    assert told["spp"] == spp and told["checks"] == len(mine), (told, mine)
    assert told["reason"] == ("criterion" if spp >= 16 * (1 + b % 3) else "spp-max"), (told, spp)
    assert abs(told["p_noisy"] - 1 / (b + 2)) < 1e-12 and abs(told["error"] - 1 / spp) < 1e-12, told
    # what it saw last is what the image has
    red = float([a[4] for a in asked if int(a[0]) == b][-1])
    stats = subprocess.run(["oiiotool", "a.exr", "--cut", "16x16+%d+%d" % (x, y), "--printstats"], capture_output=True, text=True).stdout
    shown = float(re.search(r"Stats Avg: (\S+)", stats).group(1))
    assert abs(shown - red) < 2e-3 * red + 1e-5, (shown, red)
spps = [b["spp"] for b in report["blocks"]]
assert stops.strip().split(";")[1:-1] == [str(s) for s in spps], stops
lines = said.split("\n")[:-1]
told = [l.rpartition(": ")[2] for l in lines[:-1] if l.startswith("lull-render: criterion diary")]
assert len(told) == len(lines) - 1 > 1 and told[0] == "nothing to worry about" and set(told[1:]) == {"watch out"}, said # news once
reasons = [b["reason"] for b in report["blocks"]]
tail = "blocks:" + "".join(" %d %s" % (reasons.count(r), r) for r in ("criterion", "spp-max") if r in reasons)
assert lines[-1].startswith("lull-render: %.0f spp on average, " % (sum(spps) / 6)) and lines[-1].endswith(tail), lines[-1]
P
run() { # run CRITERION ARGUMENTS...
    criterion=$1; shift
    rm -f diary
    "$P" "$scene" --size 48x32 --block 16 --seed 5 -c "$D:$criterion" -o a.exr --report a.json --stop-map a.csv "$@" 2>said
}
for threads in 1 3; do
    run diary --spp-min 8 --spp-max 40 -t $threads
    t "asked and heard, $threads threads" python3 check.py a.json a.csv 8 40 0 said
done
run diary --spp-min 4 --spp-max 1000
t "no longer than it wishes" python3 check.py a.json a.csv 4 1000 0 said
run diary --spp-min 1 --spp-max 40
t "not before its first_spp" python3 check.py a.json a.csv 1 40 0 said
run diary --spp-min 1 --spp-max 3
t "  …but once where the render ends before" python3 check.py a.json a.csv 1 3 0 said
run diary-reopens --spp-min 8 --spp-max 40
t "who reopens is asked about stopped blocks, and only then" python3 check.py a.json a.csv 8 40 1 said

# --- its end, however the render ends ---
ends() { [ "$(head -n 1 diary)" = create ] && [ "$(tail -n 1 diary)" = destroy ] && [ "$(tail -n 2 diary | head -n 1)" = end ] && [ "$(grep -cv ask diary)" -eq 4 ]; }
run diary --spp-min 8 --spp-max 40 -q
t "-q: neither its warnings nor the summary are said" test ! -s said
run diary --spp-max 100000 --spp-min 90000 --time-budget 0.2
t "a time budget: the frame ends, the criterion too" ends
t "  …and it is told the budget" grep -q '^begin .* budget 0.2 ' diary
"$P" "$scene" -q --size 48x32 --block 16 -c "$D:diary" --spp-min 50000 --spp-max 100000 -o b.exr --checkpoint b.ckp --checkpoint-every 0 2>said &
pid=$!
until [ -s b.ckp ] || ! kill -0 $pid; do sleep 0.1; done
kill -INT $pid; wait $pid
t "interrupted: status 130" test $? -eq 130
t "  …the criterion has ended" sh -c "tail -n 1 diary | grep -qx destroy"
rm -f diary
"$P" "$scene" --explain -c "$D:diary" >out 2>said
t "--explain renders nothing" sh -c "! grep -q ask diary"
t "  …and leaves nobody behind" sh -c "[ \$(grep -c create diary) -eq \$(grep -c destroy diary) ]"
exit $bad
