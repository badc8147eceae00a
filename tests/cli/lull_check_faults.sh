#!/bin/sh
# lull-check finds what is broken, and nothing else: each fault of tests/abi/plugins/faulty.c must fail the check that is there to find
# it, each number of tests/abi/plugins/puppet.c must be minded from its limit on and not before; and a witness in the criterion says
# what the host that lull-check plays gives it. The whole output of each run is compared with tests/cli/lull_check_faults.txt.
. tests/cli/lull_check_setup
fault() { run "$1 $2: $3" -o "$2" -p "fault=$1" "$plugins/faulty.so"; }
# What hangs is ended after a minute, in which even a busy machine comes to where it hangs: all of it meanwhile.
hangs=0
hang() { # hang NAME ARGS...: begun here, told by `hanged NAME`
    hangs=$((hangs + 1)) name=$1
    shift
    echo "$name" >"$tmp/hang$hangs.name"
    { "$check" -L 60 "$@"; echo "exit status $?"; } >"$tmp/hang$hangs" 2>&1 &
    echo $! >"$tmp/hang$hangs.pid"
}
hanged() {
    i=$(grep -lxF "$1" "$tmp"/hang*.name)
    wait "$(cat "${i%.name}.pid")"
    mv "${i%.name}" "$tmp/out"
    same "$1"
}
hang "30 flat: hangs" -o flat -p fault=30 "$plugins/faulty.so"
hang "47 misuse: hangs on a block from right to left" -o misuse -p fault=47 "$plugins/faulty.so"
for where in load entry create begin evaluate; do
    LULL_HANG=$where hang "hangs in $where" -o table -o flat "$plugins/hang.so"
done

run "all checks of the faulty criterion without a fault" "$plugins/faulty.so"

fault 1 leaks "create leaks memory"
fault 2 leaks "create leaks a file"
fault 3 newer-host "writes past a decision"
fault 4 fp "changes MXCSR"
fault 5 requirements "starts a thread"
fault 6 batch "depends on the order of the batch"
fault 7 repeat "asking twice leaves a trace"
fault 8 restart "RESTART does not forget"
fault 9 two-instances "instances share state"
mask='s/ action [^ ]* error [^ ]* / action X error X /g' # of memory that is none of the image
fault 10 strides "ignores strides"
fault 11 types "reads every type as f32"
mask=
fault 12 normalisers "one spp for all blocks"
fault 13 newer-host "keeps a pointer of begin_frame"
fault 14 no-samples "divides by 0 samples"
fault 15 flat "prints"
fault 16 bad-values "exits on NaN"
fault 17 shapes "crashes on a block of 1x1"
fault 18 unknown-key "accepts unknown keys"
fault 19 parameters "accepts values out of range"
fault 20 state "loads a state cut short"
fault 21 state "a refused load changes the instance"
fault 22 evaluate-allocates "evaluate allocates"
fault 24 repeat "next_spp does not lie ahead"
mask='/ answers action /d' # of memory that is none of the image: which pixels lie beside it is chance
fault 25 strides "reads beyond the image"
mask=
fault 26 missing-planes "does not miss a required plane"
fault 27 unknown-key "a failed create touches the instance"
fault 28 out-of-memory "does not look at malloc's result"
fault 29 no-samples "stops at 0 samples"
hanged "30 flat: hangs"
fault 31 order "begins a frame twice"
fault 32 invalid "accepts a block that is not in the frame"
fault 33 repeat "claims to be deterministic and is not"
fault 34 short-structs "reads past a short host struct"
fault 35 unknown-key "does not name an unknown key"
fault 36 state "ignores that saving failed"
fault 37 older-host "reads past the view"
fault 38 misuse "writes decisions into a stride that is too short"
fault 39 misuse "takes a scale of 0"
fault 40 misuse "looks at the first block only"
fault 41 misuse "refuses without a word"
fault 42 misuse "answers a status that there is not"
fault 43 misuse "fills the error of a call that succeeds"
fault 44 misuse "drops its history when it refuses a frame"
fault 45 misuse "makes memory for the frame's blocks and trusts the call's"
fault 46 misuse "crashes on a long key"
hanged "47 misuse: hangs on a block from right to left"
fault 48 misuse "saves without a frame"
fault 49 misuse "reads past a short writer"
fault 50 leaks "each frame leaks 8 bytes"
fault 51 leaks "every seventh create leaks 8 bytes"
fault 52 leaks "a list of all that was created, which doubles when it is full"
fault 53 leaks "no fault: a table that is full after 60 times and 32 KB once, late"
for where in load entry create begin evaluate; do
    hanged "hangs in $where"
