#!/bin/sh
# lull-check finds what is broken: each fault of tests/abi/plugins/faulty.c must fail the check that is there to find it.
BUILD=${BUILD:-build}
check=$BUILD/bin/lull-check plugins=$BUILD/tests/abi/plugins
tmp=$(mktemp -d) || exit 2
trap 'rm -rf "$tmp"' EXIT
n=0
expect() { # expect NAME CHECK TEXT ARGS...: exit 1, CHECK is "not ok" and TEXT is said
    n=$((n + 1)) name=$1 id=$2 text=$3
    shift 3
    "$check" -L "${limit:-60}" "$@" >"$tmp/log" 2>&1
    got=$?
    if [ "$got" = 1 ] && grep -q "^not ok [0-9]* - $id:" "$tmp/log" && grep -qF -e "$text" "$tmp/log"; then
        echo "ok $n - $name"
    else
        echo "not ok $n - $name (exit status $got)"
        tail -n 20 "$tmp/log" | sed 's/^/#   /'
    fi
}
fault() { expect "$4" "$2" "$3" -o "$2" -p "fault=$1" "$plugins/faulty.so"; }

fault 1 leaks "bytes behind" "create leaks memory"
fault 2 leaks "files open" "create leaks a file"
fault 3 newer-host "past the end of a decision" "writes past a decision"
fault 4 fp "floating-point control register" "changes MXCSR"
fault 5 requirements "started 1 thread" "starts a thread"
fault 6 batch "reverse order" "depends on the order of the batch"
fault 7 repeat "each question twice" "asking twice leaves a trace"
fault 8 restart "after RESTART" "RESTART does not forget"
fault 9 two-instances "of two instances" "instances share state"
fault 10 strides "bottom-up" "ignores strides"
fault 11 types "f16" "reads every type as f32"
fault 12 normalisers "f32 sums" "one spp for all blocks"
fault 13 newer-host "wider structs" "keeps a pointer of begin_frame"
fault 14 no-samples "error is inf" "divides by 0 samples"
fault 15 flat "hello" "prints"
fault 16 bad-values "ended the process" "exits on NaN"
fault 17 shapes "crashed" "crashes on a block of 1x1"
fault 18 unknown-key "no-such-parameter" "accepts unknown keys"
fault 19 parameters "threshold" "accepts values out of range"
fault 20 state "is accepted" "loads a state cut short"
fault 21 state "after a refused load" "a refused load changes the instance"
fault 22 evaluate-allocates "allocations" "evaluate allocates"
fault 24 repeat "is not later" "next_spp does not lie ahead"
fault 25 strides "crashed" "reads beyond the image"
fault 26 missing-planes "COLOR" "does not miss a required plane"
fault 27 unknown-key "touched the instance" "a failed create touches the instance"
fault 28 out-of-memory "crashed" "does not look at malloc's result"
fault 29 no-samples "without any sample" "stops at 0 samples"
limit=2
fault 30 flat "did not end within" "hangs"
limit=
fault 31 order "without RESTART" "begins a frame twice"
fault 32 invalid "not in the frame" "accepts a block that is not in the frame"
fault 33 repeat "session once more" "claims to be deterministic and is not"
fault 34 short-structs "crashed" "reads past a short host struct"
fault 35 unknown-key "does not name the key" "does not name an unknown key"
fault 36 state "writing failed" "ignores that saving failed"
fault 37 older-host "crashed" "reads past the view"
fault 38 misuse "a short stride of the decisions" "writes decisions into a stride that is too short"
fault 39 misuse "a plane of a scale that is none: status 0, expected -1 -5" "takes a scale of 0"
fault 40 misuse "a block that the frame has not: status 0, expected -1" "looks at the first block only"
fault 41 misuse "but the error says -1, \"\"" "refuses without a word"
fault 42 misuse "too few planes: status 5, expected -5" "answers a status that there is not"
fault 43 misuse "status 0, but the error says -11, \"all is well\"" "fills the error of a call that succeeds"
fault 44 misuse "after refused calls: block 0" "drops its history when it refuses a frame"
fault 45 misuse "evaluate: a block of another rectangle" "makes memory for the frame's blocks and trusts the call's"
fault 46 misuse "create: an unknown key" "crashes on a long key"
limit=2
fault 47 misuse "evaluate: a block from right to left" "hangs on a block from right to left"
limit=
fault 48 misuse "save: no frame is open: status 0, expected -6" "saves without a frame"
fault 49 misuse "save: no frame is open, a short writer" "reads past a short writer"

# A mean over the block alone, without the guard against rare bright paths.
for k in halfbuf variance; do
    expect "$k without its guard stops a block with a firefly" firefly "hang on one sample" -o firefly -p tail-share=1 $k
done

expect "exports two symbols" symbols "helper_that_should_be_static" -o symbols "$plugins/two_symbols.so"
expect "create never works" create "create failed" "$plugins/two_symbols.so"
for broken in no_entry unresolved short_table twin_ids endless empty crash_on_load; do
    expect "$broken" find "" "$plugins/$broken.so"
done
echo "1..$n"
