#!/bin/sh
# Criteria that are Python files in hosts written in C: the stops of the same criterion in C, everything that a criterion is part of,
# scripts that are wrong or hostile, and that nothing of them outlives the host.
. "$(dirname "$0")/../hosts/find-python"
LULL_PYTHON=$("$python" -c 'import sys; print(sys.executable)')
export LULL_PYTHON
. "$(dirname "$0")/lull_render_setup"
check=${P%/*}/lull-check
example=$here/../../plugin-api/examples/dammertz.py
blocks="$scene --block 32 --spp-max 600 -q"
says() { "$LULL_PYTHON" -c "import json, sys; r = json.load(open(sys.argv[1])); print($2)" "$1"; }
stops() { says "$1" '[(b["spp"], b["checks"], b["reason"]) for b in r["blocks"]]'; }
same_stops() { # same_stops ARGUMENTS...: by halfbuf and by the example
    "$P" $blocks -c halfbuf "$@" -o a.exr --report a.json && "$P" $blocks -c "$example" "$@" -o b.exr --report b.json || return 1
    stops a.json >a.txt && stops b.json >b.txt && cat a.txt && cmp a.txt b.txt && ! grep -q "spp-max" a.txt
}
t "the example stops every block where halfbuf does, at as many checks" same_stops -p threshold=0.01
"$LULL_PYTHON" - <<'E2'
import struct, zlib
def chunk(kind, data): return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
rows = b"".join(b"\0" + bytes(255 if x < 20 else 60 if y > 40 else 0 for x in range(64)) for y in range(48))
open("mask.png", "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 64, 48, 8, 0, 0, 0, 0)) +
                             chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
E2
t "  ...under a mask, of several instances, too" same_stops -p threshold=0.04 --size 64x48 --mask mask.png
even="$scene --block 32 --spp 40 -q"
t "--spp asks it, for the report" sh -c "'$P' $even -c halfbuf -o a.exr --report a.json && '$P' $even -c '$example' -o b.exr --report b.json"
close() { says a.json '[b["error"] for b in r["blocks"]]' >a.txt; says b.json '[b["error"] for b in r["blocks"]]' >b.txt
    "$LULL_PYTHON" -c 'a, b = (eval(open(f).read()) for f in ("a.txt", "b.txt")); print(a, b); exit(not all(x > 0 and abs(x - y) <= 1e-12 * x for x, y in zip(a, b)))'; }
t "  ...which has the same errors" close
cp "$example" mine.py
t "resumed it is the uninterrupted render" sh -c "'$P' $blocks -c mine.py -p threshold=0.01 -o whole.exr --reproducible"
interrupted r.ckp $blocks -c mine.py -p threshold=0.01 -o part.exr --reproducible >/dev/null 2>&1
t "  ...byte for byte" sh -c "'$P' $blocks -c mine.py -p threshold=0.01 -o part.exr --reproducible --checkpoint r.ckp --resume && cmp whole.exr part.exr"
echo "# another" >>mine.py
refused "r.ckp" $blocks -c mine.py -p threshold=0.01 --checkpoint r.ckp --resume -o part.exr
t "a quote, a stop map, frames" sh -c "'$P' $blocks -c mine.py --quote && '$P' $blocks -c mine.py --stop-map s.csv -o s.exr && [ -s s.csv ] &&
    cp '$scene' f1.pbrt && cp '$scene' f2.pbrt && '$P' f%d.pbrt --frames 1-2 --block 32 -q -c mine.py -o f%d.exr && [ -s f2.exr ]"
t "two processes render the pixels of one" sh -c "command -v mpirun >/dev/null || exit 0; OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_plm=isolated \
    mpirun --oversubscribe -n 2 '$P' $blocks -c mine.py -p threshold=0.01 -o mpi.exr --reproducible && '$P' $blocks -c mine.py -p threshold=0.01 -o one.exr --reproducible && cmp one.exr mpi.exr"
ln -s mine.py link.json
refused "link.json" $blocks -c mine.py --report link.json
refused "no parameter 'thresh'" $blocks -c mine.py -p thresh=1
refused "threshold: 'x' is not a number" $blocks -c mine.py -p threshold=x
refused "./none.py: no such file" $blocks -c none.py
refused "holds no criterion with the id other, but mine" $blocks -c mine.py:other
mkdir folder.py
mkfifo fifo.py
refused "./folder.py: not a file" $blocks -c folder.py
refused "./fifo.py: not a file" $blocks -c fifo.py
mkdir "ä b"
cp mine.py "ä b/größer als.py"
t "a path with blanks and other letters" "$P" $blocks -c "ä b/größer als.py" -o b.exr --report b.json
t "  ...is an id of those that there are" sh -c "grep -q '\"id\":[[:space:]]*\"gr-er-als\"' b.json"

# --- what is wrong when it is read: one line, status 2
wrong() { # wrong TEXT: of the script on standard input
    cat >wrong.py
    refused "$1" $blocks -c wrong.py
}
wrong "wrong.py:1: SyntaxError: '(' was never closed in 'def check(block:'" <<'E2'
def check(block:
E2
wrong "wrong.py: it has no check(block)" </dev/null
wrong "wrong.py: python3 ended its process: exit status 1" <<'E2'
import os; os.closerange(3, 100)
def check(block): return True
E2
wrong "wrong.py: check is 3: expected a function" <<'E2'
check = 3
E2
wrong "wrong.py:2: ModuleNotFoundError: No module named 'no_such_module' in 'import no_such_module'" <<'E2'
import os
import no_such_module
E2
wrong "wrong.py:2: ZeroDivisionError: division by zero in 'x = 1 / 0'" <<'E2'
# é
x = 1 / 0
E2
wrong "wrong.py:1: SystemExit: 3" <<'E2'
raise SystemExit(3)
E2
wrong "python3 ended its process: exit status 0" <<'E2'
import os; os._exit(0)
E2
for line in "requires = 'color'" "requires = ['colour']" "uses = 3" "first_spp = 0" "limit_s = None" "name = 3" "parameters = {'a': None}" \
    "parameters = {'A b': 1.0}" "parameters = {f'a{i}': 1 for i in range(17)}" "parameters = {'a': float('nan')}"; do
    printf '%s\ndef check(block):\n    return True\n' "$line" >text
    wrong "wrong.py: " <text
done
printf '\000\001' >text
wrong "wrong.py: " <text
printf 'x = "\351"\n' >text
wrong "wrong.py:1: SyntaxError: (unicode error) 'utf-8' codec can't decode byte 0xe9" <text

# --- what is wrong when it is asked: the blocks go on, one line and the report say why
hostile() { # hostile TEXT: of the check on standard input
    { printf 'import ctypes, os, re, signal, sys, time\nrequires = ["color", "half"]\nlimit_s = %s\n' "${limit:-600}"; cat; } >hostile.py
    "$P" "$scene" --block 32 --spp-max "${most:-20}" -q -c hostile.py -o h.exr --report h.json >out 2>err || { cat err; return 1; }
    cat err h.json
    [ "$(wc -l <err)" = 1 ] && [ ! -s out ] && grep -qF -- "lull-render: criterion hostile: " err && grep -qF -- "$1" err || return 1
    [ "$(says h.json '{b["reason"] for b in r["blocks"]}')" = "{'spp-max'}" ] && says h.json '" ".join(r["criterion"]["messages"])' | grep -qF -- "$1"
}
while IFS='|' read -r text body; do
    printf 'def check(block):\n    %s\n' "$body" >body
    t "asked: $body" hostile "$text" <body
done <<'E2'
hostile.py:5: ZeroDivisionError: division by zero in 'return 1 / 0'|return 1 / 0
hostile.py:5: ValueError: cannot reshape|return block.color.reshape(7)
hostile.py:4: check returned None: expected True (stop)|pass
hostile.py:4: check returned 'stop'|return "stop"
hostile.py:4: check returned nan|return float("nan")
hostile.py:4: check returned inf|return float("inf")
hostile.py:4: check returned -5|return -5
hostile.py:4: check returned 16|return block.spp
hostile.py:4: check returned ()|return ()
hostile.py:4: check returned (True, -1)|return True, -1
hostile.py:4: check returned (True, 1, 2, 3)|return True, 1, 2, 3
hostile.py:4: check returned array(|return block.color
hostile.py:5: SystemExit: 3|sys.exit(3)
hostile.py:5: KeyboardInterrupt|os.kill(os.getpid(), signal.SIGINT); time.sleep(600)
hostile.py:5: MemoryError|return bytearray(10 ** 15)
hostile.py:5: RecursionError|return check(block)
python3 ended its process: exit status 3|os._exit(3)
python3 ended its process: signal 11|ctypes.string_at(0)
python3 ended its process: |os.closerange(0, 100)
an answer that nobody had asked for|os.write(4, b"abc"); return True
python3 ended its process: exit status 5|os.fork() or time.sleep(1000); os._exit(5)
E2
endless='while True: x = 1'
printf 'def check(block):\n    %s\n' "$endless" >body
limit=1 t "asked: $endless" hostile "hostile.py:5: TimeoutError: it takes too long" <body
printf 'def check(block):\n    signal.signal(signal.SIGALRM, signal.SIG_IGN)\n    %s\n' "$endless" >body
limit=1 most=17 t "asked: the same without an alarm" hostile "python3 has not answered for 6 s" <body
meek() { # meek: the script on standard input stops every block at 30 samples and says nothing
    cat >meek.py
    "$P" "$scene" --block 32 --spp-max 64 -q -c meek.py -o m.exr --report m.json >out 2>err || return 1
    cat err m.json
    [ ! -s out ] && ! grep -q lull-render err && [ "$(says m.json '{b["reason"] for b in r["blocks"]}')" = "{'criterion'}" ]
}
echo 'x = 1' >beside.py
while read -r body; do
    printf 'import os, sys, threading, time\nrequires = ["color", "half"]\ndef check(block):\n    %s\n    return 30 if block.spp < 30 else True\n' "$body" >body
    t "asked: $body" meek <body
done <<'E2'
print("x" * 100000)
os.write(1, b"x" * 100000)
os.fork()
block.color[:] = 0; block.half.fill(7)
sys.stdout.close(); sys.stderr.close()
threading.Thread(target=lambda: time.sleep(1000)).start()
os.chdir("/"); os.environ.clear()
import beside; os.chdir("/")
E2
mkdir path && echo 'x = 1' >path/on_path.py
printf 'import on_path\nrequires = ["color", "half"]\ndef check(block):\n    return 30 if block.spp < 30 else True\n' >body
render=$P
printf '#!/bin/sh\nPYTHONPATH=path PYTHONHOME=/none PYTHONIOENCODING=x PYTHONHASHSEED=x PYTHONVERBOSE=1 exec "%s" "$@"\n' "$render" >others && chmod +x others
quiet() { meek && [ ! -s err ]; }
P=./others t "of the variables for other Pythons it knows PYTHONPATH alone" quiet <body
P=$render
printf 'requires = ["color"]\ndef check(block):\n    print("x" * 100)\n    return block.spp > 20\n' >prints.py
t "no standard streams" sh -c "'$P' $blocks -c prints.py -o n.exr --report n.json <&- >&- 2>&-"
t "  ...and the blocks stop" [ "$(says n.json '{b["reason"] for b in r["blocks"]}')" = "{'criterion'}" ]

# --- without what it takes
rm -f out err
none() { # none TEXT: the criterion is refused in one line
    refused "$1" $blocks -c mine.py
}
printf '#!/bin/sh\nexec "%s" -S -E "$@"\n' "$LULL_PYTHON" >bare && chmod +x bare
own=$LULL_PYTHON
LULL_PYTHON=$PWD/bare none "needs numpy, which"
LULL_PYTHON=/no/such/python3 none "cannot run /no/such/python3: No such file or directory"
LULL_PYTHON=$PWD/fifo.py none "cannot run $PWD/fifo.py: Permission denied"
LULL_PYTHON=false none "python3 ended its process: exit status 1"
LULL_PYTHON=$own
printf '#!/bin/sh\nunset LULL_PYTHON\nPATH=/nonexistent exec "%s" "$@"\n' "$render" >pathless && chmod +x pathless
P=./pathless none "cannot run python3: No such file or directory"
mkdir bin && cp "$render" bin
P=bin/lull-render none "no modules/lull-python.so in the criterion directories"
P=$render

# --- nobody outlives the host, however it ends
cat >stay.py <<'E2'
import os, re, subprocess
requires = ["color", "half"]
def check(block):
    child = subprocess.Popen(["sleep", "1000"])
    with open("pids.part", "w") as file:
        file.write(f"{os.getpid()} {child.pid}")
    os.rename("pids.part", "pids")
    re.match("(a+)+$", "a" * 60 + "b")  # nothing but the system ends that
E2
outlived() { # outlived SIGNAL
    rm -f pids
    "$P" $blocks -c stay.py -o s.exr & host=$!
    until [ -s pids ] || ! kill -0 $host; do sleep 0.05; done
    kill -"$1" $host
    wait $host
    tries=0
    for pid in $(cat pids); do
        while [ -e "/proc/$pid" ] && ! grep -q '^State:.Z' "/proc/$pid/status" 2>/dev/null; do
            tries=$((tries + 1))
            [ $tries -lt 1200 ] || { kill -KILL "$pid"; echo "$pid is left"; return 1; }
            sleep 0.1
        done
    done
}
t "a host that is killed takes its python3 along, and what that has started" outlived KILL

# --- lull-check
t "lull-check says what it leaves out" sh -c "'$check' -o symbols -o entry -o load -o table -o unknown-key -o parameters -o bad-values -o firefly -o repeat \
    -o two-instances -o evaluate-allocates -o batch '$example' >out; grep -c SKIP out | grep -qx 2 && tail -n 1 out | grep -qx '# 12 checks, 0 failed'"
printf 'seen = []\nrequires = ["color"]\ndef check(block):\n    seen.append(block.spp)\n    return len(seen) > 9, len(seen)\n' >history.py
t "  ...finds a script that has a memory" sh -c "! '$check' -o repeat history.py >out && grep -q 'not ok 1 - repeat' out"
printf 'requires = ["color"]\ndef check(block):\n    print("hello")\n    return False\n' >prints.py
t "  ...and one that prints" sh -c "! '$check' -o flat prints.py >out && grep -q 'it printed:' out && grep -q hello out"
printf 'def check(block)\n' >wrong.py
t "  ...tells what is wrong with one" sh -c "! '$check' wrong.py >out && grep -q 'wrong.py:1: SyntaxError' out"
echo "1..$n"
exit $bad