done

# A mean over the block alone, without the guard against rare bright paths.
for k in halfbuf variance; do
    run "$k without its guard stops a block with a firefly" -o firefly -p tail-share=1 $k
done

run "exports two symbols, and create never works" "$plugins/two_symbols.so"
for broken in no_entry unresolved short_table twin_ids endless empty crash_on_load; do
    run "$broken" "$plugins/$broken.so"
done

# limit CHECK DIALS...: what the check says of a puppet with each of these settings, at its limit and beyond
limit() {
    k=$1
    shift
    for dials in "$@"; do
        echo "$dials"
        LULL_PUPPET=$dials "$check" -L 60 -o "$k" "$plugins/puppet.so" 2>&1 | grep -v '^# [^ ]\|^1\.\.'
    done >"$tmp/out"
    same "limits of $k: $*"
}
limit repeat p=0 p=1 p=nan p=-1e-9 p=1.0000001
limit repeat error=0 error=nan error=-1e-300 error=inf
limit repeat predicted=0 predicted=nan predicted=-1e-9 predicted=inf
limit repeat action=0 action=1,from=4 action=2 answer-flags=2 answer-flags=1,action=0 answer-flags=1 answer-flags=4
limit repeat next=1 next=0 next=0,action=1,from=4
limit no-samples action=1,from=2,first=2 action=1,from=2,first=3 action=1,from=1 action=1 action=1,first=1,from=1
limit requirements flags=1 flags=3 flags=3,minor=1 flags=0 flags=0,width=8 flags=0,height=8 flags=0,width=8,height=8
limit requirements used=511 used=511,minor=1 required=2,used=1 required=3,used=3 first=1 first=0 unset=1 unset=2 size=8
limit requirements width=16384 width=16385 height=16384 height=16385 halo=16384 halo=16385
limit table caps=7 caps=8 caps=8,minor=1 names=2 names=3 names=4 claims=1 level=2 level=3 level=-1
limit entry far=1 far=2 far=3 far=4294967295 far=2147483648 far=2147483647 new=1 entries=0
limit unknown-key key=-3 key=1 code=1 message=0 touch=1
limit parameters value=-2 value=0 code=-1 message=0 touch=1
limit null key=-1 touch=1 value=-1
limit batch caps=2,drift=0.00099 caps=2,drift=0.00102 caps=2,error=1e-9,drift=0.9 caps=2,error=1e-9,drift=2 caps=3,drift=1e-15
limit batch caps=2,drift-p=0.0004 caps=2,drift-p=0.0006 caps=2,next=1 caps=1
limit firefly required=17 required=9 required=9,stop=1e9 required=8,first=1000
limit block-size flags=0,width=8,height=9
limit bad-values answer-flags=2 required=2
quick=$("$check" --list | sed 's/ .*//' | grep -vx -e leaks -e time | sed 's/^/-o /')
for dials in level=0 level=1,caps=0 flags=0,width=24,height=16,caps=7,first=33 required=255,halo=2,width=40,height=30,stop=100; do
    # shellcheck disable=SC2086
    LULL_PUPPET=$dials "$check" -L 60 -m 500 $quick "$plugins/puppet.so" >"$tmp/out" 2>&1
    same "all checks of a puppet with $dials"
done

# What a criterion is given, check by check. Left out is what depends on the time.
for dials in caps=3 flags=0,width=9,height=7,caps=7,first=5,halo=2 used=17,required=17,stop=1000,bytes=7; do
    mkdir "$tmp/$dials"
    for k in $("$check" --list | sed 's/ .*//' | grep -vx -e leaks -e out-of-memory -e time); do
        : >"$tmp/$dials/$k"
        LULL_WITNESS=$tmp/$dials/$k LULL_PUPPET=$dials "$check" -q -L 60 -m 300 -o "$k" "$plugins/puppet.so" >/dev/null 2>&1
    done
    (cd "$tmp/$dials" && awk 'FNR == 1 { name[++files] = FILENAME } NF != 7 { print FILENAME ": " $0 }
        { for (i = 1; i <= 7; i++) sum[FILENAME, i] += $i }
        END { for (f = 1; f <= files; f++) {
            k = name[f]
            printf "%s: lives %d calls %d frames %d questions %d answers %d open %d sum %.0f\n", k, sum[k, 1], sum[k, 2], sum[k, 3],
                sum[k, 4], sum[k, 5], sum[k, 6], sum[k, 7] } }' ./*) >"$tmp/out"
    same "what is given to a puppet with $dials"
done
approved tests/cli/lull_check_faults.txt
