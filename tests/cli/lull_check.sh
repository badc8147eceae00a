#!/bin/sh
# lull-check: its options and exit statuses, and every criterion of the build against the whole contract.
. tests/cli/lull_check_setup
status() { # status N ARGS...: lull-check ends with this status
    want=$1
    shift
    "$check" "$@"
    got=$?
    [ "$got" = "$want" ] || { echo "exit status $got, expected $want"; return 1; }
}
says() { # says TEXT ARGS...
    text=$1
    shift
    "$check" "$@" 2>&1 | grep -F -e "$text"
}

t "the manual page names every option" sh -c 'for o in $("$1" --help | grep -o -e "--[a-z]*" | sort -u); do
    tr -d "\\\\" <docs/man/lull-check.1 | grep -qF -e "$o" || case $o in --usage | --version) ;; *) echo "$o"; exit 1 ;; esac; done' - "$check"
t "no criterion: 2" status 2
t "unknown option: 2" status 2 --no-such-option null
t "no such file: 2" status 2 ./no-such.so
t "unknown check: 2" status 2 -o no-such-check null
t "bad number: 2" status 2 -t 1 null
t "-p without '=': 2" status 2 -p threshold halfbuf
t "by name, from beside the program" status 0 -o table null
t "by name, from LULL_PLUGIN_PATH" env LULL_PLUGIN_PATH="$BUILD/tests/abi/plugins" "$check" -q -o entry faulty
t "by path and id" status 0 -o table "$BUILD/lib/lull/null.so:null"
t "-p reaches the criterion" says "first at 77 spp" -o requirements -p first-spp=77 halfbuf
t "-m and -s reach the calls outside the rules" sh -c '[ "$("$1" -o misuse -m 1000 -s 2 halfbuf)" = "$("$1" -o misuse -m 1000 -s 2 halfbuf)" ] &&
    [ "$("$1" -o misuse -m 1000 halfbuf)" != "$("$1" -o misuse -m 1000 -s 2 halfbuf)" ] && "$1" -o misuse -m 999 -s 2 halfbuf | grep -F "(999 calls, "' - "$check"
t "no misuse: 2" status 2 -m 0 null
for o in --help --usage --list; do # whole outputs: tests/cli/lull_check.txt
    run "lull-check $o" $o
done
run "-q" -q -o table null
run "two criteria, three checks" -o symbols -o table -o no-samples null fixed
run "a library of two" "$plugins/pair.so"
run "a wrong parameter" -p threshold=x halfbuf
run "an unknown parameter" -p no-such=1 halfbuf
run "no such criterion" no-such-criterion
run "no such id" "$BUILD/lib/lull/null.so:other"
run "no library" ./Makefile
run "a model that is wanted" -o table "$BUILD/lib/lull/baselines.so:svd-entropy"
run "a model that is wanted, beside another parameter" -o table -p visible=0.5 "$BUILD/lib/lull/baselines.so:svd-entropy"
for k in null fixed halfbuf variance; do
    run "all checks of $k" $k
done
t "a limit that is too short fails the check" status 1 -L 1 -o shapes -p fault=30 "$BUILD/tests/abi/plugins/faulty.so"

mkdir "$tmp/lib" && cp "$BUILD/lib/lull/baselines.so" "$tmp/lib" && echo broken >"$tmp/lib/svd-entropy.ggn"
t "a model that is there and is broken is no reason to skip" status 1 -o table "$tmp/lib/baselines.so:svd-entropy"

# ggn and the baselines need a model each: ggn the shipped one, the baselines one of a few small blocks.
for k in svd-entropy attributes noise-mask; do
    t "a small model for $k" "$BUILD/bin/ggn" baseline $k --data tests/data/train-demo --epochs 2 --ratio 1.3 --output "$tmp/$k.ggn"
done
# ggn judges a block in some 80 ms: all checks take two minutes (LULL_CHECK_ALL=1), these ten seconds; the sanitizer makes its
# convolutions 50 times slower, so there only the checks that end before a full window of images. The baselines' checks take
# half a minute each: those of what they add to the others, their own numbers and state.
few="symbols load entry table unknown-key parameters requirements older-host short-structs no-samples misuse"
of() { # of ID [CHECK...]: options for the criterion
    id=$1
    shift
    [ -z "${LULL_CHECK_ALL:-}" ] && echo "-m 50" && for k in "$@"; do echo "-o $k"; done
    case $id in svd-entropy | attributes | noise-mask) echo "-p model=$tmp/$id.ggn" ;; esac
}
# With the denoiser of tests/stub everything; with the real one, which takes a second for a block, what it could break.
denoised() { # denoised WHERE
    t "denoised.so keeps the contract$1" env LULL_OIDN="$checker_build/tests/oidn-stub" "$checker" -q -L "${LIMIT_S:-3600}" "$so"
    set -- "denoised.so keeps it with Open Image Denoise$1" null strides repeat evaluate-allocates out-of-memory
    if "$checker" -o table "$so" | grep -q "^ok.*table"; then
        name=$1
        shift
        # shellcheck disable=SC2046
        t "$name" "$checker" -q -L "${LIMIT_S:-3600}" $(printf -- '-o %s ' "$@") "$so"
    else
        n=$((n + 1))
        echo "ok $n - $1 # SKIP scripts/setup --denoiser has not put it into build/oidn"
    fi
}
all() { # all CHECKER LIBDIR WHERE CHECK...: each criterion of the build
    checker=$1 lib=$2 where=$3 checker_build=${2%/lib/lull}
    shift 3
    for so in "$lib"/*.so; do
        case ${so##*/} in
        denoised.so) denoised "$where" ;;
        observer.so)
            t "observer keeps the contract$where" "$checker" -q -L "${LIMIT_S:-3600}" "$so"
            t "observer keeps it without half buffers$where" "$checker" -q -L "${LIMIT_S:-3600}" -r "$so" ;;
        baselines.so)
            for k in svd-entropy attributes noise-mask; do
                # shellcheck disable=SC2046
                t "$k keeps the contract$where" "$checker" -q -L "${LIMIT_S:-3600}" $(of $k $few state repeat batch shapes evaluate-allocates) "$so:$k"
            done ;;
        ggn.so)
            if [ -z "${LULL_MODEL:-}" ] && ! ls ggn/models/lull-*.ggn >/dev/null 2>&1; then
                n=$((n + 1))
                echo "ok $n - ggn keeps the contract$where # SKIP no model in ggn/models"
            else
                # shellcheck disable=SC2046
                t "ggn keeps the contract$where" "$checker" -q -L "${LIMIT_S:-3600}" $(of ggn $few "$@") "$so"
            fi ;;
        *) [ "$checker" = "$check" ] || t "${so##*/} keeps the contract$where" "$checker" -q -L "${LIMIT_S:-3600}" "$so" ;; # plain: above
        esac
    done
}
t "every criterion of the baselines is checked here" sh -c '[ "$("$1" --list-criteria | grep -c "baselines.so")" = 3 ]' - "$BUILD/bin/lull-render"
all "$check" "$BUILD/lib/lull" "" newer-host order
# Once: not again for each instruction set (tests/processors/list).
[ "$BUILD" = build ] && [ -z "${LULL_ISA:-}" ] && [ -x build/asan/bin/lull-check ] && all build/asan/bin/lull-check build/asan/lib/lull " under ASan and UBSan"
approved tests/cli/lull_check.txt
